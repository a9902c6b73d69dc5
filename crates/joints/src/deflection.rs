//! What bodies feel behind a joint that gives between its encoder and its link.

use crate::bodies::{Bodies, EXCURSION, Load, moved};
use crate::dynamics::{each_sample, inverse_dynamics, sign};
use crate::motion::Motion;
use crate::scene::Scene;
use crate::swing::{Fall, Swing};
use ndof_devices::TERMS_OF_A_LINK;
use ndof_models::robot::Robot;
use ndof_signal::{RESOLVED, derivatives};
use rayon::prelude::*;
use std::sync::Arc;

/// Share of a spring's stiffness that the load behind it leaves at least: where it takes more, the link falls over.
const STANDS: f64 = 0.1;

/// How a gear lets its link move.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Lets {
    /// It gives with the torque on it.
    Give,
    /// It has play, in which the link falls and on whose sides it stays where it lands.
    Play,
}

/// A gear between the encoder of a joint and its link that is not stiff.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Gear {
    pub joint: usize,
    pub lets: Lets,
    /// How far it gives (rad/(N m)), or the width of its play (rad).
    pub extent: f64,
    /// What slows its deflection (N m s/rad).
    pub damping: f64,
    /// Deflection and rate beyond those of a link that follows its load, with which each trial begins; a link that falls lands and forgets.
    pub starts: Vec<[f64; 2]>,
    /// What it carries.
    pub bodies: Arc<Bodies>,
}

/// Share of critical damping that a gear is taken to have until it is fitted: metal has hundredths.
const USUAL: f64 = 0.05;

impl Gear {
    /// One of this extent with what metal usually damps.
    pub fn new(scene: &Scene<'_>, joint: usize, lets: Lets, extent: f64) -> Self {
        let (inertia, bodies) = (scene.joints[joint].inertia, scene.bodies.clone());
        let (damping, starts) = match lets {
            Lets::Give if extent > 0.0 => (2.0 * USUAL * (inertia / extent).sqrt(), vec![[0.0; 2]; scene.trials]),
            Lets::Give => (0.0, vec![[0.0; 2]; scene.trials]),
            Lets::Play => (0.0, vec![]),
        };
        Gear { joint, lets, extent, damping, starts, bodies }
    }

    /// Whether its link swings, and so remembers how it began.
    pub fn swings(&self) -> bool {
        self.lets == Lets::Give && self.extent > 0.0
    }

    /// Whether nothing of it was fitted but perhaps its extent: its links begin as if they followed their load.
    pub fn is_searched(&self) -> bool {
        self.starts.iter().flatten().all(|x| *x == 0.0)
    }
}

/// The change of all torques for each unit of a gear's extent: by the torque on the link where it then is.
///
/// The link swings on the gear, which the encoder moves: with the deflection δ = θ − q, the torque τ(q, q̇, q̈) that its bodies need and k the inverse of
/// the compliance,
///
/// k δ + d δ̇ = τ(θ − δ, θ̇ − δ̇, θ̈ − δ̈).
///
/// In a play it falls, 0 = τ(θ − δ, …) while |δ| < g/2, and lands without a rebound. A gear without an extent is the line at none of it.
pub(crate) fn given(motion: &Motion, scene: &Scene<'_>, gear: &Gear) -> Vec<(usize, Vec<f64>)> {
    let Gear { joint, extent, .. } = *gear;
    match gear.lets {
        Lets::Give if extent <= 0.0 => deflected(motion, scene, joint, |torque| -torque),
        Lets::Play if extent <= 0.0 => deflected(motion, scene, joint, |torque| -0.5 * sign(torque, scene.joints[joint].torque_noise)),
        _ => {
            let [bent, rate, curve] = deflections(motion, scene, gear);
            let mut torques = inverse_dynamics(&gear.bodies.chain, &moved(motion, joint, -1.0, [&bent, &rate, &curve]));
            // The rotor turns with the encoder.
            torques[joint].iter_mut().zip(&curve).for_each(|(t, c)| *t += scene.joints[joint].rotor * c);
            torques.into_iter().zip(gear.bodies.torques(motion)).map(|(t, r)| t.iter().zip(r).map(|(t, r)| (t - r) / extent).collect()).enumerate().collect()
        }
    }
}

