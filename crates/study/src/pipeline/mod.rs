//! From trials to results, without flags and without files.

mod confidence;
mod estimate;

pub use estimate::{EstimateSettings, Estimated, MethodName, estimate};
