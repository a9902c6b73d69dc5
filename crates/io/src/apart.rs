//! A recording that stays in its file, channel by channel.

use crate::error::IoError;
use crate::options::ReadOptions;
#[cfg(feature = "parquet")]
use crate::parquet::ParquetStream;
use crate::pieces::{Piece, Pieces};
#[cfg(feature = "parquet")]
use std::fs::File;
use std::path::{Path, PathBuf};

/// A long Parquet file whose channels are read one by one, each of them whole, or all of them piece by piece.
///
/// ```no_run
/// # fn main() -> Result<(), ndof_io::IoError> {
/// if let Some(file) = ndof_io::Apart::open("hour.parquet".as_ref(), &ndof_io::ReadOptions::default()) {
///     assert_eq!(file.channel("force_x")?.map(|read| read.recording.len()), Some(file.samples()));
/// }
/// # Ok(()) }
/// ```
#[derive(Clone, Debug)]
pub struct Apart {
    path: PathBuf,
    options: ReadOptions,
    samples: usize,
}

/// Bytes of a file below which a recording is held in memory as well.
#[cfg(feature = "parquet")]
const LONG: u64 = 1 << 25;

impl Apart {
    /// The file, if a channel of it alone is surely what it is in the whole recording, and it is long enough for that to matter; `None` of any other, which
    /// [`read_trials`](crate::read_trials) reads or refuses.
    #[cfg(feature = "parquet")]
    pub fn open(path: &Path, options: &ReadOptions) -> Option<Self> {
        let long = std::fs::metadata(path).is_ok_and(|metadata| metadata.is_file() && metadata.len() >= LONG);
        if !long { None } else { Apart::of(path, options) }
    }

    /// No file, without the format.
    #[cfg(not(feature = "parquet"))]
    pub fn open(_: &Path, _: &ReadOptions) -> Option<Self> {
        None
    }

    /// The same of a file of any length.
    #[cfg(feature = "parquet")]
    pub(crate) fn of(path: &Path, options: &ReadOptions) -> Option<Self> {
        let mut own = Apart { path: path.to_owned(), options: options.clone(), samples: 0 };
        let bytes = usize::try_from(std::fs::metadata(path).ok()?.len()).ok()?;
        own.samples = own.stream().ok()?.samples_apart(bytes)?;
        Some(own)
    }

    #[cfg(feature = "parquet")]
    fn stream(&self) -> Result<ParquetStream, IoError> {
        let file = self.path.display().to_string();
        let handle = File::open(&self.path).map_err(|source| IoError::Read { file: file.clone(), source })?;
        ParquetStream::open(handle, &file, self.options.clone())
    }

    /// Samples of each channel.
    pub fn samples(&self) -> usize {
        self.samples
    }

    /// A channel, whole, in a recording of its own on the clock of the file; nothing of an empty one.
    ///
    /// # Errors
    /// [`IoError`] if it cannot be read, or there is none of this name.
    #[cfg(feature = "parquet")]
    pub fn channel(&self, name: &str) -> Result<Option<Piece>, IoError> {
        self.stream()?.of_channel(name).next_piece()
    }

    /// No channel, without the format.
    #[cfg(not(feature = "parquet"))]
    pub fn channel(&self, _: &str) -> Result<Option<Piece>, IoError> {
        Ok(None)
    }

    /// All channels, piece by piece.
    ///
    /// # Errors
    /// As [`Pieces::open`].
    pub fn pieces(&self) -> Result<Pieces, IoError> {
        Pieces::open(&self.path, self.options.clone())
    }
}
