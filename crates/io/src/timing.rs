//! When the samples of a file were taken: by its time column, its facts or its reader's word.

use crate::error::{IoError, Place};
use crate::options::{ReadOptions, Resample};
use crate::recording::Note;
use crate::resample::{self, Grid};
use crate::table::{Column, Rounding, Table};
use crate::time::{Clock, Stamps, simplest};
use ndof_signal::{Quantity, Unit};

/// Metadata that tell the rate and the start of a recording.
pub(crate) const RATE_KEY: &str = "sample_rate_hz";
pub(crate) const START_KEY: &str = "start_s";

/// A rate further than this from another is not the same rate.
pub(crate) const RATE_AGREEMENT: f64 = 1e-3;

/// A step of more than so many median steps has lost a sample.
const GAP: f64 = 1.5;

/// Hardly anybody samples the motion of a mechanism more slowly.
const SLOW_HZ: f64 = 10.0;

/// Jitter worth a word, as a share of the median step.
const JITTER: f64 = 1e-3;

/// An interpolation grid may be this far from the median step: it is ours to choose, so it gets a round rate.
const GRID_ROUNDING: f64 = 1e-3;

/// The error for one step of `found_s` among `steps` that are even.
pub(crate) fn irregular(file: &str, place: Place, found_s: f64, rate_hz: f64, steps: usize) -> IoError {
    IoError::IrregularTime { file: file.to_owned(), place, found_s, expected_s: 1.0 / rate_hz, count: 1, steps }
}

/// The clock of a recording, and the times of the file's samples with the grid to interpolate onto, if any.
pub(crate) struct Timing {
    pub clock: Clock,
    pub regridded: Option<(Vec<f64>, Grid)>,
}

impl Table {
    /// Says when its first sample was taken and how many follow in a second.
    pub fn set_clock(&mut self, rate_hz: f64, start_s: f64) {
        self.metadata.insert(RATE_KEY.to_owned(), rate_hz.to_string());
        if start_s != 0.0 {
            self.metadata.insert(START_KEY.to_owned(), start_s.to_string());
        }
    }
}

/// The timing of `table`, whose time column has been taken out as `time`.
pub(crate) fn timing(file: &str, table: &Table, time: Option<Column>, options: &ReadOptions, notes: &mut Vec<Note>) -> Result<Timing, IoError> {
    let (clock, times_s, rounding) = match time {
        Some(mut column) => {
            seconds(file, table, &mut column, options)?;
            let stamps = Stamps::new(file, table, &column.samples, column.rounding);
            let clock = stamps.and_then(|stamps| stamps.regular(file, table)).map(|clock| agree(table, options, clock, notes));
            let said = options.units.contains_key(&column.name) || column.unit.is_some();
            if let Some(clock) = clock.as_ref().ok().filter(|clock| !said && clock.rate_hz < SLOW_HZ) {
                notes.push(Note::new(
                    "unit-inferred",
                    format!("column \"{}\" says nothing of its unit and is taken in seconds, which makes {} samples a second", column.name, clock.rate_hz),
                    format!("write \"{} [s]\" into the header if that is right, and \"{} [ms]\" if it counts milliseconds", column.name, column.name),
                ));
            }
            (clock, column.samples, column.rounding)
        }
        None => {
            let clock = from_rate(file, table, options, notes)?;
            // As large as a channel, and of use only where samples are moved.
            let len = options.resample.and(table.columns.first()).map_or(0, |c| c.samples.len());
            (Ok(clock), (0..len).map(|k| clock.start_s + k as f64 / clock.rate_hz).collect(), Rounding::default())
        }
    };
    let how = match (clock, options.resample) {
        (Err(error), None) if options.any_timing => {
            let clock = by_median(table, &times_s, rounding, &error.to_string(), notes).ok_or(error)?;
            return Ok(Timing { clock, regridded: None });
        }
        (Err(error), None) => return Err(error),
        (Err(_), Some(how)) => how,
        (Ok(clock), Some(Resample::Hz(rate_hz))) if (rate_hz / clock.rate_hz - 1.0).abs() > RATE_AGREEMENT => Resample::Hz(rate_hz),
        (Ok(clock), _) => return Ok(Timing { clock, regridded: None }),
    };
    let stamps = Stamps::new(file, table, &times_s, rounding)?;
    let how = match how {
        Resample::Auto => Resample::Hz(simplest(1.0 / stamps.median_step_s, GRID_ROUNDING)),
        given => given,
    };
    let grid = resample::grid(file, table, &stamps, how)?;
    notes.push(Note::new(
        "resampled",
        format!(
            "{} samples were interpolated onto {} at {} Hz; the longest gap is {:.3} steps long",
            times_s.len(),
            grid.len,
            grid.rate_hz,
            grid.longest_gap_s / stamps.median_step_s
        ),
        format!("trust nothing above {:.3} Hz, half a sample a gap", 0.5 / grid.longest_gap_s),
    ));
    let clock = Clock { rate_hz: grid.rate_hz, start_s: grid.start_s, relative_error: 0.0 };
    Ok(Timing { clock, regridded: Some((times_s, grid)) })
}

