//! The robot, what its file says of it, and what is known of a log before anything is tried.

use crate::JointsError;
use crate::bodies::Bodies;
use crate::causes::Form;
use crate::column::Column;
use crate::dynamics::inverse_dynamics;
use crate::motion::Motion;
use ndof_devices::{SerialChain, TERMS_OF_A_LINK};
use ndof_models::robot::{Joints, Robot};
use ndof_signal::{MotionNoise, RESOLVED, Recording, derivatives, deviation, effort_noise, rms};
use ndof_sysid::Ports;
use std::sync::Arc;

/// What is known of a joint over all that is fitted.
#[derive(Clone, Copy, Debug)]
pub(crate) struct JointScale {
    /// Up to where its motion is told from the noise of its encoder (Hz).
    pub corner_hz: f64,
    /// What it turns, in the middle of its movement (kg m²).
    pub inertia: f64,
    /// What of it is the motor's, before a gear (kg m²).
    pub rotor: f64,
    /// Least and greatest angle.
    pub range: [f64; 2],
    /// How fast it moves to and fro: rms of its rate over that of its way.
    pub pace_hz: f64,
    /// rms of its rate.
    pub speed: f64,
    /// rms of the noise in the rate whose sign counts.
    pub speed_noise: f64,
    /// Standard deviation of its torque; of one that is not driven, that of what its bodies exchange with it.
    pub torque: f64,
    /// The only value that its torque has, if there is one: of a joint that is not driven none.
    pub constant: Option<f64>,
    /// One-sided density of its torque's noise, as it is above all motion.
    pub hiss: f64,
    /// What of its torque is no more than its noise: the size over which the sign of a torque is smoothed.
    pub torque_noise: f64,
    /// Smallest way of the encoder that is more than its noise.
    pub angle_noise: f64,
}

/// A robot with the scales of a log.
#[derive(Clone, Debug)]
pub(crate) struct Scene<'a> {
    pub chain: &'a SerialChain,
    pub rate_hz: f64,
    /// How many there are.
    pub trials: usize,
    /// Highest frequency of any joint's motion that rises above the noise of its encoder.
    pub fastest_hz: f64,
    pub joints: Vec<JointScale>,
    /// Those of the file.
    pub bodies: Arc<Bodies>,
}

/// Logs that can be judged: the scene, and the smoothed motion of each trial; a simulator's, if there are any, are smoothed alike.
pub(crate) fn scene<'a>(chain: &'a SerialChain, trials: &[Recording], simulated: &[Recording], ports: &Ports) -> Result<(Scene<'a>, Vec<Motion>), JointsError> {
    let n = chain.joints().count();
    let first = trials.first().ok_or(JointsError::NoTrial)?;
    if ports.inputs.len() != n || ports.outputs.len() != n {
        return Err(JointsError::Channels { joints: chain.joints().names.clone(), torques: ports.inputs.len(), angles: ports.outputs.len() });
    }
    let rate_hz = first.sample_rate_hz();
    let angle = |j: usize| -> Vec<&[f64]> { trials.iter().map(|r| r.channels()[ports.outputs[j]].samples.as_slice()).collect() };
    let found: Vec<Option<MotionNoise>> = (0..n).map(|j| MotionNoise::of(&angle(j), rate_hz)).collect();
    let fastest_hz = found.iter().flatten().map(|e| e.corner_hz).fold(0.0, f64::max);
    if fastest_hz <= 0.0 {
        return Err(JointsError::Still);
    }
    let inertias = inertias(chain, trials, ports);
    let rotors = chain.inertial_parameters().split_off(TERMS_OF_A_LINK * n);
    let corners = corners(&inertias, trials, ports, &found, fastest_hz);
    let moved = |(trial, r): (usize, &Recording)| {
        let mut motion = Motion { trial, ..motion(r, ports, &corners) };
        motion.sharp = sharp(r, ports, &motion, &found);
        let rigid = inverse_dynamics(chain, &motion);
        Motion { rigid, ..motion }
    };
    let mut motions: Vec<Motion> = trials.iter().enumerate().map(moved).collect();
    within_bounds(&motions, chain)?;
    let joints = (0..n)
        .map(|j| {
            let all = |series: &dyn Fn(&Motion) -> &Vec<f64>| -> Vec<f64> { motions.iter().flat_map(|m| series(m).iter().copied()).collect() };
            let (q, v, torque) = (all(&|m| &m.q[j]), all(&|m| &m.v[j]), all(&|m| &m.torque[j]));
            let own = MotionNoise { corner_hz: corners[j], density: found[j].map_or(0.0, |e| e.density) };
            let speed = rms(&v);
            let constant = constant(trials, ports, j);
            let spread = if constant.is_some() { deviation(&all(&|m| &m.rigid[j])) } else { deviation(&torque) };
            JointScale {
                corner_hz: corners[j],
                inertia: inertias[j],
                rotor: rotors[j],
                range: [q.iter().copied().fold(f64::INFINITY, f64::min), q.iter().copied().fold(f64::NEG_INFINITY, f64::max)],
                pace_hz: speed / deviation(&q).max(f64::MIN_POSITIVE) / std::f64::consts::TAU,
                speed,
                speed_noise: (SIGN * speed).max(f64::MIN_POSITIVE),
                torque: spread,
                constant,
                hiss: hiss(trials, ports, j),
                torque_noise: (1e-2 * spread).max(f64::MIN_POSITIVE),
                angle_noise: own.rms_of_derivative(0),
            }
        })
        .collect();
    let bodies = Arc::new(Bodies::new(chain.clone(), trials.len()));
    let scene = Scene { chain, rate_hz, trials: trials.len(), fastest_hz, joints, bodies };
    let simulated: Vec<Motion> = simulated.iter().enumerate().map(moved).collect();
    within_bounds(&simulated, chain)?;
    for (motion, own) in motions.iter_mut().zip(simulated) {
        let file = scene.nominal(&own);
        motion.beyond = own.torque;
        motion.beyond.iter_mut().flatten().zip(file.iter().flatten()).for_each(|(beyond, file)| *beyond -= file);
    }
    Ok((scene, motions))
}

