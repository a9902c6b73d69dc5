//! What bodies feel behind a joint that gives between its encoder and its link.

use crate::column::{each_sample, inverse_dynamics};
use crate::motion::Motion;
use crate::scene::Scene;
use ndof_models::robot::Robot;
use ndof_signal::{RESOLVED, derivatives};
use std::sync::Arc;

/// Largest excursion over which the torques are differenced (rad): far above round-off, and its cube far below the torques' noise.
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
    /// Deflection and rate beyond those of a link that follows its load, with which each trial begins; none where it is not said.
    pub starts: Vec<[f64; 2]>,
}

/// Share of critical damping that a gear is taken to have until it is fitted: metal has hundredths.
const USUAL: f64 = 0.05;

impl Gear {
    /// One of this compliance with what metal usually damps.
    pub fn new(joint: usize, compliance: f64, inertia: f64) -> Self {
        let damping = if compliance > 0.0 { 2.0 * USUAL * (inertia / compliance).sqrt() } else { 0.0 };
        Gear { joint, compliance, damping, starts: vec![] }
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
    let mut torques = inverse_dynamics(scene.chain, &moved(motion, joint, -1.0, [&bent, &rate, &curve]));
    // The rotor turns with the encoder.
    torques[joint].iter_mut().zip(&curve).for_each(|(t, c)| *t += scene.joints[joint].rotor * c);
    torques.into_iter().zip(&motion.rigid).map(|(t, r)| t.iter().zip(r).map(|(t, r)| (t - r) / compliance).collect()).enumerate().collect()
}

/// What hangs on a joint, sample by sample.
#[derive(Clone, Debug)]
pub(crate) struct Load {
    /// Inertia about the joint, without its rotor; it does not depend on the joint's own angle.
    inertia: Vec<f64>,
    /// How much less torque it needs for each unit of a deflection.
    slope: Vec<f64>,
}

impl Load {
    fn of(motion: &Motion, scene: &Scene<'_>, joint: usize) -> Self {
        let n = scene.joints.len();
        let weightless = scene.chain.clone().with_gravity([0.0; 3]);
        let (still, mut unit) = (vec![0.0; n], vec![0.0; n]);
        unit[joint] = 1.0;
        let inertia = each_sample(motion, n, |q, _, _, out| weightless.inverse_dynamics(q, &still, &unit, out)).swap_remove(joint);
        let rotor = scene.joints[joint].rotor;
        let nothing = vec![0.0; inertia.len()];
        let bent = moved(motion, joint, EXCURSION, [&vec![1.0; inertia.len()], &nothing, &nothing]);
        let further = inverse_dynamics(scene.chain, &bent).swap_remove(joint);
        let slope = further.iter().zip(&motion.rigid[joint]).map(|(f, r)| (f - r) / EXCURSION).collect();
        Load { inertia: inertia.into_iter().map(|m| m - rotor).collect(), slope }
    }
}

/// The deflection δ of a gear, sample by sample. With M(t) the inertia behind it and u(t, δ) what its bodies need where only they are deflected,
/// M δ̈ + (d + Ṁ) δ̇ + k δ = u(t, δ): exact in each step for coefficients in its middle and u on a line in t and δ.
fn swings(motion: &Motion, scene: &Scene<'_>, gear: &Gear) -> Vec<f64> {
    let Gear { joint, compliance, damping, .. } = *gear;
    let (n, step_s, stiffness) = (motion.q[joint].len(), 1.0 / scene.rate_hz, 1.0 / compliance);
    let load = motion.loads[joint].get_or_init(|| Arc::new(Load::of(motion, scene, joint)));
    let (rotor, rigid) = (scene.joints[joint].rotor, &motion.rigid[joint]);
    let [mut q, mut v, mut a, mut out] = [(); 4].map(|()| vec![0.0; motion.q.len()]);
    let slope = |k: usize| load.slope[k].max((STANDS - 1.0) * stiffness);
    // u where the line in δ passes through none of it.
    let mut needed = |k: usize, bent: f64| {
        for j in 0..q.len() {
            (q[j], v[j], a[j]) = (motion.q[j][k], motion.v[j][k], motion.a[j][k]);
        }
        q[joint] -= bent;
        scene.chain.inverse_dynamics(&q, &v, &a, &mut out);
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
    let start = gear.starts.get(motion.trial).copied().unwrap_or_default();
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
    use ndof_devices::RobotConfig;
    use ndof_signal::{Channel, Quantity, Recording, Unit};
    use ndof_sysid::Ports;

    const PENDULUM: &str = r#"
schema = "ndof/robot/1"
name = "pendulum"
joints = [{ name = "elbow", axis = [0.0, 1.0, 0.0], mass_kg = 2.0, centre_m = [0.3, 0.0, 0.0] }]
"#;

    fn wave(t: f64) -> [f64; 2] {
        [0.5 * (1.3 * t).sin() + 0.3 * (2.9 * t).sin(), 0.65 * (1.3 * t).cos() + 0.87 * (2.9 * t).cos()]
    }

    /// The torque of a gear whose link swings on it, by Runge-Kutta steps of a tenth of a millisecond.
    fn swinging(stiffness: f64, damping: f64, samples: usize) -> Vec<f64> {
        const STEP: f64 = 1e-4;
        let spring = |t: f64, [q, v]: [f64; 2]| stiffness * (wave(t)[0] - q) + damping * (wave(t)[1] - v);
        let moves = |t: f64, x: [f64; 2]| [x[1], (spring(t, x) + 2.0 * 9.81 * 0.3 * x[0].cos()) / 0.18];
        let after = |x: [f64; 2], d: [f64; 2], h: f64| [x[0] + h * d[0], x[1] + h * d[1]];
        let mut x = [5.886 / stiffness, 1.52];
        let mut out = Vec::new();
        for k in 0..100 * samples {
            let t = k as f64 * STEP;
            if k % 100 == 0 {
                out.push(spring(t, x));
            }
            let a = moves(t, x);
            let b = moves(t + 0.5 * STEP, after(x, a, 0.5 * STEP));
            let c = moves(t + 0.5 * STEP, after(x, b, 0.5 * STEP));
            let d = moves(t + STEP, after(x, c, STEP));
            x = after(x, std::array::from_fn(|i| (a[i] + 2.0 * b[i] + 2.0 * c[i] + d[i]) / 6.0), STEP);
        }
        out
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

    #[test]
    fn a_link_swings_on_its_gear_as_its_equation_says() {
        let chain = RobotConfig::parse("pendulum.toml", PENDULUM, None).and_then(|c| c.chain()).expect("a robot");
        let ports = Ports { references: vec![], inputs: vec![0], outputs: vec![1] };
        let channel = |name: &str, quantity, samples| Channel::new(name, Unit::si(quantity, true), samples);
        for (stiffness, damping) in [(16.0, 0.15), (16.0, 0.6), (40.0, 1.0), (4000.0, 1.0)] {
            let torque = swinging(stiffness, damping, 6000);
            let angle = (0..6000).map(|k| wave(f64::from(k) / 100.0)[0]).collect();
            let channels = vec![channel("torque", Quantity::Effort, torque.clone()), channel("angle", Quantity::Displacement, angle)];
            let (scene, motions) = scene(&chain, &[Recording::new(100.0, channels).expect("a log")], &[], &ports).expect("it moves");
            // Where the swing of the beginning and the ends of the smoothing are over.
            let left = |times: f64| {
                let gear = Gear { joint: 0, compliance: 1.0 / stiffness, damping: times * damping, starts: vec![] };
                let found = given(&motions[0], &scene, &gear).swap_remove(0).1;
                rms(&(2000..5000).map(|k| torque[k] - motions[0].rigid[0][k] - found[k] / stiffness).collect::<Vec<_>>())
            };
            // What ten percent of its small damping changes is more than ten times what is left.
            assert!(left(1.0) < 1e-4 * rms(&torque) && left(1.0) < 0.1 * left(1.1), "{stiffness} {damping}: {} {}", left(1.0), left(1.1));
        }
    }
}
