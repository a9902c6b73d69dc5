//! Columns of lists, as data sets for robot learning keep a state or an action: one channel an element.

use super::PARQUET;
use super::kind::Kind;
use crate::arrays::{Entry, Value};
use crate::error::IoError;
use crate::limits::{Budget, MAX_CHANNELS};
use ::parquet::column::reader::{ColumnReader, ColumnReaderImpl};
use ::parquet::data_type::DataType;
use ::parquet::errors::ParquetError;
use ::parquet::file::reader::FileReader;
use ::parquet::schema::types::ColumnDescriptor;

/// Rows that are decoded at a time.
const BATCH: usize = 1 << 12;

/// How the elements of a column of lists are to be taken.
#[derive(Clone, Copy)]
pub(super) struct ListKind {
    kind: Kind,
    /// The level of an element that is there, and from which on there is an element at all, be it missing.
    present: i16,
    element: i16,
}

/// The lists of a column, one behind the other.
#[derive(Default)]
struct Lists {
    values: Vec<f64>,
    lengths: Vec<u32>,
}

impl ListKind {
    /// [`None`] if it is no column of lists of plain numbers.
    pub fn of(column: &ColumnDescriptor) -> Option<Self> {
        let kind = (column.max_rep_level() == 1).then(|| Kind::of_numbers(column)).flatten()?;
        let present = column.max_def_level();
        Some(ListKind { kind, present, element: present - i16::from(column.self_type().is_optional()) })
    }

    /// Reads column `index`: an entry for each element, where all lists have the same length.
    pub fn read(self, reader: &dyn FileReader, index: usize, file: &str, budget: &mut Budget) -> Result<Vec<Entry>, IoError> {
        let metadata = reader.metadata();
        let column = metadata.file_metadata().schema_descr().column(index);
        // `observation.state`, `list`, `element`: only the first is somebody's name.
        let parts = column.path().parts();
        let name = parts.first().cloned().unwrap_or_default();
        let damaged = |what: String| IoError::Damaged { file: file.to_owned(), format: PARQUET, what: format!("column \"{name}\" {what}") };
        let mut lists = Lists::default();
        for g in 0..reader.num_row_groups() {
            let group = metadata.row_group(g);
            budget.claim(file, 16 * u64::try_from(group.column(index).num_values()).unwrap_or(u64::MAX))?;
            let before = lists.lengths.len();
            let mut open = reader.get_row_group(g).and_then(|r| r.get_column_reader(index)).map_err(|e| damaged(format!("cannot be opened ({e})")))?;
            self.append(&mut open, &mut lists).map_err(|e| damaged(format!("cannot be read ({e})")))?;
            if (lists.lengths.len() - before) as i64 != group.num_rows() {
                return Err(damaged(format!("has {} rows in row group {g}, which says {}", lists.lengths.len() - before, group.num_rows())));
            }
        }
        let width = lists.lengths.iter().copied().find(|n| *n > 0).unwrap_or(0) as usize;
        let plain = parts.len() <= 3 && width > 0 && lists.lengths.iter().all(|&n| n == 0 || n as usize == width);
        if !plain {
            return Ok(vec![Entry::new(vec![name], Value::Other("lists of several lengths"))]);
        }
        if width > MAX_CHANNELS {
            return Err(IoError::too_large(file, "elements of a list", width, MAX_CHANNELS, "save the elements that are needed"));
        }
        budget.claim(file, 8 * (width as u64).saturating_mul(lists.lengths.len() as u64))?;
        Ok((0..width).map(|k| self.entry(&name, k, width, &lists)).collect())
    }

    fn entry(self, name: &str, k: usize, width: usize, lists: &Lists) -> Entry {
        let mut at = k;
        let value = |&length: &u32| {
            // A row without a list is a missing sample of every channel.
            let value = if length == 0 { None } else { lists.values.get(at).copied() };
            at += if length == 0 { 0 } else { width };
            value.unwrap_or(f64::NAN)
        };
        let values: Vec<f64> = lists.lengths.iter().map(value).collect();
        let value = Value::Numbers { shape: vec![values.len()], values, rounding: self.kind.rounding };
        Entry { unit: self.kind.unit.map(str::to_owned), ..Entry::new(vec![format!("{name}_{k}")], value) }
    }

    fn append(self, column: &mut ColumnReader, lists: &mut Lists) -> Result<(), ParquetError> {
        match column {
            ColumnReader::DoubleColumnReader(r) => self.batches(r, lists, |x| x),
            ColumnReader::FloatColumnReader(r) => self.batches(r, lists, f64::from),
            ColumnReader::BoolColumnReader(r) => self.batches(r, lists, f64::from),
            ColumnReader::Int32ColumnReader(r) if self.kind.unsigned => self.batches(r, lists, |x| f64::from(x.cast_unsigned())),
            ColumnReader::Int32ColumnReader(r) => self.batches(r, lists, f64::from),
            ColumnReader::Int64ColumnReader(r) if self.kind.unsigned => self.batches(r, lists, |x| x.cast_unsigned() as f64),
            ColumnReader::Int64ColumnReader(r) => self.batches(r, lists, |x| x as f64),
            _ => Err(ParquetError::General("its type is not the one of its schema".to_owned())),
        }
    }

    fn batches<T: DataType>(self, reader: &mut ColumnReaderImpl<T>, lists: &mut Lists, number: impl Fn(T::T) -> f64) -> Result<(), ParquetError> {
        let (mut values, mut present, mut starts) = (Vec::new(), Vec::new(), Vec::new());
        loop {
            values.clear();
            present.clear();
            starts.clear();
            let (records, ..) = reader.read_records(BATCH, Some(&mut present), Some(&mut starts), &mut values)?;
            if records == 0 {
                return Ok(());
            }
            let mut numbers = values.drain(..).map(&number);
            for (&level, &start) in present.iter().zip(&starts) {
                if start == 0 {
                    lists.lengths.push(0);
                }
                if level >= self.element {
                    lists.values.push(if level < self.present { f64::NAN } else { numbers.next().unwrap_or(f64::NAN) });
                    if let Some(length) = lists.lengths.last_mut() {
                        *length += 1;
                    }
                }
            }
        }
    }
}
