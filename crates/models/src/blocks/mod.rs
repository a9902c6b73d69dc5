//! Linear elements that extend a baseline: one scalar function of s each, and the place where it acts.
//!
//! [`Composite`] puts any number of [`Block`]s onto a baseline; the result is a [`ParametricModel`](crate::ParametricModel)
//! like any other.

mod composite;
pub(crate) mod elements;
mod registry;

pub use composite::{Composite, Place, Placed};
pub use elements::{Delay, FirstOrderFilter, FlexibleMode, Fractional, Reflex, SecondOrderFilter, SeriesCompliance, StandardLinearSolid};
pub use registry::{BLOCKS, BlockCard, find};

use num_complex::Complex64;

/// A parameter of a block.
#[derive(Clone, Debug, PartialEq)]
pub struct BlockParameter {
    /// Name with unit.
    pub name: String,
    /// SI unit.
    pub unit: String,
    /// Least value that makes sense.
    pub lower: f64,
    /// Largest value that makes sense.
    pub upper: f64,
    /// Where searches begin; every combination with those of the other parameters is tried.
    pub starts: Vec<f64>,
}

impl BlockParameter {
    pub(crate) fn new(name: impl Into<String>, unit: impl Into<String>, bounds: (f64, f64), starts: &[f64]) -> Self {
        BlockParameter { name: name.into(), unit: unit.into(), lower: bounds.0, upper: bounds.1, starts: starts.to_vec() }
    }
}

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

    /// How it leaves the baseline as it is.
    fn vanishes(&self) -> Vanishing;
}
