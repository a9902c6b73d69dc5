//! One file a subcommand.

pub mod convert;
pub mod diagnose;
pub mod estimate;
pub mod fit;
pub mod list;
pub mod schema;
pub mod simulate;
pub mod study;
