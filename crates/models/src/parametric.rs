//! What a linear parametric model is to a fit.

use crate::Axis;
use ndarray::Array2;
use num_complex::Complex64;
use serde::{Deserialize, Serialize};

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

    /// How large parameter `parameter` would have to be to matter: its own size, unless the model knows better.
    /// An interval wider than that says nothing.
    fn scale(&self, theta: &[f64], parameter: usize) -> f64 {
        theta[parameter].abs()
    }

    /// Writes D(s) to `value` (N × N, row-major) and, where asked, ∂D/∂θₖ to the k-th block of `derivative`.
    fn stiffness(&self, theta: &[f64], s: Complex64, value: &mut [Complex64], derivative: Option<&mut [Complex64]>);

    /// Coordinates in which a minimiser moves freely where `theta` obeys constraints that are no bounds; `theta` itself
    /// unless the model knows better.
    fn internal(&self, theta: &[f64]) -> Vec<f64> {
        theta.to_vec()
    }

    /// `theta` of such coordinates.
    fn natural(&self, internal: &[f64]) -> Vec<f64> {
        internal.to_vec()
    }

    /// ∂θ/∂x of such coordinates; `None` for the identity.
    fn natural_jacobian(&self, internal: &[f64]) -> Option<Array2<f64>> {
        let _ = internal;
        None
    }
}
