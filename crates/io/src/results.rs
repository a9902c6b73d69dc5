//! Tables of results, one row a subject.

use crate::atomic::write_atomic;
use crate::error::IoError;
use std::path::Path;

/// A column of a table of results.
#[derive(Clone, Debug, PartialEq)]
pub enum ResultColumn {
    /// Numbers, or nothing.
    Numbers(Vec<Option<f64>>),
    /// Texts, or nothing.
    Texts(Vec<Option<String>>),
}

impl ResultColumn {
    fn cell(&self, row: usize) -> Option<String> {
        match self {
            ResultColumn::Numbers(values) => values.get(row)?.map(|value| value.to_string()),
            ResultColumn::Texts(values) => values.get(row)?.clone(),
        }
    }

    fn len(&self) -> usize {
        match self {
            ResultColumn::Numbers(values) => values.len(),
            ResultColumn::Texts(values) => values.len(),
        }
    }
}

/// Writes a table as CSV (RFC 4180; what is missing is empty, numbers read back exactly), atomically.
///
/// # Errors
/// [`IoError::Write`].
pub fn write_results_csv(path: &Path, columns: &[(String, ResultColumn)]) -> Result<(), IoError> {
    let quoted = |cell: &str| if cell.contains([',', '"', '\n', '\r']) { format!("\"{}\"", cell.replace('"', "\"\"")) } else { cell.to_owned() };
    let rows = columns.iter().map(|(_, column)| column.len()).max().unwrap_or(0);
    let mut text = columns.iter().map(|(name, _)| quoted(name)).collect::<Vec<_>>().join(",") + "\n";
    for row in 0..rows {
        text += &columns.iter().map(|(_, column)| quoted(&column.cell(row).unwrap_or_default())).collect::<Vec<_>>().join(",");
        text.push('\n');
    }
    write_atomic(path, text.as_bytes())
}

/// Writes a table as Parquet, atomically; `false`, and nothing is written, in a build without the feature `parquet`.
///
/// # Errors
/// [`IoError::Write`], or [`IoError::Unwritable`] if the table has no Parquet.
#[cfg(feature = "parquet")]
pub fn write_results_parquet(path: &Path, columns: &[(String, ResultColumn)]) -> Result<bool, IoError> {
    let unwritable =
        |why| IoError::Unwritable { file: path.display().to_string(), what: format!("the table ({why})"), format: "Parquet", remedy: "use the CSV beside it" };
    write_atomic(path, &crate::parquet::write_table(columns).map_err(unwritable)?)?;
    Ok(true)
}

/// Writes a table as Parquet, atomically; `false`, and nothing is written, in a build without the feature `parquet`.
///
/// # Errors
/// None in this build.
#[cfg(not(feature = "parquet"))]
pub fn write_results_parquet(_path: &Path, _columns: &[(String, ResultColumn)]) -> Result<bool, IoError> {
    Ok(false)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table() -> Vec<(String, ResultColumn)> {
        let names = ResultColumn::Texts(vec![Some("a, b".to_owned()), Some("c".to_owned())]);
        vec![("subject".to_owned(), names), ("K".to_owned(), ResultColumn::Numbers(vec![Some(0.1), None]))]
    }

    #[test]
    fn csv_quotes_what_it_must_and_leaves_gaps_empty() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("t.csv");
        write_results_csv(&path, &table()).unwrap();
        assert_eq!(std::fs::read_to_string(&path).unwrap(), "subject,K\n\"a, b\",0.1\nc,\n");
    }

    #[cfg(feature = "parquet")]
    #[test]
    fn parquet_holds_the_same_with_nulls() {
        use ::parquet::file::reader::{FileReader, SerializedFileReader};
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("t.parquet");
        assert!(write_results_parquet(&path, &table()).unwrap());
        let reader = SerializedFileReader::new(std::fs::File::open(&path).unwrap()).unwrap();
        let rows: Vec<String> = reader.get_row_iter(None).unwrap().map(|row| row.unwrap().to_string()).collect();
        assert_eq!(rows, ["{subject: \"a, b\", K: 0.1}", "{subject: \"c\", K: null}"]);
    }
}
