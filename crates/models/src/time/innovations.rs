//! What a run's error adds at each sample to what a force of the limb and the sensor's noise let one expect of it.

use super::deviations::Deviations;
use serde::{Deserialize, Serialize};
use std::f64::consts::{SQRT_2, TAU};

/// Where the noise of a fit with given force enters.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Disturbance {
    /// Where the motion is measured.
    #[default]
    Output,
    /// As a force that the limb makes, slow or not, besides white noise where the motion is measured. Its answer changes with
    /// what a nonlinear law makes of the limb at each instant, so the errors are weighted by the innovations of a Kalman filter
    /// along the run.
    Force,
}

/// A force of the limb and the noise of its sensor, one number an axis.
///
/// # References
/// L. Ljung (1999), System identification, ch. 4 and 7: the innovations form and prediction-error methods.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LimbNoise {
    /// rms force (N, N m), white noise through a Butterworth low-pass of second order.
    pub force: Vec<f64>,
    /// Its corner (Hz).
    pub corner_hz: Vec<f64>,
    /// White noise of the measured displacement (m, rad).
    pub sensor: Vec<f64>,
}

/// A time-varying filter that makes a window's errors white, and keeps their generalised variance.
pub(super) struct Innovations {
    size: usize,
    axes: usize,
    /// size × size from each sample to the next.
    steps: Vec<f64>,
    /// What an axis' innovation adds to the state, and what weights it: 1 + size numbers a sample and axis.
    gains: Vec<f64>,
}

/// Sums of one pass over a window: Σ ν²/S, Σ ln S and their number.
#[derive(Clone, Copy, Default)]
struct Sums {
    square: f64,
    log: f64,
    count: f64,
}

impl Innovations {
    /// The filter of one window for unit overall scale, with the sums of `errors` (samples × axes, m).
    fn new(deviations: &Deviations, noise: &LimbNoise, errors: &[f64], step_s: f64, keep: bool) -> (Self, Sums) {
        let (axes, own) = (noise.force.len(), deviations.size);
        let size = own + 2 * axes;
        let shapes: Vec<[f64; 4]> = noise.corner_hz.iter().map(|hz| butterworth(TAU * hz, step_s)).collect();
        let samples = errors.len() / axes;
        let mut out = Innovations { size, axes, steps: Vec::new(), gains: Vec::new() };
        let mut p = vec![0.0; size * size];
        for (i, force) in noise.force.iter().enumerate() {
            let at = own + 2 * i;
            p[at * size + at] = force * force;
            p[(at + 1) * size + at + 1] = (force * TAU * noise.corner_hz[i]).powi(2);
        }
        let stationary = p.clone();
        let (mut state, mut sums) = (vec![0.0; size], Sums::default());
        let (mut step, mut half, mut moved) = (vec![0.0; size * size], vec![0.0; size * size], vec![0.0; size]);
        for k in 0..samples {
            for i in 0..axes {
                // One axis after the other is one update by all.
                let spread = p[i * size + i] + noise.sensor[i].powi(2);
                let innovation = errors[k * axes + i] - state[i];
                sums.square += innovation * innovation / spread;
                sums.log += spread.ln();
                sums.count += 1.0;
                let column: Vec<f64> = (0..size).map(|r| p[r * size + i]).collect();
                for r in 0..size {
                    state[r] += column[r] / spread * innovation;
                    (0..size).for_each(|c| p[r * size + c] -= column[r] * column[c] / spread);
                }
                if keep {
                    out.gains.push(1.0 / spread.sqrt());
                    out.gains.extend(column.iter().map(|v| v / spread));
                }
            }
            if k + 1 == samples {
                break;
            }
            step.fill(0.0);
            let (phi, gamma) = (&deviations.phi[k * own * own..(k + 1) * own * own], &deviations.gamma[k * own * axes..(k + 1) * own * axes]);
            (0..own).for_each(|r| step[r * size..r * size + own].copy_from_slice(&phi[r * own..(r + 1) * own]));
            for (i, shape) in shapes.iter().enumerate() {
                let at = own + 2 * i;
                for r in 0..2 {
                    (0..2).for_each(|c| step[(at + r) * size + at + c] = shape[2 * r + c]);
                }
                // The force at its mean over the sample: half of it is what it was.
                for r in 0..own {
                    step[r * size + at] = 0.5 * gamma[r * axes + i] * (1.0 + shape[0]);
                    step[r * size + at + 1] = 0.5 * gamma[r * axes + i] * shape[1];
                }
            }
            (0..size).for_each(|r| moved[r] = (0..size).map(|c| step[r * size + c] * state[c]).sum());
            state.copy_from_slice(&moved);
            product(&step, &p, &mut half, size, false);
            product(&half, &step, &mut p, size, true);
            for (i, shape) in shapes.iter().enumerate() {
                let at = own + 2 * i;
                // What is new in the force keeps it as large as it is.
                let entry = |r: usize, c: usize| stationary[(at + r) * size + at + c];
                let new = |r: usize, c: usize| entry(r, c) - shape[2 * r] * entry(0, 0) * shape[2 * c] - shape[2 * r + 1] * entry(1, 1) * shape[2 * c + 1];
                let spread = [new(0, 0), new(0, 1), new(1, 1)];
                let by = |r: usize| if r < own { 0.5 * gamma[r * axes + i] } else { f64::from(u8::from(r == at)) };
                for r in 0..size {
                    let (a, b) = (by(r), f64::from(u8::from(r == at + 1)));
                    for c in 0..size {
                        let (d, e) = (by(c), f64::from(u8::from(c == at + 1)));
                        p[r * size + c] += a * d * spread[0] + (a * e + b * d) * spread[1] + b * e * spread[2];
                    }
                }
            }
            if keep {
                out.steps.extend_from_slice(&step);
            }
        }
        (out, sums)
    }

