//! Experiments and studies as data: the pipeline from design to report, and the results that other programs read.

mod error;
pub mod file;
mod pipeline;
pub mod result;
mod roles;
mod suggest;
mod trials;
mod trim;

pub use error::StudyError;
pub use pipeline::{EstimateSettings, Estimated, MethodName, estimate};
pub use roles::{RoleNames, Roles, axis_of};
pub use suggest::nearest;
pub use trials::{Trial, Trials};
pub use trim::Trim;
