//! The exam of a diagnosis: which questions it has, and how each is made.
//!
//! A question is drawn from its seed alone; its strength is set by a twin without the effect and least squares. No diagnosis is called.

pub mod families;
mod paper;
mod pose;
mod write;

pub use paper::{Aim, Question, Set, paper};
pub use pose::{Class, Posed, pose};
pub use write::write;
