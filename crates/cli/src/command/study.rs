//! `ndof study`.

use super::fit::{over_schedule, parameter_table};
use super::simulate::{built_in, write_trials};
use crate::error::CliError;
use crate::options::{Reading, Recordings, Shared};
use crate::output::{self, headed, short, write_json};
use crate::progress::Progress;
use clap::Args;
use ndof_analysis::{Diagnose, Trials};
use ndof_study::file::{HiddenEffect, StudyDocument, StudyFile};
use ndof_study::sensitivity::result::SensitivityResult;
use ndof_study::{StudyOutcome, analyse, cases_report, run_cases, study_report, study_result, summary_tables};
use std::path::{Path, PathBuf};

/// Run a whole study: design, simulate, estimate, fit, project to the joints, report.
///
/// Writes recordings/, estimate.json, fit.json, study.json, plots/ and report.html into --out and prints the table of parameters.
/// A study with several cases writes those of the first there and those of each further case into cases/NAME/. --recording takes
/// measured files in place of the simulation. `ndof fit --study` and `ndof diagnose --study` write a study of recordings, with
/// [recordings] in place of [experiment].
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  ndof study arm --out results")]
pub struct Arguments {
    /// A built-in study (arm, arm-moving, drift, masses, arm-hidden, sensitivity, spring-array, wrist), or STUDY.toml
    study: String,
    /// Folder for all results [default: ndof-out/NAME]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Measured trials in place of the simulation
    #[arg(long, value_name = "FILE", num_args = 1..)]
    recording: Vec<PathBuf>,
    #[command(flatten)]
    reading: Reading,
    #[command(flatten)]
    shared: Shared,
}

pub fn run(arguments: &Arguments, studies: &[(&str, &str)]) -> Result<(), CliError> {
    let shared = &arguments.shared;
    shared.apply_threads()?;
    let path = Path::new(&arguments.study);
    let bars = Progress::steps(shared.quiet);
    let progress = |what: &'static str, done: usize, total: usize| bars.show(what, done, total);
    if !studies.iter().any(|(known, _)| *known == arguments.study)
        && path.exists()
        && let Some(study) = Recordings::study(path)?
    {
        let outcome = analyse(&study, measured(arguments, &study)?, &progress)?;
        return finish(arguments, &stem(path), &study, &[(String::new(), outcome)]);
    }
    let (name, study) = load(&arguments.study, studies)?;
    let recordings = if arguments.recording.is_empty() { None } else { Some(arguments.reading.read_all(&arguments.recording)?) };
    let outcomes = run_cases(&study, recordings, shared.seed, &progress)?;
    finish(arguments, &name, &study, &outcomes)
}

/// The recordings of a study; --recording puts others in their place.
fn measured(arguments: &Arguments, study: &StudyDocument<Recordings>) -> Result<Trials, CliError> {
    if arguments.reading != Reading::default() {
        return Err(CliError::Usage(format!("{} says how its recordings are read; write it into [recordings] there", arguments.study)));
    }
    let Recordings { files, reading } = &study.experiment;
    let kept = [study.estimate.channels(), study.fit.channels(), study.diagnose.as_ref().map_or_else(Vec::new, Diagnose::channels)].concat();
    reading.trials_with(if arguments.recording.is_empty() { files } else { &arguments.recording }, &kept)
}

/// Results in their folders and in print.
fn finish<E>(arguments: &Arguments, name: &str, study: &StudyDocument<E>, outcomes: &[(String, StudyOutcome)]) -> Result<(), CliError> {
    let shared = &arguments.shared;
    let out = arguments.out.clone().unwrap_or_else(|| Path::new("ndof-out").join(name));
    outcomes.iter().for_each(|(_, outcome)| output::understood(shared, &outcome.trials));
    let result = study_result(study, outcomes)?;
    let Some((_, outcome)) = outcomes.first() else { return Ok(()) };
    let (title, command) = (study.title.as_deref().unwrap_or(name), format!("ndof study {}", arguments.study));
    let several = if outcomes.len() > 1 { cases_report(outcomes, &result, &study.report, title, &command)? } else { None };
    let report = output::with_flags(several.map_or_else(|| study_report(outcome, title, &command), Ok)?);

    output::create_folder(&out)?;
    write_json(&out.join("study.json"), &result)?;
    for (k, (case, outcome)) in outcomes.iter().enumerate() {
        write_case(&if k == 0 { out.clone() } else { out.join("cases").join(case) }, name, outcome)?;
    }
    output::write_plots(&out.join("plots"), &report)?;
    ndof_io::write_atomic(&out.join("report.html"), report.to_html().as_bytes())?;
    output::report(shared, &report)?;
    if outcomes.len() == 1 {
        let fit = &outcome.fitted.result;
        return output::told(shared, fit, &fit.head.warnings, &summary(outcome, &out));
    }
    let tables: Vec<String> = summary_tables(&result, &study.report).iter().map(as_text).collect();
    let where_to = format!("{}\nresults in {}: report.html, study.json, plots/, and one folder a case under cases/\n", tables.join("\n"), out.display());
    output::told(shared, &result, &result.head.warnings, &where_to)
}

