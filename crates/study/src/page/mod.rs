//! Results as sections of a report.

mod convert;
mod estimate;
mod fit;
mod study;

pub use estimate::estimate_report;
pub use fit::fit_report;
pub use study::study_report;
