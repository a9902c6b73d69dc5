//! A frequency response with its covariance.

use crate::uncertainty::{NAN, Uncertainty, chosen, scale};
use ndarray::{Array2, Array3, Axis};
use num_complex::Complex64;
use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;

/// The places of a matrix, row by row.
#[inline]
pub(crate) fn places(rows: usize, columns: usize) -> impl Iterator<Item = (usize, usize)> {
    (0..rows).flat_map(move |i| (0..columns).map(move |j| (i, j)))
}

/// The physical meaning of a response between effort F and displacement d.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ResponseKind {
    /// C = d/F (m/N).
    Compliance,
    /// D = F/d = C⁻¹ (N/m).
    DynamicStiffness,
    /// Z = F/ḋ = D/s (N s/m).
    Impedance,
    /// Y = ḋ/F = s C (m/(N s)).
    Admittance,
    /// Outputs over inputs of any other quantities.
    Transfer,
}

impl ResponseKind {
    /// Whether effort stands in the numerator.
    pub fn is_effort_over_motion(self) -> bool {
        matches!(self, ResponseKind::DynamicStiffness | ResponseKind::Impedance)
    }

    /// The power of s that takes displacement over effort (or its inverse) to this kind.
    fn power_of_s(self) -> i32 {
        match self {
            ResponseKind::Impedance => -1,
            ResponseKind::Admittance => 1,
            _ => 0,
        }
    }
}

/// The response of outputs to inputs at each frequency: `H[f][output][input]`, NaN where it does not exist.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FrequencyResponse {
    /// The grid.
    pub frequency_hz: Vec<f64>,
    /// Names of the inputs (columns).
    pub inputs: Vec<String>,
    /// Names of the outputs (rows).
    pub outputs: Vec<String>,
    /// What it means physically.
    pub kind: ResponseKind,
    /// `H[f][p][q]`.
    pub value: Array3<Complex64>,
    /// Covariance, where it was estimated and not computed from a model.
    pub uncertainty: Option<Uncertainty>,
}

/// Why a response cannot be converted.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[allow(missing_docs, reason = "a message says what its fields are")]
pub enum ResponseError {
    /// An inverse of something that is not square.
    #[error("a response of {outputs} outputs to {inputs} inputs has no inverse; choose as many outputs as inputs")]
    NotSquare { outputs: usize, inputs: usize },
    /// A response of another size than the model that it is set against.
    #[error("a response of {outputs} outputs to {inputs} inputs beside a model of {axes} axes; give one output and one input for each axis")]
    Size { outputs: usize, inputs: usize, axes: usize },
    /// A general transfer function has no mechanical meaning to convert.
    #[error("{from:?} cannot be turned into {to:?}: the channels are not effort and motion; set their units or prefixes")]
    NoMeaning { from: ResponseKind, to: ResponseKind },
}

impl FrequencyResponse {
    /// Number of frequencies.
    pub fn len(&self) -> usize {
        self.frequency_hz.len()
    }

    /// Whether there is no frequency.
    pub fn is_empty(&self) -> bool {
        self.frequency_hz.is_empty()
    }

    /// Outputs and inputs.
    pub fn shape(&self) -> (usize, usize) {
        (self.outputs.len(), self.inputs.len())
    }

    /// The matrix at frequency index `f`.
    pub fn at(&self, f: usize) -> Array2<Complex64> {
        self.value.index_axis(Axis(0), f).to_owned()
    }

    /// E|δH_ij|² at frequency index `f`; NaN without a covariance.
    pub fn variance(&self, f: usize, output: usize, input: usize) -> f64 {
        self.uncertainty.as_ref().map_or(f64::NAN, |u| u.noise[[f, output, output]].re * u.input_inverse[[f, input, input]].re)
    }

    /// Indices of the frequencies `low_hz..=high_hz`.
    pub fn within(&self, [low_hz, high_hz]: [f64; 2]) -> Vec<usize> {
        (0..self.len()).filter(|&f| (low_hz..=high_hz).contains(&self.frequency_hz[f])).collect()
    }

