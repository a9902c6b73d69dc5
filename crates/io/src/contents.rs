//! The bytes of a file, as many as are taken.

use crate::error::IoError;
use crate::limits::MAX_BYTES;
use std::fs::File;
use std::io::Read;
use std::path::Path;

/// The bytes of a file and how messages call it.
pub(crate) fn contents(path: &Path) -> Result<(Vec<u8>, String), IoError> {
    if path.as_os_str() == "-" {
        let file = "standard input";
        return Ok((all_bytes(file, std::io::stdin().lock(), 0)?, file.to_owned()));
    }
    let file = path.display().to_string();
    let failed = |source| IoError::Read { file: file.clone(), source };
    let handle = File::open(path).map_err(failed)?;
    let metadata = handle.metadata().map_err(failed)?;
    if metadata.is_dir() {
        return Err(failed(std::io::ErrorKind::IsADirectory.into()));
    }
    Ok((all_bytes(&file, handle, metadata.len())?, file))
}

fn all_bytes(file: &str, source: impl Read, expected: u64) -> Result<Vec<u8>, IoError> {
    let too_large = |found| IoError::TooLarge { file: file.to_owned(), what: "bytes", found, limit: MAX_BYTES, remedy: "split the recording into trials" };
    if expected > MAX_BYTES {
        return Err(too_large(expected));
    }
    let mut bytes = Vec::with_capacity(expected as usize + 1);
    source.take(MAX_BYTES + 1).read_to_end(&mut bytes).map_err(|source| IoError::Read { file: file.to_owned(), source })?;
    if bytes.len() as u64 > MAX_BYTES { Err(too_large(bytes.len() as u64)) } else { Ok(bytes) }
}
