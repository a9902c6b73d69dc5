//! Experiments and studies as files: simulation, design of perturbations, and whole studies with their cases.
//!
//! [`run_study`] goes from a [`StudyFile`](file::StudyFile) to what the analyses of [`ndof_analysis`] make of it.

#![cfg_attr(docsrs, feature(doc_cfg))]

mod analysed;
pub mod cases;
mod command;
pub mod design;
mod error;
pub mod file;
mod limits;
mod moving;
mod page;
mod run;
pub mod sensitivity;
mod simulate;

pub use cases::{run_cases, study_result};
pub use design::{Design, Designed, ExcitedRobot, LooseLimb, RobotMotion, Target, design};
pub use error::StudyError;
pub use page::{cases_report, design_report, excitation_report, study_report, summary_tables};
pub use run::{StudyOutcome, analyse, run_study};
pub use simulate::{JointTruth, Matrices, Simulated, Truth, simulate};

/// Called with what is done, how much of it and of how much; from any thread.
pub type Progress<'a> = dyn Fn(&'static str, usize, usize) + Sync + 'a;
