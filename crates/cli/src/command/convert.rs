//! `ndof convert`.

use super::simulate::write_recordings;
use crate::error::CliError;
use crate::options::Reading;
use clap::Args;
use std::path::PathBuf;

/// Convert a recording from one format to another; the suffix of OUT says which.
///
/// What is read is written: named, turned, calibrated and cut as the options say. Several stretches become OUT-1, OUT-2 and so on.
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  ndof convert trial.mat trial.csv")]
pub struct Arguments {
    /// The recording to read, `-` for CSV on standard input
    #[arg(value_name = "IN")]
    from: PathBuf,
    /// The file to write
    #[arg(value_name = "OUT")]
    to: PathBuf,
    #[command(flatten)]
    reading: Reading,
}

pub fn run(arguments: &Arguments) -> Result<(), CliError> {
    let stretches = arguments.reading.stretches(&arguments.from)?;
    let same = |a: &PathBuf, b: &PathBuf| matches!((a.canonicalize(), b.canonicalize()), (Ok(a), Ok(b)) if a == b);
    if same(&arguments.from, &arguments.to) {
        return Err(CliError::Usage(format!("{} is the input itself, which is never changed; give another name for the output", arguments.to.display())));
    }
    match stretches.as_slice() {
        [one] => Ok(ndof_io::write(&arguments.to, one)?),
        several => write_recordings(&arguments.to, several).map(drop),
    }
}
