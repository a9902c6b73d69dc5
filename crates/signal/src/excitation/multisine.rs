//! Random-phase multisines: the lines they hold, their phases, and one period of each experiment.

use super::crest::{Synthesis, reduce_crest};
use super::{ExcitationError, positive};
use num_complex::Complex64;
use rand::seq::SliceRandom;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};
use std::f64::consts::{SQRT_2, TAU};

/// Which harmonics of the period carry power.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Lines {
    /// Every one in the band.
    All,
    /// Odd ones: what appears at even ones is even distortion.
    Odd,
    /// Odd ones, of every four consecutive ones a random one left out: what appears there is odd distortion.
    #[default]
    OddWithDetection,
}

/// How several axes are told apart.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum AxisPlan {
    /// As many experiments as axes, all lines on all axes, orthogonal from experiment to experiment.
    #[default]
    Orthogonal,
    /// One experiment in which the axes take turns at the lines; the resolution of each is coarser by their number.
    Zippered,
}

/// A multisine of any number of axes.
///
/// x_i(t) = Σ_k A(k) cos(2πkt/T + φ_i(k)), with random phases. Of orthogonal experiments e = 1..q the matrix of lines
/// is R(k) = A(k) diag(e^{jφ_i(k)}) W with R Rᴴ = q A² I: W is Hadamard's matrix where q is a power of two, else that
/// of the discrete Fourier transform (Dobrowiecki, Schoukens & Guillaume 2006, *IEEE Trans. Instrum. Meas.* 55:1838).
///
/// ```
/// use ndof_signal::Multisine;
/// let design = Multisine { axes: 2, rms: 4.0, ..Multisine::default() };
/// let set = design.generate(1)?;
/// assert_eq!((set.experiments.len(), set.experiments[0].len(), set.experiments[0][0].len()), (2, 2, 5000));
/// assert!(set.excited[0].iter().all(|k| k % 2 == 1));
/// # Ok::<(), ndof_signal::ExcitationError>(())
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Multisine {
    /// Number of signals q.
    pub axes: usize,
    /// Samples in a period; lines are multiples of sample rate / period.
    pub period: usize,
    /// Sample rate.
    pub sample_rate_hz: f64,
    /// Root mean square of each signal, exact; in the unit of the signal.
    pub rms: f64,
    /// The band of the lines, in Hz.
    pub band_hz: (f64, f64),
    /// Amplitudes go with f to this power: 0 is flat, −0.5 favours low frequencies.
    pub slope: f64,
    /// Which harmonics carry power.
    pub lines: Lines,
    /// How the axes are told apart.
    pub plan: AxisPlan,
    /// Steps of crest-factor reduction; 0 leaves the phases random.
    pub crest_steps: usize,
}

impl Default for Multisine {
    /// One axis, 10 s at 500 Hz, 0.3 to 12 Hz flat, odd lines with detection lines, unit rms, crest reduced.
    fn default() -> Self {
        Multisine {
            axes: 1,
            period: 5000,
            sample_rate_hz: 500.0,
            rms: 1.0,
            band_hz: (0.3, 12.0),
            slope: 0.0,
            lines: Lines::OddWithDetection,
            plan: AxisPlan::Orthogonal,
            crest_steps: 200,
        }
    }
}

/// One period of every signal of every experiment, and what lies where.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MultisineSet {
    /// Samples, `[experiment][axis][sample]`; to be repeated.
    pub experiments: Vec<Vec<Vec<f64>>>,
    /// Lines that carry power, `[axis][…]`, as multiples of sample rate / period.
    pub excited: Vec<Vec<usize>>,
    /// Odd lines in the band that carry none on any axis.
    pub odd_detection: Vec<usize>,
    /// Even lines in the band that carry none on any axis.
    pub even_detection: Vec<usize>,
    /// The largest crest factor (peak over rms) of all signals, with random phases and as delivered.
    pub crest_factor: (f64, f64),
}

