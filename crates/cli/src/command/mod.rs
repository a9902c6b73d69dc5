//! One file a subcommand.

pub mod check;
pub mod cohort;
pub mod compare;
// A page has no shell, and reads no schema: they would be a twentieth of what it loads.
#[cfg(not(target_family = "wasm"))]
pub mod completions;
pub mod convert;
pub mod design;
pub mod diagnose;
pub mod estimate;
pub mod fit;
pub mod list;
pub mod live;
#[cfg(not(target_family = "wasm"))]
pub mod schema;
pub mod simulate;
pub mod study;
