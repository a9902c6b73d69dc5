//! The derived (joint input-output, instrumental-variable) estimate, unbiased under feedback.

use super::coherence::imply;
use super::direct::LARGEST_CONDITION;
use super::{Coherence, EstimateError, check};
use crate::hermitian::{Cholesky, eigen, scaled_condition};
use crate::labels::Labels;
use crate::ports::Ports;
use crate::response::{FrequencyResponse, ResponseKind, Uncertainty};
use ndarray::{Array2, Array3};
use ndof_signal::CrossSpectra;
use num_complex::Complex64;
use serde::{Deserialize, Serialize};

const NAN: Complex64 = Complex64::new(f64::NAN, f64::NAN);

/// Below this strength of the instrument the estimate is biased towards the direct one, and its intervals are too
/// narrow.
pub const WEAK_INSTRUMENT: f64 = 10.0;

/// Both halves of a derived estimate: what the reference does to outputs and inputs.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ToReference {
    /// R = S_yr S_rr⁻¹, [f][p][q_r].
    pub r: FrequencyResponse,
    /// T = S_ur S_rr⁻¹, [f][q][q_r].
    pub t: FrequencyResponse,
    /// Multiple coherence of the references with each output, [f][p]: the quality of R.
    pub output_coherence: Array2<f64>,
    /// Multiple coherence of the references with each input, [f][q]: the quality of T.
    pub input_coherence: Array2<f64>,
}

/// Outputs over inputs by way of the references, with everything that says how far to trust it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct DerivedEstimate {
    /// C = R T⁻¹ with covariance.
    pub response: FrequencyResponse,
    /// R and T.
    pub to_reference: ToReference,
    /// With the paper's assumption that the output noise is that of the direct estimate: optimistic under feedback.
    pub coherence_paper: Coherence,
    /// With the noise of the equation that was solved, and the part of the inputs that the references caused.
    pub coherence_iv: Coherence,
    /// Smallest eigenvalue of N^(−½) S^c_uu N^(−½) (n_e − q_r)/q_r, N = S_uu − S^c_uu (Cragg & Donald 1993), [f].
    pub instrument_strength: Vec<f64>,
    /// Whether at this frequency that strength, or n_e γ²/(1 − γ²) of any one input with the references, is below
    /// [`WEAK_INSTRUMENT`], [f].
    pub weak_instrument: Vec<bool>,
    /// Indices of bins without an estimate (0 Hz after mean removal is not listed).
    pub singular_bins: Vec<usize>,
}

