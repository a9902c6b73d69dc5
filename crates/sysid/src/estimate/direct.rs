//! The direct estimate: outputs over measured inputs.

use super::{Coherence, EstimateError, Significance, check};
use crate::filling::{Filling, scatter, scatter_hermitian, scatter_real};
use crate::labels::Labels;
use crate::lanes::{Batches, LANES, LaneCholesky, Lanes, Reals, condition, dot_conj, each, lanes, lower, map, power};
use crate::ports::Ports;
use crate::response::FrequencyResponse;
use crate::uncertainty::{NAN, Uncertainty};
use ndarray::{Array2, Array3};
use ndof_linear::hermitian_eigen;
use ndof_signal::CrossSpectra;
use ndof_signal::vectorized;
use num_complex::Complex64;
use pulp::{Simd, WithSimd};
use serde::{Deserialize, Serialize};

/// Above this condition number of the scaled input matrix a bin has no estimate.
pub const LARGEST_CONDITION: f64 = 1e8;

/// Where the noise is thought to be.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Direct {
    /// In the outputs: S_yu S_uu⁻¹.
    #[default]
    H1,
    /// In the inputs: S_yy S_uy⁻¹, as many outputs as inputs.
    H2,
    /// In both, in proportion to each channel's power: total least squares of each output on the inputs, every channel
    /// scaled to unit power (for one input the geometric mean of H1 and H2).
    Hv,
}

/// Outputs over measured inputs, with everything that says how far to trust it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct DirectEstimate {
    /// `H[f][p][q]` with covariance.
    pub response: FrequencyResponse,
    /// Of the outputs with the inputs.
    pub coherence: Coherence,
    /// Ordinary coherence between inputs, `[f][q][q]`.
    pub input_coherence: Array3<f64>,
    /// 1-norm condition number of S_uu scaled to unit diagonal, `[f]`; infinite where singular. For one and two inputs it is
    /// the 2-norm one, for q inputs at most q times that.
    pub input_condition_number: Vec<f64>,
    /// What chance alone gives.
    pub significance_95: Significance,
    /// Effective averages behind it.
    pub effective_averages: f64,
    /// Indices of bins without an estimate because the inputs depend on each other there (0 Hz after mean removal is
    /// not listed).
    pub singular_bins: Vec<usize>,
}

/// The direct estimate from cross-spectra, for any number of inputs and outputs.
///
/// H1 = S_yu S_uu⁻¹, S_nn = S_yy − H S_uu Hᴴ, Cov(vec H) = (S_uu⁻¹)ᵀ ⊗ S_nn / (n_e − q).
///
/// Under feedback from the outputs to the inputs it is biased towards the negative inverse of the feedback path; see
/// [`derived`](super::derived()). The covariance of Hv is first order in the noise-to-signal ratio.
///
/// # Errors
/// [`EstimateError`] if ports and labels do not fit, there are not more effective averages than inputs, or the inputs
/// depend on each other at every frequency. At single frequencies the entries are NaN and listed.
///
/// References: Bendat & Piersol, Random Data, 4th ed. 2010, ch. 7 and 9; Rocklin, Crowley & Vold 1985 (Hv).
pub fn direct(spectra: &CrossSpectra, ports: &Ports, labels: &Labels, method: Direct) -> Result<DirectEstimate, EstimateError> {
    check::ports(spectra, ports, labels)?;
    let (p, q) = (ports.outputs.len(), ports.inputs.len());
    match method {
        Direct::H1 => h1(spectra, ports, labels),
        Direct::H2 if p != q => Err(EstimateError::NotSquare { outputs: p, inputs: q }),
        Direct::H2 => h2(spectra, ports, labels),
        Direct::Hv => hv(spectra, ports, labels),
    }
}

