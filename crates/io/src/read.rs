//! Reading a recording from any format.

use crate::assemble::assemble;
use crate::error::{IoError, Place};
use crate::formats;
use crate::limits::MAX_BYTES;
use crate::names::split_name;
use crate::note::Note;
use crate::options::ReadOptions;
use crate::table::{Column, Rounding, Table};
use ndof_signal::{Recording, RecordingError};
use std::collections::BTreeMap;
use std::fs::File;
use std::io::Read;
use std::path::Path;

/// Samples of a channel that the file does not have.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct MissingSamples {
    /// The channel.
    pub channel: String,
    /// Where the first one is.
    pub place: Place,
    /// Its row, from 0.
    pub first_sample: usize,
    /// How many there are.
    pub count: usize,
    /// Out of how many.
    pub total: usize,
}

/// A recording with what was done to get it.
#[derive(Clone, Debug, PartialEq)]
pub struct ReadRecording {
    /// The file's name, for messages.
    pub file: String,
    /// The samples in SI units.
    pub recording: Recording,
    /// Conversions and assumptions, in the order of the file.
    pub notes: Vec<Note>,
    /// Channels with missing samples; empty unless [`ReadOptions::allow_nan`] is set.
    pub missing: Vec<MissingSamples>,
}

impl ReadRecording {
    /// Checks that the channels `used` (all, if `None`) miss no sample.
    ///
    /// # Errors
    /// [`IoError::Missing`] with the first place.
    pub fn require_complete(&self, used: Option<&[&str]>) -> Result<(), IoError> {
        match self.missing.iter().find(|m| used.is_none_or(|names| names.contains(&m.channel.as_str()))) {
            Some(m) => Err(IoError::Missing { file: self.file.clone(), place: m.place, channel: m.channel.clone(), count: m.count, total: m.total }),
            None => Ok(()),
        }
    }
}

/// Reads a recording; the format follows from the content, then from the suffix. `-` is standard input, as CSV.
///
/// # Errors
/// [`IoError`] with file, place and remedy.
pub fn read(path: &Path, options: &ReadOptions) -> Result<ReadRecording, IoError> {
    if path.as_os_str() == "-" {
        let file = "standard input";
        let bytes = all_bytes(file, std::io::stdin().lock(), 0)?;
        return read_bytes(&bytes, file, options);
    }
    let file = path.display().to_string();
    let failed = |source| IoError::Read { file: file.clone(), source };
    let handle = File::open(path).map_err(failed)?;
    let metadata = handle.metadata().map_err(failed)?;
    if metadata.is_dir() {
        return Err(failed(std::io::ErrorKind::IsADirectory.into()));
    }
    let bytes = all_bytes(&file, handle, metadata.len())?;
    read_bytes(&bytes, &file, options)
}

/// Reads a recording from the bytes of a file called `file`, whose suffix counts where the content does not tell.
///
/// # Errors
/// [`IoError`] with file, place and remedy.
///
/// ```
/// let csv = b"# sample_rate_hz: 500\nforce_x [N],pos_x [mm]\n1.0,2.0\n1.5,2.5\n";
/// let read = ndof_io::read_bytes(csv, "trial.csv", &ndof_io::ReadOptions::default())?;
/// assert_eq!(read.recording.sample_rate_hz(), 500.0);
/// assert_eq!(read.recording.channel("pos_x")?.samples, [0.002, 0.0025]); // SI
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn read_bytes(bytes: &[u8], file: &str, options: &ReadOptions) -> Result<ReadRecording, IoError> {
    let format = formats::detect(bytes, file)?;
    let table = (formats::reader(format, file)?)(bytes, file)?;
    assemble(file, table, options)
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
        Column { name: name.to_owned(), unit: unit.map(str::to_owned), samples, rounding: Rounding::default() }
    };
    let columns: Vec<Column> = columns.into_iter().map(column).collect();
    if let Some(pair) = columns.windows(2).find(|pair| pair[0].samples.len() != pair[1].samples.len()) {
        let source =
            RecordingError::Length { first: pair[0].name.clone(), expected: pair[0].samples.len(), name: pair[1].name.clone(), found: pair[1].samples.len() };
        return Err(IoError::Recording { file: file.to_owned(), source });
    }
    assemble(file, Table { columns, metadata, ..Table::default() }, options)
}

fn all_bytes(file: &str, source: impl Read, expected: u64) -> Result<Vec<u8>, IoError> {
    let too_large = |found| IoError::TooLarge { file: file.to_owned(), what: "bytes", found, limit: MAX_BYTES, remedy: "split the recording into trials" };
    if expected > MAX_BYTES {
        return Err(too_large(expected));
    }
    let mut bytes = Vec::new();
    source.take(MAX_BYTES + 1).read_to_end(&mut bytes).map_err(|source| IoError::Read { file: file.to_owned(), source })?;
    if bytes.len() as u64 > MAX_BYTES { Err(too_large(bytes.len() as u64)) } else { Ok(bytes) }
}
