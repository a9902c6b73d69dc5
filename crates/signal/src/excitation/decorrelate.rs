//! Signals that an analysis finds incoherent.

use super::input_coherence::{InputCoherence, input_coherence};
use super::limits::apply_response;
use super::{ExcitationError, positive};
use crate::{CrossSpectra, Welch};
use ndarray::Array2;
use num_complex::Complex64;
use serde::{Deserialize, Serialize};

/// Takes from each of several signals what one analysis predicts of it from the others.
///
/// Independent noise has no coherence; a sample of it has about 1/n_e, by chance, and that is what one trial delivers.
/// Each step takes half of every prediction,
///
/// X_i(f) ← X_i(f) − ½ Σ_{j≠i} (S_ij/S_jj)(f) X_j(f),
///
/// which is the symmetric orthogonalisation S^(−½) to first order, so that a few steps end near zero and the signals
/// change by about their coherence. It works on the *sample* in this analysis (window, overlap, length): another
/// setting again shows what chance gives, and a change of the seed is as random as before.
///
/// ```
/// use ndof_signal::{Decorrelation, FilteredNoise};
/// let noise = FilteredNoise { axes: 3, samples: 10_000, ..FilteredNoise::default() }.generate(1)?;
/// let done = Decorrelation::default().apply(&noise, 500.0)?;
/// assert!(done.before.max > 0.2 && done.after.max < 0.01);
/// # Ok::<(), ndof_signal::ExcitationError>(())
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Decorrelation {
    /// The analysis with which the recording will be treated.
    pub welch: Welch,
    /// The band that counts, in Hz.
    pub band_hz: (f64, f64),
    /// The largest coherence that is good enough.
    pub target: f64,
    /// Steps after which to stop all the same.
    pub steps: usize,
    /// Samples at the beginning that will not be analysed.
    pub skip: usize,
}

impl Default for Decorrelation {
    /// The paper's second setting over 0.25 to 15 Hz, to 0.005 within twenty steps.
    fn default() -> Self {
        Decorrelation { welch: Welch::smooth(), band_hz: (0.25, 15.0), target: 0.005, steps: 20, skip: 0 }
    }
}

/// Signals after [`Decorrelation::apply`].
#[derive(Clone, Debug, PartialEq)]
pub struct Decorrelated {
    /// The signals.
    pub signals: Vec<Vec<f64>>,
    /// Coherence before.
    pub before: InputCoherence,
    /// Coherence after.
    pub after: InputCoherence,
    /// Root mean square of the change over that of the signals.
    pub change: f64,
}

impl Decorrelation {
    /// The signals with the lowest largest coherence that the steps came by.
    ///
    /// # Errors
    /// [`ExcitationError`] if the analysis does not fit the signals or the band holds none of its frequencies.
    pub fn apply(&self, signals: &[Vec<f64>], sample_rate_hz: f64) -> Result<Decorrelated, ExcitationError> {
        positive("sample rate in Hz", sample_rate_hz)?;
        let analyse = |signals: &[Vec<f64>]| -> Result<(CrossSpectra, InputCoherence), ExcitationError> {
            let columns: Vec<&[f64]> = signals.iter().map(|signal| signal.get(self.skip..).unwrap_or_default()).collect();
            let spectra = self.welch.spectra(sample_rate_hz, &columns)?;
            let coherence = input_coherence(&spectra, self.band_hz)?;
            Ok((spectra, coherence))
        };
        let (mut spectra, before) = analyse(signals)?;
        let mut best = (before, signals.to_vec());
        let mut current = signals.to_vec();
        // What lies within one window's reach of the band shows in it.
        let margin_hz = 2.0 * sample_rate_hz / self.welch.nperseg as f64;
        // A window's length of silence receives what the correction rings on.
        let padding_s = self.welch.nperseg as f64 / sample_rate_hz;
        for _ in 0..self.steps {
            if best.0.max <= self.target {
                break;
            }
            let reach = (self.band_hz.0 - margin_hz, self.band_hz.1 + margin_hz);
            current = apply_response(&current, sample_rate_hz, padding_s, |hz| correction(&spectra, hz, reach))?;
            let coherence;
            (spectra, coherence) = analyse(&current)?;
            if coherence.max < best.0.max {
                best = (coherence, current.clone());
            }
        }
        let (after, after_signals) = best;
        let square = |x: &mut dyn Iterator<Item = f64>| x.map(|x| x * x).sum::<f64>();
        let changed = square(&mut signals.iter().flatten().zip(after_signals.iter().flatten()).map(|(a, b)| a - b));
        let change = (changed / square(&mut signals.iter().flatten().copied())).sqrt();
        Ok(Decorrelated { signals: after_signals, before, after, change })
    }
}

