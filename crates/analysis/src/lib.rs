//! Recordings in, results out: what is wrong with them, the frequency response, a mechanical model, its projection to joints, what
//! changed, what a simulation gets wrong, and how far a measurement has come.
//!
//! [`Trial`] and [`Trials`] are recordings with roles. Each task is a struct of settings ([`Estimate`], [`Fit`], [`Diagnose`]), which is also
//! a table of a study's file, and a function; what it gives holds one `result` that other programs read as JSON.

#![cfg_attr(docsrs, feature(doc_cfg))]

pub mod check;
pub mod compare;
pub mod diagnose;
mod error;
pub mod estimate;
pub mod file;
pub mod fit;
pub mod live;
mod nested;
#[cfg(feature = "clap")]
pub mod options;
mod response;
pub mod result;
mod schedule;
mod suggest;
mod trials;

pub use check::check;
pub use compare::{compare_fits, compare_sessions};
pub use diagnose::{AddedEffort, Diagnose, Diagnosed, HeldOut, Question, diagnose, diagnose_simulator};
pub use error::{AnalysisError, in_order};
pub use estimate::{ApartRecording, Estimate, Estimated, MethodName, Streamed, estimate, estimate_apart, estimate_to_fit};
pub use fit::{
    ComparedParameter, DELAY_FLOOR_S, FLOORS, Fit, FitCost, Fitted, Leftover, MODEL, Overlay, Run, VafWeight, fit, fit_response, leftover, overlay, project,
};
pub use live::{Enough, Live};
pub use response::MeasuredResponse;
pub use result::log_spaced;
pub use schedule::{Events, PHASE, TIME};
pub use suggest::{did_you_mean, nearest, window_named};
pub use trials::{Channels, RoleNames, Roles, Trial, Trials, Trim, axis_of};
