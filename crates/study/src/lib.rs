//! Experiments and studies as data: the pipeline from design to report, and the results that other programs read.
//!
//! [`Trials`] are recordings with roles; [`estimate`], [`fit`] and [`run_study`] go from there to the results of
//! [`result`]; [`file`](mod@file) holds what people write.

mod error;
pub mod file;
mod limits;
mod page;
mod pipeline;
pub mod result;
mod roles;
mod suggest;
mod trials;
mod trim;
mod words;

pub use error::StudyError;
pub use page::{cases_report, design_report, diagnosis_report, estimate_report, fit_report, study_report, summary_tables};
pub use pipeline::{
    ComparedParameter, DELAY_FLOOR_S, DesignSettings, Designed, DiagnoseSettings, EstimateSettings, Estimated, FLOORS, FitCost, FitSettings, Fitted, HoldOut,
    JointTruth, Leftover, Limits, Live, LiveSettings, LooseLimb, MODEL, Matrices, MethodName, Overlay, Progress, Run, Simulated, Streamed, StudyOutcome,
    Target, Truth, VafWeight, check, compare, compare_fits, compare_sessions, design, diagnose, diagnose_with_pictures, estimate, fit, leftover,
    model_response, overlay, project, run_cases, run_study, simulate, study_result,
};
pub use roles::{RoleNames, Roles, axis_of};
pub use suggest::{nearest, window_named};
pub use trials::{Trial, Trials};
pub use trim::Trim;
pub use words::{p_value, sentence};
