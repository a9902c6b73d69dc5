//! What each fuzz target does with arbitrary bytes: a right answer or an error, in bounded time and memory, never a panic.

mod estimators;
#[cfg(feature = "files")]
mod files;
mod fits;
#[cfg(feature = "files")]
mod laboratory;
mod numbers;
mod response;

pub use estimators::estimators;
#[cfg(feature = "files")]
pub use files::{json, recording, robot, toml};
pub use fits::fits;
#[cfg(feature = "files")]
pub use laboratory::{response, trials};
