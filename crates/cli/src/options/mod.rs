//! Options that several subcommands share, and what they mean.

mod analysis;
mod channels;
mod limb;
mod parse;
mod reading;
mod shared;

pub use analysis::Analysis;
pub use channels::Channels;
pub use limb::Limb;
pub use parse::{count, not_negative, number, pair, positive, whole, words};
pub use reading::Reading;
pub use shared::{Shared, unused};
