//! The types of columns that are numbers, and their decoding.

use crate::table::Rounding;
use ::parquet::basic::{LogicalType, TimeUnit, Type as Physical};
use ::parquet::column::reader::{ColumnReader, ColumnReaderImpl};
use ::parquet::data_type::DataType;
use ::parquet::errors::ParquetError;
use ::parquet::schema::types::ColumnDescriptor;

/// Rows that are decoded at a time.
const BATCH: usize = 1 << 14;

/// How the numbers of a column are to be taken.
#[derive(Clone, Copy)]
pub(super) struct Kind {
    pub(super) unsigned: bool,
    /// The level of a value that is there, in a column or within structs.
    present: i16,
    pub(super) unit: Option<&'static str>,
    pub(super) rounding: Rounding,
}

impl Kind {
    pub(super) fn of(column: &ColumnDescriptor) -> Option<Self> {
        if column.max_rep_level() > 0 { None } else { Kind::of_numbers(column) }
    }

    /// As [`Kind::of`], in a list or not.
    pub(super) fn of_numbers(column: &ColumnDescriptor) -> Option<Self> {
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
        Some(Kind { unsigned, present: column.max_def_level(), unit, rounding })
    }
}

/// Decodes up to `limit` rows of a column of a row group behind `values` and returns their number.
pub(super) fn append(column: &mut ColumnReader, kind: Kind, limit: usize, values: &mut Vec<f64>) -> Result<usize, ParquetError> {
    match column {
        ColumnReader::DoubleColumnReader(r) => batches(r, kind.present, limit, values, |x| x),
        ColumnReader::FloatColumnReader(r) => batches(r, kind.present, limit, values, f64::from),
        ColumnReader::BoolColumnReader(r) => batches(r, kind.present, limit, values, f64::from),
        ColumnReader::Int32ColumnReader(r) if kind.unsigned => batches(r, kind.present, limit, values, |x| f64::from(x.cast_unsigned())),
        ColumnReader::Int32ColumnReader(r) => batches(r, kind.present, limit, values, f64::from),
        ColumnReader::Int64ColumnReader(r) if kind.unsigned => batches(r, kind.present, limit, values, |x| x.cast_unsigned() as f64),
        ColumnReader::Int64ColumnReader(r) => batches(r, kind.present, limit, values, |x| x as f64),
        _ => Err(ParquetError::General("its type is not the one of its schema".to_owned())),
    }
}

fn batches<T: DataType>(
    reader: &mut ColumnReaderImpl<T>,
    present_level: i16,
    limit: usize,
    values: &mut Vec<f64>,
    number: impl Fn(T::T) -> f64,
) -> Result<usize, ParquetError> {
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
            // Below the level of a value that is there, it is missing.
            values.extend(levels.iter().map(|&level| if level < present_level { f64::NAN } else { numbers.next().unwrap_or(f64::NAN) }));
        }
    }
    Ok(values.len() - before)
}
