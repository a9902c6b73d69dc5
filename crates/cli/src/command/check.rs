//! `ndof check`.

use crate::error::CliError;
use crate::flags::as_flags;
use crate::options::{Reading, Shared};
use crate::output::{self, columns, headed, interval, short};
use clap::Args;
use ndof_analysis::check::result::CheckResult;
use ndof_io::Explanation;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Look at the data before the numbers: rate, missing, constant or clipped channels, resolution, outliers, trends, band.
///
/// Prints what was understood of each file, then what is wrong with it and what to do: a fault makes numbers wrong, a remark
/// deserves a look. `estimate`, `fit` and `diagnose` check the same and give it as warnings. Of a file that cannot be read it says what it
/// is, what was understood, and which options would make it readable; of a frequency response, what is in it.
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  ndof check trial-1.csv trial-2.csv")]
pub struct Arguments {
    /// Recordings; `-` is CSV on standard input
    #[arg(required = true, value_name = "FILE")]
    files: Vec<PathBuf>,
    /// End with code 1 if there is a fault
    #[arg(long)]
    exit_code: bool,
    #[command(flatten)]
    reading: Reading,
    #[command(flatten)]
    shared: Shared,
}

pub fn run(arguments: &Arguments) -> Result<ExitCode, CliError> {
    let shared = &arguments.shared;
    shared.apply_threads()?;
    if let Some(measured) = arguments.reading.response(&arguments.files)? {
        if shared.json.is_some() {
            return Err(CliError::Usage(format!(
                "{} is a frequency response, and the JSON of `ndof check` is about recordings; leave --json out",
                measured.file
            )));
        }
        output::warnings(shared, &measured.warnings);
        output::table(shared, &explained(&ndof_io::explain(Path::new(&measured.file))?))?;
        return Ok(ExitCode::SUCCESS);
    }
    let trials = match arguments.reading.look_at(&arguments.files) {
        Err(CliError::Io(error)) => {
            let there = arguments.files.iter().filter(|file| file.is_file());
            for told in there.map(|file| ndof_io::explain(file)).collect::<Result<Vec<_>, _>>()?.iter().filter(|told| !told.readable) {
                output::table(shared, &explained(told))?;
            }
            return Err(error.into());
        }
        read => read?,
    };
    let result = ndof_analysis::check(&trials, &arguments.reading.roles());
    output::told(shared, &result, &result.head.warnings, &summary(&result))?;
    Ok(if arguments.exit_code && result.verdict == "faulty" { ExitCode::from(1) } else { ExitCode::SUCCESS })
}

/// What a file is, what was understood of it and what not, and what would help.
fn explained(told: &Explanation) -> String {
    let mut text = format!("{}: {}, {} bytes\n", told.file, told.format.unwrap_or("no format that is known"), told.bytes);
    for (head, lines) in [("understood", &told.understood), ("not understood", &told.not_understood), ("what would help", &told.remedies)] {
        if !lines.is_empty() {
            text += &format!("{head}:\n{}", lines.iter().map(|line| format!("  {}\n", as_flags(line))).collect::<String>());
        }
    }
    for trial in &told.trials {
        let name = trial.name.as_ref().map_or_else(String::new, |name| format!(", trial {name}"));
        text += &format!("channels{name}:\n");
        let rows: Vec<Vec<String>> = trial.channels.iter().map(|c| vec![format!("  {}", c.name), c.unit.clone(), format!("{} missing", c.missing)]).collect();
        text += &columns(&rows);
    }
    text
}

/// What was understood, what was found, and the verdict.
fn summary(result: &CheckResult) -> String {
    let mut text = String::new();
    for trial in &result.trials {
        text += &format!("{}: {:.3} s at {} Hz, {} channels\n", trial.file, trial.duration_s, trial.sample_rate_hz, trial.channels.len());
        let rows = trial.channels.iter().map(|c| {
            let band = interval(c.band_hz);
            vec![c.name.clone(), c.unit.clone(), c.role.clone(), short(c.mean), short(c.std), short(c.step), band, c.missing.to_string()]
        });
        text += &headed(&["", "unit", "role", "mean", "std", "resolution", "98 % of power, Hz", "missing"], rows);
        for lag in &trial.lags {
            text += &format!("{} → {}: {} ms late (coherence {:.2})\n", lag.from, lag.to, short(lag.lag_s.map(|s| 1e3 * s)), lag.coherence);
        }
        text.push('\n');
    }
    if !result.assumptions.is_empty() {
        let least = |values: &[Option<f64>]| short(values.iter().flatten().copied().reduce(f64::min));
        let furthest = |values: &[Option<f64>]| short(values.iter().flatten().copied().reduce(|x, y| if y.abs() > x.abs() { y } else { x }));
        let between = |table: &[Vec<Option<f64>>]| {
            let pairs: Vec<f64> = (0..table.len()).flat_map(|i| (0..i).filter_map(move |j| table[i][j])).collect();
            short((!pairs.is_empty()).then(|| pairs.iter().sum::<f64>() / pairs.len() as f64))
        };
        let rows = result.assumptions.iter().map(|a| {
            vec![
                a.name.clone(),
                least(&a.drift_p_value),
                least(&a.trend_p_value),
                furthest(&a.skewness),
                furthest(&a.excess_kurtosis),
                least(&a.normal_p_value),
                between(&a.squared_correlation),
                between(&a.squared_correlation_of_mean_squares),
            ]
        });
        let head = ["", "drift, p", "trend, p", "skewness", "excess kurtosis", "Gaussian, p", "R² between trials", "of their mean squares"];
        text += &format!("{}\n", headed(&head, rows));
    }
    for f in &result.findings {
        let file = result.trials.get(f.trial - 1).map(|trial| trial.file.as_str()).unwrap_or_default();
        let channel = f.channel.as_ref().map(|c| format!(", {c}")).unwrap_or_default();
        text += &format!("{}[{}] {file}{channel}: {}\n  do: {}\n", f.severity, f.code, as_flags(&f.message), as_flags(&f.action));
    }
    let meaning = match result.verdict.as_str() {
        "faulty" => "faulty: numbers from these data would be wrong; do what the faults ask for first",
        "usable" => "usable: numbers can be had; mind the remarks",
        other => other,
    };
    text + &format!("verdict: {meaning}\n")
}
