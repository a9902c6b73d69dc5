//! Band-limited uniform noise, one independent stream an axis, and the search for a seed whose axes look independent.

use super::input_coherence::{InputCoherence, input_coherence};
use super::{ExcitationError, positive};
use crate::{Passband, SosFilter, Welch};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::sync::atomic::{AtomicUsize, Ordering};

/// Uniform noise through a Butterworth low-pass: the perturbation of Palazzolo et al. (2007).
///
/// ```
/// use ndof_signal::FilteredNoise;
/// let forces = FilteredNoise { axes: 2, rms: 4.0, ..FilteredNoise::default() }.generate(1)?;
/// assert_eq!((forces.len(), forces[0].len()), (2, 25_000));
/// # Ok::<(), ndof_signal::ExcitationError>(())
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct FilteredNoise {
    /// Number of signals.
    pub axes: usize,
    /// Samples in each.
    pub samples: usize,
    /// Sample rate.
    pub sample_rate_hz: f64,
    /// Root mean square of each signal, exact; in the unit of the signal.
    pub rms: f64,
    /// Corner of the low-pass.
    pub cutoff_hz: f64,
    /// Order of the low-pass.
    pub order: usize,
    /// Time that the filter runs before the signal begins.
    pub warm_up_s: f64,
}

impl Default for FilteredNoise {
    /// The paper's: 50 s at 500 Hz, eighth order, 15 Hz; one axis, unit rms.
    fn default() -> Self {
        FilteredNoise { axes: 1, samples: 25_000, sample_rate_hz: 500.0, rms: 1.0, cutoff_hz: 15.0, order: 8, warm_up_s: 2.0 }
    }
}

/// How candidates of the seed search are judged.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SeedCriterion {
    /// The analysis with which the recording will be treated.
    pub welch: Welch,
    /// The band that counts, in Hz.
    pub band_hz: (f64, f64),
    /// Seeds to try.
    pub candidates: usize,
    /// How many of the best to name.
    pub keep: usize,
    /// Samples at the beginning that will not be analysed.
    pub skip: usize,
}

impl Default for SeedCriterion {
    /// The paper's second setting over 0.25 to 12 Hz, 300 seeds.
    fn default() -> Self {
        SeedCriterion { welch: Welch::smooth(), band_hz: (0.25, 12.0), candidates: 300, keep: 1, skip: 0 }
    }
}

/// What a seed search found.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SeedSearch {
    /// The best seed.
    pub seed: u64,
    /// What it reaches.
    pub coherence: InputCoherence,
    /// The best seeds, the best first, as many as were to be kept.
    pub best: Vec<u64>,
    /// Seeds tried.
    pub tried: usize,
    /// Median over the first candidates (at most a hundred) of the largest coherence: what chance gives.
    pub median_max: f64,
}

impl FilteredNoise {
    fn filter(&self) -> Result<SosFilter, ExcitationError> {
        positive("rms", self.rms)?;
        positive("number of axes", self.axes as f64)?;
        positive("number of samples", self.samples as f64)?;
        if !(self.warm_up_s.is_finite() && self.warm_up_s >= 0.0) {
            return Err(ExcitationError::NotPositive { what: "warm-up in seconds", value: self.warm_up_s });
        }
        Ok(SosFilter::butterworth(self.order, Passband::Low(self.cutoff_hz), self.sample_rate_hz)?)
    }

    /// The signals, one an axis; axis k is stream k of the generator with this seed.
    ///
    /// # Errors
    /// [`ExcitationError`] if a setting makes no sense.
    pub fn generate(&self, seed: u64) -> Result<Vec<Vec<f64>>, ExcitationError> {
        let filter = self.filter()?;
        Ok((0..self.axes).map(|axis| self.axis(&filter, seed, axis)).collect())
    }

    fn axis(&self, filter: &SosFilter, seed: u64, axis: usize) -> Vec<f64> {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        rng.set_stream(axis as u64);
        let mut stream = filter.stream();
        let mut draw = || stream.step(rng.random_range(-1.0..1.0));
        for _ in 0..(self.warm_up_s * self.sample_rate_hz).ceil() as usize {
            draw();
        }
        let mut signal: Vec<f64> = (0..self.samples).map(|_| draw()).collect();
        let mean_square = signal.iter().map(|s| s * s).sum::<f64>() / self.samples as f64;
        let scale = self.rms / mean_square.sqrt();
        signal.iter_mut().for_each(|s| *s *= scale);
        signal
    }

