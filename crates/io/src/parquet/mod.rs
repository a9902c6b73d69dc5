//! Parquet: one column of numbers a channel, units and facts in the file's key-value metadata.
//!
//! The keys are `sample_rate_hz`, `start_s`, `unit/NAME` for the unit of a channel, and any others as facts. A JSON
//! object under `units` is understood too, and so is a name with its unit in brackets. A missing value is NaN. A column of lists is a channel for each element, and one that
//! counts episodes makes a trial of each.

mod episodes;
mod kind;
mod lists;
mod pages;
mod read;
mod stream;
mod table;
mod write;

pub(crate) use read::read;
pub(crate) use stream::ParquetStream;
pub(crate) use table::write as write_table;
pub(crate) use write::write;

/// The format's name in messages.
const PARQUET: &str = "Parquet";

/// The key under which a channel's unit stands, before its name.
const UNIT_KEY: &str = "unit/";

/// A JSON object of units by name, as Python programs write it.
const UNITS_KEY: &str = "units";

/// Keys of other programs that describe their own types.
const FOREIGN_KEYS: [&str; 4] = ["ARROW:schema", "pandas", "huggingface", "org.apache.spark.sql.parquet.row.metadata"];
