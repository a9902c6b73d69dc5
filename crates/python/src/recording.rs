//! Recordings between Python and Rust, and their files.

use crate::document::Document;
use crate::error::{raise, raise_analysis, raise_io};
use ndof::analysis::file::ChannelsFile;
use ndof::analysis::result::Warning;
use ndof::analysis::{RoleNames, Trial, Trials, Trim, axis_of};
use ndof::io::{ReadOptions, ReadRecording, Resample};
use ndof::signal::{Channel, Quantity, Recording, RecordingError, Unit};
use numpy::{IntoPyArray, PyArray1, PyReadonlyArray1};
use pyo3::prelude::*;
use std::collections::BTreeMap;
use std::path::PathBuf;

/// Code, message and action of a warning.
type WarningParts = (String, String, String);

/// The attributes of a Python `Recording`.
#[derive(FromPyObject)]
pub struct PyRecording<'py> {
    name: String,
    sample_rate_hz: f64,
    start_s: f64,
    metadata: BTreeMap<String, String>,
    warnings: Vec<WarningParts>,
    #[pyo3(attribute("_names"))]
    names: Vec<String>,
    #[pyo3(attribute("_units"))]
    units: Vec<String>,
    #[pyo3(attribute("_samples"))]
    samples: Vec<PyReadonlyArray1<'py, f64>>,
}

/// What Python makes a `Recording` from: name, rate, start, metadata, warnings, names, units, samples.
pub type Parts<'py> = (String, f64, f64, BTreeMap<String, String>, Vec<WarningParts>, Vec<String>, Vec<String>, Vec<Bound<'py, PyArray1<f64>>>);

/// The unit of a symbol that a recording holds.
pub fn unit_of(symbol: &str) -> Unit {
    Unit::parse(symbol).map_or_else(|_| Unit::other(symbol), |(unit, _)| unit)
}

impl PyRecording<'_> {
    /// Samples of all channels together.
    pub fn size(&self) -> usize {
        self.samples.iter().map(|samples| samples.as_array().len()).sum()
    }

    /// The recording as a trial of the library; samples are copied once.
    pub fn trial(&self) -> PyResult<Trial> {
        let channels = self.names.iter().zip(&self.units).zip(&self.samples);
        let channels = channels.map(|((name, unit), samples)| Channel::new(name, unit_of(unit), samples.as_array().to_vec())).collect();
        let recording = Recording::new(self.sample_rate_hz, channels).map_err(raise)?.starting_at(self.start_s).with_metadata(self.metadata.clone());
        let warnings = self.warnings.iter().map(|(code, message, action)| Warning::new(code, message, action)).collect();
        Ok(Trial { warnings, ..Trial::of(&self.name, recording) })
    }
}

/// Several recordings as trials, with the number of their samples.
pub fn trials_of(recordings: &[PyRecording<'_>]) -> PyResult<(Vec<Trial>, usize)> {
    let size = recordings.iter().map(PyRecording::size).sum();
    Ok((recordings.iter().map(PyRecording::trial).collect::<PyResult<_>>()?, size))
}

/// Which channel is what: references, inputs, outputs.
pub type Roles = (Option<Vec<String>>, Option<Vec<String>>, Option<Vec<String>>);

/// Which stretches are used: start, stop, left out.
pub type Stretches = (Option<f64>, Option<f64>, Vec<[f64; 2]>);

/// The roles that are asked for.
pub fn role_names((references, inputs, outputs): Roles) -> RoleNames {
    RoleNames { references, inputs, outputs, ..RoleNames::default() }
}

/// Trials of one experiment with roles and stretches, as `ndof` reads them from files; the channels `kept` stay without a role.
pub fn experiment_with(trials: Vec<Trial>, roles: Roles, stretches: Stretches, kept: Vec<String>) -> PyResult<Trials> {
    let names = RoleNames { kept, ..role_names(roles) };
    Trials::new(trials, &names, &trim(stretches)).map_err(raise_analysis)
}

/// The stretches that are asked for.
pub fn trim((start_s, stop_s, exclude_s): Stretches) -> Trim {
    Trim { start_s, stop_s, exclude_s }
}

fn warnings(warnings: Vec<Warning>) -> Vec<WarningParts> {
    warnings.into_iter().map(|Warning { code, message, action }| (code, message, action)).collect()
}

/// A recording for Python; its samples move, they are not copied.
pub fn parts<'py>(py: Python<'py>, name: &str, recording: Recording, warnings: Vec<WarningParts>) -> Parts<'py> {
    let (rate, start, metadata) = (recording.sample_rate_hz(), recording.start_s(), recording.metadata().clone());
    let (mut names, mut units, mut samples) = (Vec::new(), Vec::new(), Vec::new());
    for channel in recording.into_channels() {
        names.push(channel.name);
        units.push(channel.unit.symbol().to_owned());
        samples.push(channel.samples.into_pyarray(py));
    }
    (name.to_owned(), rate, start, metadata, warnings, names, units, samples)
}

