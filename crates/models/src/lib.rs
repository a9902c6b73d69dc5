//! Mechanical models, the effects that extend them, and their fitting.

mod force_law;

pub use force_law::{ForceLaw, Motion, Stage};
