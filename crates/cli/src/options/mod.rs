//! Options that several subcommands share, and what they mean.

mod channels;
mod events;
mod limb;
mod measured;
mod reading;
mod shared;

pub use channels::Channels;
pub use events::read_events;
pub use limb::Limb;
pub use measured::Recordings;
pub use reading::{Reading, measured};
pub use shared::{Shared, refuse_unused, unused};
