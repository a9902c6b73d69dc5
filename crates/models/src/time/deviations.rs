//! Small deviations from a run: the linear steps that carry them from sample to sample.

use super::law::LOCAL_VARIABLES;
use super::simulate::Runner;
use super::{Local, Mechanism};
use faer::Mat;
use faer::prelude::Solve;

/// Places within a sample at which the laws are linearised, at least; dry friction turns around within one.
const PLACES: usize = 4;

/// δ⁺ = Φ_k δ + Γ_k w with δ = (δx, δẋ, δz) of all axes and laws, and w a force on each axis, held over the sample at its mean.
///
/// The tangent of each law is the mean over the sample, and the step that of Cayley. What a delayed law makes of a deviation one
/// delay ago is left out: where that law is linear, the same answer follows every deviation.
pub(super) struct Deviations {
    /// Length of δ.
    pub size: usize,
    /// Φ of each sample but the last, size × size.
    pub phi: Vec<f64>,
    /// Γ of the same, size × axes.
    pub gamma: Vec<f64>,
}

/// A law's place in δ, its hidden states along the run, and the tangent that is being summed.
struct Walker<'a> {
    placed: &'a super::PlacedLaw,
    theta: &'a [f64],
    first: usize,
    states: Vec<f64>,
}

impl Deviations {
    /// Those of the run whose positions are given, one series an axis.
    pub(super) fn along(mechanism: &Mechanism, theta: &[f64], positions: &[Vec<f64>], step_s: f64) -> Self {
        let n = mechanism.axes.len();
        let runner = Runner::new(mechanism, theta);
        let velocities: Vec<Vec<f64>> = positions.iter().map(|x| super::trial::slope(x, 1.0 / step_s)).collect();
        let (mut at, mut size) = (mechanism.baseline_parameters(), 2 * n);
        let mut walkers: Vec<Walker<'_>> = Vec::new();
        for placed in &mechanism.laws {
            let count = placed.law.parameters(false).len();
            walkers.push(Walker { placed, theta: &theta[at..at + count], first: size, states: vec![0.0; placed.law.states()] });
            at += count;
            size += placed.law.states();
        }
        let samples = positions.first().map_or(0, Vec::len);
        let (mut phi, mut gamma) = (Vec::with_capacity(samples * size * size), Vec::with_capacity(samples * size * n));
        for k in 0..samples.saturating_sub(1) {
            let mut rate = vec![0.0; size * size];
            for i in 0..n {
                rate[i * size + n + i] = 1.0;
                for j in 0..n {
                    let turned = |m: &[f64]| -> f64 { (0..n).map(|l| runner.inverse[i * n + l] * m[l * n + j]).sum() };
                    rate[(n + i) * size + j] = -turned(&runner.stiffness);
                    rate[(n + i) * size + n + j] = -turned(&runner.damping);
                }
            }
            let mut jumps = Vec::new();
            for walker in &mut walkers {
                let axis = walker.placed.axis;
                jumps.push(walker.step(&positions[axis], &velocities[axis], k, step_s, (&runner.inverse, n), (&mut rate, size)));
            }
            // (I − hA/2)⁻¹ [I + hA/2, h M⁻¹ in the rows of velocity]
            let width = size + n;
            let half = |r: usize, c: usize| 0.5 * step_s * rate[r * size + c];
            let unit = |r: usize, c: usize| f64::from(u8::from(r == c));
            let left = Mat::from_fn(size, size, |r, c| unit(r, c) - half(r, c));
            let solved = left.partial_piv_lu().solve(Mat::from_fn(size, width, |r, c| match c.checked_sub(size) {
                None => unit(r, c) + half(r, c),
                Some(j) if (n..2 * n).contains(&r) => step_s * runner.inverse[(r - n) * n + j],
                Some(_) => 0.0,
            }));
            let mut right: Vec<f64> = (0..size * width).map(|e| solved[(e / width, e % width)]).collect();
            for (walker, jump) in walkers.iter().zip(jumps).filter(|(w, _)| w.placed.law.settles()) {
                // z⁺ = S_x x⁺ + S_z z, row by row.
                let (nz, axis) = (walker.states.len(), walker.placed.axis);
                let before: Vec<f64> = right[walker.first * width..(walker.first + nz) * width].to_vec();
                for l in 0..nz {
                    for c in 0..width {
                        let own: f64 = (0..nz).map(|m| jump[l * (1 + nz) + 1 + m] * before[m * width + c]).sum();
                        right[(walker.first + l) * width + c] = own + jump[l * (1 + nz)] * right[axis * width + c];
                    }
                }
            }
            for row in right.chunks_exact(width) {
                phi.extend_from_slice(&row[..size]);
                gamma.extend_from_slice(&row[size..]);
            }
        }
        Deviations { size, phi, gamma }
    }
}

