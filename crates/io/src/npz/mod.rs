//! NPZ, NumPy's archive of arrays: one 1-D array a channel.
//!
//! `sample_rate_hz` (or `fs`) is a single number, or there is a vector `t`. Units stand under `unit/NAME` and facts
//! under `metadata/KEY` as text, so that `numpy.load(file)["force_x"]` is the plain channel.

pub(crate) mod npy;
mod read;
mod write;

pub(crate) use read::arrays_of;
pub(crate) use read::read;
pub(crate) use write::write;
pub(crate) use write::zip;

/// The format's name in messages.
const NPZ: &str = "NPZ";
