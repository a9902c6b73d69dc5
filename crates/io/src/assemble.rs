//! From the columns of a file to a recording in SI units at one rate.

use crate::error::IoError;
use crate::limits::MAX_CHANNELS;
use crate::options::ReadOptions;
use crate::recording::{MissingSamples, Note, ReadRecording};
use crate::resample;
use crate::table::{Column, Table};
use crate::timing::{RATE_KEY, START_KEY, Timing, number, timing};
use crate::units::resolve;
use ndof_signal::{Channel, Quantity, Recording, Unit};
use std::collections::HashMap;

/// Metadata that say what the recording keeps in fields of its own.
pub(crate) const SAMPLES_KEY: &str = "samples";
pub(crate) const RESERVED_KEYS: [&str; 3] = [RATE_KEY, START_KEY, SAMPLES_KEY];

/// Whether a column of this name is the time.
///
/// ```
/// assert!(ndof_io::is_time("Time_s") && !ndof_io::is_time("delay_s"));
/// ```
pub fn is_time(name: &str) -> bool {
    name == "t" || ["time", "time_s", "t_s"].iter().any(|own| name.eq_ignore_ascii_case(own))
}

/// Understands units and time of `table` and checks what a recording promises.
pub(crate) fn assemble(file: &str, mut table: Table, options: &ReadOptions) -> Result<ReadRecording, IoError> {
    check_overrides(file, &table, options)?;
    name_time(&mut table, options);
    check_names(file, &table)?;
    let declared = table.metadata.get(SAMPLES_KEY).and_then(|text| number(text));
    let incomplete = require_count(file, declared, table.columns.first().map_or(0, |c| c.samples.len()));
    if !options.any_timing {
        incomplete?;
    } else if let Err(error) = incomplete {
        table.notes.push(Note::new("sample-timing", error.to_string(), "copy the file again, or use what is there"));
    }
    if let Some(window_s) = options.window_s {
        cut(&mut table, window_s, options);
    }
    let time = table.columns.iter().position(|c| is_time(&c.name)).map(|i| table.columns.remove(i));
    let mut notes = std::mem::take(&mut table.notes);
    let Timing { clock, regridded } = timing(file, &table, time, options, &mut notes)?;
    let names: Vec<String> = table.columns.iter().map(|c| c.name.clone()).collect();
    let mut channels = Vec::with_capacity(names.len());
    let mut missing = Vec::new();
    for column in std::mem::take(&mut table.columns) {
        let (unit, factor) = resolve(file, &column.name, column.unit.as_deref(), &names, options, &mut notes)?;
        let mut samples = column.samples;
        if factor != 1.0 {
            samples.iter_mut().for_each(|s| *s *= factor);
        }
        if let Some(first) = samples.iter().position(|s| !s.is_finite()) {
            let count = samples.iter().filter(|s| !s.is_finite()).count();
            missing.push(MissingSamples { channel: column.name.clone(), place: table.place(first), count, total: samples.len() });
        }
        if let Some((times, grid)) = &regridded {
            samples = resample::interpolate(times, &samples, grid);
        }
        channels.push(Channel::new(column.name, unit, samples));
    }
    RESERVED_KEYS.iter().for_each(|key| {
        table.metadata.remove(*key);
    });
    let recording = Recording::new(clock.rate_hz, channels)
        .map_err(|source| IoError::Recording { file: file.to_owned(), source })?
        .starting_at(clock.start_s)
        .with_metadata(table.metadata);
    let read = ReadRecording { file: file.to_owned(), trial: table.trial, recording, notes, missing };
    if !options.allow_nan {
        read.require_complete(None)?;
    }
    Ok(read)
}

