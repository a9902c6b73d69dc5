//! Errors of the library as Python exceptions, with the same text.

use ndof::analysis::AnalysisError;
use ndof::io::IoError;
use ndof::study::StudyError;
use pyo3::PyErr;
use std::fmt::Display;

// Written in Python, where one class may be a ValueError and another an OSError too.
pyo3::import_exception!(ndof._errors, NdofError);
pyo3::import_exception!(ndof._errors, FileError);

/// An exception with the text of `error`.
pub fn raise(error: impl Display) -> PyErr {
    NdofError::new_err(error.to_string())
}

/// An error of reading or writing: [`FileError`] where it is about the file as a whole and not about what it holds.
pub fn raise_io(error: IoError) -> PyErr {
    let of_the_file = matches!(error, IoError::Read { .. }) || error.is_machine_failure();
    if of_the_file { FileError::new_err(error.to_string()) } else { raise(error) }
}

/// An error of an analysis.
pub fn raise_analysis(error: AnalysisError) -> PyErr {
    match error {
        AnalysisError::Io(error) => raise_io(error),
        AnalysisError::Read { .. } => FileError::new_err(error.to_string()),
        other => raise(other),
    }
}

/// An error of a study.
pub fn raise_study(error: StudyError) -> PyErr {
    match error {
        StudyError::Analysis(error) => raise_analysis(error),
        other => raise(other),
    }
}
