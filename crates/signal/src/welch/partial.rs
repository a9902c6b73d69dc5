//! Welch's method shared out among workers that see only their stretch of the record.

use super::plan::Plan;
use super::sum::Sum;
use super::{BLOCK, Welch, WelchError};
use crate::cross_spectra::CrossSpectra;
use crate::segments::{count, require_finite};
use num_complex::Complex64;
use serde::{Deserialize, Serialize};
use std::ops::Range;

/// The sums of some blocks of 64 segments, to be merged with those of the other workers.
///
/// ```
/// use ndof_signal::Welch;
/// let x: Vec<f64> = (0..20_000).map(|k| (k as f64 * 0.7).sin()).collect();
/// let welch = Welch::new(128);
/// let blocks = welch.blocks(x.len());
/// let halves = [0..2, 2..blocks].map(|blocks| {
///     let mine = &x[welch.block_samples(blocks.clone(), x.len())];
///     welch.partial(blocks, x.len(), &[mine])
/// });
/// let [first, second] = halves;
/// let merged = first?.merge(second?)?.spectra(100.0)?;
/// assert_eq!(merged, welch.spectra(100.0, &[&x])?);
/// # Ok::<(), ndof_signal::WelchError>(())
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct WelchPartial {
    settings: Welch,
    channels: usize,
    /// Samples in the whole record.
    len: usize,
    /// Each block with its index, in order.
    sums: Vec<(usize, Vec<Complex64>)>,
}

impl Welch {
    /// Number of blocks of up to 64 segments in a record of `len` samples; work is shared out in whole blocks.
    pub fn blocks(&self, len: usize) -> usize {
        self.segments(len).div_ceil(BLOCK)
    }

    /// The samples that a worker needs for `blocks` of a record of `len` samples.
    pub fn block_samples(&self, blocks: Range<usize>, len: usize) -> Range<usize> {
        let segments = blocks.start * BLOCK..self.segments(len).min(blocks.end * BLOCK);
        if segments.is_empty() { 0..0 } else { segments.start * self.hop()..(segments.end - 1) * self.hop() + self.nperseg }
    }

    fn segments(&self, len: usize) -> usize {
        if self.validate().is_ok() { count(len, self.nperseg, self.hop()) } else { 0 }
    }

    /// The sums of `blocks` of a record of `len` samples, of whose channels only the stretch
    /// [`block_samples`](Self::block_samples) is given.
    ///
    /// # Errors
    /// [`WelchError`] if the settings contradict each other, the stretch has another length, or it holds a NaN.
    pub fn partial(&self, blocks: Range<usize>, len: usize, channels: &[&[f64]]) -> Result<WelchPartial, WelchError> {
        self.validate()?;
        let stretch = self.block_samples(blocks.clone(), len);
        require_finite(channels, stretch.len(), stretch.start)?;
        let plan = Plan::of(self);
        let mut sum = Sum::new(&plan.transform, channels.len());
        let sums = blocks
            .filter(|block| block * BLOCK < self.segments(len))
            .map(|block| {
                for k in block * BLOCK..self.segments(len).min((block + 1) * BLOCK) {
                    let at = k * self.hop() - stretch.start;
                    sum.add(&plan.transform, channels.iter().map(|c| &c[at..at + self.nperseg]));
                }
                let mut total = Vec::new();
                sum.drain_into(&plan.transform, 1.0, &mut total);
                (block, total)
            })
            .collect();
        Ok(WelchPartial { settings: self.clone(), channels: channels.len(), len, sums })
    }
}

impl WelchPartial {
    /// Both together, in any order.
    ///
    /// # Errors
    /// [`WelchError::Merge`] if they are not parts of one analysis of one record, or share a block.
    pub fn merge(mut self, other: WelchPartial) -> Result<WelchPartial, WelchError> {
        if self.settings != other.settings || self.channels != other.channels || self.len != other.len {
            return Err(WelchError::Merge { why: "they differ in settings, channels or length of the record" });
        }
        self.sums.extend(other.sums);
        self.sums.sort_by_key(|(block, _)| *block);
        if self.sums.windows(2).any(|pair| pair[0].0 == pair[1].0) {
            return Err(WelchError::Merge { why: "both hold the same block" });
        }
        Ok(self)
    }

    /// Whether every block of the record is there.
    pub fn is_complete(&self) -> bool {
        !self.sums.is_empty() && self.sums.len() == self.settings.blocks(self.len)
    }

