//! Writing a recording in any format.

use crate::assemble::RESERVED_KEYS;
use crate::atomic::write_atomic;
use crate::detect;
use crate::error::IoError;
use crate::timing::{RATE_KEY, START_KEY};
use ndof_signal::Recording;
use std::path::Path;

/// Writes a recording in the format of the suffix, atomically; reading it gives the same recording, bit for bit. A name that ends
/// with `_motion.tsv` gives the three files of BIDS motion.
///
/// # Errors
/// [`IoError`] if no format has this suffix, the format cannot hold the recording, or the disk fails.
///
/// ```
/// use ndof_signal::{Channel, Recording, Unit};
/// let channel = Channel::new("force_x", Unit::parse("N")?.0, vec![0.1, 0.2]);
/// let recording = Recording::new(500.0, vec![channel])?;
/// let dir = tempfile::tempdir()?;
/// let path = dir.path().join("trial.csv");
/// ndof_io::write(&path, &recording)?;
/// assert_eq!(ndof_io::read(&path, &Default::default())?.recording, recording);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn write(path: &Path, recording: &Recording) -> Result<(), IoError> {
    if crate::bids::is_name(path) {
        return crate::bids::write(path, recording);
    }
    write_atomic(path, &encode(recording, &path.display().to_string())?)
}

/// What every file says of the time of a recording: its rate and, unless it is zero, its start.
pub(crate) fn times(recording: &Recording) -> impl Iterator<Item = (&'static str, f64)> {
    let start_s = recording.start_s();
    std::iter::once((RATE_KEY, recording.sample_rate_hz())).chain((start_s != 0.0).then_some((START_KEY, start_s)))
}

/// The metadata of a recording that a file does not say in another way.
pub(crate) fn own_metadata(recording: &Recording) -> impl Iterator<Item = (&String, &String)> {
    recording.metadata().iter().filter(|(key, _)| !RESERVED_KEYS.contains(&key.as_str()))
}

/// The bytes of a recording in the format of the suffix of `file`.
///
/// # Errors
/// As [`write()`], without the disk's.
pub fn encode(recording: &Recording, file: &str) -> Result<Vec<u8>, IoError> {
    (detect::writer(file)?)(recording, file)
}
