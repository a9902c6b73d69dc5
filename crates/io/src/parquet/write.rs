//! A recording as Parquet, such that reading it gives the same recording bit for bit.

use super::{FOREIGN_KEYS, PARQUET, UNIT_KEY, UNITS_KEY};
use crate::assemble::is_time;
use crate::error::IoError;
use crate::names::{indexed, read_back};
use crate::write::{own_metadata, times};
use ::parquet::basic::{Compression, Repetition, Type as Physical};
use ::parquet::data_type::DoubleType;
use ::parquet::errors::ParquetError;
use ::parquet::file::metadata::KeyValue;
use ::parquet::file::properties::{EnabledStatistics, WriterProperties};
use ::parquet::file::writer::SerializedFileWriter;
use ::parquet::schema::types::Type;
use ndof_signal::Recording;
use std::sync::Arc;

/// Rows of one row group: some MB of a usual recording, so that a reader need not hold more at once.
const ROWS: usize = 1 << 17;

/// The bytes of the file.
pub(crate) fn write(recording: &Recording, file: &str) -> Result<Vec<u8>, IoError> {
    let unwritable = |what: String, remedy| IoError::Unwritable { file: file.to_owned(), what, format: PARQUET, remedy };
    if recording.is_empty() {
        return Err(unwritable("a recording without samples".to_owned(), "record or keep at least one"));
    }
    let mut facts: Vec<_> = times(recording).map(|(key, value)| (key.to_owned(), value.to_string())).collect();
    for channel in recording.channels() {
        let (name, unit) = (&channel.name, channel.unit.symbol());
        if name.is_empty() || is_time(name) || indexed(name) != *name || read_back(unit) != channel.unit {
            return Err(unwritable(format!("channel {name:?} in {unit:?}"), "give it another name or unit"));
        }
        facts.push((format!("{UNIT_KEY}{name}"), unit.to_owned()));
    }
    for (key, value) in own_metadata(recording) {
        if key.is_empty() || key.starts_with(UNIT_KEY) || key == UNITS_KEY || FOREIGN_KEYS.contains(&key.as_str()) {
            return Err(unwritable(format!("metadata key {key:?}"), "use another key"));
        }
        facts.push((key.clone(), value.clone()));
    }
    encode(recording, facts).map_err(|e| unwritable(format!("the recording ({e})"), "write CSV or NPZ"))
}

fn encode(recording: &Recording, facts: Vec<(String, String)>) -> Result<Vec<u8>, ParquetError> {
    let columns = recording
        .channels()
        .iter()
        .map(|c| Ok(Arc::new(Type::primitive_type_builder(&c.name, Physical::DOUBLE).with_repetition(Repetition::REQUIRED).build()?)))
        .collect::<Result<Vec<_>, ParquetError>>()?;
    let schema = Arc::new(Type::group_type_builder("recording").with_fields(columns).build()?);
    let properties = WriterProperties::builder()
        .set_compression(Compression::SNAPPY)
        .set_dictionary_enabled(false)
        .set_statistics_enabled(EnabledStatistics::None)
        .set_created_by(concat!("ndof ", env!("CARGO_PKG_VERSION")).to_owned())
        .set_key_value_metadata(Some(facts.into_iter().map(|(key, value)| KeyValue::new(key, value)).collect()))
        .build();
    let mut writer = SerializedFileWriter::new(Vec::new(), schema, Arc::new(properties))?;
    for start in (0..recording.len()).step_by(ROWS) {
        let rows = start..recording.len().min(start + ROWS);
        let mut group = writer.next_row_group()?;
        for channel in recording.channels() {
            let Some(mut column) = group.next_column()? else { break };
            column.typed::<DoubleType>().write_batch(&channel.samples[rows.clone()], None, None)?;
            column.close()?;
        }
        group.close()?;
    }
    writer.into_inner()
}