fn h1(spectra: &CrossSpectra, ports: &Ports, labels: &Labels) -> Result<DirectEstimate, EstimateError> {
    let (p, q, bins) = (ports.outputs.len(), ports.inputs.len(), spectra.frequency_hz().len());
    let averages = spectra.effective_averages();
    let freedom = check::degrees_of_freedom(averages, q)?;
    let mut out = Results::new(bins, p, q);
    let channels = ports.inputs.iter().chain(&ports.outputs).copied().collect();
    let singular_bins = vectorized(Solve { spectra, channels, freedom, out: &mut out, p, q });
    check::not_all_singular(spectra, &ports.inputs, &labels.inputs, "input", &singular_bins)?;
    Ok(DirectEstimate {
        response: FrequencyResponse {
            frequency_hz: spectra.frequency_hz().to_vec(),
            inputs: labels.inputs.clone(),
            outputs: labels.outputs.clone(),
            kind: labels.kind,
            value: out.value.finish(),
            uncertainty: Some(Uncertainty::of_spectra(spectra, out.noise.finish(), out.input_inverse.finish(), freedom)),
        },
        coherence: Coherence { ordinary: out.ordinary.finish(), partial: out.partial.finish(), multiple: out.multiple.finish().remove_axis(ndarray::Axis(1)) },
        input_coherence: out.input_coherence.finish(),
        input_condition_number: out.condition,
        significance_95: Significance::at_95_percent(averages, q),
        effective_averages: averages,
        singular_bins,
    })
}

/// H1 at all frequencies, as a type, so that it is compiled for the vector unit at hand; small sizes have code of their own.
struct Solve<'a> {
    spectra: &'a CrossSpectra,
    /// Inputs, then outputs.
    channels: Vec<usize>,
    freedom: f64,
    out: &'a mut Results,
    p: usize,
    q: usize,
}

impl WithSimd for Solve<'_> {
    /// Bins without an estimate.
    type Output = Vec<usize>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> Vec<usize> {
        match (self.p, self.q) {
            (1, 1) => self.with_size(1, 1),
            (2, 2) => self.with_size(2, 2),
            (p, q) => self.with_size(p, q),
        }
    }
}

impl Solve<'_> {
    #[inline(always)]
    fn with_size(self, p: usize, q: usize) -> Vec<usize> {
        let Solve { spectra, channels, freedom, out, .. } = self;
        let (bins, mut singular_bins) = (spectra.frequency_hz().len(), Vec::new());
        let mut batches = Batches::new(spectra, channels);
        let mut cholesky = LaneCholesky::new(q);
        let triangle = vec![Lanes::ZERO; q * (q + 1) / 2];
        let (mut inverse, mut scratch) = (triangle.clone(), triangle);
        let mut rows = vec![Lanes::ZERO; p * q];
        let (mut inverse_power, mut residual) = (vec![[0.0; LANES]; q], vec![[0.0; LANES]; p]);
        let first = usize::from(spectra.mean_removed());
        out.skip(first);
        for f in (first..bins).step_by(LANES) {
            let count = LANES.min(bins - f);
            let s = batches.load(f, count);
            let input = |i: usize, j: usize| s[lower(i, j)];
            let cross = |i: usize, j: usize| s[lower(q + i, j)];
            cholesky.factor(input);
            cholesky.inverse(&mut inverse, &mut scratch);
            let condition = condition(q, input, &inverse);
            out.condition.extend(condition.iter().take(count).map(|c| if c.is_nan() { f64::INFINITY } else { *c }));
            scatter_hermitian(out.input_inverse.batch(count), q, |i, j| inverse[lower(i, j)]);

            between_inputs(q, s, &mut inverse_power, out.input_coherence.batch(count));
            let ordinary = out.ordinary.batch(count);
            for i in 0..p {
                let power = each(&s[lower(q + i, q + i)].re, f64::recip);
                for j in 0..q {
                    let coherence = map(&map(&cross(i, j).norm_sqr(), &inverse_power[j], |n, p| n * p), &power, |n, p| n * p);
                    scatter_real(ordinary, p * q, i * q + j, &coherence);
                    rows[i * q + j] = cross(i, j);
                }
                cholesky.whiten(&mut rows[i * q..(i + 1) * q]);
            }
            let row = |i: usize| &rows[i * q..(i + 1) * q];
            let noise = out.noise.batch(count);
            noise_between((p, q), s, &rows, freedom, noise);
            let multiple = out.multiple.batch(count);
            for i in 0..p {
                let (full, explained) = (s[lower(q + i, q + i)].re, power(row(i)));
                let rest = map(&full, &explained, |a, b| (a - b).max(0.0));
                // f64::max hides a NaN; the share below does not.
                let rest = lanes(|l| if explained[l].is_nan() { f64::NAN } else { rest[l] });
                scatter(noise, p * p, i * p + i, &Lanes { re: each(&rest, |v| v / freedom), im: [0.0; LANES] });
                scatter_real(multiple, p, i, &map(&explained, &full, |a, b| if a > b { 1.0 } else { a / b }));
                residual[i] = rest;
            }
            let (value, partial) = (out.value.batch(count), out.partial.batch(count));
            for i in 0..p {
                let row = &mut rows[i * q..(i + 1) * q];
                cholesky.unwhiten(row);
                for (j, h) in row.iter().enumerate() {
                    scatter(value, p * q, i * q + j, h);
                    let size = h.norm_sqr();
                    let spread = map(&residual[i], &inverse[lower(j, j)].re, |n, v| n * v);
                    scatter_real(partial, p * q, i * q + j, &map(&size, &spread, |a, b| a / (a + b)));
                }
            }
            for (l, c) in condition.iter().enumerate().take(count) {
                let usable = *c <= LARGEST_CONDITION;
                if !usable {
                    singular_bins.push(f + l);
                    out.erase(f + l);
                }
            }
        }
        singular_bins
    }
}

