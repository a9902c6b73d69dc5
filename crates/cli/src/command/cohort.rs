//! `ndof cohort`.

use crate::error::CliError;
use crate::options::{Analysis, Reading, Shared};
use crate::output::{self, columns};
use crate::progress;
use clap::Args;
use ndof_study::FitSettings;
use ndof_study::file::{self, KinematicsFile};
use ndof_study::result::FitResult;
use rayon::prelude::*;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Fit every subject of a folder: one row each.
///
/// A subject is a folder with its trials, or a single file. Each subject's fit is written as soon as it is done, so a run that
/// was stopped goes on where it was; a subject that fails is a row that says why.
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  ndof cohort subjects --out cohort --band 0.5-8")]
pub struct Arguments {
    /// Folder of subjects
    #[arg(value_name = "DIR")]
    folder: PathBuf,
    /// Folder for the table, cohort.csv, and one result a subject
    #[arg(long, value_name = "DIR", default_value = "ndof-out/cohort")]
    out: PathBuf,
    /// Project endpoint to joint impedance with this arm
    #[arg(long, value_name = "FILE.toml")]
    kinematics: Option<PathBuf>,
    #[command(flatten)]
    reading: Reading,
    #[command(flatten)]
    analysis: Analysis,
    #[command(flatten)]
    shared: Shared,
}

/// Suffixes of the files that are recordings.
const SUFFIXES: [&str; 9] = ["csv", "tsv", "txt", "npz", "mat", "parquet", "h5", "hdf5", "nxs"];

/// A subject with its trials.
struct Subject {
    name: String,
    files: Vec<PathBuf>,
}

pub fn run(arguments: &Arguments) -> Result<ExitCode, CliError> {
    let shared = &arguments.shared;
    shared.apply_threads()?;
    let subjects = subjects(&arguments.folder)?;
    if subjects.is_empty() {
        return Err(CliError::Usage(format!(
            "{}: no folder and no recording in it; give a folder with one folder, or one file, a subject",
            arguments.folder.display()
        )));
    }
    let kinematics = arguments.kinematics.as_deref().map(file::read::<KinematicsFile>).transpose()?;
    let results = arguments.out.join("subjects");
    output::create_folder(&results)?;
    same_settings(&arguments.out.join("settings.txt"), &format!("{:?}\n{:?}\n{:?}\n{kinematics:?}\n", arguments.reading, arguments.analysis, shared.band))?;
    let bars = progress::Steps::new(shared.quiet);
    let done = AtomicUsize::new(0);
    subjects.par_iter().try_for_each(|subject| {
        let (good, bad) = (results.join(format!("{}.json", subject.name)), results.join(format!("{}.error", subject.name)));
        if !good.exists() && !bad.exists() {
            match fit(arguments, kinematics.as_ref(), subject) {
                Ok(result) => output::write_json(&good, &result)?,
                Err(error) => ndof_io::write_atomic(&bad, error.to_string().as_bytes())?,
            }
        }
        bars.show("fit", done.fetch_add(1, Ordering::Relaxed) + 1, subjects.len());
        Ok::<(), CliError>(())
    })?;
    drop(bars);
    let rows = table(&subjects, &results)?;
    let csv: String = rows.iter().map(|row| row.iter().map(|cell| quoted(cell)).collect::<Vec<_>>().join(",") + "\n").collect();
    ndof_io::write_atomic(&arguments.out.join("cohort.csv"), csv.as_bytes())?;
    output::table(shared, &columns(&rows))?;
    Ok(ExitCode::SUCCESS)
}

fn subjects(folder: &Path) -> Result<Vec<Subject>, CliError> {
    let mut subjects = Vec::new();
    for path in entries(folder)? {
        let name = |part: Option<&std::ffi::OsStr>| part.map(|part| part.to_string_lossy().into_owned()).unwrap_or_default();
        if path.is_dir() {
            let files: Vec<PathBuf> = entries(&path)?.into_iter().filter(|file| is_recording(file)).collect();
            if !files.is_empty() {
                subjects.push(Subject { name: name(path.file_name()), files });
            }
        } else if is_recording(&path) {
            subjects.push(Subject { name: name(path.file_stem()), files: vec![path] });
        }
    }
    if let Some(pair) = subjects.windows(2).find(|pair| pair[0].name == pair[1].name) {
        return Err(CliError::Usage(format!("two subjects are called \"{}\"; rename one of them", pair[0].name)));
    }
    Ok(subjects)
}

