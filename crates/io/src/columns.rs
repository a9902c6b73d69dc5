//! What the columns of a table without a header are.

use crate::error::IoError;
use crate::limits::MAX_CHANNELS;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// The channels of a table without a header, by the numbers of their columns.
///
/// ```
/// let file = "[columns]\ntorque_ie = { number = 8, unit = \"N m\" }\nangle_ie = { number = 2, unit = \"rad\" }\n";
/// let columns = ndof_io::ColumnsFile::parse(file, "robot.toml")?;
/// assert_eq!(columns.columns["angle_ie"].number, 2);
/// # Ok::<(), ndof_io::IoError>(())
/// ```
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ColumnsFile {
    /// `ndof/columns/1`.
    pub schema: Option<String>,
    /// Samples a second, for a table that has no column of time.
    pub sample_rate_hz: Option<f64>,
    /// By the name of a channel, where it stands; columns that are not named are not read.
    pub columns: BTreeMap<String, ColumnNumber>,
}

/// Where a channel stands.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ColumnNumber {
    /// The column, from 1.
    pub number: usize,
    /// Its unit.
    pub unit: Option<String>,
}

impl ColumnsFile {
    /// The schema's name.
    pub const SCHEMA: &str = "ndof/columns/1";

    /// Reads the TOML text of `file`, which messages name.
    ///
    /// # Errors
    /// [`IoError::Columns`] if it is no such file, names no column, or names one twice.
    pub fn parse(text: &str, file: &str) -> Result<Self, IoError> {
        let wrong = |what: String| IoError::Columns { file: file.to_owned(), what };
        let columns: ColumnsFile = toml::from_str(text).map_err(|e| wrong(e.to_string().trim_end().to_owned()))?;
        columns.check(file)
    }

    /// The same where it makes sense; `file` is what messages call it.
    ///
    /// # Errors
    /// As [`ColumnsFile::parse`].
    pub fn check(self, file: &str) -> Result<Self, IoError> {
        let columns = self;
        let wrong = |what: String| IoError::Columns { file: file.to_owned(), what };
        if let Some(schema) = columns.schema.as_deref().filter(|schema| *schema != Self::SCHEMA) {
            return Err(wrong(format!("its schema is {schema}, and {} is read here", Self::SCHEMA)));
        }
        if columns.columns.is_empty() {
            return Err(wrong("it names no column".to_owned()));
        }
        let mut seen = BTreeMap::new();
        for (name, column) in &columns.columns {
            if !(1..=MAX_CHANNELS).contains(&column.number) {
                return Err(wrong(format!("{name} has number {}; columns are numbered from 1 to {MAX_CHANNELS}", column.number)));
            }
            if let Some(other) = seen.insert(column.number, name) {
                return Err(wrong(format!("{other} and {name} both have number {}", column.number)));
            }
        }
        Ok(columns)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_no_layout_is_refused_with_its_reason() {
        for (text, why) in [
            ("[columns]\n", "names no column"),
            ("[columns]\na = { number = 0 }\n", "from 1"),
            ("[columns]\na = { number = 2 }\nb = { number = 2 }\n", "both have number 2"),
            ("[columns]\na = { number = 2, units = \"N\" }\n", "units"),
            ("schema = \"ndof/channels/1\"\n[columns]\na = { number = 2 }\n", "ndof/columns/1"),
            ("columns = 3", "columns"),
        ] {
            let error = ColumnsFile::parse(text, "lab.toml").unwrap_err().to_string();
            assert!(error.contains(why) && error.starts_with("lab.toml"), "{error}");
        }
    }
}
