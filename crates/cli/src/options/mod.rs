//! Options that several subcommands share, and what they mean.

mod channels;
mod cycles;
mod in_file;
mod limb;
mod measured;
mod reading;
mod shared;

pub use channels::Channels;
pub use cycles::CycleOptions;
pub use limb::Limb;
pub use measured::Recordings;
pub use reading::{Reading, measured};
pub use shared::{Shared, refuse_unused, unused};
