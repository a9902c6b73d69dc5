//! The bodies behind joints, and what is known of them along each trial.

use crate::dynamics::{each_sample, inverse_dynamics};
use crate::motion::Motion;
use ndof_devices::SerialChain;
use ndof_models::robot::Robot;
use std::sync::OnceLock;

/// Excursion over which torques are differenced (rad): far above round-off, and what bends over it is far below the torques' noise.
pub(crate) const EXCURSION: f64 = 1e-4;

/// Bodies as a gear carries them: the file's, or as they were found to be.
#[derive(Debug)]
pub(crate) struct Bodies {
    pub chain: SerialChain,
    /// What is known of them in each trial, once it is asked for.
    known: Vec<Known>,
}

#[derive(Debug)]
struct Known {
    torques: OnceLock<Vec<Vec<f64>>>,
    loads: Vec<OnceLock<Load>>,
}

impl PartialEq for Bodies {
    fn eq(&self, other: &Bodies) -> bool {
        self.chain == other.chain
    }
}

impl Bodies {
    pub fn new(chain: SerialChain, trials: usize) -> Self {
        let joints = chain.joints().count();
        let known = || Known { torques: OnceLock::new(), loads: (0..joints).map(|_| OnceLock::new()).collect() };
        Bodies { chain, known: (0..trials).map(|_| known()).collect() }
    }

    /// The same with so much more of their inertial parameters; `None` where there are no such bodies.
    pub fn with(&self, more: &[f64]) -> Option<Self> {
        let mut inertial = self.chain.inertial_parameters();
        inertial.iter_mut().zip(more).for_each(|(own, more)| *own += more);
        Some(Bodies::new(self.chain.clone().with_inertial_parameters(&inertial)?, self.known.len()))
    }

    /// Torques that they need without a deflection, `[joint][sample]`.
    pub fn torques(&self, motion: &Motion) -> &[Vec<f64>] {
        kept(&self.known[motion.trial].torques, || inverse_dynamics(&self.chain, motion)).as_slice()
    }

    /// What hangs on a joint with this rotor.
    pub fn load(&self, motion: &Motion, joint: usize, rotor: f64) -> &Load {
        kept(&self.known[motion.trial].loads[joint], || Load::of(motion, self, joint, rotor))
    }
}

/// What is kept, made if it is not there, and never inside of the lock: who makes it by several threads takes other work while it waits for them, which may ask
/// for the same.
fn kept<T>(lock: &OnceLock<T>, make: impl FnOnce() -> T) -> &T {
    lock.get().unwrap_or_else(|| {
        let made = make();
        lock.get_or_init(|| made)
    })
}

/// What hangs on a joint, sample by sample.
#[derive(Debug)]
pub(crate) struct Load {
    /// Inertia about the joint, without its rotor; it does not depend on the joint's own angle.
    pub inertia: Vec<f64>,
    /// How much less torque it needs for each unit of a deflection.
    pub slope: Vec<f64>,
}

impl Load {
    fn of(motion: &Motion, bodies: &Bodies, joint: usize, rotor: f64) -> Self {
        let n = motion.q.len();
        let weightless = bodies.chain.clone().with_gravity([0.0; 3]);
        let (still, mut unit) = (vec![0.0; n], vec![0.0; n]);
        unit[joint] = 1.0;
        let inertia = each_sample(motion, n, |q, _, _, out| weightless.inverse_dynamics(q, &still, &unit, out)).swap_remove(joint);
        let nothing = vec![0.0; inertia.len()];
        let bent = moved(motion, joint, EXCURSION, [&vec![1.0; inertia.len()], &nothing, &nothing]);
        let further = inverse_dynamics(&bodies.chain, &bent).swap_remove(joint);
        let slope = further.iter().zip(&bodies.torques(motion)[joint]).map(|(f, r)| (f - r) / EXCURSION).collect();
        Load { inertia: inertia.into_iter().map(|m| m - rotor).collect(), slope }
    }
}

/// A motion in which a joint is so many times a deflection further.
pub(crate) fn moved(motion: &Motion, joint: usize, times: f64, bent: [&[f64]; 3]) -> Motion {
    let mut moved = motion.clone();
    for (series, bent) in [&mut moved.q, &mut moved.v, &mut moved.a].into_iter().zip(bent) {
        series[joint].iter_mut().zip(bent).for_each(|(x, d)| *x += times * d);
    }
    moved
}

/// The change of gravity `g` when the base is turned by a rotation vector, the axis times the angle (Rodrigues).
pub(crate) fn turned(g: [f64; 3], tilt: &[f64; 3]) -> [f64; 3] {
    let angle = tilt.iter().map(|t| t * t).sum::<f64>().sqrt();
    if angle == 0.0 {
        return [0.0; 3];
    }
    // Seen from the base, gravity turns the other way.
    let axis = tilt.map(|t| -t / angle);
    let (once, twice) = (cross(axis, g), cross(axis, cross(axis, g)));
    std::array::from_fn(|k| angle.sin() * once[k] + (1.0 - angle.cos()) * twice[k])
}

