//! The commanded perturbation of an experiment, trial by trial.

use crate::error::StudyError;
use crate::file::Excitation;
use ndof_signal::{Chirp, FilteredNoise, Limits, Multisine, Prbs, SeedCriterion, Sweep};

/// A perturbation to be commanded: one signal an axis.
#[derive(Clone, Debug, PartialEq)]
pub struct Command {
    /// `[axis][sample]`, in N or N m.
    pub signals: Vec<Vec<f64>>,
    /// Seed that it was drawn from.
    pub seed: u64,
    /// Largest coherence between its axes in the band that the search judges, if there was a search.
    pub coherence: Option<f64>,
}

/// The perturbation of trial `trial`: each trial draws from a seed of its own; orthogonal multisines and sweeps take turns.
///
/// # Errors
/// [`StudyError::Excitation`] if a setting makes no sense, [`StudyError::Meaning`] for an unknown kind.
pub fn command(excitation: &Excitation, axes: usize, samples: usize, sample_rate_hz: f64, seed: u64, trial: usize) -> Result<Command, StudyError> {
    let candidates = excitation.candidates.max(1);
    let first = seed.wrapping_mul(1_000_003).wrapping_add((trial * candidates) as u64);
    let mut command = Command { signals: Vec::new(), seed: first, coherence: None };
    let period = ((excitation.period_s * sample_rate_hz).round() as usize).max(1);
    match excitation.kind.as_str() {
        "filtered-noise" => {
            let noise = FilteredNoise {
                axes,
                samples,
                sample_rate_hz,
                rms: excitation.rms,
                cutoff_hz: excitation.cutoff_hz,
                order: excitation.order,
                ..FilteredNoise::default()
            };
            if candidates > 1 && axes > 1 {
                let found = noise.search(first, &SeedCriterion { candidates, ..SeedCriterion::default() }, &|_, _| ())?;
                (command.seed, command.coherence) = (found.seed, Some(found.coherence.max));
            }
            command.signals = noise.generate(command.seed)?;
        }
        "multisine" => {
            let design = Multisine {
                axes,
                period,
                sample_rate_hz,
                rms: excitation.rms,
                band_hz: (excitation.band_hz[0], excitation.band_hz[1]),
                ..Multisine::default()
            };
            // One realisation of the phases for each round of orthogonal experiments.
            command.seed = seed.wrapping_mul(1_000_003).wrapping_add((trial / axes.max(1)) as u64);
            let mut set = design.generate(command.seed)?;
            let experiment = trial % set.experiments.len().max(1);
            command.signals = repeat(set.experiments.swap_remove(experiment), samples);
        }
        "prbs" => {
            // Power reaches to about 0.44 fs/hold.
            let hold = ((0.44 * sample_rate_hz / excitation.cutoff_hz).round() as usize).max(1);
            let order = (2..=20).find(|order| ((1_usize << order) - 1) * hold >= period).unwrap_or(20);
            command.signals = repeat(Prbs { axes, order, hold, amplitude: excitation.rms }.generate(command.seed)?, samples);
        }
        "chirp" => {
            let chirp = Chirp {
                samples,
                sample_rate_hz,
                from_hz: excitation.band_hz[0],
                to_hz: excitation.band_hz[1],
                sweep: Sweep::Logarithmic,
                amplitude: std::f64::consts::SQRT_2 * excitation.rms,
            };
            command.signals = vec![vec![0.0; samples]; axes];
            if let Some(axis) = command.signals.get_mut(trial % axes.max(1)) {
                *axis = chirp.generate()?;
            }
        }
        other => {
            return Err(StudyError::Meaning { file: "excitation".to_owned(), what: format!("kind = \"{other}\"; there are {}", Excitation::KINDS.join(", ")) });
        }
    }
    if let Some(peak) = excitation.peak {
        let limits = Limits { peak, slew_per_s: f64::INFINITY };
        let scale = command.signals.iter().map(|signal| limits.scale(signal, sample_rate_hz)).fold(1.0, f64::min);
        command.signals.iter_mut().flatten().for_each(|sample| *sample *= scale);
    }
    Ok(command)
}

/// Periods end to end until there are `samples`.
fn repeat(periods: Vec<Vec<f64>>, samples: usize) -> Vec<Vec<f64>> {
    periods.into_iter().map(|period| period.iter().copied().cycle().take(samples).collect()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_kind_has_its_size_and_its_limit() {
        for kind in Excitation::KINDS {
            let excitation = Excitation { kind: kind.to_owned(), peak: Some(5.0), ..Excitation::default() };
            for trial in 0..2 {
                let signals = command(&excitation, 2, 6000, 500.0, 1, trial).expect(kind).signals;
                assert_eq!((signals.len(), signals[0].len()), (2, 6000), "{kind}");
                let peak = signals.iter().flatten().fold(0.0_f64, |peak, sample| peak.max(sample.abs()));
                assert!(peak <= 5.0 + 1e-12 && peak > 1.0, "{kind}: {peak}");
            }
        }
    }

    #[test]
    fn orthogonal_multisines_take_turns_with_the_same_phases() {
        let excitation = Excitation { kind: "multisine".to_owned(), ..Excitation::default() };
        let [a, b] = [0, 1].map(|trial| command(&excitation, 2, 5000, 500.0, 1, trial).expect("a multisine").signals);
        // Rᴴ-orthogonality: over both experiments the two axes are uncorrelated.
        let dot = |x: &[f64], y: &[f64]| x.iter().zip(y).map(|(p, q)| p * q).sum::<f64>();
        let power = dot(&a[0], &a[0]);
        assert!((dot(&a[0], &a[1]) + dot(&b[0], &b[1])).abs() < 1e-9 * power);
    }
}
