//! What bodies feel behind a joint that gives between its encoder and its link.

use crate::column::{Column, each_sample, inverse_dynamics};
use crate::motion::Motion;
use crate::scene::{Scene, turned};
use ndof_devices::{SerialChain, TERMS_OF_A_LINK};
use ndof_models::robot::Robot;
use ndof_signal::{RESOLVED, derivatives};
use std::sync::{Arc, OnceLock};

/// Excursion over which torques are differenced (rad): far above round-off, and what bends over it is far below the torques' noise.
const EXCURSION: f64 = 1e-4;
/// Share of a spring's stiffness that the load behind it leaves at least: where it takes more, the link falls over.
const STANDS: f64 = 0.1;

/// A gear that gives between the encoder of a joint and its link.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Gear {
    pub joint: usize,
    /// How far it gives (rad/(N m)).
    pub compliance: f64,
    /// What slows its deflection (N m s/rad).
    pub damping: f64,
    /// Deflection and rate beyond those of a link that follows its load, with which each trial begins.
    pub starts: Vec<[f64; 2]>,
    /// What it carries.
    pub bodies: Arc<Bodies>,
}

/// Share of critical damping that a gear is taken to have until it is fitted: metal has hundredths.
const USUAL: f64 = 0.05;

impl Gear {
    /// One of this compliance with what metal usually damps.
    pub fn new(scene: &Scene<'_>, joint: usize, compliance: f64) -> Self {
        let inertia = scene.joints[joint].inertia;
        let damping = if compliance > 0.0 { 2.0 * USUAL * (inertia / compliance).sqrt() } else { 0.0 };
        Gear { joint, compliance, damping, starts: vec![[0.0; 2]; scene.trials], bodies: scene.bodies.clone() }
    }

    /// Whether nothing of it was fitted but perhaps its compliance: its links begin as if they followed their load.
    pub fn is_searched(&self) -> bool {
        self.starts.iter().flatten().all(|x| *x == 0.0)
    }
}

/// The change of all torques for each unit of a compliance, when the joint gives by it: by the torque on the link where it then is.
///
/// The link swings on the gear, which the encoder moves: with the deflection δ = θ − q, the torque τ(q, q̇, q̈) that its bodies need and k the inverse of
/// the compliance,
///
/// k δ + d δ̇ = τ(θ − δ, θ̇ − δ̇, θ̈ − δ̈).
pub(crate) fn given(motion: &Motion, scene: &Scene<'_>, gear: &Gear) -> Vec<(usize, Vec<f64>)> {
    let Gear { joint, compliance, .. } = *gear;
    if compliance <= 0.0 {
        return deflected(motion, scene, joint, |torque| -torque);
    }
    let [bent, rate, curve] = derivatives(&swings(motion, scene, gear), scene.rate_hz, RESOLVED * scene.rate_hz / 2.0);
    let mut torques = inverse_dynamics(&gear.bodies.chain, &moved(motion, joint, -1.0, [&bent, &rate, &curve]));
    // The rotor turns with the encoder.
    torques[joint].iter_mut().zip(&curve).for_each(|(t, c)| *t += scene.joints[joint].rotor * c);
    torques.into_iter().zip(gear.bodies.torques(motion)).map(|(t, r)| t.iter().zip(r).map(|(t, r)| (t - r) / compliance).collect()).enumerate().collect()
}

/// Bodies as a gear carries them: the file's, or as they were found to be.
#[derive(Debug)]
pub(crate) struct Bodies {
    chain: SerialChain,
    /// What is known of them in each trial, once it is asked for.
    known: Vec<Known>,
}

#[derive(Debug)]
struct Known {
    /// Torques that they need without a deflection, `[joint][sample]`.
    torques: OnceLock<Vec<Vec<f64>>>,
    /// What hangs on each joint.
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

    /// The same with so much more of these columns' bodies; `None` where there are no such bodies.
    pub fn with(&self, columns: &[Column], factors: &[f64]) -> Option<Self> {
        let mut inertial = self.chain.inertial_parameters();
        for (column, factor) in columns.iter().zip(factors) {
            if let Column::Body { link, parts } = column {
                inertial[TERMS_OF_A_LINK * link..].iter_mut().zip(parts).for_each(|(own, part)| *own += factor * part);
            }
        }
        Some(Bodies::new(self.chain.clone().with_inertial_parameters(&inertial)?, self.known.len()))
    }

