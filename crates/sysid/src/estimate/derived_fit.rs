//! The derived estimate of a fit at each line.

use super::EstimateError;
use super::derived::{DerivedEstimate, part_of};
use super::derived_line::{DerivedLines, Found};
use super::fitted::Fitted;
use super::local_lines::TASK;
use crate::filling::Filling;
use crate::labels::Labels;
use crate::response::{FrequencyResponse, ResponseKind};
use ndarray::{Axis, Slice};
use num_complex::Complex64;
use rayon::prelude::*;

impl Fitted {
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
            self.response(
                [self.g.slice_axis(Axis(1), part).to_owned(), part_of(&self.noise, (from, to)), self.gram_inverse.clone()],
                ResponseKind::Transfer,
                &labels.references,
                outputs,
            )
        };
        let response = self.derived_response([value, noise, input_inverse], labels);
        Ok(DerivedEstimate::new(response, [to_reference(0, p, &labels.outputs), to_reference(p, m, &labels.inputs)], judged, missing))
    }

    /// The response of [`derived`](Self::derived) alone, by which nothing is judged.
    pub(crate) fn derived_alone(&self, labels: &Labels) -> Result<FrequencyResponse, EstimateError> {
        let Found { value, noise, input_inverse, .. } = self.by_lines(None, labels)?;
        Ok(self.derived_response([value, noise, input_inverse], labels))
    }

    fn derived_response(&self, found: [Filling<Complex64>; 3], labels: &Labels) -> FrequencyResponse {
        let mut response = self.response(found.map(Filling::finish), labels.kind, &labels.inputs, &labels.outputs);
        if let Some(u) = &mut response.uncertainty {
            u.unexplained = Some(self.noise.clone());
        }
        response
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
}