/// How far a gear is deflected, how fast, and how that changes.
fn deflections(motion: &Motion, scene: &Scene<'_>, gear: &Gear) -> [Vec<f64>; 3] {
    let deflection = match gear.lets {
        Lets::Give => swings(motion, scene, gear),
        Lets::Play => falls(motion, scene, gear),
    };
    derivatives(&deflection, scene.rate_hz, RESOLVED * scene.rate_hz / 2.0)
}

/// The change of all torques for each unit more of bodies behind a gear, `[body][joint][sample]`: what they need where the link is, and what the swing needs
/// that they change, to first order. A body is its link and its inertial parameters.
pub(crate) fn heavier(motion: &Motion, scene: &Scene<'_>, gear: &Gear, bodies: &[(usize, [f64; TERMS_OF_A_LINK])]) -> Vec<Vec<Vec<f64>>> {
    let (n, joint, chain) = (scene.joints.len(), gear.joint, &gear.bodies.chain);
    let [bent, rate, curve] = deflections(motion, scene, gear);
    let link = moved(motion, joint, -1.0, [&bent, &rate, &curve]);
    let mut felt = each_sample(&link, n * bodies.len(), |q, v, a, out| {
        let y = chain.regressor(q, v, a);
        for (out, (body, parts)) in out.chunks_exact_mut(n).zip(bodies) {
            out.iter_mut().enumerate().for_each(|(j, out)| *out = parts.iter().enumerate().map(|(k, p)| p * y[[j, TERMS_OF_A_LINK * body + k]]).sum());
        }
    });
    let before = inverse_dynamics(chain, &link);
    felt.par_chunks_exact_mut(n).for_each(|felt| {
        let more = follows(motion, scene, gear, &felt[joint]);
        let size = more.iter().fold(0.0_f64, |s, x| s.max(x.abs()));
        if size > 0.0 {
            let step = EXCURSION / size;
            let [bent, rate, curve] = derivatives(&more, scene.rate_hz, RESOLVED * scene.rate_hz / 2.0);
            let after = inverse_dynamics(chain, &moved(&link, joint, -step, [&bent, &rate, &curve]));
            for ((felt, after), before) in felt.iter_mut().zip(&after).zip(&before) {
                felt.iter_mut().zip(after.iter().zip(before)).for_each(|(f, (a, b))| *f += (a - b) / step);
            }
            felt[joint].iter_mut().zip(&curve).for_each(|(f, c)| *f += scene.joints[joint].rotor * c);
        }
    });
    felt.chunks_exact(n).map(<[_]>::to_vec).collect()
}

/// What the bodies behind a gear need at each sample where only they are deflected.
struct Needed<'a> {
    motion: &'a Motion,
    gear: &'a Gear,
    rotor: f64,
    load: &'a Load,
    /// Without a deflection.
    rigid: &'a [f64],
    step_s: f64,
    states: [Vec<f64>; 4],
}

impl<'a> Needed<'a> {
    fn new(motion: &'a Motion, scene: &Scene<'_>, gear: &'a Gear) -> Self {
        let (joint, rotor) = (gear.joint, scene.joints[gear.joint].rotor);
        let (load, rigid) = (gear.bodies.load(motion, joint, rotor), &gear.bodies.torques(motion)[joint]);
        Needed { motion, gear, rotor, load, rigid, step_s: 1.0 / scene.rate_hz, states: [(); 4].map(|()| vec![0.0; motion.q.len()]) }
    }

    /// The sample after this one.
    fn next(&self, k: usize) -> usize {
        (k + 1).min(self.rigid.len() - 1)
    }

    /// At a deflection.
    fn at(&mut self, k: usize, bent: f64) -> f64 {
        let ([q, v, a, out], joint, motion) = (&mut self.states, self.gear.joint, self.motion);
        for j in 0..q.len() {
            (q[j], v[j], a[j]) = (motion.q[j][k], motion.v[j][k], motion.a[j][k]);
        }
        q[joint] -= bent;
        self.gear.bodies.chain.inverse_dynamics(q, v, a, out);
        out[joint] - self.rotor * a[joint]
    }

    /// How much less they need for each unit of a deflection, as far as the link stands on its gear.
    fn slope(&self, k: usize) -> f64 {
        self.load.slope[k].max((STANDS - 1.0) / self.gear.extent)
    }

