//! Linear elements that extend a baseline: one scalar function of s each, and the place where it acts.
//!
//! [`Composite`] puts any number of [`Block`]s onto a baseline; the result is a [`ParametricModel`](crate::ParametricModel)
//! like any other.

mod composite;
mod elements;
pub(crate) mod parameter;
mod registry;

pub use composite::{Composite, Place, Placed};
pub use elements::{Delay, FirstOrderFilter, FlexibleMode, Fractional, Reflex, SecondOrderFilter, SeriesCompliance, StandardLinearSolid};
pub use parameter::BlockParameter;
pub use registry::{BLOCKS, BlockCard, find};

use num_complex::Complex64;

/// How a block leaves the baseline as it is, which decides what a likelihood ratio against the model without it is compared with.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Vanishing {
    /// At a value within its bounds: a delay of nothing.
    Inside,
    /// With its only parameter at a bound: a cut-off as high as can be.
    AtBound,
    /// With one parameter at a bound where the others have no effect: a reflex without gain, a mode without mass.
    WithoutEffect,
}

/// A scalar transfer function h(s, θ).
pub trait Block: Send + Sync {
    /// What `ndof list` calls it.
    fn name(&self) -> &'static str;

    /// Its parameters; names and units of a rotation where `rotational`.
    fn parameters(&self, rotational: bool) -> Vec<BlockParameter>;

    /// h(s, θ), and ∂h/∂θ_k into `slopes`.
    fn evaluate(&self, theta: &[f64], s: Complex64, slopes: &mut [Complex64]) -> Complex64;

    /// h(s, θ) alone, of no more than eight parameters.
    fn response(&self, theta: &[f64], s: Complex64) -> Complex64 {
        self.evaluate(theta, s, &mut [Complex64::default(); 8][..theta.len()])
    }

    /// How it leaves the baseline as it is.
    fn vanishes(&self) -> Vanishing {
        Vanishing::WithoutEffect
    }
}
