//! How strong an effect is in a recording: by the same recording without it, and least squares that know nothing of the diagnosis.

use super::{Case, FS, Made, Plant, make};
use ndof_signal::forward_transform;
use num_complex::Complex64;
use std::f64::consts::{PI, TAU};

/// Size of what is hidden.
#[derive(Clone, Copy, Debug, Default)]
pub struct Strength {
    /// Share of the linear model's residual power that is there only with the effect.
    pub share: f64,
    /// Root of that power over the effort's.
    pub size: f64,
}

/// Compares a case with its twin without effects and imperfections, on the axis that they sit on.
pub fn strength(case: &Case, made: &Made) -> Strength {
    let twin = make(&Case { hidden: vec![], background: false, ..case.clone() });
    let (with, effort) = residual(case, made);
    let (without, _) = residual(case, &twin);
    let more = (with - without).max(0.0);
    let size = (more / effort.max(f64::MIN_POSITIVE)).sqrt();
    Strength { share: more / with.max(f64::MIN_POSITIVE), size: if tolerated(case, made) { 0.0 } else { size } }
}

/// Whether all that is hidden lies within what instruments are allowed: a delay or filter below 0.8 ms and an angle below 2° (four
/// standard deviations of the priors; times are longer for slower experiments), steps whose rounding is below 1 % of the rms.
fn tolerated(case: &Case, made: &Made) -> bool {
    let late = 0.8e-3 * 12.0 / case.plant.band_hz();
    !case.hidden.is_empty()
        && case.hidden.iter().zip(&made.truth).all(|(hidden, truth)| match (hidden.name, truth.first()) {
            ("measurement-delay", Some((_, delay))) => *delay < late,
            ("channel-filter", Some((_, cutoff))) => 1.0 / (TAU * cutoff) < late,
            ("sensor-misalignment", Some((_, angle))) => angle.abs() < 2f64.to_radians(),
            ("quantisation", Some((_, step))) => {
                let x = &made.recordings[0].channels()[made.ports.outputs[made.axis]].samples;
                let mean = x.iter().sum::<f64>() / x.len() as f64;
                let rms = (x.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / x.len() as f64).sqrt();
                step / 12f64.sqrt() < 0.01 * rms
            }
            _ => false,
        })
}

/// Residual power of effort = M a + B v + K x with a symmetric M, by least squares in the frequency domain, and the effort's power:
/// both on the hidden axis, or on all axes where what is hidden has none.
fn residual(case: &Case, made: &Made) -> (f64, f64) {
    let n = case.plant.axes();
    let everywhere = case.hidden.iter().any(|h| h.name == "sensor-misalignment");
    let (mut left, mut all) = (0.0, 0.0);
    for recording in &made.recordings {
        let samples = recording.len();
        let forward = forward_transform(samples);
        let spectrum = |channel: usize| -> Vec<Complex64> {
            let x = &recording.channels()[channel].samples;
            let mean = x.iter().sum::<f64>() / samples as f64;
            let mut buffer: Vec<f64> = x.iter().enumerate().map(|(k, v)| (v - mean) * (PI * (k as f64 + 0.5) / samples as f64).sin().powi(2)).collect();
            let mut out = forward.make_output_vec();
            forward.process(&mut buffer, &mut out).expect("a series of the right length");
            out
        };
        let df = FS / samples as f64;
        let lines = (0.1 / df).ceil() as usize..(case.plant.band_hz() / df) as usize;
        let count = lines.len();
        let (efforts, motions) =
            if case.plant == Plant::Motion { (&made.ports.outputs, &made.ports.inputs) } else { (&made.ports.inputs, &made.ports.outputs) };
        let power = |v: &[Complex64]| v.iter().map(|v| v.norm_sqr()).sum::<f64>();
        let mut rest: Vec<Complex64> = efforts.iter().flat_map(|c| spectrum(*c)[lines.clone()].to_vec()).collect();
        let size: Vec<f64> = rest.chunks(count).map(|part| power(part).sqrt()).collect();
        rest.iter_mut().enumerate().for_each(|(k, v)| *v /= size[k / count]);
        let x: Vec<Vec<Complex64>> = motions.iter().map(|c| spectrum(*c)).collect();
        let s = |k: usize| Complex64::new(0.0, TAU * k as f64 * df);
        let mut columns: Vec<Vec<Complex64>> = Vec::new();
        for (i, j, order) in (0..n).flat_map(|i| (0..n).flat_map(move |j| (0..3).map(move |order| (i, j, order)))) {
            if order == 2 && j < i {
                continue;
            }
            let mut column = vec![Complex64::ZERO; n * count];
            for (row, from) in if order == 2 && i != j { vec![(i, j), (j, i)] } else { vec![(i, j)] } {
                lines.clone().enumerate().for_each(|(q, k)| column[row * count + q] += x[from][k] * s(k).powi(order) / size[row]);
            }
            columns.push(column);
        }
        // Orthogonal columns one after the other (modified Gram and Schmidt), twice for accuracy.
        let dot = |a: &[Complex64], b: &[Complex64]| a.iter().zip(b).map(|(a, b)| a.re * b.re + a.im * b.im).sum::<f64>();
        let mut basis: Vec<Vec<Complex64>> = Vec::new();
        for mut column in columns {
            for _ in 0..2 {
                for b in &basis {
                    let w = dot(b, &column);
                    column.iter_mut().zip(b).for_each(|(c, b)| *c -= b * w);
                }
            }
            let length = dot(&column, &column).sqrt();
            if length > 0.0 {
                column.iter_mut().for_each(|c| *c /= length);
                basis.push(column);
            }
        }
        for b in &basis {
            let w = dot(b, &rest);
            rest.iter_mut().zip(b).for_each(|(r, b)| *r -= b * w);
        }
        let rows = if everywhere { 0..n * count } else { made.axis * count..(made.axis + 1) * count };
        left += power(&rest[rows]) * size[made.axis].powi(2);
        all += size[made.axis].powi(2) * if everywhere { n as f64 } else { 1.0 };
    }
    (left, all)
}
