//! One message for the user, and the exit code that goes with it.

use ndof_analysis::{AnalysisError, did_you_mean, nearest};
use ndof_io::IoError;
use ndof_report::FigureError;
use ndof_study::StudyError;
use std::process::ExitCode;

/// Why a command ended without its result.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs, reason = "a message says what its fields are")]
pub enum CliError {
    /// Bad usage.
    #[error("{0}")]
    Usage(String),
    /// A recording cannot be read or written.
    #[error(transparent)]
    Io(#[from] IoError),
    /// The job cannot be done with this input.
    #[error(transparent)]
    Analysis(#[from] AnalysisError),
    /// The experiment or the study cannot be done.
    #[error(transparent)]
    Study(#[from] StudyError),
    /// A picture cannot be drawn.
    #[error("drawing: {0}")]
    Figure(#[from] FigureError),
    /// The machine failed.
    #[error("{what}: {source}; check disk and permissions")]
    Machine { what: String, source: std::io::Error },
    /// Whoever reads our output has had enough.
    #[error("standard output was closed")]
    BrokenPipe,
}

impl CliError {
    /// The error for a study that does not exist.
    pub(crate) fn unknown_study(name: &str, studies: &[(&str, &str)]) -> Self {
        let known: Vec<&str> = studies.iter().map(|(known, _)| *known).collect();
        let suggestion = did_you_mean(nearest(name, known.iter().copied()).as_deref());
        CliError::Usage(format!("no study \"{name}\"{suggestion}; built in: {}; or give a file, STUDY.toml", known.join(", ")))
    }

    /// 0 for a pipe that was closed early, 3 if the machine failed, else 2.
    pub fn exit_code(&self) -> ExitCode {
        ExitCode::from(match self {
            CliError::BrokenPipe => 0,
            CliError::Machine { .. } => 3,
            CliError::Io(error) | CliError::Analysis(AnalysisError::Io(error)) | CliError::Study(StudyError::Analysis(AnalysisError::Io(error)))
                if error.is_machine_failure() =>
            {
                3
            }
            _ => 2,
        })
    }
}

impl From<std::io::Error> for CliError {
    fn from(source: std::io::Error) -> Self {
        match source.kind() {
            std::io::ErrorKind::BrokenPipe => CliError::BrokenPipe,
            _ => CliError::Machine { what: "writing to standard output".to_owned(), source },
        }
    }
}
