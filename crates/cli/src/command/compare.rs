//! `ndof compare`.

use crate::error::CliError;
use crate::options::Shared;
use crate::output::{self, columns, short};
use clap::Args;
use ndof_study::compare_fits;
use ndof_study::result::{CompareResult, FitResult};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Compare fits with each other: before and after, left and right, session by session.
///
/// Every fit is compared with the first; p-values are adjusted for all parameters. Of three fits or more the scatter between them
/// gives the standard error of measurement and the minimal detectable change.
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  ndof compare before/fit.json after/fit.json")]
pub struct Arguments {
    /// Results of `ndof fit`
    #[arg(required = true, num_args = 2.., value_name = "FIT.json")]
    files: Vec<PathBuf>,
    #[command(flatten)]
    shared: Shared,
}

pub fn run(arguments: &Arguments) -> Result<ExitCode, CliError> {
    let shared = &arguments.shared;
    let fits = arguments.files.iter().map(|file| read(file)).collect::<Result<Vec<_>, _>>()?;
    let result = compare_fits(&fits, "compare")?;
    output::json(shared, &result)?;
    output::warnings(shared, &result.warnings);
    output::table(shared, &summary(&result, &arguments.files))?;
    Ok(ExitCode::SUCCESS)
}

fn read(file: &Path) -> Result<FitResult, CliError> {
    let name = file.display();
    let text = std::fs::read_to_string(file).map_err(|error| CliError::Usage(format!("{name}: {error}; check the path")))?;
    serde_json::from_str(&text).map_err(|error| CliError::Usage(format!("{name}, line {}: {error}; give results that `ndof fit --json` wrote", error.line())))
}

fn summary(result: &CompareResult, files: &[PathBuf]) -> String {
    let mut rows = vec![vec![String::new(), "unit".to_owned()]];
    rows[0].push(files.first().map(|file| file.display().to_string()).unwrap_or_default());
    for file in files.iter().skip(1) {
        rows[0].extend([file.display().to_string(), "difference".to_owned(), "95 % interval".to_owned(), "p".to_owned()]);
    }
    let scatter = result.fits > 2;
    if scatter {
        rows[0].extend(["SEM", "detectable"].map(str::to_owned));
    }
    for p in &result.parameters {
        let mut row = vec![p.name.clone(), p.unit.clone(), short(p.values.first().copied().flatten())];
        for (value, d) in p.values.iter().skip(1).zip(&p.differences) {
            let interval = d.ci95.map_or_else(|| "–".to_owned(), |[low, high]| format!("{} … {}", short(Some(low)), short(Some(high))));
            row.extend([short(*value), short(d.value), interval, short(d.p_value)]);
        }
        if scatter {
            row.extend([short(p.standard_error_of_measurement), short(p.minimal_detectable_change)]);
        }
        rows.push(row);
    }
    columns(&rows)
}
