//! `ndof simulate`.

use crate::error::CliError;
use crate::options::Shared;
use crate::output;
use crate::progress::Progress;
use clap::Args;
use ndof_signal::Recording;
use ndof_study::Truth;
use ndof_study::file::{ExperimentFile, StudyFile};
use std::path::{Path, PathBuf};

/// Simulate an experiment: device, limb, controller, sensors and hidden effects to a recording.
///
/// Several trials are written as NAME-1.EXT, NAME-2.EXT …; what was simulated goes into NAME.truth.json.
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  ndof simulate arm --out trial.csv --seed 7")]
pub struct Arguments {
    /// EXPERIMENT.toml, or the name of a built-in study
    experiment: String,
    /// The recording to write; its suffix says the format
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    #[command(flatten)]
    shared: Shared,
}

pub fn run(arguments: &Arguments, studies: &[(&str, &str)]) -> Result<(), CliError> {
    let shared = &arguments.shared;
    shared.apply_threads()?;
    let mut experiment = experiment(&arguments.experiment, studies)?;
    experiment.seed = shared.seed.unwrap_or(experiment.seed);
    let bars = Progress::steps(shared.quiet);
    let simulated = ndof_study::simulate(&experiment, &|what, done, total| bars.show(what, done, total))?;
    let files = write_trials(&arguments.out, &simulated.recordings, &simulated.truth)?;
    output::table(shared, &format!("{}\n", files.iter().map(|f| f.display().to_string()).collect::<Vec<_>>().join("\n")))
}

/// The experiment of a file or of a built-in study.
pub fn experiment(name: &str, studies: &[(&str, &str)]) -> Result<ExperimentFile, CliError> {
    Ok(match built_in(name, studies)? {
        Some((name, text)) => StudyFile::parse(text, name)?.experiment,
        None => StudyFile::experiment_of(Path::new(name))?,
    })
}

/// The built-in study of that name with its text, or nothing where it is the path of a file.
pub fn built_in<'a>(name: &str, studies: &[(&'a str, &'a str)]) -> Result<Option<(&'a str, &'a str)>, CliError> {
    let found = studies.iter().find(|(known, _)| *known == name).copied();
    if found.is_none() {
        let path = Path::new(name);
        if !path.exists() && path.extension().is_none() {
            return Err(CliError::unknown_study(name, studies));
        }
        ndof_io::keep(path);
    }
    Ok(found)
}

/// Writes NAME.EXT, or NAME-1.EXT …, and NAME.truth.json beside; returns the recordings' paths.
pub fn write_trials(out: &Path, recordings: &[Recording], truth: &Truth) -> Result<Vec<PathBuf>, CliError> {
    let files = write_recordings(out, recordings)?;
    output::write_json(&out.with_extension("truth.json"), truth)?;
    Ok(files)
}

/// Writes NAME.EXT, or NAME-1.EXT … where there are several; returns their paths.
pub fn write_recordings(out: &Path, recordings: &[Recording]) -> Result<Vec<PathBuf>, CliError> {
    let stem = out.file_stem().map_or_else(|| "recording".to_owned(), |stem| stem.to_string_lossy().into_owned());
    let extension = out.extension().map_or_else(|| "csv".to_owned(), |extension| extension.to_string_lossy().into_owned());
    let folder = out.parent().unwrap_or_else(|| Path::new(""));
    output::create_folder(folder)?;
    let mut files = Vec::with_capacity(recordings.len());
    for (k, recording) in recordings.iter().enumerate() {
        let name = if recordings.len() == 1 { format!("{stem}.{extension}") } else { format!("{stem}-{}.{extension}", k + 1) };
        let path = folder.join(name);
        ndof_io::write(&path, recording)?;
        files.push(path);
    }
    Ok(files)
}