impl Multisine {
    /// The signals for a seed.
    ///
    /// # Errors
    /// [`ExcitationError`] if a setting makes no sense or an axis is left without a line.
    pub fn generate(&self, seed: u64) -> Result<MultisineSet, ExcitationError> {
        positive("rms", self.rms)?;
        positive("number of axes", self.axes as f64)?;
        positive("sample rate in Hz", self.sample_rate_hz)?;
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let step_hz = self.sample_rate_hz / self.period.max(1) as f64;
        let in_band: Vec<usize> = (1..self.period.div_ceil(2)).filter(|&k| (self.band_hz.0..=self.band_hz.1).contains(&(k as f64 * step_hz))).collect();
        let carrying = self.carrying(&in_band, &mut rng);
        let turns = if self.plan == AxisPlan::Zippered { self.axes } else { 1 };
        let excited: Vec<Vec<usize>> = (0..self.axes).map(|axis| carrying.iter().skip(axis % turns).step_by(turns).copied().collect()).collect();
        if excited.iter().any(Vec::is_empty) {
            return Err(ExcitationError::NoLines { low_hz: self.band_hz.0, high_hz: self.band_hz.1, step_hz, axes: turns });
        }
        let count = if self.plan == AxisPlan::Orthogonal { self.axes } else { 1 };
        let mut experiments = vec![Vec::with_capacity(self.axes); count];
        let mut crest_factor = (0.0_f64, 0.0_f64);
        let synthesis = Synthesis::new(self.period);
        for (axis, lines) in excited.iter().enumerate() {
            let amplitudes = self.amplitudes(lines, step_hz);
            let mut phases: Vec<f64> = lines.iter().map(|_| rng.random_range(0.0..TAU)).collect();
            let turns: Vec<Complex64> = (0..count).map(|experiment| orthogonal(count, axis % count, experiment)).collect();
            let (before, after) = reduce_crest(&synthesis, lines, &amplitudes, &mut phases, &turns, self.crest_steps);
            crest_factor = (crest_factor.0.max(before), crest_factor.1.max(after));
            for (signals, turn) in experiments.iter_mut().zip(&turns) {
                let mut signal = synthesis.signal(lines, &amplitudes, &phases, *turn);
                let mean_square = signal.iter().map(|s| s * s).sum::<f64>() / self.period as f64;
                signal.iter_mut().for_each(|s| *s *= self.rms / mean_square.sqrt());
                signals.push(signal);
            }
        }
        let (odd_detection, even_detection) = in_band.iter().filter(|k| !carrying.contains(k)).partition(|k| !k.is_multiple_of(2));
        Ok(MultisineSet { experiments, excited, odd_detection, even_detection, crest_factor })
    }

    fn carrying(&self, in_band: &[usize], rng: &mut ChaCha8Rng) -> Vec<usize> {
        let odd: Vec<usize> = in_band.iter().filter(|k| !k.is_multiple_of(2)).copied().collect();
        match self.lines {
            Lines::All => in_band.to_vec(),
            Lines::Odd => odd,
            Lines::OddWithDetection => {
                let mut kept: Vec<usize> = odd
                    .chunks(4)
                    .flat_map(|group| {
                        let mut group = group.to_vec();
                        if group.len() == 4 {
                            group.shuffle(rng);
                            group.truncate(3);
                        }
                        group
                    })
                    .collect();
                kept.sort_unstable();
                kept
            }
        }
    }

    fn amplitudes(&self, lines: &[usize], step_hz: f64) -> Vec<f64> {
        let shape: Vec<f64> = lines.iter().map(|&k| (k as f64 * step_hz).powf(self.slope)).collect();
        let scale = self.rms * SQRT_2 / shape.iter().map(|a| a * a).sum::<f64>().sqrt();
        shape.iter().map(|a| a * scale).collect()
    }
}

