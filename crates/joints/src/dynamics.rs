//! Torques along a motion, sample by sample.

use crate::motion::Motion;
use ndof_devices::SerialChain;
use ndof_models::robot::Robot;

/// The smooth sign of a velocity that turns over this speed.
pub(crate) fn sign(v: f64, over: f64) -> f64 {
    (v / over).tanh()
}

/// What `torque` says of q, q̇ and q̈ at each sample, `[joint][sample]`.
pub(crate) fn each_sample(motion: &Motion, joints: usize, torque: impl Fn(&[f64], &[f64], &[f64], &mut [f64])) -> Vec<Vec<f64>> {
    let (n, samples) = (motion.q.len(), motion.q[0].len());
    let mut out = vec![vec![0.0; samples]; joints];
    let (mut q, mut v, mut a, mut t) = (vec![0.0; n], vec![0.0; n], vec![0.0; n], vec![0.0; joints]);
    for k in 0..samples {
        for j in 0..n {
            (q[j], v[j], a[j]) = (motion.q[j][k], motion.v[j][k], motion.a[j][k]);
        }
        torque(&q, &v, &a, &mut t);
        out.iter_mut().zip(&t).for_each(|(out, t)| out[k] = *t);
    }
    out
}

/// Torques of the file's bodies along a motion.
pub(crate) fn inverse_dynamics(chain: &SerialChain, motion: &Motion) -> Vec<Vec<f64>> {
    each_sample(motion, motion.q.len(), |q, v, a, out| chain.inverse_dynamics(q, v, a, out))
}
