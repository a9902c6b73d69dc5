//! How much of a file is believed: bounds that hold before memory is reserved for what a header claims.

use crate::error::IoError;
use std::io::{self, Read};

/// Bytes of one file, and of what it unpacks to: about 40 hours of 12 channels at 1 kHz in binary.
pub(crate) const MAX_BYTES: u64 = 1 << 34;

/// Channels of one file. A recording of a limb has tens; EMG arrays and motion capture have hundreds.
pub(crate) const MAX_CHANNELS: usize = 4096;

/// Samples in a resampled recording per sample in the file, so that two stamps far apart do not fill the memory.
pub(crate) const MAX_RESAMPLE_GROWTH: f64 = 16.0;

/// Arrays of one file, channels, units and facts together.
pub(crate) const MAX_ENTRIES: usize = 4 * MAX_CHANNELS;

/// What a compressed file may unpack to, whatever its size: six 50 s trials are 10 MB.
const UNPACKED_FLOOR: u64 = 1 << 25;

/// How many times its own size a file may unpack to beyond that. Measured signals shrink two- to tenfold, a bomb
/// thousandfold.
const MAX_RATIO: u64 = 100;

/// The bytes that a file may still unpack to.
#[derive(Debug)]
pub(crate) struct Budget {
    left: u64,
    limit: u64,
}

impl Budget {
    /// The budget of a file of `bytes` bytes.
    pub fn of(bytes: usize) -> Self {
        let limit = (bytes as u64).saturating_mul(MAX_RATIO).clamp(UNPACKED_FLOOR, MAX_BYTES);
        Budget { left: limit, limit }
    }

    /// Takes `bytes` from it.
    pub fn claim(&mut self, file: &str, bytes: u64) -> Result<(), IoError> {
        match self.left.checked_sub(bytes) {
            Some(left) => {
                self.left = left;
                Ok(())
            }
            None => Err(IoError::TooLarge {
                file: file.to_owned(),
                what: "bytes after unpacking",
                found: (self.limit - self.left).saturating_add(bytes),
                limit: self.limit,
                remedy: "if the file is no decompression bomb, save it without compression",
            }),
        }
    }

    /// Unpacks a stream to its end, and stops where the budget does. The inner error is the stream's own.
    pub fn unpack(&mut self, file: &str, stream: impl Read) -> Result<io::Result<Vec<u8>>, IoError> {
        let mut unpacked = Vec::new();
        let result = stream.take(self.left.saturating_add(1)).read_to_end(&mut unpacked);
        self.claim(file, unpacked.len() as u64)?;
        Ok(result.map(|_| unpacked))
    }
}
