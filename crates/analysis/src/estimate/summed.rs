//! Spectra of records that come piece by piece, kept as sums.

use super::estimated::Estimated;
use super::measured::{in_file, labels};
use super::settings::Estimate;
use super::{limits, repeat};
use crate::error::AnalysisError;
use crate::trials::Trials;
use ndof_signal::{CrossSpectra, WelchError, WelchStream};
use ndof_sysid::{EstimateError, SpectralMethod, estimate_from_spectra};

/// Length of a segment where none is given: about that of the paper, 4.096 s.
const SEGMENT_S: f64 = 4.0;

/// Samples in a segment where nobody knows yet how long the measurement will be.
pub(crate) fn segment(settings: &Estimate, rate_hz: f64) -> usize {
    settings.nperseg.unwrap_or_else(|| (SEGMENT_S * rate_hz).log2().round().exp2().max(8.0) as usize)
}

/// Welch's spectra of stretches without a gap: those that have ended, and the one that grows.
#[derive(Clone)]
pub(crate) struct Summed {
    method: SpectralMethod,
    /// A stream that has seen nothing, of which each stretch begins.
    blank: WelchStream,
    growing: WelchStream,
    ended: Vec<CrossSpectra>,
}

impl Summed {
    /// Nothing yet, of segments of `nperseg` samples.
    pub fn new(settings: &Estimate, nperseg: usize, (rate_hz, channels): (f64, usize), file: &str) -> Result<Self, AnalysisError> {
        let welch = settings.segments_of(nperseg);
        let blank = welch.stream(rate_hz, channels).map_err(|source| failed(file, source))?;
        let method = SpectralMethod::Welch(welch);
        limits::estimate(&method, nperseg, channels).map_err(|what| AnalysisError::TooLarge { what })?;
        Ok(Summed { method, growing: blank.clone(), blank, ended: Vec::new() })
    }

    /// Takes the next samples, one slice a channel.
    pub fn push(&mut self, columns: &[&[f64]], file: &str) -> Result<(), AnalysisError> {
        self.growing.push(columns).map_err(|source| failed(file, source))
    }

    /// Ends the stretch: what comes next does not follow.
    pub fn end(&mut self, file: &str) -> Result<(), AnalysisError> {
        let stretch = std::mem::replace(&mut self.growing, self.blank.clone());
        self.ended.push(stretch.finish().map_err(|source| failed(file, source))?);
        Ok(())
    }

    /// The spectra of everything so far; nothing while no stretch is as long as a segment.
    pub fn spectra(&self, file: &str) -> Result<Option<CrossSpectra>, AnalysisError> {
        let all: Vec<CrossSpectra> = self.ended.iter().cloned().chain(self.growing.spectra().ok()).collect();
        match all.as_slice() {
            [] => Ok(None),
            // Pooling one would round it.
            [one] => Ok(Some(one.clone())),
            several => CrossSpectra::pool(several).map(Some).map_err(|error| AnalysisError::Estimate { file: file.to_owned(), source: error.into() }),
        }
    }

    /// Makes one of the stretches that have ended, so that memory does not grow with their number.
    pub fn join_ended(&mut self) {
        if self.ended.len() > 1
            && let Ok(joined) = CrossSpectra::pool(&self.ended)
        {
            self.ended = vec![joined];
        }
    }

    /// The estimate from `spectra`; `trials` says what the channels are.
    pub fn estimate(&self, spectra: CrossSpectra, trials: &Trials, settings: &Estimate) -> Result<Estimated, AnalysisError> {
        let why = match settings.nperseg {
            Some(_) => "segments as asked for",
            None => "segments of about 4 s: how long a stream is shows at its end only",
        };
        let stretches = spectra.trials();
        let estimates =
            estimate_from_spectra(spectra, &trials.roles.ports, &labels(trials), &self.method, settings.estimator).map_err(|error| in_file(error, trials))?;
        let mut estimated = Estimated::new(trials, settings, estimates, why.to_owned(), true)?;
        let result = &mut estimated.result;
        result.trials = stretches;
        result.head.warnings.extend(repeat::warnings(result, &estimated.estimates));
        Ok(estimated)
    }
}

fn failed(file: &str, source: WelchError) -> AnalysisError {
    AnalysisError::Estimate { file: file.to_owned(), source: EstimateError::Welch { trial: 1, source } }
}
