//! The direct estimate: outputs over measured inputs.

use super::{Coherence, EstimateError, Significance, check};
use crate::hermitian::{Cholesky, eigen, scaled_condition};
use crate::labels::Labels;
use crate::ports::Ports;
use crate::response::{FrequencyResponse, Uncertainty};
use ndarray::{Array2, Array3};
use ndof_signal::CrossSpectra;
use num_complex::Complex64;
use serde::{Deserialize, Serialize};

/// Above this condition number of the scaled input matrix a bin has no estimate.
pub const LARGEST_CONDITION: f64 = 1e8;

const NAN: Complex64 = Complex64::new(f64::NAN, f64::NAN);

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
    /// H[f][p][q] with covariance.
    pub response: FrequencyResponse,
    /// Of the outputs with the inputs.
    pub coherence: Coherence,
    /// Ordinary coherence between inputs, [f][q][q].
    pub input_coherence: Array3<f64>,
    /// 2-norm condition number of S_uu scaled to unit diagonal, [f]; infinite where singular.
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
/// [`derived`](super::derived). The covariance of Hv is first order in the noise-to-signal ratio.
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
    let mut value = Array3::from_elem((bins, p, q), NAN);
    let mut noise = Array3::from_elem((bins, p, p), NAN);
    let mut input_inverse = Array3::from_elem((bins, q, q), NAN);
    let mut coherence = Coherence::nan(bins, p, q);
    let mut input_coherence = Array3::from_elem((bins, q, q), f64::NAN);
    let mut condition = vec![f64::NAN; bins];
    let mut singular_bins = Vec::new();
    let mut cholesky = Cholesky::new(q);
    let (mut scratch, mut values, mut inverse) = (vec![Complex64::default(); q * q], vec![0.0; q], vec![Complex64::default(); q * q]);
    let mut rows = vec![Complex64::default(); p * q];
    for f in usize::from(spectra.mean_removed())..bins {
        let input = |i: usize, j: usize| spectra.at(f, ports.inputs[i], ports.inputs[j]);
        condition[f] = scaled_condition(input, &mut scratch, &mut values);
        for i in 0..q {
            for j in 0..q {
                input_coherence[[f, i, j]] = input(i, j).norm_sqr() / (input(i, i).re * input(j, j).re);
            }
        }
        if !(condition[f] <= LARGEST_CONDITION && cholesky.factor(input)) {
            singular_bins.push(f);
            continue;
        }
        cholesky.inverse(&mut inverse);
        for (entry, &value) in input_inverse.index_axis_mut(ndarray::Axis(0), f).iter_mut().zip(&inverse) {
            *entry = value;
        }
        for (i, row) in rows.chunks_exact_mut(q).enumerate() {
            row.iter_mut().zip(&ports.inputs).for_each(|(r, &u)| *r = spectra.at(f, ports.outputs[i], u));
            cholesky.whiten(row);
        }
        for i in 0..p {
            for k in 0..=i {
                let explained: Complex64 = (0..q).map(|j| rows[i * q + j] * rows[k * q + j].conj()).sum();
                let rest = spectra.at(f, ports.outputs[i], ports.outputs[k]) - explained;
                let rest = if i == k { Complex64::new(rest.re.max(0.0), 0.0) } else { rest } / freedom;
                noise[[f, i, k]] = rest;
                noise[[f, k, i]] = rest.conj();
            }
        }
        for (i, row) in rows.chunks_exact_mut(q).enumerate() {
            let power = spectra.power(f, ports.outputs[i]);
            let explained: f64 = row.iter().map(|w| w.norm_sqr()).sum();
            coherence.multiple[[f, i]] = (explained / power).min(1.0);
            cholesky.unwhiten(row);
            let noise = noise[[f, i, i]].re * freedom;
            for j in 0..q {
                let alone = row[j].norm_sqr() / inverse[j * q + j].re;
                coherence.partial[[f, i, j]] = alone / (alone + noise);
                coherence.ordinary[[f, i, j]] = spectra.at(f, ports.outputs[i], ports.inputs[j]).norm_sqr() / (power * input(j, j).re);
                value[[f, i, j]] = row[j];
            }
        }
    }
    check::not_all_singular(spectra, &ports.inputs, &labels.inputs, "input", &singular_bins)?;
    Ok(DirectEstimate {
        response: FrequencyResponse {
            frequency_hz: spectra.frequency_hz().to_vec(),
            inputs: labels.inputs.clone(),
            outputs: labels.outputs.clone(),
            kind: labels.kind,
            value,
            uncertainty: Some(Uncertainty {
                noise,
                input_inverse,
                degrees_of_freedom: freedom,
                independent_spacing_hz: spectra.independent_spacing_hz(),
                kernel: spectra.kernel().clone(),
            }),
        },
        coherence,
        input_coherence,
        input_condition_number: condition,
        significance_95: Significance::at_95_percent(averages, q),
        effective_averages: averages,
        singular_bins,
    })
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
            eigen(&mut matrix, &mut values, Some(&mut vectors));
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
