//! Columns of numbers, row group by row group.

use super::{FOREIGN_KEYS, PARQUET, UNIT_KEY, UNITS_KEY};
use crate::arrays::{self, Entry, Value};
use crate::budget::{Budget, MAX_ENTRIES};
use crate::error::IoError;
use crate::table::{Rounding, Table};
use ::parquet::basic::{Compression, LogicalType, TimeUnit, Type as Physical};
use ::parquet::column::reader::{ColumnReader, ColumnReaderImpl};
use ::parquet::data_type::DataType;
use ::parquet::errors::ParquetError;
use ::parquet::file::metadata::{KeyValue, ParquetMetaData};
use ::parquet::file::reader::{FileReader, SerializedFileReader};
use ::parquet::schema::types::ColumnDescriptor;
use bytes::Bytes;
use std::collections::BTreeMap;

/// Rows that are decoded at a time.
const BATCH: usize = 1 << 14;

/// Reads a Parquet file.
///
/// The decoder (parquet 60.1) panics on some damaged pages, which is caught here and told as the damage that it is.
pub(crate) fn read(bytes: &[u8], file: &str) -> Result<Table, IoError> {
    caught(file, || decode(bytes, file))
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
    check_compression(file, metadata)?;
    let mut entries = Vec::new();
    for (i, column) in metadata.file_metadata().schema_descr().columns().iter().enumerate() {
        let name = column.path().parts().join(".");
        let Some(kind) = Kind::of(column) else {
            entries.push(Entry::new(vec![name], Value::Other("no column of plain numbers")));
            continue;
        };
        let mut values = Vec::new();
        for group in 0..reader.num_row_groups() {
            let rows = metadata.row_group(group).num_rows();
            let column = reader.get_row_group(group).and_then(|g| g.get_column_reader(i));
            let read =
                column.and_then(|mut column| append(&mut column, kind, usize::MAX, &mut values)).map_err(|e| damaged(format!("column \"{name}\": {e}")))?;
            if read as i64 != rows {
                return Err(damaged(format!("column \"{name}\" has {read} values in row group {group}, which says {rows}")));
            }
        }
        let value = Value::Numbers { shape: vec![values.len()], values, rounding: kind.rounding };
        entries.push(Entry { unit: kind.unit.map(str::to_owned), ..Entry::new(vec![name], value) });
    }
    for KeyValue { key, value } in metadata.file_metadata().key_value_metadata().into_iter().flatten() {
        facts(key, value.as_deref().unwrap_or_default(), &mut entries);
    }
    arrays::table(file, entries)
}

/// Refuses what a directory claims before memory is taken for it.
fn check_size(file: &str, len: usize, metadata: &ParquetMetaData) -> Result<(), IoError> {
    let columns = metadata.file_metadata().schema_descr().num_columns();
    if columns > MAX_ENTRIES {
        return Err(IoError::TooLarge {
            file: file.to_owned(),
            what: "columns",
            found: columns as u64,
            limit: MAX_ENTRIES as u64,
            remedy: "save one column a channel",
        });
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
        Some(codec) => Err(IoError::Unsuitable {
            file: file.to_owned(),
            what: format!("it is compressed with {codec}, which is not built in"),
            remedy: "save it with compression \"snappy\" or none".to_owned(),
        }),
        None => Ok(()),
    }
}

/// How the numbers of a column are to be taken.
#[derive(Clone, Copy)]
pub(super) struct Kind {
    unsigned: bool,
    pub(super) unit: Option<&'static str>,
    pub(super) rounding: Rounding,
}

impl Kind {
    pub(super) fn of(column: &ColumnDescriptor) -> Option<Self> {
        if column.path().parts().len() != 1 || column.max_rep_level() > 0 || column.max_def_level() > 1 {
            return None;
        }
        let rounding = match column.physical_type() {
            Physical::DOUBLE => Rounding::default(),
            Physical::FLOAT => Rounding::SINGLE,
            Physical::INT32 | Physical::INT64 | Physical::BOOLEAN => Rounding::INTEGER,
            _ => return None,
        };
        let time = |unit: &TimeUnit| match unit {
            TimeUnit::MILLIS => "ms",
            TimeUnit::MICROS => "us",
            TimeUnit::NANOS => "ns",
        };
        let (unsigned, unit) = match column.logical_type_ref() {
            None => (false, None),
            Some(LogicalType::Integer(int)) => (!int.is_signed, None),
            Some(LogicalType::Timestamp(stamp)) => (false, Some(time(&stamp.unit))),
            Some(LogicalType::Time(stamp)) => (false, Some(time(&stamp.unit))),
            Some(_) => return None,
        };
        Some(Kind { unsigned, unit, rounding })
    }
}

/// Decodes up to `limit` rows of a column of a row group behind `values` and returns their number.
pub(super) fn append(column: &mut ColumnReader, kind: Kind, limit: usize, values: &mut Vec<f64>) -> Result<usize, ParquetError> {
    match column {
        ColumnReader::DoubleColumnReader(r) => batches(r, limit, values, |x| x),
        ColumnReader::FloatColumnReader(r) => batches(r, limit, values, f64::from),
        ColumnReader::BoolColumnReader(r) => batches(r, limit, values, f64::from),
        ColumnReader::Int32ColumnReader(r) if kind.unsigned => batches(r, limit, values, |x| f64::from(x.cast_unsigned())),
        ColumnReader::Int32ColumnReader(r) => batches(r, limit, values, f64::from),
        ColumnReader::Int64ColumnReader(r) if kind.unsigned => batches(r, limit, values, |x| x.cast_unsigned() as f64),
        ColumnReader::Int64ColumnReader(r) => batches(r, limit, values, |x| x as f64),
        _ => Err(ParquetError::General("its type is not the one of its schema".to_owned())),
    }
}

fn batches<T: DataType>(reader: &mut ColumnReaderImpl<T>, limit: usize, values: &mut Vec<f64>, number: impl Fn(T::T) -> f64) -> Result<usize, ParquetError> {
    let before = values.len();
    let (mut present, mut levels) = (Vec::with_capacity(BATCH.min(limit)), Vec::with_capacity(BATCH.min(limit)));
    while values.len() - before < limit {
        present.clear();
        levels.clear();
        let (records, ..) = reader.read_records(BATCH.min(limit - (values.len() - before)), Some(&mut levels), None, &mut present)?;
        if records == 0 {
            break;
        }
        let mut numbers = present.drain(..).map(&number);
        if levels.is_empty() {
            values.extend(numbers);
        } else {
            // Level 0 is a missing value.
            values.extend(levels.iter().map(|&level| if level == 0 { f64::NAN } else { numbers.next().unwrap_or(f64::NAN) }));
        }
    }
    Ok(values.len() - before)
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
