//! A recording with what was done to get it.

use crate::error::{IoError, Place};
use ndof_signal::Recording;
/// What reading a file did that its user should know.
pub use ndof_signal::Warning as Note;

/// Samples of a channel that the file does not have.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct MissingSamples {
    /// The channel.
    pub channel: String,
    /// Where the first one is.
    pub place: Place,
    /// How many there are.
    pub count: usize,
    /// Out of how many.
    pub total: usize,
}

/// A recording with what was done to get it.
#[derive(Clone, Debug, PartialEq)]
pub struct ReadRecording {
    /// The file's name, for messages, with that of the trial where the file holds several.
    pub file: String,
    /// The trial's name, in a file that may hold several.
    pub trial: Option<String>,
    /// The samples in SI units.
    pub recording: Recording,
    /// Conversions and assumptions, in the order of the file.
    pub notes: Vec<Note>,
    /// Channels with missing samples; empty unless [`allow_nan`](crate::ReadOptions::allow_nan) is set.
    pub missing: Vec<MissingSamples>,
}

impl ReadRecording {
    /// Checks that the channels `used` (all, if `None`) miss no sample.
    ///
    /// # Errors
    /// [`IoError::Missing`] with the first place.
    pub fn require_complete(&self, used: Option<&[&str]>) -> Result<(), IoError> {
        match self.missing.iter().find(|m| used.is_none_or(|names| names.contains(&m.channel.as_str()))) {
            Some(m) => Err(IoError::Missing { file: self.file.clone(), place: m.place, channel: m.channel.clone(), count: m.count, total: m.total }),
            None => Ok(()),
        }
    }
}
