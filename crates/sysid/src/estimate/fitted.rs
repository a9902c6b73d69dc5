//! Estimates from a least-squares fit of a response at each frequency, as the local polynomial and the periodic method
//! make it.

use super::coherence::{Coherence, Significance, imply};
use super::derived::{DerivedEstimate, ToReference, WEAK_INSTRUMENT, largest_ratio};
use super::direct::{DirectEstimate, LARGEST_CONDITION};
use super::{EstimateError, check};
use crate::hermitian::{Cholesky, scaled_condition};
use crate::labels::Labels;
use crate::response::{FrequencyResponse, ResponseKind, Uncertainty};
use ndarray::{Array2, Array3};
use ndof_signal::Kernel;
use num_complex::Complex64;

const NAN: Complex64 = Complex64::new(f64::NAN, f64::NAN);

/// A response of `m` responders to `q` drivers with Cov(vec G) = gram_inverseᵀ ⊗ noise, NaN where there is none.
#[derive(Clone, Debug)]
pub(crate) struct Fitted {
    pub(crate) frequency_hz: Vec<f64>,
    /// `[f][m][q]`.
    pub(crate) g: Array3<Complex64>,
    /// Unexplained density of the responders, unbiased, `[f][m][m]`.
    pub(crate) noise: Array3<Complex64>,
    /// `[f][q][q]`.
    pub(crate) gram_inverse: Array3<Complex64>,
    /// Density of the drivers, `[f][q][q]`.
    pub(crate) driver: Array3<Complex64>,
    pub(crate) degrees_of_freedom: f64,
    pub(crate) independent_spacing_hz: f64,
}

impl Fitted {
    fn uncertainty(&self, noise: Array3<Complex64>, input_inverse: Array3<Complex64>) -> Option<Uncertainty> {
        Some(Uncertainty {
            noise,
            input_inverse,
            degrees_of_freedom: self.degrees_of_freedom,
            independent_spacing_hz: self.independent_spacing_hz,
            kernel: Kernel { offset_hz: vec![0.0], weight: vec![1.0] },
            inverted: false,
        })
    }

    /// Averages that a Welch estimate of the same degrees of freedom would have.
    fn equivalent_averages(&self) -> f64 {
        self.degrees_of_freedom + self.g.dim().2 as f64
    }

    /// Outputs over inputs, from the fit of outputs (responders) on inputs (drivers).
    pub(crate) fn direct(&self, labels: &Labels) -> Result<DirectEstimate, EstimateError> {
        let (bins, p, q) = self.g.dim();
        let mut coherence = Coherence::nan(bins, p, q);
        let mut input_coherence = Array3::from_elem((bins, q, q), f64::NAN);
        let mut condition = vec![f64::NAN; bins];
        let mut singular_bins = Vec::new();
        let mut cholesky = Cholesky::new(q);
        let (mut inverse, mut row) = (vec![Complex64::default(); q * q], vec![NAN; q]);
        let mut value = self.g.clone();
        for f in usize::from(self.frequency_hz.first() == Some(&0.0))..bins {
            let input = |i: usize, j: usize| self.driver[[f, i, j]];
            for (i, j) in (0..q).flat_map(|i| (0..q).map(move |j| (i, j))) {
                input_coherence[[f, i, j]] = input(i, j).norm_sqr() / (input(i, i).re * input(j, j).re);
            }
            condition[f] = f64::INFINITY;
            if cholesky.factor(input) {
                cholesky.inverse(&mut inverse);
                condition[f] = scaled_condition(q, input, &inverse);
            }
            if condition[f] > LARGEST_CONDITION || !self.g[[f, 0, 0]].is_finite() {
                singular_bins.push(f);
                value.index_axis_mut(ndarray::Axis(0), f).fill(NAN);
                continue;
            }
            for i in 0..p {
                (0..q).for_each(|j| row[j] = self.g[[f, i, j]]);
                imply(&mut coherence, (f, i), &row, input, &inverse, self.noise[[f, i, i]].re);
            }
        }
        if value.iter().all(|v| v.is_nan()) {
            return Err(EstimateError::Dependent { role: "input", names: labels.inputs.clone() });
        }
        let averages = self.equivalent_averages();
        Ok(DirectEstimate {
            response: FrequencyResponse {
                frequency_hz: self.frequency_hz.clone(),
                inputs: labels.inputs.clone(),
                outputs: labels.outputs.clone(),
                kind: labels.kind,
                value,
                uncertainty: self.uncertainty(self.noise.clone(), self.gram_inverse.clone()),
            },
            coherence,
            input_coherence,
            input_condition_number: condition,
            significance_95: Significance::at_95_percent(averages, q),
            effective_averages: averages,
            singular_bins,
        })
    }

