//! What a caller adds to what a file says.

use std::collections::BTreeMap;

/// Onto which rate irregular time is interpolated.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Resample {
    /// The median step of the file.
    Auto,
    /// This rate in Hz.
    Hz(f64),
}

/// How to read a file; the default trusts the file alone and refuses missing samples.
///
/// ```
/// let options = ndof_io::ReadOptions { sample_rate_hz: Some(500.0), ..Default::default() };
/// assert!(options.resample.is_none());
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ReadOptions {
    /// Samples a second, for a file that has neither a time column nor a rate.
    pub sample_rate_hz: Option<f64>,
    /// Repair irregular time by interpolation onto a regular grid; without it irregular time is an error.
    pub resample: Option<Resample>,
    /// The unit of a channel where the file gives none or a wrong one, by channel name.
    pub units: BTreeMap<String, String>,
    /// Keep missing samples as NaN instead of refusing the file.
    pub allow_nan: bool,
}
