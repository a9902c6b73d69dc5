//! What a file is: what was understood of it, what was not, and what would make it readable.

use crate::contents::contents;
use crate::detect::detect;
use crate::error::{IoError, listed};
use crate::options::ReadOptions;
use crate::read::read_trials;
use crate::recording::{Note, ReadRecording};
use crate::response::{format_name, read_response_bytes};
use serde::Serialize;
use std::path::Path;

/// Notes of what was understood; of the others, something was left out, assumed or repaired.
const PLAIN: [&str; 5] = ["unit-converted", "unit-given", "clocks-joined", "clock-of-messages", "decimal-comma"];

/// What a file holds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Holds {
    /// Channels over time.
    Recording,
    /// A frequency response.
    Response,
    /// Nothing that is read here.
    #[default]
    Unknown,
}

/// What a file is.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Explanation {
    /// The file.
    pub file: String,
    /// Its size in bytes.
    pub bytes: u64,
    /// The format's name; [`None`] where it is not known.
    pub format: Option<&'static str>,
    /// What it holds.
    pub holds: Holds,
    /// The trials in it, as far as they could be read.
    pub trials: Vec<ExplainedTrial>,
    /// What was understood, in sentences.
    pub understood: Vec<String>,
    /// What was not, and what was assumed or left out.
    pub not_understood: Vec<String>,
    /// Options, and other things to do, that would make it readable or its meaning sure.
    pub remedies: Vec<String>,
    /// Whether it is read as it is.
    pub readable: bool,
}

/// One trial of a file.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ExplainedTrial {
    /// Its name, in a file that may hold several.
    pub name: Option<String>,
    /// Samples a second; [`None`] where nothing says it.
    pub sample_rate_hz: Option<f64>,
    /// Samples of each channel.
    pub samples: usize,
    /// Its channels.
    pub channels: Vec<ExplainedChannel>,
}

/// One channel of a trial.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct ExplainedChannel {
    /// Its name.
    pub name: String,
    /// Its unit's symbol, in the International System; "" for none.
    pub unit: String,
    /// Samples that are missing.
    pub missing: usize,
}

/// Explains any file. It fails only where the file cannot be opened: what cannot be read is part of the explanation.
///
/// # Errors
/// [`IoError::Read`], [`IoError::TooLarge`].
///
/// ```
/// let folder = tempfile::tempdir()?;
/// let path = folder.path().join("log.asc");
/// std::fs::write(&path, "1 0.5 3\n2 0.25 4\n3 0.125 5\n")?;
/// let told = ndof_io::explain(&path)?;
/// assert!(!told.readable && told.remedies.iter().any(|remedy| remedy.contains("--columns")));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn explain(path: &Path) -> Result<Explanation, IoError> {
    let (bytes, file) = contents(path)?;
    let format = detect(&bytes, &file);
    let mut told = Explanation { bytes: bytes.len() as u64, format: format.as_ref().ok().map(|f| f.name), file, ..Explanation::default() };
    if let Some(name) = format_name(&bytes) {
        told.format = Some(name);
        told.response(&bytes);
        return Ok(told);
    }
    if let Err(error) = format {
        told.refused(&error);
        return Ok(told);
    }
    let lenient = ReadOptions { any_timing: true, allow_nan: true, ..ReadOptions::default() };
    match read_trials(path, &lenient) {
        Ok(trials) => told.recording(trials, true),
        Err(error @ IoError::NoSampleRate { .. }) => {
            told.refused(&error);
            // Any rate shows the channels; it is not told.
            if let Ok(trials) = read_trials(path, &ReadOptions { sample_rate_hz: Some(1.0), ..lenient }) {
                told.recording(trials, false);
            }
        }
        Err(error) => told.refused(&error),
    }
    Ok(told)
}

