//! From the columns of a file to a recording in SI units at one rate.

use crate::error::IoError;
use crate::limits::MAX_CHANNELS;
use crate::note::Note;
use crate::options::{ReadOptions, Resample};
use crate::read::{MissingSamples, ReadRecording};
use crate::resample;
use crate::table::{Column, Table};
use crate::time::{Clock, Stamps, simplest};
use crate::units::resolve;
use ndof_signal::{Channel, Quantity, Recording, Unit};
use std::collections::HashMap;

/// Metadata that say what the recording keeps in fields of its own.
pub(crate) const RATE_KEY: &str = "sample_rate_hz";
pub(crate) const START_KEY: &str = "start_s";
pub(crate) const SAMPLES_KEY: &str = "samples";
pub(crate) const RESERVED_KEYS: [&str; 3] = [RATE_KEY, START_KEY, SAMPLES_KEY];

/// A metadata rate further than this from the time column's is not the same rate.
const RATE_AGREEMENT: f64 = 1e-3;

/// An interpolation grid may be this far from the median step: it is ours to choose, so it gets a round rate.
const GRID_ROUNDING: f64 = 1e-3;

/// Whether a column of this name is the time.
pub(crate) fn is_time(name: &str) -> bool {
    name == "t" || name.eq_ignore_ascii_case("time")
}