/// Beyond this products of torques and of what follows from angles overflow.
const LARGEST: f64 = 1e60;

/// Refuses logs that no robot makes, such as those of a simulator that swung up until it ended.
fn within_bounds(motions: &[Motion], chain: &SerialChain) -> Result<(), JointsError> {
    for (trial, motion) in motions.iter().enumerate() {
        for (j, joint) in chain.joints().names.iter().enumerate() {
            let all = [&motion.q, &motion.v, &motion.a, &motion.sharp, &motion.torque, &motion.rigid];
            if !all.iter().flat_map(|series| &series[j]).all(|x| x.abs() <= LARGEST) {
                return Err(JointsError::OutOfBounds { trial: trial + 1, joint: joint.clone() });
            }
        }
    }
    Ok(())
}

/// Each joint's inertia, the others at rest, in the middle of the movement.
fn inertias(chain: &SerialChain, trials: &[Recording], ports: &Ports) -> Vec<f64> {
    let n = ports.outputs.len();
    let mean = |c: usize| {
        let all: Vec<f64> = trials.iter().flat_map(|r| r.channels()[c].samples.iter().copied()).collect();
        all.iter().sum::<f64>() / all.len().max(1) as f64
    };
    let posture: Vec<f64> = ports.outputs.iter().map(|c| mean(*c)).collect();
    let mut mass = vec![0.0; n * n];
    chain.mass_matrix(&posture, &mut mass);
    (0..n).map(|j| mass[j * n + j]).collect()
}

fn torques<'a>(trials: &'a [Recording], ports: &Ports, j: usize) -> Vec<&'a [f64]> {
    trials.iter().map(|r| r.channels()[ports.inputs[j]].samples.as_slice()).collect()
}

/// The only value of a torque, if there is one.
fn constant(trials: &[Recording], ports: &Ports, j: usize) -> Option<f64> {
    let all = torques(trials, ports, j);
    all.iter().flat_map(|torque| torque.first()).next().copied().filter(|first| all.iter().all(|torque| torque.iter().all(|t| t == first)))
}

/// Density of a torque's noise.
fn hiss(trials: &[Recording], ports: &Ports, j: usize) -> f64 {
    effort_noise(&torques(trials, ports, j), trials[0].sample_rate_hz()).unwrap_or(0.0)
}

/// Where the motion of each joint is cut off: where the noise of its encoder, seen through the joint's inertia, overtakes that of its torque. One that is
/// not driven has no noise to be overtaken.
fn corners(inertias: &[f64], trials: &[Recording], ports: &Ports, found: &[Option<MotionNoise>], fastest_hz: f64) -> Vec<f64> {
    let of = |(j, found): (usize, &Option<MotionNoise>)| {
        let noise = found.filter(|_| constant(trials, ports, j).is_none());
        noise.map_or(fastest_hz, |noise| noise.overtakes_hz(inertias[j], hiss(trials, ports, j), trials[0].sample_rate_hz()))
    };
    found.iter().enumerate().map(of).collect()
}