/// The clock of the median step, with what is wrong with the others; nothing where there is no step forwards.
fn by_median(table: &Table, times_s: &[f64], rounding: Rounding, error: &str, notes: &mut Vec<Note>) -> Option<Clock> {
    let steps: Vec<f64> = times_s.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let mut forwards: Vec<f64> = steps.iter().copied().filter(|step| *step > 0.0).collect();
    forwards.sort_by(f64::total_cmp);
    let median_s = *forwards.get(forwards.len() / 2)?;
    let note = |message: String, action: &str| Note::new("sample-timing", message, action);
    let backwards = steps.len() - forwards.len();
    if backwards > 0 {
        notes.push(note(
            format!("time stands still or runs backwards {backwards} times ({error})"),
            "look for repeated or swapped lines, or two recordings in one file; where times are rounded to less than a step, write more decimals, or delete the column and give the rate by --sample-rate",
        ));
    }
    let gaps: Vec<usize> = (0..steps.len()).filter(|&k| steps[k] > GAP * median_s).collect();
    if let Some(&longest) = gaps.iter().max_by(|a, b| steps[**a].total_cmp(&steps[**b])) {
        let lost: f64 = gaps.iter().map(|&k| (steps[k] / median_s).round() - 1.0).sum();
        notes.push(note(
            format!(
                "{} gaps, about {lost:.0} samples lost of {:.0}; the longest is {:.4} s at {}",
                gaps.len(),
                lost + times_s.len() as f64,
                steps[longest],
                table.place(longest + 1)
            ),
            "cut them out with --start, --stop or --exclude; --resample interpolates over short ones",
        ));
    }
    let within: Vec<f64> = forwards.iter().map(|step| step - median_s).filter(|error| error.abs() < (GAP - 1.0) * median_s).collect();
    let jitter_s = (within.iter().map(|error| error * error).sum::<f64>() / within.len().max(1) as f64).sqrt();
    let coarseness = rounding.about(times_s.iter().fold(0.0, |most: f64, t| most.max(t.abs())));
    if jitter_s > JITTER * median_s + coarseness {
        notes.push(note(
            format!("the steps of time jitter by {:.3e} s rms, {:.1} % of the median step of {median_s:.6} s", jitter_s, 100.0 * jitter_s / median_s),
            "--resample interpolates onto a regular grid; better, write the time of the sample and not that of its arrival",
        ));
    }
    if notes.iter().all(|note| note.code != "sample-timing") {
        notes.push(note(error.to_owned(), "--resample interpolates onto a regular grid; check the sample rate"));
    }
    Some(Clock { rate_hz: simplest(1.0 / median_s, GRID_ROUNDING), start_s: *times_s.first()?, relative_error: 0.0 })
}

/// The number that a metadata value is, with the unit or the separators behind it that people and spreadsheets leave.
pub(crate) fn number(text: &str) -> Option<f64> {
    let plain = text.trim_end_matches([',', ';', '\t', ' ']);
    plain.strip_suffix("Hz").unwrap_or(plain).trim_end().parse().ok().filter(|x: &f64| x.is_finite())
}

