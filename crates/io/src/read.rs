//! Reading a recording from any format.

use crate::assemble::assemble;
use crate::bids;
use crate::contents::contents;
use crate::detect;
use crate::error::{IoError, listed};
use crate::formats::TEXT;
use crate::names::split_name;
use crate::options::ReadOptions;
use crate::recording::ReadRecording;
use crate::table::{Column, Rounding, Table};
use ndof_signal::RecordingError;
use std::collections::BTreeMap;
use std::path::Path;

/// Reads a recording; the format follows from the content, then from the suffix. `-` is standard input, as CSV.
///
/// # Errors
/// [`IoError`] with file, place and remedy; [`IoError::SeveralTrials`] where [`read_trials`] would give more than one.
pub fn read(path: &Path, options: &ReadOptions) -> Result<ReadRecording, IoError> {
    if bids::is(path) {
        return bids::read(path, options);
    }
    let (bytes, file) = contents(path)?;
    read_bytes(&bytes, &file, options)
}

/// Reads every trial that a file holds, in the file's order: one, except in archives of trials and the like.
///
/// # Errors
/// [`IoError`] with file, trial, place and remedy.
pub fn read_trials(path: &Path, options: &ReadOptions) -> Result<Vec<ReadRecording>, IoError> {
    if bids::is(path) {
        return Ok(vec![bids::read(path, options)?]);
    }
    let (bytes, file) = contents(path)?;
    read_trials_bytes(&bytes, &file, options)
}

/// Reads a recording from the bytes of a file called `file`, whose suffix counts where the content does not tell.
///
/// # Errors
/// As [`read`].
///
/// ```
/// let csv = b"# sample_rate_hz: 500\nforce_x [N],pos_x [mm]\n1.0,2.0\n1.5,2.5\n";
/// let read = ndof_io::read_bytes(csv, "trial.csv", &ndof_io::ReadOptions::default())?;
/// assert_eq!(read.recording.sample_rate_hz(), 500.0);
/// assert_eq!(read.recording.channel("pos_x")?.samples, [0.002, 0.0025]); // SI
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn read_bytes(bytes: &[u8], file: &str, options: &ReadOptions) -> Result<ReadRecording, IoError> {
    let mut tables = tables(bytes, file, options)?;
    match tables.len() {
        1 => assemble(file, tables.remove(0), options),
        _ => Err(IoError::SeveralTrials {
            file: file.to_owned(),
            trials: tables.into_iter().map(|table| table.trial.unwrap_or_default()).collect(),
            remedy: "name one with --trial NAME",
        }),
    }
}

/// As [`read_trials`], from the bytes of a file called `file`.
///
/// # Errors
/// As [`read_trials`].
///
/// ```
/// let csv = b"# sample_rate_hz: 500\nforce_x [N],pos_x [mm]\n1.0,2.0\n1.5,2.5\n";
/// let trials = ndof_io::read_trials_bytes(csv, "trial.csv", &ndof_io::ReadOptions::default())?;
/// assert_eq!((trials.len(), trials[0].trial.as_deref()), (1, None));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn read_trials_bytes(bytes: &[u8], file: &str, options: &ReadOptions) -> Result<Vec<ReadRecording>, IoError> {
    let tables = tables(bytes, file, options)?;
    let name = |table: &Table| {
        table.trial.as_ref().map_or_else(
            || file.to_owned(),
            |trial| {
                let said = if trial.starts_with("trial") { "" } else { "trial " };
                format!("{file}, {said}{trial}")
            },
        )
    };
    tables.into_iter().map(|table| assemble(&name(&table), table, options)).collect()
}

/// The tables that are asked for, at least one.
fn tables(bytes: &[u8], file: &str, options: &ReadOptions) -> Result<Vec<Table>, IoError> {
    let format = detect::detect(bytes, file)?;
    let unsuitable = |what: String, remedy: String| IoError::Unsuitable { file: file.to_owned(), what, remedy };
    if options.columns.is_some() && format.name != TEXT {
        return Err(unsuitable(format!("columns are given by number, and a file of {} names its own", format.name), "leave --columns out".to_owned()));
    }
    if options.sample_rate_hz.is_none() && crate::response::is_response(bytes) {
        return Err(unsuitable("it is a frequency response and no recording over time".to_owned(), "read it as one: fit and compare do".to_owned()));
    }
    let mut tables = (detect::reader(format, file)?)(bytes, file, options)?;
    if tables.is_empty() {
        return Err(unsuitable("there is no trial in it".to_owned(), "look whether it was saved completely".to_owned()));
    }
    if let Some(wanted) = &options.trial {
        let number = wanted.parse::<usize>().ok().filter(|n| (1..=tables.len()).contains(n));
        match tables.iter().position(|table| table.trial.as_ref() == Some(wanted)).or(number.map(|n| n - 1)) {
            Some(at) => tables = vec![tables.swap_remove(at)],
            None => {
                let names: Vec<String> = tables.into_iter().map(|table| table.trial.unwrap_or_default()).collect();
                return Err(unsuitable(format!("there is no trial \"{wanted}\" in it"), format!("it has: {}", listed(&names))));
            }
        }
    }
    Ok(tables)
}

/// Makes a recording of columns in memory, a data frame's for example, under the rules of files: `name [unit]` or a name
/// that says it, time as a column `t` or `time` or a rate in `metadata` or `options`. `file` is what messages call it.
///
/// # Errors
/// [`IoError`] with place and remedy.
///
/// ```
/// use ndof_io::{ReadOptions, from_columns};
/// let columns = vec![("time [ms]".to_owned(), vec![0.0, 2.0, 4.0]), ("pos_x [mm]".to_owned(), vec![1.0, 2.0, 3.0])];
/// let read = from_columns(columns, Default::default(), "the table", &ReadOptions::default())?;
/// assert_eq!((read.recording.sample_rate_hz(), read.recording.channel("pos_x")?.samples[2]), (500.0, 0.003));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn from_columns(columns: Vec<(String, Vec<f64>)>, metadata: BTreeMap<String, String>, file: &str, options: &ReadOptions) -> Result<ReadRecording, IoError> {
    let column = |(text, samples): (String, Vec<f64>)| {
        let (name, unit) = split_name(&text);
        Column { name: name.into_owned(), unit: unit.map(str::to_owned), samples, rounding: Rounding::default() }
    };
    let columns: Vec<Column> = columns.into_iter().map(column).collect();
    if let Some(pair) = columns.windows(2).find(|pair| pair[0].samples.len() != pair[1].samples.len()) {
        let source =
            RecordingError::Length { first: pair[0].name.clone(), expected: pair[0].samples.len(), name: pair[1].name.clone(), found: pair[1].samples.len() };
        return Err(IoError::Recording { file: file.to_owned(), source });
    }
    assemble(file, Table { columns, metadata, ..Table::default() }, options)
}