/// Understands units and time of `table` and checks what a recording promises.
pub(crate) fn assemble(file: &str, mut table: Table, options: &ReadOptions) -> Result<ReadRecording, IoError> {
    check_names(file, &table)?;
    check_sample_count(file, &table)?;
    let time = table.columns.iter().position(|c| is_time(&c.name)).map(|i| table.columns.remove(i));
    check_overrides(file, &table, options)?;
    let mut notes = std::mem::take(&mut table.notes);
    let (clock, grid) = match time {
        Some(column) => from_stamps(file, &table, column, options, &mut notes)?,
        None => (from_rate(file, &table, options)?, None),
    };
    let mut channels = Vec::with_capacity(table.columns.len());
    let mut missing = Vec::new();
    for column in std::mem::take(&mut table.columns) {
        let (unit, factor) = resolve(file, &column.name, column.unit.as_deref(), options, &mut notes)?;
        let mut samples = column.samples;
        if factor != 1.0 {
            samples.iter_mut().for_each(|s| *s *= factor);
        }
        if let Some(first) = samples.iter().position(|s| !s.is_finite()) {
            let count = samples.iter().filter(|s| !s.is_finite()).count();
            missing.push(MissingSamples { channel: column.name.clone(), place: table.place(first), first_sample: first, count, total: samples.len() });
        }
        if let Some((times, grid)) = &grid {
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
    let read = ReadRecording { file: file.to_owned(), recording, notes, missing };
    if !options.allow_nan {
        read.require_complete(None)?;
    }
    Ok(read)
}

fn check_names(file: &str, table: &Table) -> Result<(), IoError> {
    if table.columns.len() > MAX_CHANNELS {
        return Err(IoError::TooLarge {
            file: file.to_owned(),
            what: "channels",
            found: table.columns.len() as u64,
            limit: MAX_CHANNELS as u64,
            remedy: "split the file; if it has a row for each channel, transpose it",
        });
    }
    let mut seen = HashMap::new();
    for (i, column) in table.columns.iter().enumerate() {
        let key = if is_time(&column.name) { "t" } else { column.name.as_str() };
        if let Some(first) = seen.insert(key, i) {
            return Err(IoError::DuplicateName { file: file.to_owned(), name: column.name.clone(), first: first + 1, second: i + 1 });
        }
    }
    if table.columns.iter().all(|c| is_time(&c.name)) {
        return Err(IoError::Unsuitable {
            file: file.to_owned(),
            what: "there is no channel in it besides the time".to_owned(),
            remedy: "a recording needs at least one, such as `force_x [N]`".to_owned(),
        });
    }
    Ok(())
}

fn check_sample_count(file: &str, table: &Table) -> Result<(), IoError> {
    let found = table.columns.first().map_or(0, |c| c.samples.len());
    match table.metadata.get(SAMPLES_KEY).and_then(|text| number(text)) {
        Some(declared) if declared != found as f64 => Err(IoError::SampleCount { file: file.to_owned(), declared, found }),
        _ => Ok(()),
    }
}

fn check_overrides(file: &str, table: &Table, options: &ReadOptions) -> Result<(), IoError> {
    match options.units.keys().find(|name| !table.columns.iter().any(|c| c.name == **name)) {
        Some(name) => {
            Err(IoError::NoChannel { file: file.to_owned(), channel: name.clone(), available: table.columns.iter().map(|c| c.name.clone()).collect() })
        }
        None => Ok(()),
    }
}

/// The number that a metadata value is, with the separators behind it that spreadsheets leave on comment lines.
fn number(text: &str) -> Option<f64> {
    text.trim_end_matches([',', ';', '\t', ' ']).parse().ok().filter(|x: &f64| x.is_finite())
}

fn from_rate(file: &str, table: &Table, options: &ReadOptions) -> Result<Clock, IoError> {
    let start_s = table.metadata.get(START_KEY).and_then(|t| number(t)).unwrap_or(0.0);
    let written = table.metadata.get(RATE_KEY);
    let clock = |rate_hz| Clock { rate_hz, start_s, relative_error: 0.0 };
    if let Some(rate_hz) = written.and_then(|text| number(text)) {
        return if rate_hz > 0.0 { Ok(clock(rate_hz)) } else { Err(IoError::BadRate { file: file.to_owned(), what: "sample_rate_hz", rate_hz }) };
    }
    match options.sample_rate_hz {
        Some(rate_hz) if rate_hz.is_finite() && rate_hz > 0.0 => Ok(clock(rate_hz)),
        Some(rate_hz) => Err(IoError::BadRate { file: file.to_owned(), what: "the sample rate given", rate_hz }),
        None => Err(IoError::NoSampleRate {
            file: file.to_owned(),
            found: match written {
                Some(text) => format!("the sample rate is \"{text}\", which is no number"),
                None => "neither a time column nor a sample rate says how fast the samples were taken".to_owned(),
            },
        }),
    }
}

type Regridded = Option<(Vec<f64>, resample::Grid)>;

fn from_stamps(file: &str, table: &Table, mut column: Column, options: &ReadOptions, notes: &mut Vec<Note>) -> Result<(Clock, Regridded), IoError> {
    let unit = column.unit.as_deref().unwrap_or("s");
    let factor = match Unit::parse(unit) {
        Ok((parsed, factor)) if parsed.quantity() == Quantity::Time => factor,
        _ => return Err(IoError::TimeUnit { file: file.to_owned(), column: column.name.clone(), unit: unit.to_owned() }),
    };
    let total = column.samples.len();
    if let Some(row) = column.samples.iter().position(|t| !t.is_finite()) {
        let count = column.samples.iter().filter(|t| !t.is_finite()).count();
        return Err(IoError::Missing { file: file.to_owned(), place: table.place(row), channel: column.name, count, total });
    }
    column.samples.iter_mut().for_each(|t| *t *= factor);
    column.rounding.place *= factor;
    let stamps = Stamps::new(file, table, &column.samples, column.rounding)?;
    let (clock, grid) = match (stamps.regular(file, table), options.resample) {
        (Ok(clock), how) => {
            let wanted = match how {
                Some(Resample::Hz(rate_hz)) if (rate_hz / clock.rate_hz - 1.0).abs() > RATE_AGREEMENT => how,
                _ => None,
            };
            match wanted {
                Some(how) => (clock, Some(resample::grid(file, table, &stamps, how)?)),
                None => (agree(table, options, clock, notes), None),
            }
        }
        (Err(error), None) => return Err(error),
        (Err(_), Some(how)) => {
            let how = match how {
                Resample::Auto => Resample::Hz(simplest(1.0 / stamps.median_step_s, GRID_ROUNDING)),
                given => given,
            };
            let grid = resample::grid(file, table, &stamps, how)?;
            (Clock { rate_hz: grid.rate_hz, start_s: grid.start_s, relative_error: 0.0 }, Some(grid))
        }
    };
    let Some(grid) = grid else { return Ok((clock, None)) };
    notes.push(Note::new(
        "resampled",
        format!(
            "{total} samples were interpolated onto {} at {} Hz; the longest gap is {:.3} steps long",
            grid.len,
            grid.rate_hz,
            grid.longest_gap_s / stamps.median_step_s
        ),
        format!("trust nothing above {:.3} Hz, half a sample a gap", 0.5 / grid.longest_gap_s),
    ));
    Ok((Clock { rate_hz: grid.rate_hz, start_s: grid.start_s, relative_error: 0.0 }, Some((column.samples, grid))))
}

/// Compares the time column's rate with what else is said: the exact one is taken where they agree, else it is told.
fn agree(table: &Table, options: &ReadOptions, clock: Clock, notes: &mut Vec<Note>) -> Clock {
    let written = table.metadata.get(RATE_KEY).and_then(|t| number(t)).map(|rate| (rate, "the line sample_rate_hz"));
    let given = options.sample_rate_hz.map(|rate| (rate, "the sample rate given"));
    let mut result = clock;
    for (rate_hz, what) in written.into_iter().chain(given) {
        let apart = (rate_hz / clock.rate_hz - 1.0).abs();
        if apart > RATE_AGREEMENT {
            notes.push(Note::new(
                "sample-rate-conflict",
                format!("the time column runs at {} Hz, {what} is {rate_hz} Hz; the time column is used", clock.rate_hz),
                "correct the one that is wrong, or delete the time column",
            ));
        } else if apart <= clock.relative_error + f64::EPSILON {
            result.rate_hz = rate_hz;
        }
    }
    result
}
