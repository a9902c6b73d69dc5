//! The cascade itself: coefficients, frequency response, filtering of a whole signal or sample by sample.

use num_complex::Complex64;
use serde::{Deserialize, Serialize};

/// One second-order section, H(z) = (b₀ + b₁z⁻¹ + b₂z⁻²) / (1 + a₁z⁻¹ + a₂z⁻²).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Section {
    /// Numerator b₀, b₁, b₂.
    pub b: [f64; 3],
    /// Denominator a₁, a₂; a₀ = 1.
    pub a: [f64; 2],
}

impl Section {
    fn gain_at_rest(&self) -> f64 {
        self.b.iter().sum::<f64>() / (1.0 + self.a[0] + self.a[1])
    }

    /// The state that a constant input of one settles to (direct form II transposed).
    fn settled(&self) -> [f64; 2] {
        let gain = self.gain_at_rest();
        let second = self.b[2] - self.a[1] * gain;
        [self.b[1] - self.a[0] * gain + second, second]
    }

    #[inline]
    fn step(&self, state: &mut [f64; 2], x: f64) -> f64 {
        let y = self.b[0] * x + state[0];
        state[0] = self.b[1] * x - self.a[0] * y + state[1];
        state[1] = self.b[2] * x - self.a[1] * y;
        y
    }
}

/// A digital filter as a cascade of second-order sections, which keeps high orders at low corners accurate.
///
/// ```
/// use ndof_signal::{Passband, SosFilter};
/// let filter = SosFilter::butterworth(8, Passband::Low(15.0), 500.0)?;
/// assert!((filter.response(15.0, 500.0).norm() - 0.5_f64.sqrt()).abs() < 1e-12);
/// let smooth = filter.filter(&[1.0; 200]);
/// assert_eq!(smooth.len(), 200);
/// # Ok::<(), ndof_signal::FilterError>(())
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SosFilter {
    pub(super) sections: Vec<Section>,
}

impl SosFilter {
    /// A filter from its sections.
    pub fn from_sections(sections: Vec<Section>) -> Self {
        SosFilter { sections }
    }

    /// The sections, in the order of the signal.
    pub fn sections(&self) -> &[Section] {
        &self.sections
    }

    /// H(e^{j2πf/fs}) at `frequency_hz`.
    pub fn response(&self, frequency_hz: f64, sample_rate_hz: f64) -> Complex64 {
        let back = Complex64::cis(-std::f64::consts::TAU * frequency_hz / sample_rate_hz);
        self.sections.iter().map(|s| (s.b[0] + back * (s.b[1] + back * s.b[2])) / (1.0 + back * (s.a[0] + back * s.a[1]))).product()
    }

    /// The filtered signal, from rest (`scipy.signal.sosfilt`).
    pub fn filter(&self, signal: &[f64]) -> Vec<f64> {
        let mut out = signal.to_vec();
        self.stream().process(&mut out);
        out
    }

    /// A filter at rest, for samples as they come.
    pub fn stream(&self) -> SosStream {
        SosStream { state: vec![[0.0; 2]; self.sections.len()], sections: self.sections.clone() }
    }

    /// A filter that has seen `value` for ever, so that it starts without a transient (`scipy.signal.sosfilt_zi`).
    ///
    /// ```
    /// use ndof_signal::{Passband, SosFilter};
    /// let filter = SosFilter::butterworth(1, Passband::Low(20.0), 500.0)?;
    /// assert!((filter.stream_settled_at(3.0).step(3.0) - 3.0).abs() < 1e-12);
    /// # Ok::<(), ndof_signal::FilterError>(())
    /// ```
    pub fn stream_settled_at(&self, value: f64) -> SosStream {
        let mut level = value;
        let state = self
            .sections
            .iter()
            .map(|section| {
                let state = section.settled().map(|s| s * level);
                level *= section.gain_at_rest();
                state
            })
            .collect();
        SosStream { state, sections: self.sections.clone() }
    }
}

/// A filter with its state: takes samples as they come.
#[derive(Clone, Debug, PartialEq)]
pub struct SosStream {
    sections: Vec<Section>,
    state: Vec<[f64; 2]>,
}

impl SosStream {
    /// The output for the next sample.
    #[inline]
    pub fn step(&mut self, x: f64) -> f64 {
        self.sections.iter().zip(&mut self.state).fold(x, |x, (section, state)| section.step(state, x))
    }

    /// Filters the next samples in place.
    pub fn process(&mut self, samples: &mut [f64]) {
        samples.iter_mut().for_each(|s| *s = self.step(*s));
    }
}

#[cfg(test)]
mod tests {
    use crate::{Passband, Section, SosFilter};
    use num_complex::Complex64;

    #[test]
    fn pieces_give_the_same_bytes_as_the_whole() {
        let filter = SosFilter::butterworth(5, Passband::High(3.0), 100.0).expect("valid");
        let x: Vec<f64> = (0..500).map(|k| (f64::from(k) * 0.7).sin() + 1.0).collect();
        let mut pieces = x.clone();
        let mut stream = filter.stream();
        pieces.chunks_mut(37).for_each(|piece| stream.process(piece));
        assert_eq!(pieces, filter.filter(&x));
    }

    #[test]
    fn a_settled_filter_has_no_transient() {
        for (band, gain) in [(Passband::Low(10.0), 1.0), (Passband::High(10.0), 0.0), (Passband::Band(5.0, 10.0), 0.0)] {
            let filter = SosFilter::butterworth(6, band, 100.0).expect("valid");
            let mut stream = filter.stream_settled_at(2.0);
            for _ in 0..50 {
                assert!((stream.step(2.0) - 2.0 * gain).abs() < 1e-9, "{band:?}");
            }
        }
    }

    #[test]
    fn a_delay_turns_the_response_down() {
        let late = SosFilter::from_sections(vec![Section { b: [0.0, 1.0, 0.0], a: [0.0, 0.0] }]);
        assert!((late.response(10.0, 100.0) - Complex64::cis(-0.2 * std::f64::consts::PI)).norm() < 1e-15);
    }
}