/// Ordinary coherence between inputs; `inverse_power` becomes 1/S_jj of each.
#[inline(always)]
fn between_inputs(q: usize, s: &[Lanes], inverse_power: &mut [Reals], out: &mut [f64]) {
    for (j, inverse_power) in inverse_power.iter_mut().enumerate() {
        *inverse_power = each(&s[lower(j, j)].re, |power| 1.0 / power);
    }
    for i in 0..q {
        for j in 0..=i {
            let product = map(&inverse_power[i], &inverse_power[j], |a, b| a * b);
            let coherence = map(&s[lower(i, j)].norm_sqr(), &product, |n, p| n * p);
            scatter_real(out, q * q, i * q + j, &coherence);
            scatter_real(out, q * q, j * q + i, &coherence);
        }
    }
}

/// Noise that two different outputs share, from their whitened rows.
#[inline(always)]
fn noise_between((p, q): (usize, usize), s: &[Lanes], rows: &[Lanes], freedom: f64, out: &mut [Complex64]) {
    let share = [1.0 / freedom; LANES];
    for i in 0..p {
        for k in 0..i {
            let explained = dot_conj(&rows[i * q..(i + 1) * q], &rows[k * q..(k + 1) * q]);
            let full = s[lower(q + i, q + k)];
            let rest = Lanes { re: map(&full.re, &explained.re, |a, b| a - b), im: map(&full.im, &explained.im, |a, b| a - b) }.scaled(&share);
            scatter(out, p * p, i * p + k, &rest);
            scatter(out, p * p, k * p + i, &rest.conj());
        }
    }
}

/// The arrays of a direct estimate while they are made.
struct Results {
    value: Filling<Complex64>,
    noise: Filling<Complex64>,
    input_inverse: Filling<Complex64>,
    ordinary: Filling<f64>,
    partial: Filling<f64>,
    multiple: Filling<f64>,
    input_coherence: Filling<f64>,
    condition: Vec<f64>,
}

impl Results {
    fn new(bins: usize, p: usize, q: usize) -> Self {
        let complex = |rows: usize, columns: usize| Filling::new(bins, rows, columns, NAN);
        let real = |rows: usize, columns: usize| Filling::new(bins, rows, columns, f64::NAN);
        Results {
            value: complex(p, q),
            noise: complex(p, p),
            input_inverse: complex(q, q),
            ordinary: real(p, q),
            partial: real(p, q),
            multiple: real(1, p),
            input_coherence: real(q, q),
            condition: Vec::with_capacity(bins),
        }
    }

