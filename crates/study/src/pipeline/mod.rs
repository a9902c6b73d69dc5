//! From trials to results, without flags and without files.

mod assumptions;
mod cases;
mod check;
mod command;
mod compare;
mod confidence;
mod design;
mod diagnose;
mod estimate;
mod fit;
mod hide;
mod live;
mod method;
mod named_models;
mod overlay;
mod pairs;
mod project;
mod reliability;
mod repeat;
mod riddle;
mod robot_side;
mod sensitivity;
mod simulate;
mod streamed;
mod study;
mod summed;

pub use cases::{run_cases, study_result};
pub use check::check;
pub(crate) use check::quality;
pub use compare::{compare_fits, compare_sessions};
pub use design::{DesignSettings, Designed, Limits, LooseLimb, Target, design};
pub use diagnose::{DiagnoseSettings, HoldOut, diagnose, diagnose_with_pictures};
pub use estimate::{EstimateSettings, Estimated, estimate};
pub use fit::{DELAY_FLOOR_S, FLOORS, FitCost, FitSettings, Fitted, VafWeight, fit, model_response};
pub use live::{Live, LiveSettings};
pub use method::MethodName;
pub use named_models::MODEL;
pub use overlay::{Leftover, Overlay, Run, leftover, overlay};
pub use project::project;
pub use simulate::{JointTruth, Matrices, Simulated, Truth, simulate};
pub use streamed::Streamed;
pub use study::{ComparedParameter, StudyOutcome, compare, run_study};

/// Called with what is done, how much of it and of how much; from any thread.
pub type Progress<'a> = dyn Fn(&'static str, usize, usize) + Sync + 'a;
