//! `ndof schema`.

use crate::error::CliError;
use clap::Args;
use ndof_study::result::{SCHEMAS, schema_of};
use std::io::Write;
use std::process::ExitCode;

/// Print the JSON Schema of a result.
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  ndof schema estimate > estimate.schema.json")]
pub struct Arguments {
    /// Which result.
    name: String,
}

pub fn run(arguments: &Arguments) -> Result<ExitCode, CliError> {
    let short = arguments.name.trim_start_matches("ndof/").trim_end_matches("/1");
    let schema = schema_of(short).ok_or_else(|| {
        let suggestion = ndof_study::nearest(short, SCHEMAS.iter().copied()).map(|s| format!(" (did you mean \"{s}\"?)")).unwrap_or_default();
        CliError::Usage(format!("no schema \"{}\"{suggestion}; there are: {}", arguments.name, SCHEMAS.join(", ")))
    })?;
    let text = serde_json::to_string_pretty(&schema).map_err(|error| CliError::Usage(error.to_string()))?;
    writeln!(std::io::stdout(), "{text}")?;
    Ok(ExitCode::SUCCESS)
}
