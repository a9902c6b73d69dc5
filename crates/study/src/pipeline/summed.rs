//! Spectra of records that come piece by piece, kept as sums.

use super::estimate::{conclude, in_file, labels};
use super::method::welch;
use super::{EstimateSettings, Estimated, repeat};
use crate::error::StudyError;
use crate::limits;
use crate::trials::Trials;
use ndof_signal::{CrossSpectra, WelchError, WelchStream};
use ndof_sysid::{EstimateError, SpectralMethod, estimate_from_spectra};

/// Welch's spectra of stretches without a gap: those that have ended, and the one that grows.
#[derive(Clone)]
pub(super) struct Summed {
    method: SpectralMethod,
    /// A stream that has seen nothing, of which each stretch begins.
    blank: WelchStream,
    growing: WelchStream,
    ended: Vec<CrossSpectra>,
}

impl Summed {
    /// Nothing yet, of segments of `nperseg` samples.
    ///
    /// # Errors
    /// [`StudyError`] in the name of `file` if segments, overlap and transform do not fit, or would be more than a machine holds.
    pub fn new(settings: &EstimateSettings, nperseg: usize, (rate_hz, channels): (f64, usize), file: &str) -> Result<Self, StudyError> {
        let welch = welch(settings, nperseg);
        let blank = welch.stream(rate_hz, channels).map_err(|source| failed(file, source))?;
        let method = SpectralMethod::Welch(welch);
        limits::estimate(&method, nperseg, channels).map_err(|what| StudyError::TooLarge { what })?;
        Ok(Summed { method, growing: blank.clone(), blank, ended: Vec::new() })
    }

    /// Takes the next samples, one slice a channel.
    ///
    /// # Errors
    /// [`StudyError`] in the name of `file` if one of them is no number.
    pub fn push(&mut self, columns: &[&[f64]], file: &str) -> Result<(), StudyError> {
        self.growing.push(columns).map_err(|source| failed(file, source))
    }

    /// Ends the stretch: what comes next does not follow.
    ///
    /// # Errors
    /// [`StudyError`] in the name of `file` if it is shorter than a segment and so gives nothing.
    pub fn end(&mut self, file: &str) -> Result<(), StudyError> {
        let stretch = std::mem::replace(&mut self.growing, self.blank.clone());
        self.ended.push(stretch.spectra().map_err(|source| failed(file, source))?);
        Ok(())
    }

    /// The spectra of everything so far; nothing while no stretch is as long as a segment.
    ///
    /// # Errors
    /// [`StudyError`] in the name of `file` if stretches differ.
    pub fn spectra(&self, file: &str) -> Result<Option<CrossSpectra>, StudyError> {
        let all: Vec<CrossSpectra> = self.ended.iter().cloned().chain(self.growing.spectra().ok()).collect();
        match all.as_slice() {
            [] => Ok(None),
            // Pooling one would round it.
            [one] => Ok(Some(one.clone())),
            several => CrossSpectra::pool(several).map(Some).map_err(|error| StudyError::Estimate { file: file.to_owned(), source: error.into() }),
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
    ///
    /// # Errors
    /// [`StudyError`] if the estimate does not exist.
    pub fn estimate(&self, spectra: CrossSpectra, trials: &Trials, settings: &EstimateSettings, command: &str) -> Result<Estimated, StudyError> {
        let why = match settings.nperseg {
            Some(_) => "segments as asked for",
            None => "segments of about 4 s: how long a stream is shows at its end only",
        };
        let stretches = spectra.trials();
        let estimates =
            estimate_from_spectra(spectra, &trials.roles.ports, &labels(trials), &self.method, settings.estimator).map_err(|error| in_file(error, trials))?;
        let mut estimated = conclude(trials, settings, command, estimates, why.to_owned())?;
        let Estimated { estimates, result, .. } = &mut estimated;
        result.trials = stretches;
        result.warnings.extend(repeat::warnings(result, estimates));
        Ok(estimated)
    }
}

fn failed(file: &str, source: WelchError) -> StudyError {
    StudyError::Estimate { file: file.to_owned(), source: EstimateError::Welch { trial: 1, source } }
}
