//! An estimate of recordings that need not fit into memory.

use super::estimated::Estimated;
use super::settings::{Estimate, MethodName};
use super::summed::{Summed, segment};
use crate::error::AnalysisError;
use crate::result::{Warning, word};
use crate::trials::{RoleNames, Trial, Trials, add_each, other_unit, require_motion};
use ndof_signal::Recording;

/// Welch's method on recordings that come piece by piece; the estimate is that of the whole recordings, to the last bit.
///
/// Channels and roles are those of the first piece, and what is checked of the signals themselves is checked on it. A piece that does not
/// follow is another recording, with the same channels in the same units.
pub struct Streamed {
    names: RoleNames,
    settings: Estimate,
    begun: Option<Begun>,
}

struct Begun {
    first: Trials,
    summed: Summed,
    /// The recording that comes, and the least and greatest value of each of its channels.
    file: String,
    ranges: Vec<[f64; 2]>,
}

impl Begun {
    fn take(&mut self, columns: &[&[f64]]) -> Result<(), AnalysisError> {
        self.summed.push(columns, &self.file)?;
        for ([low, high], column) in self.ranges.iter_mut().zip(columns) {
            (*low, *high) = column.iter().fold((*low, *high), |(low, high), x| (low.min(*x), high.max(*x)));
        }
        Ok(())
    }

    /// Ends a recording, which has to have moved.
    fn end(&mut self) -> Result<(), AnalysisError> {
        require_motion(&self.file, &self.first.roles.ports, &self.first.trials[0].recording.names(), &self.ranges)?;
        self.ranges.fill(NOTHING);
        self.summed.end(&self.file)
    }
}

/// The range of no sample.
const NOTHING: [f64; 2] = [f64::INFINITY, f64::NEG_INFINITY];

impl Streamed {
    /// Nothing yet.
    ///
    /// # Errors
    /// [`AnalysisError::NoStream`] for another method than Welch's.
    pub fn new(names: RoleNames, settings: Estimate) -> Result<Self, AnalysisError> {
        match settings.method {
            MethodName::Auto | MethodName::Welch => Ok(Streamed { names, settings, begun: None }),
            other => Err(AnalysisError::NoStream { method: word(&other) }),
        }
    }

    /// Takes the next samples of `file`; `follows` says that they go on where those before ended.
    ///
    /// # Errors
    /// [`AnalysisError`] if roles cannot be found, channels or rate are not those of before, or a channel that is used holds no number.
    pub fn push(&mut self, file: &str, piece: Recording, follows: bool, notes: impl IntoIterator<Item = Warning>) -> Result<(), AnalysisError> {
        let Some(begun) = &mut self.begun else {
            let rate_hz = piece.sample_rate_hz();
            let trial = Trial { file: file.to_owned(), recording: piece, warnings: notes.into_iter().collect() };
            let first = Trials::of_stream(vec![trial], &self.names)?;
            let columns: Vec<&[f64]> = first.trials[0].recording.channels().iter().map(|c| c.samples.as_slice()).collect();
            let summed = Summed::new(&self.settings, segment(&self.settings, rate_hz), (rate_hz, columns.len()), file)?;
            let mut begun = Begun { first: first.clone(), summed, file: file.to_owned(), ranges: vec![NOTHING; columns.len()] };
            begun.take(&columns)?;
            self.begun = Some(begun);
            return Ok(());
        };
        let own = &begun.first.trials[0];
        let mismatch = |what, found, expected| AnalysisError::TrialMismatch { file: file.to_owned(), what, found, first: own.file.clone(), expected };
        if piece.sample_rate_hz() != begun.first.sample_rate_hz() {
            return Err(mismatch("the sample rate", format!("{} Hz", piece.sample_rate_hz()), format!("{} Hz", begun.first.sample_rate_hz())));
        }
        if !follows && let Some((found, expected)) = other_unit(piece.channels(), &own.recording) {
            return Err(mismatch("a channel", found, expected));
        }
        let find = |name: &String| piece.channels().iter().find(|channel| channel.name == *name).map(|channel| channel.samples.as_slice());
        let names = own.recording.names();
        let columns: Option<Vec<&[f64]>> = names.iter().map(find).collect();
        let columns = columns.ok_or_else(|| mismatch("the list of channels", piece.names().join(", "), names.join(", ")))?;
        add_each(&mut begun.first.warnings, notes);
        if !follows {
            begun.end()?;
            begun.file = file.to_owned();
        }
        begun.take(&columns)
    }

