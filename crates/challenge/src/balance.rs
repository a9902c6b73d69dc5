//! What inertia, damping and stiffness leave of a recording's efforts: least squares in the frequency domain.

use super::laws::eliminated;
use super::{Case, Made, Plant};
use ndof_signal::{Quantity, Recording, forward_transform, spectrum_by};
use num_complex::Complex64;
use std::f64::consts::{PI, TAU};

/// Powers of what is left and of all that there is, of effort and of predicted output.
#[derive(Clone, Copy, Debug, Default)]
pub struct Left {
    /// Residual power of effort = M a + B v + K x,
    pub effort: f64,
    /// of the effort itself,
    pub all_effort: f64,
    /// of that residual through the true compliance (of the residual itself where the motion is given),
    pub output: f64,
    /// and of the output itself.
    pub all_output: f64,
}

/// Lines of a recording within the band: of efforts `[axis][line]`, and of displacement, velocity and acceleration `[axis][order][line]`.
struct Lines {
    hz: Vec<f64>,
    effort: Vec<Vec<Complex64>>,
    motion: Vec<[Vec<Complex64>; 3]>,
}

fn power(v: &[Complex64]) -> f64 {
    v.iter().map(|v| v.norm_sqr()).sum()
}

/// Residuals of all recordings of a case with a symmetric M of its own each, on the hidden axis or on all.
pub fn left(case: &Case, made: &Made, everywhere: bool) -> Left {
    let mut sum = Left::default();
    for recording in &made.recordings {
        let lines = lines(case, made, recording);
        let rest = residual(&lines);
        let n = lines.effort.len();
        let axes = if everywhere { 0..n } else { made.axis..made.axis + 1 };
        let predicted = if case.plant == Plant::Motion { rest.clone() } else { through(&rest, &lines.hz, made) };
        let output = |i: usize| if case.plant == Plant::Motion { power(&lines.effort[i]) } else { power(&lines.motion[i][0]) };
        for i in axes {
            sum.effort += power(&rest[i]);
            sum.all_effort += power(&lines.effort[i]);
            sum.output += power(&predicted[i]);
            sum.all_output += output(i);
        }
    }
    sum
}

fn lines(case: &Case, made: &Made, recording: &Recording) -> Lines {
    let samples = recording.len();
    let forward = forward_transform(samples);
    let df = recording.sample_rate_hz() / samples as f64;
    // A mass without a spring is predicted over 2 s at most, which sees nothing slower than that; what drifts is as slow as the trial.
    let slow = case.hidden.iter().any(|h| h.name.contains("drift"));
    let first = if case.plant == Plant::Mass { 0.5 } else { 0.1 };
    let (first, last) = (if slow { df } else { first }, case.plant.band_hz().min(0.4 * recording.sample_rate_hz()));
    let range = (first / df).ceil() as usize..(last / df) as usize;
    let hz: Vec<f64> = range.clone().map(|k| k as f64 * df).collect();
    let (phase, rate) = (PI / samples as f64, TAU * recording.sample_rate_hz() / samples as f64);
    // The Hann window and its derivatives by time.
    let window = |order: usize, k: usize| match order {
        0 => (phase * (k as f64 + 0.5)).sin().powi(2),
        1 => 0.5 * rate * (2.0 * phase * (k as f64 + 0.5)).sin(),
        _ => 0.5 * rate * rate * (2.0 * phase * (k as f64 + 0.5)).cos(),
    };
    let spectrum = |channel: usize, order: usize| -> Vec<Complex64> {
        let x = &recording.channels()[channel].samples;
        let mean = x.iter().sum::<f64>() / samples as f64;
        let mut buffer: Vec<f64> = x.iter().enumerate().map(|(k, v)| (v - mean) * window(order, k)).collect();
        spectrum_by(forward.as_ref(), &mut buffer)[range.clone()].to_vec()
    };
    // Nothing leaks: F{w x'} = s F{w x} - F{w' x}, and F{w x''} = s² F{w x} - 2 s F{w' x} + F{w'' x}.
    let orders = |channel: usize| -> [Vec<Complex64>; 3] {
        let (plain, once, twice) = (spectrum(channel, 0), spectrum(channel, 1), spectrum(channel, 2));
        let by = |f: &dyn Fn(usize, Complex64) -> Complex64| -> Vec<Complex64> {
            hz.iter().enumerate().map(|(q, hz)| f(q, Complex64::new(0.0, TAU * hz))).collect()
        };
        let (same, first) = (by(&|q, _| plain[q]), by(&|q, s| s * plain[q] - once[q]));
        let (half, integral) = (by(&|q, s| plain[q] / s / s), by(&|q, s| plain[q] / s));
        match recording.channels()[channel].unit.quantity() {
            Quantity::Velocity => [integral, same, first],
            Quantity::Acceleration => [half, integral, same],
            _ => [same, first, by(&|q, s| s * s * plain[q] - 2.0 * s * once[q] + twice[q])],
        }
    };
    let effort = made.effort(case.plant).iter().map(|c| spectrum(*c, 0)).collect();
    let motion = made.motion(case.plant).iter().map(|c| orders(*c)).collect();
    Lines { effort, motion, hz }
}

/// What the best M, B and K leave, by axis and line; rows are weighted by their efforts' sizes.
fn residual(lines: &Lines) -> Vec<Vec<Complex64>> {
    let (n, count) = (lines.effort.len(), lines.hz.len());
    let size: Vec<f64> = lines.effort.iter().map(|f| power(f).sqrt()).collect();
    let mut rest: Vec<Complex64> = lines.effort.iter().zip(&size).flat_map(|(f, size)| f.iter().map(move |v| v / size)).collect();
    let dot = |a: &[Complex64], b: &[Complex64]| a.iter().zip(b).map(|(a, b)| a.re * b.re + a.im * b.im).sum::<f64>();
    // Orthogonal columns one after the other (modified Gram and Schmidt), twice for accuracy.
    let mut basis: Vec<Vec<Complex64>> = Vec::new();
    for (i, j, order) in (0..n).flat_map(|i| (0..n).flat_map(move |j| (0..3).map(move |order| (i, j, order)))) {
        if order == 2 && j < i {
            continue;
        }
        let mut column = vec![Complex64::ZERO; n * count];
        for (row, from) in if order == 2 && i != j { vec![(i, j), (j, i)] } else { vec![(i, j)] } {
            for (q, line) in lines.motion[from][order].iter().enumerate() {
                column[row * count + q] += line / size[row];
            }
        }
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
    rest.chunks(count).zip(&size).map(|(part, size)| part.iter().map(|v| v * size).collect()).collect()
}

/// What a force makes of the true linear plant's displacement.
fn through(force: &[Vec<Complex64>], hz: &[f64], made: &Made) -> Vec<Vec<Complex64>> {
    let n = force.len();
    let mut out = vec![Vec::with_capacity(hz.len()); n];
    for (q, f) in hz.iter().enumerate() {
        let s = Complex64::new(0.0, TAU * f);
        let row = |i: usize| (0..n).map(move |j| s * s * made.mass[i][j] + s * made.damping[i][j] + made.stiffness[i][j]);
        let moved = eliminated((0..n).map(|i| row(i).chain([force[i][q]]).collect()).collect());
        out.iter_mut().zip(moved).for_each(|(out, moved)| out.push(moved[0]));
    }
    out
}