/// The derived estimate from cross-spectra, for at least as many references as inputs.
///
/// C = R T⁻¹ = S_yr S_ur⁻¹; with more references than inputs two-stage least squares,
/// C = S_yr S_rr⁻¹ S_ru (S^c_uu)⁻¹, S^c_uu = S_ur S_rr⁻¹ S_ru. With A = [I, −C] and Σ the spectrum of [y; u] that the
/// references do not explain, S_εε = A Σ Aᴴ and Cov(vec C) = (S^c_uu)⁻ᵀ ⊗ S_εε / (n_e − q_r).
///
/// # Errors
/// [`EstimateError`] if ports and labels do not fit, there are fewer references than inputs, not more effective
/// averages than references, or references depend on each other at every frequency.
///
/// References: Palazzolo et al., IEEE TNSRE 15(1), 2007; Pintelon & Schoukens, System Identification, 2nd ed. 2012,
/// ch. 2.
pub fn derived(spectra: &CrossSpectra, ports: &Ports, labels: &Labels) -> Result<DerivedEstimate, EstimateError> {
    check::ports(spectra, ports, labels)?;
    let (p, q, qr, bins) = (ports.outputs.len(), ports.inputs.len(), ports.references.len(), spectra.frequency_hz().len());
    if qr < q {
        return Err(EstimateError::TooFewReferences { references: qr, inputs: q });
    }
    let averages = spectra.effective_averages();
    let freedom = check::degrees_of_freedom(averages, qr)?;
    let m = p + q;
    let responders: Vec<usize> = ports.outputs.iter().chain(&ports.inputs).copied().collect();

    let complex = |rows: usize, columns: usize| Array3::from_elem((bins, rows, columns), NAN);
    let (mut value, mut r, mut t) = (complex(p, q), complex(p, qr), complex(q, qr));
    let (mut noise, mut input_inverse) = (complex(p, p), complex(q, q));
    let (mut noise_r, mut noise_t, mut reference_inverse) = (complex(p, p), complex(q, q), complex(qr, qr));
    let (mut paper, mut iv) = (Coherence::nan(bins, p, q), Coherence::nan(bins, p, q));
    let (mut output_coherence, mut input_coherence) = (Array2::from_elem((bins, p), f64::NAN), Array2::from_elem((bins, q), f64::NAN));
    let (mut instrument_strength, mut weak_instrument, mut singular_bins) = (vec![f64::NAN; bins], vec![false; bins], Vec::new());

    let zeros = |n: usize| vec![Complex64::default(); n];
    let (mut reference, mut coherent, mut measured) = (Cholesky::new(qr), Cholesky::new(q), Cholesky::new(q));
    let (mut white, mut sigma, mut c) = (zeros(m * qr), zeros(m * m), zeros(p * q));
    let (mut inverse_r, mut inverse_c, mut inverse_u) = (zeros(qr * qr), zeros(q * q), zeros(q * q));
    let (mut scratch, mut values, mut row) = (zeros(qr * qr), vec![0.0; qr], zeros(qr.max(q)));
    for f in usize::from(spectra.mean_removed())..bins {
        let rr = |i: usize, j: usize| spectra.at(f, ports.references[i], ports.references[j]);
        let uu = |i: usize, j: usize| spectra.at(f, ports.inputs[i], ports.inputs[j]);
        if !(scaled_condition(rr, &mut scratch, &mut values) <= LARGEST_CONDITION && reference.factor(rr)) {
            singular_bins.push(f);
            continue;
        }
        reference.inverse(&mut inverse_r);
        assign(&mut reference_inverse, f, &inverse_r);
        for (a, row) in white.chunks_exact_mut(qr).enumerate() {
            row.iter_mut().zip(&ports.references).for_each(|(w, &r)| *w = spectra.at(f, responders[a], r));
            reference.whiten(row);
        }
        let explained = |a: usize, b: usize| -> Complex64 { (0..qr).map(|k| white[a * qr + k] * white[b * qr + k].conj()).sum() };
        for a in 0..m {
            for b in 0..=a {
                let rest = spectra.at(f, responders[a], responders[b]) - explained(a, b);
                let rest = if a == b { Complex64::new(rest.re.max(0.0), 0.0) } else { rest };
                sigma[a * m + b] = rest;
                sigma[b * m + a] = rest.conj();
            }
            row[..qr].copy_from_slice(&white[a * qr..(a + 1) * qr]);
            reference.unwhiten(&mut row[..qr]);
            let share = (explained(a, a).re / spectra.power(f, responders[a])).min(1.0);
            if a < p {
                (0..qr).for_each(|k| r[[f, a, k]] = row[k]);
                output_coherence[[f, a]] = share;
            } else {
                (0..qr).for_each(|k| t[[f, a - p, k]] = row[k]);
                input_coherence[[f, a - p]] = share;
            }
        }
        for a in 0..m {
            for b in 0..m {
                match (a < p, b < p) {
                    (true, true) => noise_r[[f, a, b]] = sigma[a * m + b] / freedom,
                    (false, false) => noise_t[[f, a - p, b - p]] = sigma[a * m + b] / freedom,
                    _ => {}
                }
            }
        }
        let cc = |i: usize, j: usize| explained(p + i, p + j);
        if !(coherent.factor(cc) && measured.factor(uu)) {
            singular_bins.push(f);
            continue;
        }
        coherent.inverse(&mut inverse_c);
        measured.inverse(&mut inverse_u);
        assign(&mut input_inverse, f, &inverse_c);
        for (i, row) in c.chunks_exact_mut(q).enumerate() {
            (0..q).for_each(|j| row[j] = explained(i, p + j));
            coherent.whiten(row);
            coherent.unwhiten(row);
            (0..q).for_each(|j| value[[f, i, j]] = row[j]);
        }
        let equation = |i: usize, k: usize| -> Complex64 {
            let mut sum = sigma[i * m + k];
            for j in 0..q {
                sum -= c[i * q + j] * sigma[(p + j) * m + k] + sigma[i * m + p + j] * c[k * q + j].conj();
                for l in 0..q {
                    sum += c[i * q + j] * sigma[(p + j) * m + p + l] * c[k * q + l].conj();
                }
            }
            sum
        };
        for i in 0..p {
            for k in 0..p {
                noise[[f, i, k]] = equation(i, k) / freedom;
            }
            let equation_noise = equation(i, i).re.max(0.0);
            (0..q).for_each(|j| row[j] = spectra.at(f, ports.outputs[i], ports.inputs[j]));
            measured.whiten(&mut row[..q]);
            let direct_noise = (spectra.power(f, ports.outputs[i]) - row[..q].iter().map(|w| w.norm_sqr()).sum::<f64>()).max(0.0);
            let own = &c[i * q..(i + 1) * q];
            imply(&mut paper, (f, i), own, uu, &inverse_u, direct_noise);
            imply(&mut iv, (f, i), own, cc, &inverse_c, equation_noise);
        }
        let largest = largest_ratio(&coherent, |i, j| sigma[(p + i) * m + p + j], &mut inverse_c, &mut inverse_u, &mut row, &mut values[..q]);
        instrument_strength[f] = freedom / qr as f64 / largest;
        let weakest = (0..q).map(|j| input_coherence[[f, j]]).map(|g| averages * g / (1.0 - g)).fold(f64::INFINITY, f64::min);
        weak_instrument[f] = instrument_strength[f].min(weakest) < WEAK_INSTRUMENT;
    }
    check::not_all_singular(spectra, &ports.references, &labels.references, "reference", &singular_bins)?;

    let wrap = |value: Array3<Complex64>, noise, inverse, kind, inputs: &[String], outputs: &[String]| FrequencyResponse {
        frequency_hz: spectra.frequency_hz().to_vec(),
        inputs: inputs.to_vec(),
        outputs: outputs.to_vec(),
        kind,
        value,
        uncertainty: Some(Uncertainty {
            noise,
            input_inverse: inverse,
            degrees_of_freedom: freedom,
            independent_spacing_hz: spectra.independent_spacing_hz(),
            kernel: spectra.kernel().clone(),
        }),
    };
    Ok(DerivedEstimate {
        response: wrap(value, noise, input_inverse, labels.kind, &labels.inputs, &labels.outputs),
        to_reference: ToReference {
            r: wrap(r, noise_r, reference_inverse.clone(), ResponseKind::Transfer, &labels.references, &labels.outputs),
            t: wrap(t, noise_t, reference_inverse, ResponseKind::Transfer, &labels.references, &labels.inputs),
            output_coherence,
            input_coherence,
        },
        coherence_paper: paper,
        coherence_iv: iv,
        instrument_strength,
        weak_instrument,
        singular_bins,
    })
}

