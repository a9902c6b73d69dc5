//! Estimates from a least-squares fit of a response at each frequency, as the local polynomial and the periodic method
//! make it.

use super::coherence::{Coherence, Significance, imply};
use super::derived::{DerivedEstimate, ToReference};
use super::derived_line::{DerivedLine, Found};
use super::direct::{DirectEstimate, LARGEST_CONDITION};
use super::local_lines::TASK;
use super::{EstimateError, check};
use crate::labels::Labels;
use crate::lanes::scaled_condition;
use crate::response::{FrequencyResponse, ResponseKind, Uncertainty};
use ndarray::{Array3, Axis};
use ndof_linear::Cholesky;
use ndof_signal::Kernel;
use num_complex::Complex64;
use rayon::prelude::*;

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
                value.index_axis_mut(Axis(0), f).fill(NAN);
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
        let (m, p) = (self.g.dim().1, labels.outputs.len());
        let bins = self.frequency_hz.len();
        let solve = |first: usize| {
            let lines = first..bins.min(first + TASK);
            let (mut line, mut found) = (DerivedLine::new(self, direct, p), Found::new(lines.clone(), self.g.dim(), p));
            let missing = lines.filter(|&f| self.frequency_hz[f] != 0.0).filter(|&f| line.solve(f, &mut found).is_none()).collect();
            (found, missing)
        };
        let (parts, missing): (Vec<Found>, Vec<Vec<usize>>) = (0..bins).step_by(TASK).collect::<Vec<_>>().into_par_iter().map(solve).unzip();
        let (mut found, singular_bins) = (Found::new(0..bins, self.g.dim(), p), missing.concat());
        parts.iter().for_each(|part| found.put(part));
        if found.value.iter().all(|v| v.is_nan()) {
            return Err(EstimateError::Dependent { role: "reference", names: labels.references.clone() });
        }
        let part = |from: usize, to: usize| {
            let pick: Vec<usize> = (from..to).collect();
            (self.g.select(Axis(1), &pick), self.noise.select(Axis(1), &pick).select(Axis(2), &pick))
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
            response: wrap(found.value, found.noise, found.input_inverse, labels.kind, &labels.inputs, &labels.outputs),
            to_reference: ToReference {
                r: wrap(r, noise_r, self.gram_inverse.clone(), ResponseKind::Transfer, &labels.references, &labels.outputs),
                t: wrap(t, noise_t, self.gram_inverse.clone(), ResponseKind::Transfer, &labels.references, &labels.inputs),
                output_coherence: found.output_coherence,
                input_coherence: found.input_coherence,
            },
            coherence_paper: found.paper,
            coherence_iv: found.iv,
            instrument_strength: found.instrument_strength,
            weak_instrument: found.weak_instrument,
            singular_bins,
        })
    }
}

/// ν > 0, or the reason why not, for a fit of `unknowns` per row to `equations`.
pub(crate) fn freedom(equations: usize, unknowns: usize) -> Result<f64, EstimateError> {
    check::degrees_of_freedom(equations as f64, unknowns)
}
