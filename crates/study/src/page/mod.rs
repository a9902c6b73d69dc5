//! Results as sections of a report.

mod cases;
mod convert;
mod design;
mod diagnosis;
mod estimate;
mod fit;
mod overlay;
mod sensitivity;
mod study;
mod tables;

pub use cases::{cases_report, summary_tables};
pub use design::design_report;
pub use diagnosis::diagnosis_report;
pub use estimate::estimate_report;
pub use fit::fit_report;
pub use study::study_report;