    /// What a line between samples takes off what swings, (ωh)²/12 of it: the second difference gives it back.
    fn bend(&self, torque: &[f64], k: usize) -> f64 {
        (torque[self.next(k)] - 2.0 * torque[k] + torque[k.saturating_sub(1)]) / 12.0
    }

    /// How the link swings between a sample and the next.
    fn swing(&self, k: usize) -> Swing {
        let [inertia, grows] = self.inertia(k);
        Swing { inertia, damping: self.gear.damping + grows, stiffness: 1.0 / self.gear.extent + 0.5 * (self.slope(k) + self.slope(self.next(k))) }
    }

    /// M between a sample and the next, and Ṁ.
    fn inertia(&self, k: usize) -> [f64; 2] {
        let (here, there) = (self.load.inertia[k], self.load.inertia[self.next(k)]);
        [0.5 * (here + there), (there - here) / self.step_s]
    }
}

/// The deflection δ of a gear, sample by sample. With M(t) the inertia behind it and u(t, δ) what its bodies need where only they are deflected,
/// M δ̈ + (d + Ṁ) δ̇ + k δ = u(t, δ): exact in each step for coefficients in its middle and u on a line in t and δ.
fn swings(motion: &Motion, scene: &Scene<'_>, gear: &Gear) -> Vec<f64> {
    let mut needed = Needed::new(motion, scene, gear);
    let (rigid, step_s) = (needed.rigid, needed.step_s);
    // u where the line in δ passes through none of it.
    let force = |needed: &mut Needed<'_>, k: usize, bent: f64| needed.at(k, bent) + needed.slope(k) * bent - needed.bend(rigid, k);
    let growth = (rigid[needed.next(0)] - rigid[0]) / step_s;
    let follows = needed.swing(0).stays(rigid[0], growth);
    let start = gear.starts[motion.trial];
    let mut state = [follows[0] + start[0], follows[1] + start[1]];
    let mut now = force(&mut needed, 0, state[0]);
    let mut deflection = Vec::with_capacity(rigid.len());
    for k in 0..rigid.len() {
        deflection.push(state[0]);
        let next = needed.next(k);
        let after = force(&mut needed, next, state[0] + step_s * state[1]);
        state = needed.swing(k).after(state, [now, after], step_s);
        now = after;
    }
    deflection
}

/// The deflection that a torque would add to small order.
fn follows(motion: &Motion, scene: &Scene<'_>, gear: &Gear, torque: &[f64]) -> Vec<f64> {
    let needed = Needed::new(motion, scene, gear);
    let force = |k: usize| torque[k] - needed.bend(torque, k);
    let mut state = needed.swing(0).stays(torque[0], (torque[needed.next(0)] - torque[0]) / needed.step_s);
    let mut deflection = Vec::with_capacity(torque.len());
    for k in 0..torque.len() {
        deflection.push(state[0]);
        state = needed.swing(k).after(state, [force(k), force(needed.next(k))], needed.step_s);
    }
    deflection
}

/// The deflection δ of a link in its play, sample by sample: M δ̈ + Ṁ δ̇ = u(t, δ) between ± g/2, u on a line in t in each step.
fn falls(motion: &Motion, scene: &Scene<'_>, gear: &Gear) -> Vec<f64> {
    let mut needed = Needed::new(motion, scene, gear);
    let side = 0.5 * gear.extent;
    let (samples, step_s) = (needed.rigid.len(), needed.step_s);
    let mut fall = Fall { side, x: side.copysign(needed.rigid[0]), v: 0.0 };
    let (mut last, mut now) = (fall.x, needed.at(0, fall.x));
    let mut deflection = Vec::with_capacity(samples);
    for k in 0..samples {
        deflection.push(fall.x);
        if fall.x != last {
            (last, now) = (fall.x, needed.at(k, fall.x));
        }
        let next = needed.next(k);
        let after = needed.at(next, fall.x);
        let [inertia, grows] = needed.inertia(k);
        // Where it falls, Ṁ δ̇ hardly changes over a step.
        let [from, to] = [now, after].map(|u| (u - grows * fall.v) / inertia);
        fall.over(step_s, from, (to - from) / step_s);
        now = after;
    }
    deflection
}

