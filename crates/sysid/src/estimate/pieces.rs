//! Trials of several lengths as pieces of one.

use ndof_signal::Recording;
use std::ops::Range;

/// Trials cut into pieces of one length, as local methods look at them: a grid of lines is that of one length.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Pieces {
    /// Samples of each.
    pub len: usize,
    /// Of which trial, and where in it.
    pub of: Vec<(usize, Range<usize>)>,
}

impl Pieces {
    /// Of the trials' own lengths the L with the largest n √L, where n samples are in whole pieces of it: intervals go by 1/√n, and the width that polynomials
    /// look over by 1/L; how much of one is worth the other no theory says, and here pieces four times as long make up for half of the samples. Trials of one length are a piece each.
    ///
    /// ```
    /// use ndof_sysid::Pieces;
    /// assert_eq!(Pieces::of_lengths(&[50, 50]).of, [(0, 0..50), (1, 0..50)]);
    /// assert_eq!(Pieces::of_lengths(&[40, 81]).of, [(0, 0..40), (1, 0..40), (1, 40..80)]);
    /// assert_eq!(Pieces::of_lengths(&[12, 30]).of, [(1, 0..30)]); // not 12, 12 and 12
    /// ```
    pub fn of_lengths(lengths: &[usize]) -> Self {
        let worth = |len: &usize| lengths.iter().map(|own| own / len * len).sum::<usize>() as f64 * (*len as f64).sqrt();
        let len = lengths.iter().copied().filter(|len| *len > 0).max_by(|a, b| worth(a).total_cmp(&worth(b))).unwrap_or(0);
        let of = |(trial, own): (usize, &usize)| (0..own.checked_div(len).unwrap_or(0)).map(move |k| (trial, k * len..(k + 1) * len)).collect::<Vec<_>>();
        Pieces { len, of: lengths.iter().enumerate().flat_map(of).collect() }
    }

    /// Those of recordings.
    pub fn new(trials: &[&Recording]) -> Self {
        Pieces::of_lengths(&trials.iter().map(|trial| trial.len()).collect::<Vec<_>>())
    }

    /// All channels of each piece.
    pub(crate) fn channels<'a>(&self, trials: &[&'a Recording]) -> impl Iterator<Item = Vec<&'a [f64]>> {
        self.of.iter().map(|(trial, range)| trials[*trial].channels().iter().map(|channel| &channel.samples[range.clone()]).collect())
    }

    /// Share of so many samples that is in them.
    pub(crate) fn share(&self, samples: usize) -> f64 {
        (self.len * self.of.len()) as f64 / samples as f64
    }
}
