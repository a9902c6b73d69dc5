//! Torques along a motion, sample by sample.

use crate::motion::Motion;
use ndof_devices::SerialChain;
use ndof_models::robot::Robot;
use rayon::prelude::*;

/// The smooth sign of a velocity that turns over this speed.
pub(crate) fn sign(v: f64, over: f64) -> f64 {
    (v / over).tanh()
}

/// Samples that a thread takes at a time.
const TOGETHER: usize = 256;

/// What `torque` says of q, q̇ and q̈ at each sample, `[joint][sample]`.
pub(crate) fn each_sample(motion: &Motion, joints: usize, torque: impl Fn(&[f64], &[f64], &[f64], &mut [f64]) + Sync) -> Vec<Vec<f64>> {
    let (n, samples) = (motion.q.len(), motion.q[0].len());
    let of = |first: usize| {
        let own = first..(first + TOGETHER).min(samples);
        let mut out = vec![vec![0.0; own.len()]; joints];
        let (mut q, mut v, mut a, mut t) = (vec![0.0; n], vec![0.0; n], vec![0.0; n], vec![0.0; joints]);
        for (at, k) in own.enumerate() {
            for j in 0..n {
                (q[j], v[j], a[j]) = (motion.q[j][k], motion.v[j][k], motion.a[j][k]);
            }
            torque(&q, &v, &a, &mut t);
            out.iter_mut().zip(&t).for_each(|(out, t)| out[at] = *t);
        }
        out
    };
    let parts: Vec<Vec<Vec<f64>>> = (0..samples).into_par_iter().step_by(TOGETHER).map(of).collect();
    (0..joints).map(|j| parts.iter().flat_map(|part| &part[j]).copied().collect()).collect()
}

/// Torques of the file's bodies along a motion.
pub(crate) fn inverse_dynamics(chain: &SerialChain, motion: &Motion) -> Vec<Vec<f64>> {
    each_sample(motion, motion.q.len(), |q, v, a, out| chain.inverse_dynamics(q, v, a, out))
}