/// The change of all torques for each unit of a deflection of one joint that follows from the torque on it.
pub(crate) fn deflected(motion: &Motion, scene: &Scene<'_>, joint: usize, deflection: impl Fn(f64) -> f64) -> Vec<(usize, Vec<f64>)> {
    let load: Vec<f64> = motion.rigid[joint].iter().map(|t| deflection(*t)).collect();
    let size = load.iter().fold(0.0_f64, |s, x| s.max(x.abs()));
    if size == 0.0 {
        return vec![];
    }
    let [bent, rate, curve] = derivatives(&load, scene.rate_hz, scene.twice_hz());
    let step = EXCURSION / size;
    let [up, down] = [step, -step].map(|times| inverse_dynamics(scene.chain, &moved(motion, joint, times, [&bent, &rate, &curve])));
    up.into_iter().zip(down).map(|(up, down)| up.iter().zip(&down).map(|(u, d)| (u - d) / (2.0 * step)).collect()).enumerate().collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::column::Column;
    use crate::scene::scene;
    use crate::swinging::swinging;
    use ndof_devices::RobotConfig;
    use ndof_signal::rms;
    use ndof_signal::{Channel, Quantity, Recording, Unit};
    use ndof_sysid::Ports;

    /// Two links of point masses in a vertical plane, rotors before both gears.
    const TWO_LINKS: &str = r#"
schema = "ndof/robot/1"
name = "two links"
joints = [
  { name = "shoulder", axis = [0.0, 1.0, 0.0], mass_kg = 1.0, centre_m = [0.2, 0.0, 0.0], rotor_inertia_kg_m2 = 0.05 },
  { name = "elbow", axis = [0.0, 1.0, 0.0], origin_m = [0.3, 0.0, 0.0], mass_kg = 1.5, centre_m = [0.25, 0.0, 0.0], rotor_inertia_kg_m2 = 0.02 },
]
"#;

    /// Angle, rate and acceleration of a sum of sines: size, rate, phase.
    fn sines(parts: &[[f64; 3]], t: f64) -> [f64; 3] {
        parts.iter().fold([0.0; 3], |[q, v, a], [size, w, phase]| {
            let (sin, cos) = (w * t + phase).sin_cos();
            [q + size * sin, v + size * w * cos, a - size * w * w * sin]
        })
    }

    fn shoulder(t: f64) -> [f64; 3] {
        sines(&[[0.5, 1.3, 0.0], [0.3, 2.9, 0.0]], t)
    }

    fn elbow(t: f64) -> [f64; 3] {
        sines(&[[0.8, 1.7, 0.4], [0.3, 3.1, 1.0]], t)
    }

    /// Torques of the links in closed form, without rotors.
    fn needed([q1, v1, a1]: [f64; 3], [q2, v2, a2]: [f64; 3]) -> [f64; 2] {
        let (g, weight, [near, far]) = (9.81, 1.5 * 0.25, [1.5 * 0.25 * 0.25, 1.5 * 0.3 * 0.25]);
        let (across, whole) = (near + far * q2.cos(), 1.0 * 0.2 * 0.2 + 1.5 * 0.3 * 0.3 + near + 2.0 * far * q2.cos());
        let first = whole * a1 + across * a2 - far * q2.sin() * (2.0 * v1 * v2 + v2 * v2);
        let second = across * a1 + near * a2 + far * q2.sin() * v1 * v1;
        [first - g * ((0.2 + 1.5 * 0.3) * q1.cos() + weight * (q1 + q2).cos()), second - g * weight * (q1 + q2).cos()]
    }

    /// A shoulder's gear gives; what hangs on it changes with the elbow, and both joints feel how it swings.
    #[test]
    fn a_link_swings_on_its_gear_as_its_equation_says() {
        let chain = RobotConfig::parse("two.toml", TWO_LINKS, None).and_then(|c| c.chain()).expect("a robot");
        let ports = Ports { references: vec![], inputs: vec![0, 1], outputs: vec![2, 3] };
        let times = || (0..6000).map(|k| f64::from(k) / 100.0);
        for (stiffness, damping) in [(40.0, 0.4), (40.0, 1.5), (100.0, 2.5), (1e4, 2.5)] {
            let spring = |t: f64, [q, v]: [f64; 2]| stiffness * (shoulder(t)[0] - q) + damping * (shoulder(t)[1] - v);
            // The torque is a line in the acceleration.
            let acceleration = |t: f64, [q, v]: [f64; 2]| {
                let [still, unit] = [0.0, 1.0].map(|a| needed([q, v, a], elbow(t))[0]);
                (spring(t, [q, v]) - still) / (unit - still)
            };
            let link = swinging(100.0, 6000, 0.0, [shoulder(0.0)[0], shoulder(0.0)[1]], acceleration);
            let torques: Vec<[f64; 2]> = times()
                .zip(&link)
                .map(|(t, x)| [spring(t, *x) + 0.05 * shoulder(t)[2], needed([x[0], x[1], acceleration(t, *x)], elbow(t))[1] + 0.02 * elbow(t)[2]])
                .collect();
            let channel = |name: &str, quantity, samples| Channel::new(name, Unit::si(quantity, true), samples);
            let mut channels: Vec<Channel> =
                (0..2).map(|j| channel(&format!("torque_{j}"), Quantity::Effort, torques.iter().map(|t| t[j]).collect())).collect();
            channels.push(channel("angle_0", Quantity::Displacement, times().map(|t| shoulder(t)[0]).collect()));
            channels.push(channel("angle_1", Quantity::Displacement, times().map(|t| elbow(t)[0]).collect()));
            let (scene, motions) = scene(&chain, &[Recording::new(100.0, channels).expect("a log")], &[], &ports).expect("it moves");
            // What is left of each torque, where the swing of the beginning and the ends of the smoothing are over.
            let left = |times: f64| {
                let gear = Gear { damping: times * damping, ..Gear::new(&scene, 0, Lets::Give, 1.0 / stiffness) };
                let found = given(&motions[0], &scene, &gear);
                [0, 1].map(|j| rms(&(3000..5500).map(|k| torques[k][j] - motions[0].rigid[j][k] - found[j].1[k] / stiffness).collect::<Vec<_>>()))
            };
            // A heavier elbow, and one whose centre is further out, beside the differences that they make.
            let gear = Gear { damping, ..Gear::new(&scene, 0, Lets::Give, 1.0 / stiffness) };
            let mut more = [[0.0; TERMS_OF_A_LINK]; 2];
            (more[0][0], more[1][1]) = (1.0, 1.0);
            let widest = swings(&motions[0], &scene, &gear).iter().fold(0.0_f64, |s, x| s.max(x.abs()));
            let changes = heavier(&motions[0], &scene, &gear, &more.map(|parts| (1, parts)));
            for (change, parts) in changes.iter().zip(&more) {
                let by = [1e-3, -1e-3].map(|by| {
                    let all: Vec<f64> = [0.0; TERMS_OF_A_LINK].iter().chain(parts).map(|p| by * p).collect();
                    let bodies = Arc::new(scene.bodies.with(&all).expect("bodies"));
                    let needs = bodies.torques(&motions[0]).to_vec();
                    let given = given(&motions[0], &scene, &Gear { bodies, ..gear.clone() });
                    [0, 1].map(|j| needs[j].iter().zip(&given[j].1).map(|(n, g)| n + g / stiffness).collect::<Vec<_>>())
                });
                let still = Column::Body { link: 1, parts: *parts }.along(&motions[0], &scene);
                for j in 0..2 {
                    let truth: Vec<f64> = by[0][j].iter().zip(&by[1][j]).map(|(up, down)| (up - down) / 2e-3).collect();
                    let less = |x: &[f64]| rms(&(500..5500).map(|k| x[k] - truth[k]).collect::<Vec<_>>());
                    // Weights are sines of angles: over a deflection of a radian their slopes change by themselves. The softest resonates, which takes that further.
                    assert!(
                        stiffness < 100.0 || less(&change[j]) < widest * less(&still[j].1),
                        "{stiffness} {damping} {j}: {} {}",
                        less(&change[j]),
                        less(&still[j].1)
                    );
                }
            }
            let (right, wrong) = (left(1.0), left(1.1));
            for j in 0..2 {
                // What ten percent of its small damping changes is more than ten times what is left.
                let size = rms(&torques.iter().map(|t| t[j]).collect::<Vec<_>>());
                assert!(right[j] < 1e-4 * size && right[j] < 0.1 * wrong[j], "{stiffness} {damping} {j}: {} {}", right[j], wrong[j]);
            }
        }
    }
}