/// I − ½ (S_ij/S_jj) off the diagonal, between the analysis' frequencies by straight lines; I beyond `reach`.
fn correction(spectra: &CrossSpectra, hz: f64, reach: (f64, f64)) -> Array2<Complex64> {
    let n = spectra.channels();
    let mut out = Array2::eye(n);
    if hz < reach.0 || hz > reach.1 {
        return out;
    }
    let grid = spectra.frequency_hz();
    let Some(step_hz) = grid.get(1).copied() else { return out };
    let below = ((hz / step_hz) as usize).min(grid.len() - 1);
    let above = (below + 1).min(grid.len() - 1);
    let weight = hz / step_hz - below as f64;
    for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))).filter(|(i, j)| i != j) {
        let predicted = |f: usize| if spectra.power(f, j) > 0.0 { spectra.at(f, i, j) / spectra.power(f, j) } else { Complex64::default() };
        out[[i, j]] = -0.5 * (predicted(below) * (1.0 - weight) + predicted(above) * weight);
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{FilteredNoise, SignalSize, power_share};

    #[test]
    fn the_correction_ends_at_its_reach() {
        let noise = FilteredNoise { axes: 2, samples: 4000, ..FilteredNoise::default() }.generate(1).expect("valid");
        let columns: Vec<&[f64]> = noise.iter().map(|x| &x[..]).collect();
        let spectra = Welch::new(500).spectra(500.0, &columns).expect("valid");
        let changes = |hz: f64| correction(&spectra, hz, (2.0, 8.0)) != Array2::<Complex64>::eye(2);
        assert_eq!([0.5, 1.999, 2.0, 5.3, 8.0, 8.001, 30.0].map(changes), [false, false, true, true, true, false, false]);
    }

    #[test]
    fn pairs_and_triples_lose_their_chance_coherence_and_keep_their_power() {
        for axes in [2, 3] {
            let signals = FilteredNoise { axes, rms: 4.0, ..FilteredNoise::default() }.generate(3).expect("valid");
            let done = Decorrelation::default().apply(&signals, 500.0).expect("valid");
            assert!(done.before.max > 0.1 && done.after.max <= 0.005, "{axes} axes: {:?} {:?}", done.before, done.after);
            // Each axis gives up about half of what (q − 1)/n_e of its power the others predict by chance, twice over.
            assert!(done.change < 3.0 * ((axes - 1) as f64 / 23.65).sqrt(), "{}", done.change);
            for (old, new) in signals.iter().zip(&done.signals) {
                let ratio = SignalSize::of(new, 500.0).rms / SignalSize::of(old, 500.0).rms;
                assert!((ratio - 1.0).abs() < 0.2, "{ratio}");
                assert!((power_share(new, 500.0, (0.1, 15.0)) - power_share(old, 500.0, (0.1, 15.0))).abs() < 0.02);
            }
        }
    }

    #[test]
    fn another_setting_sees_what_chance_gives() {
        let signals = FilteredNoise { axes: 2, ..FilteredNoise::default() }.generate(3).expect("valid");
        let done = Decorrelation::default().apply(&signals, 500.0).expect("valid");
        let columns: Vec<&[f64]> = done.signals.iter().map(Vec::as_slice).collect();
        let fine = input_coherence(&Welch::fine().spectra(500.0, &columns).expect("valid"), (0.25, 15.0)).expect("bins");
        // Five segments: 1/n_e is 0.21.
        assert!(fine.mean > 0.1, "{fine:?}");
    }

    #[test]
    fn one_signal_and_zero_steps_stay_as_they_are() {
        let one = FilteredNoise { samples: 5000, ..FilteredNoise::default() }.generate(3).expect("valid");
        assert_eq!(Decorrelation::default().apply(&one, 500.0).expect("valid").signals, one);
        let two = FilteredNoise { axes: 2, samples: 5000, ..FilteredNoise::default() }.generate(3).expect("valid");
        let idle = Decorrelation { steps: 0, ..Decorrelation::default() }.apply(&two, 500.0).expect("valid");
        assert_eq!((idle.signals, idle.change), (two, 0.0));
        assert!(matches!(Decorrelation::default().apply(&[vec![1.0; 100], vec![2.0; 100]], 500.0), Err(ExcitationError::Analysis(_))));
    }

    #[test]
    fn the_correction_is_half_the_prediction_and_goes_straight_from_line_to_line() {
        let noise = FilteredNoise { axes: 2, samples: 4000, ..FilteredNoise::default() }.generate(1).expect("valid");
        let analyse = |x: &[f64], y: &[f64]| Welch::new(250).spectra(500.0, &[x, y]).expect("valid");
        let spectra = analyse(&noise[0], &noise[1]);
        let half = |f: usize, i: usize, j: usize| -0.5 * spectra.at(f, i, j) / spectra.power(f, j);
        // 2 Hz from line to line, the 125th is Nyquist; beyond it that of the last.
        for (hz, line, share) in [(6.0, 3, 0.0), (6.5, 3, 0.25), (9.5, 4, 0.75), (250.0, 125, 0.0), (252.5, 125, 0.0), (255.0, 125, 0.0)] {
            let found = correction(&spectra, hz, (0.0, 300.0));
            for (i, j) in [(0, 1), (1, 0)] {
                let next = if share == 0.0 { half(line, i, j) } else { half(line + 1, i, j) };
                let expected = half(line, i, j) * (1.0 - share) + next * share;
                assert!((found[[i, j]] - expected).norm() < 1e-12 * expected.norm(), "{hz} Hz, {i}, {j}: {found} {expected}");
                assert_eq!(found[[i, i]], Complex64::ONE);
            }
        }
        // Silence predicts nothing.
        assert_eq!(correction(&analyse(&noise[0], &vec![0.0; 4000]), 6.0, (2.0, 8.0)), Array2::eye(2));
    }

    #[test]
    fn a_change_reaches_two_lines_beyond_the_band_and_does_not_come_round_the_end() {
        // Lines 1 Hz apart, and nothing in the first half.
        let mut noise = FilteredNoise { axes: 2, samples: 10_000, cutoff_hz: 60.0, ..FilteredNoise::default() }.generate(1).expect("valid");
        noise.iter_mut().for_each(|x| x[..5000].fill(0.0));
        let once = Decorrelation { welch: Welch::new(500), band_hz: (5.0, 20.0), target: 0.0, steps: 1, skip: 0 };
        let done = once.apply(&noise, 500.0).expect("valid");
        let change: Vec<f64> = done.signals[0].iter().zip(&noise[0]).map(|(new, old)| new - old).collect();
        let share = |band_hz| power_share(&change, 500.0, band_hz);
        assert!(share((21.2, 21.9)) > 0.01 && share((3.1, 3.8)) > 0.01 && share((2.5, 22.5)) > 0.99, "{}", share((2.5, 22.5)));
        let [first, last] = [&change[..500], &change[9500..]].map(|part| SignalSize::of(part, 500.0).rms);
        // What rings on decays slowly, for the correction ends at once; round the end it would come back as a quarter.
        assert!(first < 0.1 * last, "{first} {last}");
    }
}
