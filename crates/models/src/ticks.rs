//! A command that a loop holds from tick to tick, in channels that are read at those ticks.

use crate::{Hold, InertiaDampingStiffness, Sampling};
use ndarray::Array2;
use num_complex::Complex64;

/// A limb on a robot whose command stays from tick to tick, read at the ticks: motion x and the force F between the two.
///
/// With D the limb's dynamic stiffness, D_r that of what is before the force and u what is held,
///
/// x = (D + D_r)⁻¹ u,  F = u − D_r x
///
/// in continuous time. At the ticks these are R u and T u, sums over all that folds onto a frequency as in [`Held`](crate::Held). F jumps at each tick by
/// Γ = M (M + M_r)⁻¹ of u's step: it is read just after it ([`Hold::ReadAfter`]) or just before ([`Hold::ReadBefore`]). Where the command alone is held, D_r is all that
/// answers the motion. Where all that the motors do is held, it is the robot's inertia, whatever the controller.
///
/// # References
/// K. J. Åström & B. Wittenmark (1997), Computer-Controlled Systems, ch. 2.
#[derive(Clone, Debug, PartialEq)]
pub struct Ticks {
    /// What is behind the force.
    pub limb: InertiaDampingStiffness,
    /// What is before it, held or not.
    pub before: InertiaDampingStiffness,
}

impl Ticks {
    /// R and T at s: displacement and force as they are read by a sampling, for each unit of what is held. `None` where they do not exist.
    pub fn read(&self, sampling: Sampling, s: Complex64) -> Option<[Array2<Complex64>; 2]> {
        let mass = &self.before.inertia;
        let all = ndof_linear::inverse(&(mass + &self.limb.inertia))?;
        // What of the force before it jumps, M_r (M + M_r)⁻¹; the rest of it does not, and falls as 1/s.
        let jump = mass.dot(&all).mapv(Complex64::from);
        let held = |derivatives| Sampling { hold: Hold::Zero, derivatives, ..sampling };
        let n = jump.nrows();
        let (mut motion, mut smooth) = (Array2::zeros((n, n)), Array2::zeros((n, n)));
        let folds = held(sampling.derivatives).folds(s, 2).into_iter().zip(held(0).folds(s, 1));
        for ((folded, of_motion), (_, of_force)) in folds {
            let before = self.before.dynamic_stiffness(folded);
            let moved = ndof_linear::inverse(&(&before + &self.limb.dynamic_stiffness(folded)))?;
            smooth.scaled_add(of_force, &(before.dot(&moved) - &jump));
            motion.scaled_add(of_motion, &moved);
        }
        let late = if sampling.hold == Hold::ReadBefore { (-s / sampling.sample_rate_hz).exp() } else { Complex64::ONE };
        let force = (Array2::eye(n) - jump) * late - smooth;
        Some([motion, force])
    }

    /// G at s: what acts for each unit of force that is read, D R T⁻¹, so that motion is D⁻¹ G F without samples.
    pub fn acting(&self, sampling: Sampling, s: Complex64) -> Option<Array2<Complex64>> {
        let [motion, force] = self.read(sampling, s)?;
        Some(self.limb.dynamic_stiffness(s).dot(&motion).dot(&ndof_linear::inverse(&force)?))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Axis;
    use crate::hold::tests::state;
    use ndarray::arr2;
    use std::f64::consts::TAU;

    /// Against the exact step of the state: F = M a + B v + K x with the acceleration just after a command or just before the next.
    #[test]
    fn force_and_motion_at_ticks_are_those_of_the_exact_step() {
        let of = |[m, b, k]: [f64; 3]| InertiaDampingStiffness {
            axes: vec![Axis::linear("x")],
            inertia: arr2(&[[m]]),
            damping: arr2(&[[b]]),
            stiffness: arr2(&[[k]]),
        };
        let ([m, b, k], [all_m, all_b, all_k]) = ([2.0, 12.0, 300.0], [3.0, 29.0, 500.0]);
        for rate in [12.0, 50.0, 250.0, 1000.0] {
            for share in [0.02, 0.1, 0.25, 0.45] {
                let (hz, step_s) = (share * rate, 1.0 / rate);
                let s = Complex64::new(0.0, TAU * hz);
                let [x, v] = state(all_m, all_b, all_k, step_s, hz);
                for (hold, command) in [(Hold::ReadAfter, Complex64::ONE), (Hold::ReadBefore, (-s * step_s).exp())] {
                    let force = m * (command - all_b * v - all_k * x) / all_m + b * v + k * x;
                    for (derivatives, motion) in [(0, x), (1, v / s)] {
                        let sampling = Sampling { hold, sample_rate_hz: rate, derivatives };
                        let ticks = Ticks { limb: of([m, b, k]), before: of([all_m - m, all_b - b, all_k - k]) };
                        let [r, t] = ticks.read(sampling, s).expect("responses");
                        // Of a sum of 1/(k + a)², π²/sin²(πa), the integral beyond two foldings leaves (f + 1/2)⁻³/12 to each side, f = 2 ± a: at most 1.4e-3. A
                        // tenth of the sum lies there, without its terms of B T/(2π k M).
                        let within = 1.4e-3 + 0.1 * all_b / all_m * step_s / (3.0 * TAU);
                        let error = (r[[0, 0]] / motion - 1.0).norm().max((t[[0, 0]] / force - 1.0).norm());
                        assert!(error < within, "{hold:?} {rate} {share} {derivatives}: {error}");
                        let acting = ticks.acting(sampling, s).expect("a response")[[0, 0]] * force;
                        assert!((acting / ((s * s * m + s * b + k) * motion) - 1.0).norm() < 3.0 * within);
                    }
                }
            }
        }
    }
}