    /// The same response on the frequencies `low_hz..=high_hz` only.
    #[must_use]
    pub fn band(&self, low_hz: f64, high_hz: f64) -> Self {
        self.select(&self.within([low_hz, high_hz]))
    }

    /// Every how many frequencies there are `dense` an independent one; 1 on a grid that is coarser, or without a covariance.
    pub fn stride(&self, dense: f64) -> usize {
        let step_hz = self.frequency_hz.windows(2).map(|w| w[1] - w[0]).fold(f64::INFINITY, f64::min);
        self.uncertainty.as_ref().map_or(1, |u| (u.independent_spacing_hz / (dense * step_hz)).floor().max(1.0) as usize)
    }

    /// The same response on one frequency an independent one.
    #[must_use]
    pub fn independent(&self) -> Self {
        let keep: Vec<usize> = (0..self.len()).step_by(self.stride(1.0)).collect();
        self.select(&keep)
    }

    /// The same response at the frequencies of these indices.
    #[must_use]
    pub fn select(&self, keep: &[usize]) -> Self {
        FrequencyResponse {
            frequency_hz: keep.iter().map(|&f| self.frequency_hz[f]).collect(),
            inputs: self.inputs.clone(),
            outputs: self.outputs.clone(),
            kind: self.kind,
            value: chosen(&self.value, keep),
            uncertainty: self.uncertainty.as_ref().map(|u| u.select(keep)),
        }
    }

    /// The response to sums of inputs, u′ = W u, as least squares find it in that to the inputs: H′ = H Ω Wᵀ (W Ω Wᵀ)⁻¹, Ω the inverse of the
    /// input side of the covariance. It is what an estimate from the sums themselves gives. W: sums × inputs; NaN where it does not exist.
    ///
    /// ```
    /// use ndof_sysid::{FrequencyResponse, ResponseKind};
    /// use num_complex::Complex;
    /// let two = FrequencyResponse {
    ///     frequency_hz: vec![1.0],
    ///     inputs: vec!["a".into(), "b".into()],
    ///     outputs: vec!["x".into()],
    ///     kind: ResponseKind::Compliance,
    ///     value: ndarray::Array3::from_shape_fn((1, 1, 2), |(_, _, j)| Complex::new(0.0, [2.0, 1.0][j])),
    ///     uncertainty: None,
    /// };
    /// let sum = two.to_sums(&ndarray::arr2(&[[1.0, 0.5]])); // u' = a + b/2
    /// assert!((sum.value[[0, 0, 0]] - Complex::new(0.0, 2.0)).norm() < 1e-15);
    /// ```
    #[must_use]
    pub fn to_sums(&self, w: &Array2<f64>) -> Self {
        let (sums, w) = (w.nrows(), w.mapv(Complex64::from));
        let mut value = Array3::from_elem((self.len(), self.outputs.len(), sums), NAN);
        let mut uncertainty = self.uncertainty.clone();
        if let Some(u) = &mut uncertainty {
            u.input_inverse = Array3::from_elem((self.len(), sums, sums), NAN);
        }
        for f in 0..self.len() {
            let power = match &self.uncertainty {
                Some(u) => ndof_linear::inverse(&u.input_inverse.index_axis(Axis(0), f).to_owned()),
                None => Some(Array2::eye(self.inputs.len())),
            };
            let onto = power.map(|power| power.dot(&w.t()));
            let Some((onto, inverse)) = onto.and_then(|onto| ndof_linear::inverse(&w.dot(&onto)).map(|inverse| (onto, inverse))) else { continue };
            value.index_axis_mut(Axis(0), f).assign(&self.at(f).dot(&onto).dot(&inverse));
            if let Some(u) = &mut uncertainty {
                u.input_inverse.index_axis_mut(Axis(0), f).assign(&inverse);
            }
        }
        if let Some(u) = &mut uncertainty {
            u.turn_inputs(sums, |_| Some(w.clone()));
        }
        let inputs = (1..=sums).map(|k| format!("sum {k}")).collect();
        FrequencyResponse { inputs, value, uncertainty, ..self.clone() }
    }

