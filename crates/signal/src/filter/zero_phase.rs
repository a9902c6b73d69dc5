//! Filtering forward and backward, so that nothing is delayed.

use super::{FilterError, SosFilter};

impl SosFilter {
    /// The signal filtered forward and backward: zero phase, |H|² in gain (`scipy.signal.sosfiltfilt` with its
    /// default padding: at both ends the signal is continued by its odd reflection, over three times the number of taps).
    ///
    /// # Errors
    /// [`FilterError::TooShort`] if the signal is not longer than the padding.
    ///
    /// ```
    /// use ndof_signal::{Passband, SosFilter};
    /// let filter = SosFilter::butterworth(4, Passband::Low(5.0), 100.0)?;
    /// let line: Vec<f64> = (0..500).map(|k| 0.5 * k as f64).collect();
    /// let smooth = filter.filter_zero_phase(&line)?;
    /// assert!((smooth[250] - line[250]).abs() < 1e-6);
    /// # Ok::<(), ndof_signal::FilterError>(())
    /// ```
    pub fn filter_zero_phase(&self, signal: &[f64]) -> Result<Vec<f64>, FilterError> {
        let pad = self.padding();
        let [start, .., end] = signal else {
            return Err(FilterError::TooShort { found: signal.len(), needed: pad + 1 });
        };
        if signal.len() <= pad {
            return Err(FilterError::TooShort { found: signal.len(), needed: pad + 1 });
        }
        let before = signal[1..=pad].iter().rev().map(|x| 2.0 * start - x);
        let after = signal[signal.len() - 1 - pad..signal.len() - 1].iter().rev().map(|x| 2.0 * end - x);
        let mut extended: Vec<f64> = before.chain(signal.iter().copied()).chain(after).collect();
        for _ in 0..2 {
            self.stream_settled_at(extended[0]).process(&mut extended);
            extended.reverse();
        }
        extended.truncate(pad + signal.len());
        Ok(extended.split_off(pad))
    }

    fn padding(&self) -> usize {
        let first_order = self.sections.iter().filter(|s| s.b[2] == 0.0).count().min(self.sections.iter().filter(|s| s.a[1] == 0.0).count());
        3 * (2 * self.sections.len() + 1 - first_order)
    }
}

#[cfg(test)]
mod tests {
    use crate::{FilterError, Passband, SosFilter};

    #[test]
    fn a_tone_keeps_its_phase_and_takes_the_squared_gain() {
        let (fs, f) = (200.0, 8.0);
        let filter = SosFilter::butterworth(3, Passband::Low(10.0), fs).expect("valid");
        let x: Vec<f64> = (0..2000).map(|k| (std::f64::consts::TAU * f * f64::from(k) / fs).sin()).collect();
        let y = filter.filter_zero_phase(&x).expect("long enough");
        let gain = filter.response(f, fs).norm_sqr();
        // The end effects of a third-order 10 Hz filter are gone after a second.
        for k in 400..1600 {
            assert!((y[k] - gain * x[k]).abs() < 1e-9, "{k}");
        }
    }

    #[test]
    fn a_signal_shorter_than_the_padding_is_refused() {
        let filter = SosFilter::butterworth(4, Passband::Low(10.0), 100.0).expect("valid");
        assert_eq!(filter.filter_zero_phase(&[0.0; 15]).unwrap_err(), FilterError::TooShort { found: 15, needed: 16 });
        assert!(filter.filter_zero_phase(&[0.0; 16]).is_ok());
        assert_eq!(filter.filter_zero_phase(&[]).unwrap_err(), FilterError::TooShort { found: 0, needed: 16 });
    }
}
