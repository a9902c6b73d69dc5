//! Estimates from a least-squares fit of a response at each frequency, as the local polynomial and the periodic method
//! make it.

use super::EstimateError;
use super::coherence::{Coherence, Significance, imply};
use super::direct::{DirectEstimate, LARGEST_CONDITION};
use crate::labels::Labels;
use crate::lanes::scaled_condition;
use crate::response::{FrequencyResponse, ResponseKind, places};
use crate::uncertainty::{NAN, Uncertainty};
use ndarray::{Array3, Axis};
use ndof_linear::Cholesky;
use ndof_signal::Kernel;
use num_complex::Complex64;

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
            for (i, j) in places(q, q) {
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

    pub(super) fn response(
        &self,
        [value, noise, input_inverse]: [Array3<Complex64>; 3],
        kind: ResponseKind,
        inputs: &[String],
        outputs: &[String],
    ) -> FrequencyResponse {
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
                unexplained: None,
                kernel: Kernel { offset_hz: vec![0.0], weight: vec![1.0] },
                inverted: false,
            }),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A line at rest and then, of two inputs of unit power and coherence c²: condition (1 + c)/(1 − c); ν + q averages.
    #[test]
    fn lines_at_which_inputs_depend_on_each_other_have_no_direct_response() {
        let ports = crate::Ports { references: vec![], inputs: vec![0, 1], outputs: vec![2] };
        let labels = Labels::numbered(&ports, ResponseKind::Transfer);
        let fit = |c: &[f64]| Fitted {
            frequency_hz: (0..c.len()).map(|f| f as f64).collect(),
            g: Array3::from_shape_fn((c.len(), 1, 2), |(f, _, _)| if f > 0 && c[f] < 1.0 { Complex64::ONE } else { NAN }),
            noise: Array3::from_elem((c.len(), 1, 1), Complex64::ONE),
            gram_inverse: Array3::from_elem((c.len(), 2, 2), Complex64::ONE),
            driver: Array3::from_shape_fn((c.len(), 2, 2), |(f, i, j)| if i == j { Complex64::ONE } else { c[f].into() }),
            degrees_of_freedom: 9.0,
            independent_spacing_hz: 1.0,
        };
        let found = fit(&[0.0, 0.0, 0.5, 1.0 - 1e-9, 1.0]).direct(&labels).expect("two lines are left");
        assert_eq!((&found.singular_bins, found.effective_averages), (&vec![3, 4], 11.0));
        assert!((found.input_condition_number[1] - 1.0).abs() < 1e-12 && (found.input_condition_number[2] - 3.0).abs() < 1e-12);
        assert!((1.9e9..2.1e9).contains(&found.input_condition_number[3]) && found.input_condition_number[4] == f64::INFINITY);
        assert!((1..5).all(|f| found.response.value[[f, 0, 0]].is_nan() == (f > 2)));
        assert!(matches!(fit(&[0.0, 1.0, 1.0]).direct(&labels), Err(EstimateError::Dependent { role: "input", names }) if names == labels.inputs));
    }
}
