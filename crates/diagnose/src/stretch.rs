//! A part of the recorded data.

use std::ops::Range;

/// A part of the trials of one experiment.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Stretch {
    /// The trials with these indices, whole.
    Trials(Vec<usize>),
    /// These samples of every trial.
    Samples(Range<usize>),
}