impl Explanation {
    fn recording(&mut self, trials: Vec<ReadRecording>, timed: bool) {
        self.holds = Holds::Recording;
        self.readable = timed;
        if trials.len() > 1 {
            let names: Vec<String> = trials.iter().filter_map(|t| t.trial.clone()).collect();
            self.understood.push(format!("it holds {} trials: {}", trials.len(), listed(&names)));
            self.remedies.push("all are read as repeated trials; --trial NAME takes one".to_owned());
        }
        let mut seen: Vec<Note> = Vec::new();
        for read in trials {
            let (channels, samples) = (read.recording.channels(), read.recording.len());
            if self.trials.is_empty() {
                let rate = if timed { format!(" at {} Hz, {:.3} s", read.recording.sample_rate_hz(), read.recording.duration_s()) } else { String::new() };
                self.understood.push(format!("{} channels of {samples} samples{rate}", channels.len()));
            }
            let missing = |name: &str| read.missing.iter().find(|m| m.channel == name).map_or(0, |m| m.count);
            let explained = |c: &ndof_signal::Channel| ExplainedChannel { name: c.name.clone(), unit: c.unit.symbol().to_owned(), missing: missing(&c.name) };
            self.trials.push(ExplainedTrial {
                name: read.trial.clone(),
                sample_rate_hz: timed.then(|| read.recording.sample_rate_hz()),
                samples,
                channels: channels.iter().map(explained).collect(),
            });
            if let Some(missing) = read.missing.first() {
                self.not_understood
                    .push(format!("channel \"{}\" misses {} of {} samples, the first at {}", missing.channel, missing.count, missing.total, missing.place));
                self.remedies.push("--start, --stop and --exclude cut a stretch out".to_owned());
            }
            seen.extend(read.notes.into_iter().filter(|note| !seen.contains(note)).collect::<Vec<_>>());
        }
        let unitless = |c: &ExplainedChannel| c.unit.is_empty();
        let without: Vec<String> = self.trials.first().into_iter().flat_map(|t| t.channels.iter().filter(|c| unitless(c))).map(|c| c.name.clone()).collect();
        if !without.is_empty() {
            self.not_understood.push(format!("nothing says the unit of {}", listed(&without)));
            self.remedies.push("--channels NEW=\"OLD [UNIT]\" gives a name and a unit".to_owned());
        }
        for note in seen {
            let plain = PLAIN.contains(&note.code.as_str());
            if plain { &mut self.understood } else { &mut self.not_understood }.push(note.message);
            if !plain {
                self.remedies.push(note.action);
            }
            self.readable &= note.code != "sample-timing";
        }
        self.remedies.dedup();
    }

    fn response(&mut self, bytes: &[u8]) {
        self.holds = Holds::Response;
        match read_response_bytes(bytes, &self.file) {
            Ok(response) => {
                self.readable = true;
                let (first, last) = (response.frequency_hz.first().copied().unwrap_or(0.0), response.frequency_hz.last().copied().unwrap_or(0.0));
                self.understood.push(format!(
                    "a frequency response of {} to {}, {} frequencies from {first} to {last} Hz",
                    response.outputs.join(", "),
                    response.inputs.join(", "),
                    response.frequency_hz.len()
                ));
                for (there, what) in [(response.std.is_some(), "standard errors"), (response.coherence.is_some(), "coherences")] {
                    if there { &mut self.understood } else { &mut self.not_understood }
                        .push(format!("{} {what} with it", if there { "there are" } else { "there are no" }));
                }
            }
            Err(error) => self.refused(&error),
        }
    }

    /// Says why a file is refused: what is wrong, and what is to be done, are one sentence of the error.
    fn refused(&mut self, error: &IoError) {
        let told = error.to_string();
        let told = told.strip_prefix(&self.file).map_or(told.as_str(), |rest| rest.trim_start_matches([':', ',', ' ']));
        match told.split_once("; ") {
            Some((what, remedy)) => {
                self.not_understood.push(what.to_owned());
                self.remedies.push(remedy.to_owned());
            }
            None => self.not_understood.push(told.to_owned()),
        }
    }
}
