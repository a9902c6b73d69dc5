//! Results as sections of a report.

mod cases;
mod convert;
mod diagnosis;
mod estimate;
mod fit;
mod study;
mod tables;

pub use cases::{cases_report, summary_tables};
pub use diagnosis::diagnosis_report;
pub use estimate::estimate_report;
pub use fit::fit_report;
pub use study::study_report;