    /// Of the seeds `first_seed`, `first_seed + 1`, … the one whose axes have the lowest coherence with each other:
    /// the smallest maximum over the band and the axes (each against all others together), then the smallest mean.
    ///
    /// All are first seen without zero padding, at a share of the frequencies: that maximum is a lower bound of the whole
    /// one, so only seeds whose bound lies below the best are analysed in full, and the answer is that of analysing all.
    ///
    /// The same for any number of threads. `progress` is called with (done, total) from the working threads.
    ///
    /// # Errors
    /// [`ExcitationError`] if a setting makes no sense.
    ///
    /// ```
    /// use ndof_signal::{FilteredNoise, SeedCriterion, Welch};
    /// let noise = FilteredNoise { axes: 3, samples: 4000, ..FilteredNoise::default() };
    /// let criterion = SeedCriterion { welch: Welch::new(512), band_hz: (1.0, 12.0), candidates: 20, keep: 1, skip: 0 };
    /// let found = noise.search(1, &criterion, &|_, _| ())?;
    /// assert!(found.coherence.max < found.median_max);
    /// # Ok::<(), ndof_signal::ExcitationError>(())
    /// ```
    pub fn search(&self, first_seed: u64, criterion: &SeedCriterion, progress: &(dyn Fn(usize, usize) + Sync)) -> Result<SeedSearch, ExcitationError> {
        let judge = |seed: u64, welch: &Welch| -> Result<InputCoherence, ExcitationError> {
            let signals = self.generate(seed)?;
            let columns: Vec<&[f64]> = signals.iter().map(|signal| signal.get(criterion.skip..).unwrap_or_default()).collect();
            input_coherence(&welch.spectra(self.sample_rate_hz, &columns)?, criterion.band_hz)
        };
        let seed = |k: usize| first_seed.wrapping_add(k as u64);
        let done = AtomicUsize::new(0);
        let tick = || progress(done.fetch_add(1, Ordering::Relaxed) + 1, criterion.candidates);
        // The chance level, from the first candidates in full.
        let sample = criterion.candidates.min(CHANCE_SAMPLE);
        let whole = |k: usize| judge(seed(k), &criterion.welch);
        let mut scores: Vec<(usize, InputCoherence)> =
            (0..sample).into_par_iter().map(|k| whole(k).map(|score| (k, score)).inspect(|_| tick())).collect::<Result<_, _>>()?;
        let mut maxima: Vec<f64> = scores.iter().map(|(_, s)| s.max).collect();
        maxima.sort_by(f64::total_cmp);
        let order =
            |a: &(usize, InputCoherence), b: &(usize, InputCoherence)| a.1.max.total_cmp(&b.1.max).then(a.1.mean.total_cmp(&b.1.mean)).then(a.0.cmp(&b.0));
        scores.sort_by(order);
        if scores.is_empty() {
            return Err(ExcitationError::NoCandidates);
        }
        scores.truncate(criterion.keep.max(1));

        let coarse = coarse(criterion, self.sample_rate_hz);
        let mut bounds: Vec<(usize, f64)> = (sample..criterion.candidates)
            .into_par_iter()
            .map(|k| judge(seed(k), &coarse).map(|score| (k, score.max)).inspect(|_| tick()))
            .collect::<Result<_, _>>()?;
        bounds.sort_by(|a, b| a.1.total_cmp(&b.1).then(a.0.cmp(&b.0)));
        for (k, bound) in bounds {
            let full = scores.len() >= criterion.keep.max(1);
            if full && scores.last().is_some_and(|worst| bound > worst.1.max * (1.0 + BOUND_TOLERANCE)) {
                break;
            }
            scores.push((k, whole(k)?));
            scores.sort_by(order);
            scores.truncate(criterion.keep.max(1));
        }
        let best = scores[0];
        let middle = maxima.len() / 2;
        let median_max = if maxima.len().is_multiple_of(2) { (maxima[middle - 1] + maxima[middle]) / 2.0 } else { maxima[middle] };
        let seeds = scores.iter().map(|(k, _)| seed(*k)).collect();
        Ok(SeedSearch { seed: seed(best.0), coherence: best.1, best: seeds, tried: criterion.candidates, median_max })
    }
}

