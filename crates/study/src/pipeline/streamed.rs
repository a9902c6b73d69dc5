//! An estimate of recordings that need not fit into memory.

use super::estimate::{conclude, in_file, labels};
use super::live::segment;
use super::method::{MethodName, welch, word};
use super::{EstimateSettings, Estimated};
use crate::error::StudyError;
use crate::limits;
use crate::result::Warning;
use crate::roles::RoleNames;
use crate::trials::{Trial, Trials, other_unit};
use crate::trim::Trim;
use ndof_signal::{CrossSpectra, Recording, Welch, WelchError, WelchStream};
use ndof_sysid::{EstimateError, SpectralMethod, estimate_from_spectra};

/// Welch's method on recordings that come piece by piece; the estimate is that of the whole recordings, to the last bit.
///
/// Channels and roles are those of the first piece, and what is checked of the signals themselves is checked on it. A piece that does not
/// follow is another recording, with the same channels in the same units.
pub struct Streamed {
    names: RoleNames,
    settings: EstimateSettings,
    begun: Option<Begun>,
    /// Stretches that are complete.
    done: Vec<CrossSpectra>,
    recordings: usize,
}

struct Begun {
    first: Trials,
    welch: Welch,
    why: String,
    stream: WelchStream,
}

impl Streamed {
    /// Nothing yet.
    ///
    /// # Errors
    /// [`StudyError::NoStream`] for another method than Welch's.
    pub fn new(names: RoleNames, settings: EstimateSettings) -> Result<Self, StudyError> {
        match settings.method {
            MethodName::Auto | MethodName::Welch => Ok(Streamed { names, settings, begun: None, done: Vec::new(), recordings: 0 }),
            other => Err(StudyError::NoStream { method: word(&other) }),
        }
    }

    /// Takes the next samples of `file`; `follows` says that they go on where those before ended.
    ///
    /// # Errors
    /// [`StudyError`] if roles cannot be found, channels or rate are not those of before, or a channel that is used holds no number.
    pub fn push(&mut self, file: &str, piece: Recording, follows: bool, notes: impl IntoIterator<Item = Warning>) -> Result<(), StudyError> {
        self.recordings += usize::from(!follows);
        let Some(begun) = &mut self.begun else {
            let rate_hz = piece.sample_rate_hz();
            let trial = Trial { file: file.to_owned(), recording: piece, warnings: notes.into_iter().collect() };
            let first = Trials::new(vec![trial], &self.names, &Trim::default())?;
            let why = match self.settings.nperseg {
                Some(_) => "segments as asked for",
                None => "segments of about 4 s: how long a stream is shows at its end only",
            };
            let welch = welch(&self.settings, segment(&self.settings, rate_hz));
            let ports = &first.roles.ports;
            let used = ports.references.len() + ports.inputs.len() + ports.outputs.len();
            limits::estimate(&SpectralMethod::Welch(welch.clone()), welch.nperseg, used).map_err(|what| StudyError::TooLarge { what })?;
            let columns: Vec<&[f64]> = first.trials[0].recording.channels().iter().map(|c| c.samples.as_slice()).collect();
            let mut stream = welch.stream(rate_hz, columns.len()).map_err(|source| failed(file, source))?;
            stream.push(&columns).map_err(|source| failed(file, source))?;
            self.begun = Some(Begun { first, welch, why: why.to_owned(), stream });
            return Ok(());
        };
        let own = &begun.first.trials[0];
        let mismatch = |what, found, expected| StudyError::TrialMismatch { file: file.to_owned(), what, found, first: own.file.clone(), expected };
        if piece.sample_rate_hz() != begun.first.sample_rate_hz() {
            return Err(mismatch("the sample rate", format!("{} Hz", piece.sample_rate_hz()), format!("{} Hz", begun.first.sample_rate_hz())));
        }
        let find = |name: &String| piece.channels().iter().find(|channel| channel.name == *name).map(|channel| channel.samples.as_slice());
        if !follows && let Some((found, expected)) = other_unit(piece.channels(), &own.recording) {
            return Err(mismatch("a channel", found, expected));
        }
        let names = own.recording.names();
        let columns: Option<Vec<&[f64]>> = names.iter().map(find).collect();
        let columns = columns.ok_or_else(|| mismatch("the list of channels", piece.names().join(", "), names.join(", ")))?;
        for note in notes {
            if !begun.first.warnings.contains(&note) {
                begun.first.warnings.push(note);
            }
        }
        if !follows {
            let next = begun.welch.stream(piece.sample_rate_hz(), columns.len()).map_err(|source| failed(file, source))?;
            close(std::mem::replace(&mut begun.stream, next), file, &mut self.done)?;
        }
        begun.stream.push(&columns).map_err(|source| failed(file, source))
    }

    /// The estimate of everything that came.
    ///
    /// # Errors
    /// [`StudyError`] if nothing came, all stretches are shorter than a segment, or the estimate does not exist.
    pub fn finish(mut self, command: &str) -> Result<Estimated, StudyError> {
        let Begun { first, welch, why, stream } = self.begun.ok_or(StudyError::NoRecording)?;
        let own = |error| in_file(error, &first);
        if self.done.is_empty() {
            self.done.push(stream.spectra().map_err(|source| own(EstimateError::Welch { trial: 1, source }))?);
        } else {
            close(stream, &first.trials[0].file, &mut self.done)?;
        }
        // Pooling one would round it.
        let spectra = match self.done.pop() {
            Some(one) if self.done.is_empty() => one,
            last => CrossSpectra::pool(&self.done.into_iter().chain(last).collect::<Vec<_>>()).map_err(|error| own(error.into()))?,
        };
        let method = SpectralMethod::Welch(welch);
        let estimates = estimate_from_spectra(spectra, &first.roles.ports, &labels(&first), &method, self.settings.estimator).map_err(own)?;
        let mut estimated = conclude(&first, &self.settings, command, estimates, why)?;
        estimated.result.trials = self.recordings;
        Ok(estimated)
    }
}

/// Keeps what a recording gave.
fn close(stream: WelchStream, file: &str, done: &mut Vec<CrossSpectra>) -> Result<(), StudyError> {
    done.push(stream.spectra().map_err(|source| failed(file, source))?);
    Ok(())
}

fn failed(file: &str, source: WelchError) -> StudyError {
    StudyError::Estimate { file: file.to_owned(), source: EstimateError::Welch { trial: 1, source } }
}