/// The largest eigenvalue of S⁻¹N for S = L Lᴴ already factored, that is of L⁻¹ N L⁻ᴴ. N may be singular. `a`, `b`,
/// `row` and `values` are workspace of q², q², q and q.
pub(crate) fn largest_ratio(
    factor: &Cholesky,
    n: impl Fn(usize, usize) -> Complex64,
    a: &mut [Complex64],
    b: &mut [Complex64],
    row: &mut [Complex64],
    values: &mut [f64],
) -> f64 {
    let q = values.len();
    for i in 0..q {
        (0..q).for_each(|j| row[j] = n(i, j));
        factor.whiten(&mut row[..q]);
        a[i * q..(i + 1) * q].copy_from_slice(&row[..q]);
    }
    for j in 0..q {
        (0..q).for_each(|i| row[i] = a[i * q + j].conj());
        factor.whiten(&mut row[..q]);
        b[j * q..(j + 1) * q].copy_from_slice(&row[..q]);
    }
    eigen(b, values, None);
    values.iter().fold(0.0_f64, |a, &b| a.max(b))
}

fn assign(array: &mut Array3<Complex64>, f: usize, from: &[Complex64]) {
    array.index_axis_mut(ndarray::Axis(0), f).iter_mut().zip(from).for_each(|(to, &from)| *to = from);
}
