//! Results of studies as sections of a report.

mod cases;
mod design;
mod excitation;
mod sensitivity;
mod study;
mod tables;

pub use cases::{cases_report, summary_tables};
pub use design::design_report;
pub use excitation::excitation_report;
pub use study::study_report;
