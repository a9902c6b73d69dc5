//! The entries of the archive into named arrays, within a budget.

use super::{NPZ, npy};
use crate::arrays::{self, Entry};
use crate::error::IoError;
use crate::limits::{Budget, MAX_ENTRIES};
use crate::names::MAX_NAME;
use crate::table::Table;
use std::io::Cursor;
use zip::ZipArchive;

/// Reads an NPZ file.
pub(crate) fn read(bytes: &[u8], file: &str) -> Result<Table, IoError> {
    let entry = |(name, data): (String, Vec<u8>)| {
        let value = npy::parse(&data).map_err(|what| IoError::Damaged { file: file.to_owned(), format: NPZ, what: format!("array \"{name}\": {what}") })?;
        Ok(Entry::new(path(&name), value))
    };
    arrays::table(file, arrays_of(bytes, file)?.into_iter().map(entry).collect::<Result<_, IoError>>()?)
}

/// The arrays of an NPZ file by name, as bytes.
pub(crate) fn arrays_of(bytes: &[u8], file: &str) -> Result<Vec<(String, Vec<u8>)>, IoError> {
    let damaged = |what: String| IoError::Damaged { file: file.to_owned(), format: NPZ, what };
    let mut archive =
        ZipArchive::new(Cursor::new(bytes)).map_err(|e| IoError::Damaged { file: file.to_owned(), format: "ZIP", what: format!("it is incomplete ({e})") })?;
    if archive.len() > MAX_ENTRIES {
        return Err(IoError::too_large(file, "arrays", archive.len(), MAX_ENTRIES, "save one array a channel"));
    }
    let mut budget = Budget::of(bytes.len());
    let mut found = Vec::new();
    for i in 0..archive.len() {
        let mut entry = archive.by_index(i).map_err(|e| damaged(format!("entry {i} cannot be opened ({e})")))?;
        let name = entry.name().map_err(|e| damaged(format!("the name of entry {i} cannot be read ({e})")))?.into_owned();
        let Some(name) = name.strip_suffix(".npy") else { continue };
        if name.len() > MAX_NAME {
            return Err(damaged(format!("entry {i} has a name of {} bytes", name.len())));
        }
        let claimed = entry.size();
        // To the true end: only there is the checksum compared.
        let data = budget.unpack(file, &mut entry)?.map_err(|e| damaged(format!("array \"{name}\" cannot be unpacked ({e})")))?;
        if data.len() as u64 != claimed {
            return Err(damaged(format!("array \"{name}\" has {} bytes, the archive says {claimed}", data.len())));
        }
        found.push((name.to_owned(), data));
    }
    if found.is_empty() {
        return Err(IoError::unsuitable(
            file,
            "it is a ZIP archive without NumPy arrays",
            "if it is a spreadsheet (.xlsx, .ods), export the sheet as CSV; else unpack it",
        ));
    }
    Ok(found)
}

/// `unit/force_x` is a group and a name; other slashes belong to the name.
fn path(name: &str) -> Vec<String> {
    match name.split_once('/') {
        Some((group @ ("unit" | "metadata"), rest)) => vec![group.to_owned(), rest.to_owned()],
        _ => vec![name.to_owned()],
    }
}