fn is_recording(path: &Path) -> bool {
    path.extension().is_some_and(|suffix| SUFFIXES.iter().any(|known| suffix.eq_ignore_ascii_case(known)))
}

/// What lies in a folder, by name.
fn entries(folder: &Path) -> Result<Vec<PathBuf>, CliError> {
    let failed = |error: std::io::Error| CliError::Usage(format!("{}: {error}; give a folder of subjects", folder.display()));
    let mut paths = std::fs::read_dir(folder).map_err(failed)?.map(|entry| entry.map(|entry| entry.path())).collect::<Result<Vec<_>, _>>().map_err(failed)?;
    paths.sort();
    Ok(paths)
}

/// Results of other settings are not mixed with these.
fn same_settings(path: &Path, settings: &str) -> Result<(), CliError> {
    match std::fs::read_to_string(path) {
        Ok(before) if before != settings => {
            Err(CliError::Usage(format!("{}: the results here were made with other options; give another --out, or remove this folder", path.display())))
        }
        Ok(_) => Ok(()),
        Err(_) => Ok(ndof_io::write_atomic(path, settings.as_bytes())?),
    }
}

fn fit(arguments: &Arguments, kinematics: Option<&KinematicsFile>, subject: &Subject) -> Result<FitResult, CliError> {
    let trials = arguments.reading.trials(&subject.files)?;
    let settings = arguments.analysis.settings(&arguments.shared);
    let estimated = ndof_study::estimate(&trials, &settings, "cohort")?;
    let fit_settings = FitSettings {
        band_hz: arguments.shared.band.map(|(low, high)| [low, high]),
        estimator: settings.estimator,
        kinematics: kinematics.cloned(),
        ..FitSettings::default()
    };
    Ok(ndof_study::fit(&trials, &estimated, &fit_settings, "cohort")?.result)
}

/// One row a subject: value and standard error of every parameter, quality, and what went wrong.
fn table(subjects: &[Subject], results: &Path) -> Result<Vec<Vec<String>>, CliError> {
    let mut fits: Vec<(String, Result<FitResult, String>)> = Vec::with_capacity(subjects.len());
    for subject in subjects {
        let path = results.join(format!("{}.json", subject.name));
        let fit = match std::fs::read_to_string(&path) {
            Ok(text) => {
                Ok(serde_json::from_str(&text).map_err(|error| CliError::Usage(format!("{}: {error}; remove it to fit the subject again", path.display())))?)
            }
            Err(_) => Err(std::fs::read_to_string(results.join(format!("{}.error", subject.name))).unwrap_or_else(|error| error.to_string())),
        };
        fits.push((subject.name.clone(), fit));
    }
    let parameters = |fit: &FitResult| fit.parameters.iter().chain(fit.joint.iter().flat_map(|joint| &joint.parameters)).cloned().collect::<Vec<_>>();
    let mut names: Vec<String> = Vec::new();
    for p in fits.iter().filter_map(|(_, fit)| fit.as_ref().ok()).flat_map(&parameters) {
        if !names.contains(&p.name) {
            names.push(p.name.clone());
        }
    }
    let mut rows = vec![vec!["subject".to_owned()]];
    rows[0].extend(names.iter().flat_map(|name| [name.clone(), format!("{name}_std_error")]));
    rows[0].extend(["chi2_reduced", "r2", "error"].map(str::to_owned));
    let cell = |value: Option<f64>| value.map(|v| v.to_string()).unwrap_or_default();
    for (subject, fit) in &fits {
        let mut row = vec![subject.clone()];
        match fit {
            Ok(fit) => {
                let own = parameters(fit);
                for name in &names {
                    let p = own.iter().find(|p| p.name == *name);
                    row.extend([cell(p.and_then(|p| p.value)), cell(p.and_then(|p| p.std_error))]);
                }
                row.extend([cell(fit.chi2_reduced), cell(fit.r2), String::new()]);
            }
            Err(error) => {
                row.extend(std::iter::repeat_n(String::new(), 2 * names.len() + 2));
                row.push(error.replace('\n', " "));
            }
        }
        rows.push(row);
    }
    Ok(rows)
}

/// A cell as CSV writes it.
fn quoted(cell: &str) -> String {
    if cell.contains([',', '"']) { format!("\"{}\"", cell.replace('"', "\"\"")) } else { cell.to_owned() }
}
