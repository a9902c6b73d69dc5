//! Torques that a joint needs for each unit of what a simulation may lack, along the measured motion.

use crate::bodies::{EXCURSION, leading, unit};
use crate::deflection::{Gear, Lets, given};
use crate::dynamics::{each_sample, inverse_dynamics, sign};
use crate::motion::Motion;
use crate::scene::Scene;
use ndof_devices::TERMS_OF_A_LINK;
use ndof_models::robot::Robot;
use ndof_signal::derivatives;

/// One such torque, for one or several joints.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Column {
    /// 1.
    Constant(usize),
    /// q̇.
    Velocity(usize),
    /// v₀ asinh(q̇/v₀).
    Thinning { joint: usize, speed: f64 },
    /// q̈.
    Acceleration(usize),
    /// The sign of q̇, over the noise of q̇.
    Sign(usize),
    /// The sign over a speed of its own, tanh(q̇/v).
    Turn { joint: usize, speed: f64 },
    /// (q̇ + t q̈)/v between −1 and 1: dry friction as a soft constraint.
    Soft { joint: usize, ahead_s: f64, speed: f64 },
    /// What another level adds to such a friction, for each unit of it: over v at its own level F, over v' at F v'/v, as x = q̇ + t q̈ within ± v' less x
    /// within ± v, over v' − v.
    Firmer { joint: usize, ahead_s: f64, own: f64, speed: f64 },
    /// Another way in which the sign turns, less the sign.
    Otherwise(Box<Column>),
    /// The sign times exp(−(q̇/v)²).
    Stribeck { joint: usize, velocity: f64 },
    /// The sign of q̇ times the size of the torque that the file's bodies need.
    Load(usize),
    /// The torque itself, as the file has it.
    Torque(usize),
    /// The torques of all joints.
    Torques,
    /// The rate at which the logged torque falls.
    Falling(usize),
    /// Force of springs that slip one by one: the play operator's stop over this way, −1 … 1.
    Slip { joint: usize, way: f64 },
    /// Depth in a stop that begins there, towards larger angles or smaller, with that of a time ahead where it is damped: it pushes and never pulls.
    Stop { joint: usize, from: f64, above: bool, ahead_s: f64 },
    /// A power of the angle, from its middle, over half its range.
    Power { joint: usize, power: i32 },
    /// What bodies feel behind a gear that gives or has play, for each unit of its extent.
    Gear(Gear),
    /// A combination of the inertial parameters of a body ([`TERMS_OF_A_LINK`] numbers).
    Body { link: usize, parts: [f64; TERMS_OF_A_LINK] },
    /// What bodies and springs need more for each unit by which the zero of an angle is off, along the line to where it is off so much.
    Zero { joint: usize, at: f64 },
    /// The same of all angles, at such zeros.
    Zeros(Vec<f64>),
    /// The base turned about one of its axes, on the way from none to this tilt.
    Tilt { axis: usize, at: [f64; 3] },
    /// A gravity of its own.
    Weight([f64; 3]),
    /// Legendre polynomials of angle and rate, each over its range: what no cause was consulted for.
    Smooth { joint: usize, angle: usize, speed: usize },
}

impl Column {
    /// The factor that it is made with, where it has no other.
    pub fn factor(&self) -> Option<f64> {
        if let Column::Gear(gear) = self { Some(gear.extent).filter(|c| *c > 0.0) } else { None }
    }

    /// Numbers beside the factor that are fitted with it: a gear's damping, and how its link begins.
    pub fn beside(&self) -> usize {
        if let Column::Gear(gear @ Gear { lets: Lets::Give, .. }) = self { 1 + 2 * gear.starts.len() } else { 0 }
    }

    /// Whether all that it is made with is a number: what is none is not equal to itself.
    pub fn has_numbers(&self) -> bool {
        self.clone() == *self
    }

    /// What one unit of one of a link's inertial parameters needs.
    pub fn term(link: usize, term: usize) -> Column {
        Column::Body { link, parts: unit(term) }
    }

    /// The weight of bodies in a gravity of one along an axis.
    pub fn upright(axis: usize) -> Column {
        Column::Weight(unit(axis))
    }

