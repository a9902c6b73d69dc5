//! Samples that arrive together.

use crate::note::Note;
use ndof_signal::Recording;

/// Samples that arrived together.
#[derive(Clone, Debug, PartialEq)]
pub struct Piece {
    /// The samples in SI units, on the clock of the file; a missing one is NaN.
    pub recording: Recording,
    /// Whether it goes on where the piece before ended, without a gap.
    pub follows: bool,
    /// What was done to read it.
    pub notes: Vec<Note>,
}