    /// Replaces rows (each `width` long, axes interleaved, axis i divided by `sigma[i]`) by what is new in them.
    pub(super) fn apply(&self, rows: &mut [f64], width: usize, sigma: &[f64]) {
        let (size, axes) = (self.size, self.axes);
        let (mut state, mut next) = (vec![0.0; size * width], vec![0.0; size * width]);
        for (k, sample) in rows.chunks_exact_mut(axes * width).enumerate() {
            for (i, row) in sample.chunks_exact_mut(width).enumerate() {
                let gains = &self.gains[(k * axes + i) * (1 + size)..(k * axes + i + 1) * (1 + size)];
                row.iter_mut().zip(&state[i * width..(i + 1) * width]).for_each(|(v, s)| *v = *v * sigma[i] - s);
                for (own, gain) in state.chunks_exact_mut(width).zip(&gains[1..]) {
                    own.iter_mut().zip(row.iter()).for_each(|(s, v)| *s += gain * v);
                }
                row.iter_mut().for_each(|v| *v *= gains[0] / sigma[i]);
            }
            let Some(step) = self.steps.get(k * size * size..(k + 1) * size * size) else { break };
            next.fill(0.0);
            for (out, factors) in next.chunks_exact_mut(width).zip(step.chunks_exact(size)) {
                for (source, factor) in state.chunks_exact(width).zip(factors).filter(|(_, f)| **f != 0.0) {
                    out.iter_mut().zip(source).for_each(|(o, s)| *o += factor * s);
                }
            }
            std::mem::swap(&mut state, &mut next);
        }
    }
}

/// The noise that makes the windows' errors (samples × axes, m) most likely, by a search along given directions: a cost counts as much as a
/// fit's step, and to a tenth, which is all that the weights need, a few dozen of them do.
pub(super) fn most_likely(windows: &[(Deviations, Vec<f64>)], start: LimbNoise, step_s: f64) -> LimbNoise {
    let axes = start.force.len();
    let at = |logs: &[f64]| LimbNoise {
        force: logs[..axes].iter().map(|v| v.exp()).collect(),
        corner_hz: logs[axes..2 * axes].iter().map(|v| v.exp()).collect(),
        sensor: logs[2 * axes..].iter().map(|v| v.exp()).collect(),
    };
    let cost = |logs: &[f64]| {
        let noise = at(logs);
        if noise.corner_hz.iter().any(|hz| *hz * step_s > 0.25 || *hz * step_s < 1e-5) {
            return f64::INFINITY;
        }
        let sums = windows.iter().map(|(d, e)| Innovations::new(d, &noise, e, step_s, false).1);
        sums.map(|s| s.square + s.log).sum::<f64>()
    };
    let mut logs: Vec<f64> = start.force.iter().chain(&start.corner_hz).chain(&start.sensor).map(|v| v.max(f64::MIN_POSITIVE).ln()).collect();
    let mut least = cost(&logs);
    // Each by itself, and force and corner together, which the data tell apart least.
    let mut directions: Vec<(Vec<f64>, f64)> = Vec::new();
    for axis in 0..axes {
        for (force, corner, sensor) in [(1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0), (1.0, 1.0, 0.0), (1.0, -1.0, 0.0)] {
            let mut direction = vec![0.0; logs.len()];
            (direction[axis], direction[axes + axis], direction[2 * axes + axis]) = (force, corner, sensor);
            directions.push((direction, LONGEST));
        }
    }
    while directions.iter().any(|(_, stride)| stride.abs() > SHORTEST) {
        for (direction, stride) in &mut directions {
            let moved: Vec<f64> = logs.iter().zip(direction.iter()).map(|(v, d)| v + *stride * d).collect();
            let found = cost(&moved);
            if found < least {
                (least, logs) = (found, moved);
                *stride *= 1.5;
            } else {
                *stride *= -0.5;
            }
        }
    }
    at(&logs)
}

/// First and last stride of the search, in logarithms: a tenth in the noise costs a thousandth in the errors.
const LONGEST: f64 = 1.4;
const SHORTEST: f64 = 0.1;