impl Walker<'_> {
    /// Moves the hidden states over one sample, adds the law's mean tangent to the rates, and returns how states jump with the
    /// position and with themselves (rows of 1 + states).
    fn step(&mut self, x: &[f64], v: &[f64], k: usize, step_s: f64, (inverse, n): (&[f64], usize), (rate, size): (&mut [f64], usize)) -> Vec<f64> {
        let (law, theta, axis) = (self.placed.law.as_ref(), self.theta, self.placed.axis);
        let (nz, columns) = (self.states.len(), LOCAL_VARIABLES + self.states.len() + theta.len());
        let delay = law.delay().map_or(0.0, |d| theta[d] / step_s);
        let read = |c: &[f64], when: f64| {
            let at = when.clamp(0.0, (c.len() - 1) as f64);
            let low = (at as usize).min(c.len() - 2);
            c[low] + (c[low + 1] - c[low]) * (at - low as f64)
        };
        let local = |when: f64| Local {
            time_s: when * step_s,
            position: read(x, when),
            velocity: read(v, when),
            delayed_position: read(x, when - delay),
            delayed_velocity: read(v, when - delay),
            force: 0.0,
            delayed_force: 0.0,
        };
        let (mut rates, mut slopes) = (vec![0.0; nz], vec![0.0; (1 + nz) * columns]);
        let mut jump: Vec<f64> = (0..nz * (1 + nz)).map(|e| f64::from(u8::from(e % (1 + nz) == 1 + e / (1 + nz)))).collect();
        let mut turn = vec![0.0; nz * (1 + nz + theta.len())];
        let small = step_s / PLACES as f64;
        for place in 0..PLACES {
            let middle = k as f64 + (place as f64 + 0.5) / PLACES as f64;
            let now = local(middle);
            law.linearise(theta, &now, &self.states, &mut rates, &mut slopes);
            let share = 1.0 / PLACES as f64;
            for r in 0..=nz {
                let own = &slopes[r * columns..(r + 1) * columns];
                let mut add = |column: usize, value: f64| {
                    if r > 0 {
                        rate[(self.first + r - 1) * size + column] += share * value;
                    } else {
                        (0..n).for_each(|i| rate[(n + i) * size + column] -= share * inverse[i * n + axis] * value);
                    }
                };
                add(axis, own[0]);
                add(n + axis, own[1]);
                (0..nz).for_each(|l| add(self.first + l, own[LOCAL_VARIABLES + l]));
            }
            // A half step with the rates here, then the rates there for the whole of it; stiff states by their own slope.
            for l in 0..nz {
                let own = slopes[(1 + l) * columns + LOCAL_VARIABLES + l];
                self.states[l] += small * rates[l] / (1.0 - 0.5 * small * own).max(0.5);
            }
            if law.settles() {
                let end = read(x, k as f64 + (place as f64 + 1.0) / PLACES as f64);
                law.settle(theta, end, &mut self.states, Some(&mut turn));
                let wide = 1 + nz + theta.len();
                let before = jump.clone();
                for l in 0..nz {
                    for c in 0..=nz {
                        let carried: f64 = (0..nz).map(|m| turn[l * wide + 1 + m] * before[m * (1 + nz) + c]).sum();
                        jump[l * (1 + nz) + c] = carried + if c == 0 { turn[l * wide] } else { 0.0 };
                    }
                }
            }
        }
        jump
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Axis;
    use crate::time::{laws, simulate};
    use std::ops::Range;

    #[test]
    fn a_gap_that_is_driven_through_carries_deviations_only_while_it_is_closed() {
        let mechanism = Mechanism::new(vec![Axis::linear("x")]).with(laws::Backlash, 0);
        let positions: Vec<f64> = (0..100).map(|k| 0.01 * (k as f64 / 20.0).sin()).collect();
        let deviations = Deviations::along(&mechanism, &[2.0, 14.0, 300.0, 300.0, 2e-3], &[positions], 0.005);
        // The follower's row of each step: with the position while it is pushed, else with itself.
        let row = |k: usize| &deviations.phi[k * 9 + 6..k * 9 + 9];
        assert!(row(20)[2] == 0.0 && row(20)[0] > 0.9, "{:?}", row(20));
        // The motion turns at sample 31 and is 4 mm back at 50.
        assert!(row(40) == [0.0, 0.0, 1.0], "{:?}", row(40));
        assert!(row(55)[2] == 0.0 && row(55)[0] > 0.9, "{:?}", row(55));
    }

    /// Largest relative error of the answers of two axes to each first position and velocity (`ways` 0 to 3) and to a push on each axis halfway (4 and 5).
    fn largest_error(mechanism: &Mechanism, theta: &[f64], rate_hz: f64, ways: Range<usize>) -> f64 {
        let (samples, n) = (rate_hz as usize, 2);
        let force: Vec<Vec<f64>> = (0..n).map(|a| (0..samples).map(|k| 5.0 * ((9.0 + 4.0 * a as f64) * k as f64 / rate_hz).sin()).collect()).collect();
        let first = [0.01, -0.008, 0.02, 0.05];
        let run = |way: usize, by: f64| {
            let (mut initial, mut force) = (first, force.clone());
            if way < 2 * n {
                initial[way] += by;
            } else {
                force[way - 2 * n][samples / 2] += by;
            }
            simulate(mechanism, theta, &initial, &force.iter().map(Vec::as_slice).collect::<Vec<_>>(), rate_hz, 8)
        };
        let deviations = Deviations::along(mechanism, theta, &run(0, 0.0), 1.0 / rate_hz);
        let size = deviations.size;
        let mut worst = 0.0f64;
        for way in ways {
            let small = 1e-6;
            let (up, down) = (run(way, small), run(way, -small));
            let difference = |axis: usize, k: usize| (up[axis][k] - down[axis][k]) / (2.0 * small);
            let largest = (0..samples).flat_map(|k| [difference(0, k).abs(), difference(1, k).abs()]).fold(0.0, f64::max);
            let mut state = vec![0.0; size];
            if way < 2 * n {
                state[way] = 1.0;
            }
            for k in 0..samples - 1 {
                worst = (0..n).fold(worst, |w, axis| w.max((state[axis] - difference(axis, k)).abs() / largest));
                // A force that is linear between samples: half of the push in the mean before it and after.
                let push = if way >= 2 * n && (k == samples / 2 || k + 1 == samples / 2) { 0.5 } else { 0.0 };
                let row = |r: usize| {
                    let own: f64 = (0..size).map(|c| deviations.phi[(k * size + r) * size + c] * state[c]).sum();
                    own + if way < 2 * n { 0.0 } else { push * deviations.gamma[(k * size + r) * n + way - 2 * n] }
                };
                state = (0..size).map(row).collect();
            }
        }
        worst
    }

    #[test]
    fn steps_of_deviations_of_two_axes_are_those_of_the_run_for_every_kind_of_law() {
        let limb = || Mechanism::new(vec![Axis::linear("x"), Axis::linear("y")]);
        let base = [2.0, -0.4, 1.6, 14.0, -3.0, 17.0, 300.0, -50.0, 380.0];
        for (name, mechanism, own, bound) in [
            ("smooth", limb().with(laws::Relaxation, 1).with(laws::CubicStiffness, 0), vec![150.0, 0.08, 4e5], 0.007),
            ("by time", limb().with(laws::StiffnessDrift, 1), vec![300.0], 0.007),
            ("loop", limb().with(laws::BoucWen, 1), vec![400.0, 4e-3, 0.4], 0.007),
            ("mode", limb().with(laws::FlexibleMode, 1), vec![0.4, 40.0, 0.2], 0.018),
            ("slip", limb().with(laws::CubicStiffness, 1).with(laws::MaxwellSlip, 1), vec![2e5, 300.0, 4e-3], 0.033),
            ("range", limb().with(laws::ShortRangeStiffness, 1), vec![300.0, 3e-3], 0.033),
        ] {
            let theta: Vec<f64> = base.iter().chain(&own).copied().collect();
            assert_eq!(theta.len(), mechanism.parameters().len(), "{name}");
            let error = |rate_hz: f64, ways: Range<usize>| largest_error(&mechanism, &theta, rate_hz, ways);
            let all = error(400.0, 0..6);
            // A push that is held over a sample is ω h/12 off, a slip within a sample up to a sample late.
            assert!(all < bound, "{name}: {all}");
            // Half the step, a quarter of the error of what begins at the first sample; a fifth of that for the next order.
            assert!(name != "smooth" || error(400.0, 0..4) < 0.3 * error(200.0, 0..4));
        }
    }
}