/// Calls the time `t` where its name does not say that it is, and returns that name: the column that is given as the time; else, where nothing says how fast rows
/// were taken, the only column whose unit is one of time, and that grows from row to row.
pub(crate) fn name_time(table: &mut Table, options: &ReadOptions) -> Option<String> {
    let told = options.sample_rate_hz.is_some() || table.metadata.contains_key(RATE_KEY) || table.columns.iter().any(|c| is_time(&c.name));
    let unit = |c: &Column| options.units.get(&c.name).or(c.unit.as_ref()).cloned();
    let of_time = |c: &Column| unit(c).is_some_and(|unit| Unit::parse(&unit).is_ok_and(|(unit, _)| unit.quantity() == Quantity::Time));
    let mut found = (0..table.columns.len()).filter(|k| of_time(&table.columns[*k]));
    let time = match (&options.time, found.next(), found.next()) {
        (Some(name), ..) => table.columns.iter().position(|c| c.name == *name)?,
        (None, Some(only), None) if !told && table.columns[only].samples.windows(2).all(|t| t[1] > t[0]) => only,
        _ => return None,
    };
    let column = &mut table.columns[time];
    column.unit = unit(column);
    Some(std::mem::replace(&mut column.name, "t".to_owned()))
}

/// Drops the rows outside of a window of time; a unit that is none of time is told later.
fn cut(table: &mut Table, (from_s, to_s): (f64, f64), options: &ReadOptions) {
    let Some(time) = table.columns.iter().find(|c| is_time(&c.name)) else { return };
    let unit = options.units.get(&time.name).or(time.unit.as_ref()).map_or("s", String::as_str);
    let factor = Unit::parse(unit).map_or(1.0, |(_, factor)| factor);
    let kept: Vec<bool> = time.samples.iter().map(|t| !(t * factor < from_s || t * factor >= to_s)).collect();
    fn keep<T>(values: &mut Vec<T>, kept: &[bool]) {
        let mut flags = kept.iter();
        values.retain(|_| flags.next().is_none_or(|keep| *keep));
    }
    table.columns.iter_mut().for_each(|column| keep(&mut column.samples, &kept));
    keep(&mut table.lines, &kept);
}

fn check_names(file: &str, table: &Table) -> Result<(), IoError> {
    if table.columns.len() > MAX_CHANNELS {
        return Err(IoError::too_large(file, "channels", table.columns.len(), MAX_CHANNELS, "split the file; if it has a row for each channel, transpose it"));
    }
    let mut seen = HashMap::new();
    for (i, column) in table.columns.iter().enumerate() {
        let key = if is_time(&column.name) { "t" } else { column.name.as_str() };
        if let Some(first) = seen.insert(key, i) {
            return Err(IoError::DuplicateName { file: file.to_owned(), name: column.name.clone(), first: first + 1, second: i + 1 });
        }
    }
    if table.columns.iter().all(|c| is_time(&c.name)) {
        let ignored: Vec<&str> = table.notes.iter().filter(|note| note.code == "ignored-arrays").map(|note| note.message.as_str()).collect();
        let what = std::iter::once("there is no channel in it besides the time").chain(ignored).collect::<Vec<_>>().join("; ");
        return Err(IoError::unsuitable(file, what, "a recording needs at least one, such as `force_x [N]`"));
    }
    Ok(())
}

/// Refuses a file that says how many samples it has, and has another number of them.
pub(crate) fn require_count(file: &str, declared: Option<f64>, found: usize) -> Result<(), IoError> {
    match declared {
        Some(declared) if declared != found as f64 => Err(IoError::SampleCount { file: file.to_owned(), declared, found }),
        _ => Ok(()),
    }
}

fn check_overrides(file: &str, table: &Table, options: &ReadOptions) -> Result<(), IoError> {
    // A stream has called its time `t` by now.
    let there = |name: &String| table.columns.iter().any(|c| c.name == *name || options.time.as_ref() == Some(name) && is_time(&c.name));
    match options.units.keys().chain(&options.time).find(|name| !there(name)) {
        Some(name) if !options.units_elsewhere => {
            Err(IoError::NoChannel { file: file.to_owned(), channel: name.clone(), available: table.columns.iter().map(|c| c.name.clone()).collect() })
        }
        _ => Ok(()),
    }
}
