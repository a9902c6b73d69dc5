//! What a linear parametric model is to a fit.

use crate::{Axis, Gains};
use ndarray::{Array2, Array3};
use ndof_linear::square;
use ndof_sysid::{FrequencyResponse, ResponseKind};
use num_complex::Complex64;
use serde::{Deserialize, Serialize};

/// The response of a model on a grid, of the kind asked for; not a number where that does not exist (0 Hz of an impedance).
pub fn parametric_response(model: &dyn ParametricModel, theta: &[f64], frequency_hz: &[f64], kind: ResponseKind) -> FrequencyResponse {
    let n = model.axes().len();
    response_of(model.axes(), frequency_hz, kind, |s| {
        let mut stiffness = vec![Complex64::default(); n * n];
        model.stiffness(theta, s, &mut stiffness, None);
        stiffness
    })
}

/// The response that a dynamic stiffness D(s), n × n in rows, stands for.
pub(crate) fn response_of(axes: &[Axis], frequency_hz: &[f64], kind: ResponseKind, stiffness: impl Fn(Complex64) -> Vec<Complex64>) -> FrequencyResponse {
    let n = axes.len();
    let mut value = Array3::from_elem((frequency_hz.len(), n, n), Complex64::new(f64::NAN, f64::NAN));
    for (f, &hz) in frequency_hz.iter().enumerate() {
        let s = Complex64::new(0.0, std::f64::consts::TAU * hz);
        let flat = stiffness(s);
        let at = match kind {
            ResponseKind::DynamicStiffness => Some(flat),
            ResponseKind::Impedance => Some(flat.iter().map(|v| v / s).collect()),
            ResponseKind::Compliance | ResponseKind::Transfer => square::inverse(&flat, n),
            ResponseKind::Admittance => square::inverse(&flat, n).map(|c| c.iter().map(|v| v * s).collect()),
        };
        let slot = value.index_axis_mut(ndarray::Axis(0), f);
        slot.into_iter().zip(at.into_iter().flatten()).filter(|(_, a)| a.is_finite()).for_each(|(v, a)| *v = a);
    }
    let names: Vec<String> = axes.iter().map(|a| a.name.clone()).collect();
    FrequencyResponse { frequency_hz: frequency_hz.to_vec(), inputs: names.clone(), outputs: names, kind, value, uncertainty: None }
}

/// One parameter of a model: what it is called, where it acts, and between which bounds it makes sense.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ParameterInfo {
    /// `M_x_y`: matrix, row axis, column axis; `M` for a single axis; `delay_s` and the like elsewhere.
    pub name: String,
    /// SI unit.
    pub unit: String,
    /// The axes or the channel that it belongs to.
    pub site: String,
    /// Least value that makes sense, −∞ without one.
    pub lower: f64,
    /// Largest value that makes sense, ∞ without one.
    pub upper: f64,
}

/// A linear model of N axes, described by its dynamic stiffness D(s) = F/d.
///
/// Compliance, impedance and admittance follow from it, as do their derivatives.
pub trait ParametricModel: Send + Sync {
    /// What `ndof list models` calls it.
    fn name(&self) -> &str;

    /// The axes, in the order of rows and columns.
    fn axes(&self) -> &[Axis];

    /// The parameters, in the order of `theta`.
    fn parameters(&self) -> Vec<ParameterInfo>;

    /// The model whose parameters stand first, where this one is made of another: they matter and move as they do there, those behind them as they are.
    fn base(&self) -> Option<&dyn ParametricModel> {
        None
    }

    /// How large each parameter would have to be to matter: its own size, unless the model knows better.
    /// An interval wider than that says nothing.
    fn scales(&self, theta: &[f64]) -> Vec<f64> {
        let (base, own) = self.base().map_or((Vec::new(), 0), |base| {
            let own = base.parameters().len();
            (base.scales(&theta[..own]), own)
        });
        base.into_iter().chain(theta[own..].iter().map(|value| value.abs())).collect()
    }

    /// Writes D(s) to `value` (N × N, row-major) and, where asked, ∂D/∂θₖ to the k-th block of `derivative`.
    fn stiffness(&self, theta: &[f64], s: Complex64, value: &mut [Complex64], derivative: Option<&mut [Complex64]>);

    /// C = D⁻¹ and ∂C, arranged as in [`ParametricModel::stiffness`], where they are nearer at hand than D is; false where they are not.
    fn compliance(&self, _theta: &[f64], _s: Complex64, _value: &mut [Complex64], _derivative: Option<&mut [Complex64]>) -> bool {
        false
    }

    /// How inputs drive the axes where they are more than those; `None` where each axis has one of its own.
    fn gains(&self) -> Option<&Gains> {
        None
    }

    /// Coordinates in which a minimiser moves freely where `theta` obeys constraints that are no bounds; `theta` itself
    /// unless the model knows better.
    fn internal(&self, theta: &[f64]) -> Vec<f64> {
        let Some(base) = self.base() else { return theta.to_vec() };
        let (own, rest) = theta.split_at(base.parameters().len());
        [&base.internal(own), rest].concat()
    }

    /// `theta` of such coordinates.
    fn natural(&self, internal: &[f64]) -> Vec<f64> {
        let Some(base) = self.base() else { return internal.to_vec() };
        let (own, rest) = internal.split_at(base.parameters().len());
        [&base.natural(own), rest].concat()
    }

    /// ∂θ/∂x of such coordinates; `None` for the identity.
    fn natural_jacobian(&self, internal: &[f64]) -> Option<Array2<f64>> {
        let base = self.base()?;
        let own = base.natural_jacobian(&internal[..base.parameters().len()])?;
        let identity = |i: usize, j: usize| f64::from(u8::from(i == j));
        Some(Array2::from_shape_fn((internal.len(), internal.len()), |place| own.get(place).copied().unwrap_or_else(|| identity(place.0, place.1))))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Springs(Vec<Axis>);

    impl ParametricModel for Springs {
        fn name(&self) -> &str {
            "springs"
        }

        fn axes(&self) -> &[Axis] {
            &self.0
        }

        fn parameters(&self) -> Vec<ParameterInfo> {
            Vec::new()
        }

        fn stiffness(&self, theta: &[f64], _s: Complex64, value: &mut [Complex64], _derivative: Option<&mut [Complex64]>) {
            value[0] = theta[0].into();
        }
    }

    #[test]
    fn a_model_that_says_no_more_has_parameters_of_their_own_size_and_moves_in_them() {
        let springs = Springs(vec![Axis::linear("x")]);
        assert_eq!(springs.scales(&[-3.0, 0.5]), [3.0, 0.5]);
        assert_eq!((springs.internal(&[2.0, 7.0]), springs.natural(&[2.0, 7.0])), (vec![2.0, 7.0], vec![2.0, 7.0]));
        assert!(springs.natural_jacobian(&[2.0]).is_none());
        let response = parametric_response(&springs, &[4.0], &[1.0], ResponseKind::Compliance);
        assert_eq!(response.value[[0, 0, 0]], Complex64::from(0.25));
    }
}
