//! One file a subcommand.

pub mod check;
pub mod cohort;
pub mod compare;
pub mod completions;
pub mod convert;
pub mod design;
pub mod diagnose;
pub mod estimate;
pub mod fit;
pub mod list;
pub mod live;
pub mod schema;
pub mod simulate;
pub mod study;
