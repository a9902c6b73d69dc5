//! `ndof cohort`.

use crate::error::CliError;
use crate::options::{Limb, Reading, Shared};
use crate::output::{self, columns, short};
use crate::progress::Progress;
use clap::Args;
use ndof_analysis::fit::result::FitResult;
use ndof_analysis::{AnalysisError, Estimate, Fit};
use ndof_io::{IoError, ResultColumn};
use ndof_study::file::KinematicsFile;
use rayon::prelude::*;
use std::hash::{DefaultHasher, Hasher};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};

/// Fit every subject of a folder: one row each.
///
/// A subject is a folder with its trials, or a single file. Each subject's fit is written as soon as it is done, so a run that
/// was stopped goes on where it was. A subject whose files have changed is fitted again. A subject that fails has a row that says why.
/// The table is cohort.csv, and cohort.parquet in a build with that feature.
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  ndof cohort subjects --out cohort --band 0.5-8")]
pub struct Arguments {
    /// Folder of subjects
    #[arg(value_name = "DIR")]
    folder: PathBuf,
    /// Folder for the table, cohort.csv, and one result a subject
    #[arg(long, value_name = "DIR", default_value = "ndof-out/cohort")]
    out: PathBuf,
    #[command(flatten)]
    fit: Fit,
    #[command(flatten)]
    limb: Limb,
    #[command(flatten)]
    reading: Reading,
    #[command(flatten, next_help_heading = "Estimate")]
    estimate: Estimate,
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

pub fn run(arguments: &Arguments) -> Result<(), CliError> {
    let shared = &arguments.shared;
    shared.apply_threads()?;
    let subjects = subjects(&arguments.folder)?;
    if subjects.is_empty() {
        return Err(CliError::Usage(format!(
            "{}: no folder and no recording in it; give a folder with one folder, or one file, a subject",
            arguments.folder.display()
        )));
    }
    let kinematics = arguments.limb.read()?;
    let results = arguments.out.join("subjects");
    let sources = arguments.out.join("sources");
    for folder in [&results, &sources] {
        output::create_folder(folder)?;
        remove_leftovers(folder)?;
    }
    same_settings(&arguments.out.join("settings.txt"), &settings(arguments, kinematics.as_ref()))?;
    let bars = Progress::steps(shared.quiet);
    let done = AtomicUsize::new(0);
    subjects.par_iter().try_for_each(|subject| {
        let (good, bad) = (results.join(format!("{}.json", subject.name)), results.join(format!("{}.error", subject.name)));
        let (source, now) = (sources.join(&subject.name), contents(&subject.files));
        if !(good.exists() || bad.exists()) || std::fs::read_to_string(&source).ok() != now {
            let done = fit(arguments, kinematics.as_ref(), subject);
            // What was made of other files goes before the new files are named, so that a run that is killed here leaves nothing stale.
            remove(&good)?;
            remove(&bad)?;
            ndof_io::write_atomic(&source, now.unwrap_or_default().as_bytes())?;
            match done {
                Ok(result) => output::write_json(&good, &result)?,
                Err(error) => ndof_io::write_atomic(&bad, error.to_string().as_bytes())?,
            }
        }
        bars.show("fit", done.fetch_add(1, Ordering::Relaxed) + 1, subjects.len());
        Ok::<(), CliError>(())
    })?;
    drop(bars);
    let table = table(&subjects, &results)?;
    ndof_io::write_results_csv(&arguments.out.join("cohort.csv"), &table)?;
    ndof_io::write_results_parquet(&arguments.out.join("cohort.parquet"), &table)?;
    output::table(shared, &printed(&table))
}

/// The table for people.
fn printed(table: &[(String, ResultColumn)]) -> String {
    let mut rows = vec![table.iter().map(|(name, _)| name.clone()).collect::<Vec<_>>()];
    let count = table.iter().map(|(_, column)| if let ResultColumn::Texts(texts) = column { texts.len() } else { 0 }).max().unwrap_or(0);
    for row in 0..count {
        let cell = |column: &ResultColumn| match column {
            ResultColumn::Numbers(values) => short(values.get(row).copied().flatten()),
            ResultColumn::Texts(values) => values.get(row).cloned().flatten().unwrap_or_default(),
        };
        rows.push(table.iter().map(|(_, column)| cell(column)).collect());
    }
    columns(&rows)
}

/// Takes away what a run that was killed in the middle of writing has left.
fn remove_leftovers(folder: &Path) -> Result<(), CliError> {
    let leftover = |path: &Path| path.file_name().is_some_and(|name| name.to_string_lossy().starts_with(".ndof-") && name.to_string_lossy().ends_with(".tmp"));
    for path in entries(folder)?.into_iter().filter(|path| leftover(path)) {
        std::fs::remove_file(&path).map_err(|source| CliError::Machine { what: format!("removing {}", path.display()), source })?;
    }
    Ok(())
}

/// Names and contents of files, the latter as a number that changes with them; times are not asked, because clocks jump.
fn contents(files: &[PathBuf]) -> Option<String> {
    let mut text = String::new();
    for file in files {
        let mut hasher = DefaultHasher::new();
        hasher.write(&std::fs::read(file).ok()?);
        text += &format!("{} {:016x}\n", file.display(), hasher.finish());
    }
    Some(text)
}

/// Removes a file that may not be there.
fn remove(path: &Path) -> Result<(), CliError> {
    match std::fs::remove_file(path) {
        Err(source) if source.kind() != std::io::ErrorKind::NotFound => Err(CliError::Machine { what: format!("removing {}", path.display()), source }),
        _ => Ok(()),
    }
}

fn subjects(folder: &Path) -> Result<Vec<Subject>, CliError> {
    let mut subjects = Vec::new();
    for path in entries(folder)? {
        let name = |part: Option<&std::ffi::OsStr>| part.map(|part| part.to_string_lossy().into_owned()).unwrap_or_default();
        if path.is_dir() {
            let files: Vec<PathBuf> = entries(&path)?.into_iter().filter(|file| is_recording(file)).collect();
            subjects.push(Subject { name: name(path.file_name()), files });
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
    let failed = |source: std::io::Error| CliError::Io(IoError::Read { file: folder.display().to_string(), source });
    let mut paths = std::fs::read_dir(folder).map_err(failed)?.map(|entry| entry.map(|entry| entry.path())).collect::<Result<Vec<_>, _>>().map_err(failed)?;
    paths.sort();
    Ok(paths)
}

/// All that results depend on beside the files.
fn settings(arguments: &Arguments, kinematics: Option<&KinematicsFile>) -> String {
    let Arguments { fit, reading, estimate, shared, .. } = arguments;
    format!("{reading:?}\n{estimate:?}\n{fit:?}\n{:?}\n{kinematics:?}\n", shared.band)
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
    if subject.files.is_empty() {
        return Err(AnalysisError::NoRecording.into());
    }
    let trials = arguments.reading.trials(&subject.files)?;
    let fit = Fit { band_hz: arguments.shared.band, kinematics: kinematics.cloned(), ..arguments.fit.clone() };
    let estimated = ndof_analysis::estimate_to_fit(&trials, &arguments.shared.estimate(&arguments.estimate), &fit)?;
    let mut result = fit.run(&estimated)?.result;
    result.head.command = "cohort".to_owned();
    Ok(result)
}

/// One row a subject: value and standard error of every parameter, quality, what its fit warns of, and what went wrong.
fn table(subjects: &[Subject], results: &Path) -> Result<Vec<(String, ResultColumn)>, CliError> {
    let mut fits: Vec<Result<FitResult, String>> = Vec::with_capacity(subjects.len());
    for subject in subjects {
        let path = results.join(format!("{}.json", subject.name));
        fits.push(match std::fs::read_to_string(&path) {
            Ok(text) => {
                Ok(serde_json::from_str(&text).map_err(|error| CliError::Usage(format!("{}: {error}; remove it to fit the subject again", path.display())))?)
            }
            Err(_) => Err(std::fs::read_to_string(results.join(format!("{}.error", subject.name))).unwrap_or_else(|error| error.to_string())),
        });
    }
    let mut names: Vec<String> = Vec::new();
    for p in fits.iter().flatten().flat_map(FitResult::all_parameters) {
        if !names.contains(&p.name) {
            names.push(p.name.clone());
        }
    }
    let numbers = |value: &dyn Fn(&FitResult) -> Option<f64>| ResultColumn::Numbers(fits.iter().map(|fit| fit.as_ref().ok().and_then(value)).collect());
    let mut columns = vec![("subject".to_owned(), ResultColumn::Texts(subjects.iter().map(|subject| Some(subject.name.clone())).collect()))];
    for name in &names {
        let of = |fit: &FitResult| fit.all_parameters().find(|p| p.name == *name).cloned();
        columns.push((name.clone(), numbers(&|fit| of(fit)?.value)));
        columns.push((format!("{name}_std_error"), numbers(&|fit| of(fit)?.std_error)));
    }
    columns.push(("chi2_reduced".to_owned(), numbers(&|fit| fit.chi2_reduced)));
    columns.push(("r2".to_owned(), numbers(&|fit| fit.r2)));
    let warnings = |fit: &FitResult| fit.head.warnings.iter().map(|warning| warning.code.as_str()).collect::<Vec<_>>().join(" ");
    let warned = fits.iter().map(|fit| fit.as_ref().ok().map(&warnings).filter(|codes| !codes.is_empty())).collect();
    columns.push(("warnings".to_owned(), ResultColumn::Texts(warned)));
    columns.push(("error".to_owned(), ResultColumn::Texts(fits.into_iter().map(|fit| fit.err().map(|error| error.replace('\n', " "))).collect())));
    Ok(columns)
}
