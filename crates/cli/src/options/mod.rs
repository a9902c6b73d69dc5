//! Options that several subcommands share, and what they mean.

mod analysis;
mod parse;
mod reading;
mod shared;

pub use analysis::Analysis;
pub use parse::{not_negative, pair, positive, words};
pub use reading::Reading;
pub use shared::Shared;