    /// The spectra, with the same bytes as [`Welch::spectra`] of the whole record.
    ///
    /// # Errors
    /// [`WelchError::Merge`] if blocks are missing, [`WelchError::TooShort`] if the record has none.
    pub fn spectra(self, sample_rate_hz: f64) -> Result<CrossSpectra, WelchError> {
        let segments = self.settings.segments(self.len);
        if segments == 0 {
            return Err(WelchError::TooShort { len: self.len, nperseg: self.settings.nperseg });
        }
        if self.sums.len() != self.settings.blocks(self.len) {
            return Err(WelchError::Merge { why: "blocks are missing" });
        }
        let mut sums = self.sums.into_iter().map(|(_, sum)| sum);
        let mut total = sums.next().unwrap_or_default();
        sums.for_each(|sum| total.iter_mut().zip(sum).for_each(|(t, s)| *t += s));
        let plan = Plan::of(&self.settings);
        let scale = plan.scale(sample_rate_hz, segments);
        total.iter_mut().for_each(|t| *t *= scale);
        Ok(self.settings.finish(&plan, sample_rate_hz, self.channels, segments, total))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::segments::SamplesError;

    fn record() -> [Vec<f64>; 2] {
        let x: Vec<f64> = (0..30_000).map(|k| (f64::from(k) * f64::from(k) * 0.01).sin()).collect();
        let y = x.iter().scan(0.0, |state, x| Some(std::mem::replace(state, 0.9 * *state + x))).collect();
        [x, y]
    }

    #[test]
    fn any_split_on_block_borders_gives_the_same_bytes() {
        let [x, y] = record();
        let welch = Welch { noverlap: 96, ..Welch::new(128) };
        let whole = welch.spectra(10.0, &[&x, &y]).expect("valid");
        let blocks = welch.blocks(x.len());
        for split in 0..=blocks {
            let part = |blocks: Range<usize>| {
                let mine = welch.block_samples(blocks.clone(), x.len());
                welch.partial(blocks, x.len(), &[&x[mine.clone()], &y[mine]]).expect("valid")
            };
            let merged = part(split..blocks).merge(part(0..split)).expect("disjoint");
            assert!(merged.is_complete() && part(0..split).is_complete() == (split == blocks));
            let merged = merged.spectra(10.0).expect("complete");
            assert_eq!(merged, whole, "split at {split}");
        }
    }

    #[test]
    fn blocks_beyond_the_record_add_nothing() {
        let x = &record()[0][..2 * BLOCK * 64];
        let welch = Welch { noverlap: 0, ..Welch::new(64) };
        assert_eq!(welch.blocks(x.len()), 2);
        let part = welch.partial(0..3, x.len(), &[x]).expect("valid");
        assert!(part.is_complete());
        assert_eq!(part.spectra(10.0).expect("complete"), welch.spectra(10.0, &[x]).expect("valid"));
    }

    #[test]
    fn parts_that_do_not_fit_are_refused() {
        let [x, _] = record();
        let welch = Welch::new(128);
        let part = |welch: &Welch, blocks: Range<usize>| {
            let mine = welch.block_samples(blocks.clone(), x.len());
            welch.partial(blocks, x.len(), &[&x[mine]]).expect("valid")
        };
        assert!(matches!(part(&welch, 0..2).merge(part(&welch, 1..3)), Err(WelchError::Merge { .. })));
        assert!(matches!(part(&welch, 0..2).merge(part(&Welch::new(256), 2..3)), Err(WelchError::Merge { .. })));
        // Alike in all but one: the channels, the record's length.
        let (long, short) = (part(&welch, 0..1), x.len() - 64);
        let two = welch.partial(1..2, x.len(), &[&x[welch.block_samples(1..2, x.len())]; 2]).expect("valid");
        let other = welch.partial(1..2, short, &[&x[welch.block_samples(1..2, short)]]).expect("valid");
        assert!(matches!(long.clone().merge(two), Err(WelchError::Merge { .. })) && matches!(long.merge(other), Err(WelchError::Merge { .. })));
        assert!(matches!(part(&welch, 0..2).spectra(1.0), Err(WelchError::Merge { .. })));
        assert!(matches!(welch.partial(0..1, x.len(), &[&x[..9]]), Err(WelchError::Samples(SamplesError::Length { .. }))));
    }

    #[test]
    fn a_worker_needs_the_samples_of_its_segments() {
        // 256 segments, 32 samples apart.
        let welch = Welch { noverlap: 96, ..Welch::new(128) };
        let (len, hop) = (128 + 255 * 32 + 7, 32);
        let found = [0..1, 1..2, 1..4, 3..9, 4..5].map(|blocks| welch.block_samples(blocks, len));
        assert_eq!(found, [0..63 * hop + 128, 64 * hop..127 * hop + 128, 64 * hop..255 * hop + 128, 192 * hop..255 * hop + 128, 0..0]);
    }

    #[test]
    fn a_missing_number_is_named_by_its_place_in_the_record() {
        let [mut x, _] = record();
        let welch = Welch::new(128);
        let mine = welch.block_samples(1..2, x.len());
        x[mine.start + 9] = f64::NAN;
        let found = welch.partial(1..2, x.len(), &[&x[mine.clone()]]);
        assert_eq!(found.unwrap_err(), SamplesError::NotFinite { channel: 0, sample: mine.start + 9 }.into());
    }
}