fn read_parts(py: Python<'_>, read: ReadRecording) -> Parts<'_> {
    let name = read.file.clone();
    parts(py, &name, read.recording, warnings(read.notes))
}

fn options(sample_rate_hz: Option<f64>, resample: Option<f64>, units: BTreeMap<String, String>) -> ReadOptions {
    let resample = resample.map(|hz| if hz > 0.0 { Resample::Hz(hz) } else { Resample::Auto });
    ReadOptions { sample_rate_hz, resample, units, allow_nan: true, ..ReadOptions::default() }
}

/// Reads every trial of a recording file; `resample` of 0 takes the file's median rate. `columns` says what the columns of a table without
/// a header are, `channels` what channels are that are called otherwise, `trial` takes one trial of several.
#[pyfunction]
#[expect(clippy::too_many_arguments, reason = "every setting once, as Python writes them")]
pub fn read_trials<'py>(
    py: Python<'py>,
    path: PathBuf,
    sample_rate_hz: Option<f64>,
    resample: Option<f64>,
    units: BTreeMap<String, String>,
    columns: Document,
    channels: Document,
    trial: Option<String>,
) -> PyResult<Vec<Parts<'py>>> {
    let channels: Option<ChannelsFile> = channels.parse("channels")?;
    let units = channels.iter().flat_map(ChannelsFile::units).chain(units).collect();
    let time = channels.iter().find_map(ChannelsFile::time);
    let options = ReadOptions { columns: columns.columns()?, trial, time, ..options(sample_rate_hz, resample, units) };
    let mut read = py.detach(|| ndof::io::read_trials(&path, &options)).map_err(raise_io)?;
    if let Some(channels) = channels {
        channels.check("channels").map_err(raise_analysis)?;
        for read in &mut read {
            read.recording = channels.apply(&read.recording, &read.file).map_err(raise_analysis)?;
        }
    }
    Ok(read.into_iter().map(|read| read_parts(py, read)).collect())
}

/// What a file is, what was understood of it and what not, and what would make it readable, as JSON.
#[pyfunction]
pub fn explain(py: Python<'_>, path: PathBuf) -> PyResult<String> {
    let told = py.detach(|| ndof::io::explain(&path)).map_err(raise_io)?;
    ndof::analysis::result::to_json(&told).map_err(raise)
}

/// A recording from columns in memory, under the rules of files: `name [unit]`, a column of time or a rate.
#[pyfunction]
pub fn from_columns<'py>(
    py: Python<'py>,
    name: &str,
    columns: Vec<(String, PyReadonlyArray1<'py, f64>)>,
    metadata: BTreeMap<String, String>,
    sample_rate_hz: Option<f64>,
    resample: Option<f64>,
    units: BTreeMap<String, String>,
) -> PyResult<Parts<'py>> {
    let columns = columns.iter().map(|(name, samples)| (name.clone(), samples.as_array().to_vec())).collect();
    let read = ndof::io::from_columns(columns, metadata, name, &options(sample_rate_hz, resample, units)).map_err(raise_io)?;
    Ok(read_parts(py, read))
}

/// Writes a recording in the format of the suffix; the file is there whole or not at all.
#[pyfunction]
pub fn write(py: Python<'_>, path: PathBuf, recording: PyRecording<'_>) -> PyResult<()> {
    let trial = recording.trial()?;
    py.detach(|| ndof::io::write(&path, &trial.recording)).map_err(raise_io)
}