/// Entry (row, column) of an n × n matrix W with |W_ab| = 1 and W Wᴴ = n I: Sylvester's Hadamard matrix where n is a
/// power of two, the Fourier matrix otherwise.
fn orthogonal(n: usize, row: usize, column: usize) -> Complex64 {
    if n.is_power_of_two() {
        Complex64::from(if (row & column).count_ones().is_multiple_of(2) { 1.0 } else { -1.0 })
    } else {
        Complex64::cis(-TAU * ((row * column) % n) as f64 / n as f64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Periodic;

    fn lines(signal: &[f64]) -> Vec<Complex64> {
        let twice = [signal, signal].concat();
        let s = Periodic { period: signal.len(), discard: 0 }.spectra(500.0, &[&twice]).expect("valid");
        (0..s.frequency_hz().len()).map(|f| s.mean(f, 0)).collect()
    }

    #[test]
    fn the_experiments_are_orthogonal_for_every_number_of_axes() {
        for axes in 1..=6 {
            let design = Multisine { axes, period: 1000, rms: 2.0, band_hz: (1.0, 12.0), crest_steps: 5, ..Multisine::default() };
            let set = design.generate(axes as u64).expect("valid");
            let matrix: Vec<Vec<Vec<Complex64>>> = set.experiments.iter().map(|e| e.iter().map(|s| lines(s)).collect()).collect();
            let power = 2.0 * 2.0 * 2.0 / set.excited[0].len() as f64;
            for &k in &set.excited[0] {
                for i in 0..axes {
                    for j in 0..axes {
                        let inner: Complex64 = matrix.iter().map(|e| e[i][k] * e[j][k].conj()).sum();
                        let expected = if i == j { axes as f64 * power } else { 0.0 };
                        assert!((inner - expected).norm() < 1e-9 * axes as f64 * power, "{axes} axes, line {k}, {i}, {j}: {inner}");
                    }
                }
            }
        }
    }

    #[test]
    fn power_lies_on_the_excited_lines_only() {
        let set = Multisine { slope: -0.5, ..Multisine::default() }.generate(3).expect("valid");
        let found = lines(&set.experiments[0][0]);
        let first = found[set.excited[0][0]].norm();
        for (k, x) in found.iter().enumerate() {
            if set.excited[0].contains(&k) {
                let expected = first * (set.excited[0][0] as f64 / k as f64).sqrt();
                assert!((x.norm() / expected - 1.0).abs() < 1e-9, "{k}");
            } else {
                assert!(x.norm() < 1e-12 * first * 5000.0_f64.sqrt(), "{k}");
            }
        }
    }

    #[test]
    fn one_odd_line_of_four_is_left_out() {
        let set = Multisine { crest_steps: 0, ..Multisine::default() }.generate(3).expect("valid");
        // Odd lines 3, 5, … 119: fourteen groups of four and three more.
        assert_eq!((set.excited[0].len(), set.odd_detection.len(), set.even_detection.len()), (45, 14, 59));
        for (group, &left_out) in set.odd_detection.iter().enumerate() {
            assert!((3 + 8 * group..3 + 8 * (group + 1)).contains(&left_out), "{left_out}");
        }
    }

    #[test]
    fn zippered_axes_share_no_line() {
        let set = Multisine { axes: 3, plan: AxisPlan::Zippered, crest_steps: 0, ..Multisine::default() }.generate(3).expect("valid");
        assert_eq!(set.experiments.len(), 1);
        let mut all: Vec<usize> = set.excited.concat();
        let count = all.len();
        all.sort_unstable();
        all.dedup();
        assert_eq!((all.len(), count), (45, 45));
        for signal in &set.experiments[0] {
            assert!((signal.iter().map(|s| s * s).sum::<f64>() / 5000.0 - 1.0).abs() < 1e-12);
        }
    }

    #[test]
    fn a_band_without_lines_is_refused() {
        let none = Multisine { period: 100, band_hz: (0.3, 4.0), ..Multisine::default() };
        assert!(matches!(none.generate(1), Err(ExcitationError::NoLines { .. })));
        assert!(matches!(Multisine { period: 0, ..none }.generate(1), Err(ExcitationError::NoLines { .. })));
    }

    #[test]
    fn the_matrix_is_hadamards_or_fouriers() {
        let entries = |n: usize| (0..n).map(|row| (0..n).map(|column| orthogonal(n, row, column)).collect()).collect::<Vec<Vec<_>>>();
        let [one, third] = [Complex64::ONE, Complex64::cis(-TAU / 3.0)];
        assert_eq!(entries(4), [[one, one, one, one], [one, -one, one, -one], [one, one, -one, -one], [one, -one, -one, one]]);
        for (found, expected) in entries(3).concat().into_iter().zip([one, one, one, one, third, third.conj(), one, third.conj(), third]) {
            assert!((found - expected).norm() < 1e-15);
        }
    }

    #[test]
    fn the_amplitudes_go_with_the_slope_and_hold_the_rms() {
        let found = Multisine { rms: 3.0, slope: -0.5, ..Multisine::default() }.amplitudes(&[4, 9, 16], 0.1);
        assert!((found.iter().map(|a| a * a / 2.0).sum::<f64>() - 9.0).abs() < 1e-12, "{found:?}");
        assert!((found[1] / found[0] - 2.0 / 3.0).abs() < 1e-12 && (found[2] / found[0] - 0.5).abs() < 1e-12, "{found:?}");
    }
}
