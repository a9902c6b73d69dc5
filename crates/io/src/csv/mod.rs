//! CSV and TSV: a line of names, or one and a row of units, then a line of numbers for each sample; or no names, and a file that says what the columns are.
//!
//! The separator and the decimal sign follow from the file. What could be read in two ways is an error.

mod cells;
mod head;
mod header;
mod headless;
mod plain;
mod read;
mod rows;
mod stream;
mod write;

use crate::error::IoError;
use crate::options::ReadOptions;
use crate::table::Table;

pub(crate) use read::{read_piece, text};
pub use stream::CsvStream;
pub(crate) use write::{Shortest, write};

/// Reads a CSV file.
pub(crate) fn read(bytes: &[u8], file: &str, options: &ReadOptions) -> Result<Table, IoError> {
    let text = text(bytes, file, 0)?;
    match &options.columns {
        Some(columns) => headless::read(text, file, columns),
        None => read_piece(text, file, (0, 0)),
    }
}