    /// Outputs over inputs by way of the references, from the fit of [outputs; inputs] on references, and the direct
    /// fit for the paper's coherence.
    ///
    /// C = R W Tᴴ (T W Tᴴ)⁻¹ with W the inverse of the Gram inverse; R T⁻¹ where T is square. Noise as in
    /// [`derived`](super::derived()).
    pub(crate) fn derived(&self, direct: &Fitted, labels: &Labels) -> Result<DerivedEstimate, EstimateError> {
        let (bins, m, qr) = self.g.dim();
        let (p, q) = (labels.outputs.len(), labels.inputs.len());
        let complex = |rows: usize, columns: usize| Array3::from_elem((bins, rows, columns), NAN);
        let (mut value, mut noise, mut input_inverse) = (complex(p, q), complex(p, p), complex(q, q));
        let (mut paper, mut iv) = (Coherence::nan(bins, p, q), Coherence::nan(bins, p, q));
        let (mut output_coherence, mut input_coherence) = (Array2::from_elem((bins, p), f64::NAN), Array2::from_elem((bins, q), f64::NAN));
        let (mut instrument_strength, mut weak_instrument, mut singular_bins) = (vec![f64::NAN; bins], vec![false; bins], Vec::new());
        let zeros = |n: usize| vec![Complex64::default(); n];
        let (mut gram, mut coherent, mut measured) = (Cholesky::new(qr), Cholesky::new(q), Cholesky::new(q));
        let (mut white, mut c, mut row) = (zeros(m * qr), zeros(p * q), zeros(qr.max(q)));
        let (mut inverse_information, mut inverse_c, mut inverse_u, mut scratch) = (zeros(q * q), zeros(q * q), zeros(q * q), zeros(q * q));
        let mut values = vec![0.0; q];
        for f in usize::from(self.frequency_hz.first() == Some(&0.0))..bins {
            let finite = self.g[[f, 0, 0]].is_finite();
            // P = L Lᴴ, so that g L⁻ᴴ … W = P⁻¹ makes explained(a, b) = g_a W g_bᴴ.
            if !(finite && gram.factor(|i, j| self.gram_inverse[[f, i, j]])) {
                singular_bins.push(f);
                continue;
            }
            for a in 0..m {
                let row = &mut white[a * qr..(a + 1) * qr];
                (0..qr).for_each(|k| row[k] = self.g[[f, a, k]]);
                gram.whiten(row);
                let power: f64 = (0..qr)
                    .flat_map(|k| (0..qr).map(move |l| (k, l)))
                    .map(|(k, l)| (self.g[[f, a, k]] * self.driver[[f, k, l]] * self.g[[f, a, l]].conj()).re)
                    .sum();
                let share = power / (power + self.noise[[f, a, a]].re);
                if a < p { output_coherence[[f, a]] = share } else { input_coherence[[f, a - p]] = share }
            }
            let information = |a: usize, b: usize| -> Complex64 { (0..qr).map(|k| white[a * qr + k] * white[b * qr + k].conj()).sum() };
            let caused = |i: usize, j: usize| -> Complex64 {
                let pairs = (0..qr).flat_map(|k| (0..qr).map(move |l| (k, l)));
                pairs.map(|(k, l)| self.g[[f, p + i, k]] * self.driver[[f, k, l]] * self.g[[f, p + j, l]].conj()).sum()
            };
            let input = |i: usize, j: usize| direct.driver[[f, i, j]];
            if !coherent.factor(caused) || !measured.factor(input) {
                singular_bins.push(f);
                continue;
            }
            coherent.inverse(&mut inverse_c);
            measured.inverse(&mut inverse_u);
            if !coherent.factor(|i, j| information(p + i, p + j)) {
                singular_bins.push(f);
                continue;
            }
            coherent.inverse(&mut inverse_information);
            input_inverse.index_axis_mut(ndarray::Axis(0), f).iter_mut().zip(&inverse_information).for_each(|(to, &from)| *to = from);
            for (i, row) in c.chunks_exact_mut(q).enumerate() {
                (0..q).for_each(|j| row[j] = information(i, p + j));
                coherent.whiten(row);
                coherent.unwhiten(row);
                (0..q).for_each(|j| value[[f, i, j]] = row[j]);
            }
            let sigma = |a: usize, b: usize| self.noise[[f, a, b]];
            for (i, k) in (0..p).flat_map(|i| (0..p).map(move |k| (i, k))) {
                let mut sum = sigma(i, k);
                for j in 0..q {
                    sum -= c[i * q + j] * sigma(p + j, k) + sigma(i, p + j) * c[k * q + j].conj();
                    for l in 0..q {
                        sum += c[i * q + j] * sigma(p + j, p + l) * c[k * q + l].conj();
                    }
                }
                noise[[f, i, k]] = if i == k { Complex64::from(sum.re.max(0.0)) } else { sum };
            }
            for i in 0..p {
                let own = &c[i * q..(i + 1) * q];
                imply(&mut paper, (f, i), own, input, &inverse_u, direct.noise[[f, i, i]].re);
                imply(&mut iv, (f, i), own, caused, &inverse_c, noise[[f, i, i]].re);
            }
            // The residual holds what the error of C makes of the inputs that the references do not cause.
            let taken_in: Complex64 = (0..q).flat_map(|l| (0..q).map(move |j| (l, j))).map(|(l, j)| inverse_information[l * q + j] * sigma(p + j, p + l)).sum();
            noise.index_axis_mut(ndarray::Axis(0), f).mapv_inplace(|v| v / (1.0 + taken_in.re));
            let largest = largest_ratio(&coherent, |i, j| sigma(p + i, p + j), &mut scratch, &mut inverse_u, &mut row, &mut values);
            instrument_strength[f] = 1.0 / (qr as f64 * largest);
            let weakest = (0..q).map(|j| information(p + j, p + j).re / sigma(p + j, p + j).re).fold(f64::INFINITY, f64::min);
            weak_instrument[f] = instrument_strength[f].min(weakest) < WEAK_INSTRUMENT;
        }
        if value.iter().all(|v| v.is_nan()) {
            return Err(EstimateError::Dependent { role: "reference", names: labels.references.clone() });
        }
        let part = |from: usize, to: usize| {
            let pick: Vec<usize> = (from..to).collect();
            (self.g.select(ndarray::Axis(1), &pick), self.noise.select(ndarray::Axis(1), &pick).select(ndarray::Axis(2), &pick))
        };
        let wrap = |value, noise, inverse, kind, inputs: &[String], outputs: &[String]| FrequencyResponse {
            frequency_hz: self.frequency_hz.clone(),
            inputs: inputs.to_vec(),
            outputs: outputs.to_vec(),
            kind,
            value,
            uncertainty: self.uncertainty(noise, inverse),
        };
        let ((r, noise_r), (t, noise_t)) = (part(0, p), part(p, m));
        Ok(DerivedEstimate {
            response: wrap(value, noise, input_inverse, labels.kind, &labels.inputs, &labels.outputs),
            to_reference: ToReference {
                r: wrap(r, noise_r, self.gram_inverse.clone(), ResponseKind::Transfer, &labels.references, &labels.outputs),
                t: wrap(t, noise_t, self.gram_inverse.clone(), ResponseKind::Transfer, &labels.references, &labels.inputs),
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
}

/// ν > 0, or the reason why not, for a fit of `unknowns` per row to `equations`.
pub(crate) fn freedom(equations: usize, unknowns: usize) -> Result<f64, EstimateError> {
    check::degrees_of_freedom(equations as f64, unknowns)
}