    /// The gravity whose weight it is, beside the file's.
    pub fn gravity(&self, file: [f64; 3]) -> Option<[f64; 3]> {
        match self {
            Column::Tilt { axis, at } => Some(leading(file, at)[*axis]),
            Column::Weight(gravity) => Some(*gravity),
            _ => None,
        }
    }

    /// The joints that feel it, and what they feel, sample by sample.
    pub fn along(&self, motion: &Motion, scene: &Scene<'_>) -> Vec<(usize, Vec<f64>)> {
        let own = |joint: usize, f: &dyn Fn(f64, f64) -> f64| {
            let felt = motion.q[joint].iter().zip(&motion.v[joint]).map(|(q, v)| f(*q, *v)).collect();
            vec![(joint, felt)]
        };
        // Beyond where the motion rises above the encoder's noise the acceleration would be all noise.
        let ahead = |joint: usize, by_s: f64| {
            let [v, a, _] = derivatives(&motion.sharp[joint], scene.rate_hz, scene.fastest_hz);
            v.into_iter().zip(a).map(move |(v, a)| v + by_s * a)
        };
        match self {
            Column::Constant(j) => own(*j, &|_, _| 1.0),
            Column::Velocity(j) => own(*j, &|_, v| v),
            Column::Thinning { joint, speed } => own(*joint, &|_, v| speed * (v / speed).asinh()),
            Column::Acceleration(j) => vec![(*j, motion.a[*j].clone())],
            Column::Sign(j) => vec![(*j, motion.sharp[*j].iter().map(|v| sign(*v, scene.joints[*j].speed_noise)).collect())],
            Column::Turn { joint, speed } => vec![(*joint, motion.sharp[*joint].iter().map(|v| sign(*v, *speed)).collect())],
            Column::Soft { joint, ahead_s, speed } => vec![(*joint, ahead(*joint, *ahead_s).map(|x| (x / speed).clamp(-1.0, 1.0)).collect())],
            Column::Firmer { joint, ahead_s, own, speed } => {
                // At its own level the tangent.
                let speed = if speed == own { own * (1.0 + f64::EPSILON.sqrt()) } else { *speed };
                let more = |x: f64| (x.clamp(-speed, speed) - x.clamp(-own, *own)) / (speed - own);
                vec![(*joint, ahead(*joint, *ahead_s).map(more).collect())]
            }
            Column::Otherwise(turn) => {
                let mut turns = turn.along(motion, scene);
                for (joint, turn) in &mut turns {
                    let at_once = Column::Sign(*joint).along(motion, scene).swap_remove(0).1;
                    turn.iter_mut().zip(at_once).for_each(|(turn, sign)| *turn -= sign);
                }
                turns
            }
            Column::Stribeck { joint, velocity } => {
                let noise = scene.joints[*joint].speed_noise;
                vec![(*joint, motion.sharp[*joint].iter().map(|v| sign(*v, noise) * (-(v / velocity).powi(2)).exp()).collect())]
            }
            Column::Load(j) => {
                let noise = scene.joints[*j].speed_noise;
                let beyond = |k: usize| motion.beyond.get(*j).map_or(0.0, |b| b[k]);
                let load = |k: usize| (motion.rigid[*j][k] + beyond(k)).abs();
                vec![(*j, motion.sharp[*j].iter().enumerate().map(|(k, v)| load(k) * sign(*v, noise)).collect())]
            }
            Column::Torque(j) => vec![(*j, scene.nominal(motion).swap_remove(*j))],
            Column::Torques => scene.nominal(motion).into_iter().enumerate().collect(),
            Column::Falling(j) => {
                let [_, rate, _] = derivatives(&motion.torque[*j], scene.rate_hz, scene.joints[*j].corner_hz);
                vec![(*j, rate.iter().map(|r| -r).collect())]
            }
            Column::Slip { joint, way } => vec![(*joint, slip(&motion.q[*joint], *way))],
            Column::Stop { joint, from, above, ahead_s } => {
                let toward = if *above { 1.0 } else { -1.0 };
                let push = |(q, v): (&f64, &f64)| {
                    let depth = toward * (q - from);
                    if depth > 0.0 { toward * (depth + toward * ahead_s * v).max(0.0) } else { 0.0 }
                };
                vec![(*joint, motion.q[*joint].iter().zip(&motion.sharp[*joint]).map(push).collect())]
            }
            Column::Power { joint, power } => {
                let [low, high] = scene.joints[*joint].range;
                own(*joint, &|q, _| ((2.0 * q - low - high) / (high - low)).powi(*power))
            }
            Column::Smooth { joint, angle, speed } => {
                let ([low, high], fastest) = (scene.joints[*joint].range, 3.0 * scene.joints[*joint].speed);
                own(*joint, &|q, v| legendre(*angle, (2.0 * q - low - high) / (high - low)) * legendre(*speed, (v / fastest).clamp(-1.0, 1.0)))
            }
            Column::Gear(gear) => given(motion, scene, gear),
            Column::Body { link, parts } => {
                let felt = each_sample(motion, link + 1, |q, v, a, out| {
                    let y = scene.chain.regressor(q, v, a);
                    for (j, out) in out.iter_mut().enumerate() {
                        *out = parts.iter().enumerate().map(|(k, p)| p * y[[j, TERMS_OF_A_LINK * link + k]]).sum();
                    }
                });
                felt.into_iter().enumerate().collect()
            }
            Column::Zero { joint, at } => {
                let off = |by: f64| (0..motion.q.len()).map(|k| if k == *joint { by } else { 0.0 }).collect::<Vec<_>>();
                // At none the tangent.
                let [from, to] = if *at == 0.0 { [-EXCURSION, EXCURSION] } else { [0.0, *at] };
                let mut change = elsewhere([&off(from), &off(to)], motion, scene);
                change.iter_mut().flat_map(|(_, felt)| felt).for_each(|t| *t /= to - from);
                change
            }
            Column::Zeros(off) => elsewhere([&vec![0.0; off.len()], off], motion, scene),
            Column::Tilt { .. } | Column::Weight(_) => weight(self.gravity(scene.chain.gravity()).unwrap_or_default(), motion, scene),
        }
    }
}