fn stem(path: &Path) -> String {
    path.file_stem().map_or_else(|| "study".to_owned(), |stem| stem.to_string_lossy().into_owned())
}

/// Recordings, estimate, fit and diagnosis of one case.
fn write_case(folder: &Path, name: &str, outcome: &StudyOutcome) -> Result<(), CliError> {
    output::create_folder(folder)?;
    if let Some(simulated) = &outcome.simulated {
        let recordings = folder.join("recordings");
        output::create_folder(&recordings)?;
        write_trials(&recordings.join(format!("{name}.csv")), &simulated.recordings, &simulated.truth)?;
    }
    write_json(&folder.join("estimate.json"), &outcome.estimated.result)?;
    write_json(&folder.join("fit.json"), &outcome.fitted.result)?;
    if let Some(sensitivity) = &outcome.sensitivity {
        write_json(&folder.join("sensitivity.json"), sensitivity)?;
    }
    match &outcome.diagnosed {
        Some(diagnosed) => write_json(&folder.join("diagnosis.json"), &diagnosed.result),
        None => Ok(()),
    }
}

/// "hysteresis at x (stiffness_n_per_m = 211)".
fn told(hidden: &HiddenEffect) -> String {
    let values: Vec<String> = hidden
        .parameters
        .iter()
        .map(|(name, value)| format!("{name} = {}", value.as_float().map_or_else(|| value.to_string(), |v| output::short(Some(v)))))
        .collect();
    let at = hidden.axis.as_ref().map(|axis| format!(" at {axis}")).unwrap_or_default();
    format!("{}{at} ({})", hidden.name, values.join(", "))
}

/// A table in columns, its caption above.
fn as_text(table: &ndof_report::Table) -> String {
    let head: Vec<&str> = table.columns.iter().map(|(head, _)| head.as_str()).collect();
    format!("{}\n{}", table.caption, headed(&head, table.rows.iter().cloned()))
}

fn load(name: &str, studies: &[(&str, &str)]) -> Result<(String, StudyFile), CliError> {
    Ok(match built_in(name, studies)? {
        Some((known, text)) => (known.to_owned(), StudyFile::parse(text, known)?),
        None => (stem(Path::new(name)), StudyFile::read(Path::new(name))?),
    })
}

fn summary(outcome: &StudyOutcome, out: &Path) -> String {
    let m = &outcome.estimated.result.method;
    let mut text = format!(
        "{} trial(s), {} estimate, {:.2} effective averages, fitted from {:.2} to {:.2} Hz\n\n{}",
        outcome.trials.trials.len(),
        outcome.fitted.result.estimate,
        m.effective_averages,
        outcome.fitted.result.band_hz[0],
        outcome.fitted.result.band_hz[1],
        parameter_table(&outcome.table())
    );
    text += &outcome.fitted.result.schedule.as_ref().map_or_else(String::new, over_schedule);
    text += &outcome.sensitivity.as_ref().map(sensitivity_table).unwrap_or_default();
    if let Some(diagnosed) = &outcome.diagnosed {
        if !outcome.hidden.is_empty() {
            text += "\nSomething was hidden in these recordings. Look at plots/ and guess before you read on.\n";
        }
        text += &format!("\n{}", super::diagnose::summary(&diagnosed.result));
    }
    if !outcome.hidden.is_empty() {
        let told: Vec<String> = outcome.hidden.iter().map(told).collect();
        text += &format!("\nhidden was: {}\n", told.join("; "));
    }
    text += &format!(
        "\nresults in {}: report.html, estimate.json, fit.json, plots/{}\n",
        out.display(),
        if outcome.simulated.is_some() { ", recordings/" } else { "" }
    );
    text
}

/// What pre-compensation by wrong models does.
fn sensitivity_table(result: &SensitivityResult) -> String {
    let low = format!("max < {} Hz", result.low_band_hz[1]);
    let head = ["pre-compensation by", "coherence max", "mean", &low, "simulated max", "force rms", "K direct %", "K derived %", "B direct %", "B derived %"];
    let rows = result.rows.iter().map(|row| {
        let mut cells = vec![row.model.clone()];
        cells.extend([row.coherence.max, row.coherence.mean, row.coherence_low_max].map(|v| format!("{v:.4}")));
        if let Some(s) = &row.simulated {
            cells.push(format!("{:.4}", s.coherence.max));
            cells.push(short(Some(s.force_rms)));
            cells.extend([s.direct.K, s.derived.K, s.direct.B, s.derived.B].map(|share| share.map_or_else(|| "–".to_owned(), |v| format!("{:.2}", 100.0 * v))));
        }
        cells
    });
    format!("\n{}", headed(&head, rows))
}