    /// Frequencies that have no estimate by nature.
    fn skip(&mut self, count: usize) {
        for complex in [&mut self.value, &mut self.noise, &mut self.input_inverse] {
            complex.batch(count);
        }
        for real in [&mut self.ordinary, &mut self.partial, &mut self.multiple, &mut self.input_coherence] {
            real.batch(count);
        }
        self.condition.resize(count, f64::NAN);
    }

    /// A frequency whose inputs cannot be told apart keeps what says so: coherence between inputs and condition number.
    fn erase(&mut self, f: usize) {
        for complex in [&mut self.value, &mut self.noise, &mut self.input_inverse] {
            complex.erase(f);
        }
        for real in [&mut self.ordinary, &mut self.partial, &mut self.multiple] {
            real.erase(f);
        }
    }
}

/// Inputs as a response to the outputs by H1, inverted; the coherences are those of H1, whose definition does not
/// depend on where the noise is.
fn h2(spectra: &CrossSpectra, ports: &Ports, labels: &Labels) -> Result<DirectEstimate, EstimateError> {
    let mut estimate = h1(spectra, ports, labels)?;
    let swapped = Ports { references: Vec::new(), inputs: ports.outputs.clone(), outputs: ports.inputs.clone() };
    let names = Labels { references: Vec::new(), inputs: labels.outputs.clone(), outputs: labels.inputs.clone(), kind: labels.kind };
    let backward = h1(spectra, &swapped, &names)?;
    let forward = backward.response.inverse().map_err(|_| EstimateError::NotSquare { outputs: ports.outputs.len(), inputs: ports.inputs.len() })?;
    estimate.response = FrequencyResponse { kind: labels.kind, ..forward };
    Ok(estimate)
}

fn hv(spectra: &CrossSpectra, ports: &Ports, labels: &Labels) -> Result<DirectEstimate, EstimateError> {
    let mut estimate = h1(spectra, ports, labels)?;
    let (p, q) = (ports.outputs.len(), ports.inputs.len());
    let n = q + 1;
    let (mut matrix, mut values, mut vectors) = (vec![Complex64::default(); n * n], vec![0.0; n], vec![Complex64::default(); n * n]);
    let mut channels = ports.inputs.clone();
    channels.push(ports.outputs[0]);
    let FrequencyResponse { value, uncertainty, .. } = &mut estimate.response;
    for f in 0..value.dim().0 {
        if value[[f, 0, 0]].is_nan() {
            continue;
        }
        for i in 0..p {
            channels[q] = ports.outputs[i];
            let root = |a: usize| spectra.power(f, channels[a]).sqrt();
            for a in 0..n {
                for b in 0..n {
                    matrix[a * n + b] = spectra.at(f, channels[a], channels[b]) / (root(a) * root(b));
                }
            }
            hermitian_eigen(&mut matrix, &mut values, Some(&mut vectors));
            let smallest = (0..n).min_by(|&a, &b| values[a].total_cmp(&values[b])).unwrap_or(0);
            let last = vectors[q * n + smallest];
            for j in 0..q {
                value[[f, i, j]] = -(vectors[j * n + smallest] / last).conj() * root(q) / root(j);
            }
        }
        if let Some(u) = uncertainty {
            let h = |i: usize, j: usize| value[[f, i, j]];
            let noise = Array2::from_shape_fn((p, p), |(i, k)| {
                let (yi, yk) = (ports.outputs[i], ports.outputs[k]);
                let mut sum = spectra.at(f, yi, yk);
                for j in 0..q {
                    let uj = ports.inputs[j];
                    sum -= h(i, j) * spectra.at(f, uj, yk) + spectra.at(f, yi, uj) * h(k, j).conj();
                    for l in 0..q {
                        sum += h(i, j) * spectra.at(f, uj, ports.inputs[l]) * h(k, l).conj();
                    }
                }
                sum / u.degrees_of_freedom
            });
            u.noise.index_axis_mut(ndarray::Axis(0), f).assign(&noise);
        }
    }
    Ok(estimate)
}