/// What bodies and springs need more where each angle is so much less than its channel says, at the second of two places than at the first.
fn elsewhere(places: [&[f64]; 2], motion: &Motion, scene: &Scene<'_>) -> Vec<(usize, Vec<f64>)> {
    let [here, there] = places.map(|off| {
        if off.iter().all(|off| *off == 0.0) {
            return motion.rigid.clone();
        }
        let mut moved = motion.clone();
        moved.q.iter_mut().zip(off).for_each(|(q, off)| q.iter_mut().for_each(|q| *q -= off));
        let mut felt = inverse_dynamics(scene.chain, &moved);
        for ((felt, off), [stiffness, _]) in felt.iter_mut().zip(off).zip(scene.chain.springs()) {
            felt.iter_mut().for_each(|t| *t -= stiffness * off);
        }
        felt
    });
    there.into_iter().zip(here).map(|(there, here)| there.into_iter().zip(here).map(|(there, here)| there - here).collect()).enumerate().collect()
}

/// What the bodies weigh in a gravity.
fn weight(gravity: [f64; 3], motion: &Motion, scene: &Scene<'_>) -> Vec<(usize, Vec<f64>)> {
    let chain = scene.chain.clone().with_gravity(gravity);
    let still = vec![0.0; chain.joints().count()];
    let felt = each_sample(motion, still.len(), |q, _, _, out| chain.inverse_dynamics(q, &still, &still, out));
    felt.into_iter().enumerate().collect()
}

/// P_n(x).
fn legendre(n: usize, x: f64) -> f64 {
    let (mut before, mut now) = (0.0, 1.0);
    for k in 0..n {
        (before, now) = (now, ((2 * k + 1) as f64 * x * now - k as f64 * before) / (k + 1) as f64);
    }
    now
}

/// The stop operator: a spring that follows the motion until it slips, ±1 where it does after the way.
fn slip(q: &[f64], way: f64) -> Vec<f64> {
    let mut z = 0.0;
    let mut last = q[0];
    q.iter()
        .map(|&q| {
            z = f64::clamp(z + (q - last) / way, -1.0, 1.0);
            last = q;
            z
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::Column;

    #[test]
    fn a_law_relative_to_a_joint_that_stands_still_has_no_numbers() {
        assert!(Column::Turn { joint: 0, speed: 0.02 }.has_numbers());
        for nothing in [Column::Turn { joint: 0, speed: f64::NAN }, Column::Weight([0.0, f64::NAN, 1.0])] {
            assert!(!nothing.has_numbers(), "{nothing:?}");
        }
    }
}