    /// The same where the base is turned.
    pub fn turned(self, tilt: &[f64; 3]) -> Self {
        let (gravity, change) = (self.chain.gravity(), turned(self.chain.gravity(), tilt));
        Bodies::new(self.chain.with_gravity(std::array::from_fn(|k| gravity[k] + change[k])), self.known.len())
    }

    fn torques(&self, motion: &Motion) -> &[Vec<f64>] {
        self.known[motion.trial].torques.get_or_init(|| inverse_dynamics(&self.chain, motion))
    }

    fn load(&self, motion: &Motion, joint: usize, rotor: f64) -> &Load {
        self.known[motion.trial].loads[joint].get_or_init(|| Load::of(motion, self, joint, rotor))
    }
}

/// What hangs on a joint, sample by sample.
#[derive(Debug)]
struct Load {
    /// Inertia about the joint, without its rotor; it does not depend on the joint's own angle.
    inertia: Vec<f64>,
    /// How much less torque it needs for each unit of a deflection.
    slope: Vec<f64>,
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

/// The deflection δ of a gear, sample by sample. With M(t) the inertia behind it and u(t, δ) what its bodies need where only they are deflected,
/// M δ̈ + (d + Ṁ) δ̇ + k δ = u(t, δ): exact in each step for coefficients in its middle and u on a line in t and δ.
fn swings(motion: &Motion, scene: &Scene<'_>, gear: &Gear) -> Vec<f64> {
    let Gear { joint, compliance, damping, .. } = *gear;
    let (n, step_s, stiffness) = (motion.q[joint].len(), 1.0 / scene.rate_hz, 1.0 / compliance);
    let rotor = scene.joints[joint].rotor;
    let (load, rigid) = (gear.bodies.load(motion, joint, rotor), &gear.bodies.torques(motion)[joint]);
    let [mut q, mut v, mut a, mut out] = [(); 4].map(|()| vec![0.0; motion.q.len()]);
    let slope = |k: usize| load.slope[k].max((STANDS - 1.0) * stiffness);
    // u where the line in δ passes through none of it.
    let mut needed = |k: usize, bent: f64| {
        for j in 0..q.len() {
            (q[j], v[j], a[j]) = (motion.q[j][k], motion.v[j][k], motion.a[j][k]);
        }
        q[joint] -= bent;
        gear.bodies.chain.inverse_dynamics(&q, &v, &a, &mut out);
        // A line between samples takes (ωh)²/12 off what swings; the second difference gives it back.
        let bend = rigid[(k + 1).min(n - 1)] - 2.0 * rigid[k] + rigid[k.saturating_sub(1)];
        out[joint] - rotor * a[joint] + slope(k) * bent - bend / 12.0
    };
    let between = |k: usize| {
        let next = (k + 1).min(n - 1);
        Swing {
            inertia: 0.5 * (load.inertia[k] + load.inertia[next]),
            damping: damping + (load.inertia[next] - load.inertia[k]) / step_s,
            stiffness: stiffness + 0.5 * (slope(k) + slope(next)),
        }
    };
    let growth = (rigid[1.min(n - 1)] - rigid[0]) / step_s;
    let follows = between(0).stays(rigid[0], growth);
    let start = gear.starts[motion.trial];
    let mut state = [follows[0] + start[0], follows[1] + start[1]];
    let mut now = needed(0, state[0]);
    let mut deflection = Vec::with_capacity(n);
    for k in 0..n {
        deflection.push(state[0]);
        let after = needed((k + 1).min(n - 1), state[0] + step_s * state[1]);
        state = between(k).after(state, [now, after], step_s);
        now = after;
    }
    deflection
}

/// M ẍ + c ẋ + k x = u.
struct Swing {
    inertia: f64,
    damping: f64,
    stiffness: f64,
}

impl Swing {
    /// Where it stays, and how fast it moves, behind a force that grows in a line.
    fn stays(&self, force: f64, growth: f64) -> [f64; 2] {
        let rate = growth / self.stiffness;
        [(force - self.damping * rate) / self.stiffness, rate]
    }

