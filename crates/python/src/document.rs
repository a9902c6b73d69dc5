//! Files that people write, as Python gives them.

use crate::error::{FileError, raise_analysis, raise_io};
use crate::estimate::from_json;
use ndof::io::ColumnsFile;
use pyo3::prelude::*;
use serde::de::DeserializeOwned;
use std::path::{Path, PathBuf};

/// A file that people write, given as a path, or as the JSON of a dictionary.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct Document {
    json: Option<String>,
    path: Option<PathBuf>,
}

impl Document {
    /// The path, where that is how it was given.
    pub fn path(&self) -> Option<&Path> {
        self.path.as_deref()
    }

    /// What it says; `what` is its name in errors.
    pub fn parse<T: DeserializeOwned>(&self, what: &str) -> PyResult<Option<T>> {
        match (&self.json, &self.path) {
            (Some(text), _) => from_json(text, what).map(Some),
            (None, Some(path)) => ndof::analysis::file::read(path).map(Some).map_err(raise_analysis),
            (None, None) => Ok(None),
        }
    }

    /// What the columns of a table without a header are.
    pub fn columns(&self) -> PyResult<Option<ColumnsFile>> {
        match (&self.json, &self.path) {
            (Some(text), _) => from_json::<ColumnsFile>(text, "columns")?.check("columns").map(Some).map_err(raise_io),
            (None, Some(path)) => {
                let file = path.display().to_string();
                let text = std::fs::read_to_string(path).map_err(|error| FileError::new_err(format!("{file}: {error}; look at the path")))?;
                ColumnsFile::parse(&text, &file).map(Some).map_err(raise_io)
            }
            (None, None) => Ok(None),
        }
    }
}
