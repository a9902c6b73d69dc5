//! Welch's method on samples that arrive piece by piece.

use super::plan::Plan;
use super::sum::Sum;
use super::{BLOCK, Welch, WelchError};
use crate::cross_spectra::CrossSpectra;
use crate::segments::require_finite;
use num_complex::Complex64;
use std::sync::Arc;

impl Welch {
    /// An estimator that takes samples as they come, with memory for a few segments only.
    ///
    /// # Errors
    /// [`WelchError`] if the settings contradict each other.
    pub fn stream(&self, sample_rate_hz: f64, channels: usize) -> Result<WelchStream, WelchError> {
        self.validate()?;
        let plan = Plan::of(self);
        Ok(WelchStream {
            sum: Sum::new(&plan.transform, channels),
            total: Vec::new(),
            waiting: vec![Vec::with_capacity(2 * self.nperseg); channels],
            settings: self.clone(),
            plan,
            sample_rate_hz,
            segments: 0,
            seen: 0,
        })
    }
}

/// Welch's method on samples that arrive piece by piece.
///
/// ```
/// use ndof_signal::Welch;
/// let x: Vec<f64> = (0..5000).map(|k| (k as f64).sin()).collect();
/// let welch = Welch::new(256);
/// let mut stream = welch.stream(100.0, 1)?;
/// for piece in x.chunks(77) {
///     stream.push(&[piece])?;
/// }
/// assert_eq!(stream.spectra()?, welch.spectra(100.0, &[&x])?);
/// # Ok::<(), ndof_signal::WelchError>(())
/// ```
#[derive(Clone)]
pub struct WelchStream {
    settings: Welch,
    plan: Arc<Plan>,
    sum: Sum,
    total: Vec<Complex64>,
    waiting: Vec<Vec<f64>>,
    sample_rate_hz: f64,
    segments: usize,
    seen: usize,
}

impl WelchStream {
    /// Takes the next samples of every channel.
    ///
    /// # Errors
    /// [`WelchError`] if there are other channels, if the pieces differ in length or hold a NaN; nothing is taken then.
    pub fn push(&mut self, channels: &[&[f64]]) -> Result<(), WelchError> {
        if channels.len() != self.waiting.len() {
            return Err(WelchError::Channels { expected: self.waiting.len(), found: channels.len() });
        }
        let expected = channels.first().map_or(0, |c| c.len());
        require_finite(channels, expected, self.seen)?;
        self.seen += expected;
        for (waiting, samples) in self.waiting.iter_mut().zip(channels) {
            waiting.extend_from_slice(samples);
        }
        let (nperseg, hop) = (self.settings.nperseg, self.settings.hop());
        let mut at = 0;
        while self.waiting.first().is_some_and(|w| w.len() >= at + nperseg) {
            self.sum.add(&self.plan.transform, self.waiting.iter().map(|c| &c[at..at + nperseg]));
            self.segments += 1;
            at += hop;
            if self.segments.is_multiple_of(BLOCK) {
                self.sum.drain_into(&self.plan.transform, 1.0, &mut self.total);
            }
        }
        self.waiting.iter_mut().for_each(|w| drop(w.drain(..at)));
        Ok(())
    }

    /// Segments complete so far.
    pub fn segments(&self) -> usize {
        self.segments
    }

    /// The spectra of all samples so far; the stream goes on.
    ///
    /// # Errors
    /// [`WelchError::TooShort`] while there is no whole segment.
    pub fn spectra(&self) -> Result<CrossSpectra, WelchError> {
        self.clone().finish()
    }

    /// The spectra of all samples, without a copy of their sums.
    ///
    /// # Errors
    /// [`WelchError::TooShort`] if there is no whole segment.
    pub fn finish(mut self) -> Result<CrossSpectra, WelchError> {
        if self.segments == 0 {
            return Err(WelchError::TooShort { len: self.seen, nperseg: self.settings.nperseg });
        }
        let scale = self.plan.scale(self.sample_rate_hz, self.segments);
        let mut lower = self.total;
        if !self.segments.is_multiple_of(BLOCK) {
            self.sum.drain_into(&self.plan.transform, scale, &mut lower);
        } else {
            lower.iter_mut().for_each(|s| *s *= scale);
        }
        Ok(self.settings.finish(&self.plan, self.sample_rate_hz, self.waiting.len(), self.segments, lower))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::segments::SamplesError;

    #[test]
    fn a_whole_block_is_the_same_bytes_too() {
        let x: Vec<f64> = (0..8 * (BLOCK + 1)).map(|k| (k as f64 * 0.7).sin() + (k as f64 * 2.3).cos()).collect();
        let welch = Welch { noverlap: 8, ..Welch::new(16) };
        let mut stream = welch.stream(10.0, 1).expect("valid");
        assert!(matches!(stream.spectra(), Err(WelchError::TooShort { len: 0, nperseg: 16 })) && stream.segments() == 0);
        stream.push(&[&x]).expect("finite");
        assert_eq!((stream.segments(), stream.spectra().expect("a block")), (BLOCK, welch.spectra(10.0, &[&x]).expect("valid")));
    }

    #[test]
    fn pieces_that_do_not_fit_are_refused_and_nothing_of_them_is_taken() {
        let welch = Welch::new(8);
        let (x, y) = ([1.0, -2.0, 3.0, 0.5, 2.0, 1.0, -1.0, 4.0], [0.0, 1.0, 1.0, 2.0, 0.0, 0.0, 5.0, 1.0]);
        let mut stream = welch.stream(10.0, 2).expect("valid");
        stream.push(&[&x[..5], &y[..5]]).expect("finite");
        assert!(matches!(stream.push(&[&x[..2], &y[..1]]), Err(WelchError::Samples(SamplesError::Length { channel: 1, expected: 2, found: 1 }))));
        assert_eq!(stream.push(&[&x[..2]]), Err(WelchError::Channels { expected: 2, found: 1 }));
        assert_eq!(stream.push(&[]), Err(WelchError::Channels { expected: 2, found: 0 }));
        assert_eq!(stream.push(&[&x[..2]; 3]), Err(WelchError::Channels { expected: 2, found: 3 }));
        assert_eq!(stream.push(&[&[0.0, 1.0], &[0.0, f64::NAN]]), Err(SamplesError::NotFinite { channel: 1, sample: 6 }.into()));
        stream.push(&[&x[5..], &y[5..]]).expect("finite");
        assert_eq!(stream.spectra().expect("a segment"), welch.spectra(10.0, &[&x, &y]).expect("valid"));
    }
}
