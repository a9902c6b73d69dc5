//! Estimates from a least-squares fit of a response at each frequency, as the local polynomial and the periodic method
//! make it.

use super::coherence::{Coherence, Significance, imply};
use super::derived::{DerivedEstimate, ToReference};
use super::derived_line::{DerivedLines, Found};
use super::direct::{DirectEstimate, LARGEST_CONDITION};
use super::local_lines::TASK;
use super::{EstimateError, check};
use crate::filling::Filling;
use crate::labels::Labels;
use crate::lanes::scaled_condition;
use crate::response::{FrequencyResponse, ResponseKind, Uncertainty};
use ndarray::{Array3, Axis, Slice};
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
            response: self.response([value, self.noise.clone(), self.gram_inverse.clone()], labels.kind, &labels.inputs, &labels.outputs),
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
        let Found { value, noise, input_inverse, judged, missing } = self.by_lines(Some(direct), labels)?;
        let to_reference = |from: usize, to: usize, outputs: &[String]| {
            let part = Slice::from(from..to);
            let noise = self.noise.slice_axis(Axis(1), part).slice_axis(Axis(2), part).to_owned();
            self.response([self.g.slice_axis(Axis(1), part).to_owned(), noise, self.gram_inverse.clone()], ResponseKind::Transfer, &labels.references, outputs)
        };
        let flat = |array: Filling<f64>| array.finish().remove_axis(Axis(1));
        let coherence =
            |[ordinary, partial, multiple]: [Filling<f64>; 3]| Coherence { ordinary: ordinary.finish(), partial: partial.finish(), multiple: flat(multiple) };
        Ok(DerivedEstimate {
            to_reference: ToReference {
                r: to_reference(0, p, &labels.outputs),
                t: to_reference(p, m, &labels.inputs),
                output_coherence: flat(judged.output_coherence),
                input_coherence: flat(judged.input_coherence),
            },
            coherence_paper: coherence(judged.paper),
            coherence_iv: coherence(judged.iv),
            instrument_strength: judged.instrument_strength,
            weak_instrument: judged.weak_instrument,
            singular_bins: missing,
            response: self.response([value, noise, input_inverse].map(Filling::finish), labels.kind, &labels.inputs, &labels.outputs),
        })
    }

    /// The response of [`derived`](Self::derived) alone, by which nothing is judged.
    pub(crate) fn derived_alone(&self, labels: &Labels) -> Result<FrequencyResponse, EstimateError> {
        let Found { value, noise, input_inverse, .. } = self.by_lines(None, labels)?;
        Ok(self.response([value, noise, input_inverse].map(Filling::finish), labels.kind, &labels.inputs, &labels.outputs))
    }

    fn by_lines(&self, direct: Option<&Fitted>, labels: &Labels) -> Result<Found, EstimateError> {
        let (bins, p) = (self.frequency_hz.len(), labels.outputs.len());
        let solve = |first: usize| DerivedLines::new(self, direct, p).solve(first..bins.min(first + TASK));
        let parts: Vec<Found> = (0..bins).step_by(TASK).collect::<Vec<_>>().into_par_iter().map(solve).collect();
        let mut parts = parts.into_iter();
        let dependent = || EstimateError::Dependent { role: "reference", names: labels.references.clone() };
        let mut found = parts.next().ok_or_else(dependent)?;
        parts.for_each(|part| found.append(part));
        if found.value.is_nan() { Err(dependent()) } else { Ok(found) }
    }

    fn response(&self, [value, noise, input_inverse]: [Array3<Complex64>; 3], kind: ResponseKind, inputs: &[String], outputs: &[String]) -> FrequencyResponse {
        FrequencyResponse {
            frequency_hz: self.frequency_hz.clone(),
            inputs: inputs.to_vec(),
            outputs: outputs.to_vec(),
            kind,
            value,
            uncertainty: Some(Uncertainty {
                noise,
                input_inverse,
                degrees_of_freedom: self.degrees_of_freedom,
                independent_spacing_hz: self.independent_spacing_hz,
                kernel: Kernel { offset_hz: vec![0.0], weight: vec![1.0] },
                inverted: false,
            }),
        }
    }
}

/// ν > 0, or the reason why not, for a fit of `unknowns` per row to `equations`.
pub(crate) fn freedom(equations: usize, unknowns: usize) -> Result<f64, EstimateError> {
    check::degrees_of_freedom(equations as f64, unknowns)
}
