//! Motion of a linear limb from forces, by its compliance on the spectrum of the whole record.

use ndof_signal::{forward_transform, inverse_transform};
use num_complex::Complex64;

/// Motion of each axis; `compliance` of a frequency's number has rows for motions and columns for forces, one row after the other.
pub fn driven(force: &[Vec<f64>], compliance: impl Fn(usize) -> Vec<Complex64>) -> Option<Vec<Vec<f64>>> {
    let (axes, samples) = (force.len(), force.first()?.len());
    let (forward, back) = (forward_transform(samples), inverse_transform(samples));
    let mut forces = Vec::new();
    for channel in force {
        let mut spectrum = forward.make_output_vec();
        forward.process(&mut channel.clone(), &mut spectrum).ok()?;
        forces.push(spectrum);
    }
    let compliances: Vec<Vec<Complex64>> = (0..samples / 2 + 1).map(compliance).collect();
    let of_axis = |i: usize| {
        let mut spectrum: Vec<Complex64> = compliances.iter().enumerate().map(|(f, c)| (0..axes).map(|j| c[i * axes + j] * forces[j][f]).sum()).collect();
        spectrum[0].im = 0.0;
        spectrum[samples / 2].im = 0.0;
        let mut motion = back.make_output_vec();
        back.process(&mut spectrum, &mut motion).ok()?;
        Some(motion.iter().map(|x| x / samples as f64).collect())
    };
    (0..axes).map(of_axis).collect()
}