/// SI symbol of a unit and the factor to it; without a unit, the one that the channel's name stands for.
#[pyfunction]
pub fn unit(name: &str, text: Option<&str>, others: Vec<String>) -> (String, f64) {
    if let Some(text) = text {
        return Unit::parse(text).map_or_else(|_| (text.trim().to_owned(), 1.0), |(unit, factor)| (unit.symbol().to_owned(), factor));
    }
    let turns = |axis: &str| others.iter().any(|other| (other.starts_with("angle_") || other.starts_with("torque_")) && axis_of(other) == axis);
    let unit = ndof::io::infer_unit(name).map(|unit| match unit.quantity() {
        Quantity::Velocity | Quantity::Acceleration if turns(axis_of(name)) => Unit::si(unit.quantity(), true),
        _ => unit,
    });
    (unit.map_or_else(String::new, |unit| unit.symbol().to_owned()), 1.0)
}

/// Refuses a rate that is none, names that are given twice and channels of different length.
#[pyfunction]
pub fn validate(sample_rate_hz: f64, names: Vec<String>, lengths: Vec<usize>) -> PyResult<()> {
    let channels = names.iter().map(|name| Channel::new(name, Unit::other(""), Vec::new())).collect();
    Recording::new(sample_rate_hz, channels).map_err(raise)?;
    match lengths.iter().position(|length| *length != lengths[0]) {
        Some(i) => Err(raise(RecordingError::Length { first: names[0].clone(), expected: lengths[0], name: names[i].clone(), found: lengths[i] })),
        None => Ok(()),
    }
}

/// The recording with the sign of these channels turned.
#[pyfunction]
pub fn negate<'py>(py: Python<'py>, recording: PyRecording<'py>, channels: Vec<String>) -> PyResult<Parts<'py>> {
    let Trial { file, recording: own, .. } = recording.trial()?;
    let channels: Vec<&str> = channels.iter().map(String::as_str).collect();
    Ok(parts(py, &file, ndof::io::negate(&own, &channels).map_err(raise)?, recording.warnings))
}

/// The recording joined with `other`, which another clock took, by a channel that both have.
#[pyfunction]
pub fn align<'py>(py: Python<'py>, recording: PyRecording<'py>, other: PyRecording<'py>, by: (String, String)) -> PyResult<Parts<'py>> {
    let (Trial { file, recording: own, .. }, second) = (recording.trial()?, other.trial()?);
    let aligned = py.detach(|| ndof::io::align(&own, &second.recording, (&by.0, &by.1))).map_err(raise)?;
    let note = aligned.note(&file, &second.file, &by.0);
    let notes = recording.warnings.into_iter().chain([(note.code, note.message, note.action)]).chain(other.warnings).collect();
    Ok(parts(py, &file, aligned.recording, notes))
}

fn of_quantity(recording: &Recording, quantity: Quantity) -> Vec<String> {
    recording.channels().iter().filter(|c| c.unit.quantity() == quantity && !c.name.starts_with("cmd_")).map(|c| c.name.clone()).collect()
}

/// The recording with the mean forces of `unloaded` taken off.
#[pyfunction]
pub fn tare<'py>(py: Python<'py>, recording: PyRecording<'py>, unloaded: PyRecording<'py>) -> PyResult<Parts<'py>> {
    let Trial { file, recording: own, .. } = recording.trial()?;
    let efforts = of_quantity(&own, Quantity::Effort);
    let efforts: Vec<&str> = efforts.iter().map(String::as_str).collect();
    Ok(parts(py, &file, ndof::io::tare(&own, &unloaded.trial()?.recording, &efforts).map_err(raise)?, recording.warnings))
}

/// The recording with the inertial force of a handle beyond the transducer taken off.
#[pyfunction]
pub fn without_handle<'py>(py: Python<'py>, recording: PyRecording<'py>, mass: f64) -> PyResult<Parts<'py>> {
    let Trial { file, recording: mut own, .. } = recording.trial()?;
    let mut notes = Vec::new();
    let motions = of_quantity(&own, Quantity::Displacement);
    for effort in of_quantity(&own, Quantity::Effort) {
        if let Some(motion) = motions.iter().find(|motion| axis_of(motion) == axis_of(&effort)) {
            let note;
            (own, note) = ndof::io::without_handle(&own, &effort, motion, mass).map_err(raise)?;
            notes.extend(note);
        }
    }
    Ok(parts(py, &file, own, recording.warnings.into_iter().chain(warnings(notes)).collect()))
}
