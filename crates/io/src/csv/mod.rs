//! CSV and TSV: a line of names, then a line of numbers for each sample.
//!
//! The separator and the decimal sign follow from the file. What could be read in two ways is an error.

mod cells;
mod header;
mod read;
mod stream;
mod write;

pub(crate) use read::read;
pub use stream::CsvStream;
pub(crate) use write::write;