    /// The response to inputs u' of which these are made, u = W u', `W[f]`: H' = H W, covariance carried along. `self` may end before W does.
    ///
    /// ```
    /// use ndof_sysid::{FrequencyResponse, ResponseKind};
    /// use num_complex::Complex;
    ///
    /// let one = FrequencyResponse {
    ///     frequency_hz: vec![1.0],
    ///     inputs: vec!["a".into()],
    ///     outputs: vec!["x".into()],
    ///     kind: ResponseKind::Compliance,
    ///     value: ndarray::Array3::from_elem((1, 1, 1), Complex::new(0.0, 2.0)),
    ///     uncertainty: None,
    /// };
    /// let part = one.to_parts(&ndarray::Array3::from_elem((1, 1, 1), Complex::new(0.0, 0.5))); // a = j a'/2
    /// assert_eq!(part.value[[0, 0, 0]], Complex::new(-1.0, 0.0));
    /// ```
    #[must_use]
    pub fn to_parts(&self, w: &Array3<Complex64>) -> Self {
        let mut out = self.clone();
        for f in 0..self.len() {
            let w = w.index_axis(Axis(0), f);
            out.value.index_axis_mut(Axis(0), f).assign(&self.at(f).dot(&w));
            if let (Some(out), Some(own)) = (&mut out.uncertainty, &self.uncertainty) {
                let input = w.t().mapv(|v| v.conj()).dot(&own.input_inverse.index_axis(Axis(0), f)).dot(&w);
                out.input_inverse.index_axis_mut(Axis(0), f).assign(&input);
            }
        }
        if let Some(u) = &mut out.uncertainty {
            u.turn_inputs(w.dim().2, |f| ndof_linear::inverse(&w.index_axis(Axis(0), f).to_owned()));
        }
        out
    }

    /// Smallest singular value of H over its error √(E‖δH‖²), `[f]`; infinite without a covariance.
    ///
    /// Below about 3 the inverse cannot be trusted: its error is no longer small, and the covariance that
    /// [`inverse`](Self::inverse) carries along is too.
    pub fn invertibility(&self) -> Vec<f64> {
        let (p, q) = self.shape();
        let trace = |a: &Array3<Complex64>, f: usize| a.index_axis(Axis(0), f).diag().iter().map(|v| v.re).sum::<f64>();
        let (mut gram, mut values) = (vec![Complex64::default(); q * q], vec![0.0; q]);
        (0..self.len())
            .map(|f| {
                for (i, j) in places(q, q) {
                    gram[i * q + j] = (0..p).map(|k| self.value[[f, k, i]].conj() * self.value[[f, k, j]]).sum();
                }
                ndof_linear::hermitian_eigen(&mut gram, &mut values, None);
                let smallest = values.iter().copied().fold(f64::INFINITY, f64::min).max(0.0).sqrt();
                let error = self.uncertainty.as_ref().map_or(0.0, |u| (trace(&u.noise, f) * trace(&u.input_inverse, f)).sqrt());
                if smallest.is_finite() { smallest / error } else { f64::NAN }
            })
            .collect()
    }

