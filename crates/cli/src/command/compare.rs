//! `ndof compare`.

use crate::error::CliError;
use crate::options::{Shared, measured};
use crate::output::{self, columns, interval, p_value, short};
use clap::Args;
use ndof_analysis::compare::result::CompareResult;
use ndof_analysis::fit::result::FitResult;
use ndof_analysis::options::count;
use ndof_analysis::{Fit, compare_fits, compare_sessions};
use ndof_io::IoError;
use std::path::{Path, PathBuf};

/// Compare fits with each other: before and after, left and right, session by session.
///
/// Every fit is compared with the first; p-values are adjusted for all parameters. Of three fits or more the scatter between them
/// gives the standard error of measurement and the minimal detectable change. With --sessions the fits are those of several
/// subjects, all sessions of one after the other: then also the intraclass correlation and the mean change over all subjects.
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  ndof compare before/fit.json after/fit.json --report compare.html")]
pub struct Arguments {
    /// Results of `ndof fit`, or frequency responses, to each of which inertia, damping and stiffness are fitted within --band
    #[arg(required = true, num_args = 2.., value_name = "FIT.json")]
    files: Vec<PathBuf>,
    /// Sessions of each subject
    #[arg(long, value_name = "N", value_parser = count)]
    sessions: Option<usize>,
    #[command(flatten)]
    shared: Shared,
}

pub fn run(arguments: &Arguments) -> Result<(), CliError> {
    let shared = &arguments.shared;
    shared.apply_threads()?;
    let responses = arguments.files.iter().map(|file| ndof_io::holds_response(file)).collect::<Result<Vec<_>, _>>()?;
    if shared.band.is_some() && !responses.contains(&true) {
        return Err(CliError::Usage("--band is for responses, and these are fits with a band of their own; leave it out".to_owned()));
    }
    let fitted = |file: &Path| Ok::<_, CliError>(measured(file)?.fit(&Fit { band_hz: shared.band, ..Fit::default() })?.result);
    let read = |(file, response): (&PathBuf, &bool)| if *response { fitted(file) } else { read(file) };
    let fits = arguments.files.iter().zip(&responses).map(read).collect::<Result<Vec<_>, _>>()?;
    let result = match arguments.sessions {
        Some(sessions) => compare_sessions(&fits, sessions)?,
        None => compare_fits(&fits)?,
    };
    if shared.pictured() {
        let names: Vec<String> = arguments.files.iter().map(|file| file.display().to_string()).collect();
        output::report(shared, &ndof_report::compare_report(&result, &names, "Fits beside each other", &output::command_line())?)?;
    }
    let text = if result.reliability.is_empty() { summary(&result, &arguments.files) } else { sessions(&result) };
    output::told(shared, &result, &result.head.warnings, &text)
}

fn read(file: &Path) -> Result<FitResult, CliError> {
    let name = file.display();
    ndof_io::keep(file);
    let text = std::fs::read_to_string(file).map_err(|source| CliError::Io(IoError::Read { file: name.to_string(), source }))?;
    let remedy = "give results that `ndof fit --json` wrote";
    serde_json::from_str(&text).map_err(|error| {
        let schema = serde_json::from_str::<serde_json::Value>(&text).ok().and_then(|value| value["schema"].as_str().map(str::to_owned));
        CliError::Usage(match schema {
            Some(schema) if schema != FitResult::SCHEMA => format!("{name}: holds {schema}, not {}; {remedy}", FitResult::SCHEMA),
            // Its names of fields are none of options.
            _ => format!("{name}, line {}: {}; {remedy}", error.line(), error.to_string().replace('`', "\"")),
        })
    })
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
            row.extend([short(*value), short(d.value), interval(d.ci95), p_value(d.p_value)]);
        }
        if scatter {
            row.extend([short(p.standard_error_of_measurement), short(p.minimal_detectable_change)]);
        }
        rows.push(row);
    }
    columns(&rows)
}

/// One row a parameter: agreement of the sessions, then each later session against the first.
fn sessions(result: &CompareResult) -> String {
    let mut rows = vec![["", "unit", "mean", "ICC(2,1)", "95 % interval", "SEM", "detectable"].map(str::to_owned).to_vec()];
    for change in result.reliability.first().map(|r| r.changes.as_slice()).unwrap_or_default() {
        rows[0].extend([format!("session {} − 1", change.session), "95 % interval".to_owned(), "p".to_owned()]);
    }
    for r in &result.reliability {
        let mut row = vec![r.name.clone(), r.unit.clone(), short(r.mean), short(r.icc), interval(r.icc_ci95)];
        row.extend([short(r.standard_error_of_measurement), short(r.minimal_detectable_change)]);
        for change in &r.changes {
            row.extend([short(change.mean), interval(change.ci95), p_value(change.p_value)]);
        }
        rows.push(row);
    }
    let subjects = result.reliability.first().map_or(0, |r| r.subjects);
    format!("{subjects} subjects\n{}", columns(&rows))
}
