//! Options that several subcommands share, and what they mean.

mod channels;
mod limb;
mod reading;
mod shared;

pub use channels::Channels;
pub use limb::Limb;
pub use reading::{Reading, measured};
pub use shared::{Shared, refuse_unused, unused};