/// How that changes with a turn about each axis (G. Gallego and A. Yezzi, A compact formula for the derivative of a 3-D rotation in exponential
/// coordinates, J. Math. Imaging Vis. 51 (2015) 378).
pub(crate) fn turning(g: [f64; 3], tilt: &[f64; 3]) -> [[f64; 3]; 3] {
    let (angle, more) = (size(*tilt), turned(g, tilt));
    let there = std::array::from_fn(|k| g[k] + more[k]);
    // Of the turn that is there, and what a turn about another axis is beside it.
    let [once, twice] = if angle == 0.0 { [0.0; 2] } else { [(1.0 - angle.cos()) / angle.powi(2), (angle - angle.sin()) / angle.powi(3)] };
    std::array::from_fn(|axis| {
        let own = unit(axis);
        let across = cross(*tilt, own);
        let again = cross(*tilt, across);
        cross(there, std::array::from_fn(|k| own[k] - once * across[k] + twice * again[k]))
    })
}

/// The same as lines that lead from no tilt to this one (C. G. Broyden, A class of methods for solving nonlinear simultaneous equations, Math. Comput. 19 (1965) 577).
pub(crate) fn leading(g: [f64; 3], tilt: &[f64; 3]) -> [[f64; 3]; 3] {
    let (mut lines, whole) = (turning(g, tilt), turned(g, tilt));
    let square: f64 = tilt.iter().map(|t| t * t).sum();
    if square > 0.0 {
        let short: [f64; 3] = std::array::from_fn(|k| whole[k] - (0..3).map(|axis| lines[axis][k] * tilt[axis]).sum::<f64>());
        lines.iter_mut().zip(tilt).for_each(|(line, t)| line.iter_mut().zip(short).for_each(|(x, short)| *x += short * t / square));
    }
    lines
}

/// The tilt that turns gravity to another direction by the shortest way; to nearly the other way up about an axis of the base, as any axis across leads there.
pub(crate) fn tilt_to(g: [f64; 3], other: [f64; 3], nearly: f64) -> [f64; 3] {
    let along: f64 = g.iter().zip(other).map(|(a, b)| a * b).sum();
    let mut axis = cross(other, g);
    let angle = if along < 0.0 && size(axis) < nearly * size(g) * size(other) {
        axis = cross(most_across(g), g);
        std::f64::consts::PI
    } else {
        size(axis).atan2(along)
    };
    if angle == 0.0 { [0.0; 3] } else { axis.map(|x| x / size(axis) * angle) }
}

/// The axis of the base that is most across a direction.
pub(crate) fn most_across(g: [f64; 3]) -> [f64; 3] {
    (0..3).min_by(|a, b| g[*a].abs().total_cmp(&g[*b].abs())).map_or([0.0; 3], unit)
}

/// One at a place, and nothing elsewhere.
pub(crate) fn unit<const N: usize>(k: usize) -> [f64; N] {
    std::array::from_fn(|i| f64::from(u8::from(i == k)))
}

pub(crate) fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

pub(crate) fn size(x: [f64; 3]) -> f64 {
    x.iter().map(|x| x * x).sum::<f64>().sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shared_tests::of_a_pendulum;
    use rayon::prelude::*;

    const G: [f64; 3] = [0.0, 0.0, -9.81];

    /// Whoever makes what is kept takes other work while it waits for other threads, and that may ask for the same.
    #[test]
    fn many_may_ask_for_what_several_threads_make() {
        let at = |f: fn(f64) -> f64| (0..4000).map(|k| f(0.013 * f64::from(k))).collect();
        of_a_pendulum(at(f64::sin), at(f64::cos), |scene, view| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(4).build().expect("threads");
            let ask = |tasks: usize| {
                let bodies = Bodies::new(scene.chain.clone(), 1);
                (0..tasks)
                    .into_par_iter()
                    .for_each(|_| assert!(bodies.load(&view.motions[0], 0, 0.0).inertia.len() == bodies.torques(&view.motions[0])[0].len()));
            };
            // Few tasks leave threads that take parts of one.
            (0..200).for_each(|k| pool.install(|| ask(2 + k % 7)));
        });
    }

    #[test]
    fn a_tilt_turns_gravity_where_it_is_to() {
        for other in [[1.0, 2.0, -9.0], [9.0, 0.0, 0.0], [-3.0, 2.0, 8.0], [0.0, 0.0, 9.81], [0.0, 0.0, -9.81]] {
            let tilt = tilt_to(G, other, 1e-9);
            let (more, lines, slopes) = (turned(G, &tilt), leading(G, &tilt), turning(G, &tilt));
            for k in 0..3 {
                assert!((G[k] + more[k] - 9.81 * other[k] / size(other)).abs() < 1e-7, "{other:?} {tilt:?}");
                assert!((more[k] - (0..3).map(|axis| lines[axis][k] * tilt[axis]).sum::<f64>()).abs() < 1e-7, "{other:?}");
                for (axis, slope) in slopes.iter().enumerate() {
                    // What bends over the excursion is of its square.
                    let at = |by: f64| turned(G, &std::array::from_fn(|i| tilt[i] + if i == axis { by } else { 0.0 }))[k];
                    let change = (at(EXCURSION) - at(-EXCURSION)) / (2.0 * EXCURSION);
                    assert!((slope[k] - change).abs() < 9.81 * EXCURSION.powi(2), "{other:?} {axis} {k}");
                }
            }
        }
    }
}