    /// x and ẋ after a time in which the force goes from one to another in a line.
    fn after(&self, [x, v]: [f64; 2], [from, to]: [f64; 2], time: f64) -> [f64; 2] {
        let [before, rate] = self.stays(from, (to - from) / time);
        let [own, swing] = swung([x - before, v - rate], self.damping / (2.0 * self.inertia), self.stiffness / self.inertia, time);
        [before + rate * time + own, rate + swing]
    }
}

/// x and ẋ of ẍ + 2 α ẋ + ω² x = 0 a while later.
fn swung([x, v]: [f64; 2], decay: f64, square: f64, time: f64) -> [f64; 2] {
    let left = square - decay * decay;
    let (w, fall) = (left.abs().sqrt() * time, decay * time);
    let [c, s] = if left >= 0.0 {
        [w.cos(), w.sin()].map(|x| x * (-fall).exp())
    } else {
        // Of cosh and sinh, which alone overflow where it falls fast.
        let [slow, fast] = [w - fall, -w - fall].map(f64::exp);
        [0.5 * (slow + fast), 0.5 * (slow - fast)]
    };
    // e^(−αt) sin(ωt)/ω, which is t e^(−αt) where ω is none.
    let s = if w > 1e-9 { s / w * time } else { time * (-fall).exp() };
    [x * c + (v + decay * x) * s, v * c - (decay * v + square * x) * s]
}

/// A motion in which a joint is so many times a deflection further.
fn moved(motion: &Motion, joint: usize, times: f64, bent: [&[f64]; 3]) -> Motion {
    let mut moved = motion.clone();
    for (series, bent) in [&mut moved.q, &mut moved.v, &mut moved.a].into_iter().zip(bent) {
        series[joint].iter_mut().zip(bent).for_each(|(x, d)| *x += times * d);
    }
    moved
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
    use crate::scene::{rms, scene};
    use crate::swinging::swinging;
    use ndof_devices::RobotConfig;
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

    /// By their own equations of motion, from slow to fast and from none to much damping: x = e^(−αt) of one that is critically damped and begins with v = −α x.
    #[test]
    fn what_swings_obeys_its_equation_and_what_falls_fast_stays_finite() {
        for (decay, square) in [(0.0, 100.0), (1.0, 100.0), (10.0, 100.0), (30.0, 100.0), (1e6, 100.0), (2.0, -3.0)] {
            let at = |t: f64| swung([1.0, -0.5], decay, square, t);
            let [x, v] = at(0.07);
            let h = 1e-5;
            let [before, after] = [at(0.07 - h), at(0.07 + h)];
            assert!(x.is_finite() && v.is_finite() && ((after[0] - before[0]) / (2.0 * h) - v).abs() < 1e-6, "{decay} {square}");
            let acceleration = (after[1] - before[1]) / (2.0 * h);
            assert!((acceleration + 2.0 * decay * v + square * x).abs() < 1e-4 * (1.0 + 2.0 * decay * v.abs() + square.abs()), "{decay} {square}");
        }
        let [x, v] = swung([1.0, -10.0], 10.0, 100.0, 0.3);
        assert!((x - (-3.0_f64).exp()).abs() < 1e-12 && (v + 10.0 * (-3.0_f64).exp()).abs() < 1e-11);
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
                let gear = Gear { joint: 0, compliance: 1.0 / stiffness, damping: times * damping, starts: vec![[0.0; 2]], bodies: scene.bodies.clone() };
                let found = given(&motions[0], &scene, &gear);
                [0, 1].map(|j| rms(&(3000..5500).map(|k| torques[k][j] - motions[0].rigid[j][k] - found[j].1[k] / stiffness).collect::<Vec<_>>()))
            };
            let (right, wrong) = (left(1.0), left(1.1));
            for j in 0..2 {
                // What ten percent of its small damping changes is more than ten times what is left.
                let size = rms(&torques.iter().map(|t| t[j]).collect::<Vec<_>>());
                assert!(right[j] < 1e-4 * size && right[j] < 0.1 * wrong[j], "{stiffness} {damping} {j}: {} {}", right[j], wrong[j]);
            }
        }
    }
}
