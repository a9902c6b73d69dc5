//! The robot, what its file says of it, and what is known of a log before anything is tried.

use crate::JointsError;
use crate::column::{inverse_dynamics, sign};
use crate::motion::{Encoder, Motion, encoder, smooth};
use ndof_devices::SerialChain;
use ndof_models::robot::{Joints, Robot};
use ndof_signal::Recording;
use ndof_sysid::Ports;

/// What is known of a joint over all that is fitted.
#[derive(Clone, Copy, Debug)]
pub(crate) struct JointScale {
    /// Least and greatest angle.
    pub range: [f64; 2],
    /// rms of its rate.
    pub speed: f64,
    /// rms of the noise in its smoothed rate.
    pub speed_noise: f64,
    /// Standard deviation of its torque.
    pub torque: f64,
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
    /// Highest frequency at which every joint that moves rises above the noise of its encoder.
    pub corner_hz: f64,
    pub joints: Vec<JointScale>,
}

/// Logs that can be judged: the scene, and the smoothed motion of each trial.
pub(crate) fn scene<'a>(chain: &'a SerialChain, trials: &[Recording], ports: &Ports) -> Result<(Scene<'a>, Vec<Motion>), JointsError> {
    let n = chain.joints().count();
    let first = trials.first().ok_or(JointsError::NoTrial)?;
    if ports.inputs.len() != n || ports.outputs.len() != n {
        return Err(JointsError::Channels { joints: chain.joints().names.clone(), torques: ports.inputs.len(), angles: ports.outputs.len() });
    }
    let rate_hz = first.sample_rate_hz();
    let angle = |j: usize| -> Vec<&[f64]> { trials.iter().map(|r| r.channels()[ports.outputs[j]].samples.as_slice()).collect() };
    let found: Vec<Option<Encoder>> = (0..n).map(|j| encoder(&angle(j), rate_hz)).collect();
    let corner_hz = found.iter().flatten().map(|e| e.corner_hz).fold(f64::INFINITY, f64::min);
    if !corner_hz.is_finite() {
        return Err(JointsError::Still);
    }
    let motions: Vec<Motion> = trials
        .iter()
        .map(|r| {
            let motion = motion(r, ports, corner_hz);
            let rigid = inverse_dynamics(chain, &motion);
            Motion { rigid, ..motion }
        })
        .collect();
    let joints = (0..n)
        .map(|j| {
            let all = |series: &dyn Fn(&Motion) -> &Vec<f64>| -> Vec<f64> { motions.iter().flat_map(|m| series(m).iter().copied()).collect() };
            let (q, v, torque) = (all(&|m| &m.q[j]), all(&|m| &m.v[j]), all(&|m| &m.torque[j]));
            let own = Encoder { corner_hz, noise: found[j].map_or(0.0, |e| e.noise) };
            let speed = rms(&v);
            let deviation = deviation(&torque);
            JointScale {
                range: [q.iter().copied().fold(f64::INFINITY, f64::min), q.iter().copied().fold(f64::NEG_INFINITY, f64::max)],
                speed,
                // Below a thousandth of the speed the sign of a velocity is as sharp as any log shows it.
                speed_noise: own.noise_of(1).max(1e-3 * speed).max(f64::MIN_POSITIVE),
                torque: deviation,
                torque_noise: (1e-2 * deviation).max(f64::MIN_POSITIVE),
                angle_noise: own.noise_of(0),
            }
        })
        .collect();
    Ok((Scene { chain, rate_hz, corner_hz, joints }, motions))
}

fn motion(recording: &Recording, ports: &Ports, corner_hz: f64) -> Motion {
    let mut out = Motion::default();
    for (&torque, &angle) in ports.inputs.iter().zip(&ports.outputs) {
        let [q, v, a] = smooth(&recording.channels()[angle].samples, recording.sample_rate_hz(), corner_hz);
        out.q.push(q);
        out.v.push(v);
        out.a.push(a);
        out.torque.push(recording.channels()[torque].samples.clone());
    }
    out
}

impl Scene<'_> {
    /// Torques of all that the file says: bodies, dry and viscous friction, `[joint][sample]`.
    pub fn nominal(&self, motion: &Motion) -> Vec<Vec<f64>> {
        let mut out = motion.rigid.clone();
        let Joints { coulomb, viscous, .. } = self.chain.joints();
        for (j, out) in out.iter_mut().enumerate() {
            let noise = self.joints[j].speed_noise;
            out.iter_mut().zip(&motion.v[j]).for_each(|(t, v)| *t += coulomb[j] * sign(*v, noise) + viscous[j] * v);
        }
        out
    }
}

pub(crate) fn rms(x: &[f64]) -> f64 {
    (x.iter().map(|x| x * x).sum::<f64>() / x.len().max(1) as f64).sqrt()
}

/// Standard deviation.
pub(crate) fn deviation(x: &[f64]) -> f64 {
    let mean = x.iter().sum::<f64>() / x.len().max(1) as f64;
    (x.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / x.len().max(1) as f64).sqrt()
}
