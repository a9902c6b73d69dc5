//! The entries of the archive into named arrays, within a budget.

use super::{NPZ, npy};
use crate::arrays::{self, Entry};
use crate::budget::{Budget, MAX_ENTRIES};
use crate::error::IoError;
use crate::limits::MAX_NAME;
use crate::table::Table;
use std::io::{Cursor, Read};
use zip::ZipArchive;

/// Reads an NPZ file.
pub(crate) fn read(bytes: &[u8], file: &str) -> Result<Table, IoError> {
    let damaged = |what: String| IoError::Damaged { file: file.to_owned(), format: NPZ, what };
    let mut archive = ZipArchive::new(Cursor::new(bytes)).map_err(|e| damaged(format!("the archive cannot be opened ({e}); it may be cut off")))?;
    if archive.len() > MAX_ENTRIES {
        return Err(IoError::TooLarge {
            file: file.to_owned(),
            what: "arrays",
            found: archive.len() as u64,
            limit: MAX_ENTRIES as u64,
            remedy: "save one array a channel",
        });
    }
    let mut budget = Budget::of(bytes.len());
    let mut entries = Vec::new();
    for i in 0..archive.len() {
        let mut entry = archive.by_index(i).map_err(|e| damaged(format!("entry {i} cannot be opened ({e})")))?;
        let name = entry.name().map_err(|e| damaged(format!("the name of entry {i} cannot be read ({e})")))?.into_owned();
        let Some(name) = name.strip_suffix(".npy") else { continue };
        if name.len() > MAX_NAME {
            return Err(damaged(format!("entry {i} has a name of {} bytes", name.len())));
        }
        let claimed = entry.size();
        budget.claim(file, claimed)?;
        let mut data = Vec::new();
        entry.by_ref().take(claimed).read_to_end(&mut data).map_err(|e| damaged(format!("array \"{name}\" cannot be unpacked ({e})")))?;
        // Only at the true end is the checksum compared, and only there is a size that lies found out.
        let beyond = entry.read(&mut [0]).map_err(|e| damaged(format!("array \"{name}\": {e}")))?;
        if beyond != 0 || data.len() as u64 != claimed {
            return Err(damaged(format!("array \"{name}\" is not as long as the archive says")));
        }
        let value = npy::parse(&data).map_err(|what| damaged(format!("array \"{name}\": {what}")))?;
        entries.push(Entry { path: path(name), value });
    }
    if entries.is_empty() {
        return Err(IoError::Unsuitable {
            file: file.to_owned(),
            what: "it is a ZIP archive without NumPy arrays".to_owned(),
            remedy: "if it is a spreadsheet (.xlsx, .ods), export the sheet as CSV; else unpack it".to_owned(),
        });
    }
    arrays::table(file, entries)
}

/// `unit/force_x` is a group and a name; other slashes belong to the name.
fn path(name: &str) -> Vec<String> {
    match name.split_once('/') {
        Some((group @ ("unit" | "metadata"), rest)) => vec![group.to_owned(), rest.to_owned()],
        _ => vec![name.to_owned()],
    }
}