    /// The matrix inverse at each frequency, inputs and outputs swapped, with its covariance:
    /// δ(H⁻¹) = −H⁻¹ δH H⁻¹ keeps the Kronecker form.
    ///
    /// # Errors
    /// [`ResponseError::NotSquare`].
    pub fn inverse(&self) -> Result<Self, ResponseError> {
        let (p, q) = self.shape();
        if p != q {
            return Err(ResponseError::NotSquare { outputs: p, inputs: q });
        }
        let mut value = Array3::from_elem((self.len(), q, p), NAN);
        let mut uncertainty = self.uncertainty.clone().map(|u| Uncertainty { inverted: !u.inverted, unexplained: None, ..u });
        for f in 0..self.len() {
            let Some(inverse) = ndof_linear::inverse(&self.at(f)) else { continue };
            if let (Some(out), Some(own)) = (&mut uncertainty, &self.uncertainty) {
                let hermitian = inverse.t().mapv(|v| v.conj());
                let noise = inverse.dot(&own.noise.index_axis(Axis(0), f)).dot(&hermitian);
                let input = hermitian.dot(&own.input_inverse.index_axis(Axis(0), f)).dot(&inverse);
                out.noise.index_axis_mut(Axis(0), f).assign(&noise);
                out.input_inverse.index_axis_mut(Axis(0), f).assign(&input);
            }
            value.index_axis_mut(Axis(0), f).assign(&inverse);
        }
        Ok(FrequencyResponse {
            frequency_hz: self.frequency_hz.clone(),
            inputs: self.outputs.clone(),
            outputs: self.inputs.clone(),
            kind: match self.kind {
                ResponseKind::Compliance => ResponseKind::DynamicStiffness,
                ResponseKind::DynamicStiffness => ResponseKind::Compliance,
                ResponseKind::Impedance => ResponseKind::Admittance,
                ResponseKind::Admittance => ResponseKind::Impedance,
                ResponseKind::Transfer => ResponseKind::Transfer,
            },
            value,
            uncertainty,
        })
    }

    /// The same system as another of the four mechanical responses, covariance carried along.
    ///
    /// # Errors
    /// [`ResponseError`] if an inverse is needed and there is none, or the channels are not effort and motion.
    pub fn to_kind(&self, kind: ResponseKind) -> Result<Self, ResponseError> {
        if kind == self.kind {
            return Ok(self.clone());
        }
        if kind == ResponseKind::Transfer || self.kind == ResponseKind::Transfer {
            return Err(ResponseError::NoMeaning { from: self.kind, to: kind });
        }
        let mut response = if kind.is_effort_over_motion() == self.kind.is_effort_over_motion() { self.clone() } else { self.inverse()? };
        let power = kind.power_of_s() - response.kind.power_of_s();
        response.differentiate(&vec![power; response.outputs.len()], &[]);
        response.kind = kind;
        Ok(response)
    }

