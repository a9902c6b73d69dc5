//! Columns of numbers, row group by row group.

use super::kind::{Kind, append};
use super::lists::ListKind;
use super::{FOREIGN_KEYS, PARQUET, UNIT_KEY, UNITS_KEY, episodes, pages};
use crate::arrays::{self, Entry, Value};
use crate::error::IoError;
use crate::limits::{Budget, MAX_ENTRIES};
use crate::table::Table;
use ::parquet::basic::Compression;
use ::parquet::file::metadata::{KeyValue, ParquetMetaData, RowGroupMetaData};
use ::parquet::file::reader::{FileReader, SerializedFileReader};
use bytes::Bytes;
use rayon::prelude::*;
use std::collections::BTreeMap;

/// Reads a Parquet file: its trials, where a column counts episodes.
///
/// The decoder (parquet 60.1) panics on some damaged pages, which is caught here and told as the damage that it is.
pub(crate) fn read(bytes: &[u8], file: &str) -> Result<Vec<Table>, IoError> {
    caught(file, || decode(bytes, file)).map(episodes::split)
}

/// Turns a panic of the decoder into the error that it is.
pub(super) fn caught<T>(file: &str, work: impl FnOnce() -> Result<T, IoError>) -> Result<T, IoError> {
    std::panic::catch_unwind(std::panic::AssertUnwindSafe(work))
        .unwrap_or_else(|_| Err(IoError::Damaged { file: file.to_owned(), format: PARQUET, what: "a page does not fit the directory".to_owned() }))
}

fn decode(bytes: &[u8], file: &str) -> Result<Table, IoError> {
    let damaged = |what: String| IoError::Damaged { file: file.to_owned(), format: PARQUET, what };
    let reader =
        SerializedFileReader::new(Bytes::copy_from_slice(bytes)).map_err(|e| damaged(format!("its directory cannot be read ({e}); it may be cut off")))?;
    let metadata = reader.metadata();
    check_size(file, bytes.len(), metadata)?;
    check_places(bytes.len(), metadata).map_err(damaged)?;
    pages::check(bytes, file, metadata)?;
    check_compression(file, metadata)?;
    let mut budget = Budget::of(bytes.len());
    let columns = metadata.file_metadata().schema_descr().columns();
    let plain: Vec<Option<Result<Entry, IoError>>> =
        columns.par_iter().enumerate().map(|(i, column)| Kind::of(column).map(|kind| numbers(&reader, i, kind, file))).collect();
    let mut entries = Vec::new();
    for (i, (column, numbers)) in columns.iter().zip(plain).enumerate() {
        match (numbers, ListKind::of(column)) {
            (Some(numbers), _) => entries.push(numbers?),
            (None, Some(list)) => entries.extend(list.read(&reader, i, file, &mut budget)?),
            (None, None) => entries.push(Entry::new(vec![column.path().parts().join(".")], Value::Other("no column of plain numbers"))),
        }
    }
    for KeyValue { key, value } in metadata.file_metadata().key_value_metadata().into_iter().flatten() {
        facts(key, value.as_deref().unwrap_or_default(), &mut entries);
    }
    arrays::table(file, entries)
}

/// The column of numbers at this place, all row groups of it.
fn numbers(reader: &SerializedFileReader<Bytes>, place: usize, kind: Kind, file: &str) -> Result<Entry, IoError> {
    let metadata = reader.metadata();
    let name = metadata.file_metadata().schema_descr().column(place).path().parts().join(".");
    let damaged = |what: String| IoError::Damaged { file: file.to_owned(), format: PARQUET, what: format!("column \"{name}\"{what}") };
    let total: i64 = metadata.row_groups().iter().map(RowGroupMetaData::num_rows).sum();
    let mut values = Vec::with_capacity(usize::try_from(total).unwrap_or(0));
    for (group, claimed) in metadata.row_groups().iter().map(RowGroupMetaData::num_rows).enumerate() {
        let column = reader.get_row_group(group).and_then(|rows| rows.get_column_reader(place));
        let read = column.and_then(|mut column| append(&mut column, kind, usize::MAX, &mut values)).map_err(|e| damaged(format!(": {e}")))?;
        if read as i64 != claimed {
            return Err(damaged(format!(" has {read} values in row group {group}, which says {claimed}")));
        }
    }
    let value = Value::Numbers { shape: vec![values.len()], values, rounding: kind.rounding };
    Ok(Entry { unit: kind.unit.map(str::to_owned), ..Entry::new(vec![name], value) })
}

/// Refuses what a directory claims before memory is taken for it.
pub(super) fn check_size(file: &str, len: usize, metadata: &ParquetMetaData) -> Result<(), IoError> {
    let columns = metadata.file_metadata().schema_descr().num_columns();
    if columns > MAX_ENTRIES {
        return Err(IoError::too_large(file, "columns", columns, MAX_ENTRIES, "save one column a channel"));
    }
    let mut budget = Budget::of(len);
    for group in metadata.row_groups() {
        let rows = u64::try_from(group.num_rows()).unwrap_or(u64::MAX);
        budget.claim(file, rows.saturating_mul(8 * columns as u64))?;
        for column in group.columns() {
            budget.claim(file, u64::try_from(column.uncompressed_size()).unwrap_or(u64::MAX))?;
        }
    }
    Ok(())
}

/// Where columns lie has to be inside the file; the decoder relies on it.
pub(super) fn check_places(len: usize, metadata: &ParquetMetaData) -> Result<(), String> {
    for (g, group) in metadata.row_groups().iter().enumerate() {
        for column in group.columns() {
            let start = column.dictionary_page_offset().unwrap_or(column.data_page_offset());
            let inside = start >= 0 && column.compressed_size() >= 0 && start.checked_add(column.compressed_size()).is_some_and(|end| end as u64 <= len as u64);
            if !inside || column.num_values() < 0 {
                return Err(format!("column \"{}\" of row group {g} lies outside of the file", column.column_path().string()));
            }
        }
    }
    Ok(())
}

pub(super) fn check_compression(file: &str, metadata: &ParquetMetaData) -> Result<(), IoError> {
    let codecs = metadata.row_groups().iter().flat_map(|g| g.columns()).map(|c| c.compression());
    match codecs.into_iter().find(|c| !matches!(c, Compression::UNCOMPRESSED | Compression::SNAPPY)) {
        Some(codec) => {
            Err(IoError::unsuitable(file, format!("it is compressed with {codec}, which is not built in"), "save it with compression \"snappy\" or none"))
        }
        None => Ok(()),
    }
}

pub(super) fn facts(key: &str, value: &str, entries: &mut Vec<Entry>) {
    let text = |group: &str, name: &str, value: &str| Entry::new(vec![group.to_owned(), name.to_owned()], Value::Text(value.to_owned()));
    if let Some(name) = key.strip_prefix(UNIT_KEY) {
        entries.push(text("unit", name, value));
    } else if key == UNITS_KEY
        && let Ok(units) = serde_json::from_str::<BTreeMap<String, String>>(value)
    {
        entries.extend(units.iter().map(|(name, unit)| text("unit", name, unit)));
    } else if !FOREIGN_KEYS.contains(&key) {
        entries.push(text("metadata", key, value));
    }
}
