//! Results as sections of a report.

mod convert;
mod diagnosis;
mod estimate;
mod fit;
mod study;

pub use diagnosis::diagnosis_report;
pub use estimate::estimate_report;
pub use fit::fit_report;
pub use study::study_report;
