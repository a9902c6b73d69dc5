//! Results of analyses as sections of a report, and the pages made of them.

mod compare;
mod convert;
mod course;
mod diagnosis;
mod estimate;
mod fit;
mod overlay;
mod path;
mod schedule;
mod words;

pub use compare::compare_report;
pub use convert::{channel_traces, settings_rows};
pub use course::course_section;
pub use diagnosis::{diagnosis_report, sections as diagnosis_sections};
pub use estimate::{coherence_section, estimate_report, frame, power_section, response_section, traces_section};
pub use fit::{agreement_section, ellipse_section, fit_report, parameters_section, response_fit_report};
pub use overlay::overlay_section;
pub use schedule::schedule_section;
pub use words::{p_value, percent, sentence};
