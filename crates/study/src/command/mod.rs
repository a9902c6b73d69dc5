//! The commanded perturbation of an experiment, trial by trial.

mod delivered;
mod replay;
mod through;

pub(crate) use delivered::{delivery, forces_of, simulated};
use replay::replay;
pub(crate) use through::Through;

use crate::error::{StudyError, meaning};
use crate::file::Excitation;
use ndof_analysis::in_order;
use ndof_signal::{Chirp, Decorrelation, ExcitationError, FilteredNoise, Limits, Multisine, Prbs, SeedCriterion, ramp};
use rayon::prelude::*;

/// A perturbation to be commanded: one signal an axis.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Command {
    /// `[axis][sample]`, in N or N m.
    pub signals: Vec<Vec<f64>>,
    /// Seed that it was drawn from, unless it was replayed.
    pub seed: Option<u64>,
    /// Largest coherence between the axes that seeds reach by chance, where several were tried.
    pub chance: Option<f64>,
}

/// What all trials of a perturbation have in common.
pub(crate) struct Commands<'a> {
    pub excitation: &'a Excitation,
    pub axes: &'a [String],
    /// Length of each, what is not analysed included.
    pub samples: usize,
    /// Samples at the beginning that are not analysed.
    pub lead: usize,
    /// Samples at the beginning that the search for a seed does not look at.
    pub unseen: usize,
    pub sample_rate_hz: f64,
    pub seed: u64,
    /// T⁻¹, where it goes before the commands.
    pub compensation: Option<&'a Through>,
    /// Forces that commands deliver on the device, of their whole length.
    pub device: Option<&'a Device<'a>>,
    /// Coherence between the forces that commands deliver, where something can tell.
    pub judge: Option<&'a Judge<'a>>,
}

/// Commands to the forces that they deliver, the limb's mean force left out.
pub(crate) type Device<'a> = dyn Fn(&[Vec<f64>]) -> Result<Vec<Vec<f64>>, StudyError> + Sync + 'a;
/// The largest coherence between the forces that commands deliver.
pub(crate) type Judge<'a> = dyn Fn(&[Vec<f64>]) -> Result<f64, StudyError> + Sync + 'a;

/// Signals of experiments that belong together, of which a trial takes one.
struct Drawn {
    /// `[experiment][axis][sample]`.
    experiments: Vec<Vec<Vec<f64>>>,
    taken: usize,
    seed: u64,
    chance: Option<f64>,
    /// The best seeds, where a search found several.
    shortlist: Vec<u64>,
}

