//! What can be wrong with a file, where, and what to do about it.

use std::{fmt, io};

/// Where in a file something is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// A line of a text file, from 1.
    Line(usize),
    /// A sample of a binary file, from 0.
    Sample(usize),
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Place::Line(line) => write!(f, "line {line}"),
            Place::Sample(sample) => write!(f, "sample {sample}"),
        }
    }
}

/// Why a file was not read or not written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs, reason = "a message says what its fields are")]
pub enum IoError {
    /// The file could not be opened or read.
    #[error("{file}: cannot be read: {}", said(source, "there is no such file; check the path", "it is a folder; name the files in it, such as FOLDER/*.csv"))]
    Read { file: String, source: io::Error },
    /// The file could not be written; the target is as it was.
    #[error(
        "{file}: cannot be written: {}; what stood there before is unchanged",
        said(source, "its folder does not exist; make it first, or choose another", "it is a folder; name a file in it")
    )]
    Write { file: String, source: io::Error },
    /// The file is what the result would be made of.
    #[error("{file}: is an input of this command, and inputs are never overwritten; write the result to another file")]
    Input { file: String },
    /// The file has no data.
    #[error("{file}: the file is empty; a recording needs a line of channel names and at least two lines of numbers")]
    Empty { file: String },
    /// The content belongs to no format that is read here.
    #[error("{file}: {found}; {remedy}")]
    UnknownFormat { file: String, found: String, remedy: String },
    /// The format exists, but not in this build.
    #[error("{file}: this build does not read or write {format}; build with `--features {feature}`, or convert the file to CSV")]
    NotBuiltIn { file: String, format: &'static str, feature: &'static str },
    /// A suffix of no format that can be written.
    #[error("{file}: no format is written under this suffix; known are {}", known.join(", "))]
    UnknownSuffix { file: String, known: Vec<String> },
    /// More than the limits of this library.
    #[error("{file}: {what}: {found}, the limit is {limit}; {remedy}")]
    TooLarge { file: String, what: &'static str, found: u64, limit: u64, remedy: &'static str },
    /// The bytes of a text file are not UTF-8.
    #[error("{file}, line {line}: the text is not UTF-8 but {} (byte 0x{byte:02x}); save the file as UTF-8", encoding(*byte))]
    NotUtf8 { file: String, line: usize, byte: u8 },
    /// The first line holds numbers.
    #[error(
        "{file}, line {line}: there is no line of channel names, the first line holds numbers; put one above it, such as `force_x [N],pos_x [m]`, or say which column is which with --columns FILE.toml"
    )]
    NoHeader { file: String, line: usize },
    /// What says which column is which is no such file.
    #[error("{file}: {what}; a columns file holds `[columns]` with lines `NAME = {{ number = 3, unit = \"N\" }}`")]
    Columns { file: String, what: String },
    /// A file of several trials where one is read.
    #[error("{file}: it holds {} trials ({}), and one is read here; {remedy}", trials.len(), crate::error::listed(trials))]
    SeveralTrials { file: String, trials: Vec<String>, remedy: &'static str },
    /// There is a header but no data.
    #[error("{file}, line {line}: there are no samples under the header; check that the file was saved and copied completely")]
    HeaderOnly { file: String, line: usize },
    /// A quotation mark is never closed.
    #[error("{file}, line {line}: a quotation mark is opened and never closed; close it, or delete it")]
    OpenQuote { file: String, line: usize },
    /// Two columns have one name.
    #[error("{file}: two channels are called \"{name}\" (columns {first} and {second}); rename one of them")]
    DuplicateName {
        file: String,
        name: String,
        /// The first column, from 1.
        first: usize,
        second: usize,
    },
    /// A row has too many or too few cells.
    #[error("{file}, line {line}: {found} cells where the header names {expected} columns; {hint}")]
    Ragged { file: String, line: usize, expected: usize, found: usize, hint: String },
    /// The last line of the file is incomplete.
    #[error("{file}, line {line}: the file ends in the middle of a line; copy it again, or delete that line to use what is there")]
    CutOff { file: String, line: usize },
    /// The file holds another number of samples than it says itself.
    #[error(
        "{file}: the file says that it holds {declared} samples, {found} are there; copy it again, or correct the count in its header (`# samples:`, `nRows=`) to use what is there"
    )]
    SampleCount { file: String, declared: f64, found: usize },
    /// A cell is not a number.
    #[error("{file}, {place}, channel \"{channel}\": \"{text}\" is not a number; {hint}")]
    NotANumber { file: String, place: Place, channel: String, text: String, hint: String },
    /// Samples are missing.
    #[error(
        "{file}, {place}, channel \"{channel}\": no number here ({count} of {total} samples of this channel are missing); cut the stretch out with --start, --stop or --exclude, or repair the file"
    )]
    Missing { file: String, place: Place, channel: String, count: usize, total: usize },
    /// Nothing says how fast the samples were taken.
    #[error("{file}: {found}; give the sample rate with --sample-rate HZ, a line `# sample_rate_hz: 1000`, or a column `t [s]`")]
    NoSampleRate { file: String, found: String },
    /// The rate asked for is not a rate.
    #[error("{file}: {rate_hz} Hz as {what}; it must be a positive, finite number")]
    BadRate { file: String, what: &'static str, rate_hz: f64 },
    /// The time column has a unit that is none of time.
    #[error("{file}: the column \"{column}\" is the time, but its unit \"{unit}\" is none; write `{column} [s]` or `{column} [ms]`, or rename the column")]
    TimeUnit { file: String, column: String, unit: String },
    /// One sample does not make a rate.
    #[error("{file}: {rows} sample only; the time column gives a rate from two samples on")]
    OneSample { file: String, rows: usize },
    /// Time stands still or runs backwards.
    #[error(
        "{file}, {place}: time goes from {before_s} s to {after_s} s; it must increase: look for repeated or swapped lines, or two recordings in one file; where times are rounded to less than a step, write more decimals, or delete the column and give the rate by --sample-rate"
    )]
    TimeBackwards { file: String, place: Place, before_s: f64, after_s: f64 },
    /// The steps of time differ.
    #[error(
        "{file}, {place}: irregular time: a step of {found_s} s where {expected_s} s is expected ({count} of {steps} steps are irregular); --resample interpolates onto a regular grid, --stop and --exclude cut"
    )]
    IrregularTime {
        file: String,
        place: Place,
        found_s: f64,
        /// The median step.
        expected_s: f64,
        count: usize,
        steps: usize,
    },
    /// A gap too long to be interpolated over.
    #[error(
        "{file}, {place}: a gap of {gap_s} s, {steps:.1} steps, is too long to interpolate over (at most {limit} steps); cut it out with --stop or --exclude"
    )]
    Gap {
        file: String,
        place: Place,
        gap_s: f64,
        /// Its length in median steps.
        steps: f64,
        limit: f64,
    },
    /// Resampling below the file's own rate, which would fold high frequencies onto low ones.
    #[error("{file}: resampling to {asked_hz} Hz lies below the file's {rate_hz:.6} Hz and would alias; ask for {rate_hz:.6} Hz or more, or `auto`")]
    ResampleDown { file: String, asked_hz: f64, rate_hz: f64 },
    /// A unit was given for a channel that does not exist.
    #[error("{file}: a unit is given for \"{channel}\", which is no channel of it; it has: {}", available.join(", "))]
    NoChannel { file: String, channel: String, available: Vec<String> },
    /// A unit given by the caller is unknown.
    #[error("{file}, channel \"{channel}\": {source}")]
    Unit { file: String, channel: String, source: ndof_signal::UnknownUnit },
    /// A binary file is damaged.
    #[error("{file}: damaged {format} file: {what}; write or copy it again")]
    Damaged { file: String, format: &'static str, what: String },
    /// The file is intact, but holds what is no recording.
    #[error("{file}: {what}; {remedy}")]
    Unsuitable { file: String, what: String, remedy: String },
    /// A recording that the format cannot hold.
    #[error("{file}: {what} cannot be written as {format}; {remedy}")]
    Unwritable { file: String, what: String, format: &'static str, remedy: &'static str },
    /// The parts do not make a recording.
    #[error("{file}: {source}")]
    Recording { file: String, source: ndof_signal::RecordingError },
}

