//! Models, effects and fits, in one program: each file is a theme.

#![expect(clippy::duplicate_mod, reason = "two examples bring the same module, each for itself")]

mod ankle;
mod edges;
mod effects;
mod estimates;
mod fit_statistics;
mod free_run;
mod identifiable;
mod levenberg_marquardt;
mod limb_noise;
mod measured;
mod model_selection;
mod pieces;
mod recovery_table;
mod reflex_selection;
mod schedule;
mod support;
mod told_six_axes;
mod weighted_fit;

#[path = "../../examples/support/records.rs"]
mod records;
#[path = "../../examples/support/recovery.rs"]
mod recovery;
#[path = "../../examples/support/recovery_frequency.rs"]
mod recovery_frequency;
#[path = "../../examples/support/six_axes.rs"]
mod six_axes;
