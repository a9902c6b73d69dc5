//! Coherence between the axes of one or more trials.

use super::result::CoherenceAnalysis;
use crate::error::StudyError;
use ndof_analysis::AnalysisError;
use ndof_signal::{CrossSpectra, ExcitationError, InputCoherence, Kernel, Periodic, SpectraError, Welch, input_coherence, input_coherence_at};
use ndof_sysid::EstimateError;

/// How it is looked at.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Lens {
    /// In a band, as a recording will be analysed.
    Welch(Welch),
    /// On the lines of a periodic signal, over the experiments together.
    Lines {
        /// Samples in a period.
        period: usize,
        /// Lines as multiples of sample rate / period.
        lines: Vec<usize>,
    },
}

/// Coherence of each axis with all others together.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Between {
    /// Of each trial by itself; lines have none, one experiment alone being coherent by construction.
    pub trials: Vec<Option<InputCoherence>>,
    /// Of all trials pooled.
    pub pooled: InputCoherence,
    /// The grid within the band.
    pub frequency_hz: Vec<f64>,
    /// The largest over the axes at each of its frequencies, all trials pooled.
    pub largest: Vec<f64>,
}

impl Lens {
    /// The paper's second setting, or shorter segments for a record that would not fill three of them.
    pub(crate) fn welch(samples: usize) -> Self {
        let paper = Welch::smooth();
        if samples >= 2 * paper.nperseg { Lens::Welch(paper) } else { Lens::Welch(Welch::new((samples / 4).max(1))) }
    }

    /// Looks at `trials`, `[trial][axis][sample]`.
    pub(crate) fn look(&self, trials: &[Vec<Vec<f64>>], sample_rate_hz: f64, band_hz: (f64, f64)) -> Result<Between, StudyError> {
        let spectra = trials.iter().map(|trial| self.spectra(trial, sample_rate_hz)).collect::<Result<Vec<_>, StudyError>>()?;
        let pooled = CrossSpectra::pool(&spectra)
            .map_err(|error: SpectraError| AnalysisError::Estimate { file: "the design".to_owned(), source: EstimateError::from(error) })?;
        let alone = |spectra: &CrossSpectra| -> Result<Option<InputCoherence>, StudyError> {
            Ok(if matches!(self, Lens::Welch(_)) { Some(input_coherence(spectra, band_hz)?) } else { None })
        };
        let within = |hz: f64| matches!(self, Lens::Lines { .. }) || (band_hz.0..=band_hz.1).contains(&hz);
        let bins: Vec<usize> = (0..pooled.frequency_hz().len()).filter(|&f| within(pooled.frequency_hz()[f])).collect();
        let at: Vec<Vec<f64>> = bins.iter().map(|&f| input_coherence_at(&pooled, f)).collect();
        if at.is_empty() {
            return Err(ExcitationError::EmptyBand { low_hz: band_hz.0, high_hz: band_hz.1 }.into());
        }
        let largest: Vec<f64> = at.iter().map(|axes| axes.iter().copied().fold(0.0, f64::max)).collect();
        let count = at.iter().map(Vec::len).sum::<usize>() as f64;
        Ok(Between {
            trials: spectra.iter().map(alone).collect::<Result<_, _>>()?,
            pooled: InputCoherence { max: largest.iter().copied().fold(0.0, f64::max), mean: at.iter().flatten().sum::<f64>() / count },
            frequency_hz: bins.iter().map(|&f| pooled.frequency_hz()[f]).collect(),
            largest,
        })
    }

    /// The same for the result.
    pub(super) fn describe(&self, band_hz: (f64, f64)) -> CoherenceAnalysis {
        let band_hz = [band_hz.0, band_hz.1];
        match self {
            Lens::Welch(w) => CoherenceAnalysis { name: "welch".to_owned(), nperseg: w.nperseg, noverlap: w.noverlap, nfft: w.nfft, band_hz },
            Lens::Lines { period, .. } => CoherenceAnalysis { name: "lines".to_owned(), nperseg: *period, noverlap: 0, nfft: *period, band_hz },
        }
    }

    fn spectra(&self, trial: &[Vec<f64>], sample_rate_hz: f64) -> Result<CrossSpectra, StudyError> {
        let columns: Vec<&[f64]> = trial.iter().map(Vec::as_slice).collect();
        match self {
            Lens::Welch(welch) => Ok(welch.spectra(sample_rate_hz, &columns).map_err(ExcitationError::from)?),
            Lens::Lines { period, lines } => {
                let found = Periodic { period: *period, discard: 0 }
                    .spectra(sample_rate_hz, &columns)
                    .map_err(|source| AnalysisError::Estimate { file: "the design".to_owned(), source: EstimateError::Periodic { trial: 1, source } })?;
                let pairs = (0..columns.len()).flat_map(|a| (0..=a).map(move |b| (a, b)));
                let lower =
                    pairs.flat_map(|(a, b)| lines.iter().map(move |&k| (k, a, b))).map(|(k, a, b)| found.mean(k, a) * found.mean(k, b).conj()).collect();
                let step_hz = sample_rate_hz / *period as f64;
                let hz = lines.iter().map(|&k| k as f64 * step_hz).collect();
                Ok(CrossSpectra::from_parts(columns.len(), sample_rate_hz, hz, lower, 1.0, 1, step_hz, Kernel::default()))
            }
        }
    }
}

/// The lines of `period` samples that carry power in any of the trials, to a millionth of the strongest.
pub(crate) fn excited_lines(trials: &[Vec<Vec<f64>>], period: usize, sample_rate_hz: f64) -> Result<Vec<usize>, StudyError> {
    let every = Lens::Lines { period, lines: (1..period.div_ceil(2)).collect() };
    let mut power = vec![0.0; period.div_ceil(2)];
    for trial in trials {
        let spectra = every.spectra(trial, sample_rate_hz)?;
        for f in 0..spectra.frequency_hz().len() {
            power[f + 1] += (0..spectra.channels()).map(|axis| spectra.power(f, axis)).sum::<f64>();
        }
    }
    let strongest = power.iter().copied().fold(0.0, f64::max);
    Ok((1..power.len()).filter(|&k| power[k] > 1e-6 * strongest).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndof_signal::Multisine;

    #[test]
    fn orthogonal_experiments_are_incoherent_on_their_lines_and_one_alone_is_coherent() {
        let set = Multisine { axes: 3, period: 1000, band_hz: (1.0, 12.0), crest_steps: 0, ..Multisine::default() }.generate(1).expect("valid");
        let twice: Vec<Vec<Vec<f64>>> = set.experiments.iter().map(|e| e.iter().map(|s| s.repeat(2)).collect()).collect();
        let lines = excited_lines(&twice, 1000, 500.0).expect("lines");
        assert_eq!(lines, set.excited[0]);
        let lens = Lens::Lines { period: 1000, lines };
        // Round-off of the transforms.
        assert!(lens.look(&twice, 500.0, (0.0, 1.0)).expect("seen").pooled.max < 1e-12);
        assert!(lens.look(&twice[..1], 500.0, (0.0, 1.0)).expect("seen").pooled.max > 1.0 - 1e-9);
    }

    #[test]
    fn short_records_get_short_segments() {
        assert_eq!(Lens::welch(25_000), Lens::Welch(Welch::smooth()));
        let Lens::Welch(short) = Lens::welch(4000) else { panic!("Welch") };
        assert_eq!(short.nperseg, 1000);
    }
}