/// What the system says, without the names of files that are only ours, and what to do about it.
fn said(source: &io::Error, missing: &str, folder: &str) -> String {
    match source.kind() {
        io::ErrorKind::NotFound => missing.to_owned(),
        io::ErrorKind::IsADirectory => folder.to_owned(),
        io::ErrorKind::NotADirectory => "a part of the path is a file and no folder; check the path".to_owned(),
        io::ErrorKind::PermissionDenied => "permission denied; change the permissions or choose another place".to_owned(),
        io::ErrorKind::StorageFull => "the disk is full; make room or choose another place".to_owned(),
        _ => format!("{source}; check disk and permissions"),
    }
}

impl IoError {
    /// The error for more of `what` than is read.
    pub(crate) fn too_large(file: &str, what: &'static str, found: usize, limit: usize, remedy: &'static str) -> Self {
        IoError::TooLarge { file: file.to_owned(), what, found: found as u64, limit: limit as u64, remedy }
    }

    /// The error for what is read, and is no recording.
    pub(crate) fn unsuitable(file: &str, what: impl Into<String>, remedy: impl Into<String>) -> Self {
        IoError::Unsuitable { file: file.to_owned(), what: what.into(), remedy: remedy.into() }
    }

    /// Whether the machine failed (disk, permission) and not the file or its user: exit code 3 instead of 2.
    pub fn is_machine_failure(&self) -> bool {
        match self {
            IoError::Write { source, .. } => source.kind() != io::ErrorKind::NotFound && source.kind() != io::ErrorKind::IsADirectory,
            IoError::Read { source, .. } => !matches!(source.kind(), io::ErrorKind::NotFound | io::ErrorKind::IsADirectory | io::ErrorKind::NotADirectory),
            _ => false,
        }
    }
}

/// What a text is whose first byte that is no UTF-8 this is: the mark of UTF-16, or a letter of one byte.
fn encoding(byte: u8) -> &'static str {
    if byte >= 0xfe { "UTF-16" } else { "probably Latin-1 (Windows-1252)" }
}

/// The first few of a list that may be long.
pub(crate) fn listed(items: &[String]) -> String {
    const SHOWN: usize = 8;
    let mut text = items.iter().take(SHOWN).cloned().collect::<Vec<_>>().join(", ");
    if items.len() > SHOWN {
        text.push_str(&format!(" and {} more", items.len() - SHOWN));
    }
    text
}