impl Commands<'_> {
    /// The perturbation of trial `trial`: each trial draws from a seed of its own; orthogonal multisines and sweeps take turns.
    ///
    /// Fading comes first, then the removal of coherence and the compensation, so that all of them hold for what is delivered;
    /// limits come last and scale everything that belongs together by one factor. Of several good seeds the judge takes the best.
    pub(crate) fn trial(&self, trial: usize) -> Result<Command, StudyError> {
        let excitation = self.excitation;
        if let Some(file) = &excitation.file {
            let signals = replay(excitation, file, self.axes, self.samples, self.lead, self.sample_rate_hz, trial)?;
            return Ok(Command { signals, seed: None, chance: None });
        }
        let mut drawn = self.draw(trial)?;
        let Some(judge) = self.judge.filter(|_| drawn.shortlist.len() > 1) else {
            self.finish(&mut drawn.experiments, drawn.taken)?;
            return Ok(Command { signals: drawn.experiments.swap_remove(drawn.taken), seed: Some(drawn.seed), chance: drawn.chance });
        };
        let noise = self.noise();
        let rivals = drawn
            .shortlist
            .par_iter()
            .map(|&seed| {
                let mut one = vec![noise.generate(seed)?];
                self.finish(&mut one, 0)?;
                let signals = one.swap_remove(0);
                Ok((judge(&signals)?, seed, signals))
            })
            .collect();
        let best = in_order::<_, StudyError>(rivals)?.into_iter().min_by(|a, b| a.0.total_cmp(&b.0)).ok_or(ExcitationError::NoCandidates)?;
        Ok(Command { signals: best.2, seed: Some(best.1), chance: drawn.chance })
    }

    /// Fades, takes out coherence, compensates and limits experiments that belong together; only the one that is taken is corrected.
    fn finish(&self, experiments: &mut [Vec<Vec<f64>>], taken: usize) -> Result<(), StudyError> {
        let excitation = self.excitation;
        experiments.iter_mut().flatten().for_each(|signal| ramp(signal, self.sample_rate_hz, excitation.fade_s, excitation.fade_s));
        for (k, signals) in experiments.iter_mut().enumerate() {
            if excitation.decorrelate && self.axes.len() > 1 {
                let [low, high] = excitation.search_band_hz;
                let remove = Decorrelation { band_hz: (low, high), skip: self.lead, ..Decorrelation::default() };
                *signals = remove.apply(signals, self.sample_rate_hz)?.signals;
            }
            if let Some(compensation) = self.compensation {
                let commanded = compensation.apply(signals)?;
                let scale = expected_gain(compensation, signals)?.recip();
                let wanted = scaled(signals, scale);
                *signals = scaled(&commanded, scale);
                if k == taken {
                    self.correct(compensation, &wanted, signals)?;
                }
            }
        }
        let limits = Limits { peak: excitation.peak.unwrap_or(f64::INFINITY), slew_per_s: excitation.slew_per_s.unwrap_or(f64::INFINITY) };
        let scale = experiments.iter().flatten().map(|signal| limits.scale(signal, self.sample_rate_hz)).fold(1.0, f64::min);
        experiments.iter_mut().flatten().flatten().for_each(|sample| *sample *= scale);
        Ok(())
    }

    /// Adds T⁻¹ of what the device failed to deliver, as often as the excitation says (iterative learning control by the model's
    /// inverse; Bristow, Tharayil & Alleyne 2006, *IEEE Control Syst. Mag.* 26(3):96).
    fn correct(&self, compensation: &Through, wanted: &[Vec<f64>], commanded: &mut [Vec<f64>]) -> Result<(), StudyError> {
        let Some(device) = self.device else { return Ok(()) };
        for _ in 0..self.excitation.corrections {
            let mut missing = device(commanded)?;
            missing.iter_mut().flatten().zip(wanted.iter().flatten()).for_each(|(m, w)| *m = w - *m);
            let correction = compensation.apply(&missing)?;
            commanded.iter_mut().flatten().zip(correction.iter().flatten()).for_each(|(c, more)| *c += more);
        }
        Ok(())
    }

    fn noise(&self) -> FilteredNoise {
        let Commands { excitation, samples, sample_rate_hz, .. } = *self;
        FilteredNoise {
            axes: self.axes.len(),
            samples,
            sample_rate_hz,
            rms: excitation.rms,
            cutoff_hz: excitation.cutoff_hz,
            order: excitation.order,
            ..FilteredNoise::default()
        }
    }

    fn draw(&self, trial: usize) -> Result<Drawn, StudyError> {
        let Commands { excitation, samples, sample_rate_hz, seed, .. } = *self;
        let axes = self.axes.len();
        let candidates = excitation.candidates.max(1);
        let first = seed.wrapping_mul(1_000_003).wrapping_add((trial * candidates) as u64);
        let alone = |signals: Vec<Vec<f64>>| Drawn { experiments: vec![signals], taken: 0, seed: first, chance: None, shortlist: Vec::new() };
        let period = period_samples(excitation, sample_rate_hz);
        let [low, high] = excitation.band_hz;
        Ok(match excitation.kind.as_str() {
            "filtered-noise" => {
                let noise = self.noise();
                if candidates > 1 && axes > 1 {
                    let [low, high] = excitation.search_band_hz;
                    let criterion =
                        SeedCriterion { candidates, band_hz: (low, high), keep: excitation.shortlist, skip: self.unseen, ..SeedCriterion::default() };
                    let found = noise.search(first, &criterion, &|_, _| ())?;
                    Drawn { seed: found.seed, chance: Some(found.median_max), shortlist: found.best, ..alone(noise.generate(found.seed)?) }
                } else {
                    alone(noise.generate(first)?)
                }
            }
            "multisine" => {
                let design = Multisine {
                    axes,
                    period,
                    sample_rate_hz,
                    rms: excitation.rms,
                    band_hz: (low, high),
                    slope: excitation.slope,
                    lines: excitation.harmonics,
                    plan: excitation.axis_plan,
                    crest_steps: excitation.crest_steps,
                };
                // One realisation of the phases for each round of experiments.
                let seed = seed.wrapping_mul(1_000_003).wrapping_add((trial / axes.max(1)) as u64);
                let experiments: Vec<_> = design.generate(seed)?.experiments.into_iter().map(|periods| repeat(periods, samples)).collect();
                Drawn { taken: trial % experiments.len().max(1), experiments, seed, chance: None, shortlist: Vec::new() }
            }
            "prbs" => {
                // Power reaches to about 0.44 fs/hold.
                let hold = ((0.44 * sample_rate_hz / excitation.cutoff_hz).round() as usize).max(1);
                let order = (2..=20).find(|order| ((1_usize << order) - 1) * hold >= period).unwrap_or(20);
                alone(repeat(Prbs { axes, order, hold, amplitude: excitation.rms }.generate(first)?, samples))
            }
            "chirp" => {
                let amplitude = std::f64::consts::SQRT_2 * excitation.rms;
                let chirp = Chirp { samples, sample_rate_hz, from_hz: low, to_hz: high, sweep: excitation.sweep, amplitude };
                let mut signals = vec![vec![0.0; samples]; axes];
                if let Some(axis) = signals.get_mut(trial % axes.max(1)) {
                    *axis = chirp.generate()?;
                }
                alone(signals)
            }
            other => {
                return Err(meaning("excitation", format!("kind = \"{other}\"; there are {}", Excitation::KINDS.join(", "))));
            }
        })
    }
}

