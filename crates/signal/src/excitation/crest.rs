//! Phases for a low peak: iterative clipping.

use crate::spread::rms;
use crate::transform::{ComplexToReal, RealToComplex, forward_transform, inverse_transform, signal_by, spectrum_by};
use num_complex::Complex64;
use std::sync::Arc;

/// From lines to a period of samples and back.
pub(super) struct Synthesis {
    forward: Arc<dyn RealToComplex<f64>>,
    inverse: Arc<dyn ComplexToReal<f64>>,
}

impl Synthesis {
    pub(super) fn new(period: usize) -> Self {
        Synthesis { forward: forward_transform(period), inverse: inverse_transform(period) }
    }

    /// Σ_k A_k cos(2πkn/N + φ_k + arg turn).
    pub(super) fn signal(&self, lines: &[usize], amplitudes: &[f64], phases: &[f64], turn: Complex64) -> Vec<f64> {
        let mut spectrum = self.inverse.make_input_vec();
        for ((&k, a), phase) in lines.iter().zip(amplitudes).zip(phases) {
            spectrum[k] = Complex64::from_polar(0.5 * a, *phase) * turn;
        }
        signal_by(self.inverse.as_ref(), &mut spectrum)
    }
}

/// Peak over rms.
pub(super) fn crest_factor(signal: &[f64]) -> f64 {
    let peak = signal.iter().fold(0.0, |m: f64, s| m.max(s.abs()));
    peak / rms(signal)
}

/// Lowers the largest crest factor of one axis over its experiments (each turns all lines by `turns[e]`), in place;
/// returns it before and after.
///
/// Each step clips the signals, takes the phases of what is left and puts the amplitudes back (Van der Ouderaa,
/// Schoukens & Renneboog 1988, *IEEE Trans. Instrum. Meas.* 37:145). The clipping level rises slowly to the peak; the
/// best phases seen are kept.
pub(super) fn reduce_crest(synthesis: &Synthesis, lines: &[usize], amplitudes: &[f64], phases: &mut Vec<f64>, turns: &[Complex64], steps: usize) -> (f64, f64) {
    /// Clipping levels as a share of the peak at the first and at the last step.
    const LEVEL: (f64, f64) = (0.75, 0.95);
    let signals = |phases: &[f64]| -> Vec<Vec<f64>> { turns.iter().map(|turn| synthesis.signal(lines, amplitudes, phases, *turn)).collect() };
    let worst = |signals: &[Vec<f64>]| signals.iter().map(|s| crest_factor(s)).fold(0.0, f64::max);
    let mut current = signals(phases);
    let before = worst(&current);
    let mut best = before;
    let mut trial = phases.clone();
    for step in 0..steps {
        let level = LEVEL.0 + (LEVEL.1 - LEVEL.0) * step as f64 / steps as f64;
        let mut sum = vec![Complex64::default(); lines.len()];
        for (mut signal, turn) in current.into_iter().zip(turns) {
            let limit = level * signal.iter().fold(0.0, |m: f64, s| m.max(s.abs()));
            signal.iter_mut().for_each(|s| *s = s.clamp(-limit, limit));
            let spectrum = spectrum_by(synthesis.forward.as_ref(), &mut signal);
            sum.iter_mut().zip(lines).for_each(|(s, &k)| *s += spectrum[k] * turn.conj());
        }
        trial.iter_mut().zip(&sum).for_each(|(phase, s)| *phase = s.arg());
        current = signals(&trial);
        let crest = worst(&current);
        if crest < best {
            best = crest;
            phases.clone_from(&trial);
        }
    }
    (before, best)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Lines, Multisine};
    use std::f64::consts::TAU;

    #[test]
    fn clipping_lowers_the_crest_and_keeps_the_amplitudes() {
        let synthesis = Synthesis::new(512);
        let lines: Vec<usize> = (1..=20).collect();
        let amplitudes = vec![2.0; 20];
        let mut phases = vec![0.0; 20];
        let (before, after) = reduce_crest(&synthesis, &lines, &amplitudes, &mut phases, &[Complex64::from(1.0)], 300);
        // In phase, the peak is Σ A = 40 and the rms 2 √10.
        assert!((before - 20.0 / 10.0_f64.sqrt()).abs() < 1e-9);
        assert!(after < before);
        let mut signal = synthesis.signal(&lines, &amplitudes, &phases, Complex64::from(1.0));
        assert!((crest_factor(&signal) - after).abs() < 1e-12);
        let spectrum = spectrum_by(synthesis.forward.as_ref(), &mut signal);
        for &k in &lines {
            assert!((spectrum[k].norm() - 512.0).abs() < 1e-9, "{k}");
        }
    }

    /// SCIENCE B.3: random phases give about 3.1 on the mean, the best of 200 random draws 2.4.
    #[test]
    fn a_dense_multisine_gets_below_the_best_random_draw() {
        let set = Multisine { lines: Lines::All, ..Multisine::default() }.generate(1).expect("valid");
        let (random, reduced) = set.crest_factor;
        assert!(random > 2.4 && reduced < 2.4, "{random} to {reduced}");
    }

    #[test]
    fn a_signal_is_the_sum_of_its_turned_cosines() {
        let (lines, amplitudes, phases, turn) = ([1, 3, 4], [1.0, 0.5, 2.0], [0.3, -1.0, 2.0], 0.7);
        let signal = Synthesis::new(32).signal(&lines, &amplitudes, &phases, Complex64::cis(turn));
        for (n, found) in signal.iter().enumerate() {
            let wave = |i: usize| amplitudes[i] * (TAU * (lines[i] * n) as f64 / 32.0 + phases[i] + turn).cos();
            assert!((found - (0..3).map(wave).sum::<f64>()).abs() < 1e-12, "{n}");
        }
    }

    #[test]
    fn each_step_takes_the_phases_of_what_a_rising_level_leaves() {
        let (n, lines, amplitudes) = (64, [1, 2, 3, 5, 8, 9], [1.0, 0.8, 1.2, 0.5, 0.9, 0.7]);
        let (synthesis, turns) = (Synthesis::new(n), [1.0, 0.4].map(Complex64::cis));
        let start = vec![0.1, 0.0, -0.2, 0.1, 0.0, 0.2];
        let mut expected = start.clone();
        // Of one step and of two, each of which lowers the crest of these phases.
        for (level, steps) in [(0.75, 1), (0.85, 2)] {
            let sum_at = |k: usize| -> Complex64 {
                let of = |turn: &Complex64| {
                    let signal = synthesis.signal(&lines, &amplitudes, &expected, *turn);
                    let limit = level * signal.iter().fold(0.0, |m: f64, s| m.max(s.abs()));
                    let line: Complex64 =
                        signal.iter().enumerate().map(|(t, s)| Complex64::cis(-TAU * (k * t) as f64 / n as f64) * s.clamp(-limit, limit)).sum();
                    line / turn
                };
                turns.iter().map(of).sum()
            };
            expected = lines.iter().map(|&k| sum_at(k).arg()).collect();
            let mut phases = start.clone();
            let (before, after) = reduce_crest(&synthesis, &lines, &amplitudes, &mut phases, &turns, steps);
            assert!(after < before);
            assert!(phases.iter().zip(&expected).all(|(a, b)| (a - b).abs() < 1e-9), "{steps}: {phases:?} and {expected:?}");
        }
    }
}