/// Turns a time column into seconds.
fn seconds(file: &str, table: &Table, column: &mut Column, options: &ReadOptions) -> Result<(), IoError> {
    let unit = options.units.get(&column.name).or(column.unit.as_ref()).map_or("s", String::as_str);
    let factor = match Unit::parse(unit) {
        Ok((parsed, factor)) if parsed.quantity() == Quantity::Time => factor,
        _ => return Err(IoError::TimeUnit { file: file.to_owned(), column: column.name.clone(), unit: unit.to_owned() }),
    };
    if let Some(row) = column.samples.iter().position(|t| !t.is_finite()) {
        let count = column.samples.iter().filter(|t| !t.is_finite()).count();
        let total = column.samples.len();
        return Err(IoError::Missing { file: file.to_owned(), place: table.place(row), channel: column.name.clone(), count, total });
    }
    column.samples.iter_mut().for_each(|t| *t *= factor);
    column.rounding.place *= factor;
    Ok(())
}

fn from_rate(file: &str, table: &Table, options: &ReadOptions, notes: &mut Vec<Note>) -> Result<Clock, IoError> {
    let start_s = table.metadata.get(START_KEY).and_then(|t| number(t)).unwrap_or(0.0);
    let written = table.metadata.get(RATE_KEY);
    let clock = |rate_hz: f64, what| {
        if rate_hz.is_finite() && rate_hz > 0.0 {
            Ok(Clock { rate_hz, start_s, relative_error: 0.0 })
        } else {
            Err(IoError::BadRate { file: file.to_owned(), what, rate_hz })
        }
    };
    match (written.and_then(|text| number(text)), options.sample_rate_hz) {
        (Some(rate_hz), given) => {
            if let Some(given) = given.filter(|given| (given / rate_hz - 1.0).abs() > f64::EPSILON) {
                notes.push(Note::new(
                    "sample-rate-conflict",
                    format!("the line sample_rate_hz of the file says {rate_hz} Hz and is used; {given} Hz, given with --sample-rate, is not"),
                    "leave --sample-rate out, or correct the line in the file if that is wrong",
                ));
            }
            clock(rate_hz, "sample_rate_hz")
        }
        (None, Some(rate_hz)) => clock(rate_hz, "the sample rate given"),
        (None, None) => Err(IoError::NoSampleRate {
            file: file.to_owned(),
            found: match (written, table.columns.iter().find(|c| looks_like_time(&c.name))) {
                (Some(text), _) => format!("the sample rate is \"{text}\", which is no number"),
                (None, Some(column)) => format!("there is no time column (if \"{0}\" is the time, call it `t`, as by --channels t=\"{0} [s]\")", column.name),
                (None, None) => "neither a time column nor a sample rate says how fast the samples were taken".to_owned(),
            },
        }),
    }
}

fn looks_like_time(name: &str) -> bool {
    let name = name.to_ascii_lowercase();
    name.contains("time") || name.contains("stamp") || name.starts_with("t_")
}

/// Compares the time column's rate with what else is said: the exact one is taken where they agree, else it is told.
fn agree(table: &Table, options: &ReadOptions, clock: Clock, notes: &mut Vec<Note>) -> Clock {
    let written = table.metadata.get(RATE_KEY).and_then(|t| number(t)).map(|rate| (rate, "the line sample_rate_hz"));
    let given = options.sample_rate_hz.map(|rate| (rate, "--sample-rate"));
    let mut result = clock;
    for (rate_hz, what) in given.into_iter().chain(written) {
        let apart = (rate_hz / clock.rate_hz - 1.0).abs();
        if apart > RATE_AGREEMENT {
            notes.push(Note::new(
                "sample-rate-conflict",
                format!("the time column runs at {} Hz and is used; {what} says {rate_hz} Hz", clock.rate_hz),
                "correct the one that is wrong, or delete the time column",
            ));
        } else if apart <= clock.relative_error + f64::EPSILON {
            result.rate_hz = rate_hz;
        }
    }
    result
}