/// The analysis at every r-th of its frequencies, r the zero padding, where that is a whole number and leaves one in the band.
fn coarse(criterion: &SeedCriterion, sample_rate_hz: f64) -> Welch {
    let welch = &criterion.welch;
    let step_hz = sample_rate_hz / welch.nperseg.max(1) as f64;
    let inside = (criterion.band_hz.0 / step_hz).ceil() * step_hz <= criterion.band_hz.1;
    if inside && welch.nfft.is_multiple_of(welch.nperseg.max(1)) { Welch { nfft: welch.nperseg, ..welch.clone() } } else { welch.clone() }
}

/// Candidates from which the chance level is taken.
const CHANCE_SAMPLE: usize = 100;
/// Two transforms of different lengths agree to some machine epsilons at the frequencies that they share.
const BOUND_TOLERANCE: f64 = 1e-9;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_coarse_analysis_has_a_frequency_of_the_band() {
        // 500 samples at 500 Hz: 1 Hz apart.
        let coarse_of = |nfft, band_hz| {
            let criterion = SeedCriterion { welch: Welch { nfft, ..Welch::new(500) }, band_hz, ..SeedCriterion::default() };
            coarse(&criterion, 500.0).nfft
        };
        assert_eq!(coarse_of(2000, (2.5, 3.5)), 500);
        assert_eq!(coarse_of(2000, (2.25, 2.75)), 2000);
        assert_eq!(coarse_of(1999, (2.5, 3.5)), 1999);
        // 0.5 Hz apart.
        let fine = SeedCriterion { welch: Welch { nfft: 2000, ..Welch::new(1000) }, band_hz: (0.6, 0.9), ..SeedCriterion::default() };
        assert_eq!(coarse(&fine, 500.0).nfft, 2000);
    }

    #[test]
    fn the_rms_is_exact_and_axes_and_seeds_differ() {
        let noise = FilteredNoise { axes: 3, samples: 5000, rms: 4.0, ..FilteredNoise::default() };
        let signals = noise.generate(5).expect("valid");
        for s in &signals {
            let rms = (s.iter().map(|v| v * v).sum::<f64>() / 5000.0).sqrt();
            assert!((rms / 4.0 - 1.0).abs() < 1e-12);
        }
        assert_ne!(signals[0], signals[1]);
        assert_ne!(signals, noise.generate(6).expect("valid"));
        assert_eq!(signals, noise.generate(5).expect("valid"));
    }

    #[test]
    fn an_axis_does_not_depend_on_how_many_there_are() {
        let noise = FilteredNoise { samples: 1000, ..FilteredNoise::default() };
        assert_eq!(noise.generate(2).expect("valid")[0], FilteredNoise { axes: 4, ..noise }.generate(2).expect("valid")[0]);
    }

    /// SCIENCE B.1: white noise of variance A²/3 keeps 0.0604 of it, so rms = 0.1419 A.
    #[test]
    fn the_filter_passes_the_share_of_variance_that_theory_says() {
        let filter = SosFilter::butterworth(8, Passband::Low(15.0), 500.0).expect("valid");
        let mut impulse = vec![0.0; 5000];
        impulse[0] = 1.0;
        let share: f64 = filter.filter(&impulse).iter().map(|h| h * h).sum();
        assert!((share - 0.0604).abs() < 5e-5, "{share}");
    }

    /// The coherence of independent streams is on average 1/n_e: 0.0423 for the paper's second setting.
    #[test]
    fn the_search_finds_less_than_chance_on_every_number_of_threads() {
        let noise = FilteredNoise { axes: 2, ..FilteredNoise::default() };
        let criterion = SeedCriterion { candidates: 24, ..SeedCriterion::default() };
        let calls = AtomicUsize::new(0);
        let found = noise
            .search(100, &criterion, &|done, total| {
                assert_eq!(total, 24);
                calls.fetch_add(done, Ordering::Relaxed);
            })
            .expect("valid");
        assert_eq!((found.tried, calls.into_inner()), (24, (1..=24).sum()));
        let columns = noise.generate(found.seed).expect("valid");
        let again = input_coherence(&criterion.welch.spectra(500.0, &[&columns[0], &columns[1]]).expect("valid"), criterion.band_hz).expect("bins");
        assert_eq!(again, found.coherence);
        assert!(found.coherence.max < found.median_max);
        let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("pool");
        assert_eq!(one.install(|| noise.search(100, &criterion, &|_, _| ())).expect("valid"), found);
    }

    #[test]
    fn the_short_cut_finds_what_trying_all_finds() {
        let noise = FilteredNoise { axes: 3, samples: 3000, ..FilteredNoise::default() };
        let welch = Welch { nfft: 1024, ..Welch::new(256) };
        let criterion = SeedCriterion { welch, band_hz: (2.0, 12.0), candidates: 400, keep: 5, skip: 0 };
        let found = noise.search(7, &criterion, &|_, _| ()).expect("valid");
        let all = (7..407).map(|seed| {
            let signals = noise.generate(seed).expect("valid");
            let columns: Vec<&[f64]> = signals.iter().map(Vec::as_slice).collect();
            (seed, input_coherence(&criterion.welch.spectra(500.0, &columns).expect("valid"), criterion.band_hz).expect("bins"))
        });
        let mut all: Vec<(u64, InputCoherence)> = all.collect();
        let mut chance: Vec<f64> = all[..100].iter().map(|(_, score)| score.max).collect();
        chance.sort_by(f64::total_cmp);
        assert!((found.median_max - (chance[49] + chance[50]) / 2.0).abs() < 1e-15);
        all.sort_by(|a, b| a.1.max.total_cmp(&b.1.max));
        assert_eq!((found.seed, found.coherence), all[0]);
        assert_eq!(found.best, all[..5].iter().map(|(seed, _)| *seed).collect::<Vec<_>>());
        // A band between the frequencies of the shorter transform still has some of the longer.
        let narrow = SeedCriterion { band_hz: (2.2, 3.5), candidates: 110, ..criterion };
        assert!(noise.search(7, &narrow, &|_, _| ()).is_ok());
    }

    #[test]
    fn as_many_are_kept_as_were_asked_for() {
        let noise = FilteredNoise { axes: 2, samples: 600, ..FilteredNoise::default() };
        let criterion = SeedCriterion { welch: Welch::new(200), band_hz: (2.0, 12.0), candidates: 300, keep: 300, skip: 0 };
        let mut best = noise.search(5, &criterion, &|_, _| ()).expect("valid").best;
        best.sort_unstable();
        assert_eq!(best, (5..305).collect::<Vec<u64>>());
    }

    #[test]
    fn the_filter_runs_for_the_warm_up_before_the_signal_begins() {
        let late = FilteredNoise { samples: 300, warm_up_s: 0.2, ..FilteredNoise::default() };
        let all = FilteredNoise { samples: 400, warm_up_s: 0.0, ..late.clone() }.generate(1).expect("valid");
        let late = late.generate(1).expect("valid");
        let ratio = late[0][0] / all[0][100];
        assert!(late[0].iter().zip(&all[0][100..]).all(|(a, b)| (a - ratio * b).abs() < 1e-12));
    }

    #[test]
    fn settings_without_sense_are_refused() {
        let ok = FilteredNoise::default();
        assert!(matches!(FilteredNoise { rms: 0.0, ..ok.clone() }.generate(1), Err(ExcitationError::NotPositive { what: "rms", .. })));
        assert!(matches!(FilteredNoise { cutoff_hz: 300.0, ..ok.clone() }.generate(1), Err(ExcitationError::Filter(_))));
        assert!(matches!(FilteredNoise { axes: 0, ..ok.clone() }.generate(1), Err(ExcitationError::NotPositive { .. })));
        for warm_up_s in [-1.0, f64::NAN] {
            assert!(matches!(FilteredNoise { warm_up_s, ..ok.clone() }.generate(1), Err(ExcitationError::NotPositive { .. })));
        }
        let none = SeedCriterion { candidates: 0, ..SeedCriterion::default() };
        assert_eq!(ok.search(1, &none, &|_, _| ()).unwrap_err(), ExcitationError::NoCandidates);
    }
}
