//! A recording that stays in its file, channel by channel.

use crate::error::IoError;
use crate::options::ReadOptions;
#[cfg(feature = "parquet")]
use crate::parquet::ParquetStream;
use crate::piece::Piece;
use crate::pieces::Pieces;
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

    #[cfg(feature = "parquet")]
    fn of(path: &Path, options: &ReadOptions) -> Option<Self> {
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

#[cfg(all(test, feature = "parquet"))]
mod tests {
    use super::*;
    use crate::{encode, read};
    use ndof_signal::{Channel, Quantity, Recording, Unit};

    #[test]
    fn a_channel_apart_is_the_channel_of_the_whole() {
        let samples = |seed: usize| (0..100_000).map(|k| ((k * seed) % 1009) as f64 - 500.0).collect::<Vec<f64>>();
        let channel = |name: &str, quantity, seed| Channel::new(name, Unit::si(quantity, false), samples(seed));
        let channels = vec![channel("force_x", Quantity::Effort, 7), channel("pos_x", Quantity::Displacement, 31)];
        let recording = Recording::new(1000.0, channels).unwrap().starting_at(2.5);
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("long.parquet");
        std::fs::write(&path, encode(&recording, "long.parquet").unwrap()).unwrap();
        let options = ReadOptions::default();
        let whole = read(&path, &options).unwrap().recording;
        let apart = Apart::of(&path, &options).unwrap();
        assert_eq!(apart.samples(), whole.len());
        for name in ["force_x", "pos_x"] {
            let alone = apart.channel(name).unwrap().unwrap().recording;
            assert_eq!(alone.channels(), [whole.channel(name).unwrap().clone()]);
            assert_eq!((alone.sample_rate_hz(), alone.start_s()), (whole.sample_rate_hz(), whole.start_s()));
        }
        assert!(apart.channel("pos_y").is_err());
        assert!(Apart::open(&path, &options).is_none(), "it is short");
    }
}
