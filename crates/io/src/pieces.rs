//! Recordings larger than memory: CSV and Parquet piece by piece.

use crate::csv::CsvStream;
use crate::detect;
use crate::error::IoError;
use crate::options::ReadOptions;
#[cfg(feature = "parquet")]
use crate::parquet::ParquetStream;
use crate::recording::Note;
use ndof_signal::Recording;
use std::collections::VecDeque;
use std::fs::File;
use std::io::{Read, Seek};
use std::path::Path;

/// Bytes of text that are read at a time.
const CHUNK: usize = 1 << 20;

/// Bytes that tell a format.
const HEAD: u64 = 4096;

/// Samples that arrived together.
#[derive(Clone, Debug, PartialEq)]
pub struct Piece {
    /// The samples in SI units, on the clock of the file; a missing one is NaN.
    pub recording: Recording,
    /// Whether it goes on where the piece before ended, without a gap.
    pub follows: bool,
    /// What was done to read it.
    pub notes: Vec<Note>,
}

/// A recording in a file, piece by piece: memory does not grow with its length.
///
/// ```no_run
/// # fn main() -> Result<(), ndof_io::IoError> {
/// let mut samples = 0;
/// for piece in ndof_io::Pieces::open("hour.csv".as_ref(), ndof_io::ReadOptions::default())? {
///     samples += piece?.recording.len();
/// }
/// # Ok(()) }
/// ```
pub struct Pieces {
    waiting: VecDeque<Piece>,
    source: Source,
}

enum Source {
    Csv {
        name: String,
        file: File,
        stream: Box<CsvStream>,
    },
    #[cfg(feature = "parquet")]
    Parquet(Box<ParquetStream>),
    End,
}

impl Pieces {
    /// Opens a file; missing samples are kept, and nothing is resampled.
    ///
    /// # Errors
    /// [`IoError`] if it cannot be read, or its format has no order in time (NPZ, MAT, HDF5).
    pub fn open(path: &Path, options: ReadOptions) -> Result<Self, IoError> {
        let name = path.display().to_string();
        let failed = |source| IoError::Read { file: name.clone(), source };
        let mut file = File::open(path).map_err(failed)?;
        if file.metadata().map_err(failed)?.is_dir() {
            return Err(failed(std::io::ErrorKind::IsADirectory.into()));
        }
        let mut head = Vec::new();
        (&mut file).take(HEAD).read_to_end(&mut head).map_err(failed)?;
        file.rewind().map_err(failed)?;
        if options.columns.is_some() {
            let what = "columns are given by number, which is not read piece by piece";
            return Err(IoError::unsuitable(&name, what, "read it whole, or make CSV of it with `ndof convert`"));
        }
        let format = detect::detect(&head, &name)?;
        detect::reader(format, &name)?;
        if format.name == "CSV" && head.contains(&b'\r') && !head.contains(&b'\n') && head.len() as u64 == HEAD {
            let what = "lines end with a carriage return alone and are not read piece by piece";
            return Err(IoError::unsuitable(&name, what, "write it anew with `ndof convert`, or read it whole"));
        }
        let source = match format.name {
            "CSV" => Source::Csv { stream: Box::new(CsvStream::of_complete(&name, options)), name, file },
            #[cfg(feature = "parquet")]
            "Parquet" => Source::Parquet(Box::new(ParquetStream::open(file, &name, options)?)),
            other => {
                let what = format!("a {other} file has channel after channel and cannot be read piece by piece");
                return Err(IoError::unsuitable(&name, what, "make CSV or Parquet of it with `ndof convert`, or read it whole"));
            }
        };
        Ok(Pieces { waiting: VecDeque::new(), source })
    }

    fn advance(&mut self) -> Result<(), IoError> {
        match &mut self.source {
            Source::Csv { name, file, stream } => {
                let mut bytes = Vec::with_capacity(CHUNK);
                let count = file.take(CHUNK as u64).read_to_end(&mut bytes).map_err(|source| IoError::Read { file: name.clone(), source })?;
                if count > 0 {
                    self.waiting.extend(stream.push(&bytes)?);
                } else {
                    self.waiting.extend(stream.finish()?);
                    self.source = Source::End;
                }
            }
            #[cfg(feature = "parquet")]
            Source::Parquet(stream) => match stream.next_piece()? {
                Some(piece) => self.waiting.push_back(piece),
                None => self.source = Source::End,
            },
            Source::End => {}
        }
        Ok(())
    }
}

impl Iterator for Pieces {
    type Item = Result<Piece, IoError>;

    fn next(&mut self) -> Option<Self::Item> {
        loop {
            if let Some(piece) = self.waiting.pop_front() {
                return Some(Ok(piece));
            }
            if matches!(self.source, Source::End) {
                return None;
            }
            if let Err(error) = self.advance() {
                self.source = Source::End;
                return Some(Err(error));
            }
        }
    }
}
