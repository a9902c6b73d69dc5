//! A table of texts and numbers as Parquet, some of them missing.

use crate::results::ResultColumn;
use ::parquet::basic::{Compression, LogicalType, Repetition, Type as Physical};
use ::parquet::data_type::{ByteArray, ByteArrayType, DoubleType};
use ::parquet::errors::ParquetError;
use ::parquet::file::properties::WriterProperties;
use ::parquet::file::writer::SerializedFileWriter;
use ::parquet::schema::types::Type;
use std::sync::Arc;

/// The bytes of the file; a value that is missing is null.
pub(crate) fn write(columns: &[(String, ResultColumn)]) -> Result<Vec<u8>, ParquetError> {
    let fields = columns
        .iter()
        .map(|(name, column)| {
            let field = match column {
                ResultColumn::Numbers(_) => Type::primitive_type_builder(name, Physical::DOUBLE),
                ResultColumn::Texts(_) => Type::primitive_type_builder(name, Physical::BYTE_ARRAY).with_logical_type(Some(LogicalType::String)),
            };
            Ok(Arc::new(field.with_repetition(Repetition::OPTIONAL).build()?))
        })
        .collect::<Result<Vec<_>, ParquetError>>()?;
    let schema = Arc::new(Type::group_type_builder("results").with_fields(fields).build()?);
    let created_by = concat!("ndof ", env!("CARGO_PKG_VERSION")).to_owned();
    let properties = WriterProperties::builder().set_compression(Compression::SNAPPY).set_created_by(created_by).build();
    let mut writer = SerializedFileWriter::new(Vec::new(), schema, Arc::new(properties))?;
    let mut group = writer.next_row_group()?;
    for (_, values) in columns {
        let Some(mut column) = group.next_column()? else { break };
        match values {
            ResultColumn::Numbers(values) => {
                let (present, levels) = split(values, |value| *value);
                column.typed::<DoubleType>().write_batch(&present, Some(&levels), None)?;
            }
            ResultColumn::Texts(values) => {
                let (present, levels) = split(values, |value| ByteArray::from(value.as_str()));
                column.typed::<ByteArrayType>().write_batch(&present, Some(&levels), None)?;
            }
        }
        column.close()?;
    }
    group.close()?;
    writer.into_inner()
}

/// The values that there are, and one level a row: 1 where there is one.
fn split<T, U>(values: &[Option<T>], convert: impl Fn(&T) -> U) -> (Vec<U>, Vec<i16>) {
    (values.iter().flatten().map(convert).collect(), values.iter().map(|value| i16::from(value.is_some())).collect())
}