/// The filters of all windows, scaled so that they change no volume.
pub(super) fn filters(windows: &[(Deviations, Vec<f64>)], noise: &LimbNoise, step_s: f64) -> Vec<Innovations> {
    let (mut filters, sums): (Vec<Innovations>, Vec<Sums>) = windows.iter().map(|(d, e)| Innovations::new(d, noise, e, step_s, true)).unzip();
    let (log, count) = sums.iter().fold((0.0, 0.0), |(l, c), s| (l + s.log, c + s.count));
    let scale = (0.5 * log / f64::max(count, 1.0)).exp();
    for filter in &mut filters {
        let wide = 1 + filter.size;
        filter.gains.iter_mut().step_by(wide).for_each(|g| *g *= scale);
    }
    filters
}

/// One step of ẅ + √2 ω ẇ + ω² w = 0 by Cayley's rule, which keeps the stationary covariance positive.
fn butterworth(omega: f64, step_s: f64) -> [f64; 4] {
    let h = 0.5 * step_s;
    // (I − hA)⁻¹ = [[1 + h√2ω, h], [−hω², 1]]/d
    let (damp, stiff) = (h * SQRT_2 * omega, h * omega * omega);
    let d = 1.0 + damp + h * stiff;
    [(1.0 + damp - h * stiff) / d, 2.0 * h / d, -2.0 * stiff / d, (1.0 - damp - h * stiff) / d]
}

/// out = a b, or a bᵀ.
fn product(a: &[f64], b: &[f64], out: &mut [f64], size: usize, transposed: bool) {
    out.fill(0.0);
    for r in 0..size {
        let row = &mut out[r * size..(r + 1) * size];
        for k in 0..size {
            let factor = a[r * size + k];
            if transposed {
                row[k] = a[r * size..(r + 1) * size].iter().zip(&b[k * size..(k + 1) * size]).map(|(x, y)| x * y).sum();
            } else if factor != 0.0 {
                row.iter_mut().zip(&b[k * size..(k + 1) * size]).for_each(|(o, v)| *o += factor * v);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Axis;
    use crate::time::Mechanism;

    /// Errors of a linear limb, made with eight steps a sample by Heun's rule.
    fn errors(noise: &LimbNoise, samples: usize, step_s: f64) -> Vec<f64> {
        let mut seed = 7u64;
        let mut uniform = || {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (seed >> 11) as f64 / (1u64 << 53) as f64
        };
        let mut normal = || (0..12).map(|_| uniform()).sum::<f64>() - 6.0;
        let (h, omega) = (step_s / 8.0, TAU * noise.corner_hz[0]);
        // A Butterworth's variance under white noise of intensity q is q/(2√2 ω³) of ω⁴.
        let intensity = noise.force[0] * (2.0 * SQRT_2 / omega).sqrt() / h.sqrt();
        let (mut y, mut out) = ([0.0f64; 4], Vec::new());
        for k in 0..8 * (samples + 400) {
            let white = intensity * normal();
            let rate = |y: &[f64; 4]| [y[1], (y[2] - 14.0 * y[1] - 300.0 * y[0]) / 2.0, y[3], omega * (omega * (white - y[2]) - SQRT_2 * y[3])];
            let a = rate(&y);
            let b = rate(&std::array::from_fn(|i| y[i] + h * a[i]));
            y = std::array::from_fn(|i| y[i] + 0.5 * h * (a[i] + b[i]));
            if k >= 3200 && k % 8 == 0 {
                out.push(y[0] + noise.sensor[0] * normal());
            }
        }
        out
    }

    #[test]
    fn the_most_likely_noise_is_what_was_made_and_innovations_are_white_and_keep_the_volume() {
        let truth = LimbNoise { force: vec![0.05], corner_hz: vec![2.0], sensor: vec![1e-4] };
        let (samples, step_s) = (4000, 0.005);
        let errors = errors(&truth, samples, step_s);
        let mechanism = Mechanism::new(vec![Axis::linear("x")]);
        let deviations = Deviations::along(&mechanism, &[2.0, 14.0, 300.0], &[vec![0.0; samples]], step_s);
        let windows = [(deviations, errors.clone())];
        let start = LimbNoise { force: vec![0.3], corner_hz: vec![0.5], sensor: vec![1e-3] };
        let found = most_likely(&windows, start, step_s);
        // Forty cycles of 2 Hz and 4000 samples: scatters of 0.11 and 0.011, four of them; a stride of the search besides.
        let apart = |a: &[f64], b: &[f64]| (a[0] / b[0]).ln().abs();
        assert!(apart(&found.force, &truth.force) < 0.55 && apart(&found.corner_hz, &truth.corner_hz) < 0.55, "{found:?}");
        assert!(apart(&found.sensor, &truth.sensor) < 0.15, "{found:?}");
        let filters = filters(&windows, &found, step_s);
        let mut rows = errors;
        filters[0].apply(&mut rows, 1, &[1.0]);
        let power: f64 = rows.iter().map(|v| v * v).sum();
        for lag in 1..20 {
            let share = rows.iter().zip(&rows[lag..]).map(|(a, b)| a * b).sum::<f64>() / power;
            assert!(share.abs() < 4.0 / (samples as f64).sqrt(), "{lag}: {share}");
        }
        let log: f64 = filters[0].gains.iter().step_by(1 + filters[0].size).map(|g| g.ln()).sum();
        assert!(log.abs() < 1e-9 * samples as f64, "{log}");
    }
}