    /// The estimate of everything that came.
    ///
    /// # Errors
    /// [`AnalysisError`] if nothing came, a recording is shorter than a segment or does not move, or the estimate does not exist.
    pub fn finish(self) -> Result<Estimated, AnalysisError> {
        let mut begun = self.begun.ok_or(AnalysisError::NoRecording)?;
        begun.end()?;
        let spectra = begun.summed.spectra(&begun.file)?.ok_or(AnalysisError::NoRecording)?;
        begun.summed.estimate(spectra, &begun.first, &self.settings)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::trials::Trim;
    use ndof_signal::{Channel, Unit};

    fn settings() -> Estimate {
        Estimate { nperseg: Some(64), ..Estimate::default() }
    }

    /// `samples` that rest in the first `resting` of them.
    fn recording(samples: usize, resting: usize) -> Recording {
        let force: Vec<f64> = (0..samples).map(|k| if k < resting { 0.0 } else { (k * k % 101) as f64 / 101.0 - 0.5 }).collect();
        let motion: Vec<f64> = force.iter().enumerate().map(|(k, f)| f / 300.0 + if k < resting { 0.0 } else { 1e-4 * (k * k % 37) as f64 }).collect();
        let channel = |name: &str, unit: &str, samples| Channel::new(name, Unit::parse(unit).expect("a unit").0, samples);
        Recording::new(100.0, vec![channel("force_x", "N", force), channel("pos_x", "m", motion)]).expect("valid")
    }

    fn streamed(recordings: &[(&str, Recording)]) -> Result<Estimated, AnalysisError> {
        let mut streamed = Streamed::new(RoleNames::default(), settings())?;
        for (file, recording) in recordings {
            for from in (0..recording.len()).step_by(200) {
                let piece = recording.slice(from..(from + 200).min(recording.len())).expect("there");
                streamed.push(file, piece, from > 0, [])?;
            }
        }
        streamed.finish()
    }

    #[test]
    fn a_recording_may_rest_in_its_first_piece_but_not_throughout() {
        let whole = recording(2000, 300);
        let trial = Trial { file: "a".to_owned(), recording: whole.clone(), warnings: Vec::new() };
        let trials = Trials::new(vec![trial], &RoleNames::default(), &Trim::default()).expect("roles");
        let expected = crate::estimate::estimate(&trials, &Estimate { method: MethodName::Welch, ..settings() }).expect("an estimate");
        let found = streamed(&[("a", whole)]).expect("an estimate");
        assert_eq!(found.result.direct, expected.result.direct);
        for order in [[("moves", recording(1000, 0)), ("rests", recording(1000, 1000))], [("rests", recording(1000, 1000)), ("moves", recording(1000, 0))]] {
            let error = streamed(&order).err().map(|error| error.to_string()).unwrap_or_default();
            assert!(error.contains("rests") && error.contains("force_x"), "{error}");
        }
    }

    #[test]
    fn a_recording_that_is_too_short_is_the_one_that_is_named() {
        for order in [["short", "long"], ["long", "short"]] {
            let of = |name: &'static str| (name, recording(if name == "short" { 40 } else { 1000 }, 0));
            let error = streamed(&order.map(of)).err().map(|error| error.to_string()).unwrap_or_default();
            assert!(error.starts_with("short"), "{error}");
        }
    }
}