/// Noise of a rate, as a share of its rms, over which its sign is smoothed: at a turn a joint sticks for some samples, and a rate that were smoothed
/// further would not see it.
const SIGN: f64 = 0.01;

/// Rates up to where their noise is that share of them.
fn sharp(recording: &Recording, ports: &Ports, motion: &Motion, found: &[Option<MotionNoise>]) -> Vec<Vec<f64>> {
    let rate_hz = recording.sample_rate_hz();
    (0..found.len())
        .map(|j| {
            let Some(encoder) = found[j] else { return motion.v[j].clone() };
            let most = RESOLVED * rate_hz / 2.0;
            let corner_hz = (3.0 * (SIGN * rms(&motion.v[j]) / std::f64::consts::TAU).powi(2) / encoder.density).cbrt();
            let [_, rate, _] = derivatives(&recording.channels()[ports.outputs[j]].samples, rate_hz, corner_hz.clamp(encoder.corner_hz.min(most), most));
            rate
        })
        .collect()
}

fn motion(recording: &Recording, ports: &Ports, corners: &[f64]) -> Motion {
    let mut out = Motion::default();
    for ((&torque, &angle), &corner_hz) in ports.inputs.iter().zip(&ports.outputs).zip(corners) {
        let [q, v, a] = derivatives(&recording.channels()[angle].samples, recording.sample_rate_hz(), corner_hz);
        out.q.push(q);
        out.v.push(v);
        out.a.push(a);
        out.torque.push(recording.channels()[torque].samples.clone());
    }
    out
}

impl Scene<'_> {
    /// The lowest corner: where the ends of a log are felt longest.
    pub fn lowest_hz(&self) -> f64 {
        self.joints.iter().map(|j| j.corner_hz).fold(f64::INFINITY, f64::min)
    }

    /// Where deflections are cut off, which are differentiated twice more than the motion: twice its fastest, the sums of two of its frequencies that
    /// weight and Coriolis forces make.
    pub fn twice_hz(&self) -> f64 {
        (2.0 * self.fastest_hz).min(RESOLVED * self.rate_hz / 2.0)
    }

    /// Whether a form may be what is wrong: a torque that is nothing throughout is known to be that, and one that never changes has neither a gain nor a time. Where it is
    /// nothing all at the joint is known up to a factor, nothing at all included: the inertia that it turns is the measure of the rest.
    pub fn may_be_wrong(&self, form: &Form) -> bool {
        let constant = |j: &usize| self.joints[*j].constant;
        let measure = |column: &Column| matches!(column, Column::Body { link: j, .. } | Column::Acceleration(j) if constant(j) == Some(0.0));
        if form.joint.is_some() && form.columns.iter().any(measure) {
            return false;
        }
        match &form.columns[..] {
            [Column::Torque(j) | Column::Falling(j)] => constant(j).is_none(),
            [Column::Constant(j)] => constant(j) != Some(0.0),
            _ => true,
        }
    }

    /// How the file's dry friction turns: where it is a soft constraint, ahead of the joint and over a speed of its own.
    pub fn own_turn(&self, joint: usize) -> Column {
        let [ahead_s, over] = self.chain.soft_friction()[joint];
        let speed = (over * self.chain.joints().coulomb[joint]).max(self.joints[joint].speed_noise);
        if ahead_s > 0.0 { Column::Soft { joint, ahead_s, speed } } else { Column::Sign(joint) }
    }

    /// Torques of the simulation, `[joint][sample]`: of the file's bodies, dry and viscous friction and springs, and what a simulator has beyond them. The file
    /// carries a simulator's torque from its own motion to the measured one, from which it differs little.
    pub fn nominal(&self, motion: &Motion) -> Vec<Vec<f64>> {
        let mut out = motion.rigid.clone();
        let Joints { coulomb, viscous, .. } = self.chain.joints();
        for (j, out) in out.iter_mut().enumerate() {
            out.iter_mut().zip(&motion.v[j]).for_each(|(t, v)| *t += viscous[j] * v);
            if coulomb[j] != 0.0 {
                let turns = self.own_turn(j).along(motion, self).swap_remove(0).1;
                out.iter_mut().zip(turns).for_each(|(t, s)| *t += coulomb[j] * s);
            }
        }
        for ((out, q), [stiffness, rest]) in out.iter_mut().zip(&motion.q).zip(self.chain.springs()) {
            out.iter_mut().zip(q).for_each(|(t, q)| *t += stiffness * (q - rest));
        }
        out.iter_mut().flatten().zip(motion.beyond.iter().flatten()).for_each(|(t, b)| *t += b);
        out
    }
}