fn scaled(signals: &[Vec<f64>], factor: f64) -> Vec<Vec<f64>> {
    signals.iter().map(|signal| signal.iter().map(|sample| sample * factor).collect()).collect()
}

/// Samples in a period of a multisine, and the least of a binary sequence.
pub(crate) fn period_samples(excitation: &Excitation, sample_rate_hz: f64) -> usize {
    ((excitation.period_s * sample_rate_hz).round() as usize).max(1)
}

/// Root mean square of all commands together over that of the forces they stand for, the axes taken as independent: the same
/// for all experiments that share their amplitudes.
fn expected_gain(compensation: &Through, signals: &[Vec<f64>]) -> Result<f64, StudyError> {
    let power = |signals: &[Vec<f64>]| signals.iter().flatten().map(|s| s * s).sum::<f64>();
    let mut commanded = 0.0;
    for axis in 0..signals.len() {
        let alone: Vec<Vec<f64>> = signals.iter().enumerate().map(|(k, s)| if k == axis { s.clone() } else { vec![0.0; s.len()] }).collect();
        commanded += power(&compensation.apply(&alone)?);
    }
    Ok((commanded / power(signals)).sqrt())
}

/// Periods end to end until there are `samples`.
fn repeat(periods: Vec<Vec<f64>>, samples: usize) -> Vec<Vec<f64>> {
    periods.into_iter().map(|period| period.iter().copied().cycle().take(samples).collect()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn made(excitation: &Excitation, samples: usize, trial: usize) -> Vec<Vec<f64>> {
        let axes = ["x".to_owned(), "y".to_owned()];
        let commands =
            Commands { excitation, axes: &axes, samples, lead: 0, unseen: 0, sample_rate_hz: 500.0, seed: 1, compensation: None, device: None, judge: None };
        commands.trial(trial).expect("made").signals
    }

    #[test]
    fn every_kind_has_its_size_and_its_limits() {
        for kind in Excitation::KINDS {
            let excitation = Excitation { kind: kind.to_owned(), peak: Some(5.0), slew_per_s: Some(500.0), ..Excitation::default() };
            for trial in 0..2 {
                let signals = made(&excitation, 6000, trial);
                assert_eq!((signals.len(), signals[0].len()), (2, 6000), "{kind}");
                let peak = signals.iter().flatten().fold(0.0_f64, |peak, sample| peak.max(sample.abs()));
                let slew = signals.iter().flat_map(|s| s.windows(2)).fold(0.0_f64, |slew, pair| slew.max((pair[1] - pair[0]).abs() * 500.0));
                assert!(peak <= 5.0 + 1e-12 && slew <= 500.0 * (1.0 + 1e-12), "{kind}: {peak}, {slew}");
                assert!(peak > 0.49, "{kind}: {peak}");
            }
        }
    }

    #[test]
    fn orthogonal_multisines_take_turns_with_the_same_phases_and_one_scale() {
        let excitation = Excitation { kind: "multisine".to_owned(), peak: Some(6.0), ..Excitation::default() };
        let [a, b] = [0, 1].map(|trial| made(&excitation, 5000, trial));
        // Rᴴ-orthogonality: over both experiments the two axes are uncorrelated.
        let dot = |x: &[f64], y: &[f64]| x.iter().zip(y).map(|(p, q)| p * q).sum::<f64>();
        let power = dot(&a[0], &a[0]);
        assert!((dot(&a[0], &a[1]) + dot(&b[0], &b[1])).abs() < 1e-9 * power);
    }
}