    /// The response of such derivatives of the outputs to such derivatives of the inputs, covariance carried along; of channels beyond the last, none.
    pub fn differentiate(&mut self, outputs: &[i32], inputs: &[i32]) {
        if outputs.iter().chain(inputs).all(|power| *power == 0) {
            return;
        }
        let (p, q) = self.shape();
        for f in 0..self.len() {
            let s = Complex64::new(0.0, TAU * self.frequency_hz[f]);
            let factor = |power: Option<&i32>| power.filter(|power| **power != 0).map_or(Complex64::ONE, |power| s.powi(*power));
            let factors = |powers: &[i32], count: usize| (0..count).map(|k| factor(powers.get(k))).collect::<Vec<_>>();
            let (rows, columns) = (factors(outputs, p), factors(inputs, q));
            scale(self.value.index_axis_mut(Axis(0), f), &rows, &columns.iter().map(|column| column.inv()).collect::<Vec<_>>());
            self.uncertainty.iter_mut().for_each(|u| u.scale(f, &rows, &columns));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndarray::arr2;
    use ndof_signal::Kernel;

    fn example() -> FrequencyResponse {
        let c = |re: f64, im: f64| Complex64::new(re, im);
        let at = arr2(&[[c(2.0, 0.3), c(-0.4, 0.1)], [c(-0.5, 0.0), c(1.5, -0.7)]]);
        FrequencyResponse {
            frequency_hz: vec![1.5],
            inputs: vec!["force_x".into(), "force_y".into()],
            outputs: vec!["pos_x".into(), "pos_y".into()],
            kind: ResponseKind::Compliance,
            value: at.insert_axis(Axis(0)),
            uncertainty: Some(Uncertainty {
                noise: arr2(&[[c(0.02, 0.0), c(0.005, 0.001)], [c(0.005, -0.001), c(0.01, 0.0)]]).insert_axis(Axis(0)),
                input_inverse: arr2(&[[c(1.0, 0.0), c(0.2, 0.1)], [c(0.2, -0.1), c(0.7, 0.0)]]).insert_axis(Axis(0)),
                degrees_of_freedom: 20.0,
                independent_spacing_hz: 0.1,
                unexplained: None,
                kernel: Kernel::default(),
                inverted: false,
            }),
        }
    }

    /// (H W)⁻¹ = W⁻¹ H⁻¹: what W does to the input side of H it does to the output side of H⁻¹.
    #[test]
    fn parts_carry_values_and_covariance_along() {
        let own = example();
        let c = Complex64::new;
        let w = arr2(&[[c(1.0, 0.4), c(-0.3, 0.2)], [c(0.1, -0.6), c(0.8, 0.0)]]);
        let parts = own.to_parts(&w.clone().insert_axis(Axis(0)));
        let back = ndof_linear::inverse(&w).expect("not singular");
        let [inverse, of_parts] = [&own, &parts].map(|response| response.inverse().expect("square"));
        let [noise, expected] = [&of_parts, &inverse].map(|response| response.uncertainty.as_ref().expect("errors").noise.index_axis(Axis(0), 0).to_owned());
        let conjugate = back.t().mapv(|v| v.conj());
        for (found, expected) in [(of_parts.at(0), back.dot(&inverse.at(0))), (noise, back.dot(&expected).dot(&conjugate))] {
            found.iter().zip(&expected).for_each(|(f, e)| assert!((f - e).norm() < 1e-12 * e.norm().max(1e-3), "{f} {e}"));
        }
    }

    #[test]
    fn two_inversions_give_the_same_response_and_covariance() {
        let once = example();
        let twice = once.inverse().expect("square").inverse().expect("square");
        assert!(once.value.iter().zip(&twice.value).all(|(a, b)| (a - b).norm() < 1e-14));
        for (i, j) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
            assert!((once.variance(0, i, j) / twice.variance(0, i, j) - 1.0).abs() < 1e-12);
        }
    }

    #[test]
    fn a_transfer_function_has_no_mechanical_meaning() {
        for (from, to) in [(ResponseKind::Transfer, ResponseKind::Impedance), (ResponseKind::Compliance, ResponseKind::Transfer)] {
            assert_eq!(FrequencyResponse { kind: from, ..example() }.to_kind(to), Err(ResponseError::NoMeaning { from, to }));
        }
        assert!(example().band(10.0, 20.0).is_empty() && !example().is_empty());
    }

    #[test]
    fn a_nearly_singular_response_is_not_to_be_inverted() {
        let mut response = example();
        assert!(response.invertibility()[0] > 3.0);
        let row = [response.value[[0, 0, 0]], response.value[[0, 0, 1]]];
        (0..2).for_each(|j| response.value[[0, 1, j]] = row[j] * 1.001);
        assert!(response.invertibility()[0] < 0.1);
    }

    #[test]
    fn impedance_is_stiffness_over_s() {
        let stiffness = example().to_kind(ResponseKind::DynamicStiffness).expect("square");
        let impedance = example().to_kind(ResponseKind::Impedance).expect("square");
        let s = Complex64::new(0.0, TAU * 1.5);
        assert!((stiffness.value[[0, 0, 1]] / s - impedance.value[[0, 0, 1]]).norm() < 1e-14);
        assert_eq!(impedance.inputs, ["pos_x", "pos_y"]);
        assert!((stiffness.variance(0, 0, 1) / s.norm_sqr() / impedance.variance(0, 0, 1) - 1.0).abs() < 1e-12);
    }
}
