//! A study of recordings as a file: which they are, how they are read, and what is asked of them.

use super::Reading;
use crate::error::CliError;
use clap::Args;
use ndof_analysis::file::{KinematicsFile, check_schema, parse};
use ndof_analysis::{AnalysisError, Diagnose, Estimate, Fit, HeldOut, nearest};
use ndof_study::file::StudyFile;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::path::{Path, PathBuf};

/// A study of recordings; one of what is simulated has `[experiment]` in place of `[recordings]`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MeasuredStudy {
    /// `ndof/study/1`.
    #[serde(default)]
    pub schema: Option<String>,
    /// Title of the report.
    #[serde(default)]
    pub title: Option<String>,
    pub recordings: Recorded,
    #[serde(default)]
    pub estimate: Estimate,
    #[serde(default)]
    pub fit: Fit,
    /// Without this table there is no diagnosis.
    #[serde(default)]
    pub diagnose: Option<Diagnose>,
}

/// Recordings, and how they are read.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Recorded {
    /// As seen from the study's folder.
    pub files: Vec<PathBuf>,
    #[serde(flatten)]
    pub reading: Reading,
}

/// Just enough of a study to tell whether it is one of recordings.
#[derive(Deserialize)]
struct Glance {
    recordings: toml::Table,
}

impl MeasuredStudy {
    /// The study of a file, with the paths of its recordings as seen from here; `None` where it is one of what is simulated.
    pub fn read(path: &Path) -> Result<Option<Self>, CliError> {
        let file = path.display().to_string();
        let text = std::fs::read_to_string(path).map_err(|source| AnalysisError::Read { file: file.clone(), source })?;
        let Ok(Glance { recordings }) = toml::from_str(&text) else { return Ok(None) };
        let wrong = |what: String| CliError::from(AnalysisError::Meaning { file: file.clone(), what });
        check_keys(&recordings).map_err(wrong)?;
        let mut study: MeasuredStudy = parse(&text, &file)?;
        check_schema(study.schema.as_deref(), StudyFile::SCHEMA, &file)?;
        if study.recordings.files.is_empty() {
            return Err(wrong("[recordings] has no files; write files = [\"trial-1.csv\"]".to_owned()));
        }
        let folder = path.parent().unwrap_or_else(|| Path::new("")).to_owned();
        study.paths(|path| folder.join(path));
        ndof_io::keep(path);
        Ok(Some(study))
    }

    /// Writes what was asked for, so that `ndof study PATH` gives the same numbers: what has its default is left out, and paths are as seen
    /// from the file's folder where they lie in it.
    pub fn write(mut self, path: &Path) -> Result<(), CliError> {
        let absolute = |path: &Path| std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
        let folder = absolute(path).parent().map(Path::to_owned).unwrap_or_default();
        self.paths(|path| {
            let path = absolute(path);
            path.strip_prefix(&folder).map(Path::to_owned).unwrap_or(path)
        });
        self.schema = Some(StudyFile::SCHEMA.to_owned());
        let fit = Fit { kinematics: self.fit.kinematics.as_ref().map(|_| KinematicsFile::default()), ..Fit::default() };
        let plain = MeasuredStudy { fit, diagnose: self.diagnose.as_ref().map(|_| Diagnose::default()), ..MeasuredStudy::default() };
        let unwritten = |why: String| CliError::Usage(format!("--study {}: {why}", path.display()));
        let mut value = serde_json::to_value(&self).map_err(|error| unwritten(error.to_string()))?;
        without(&mut value, &serde_json::to_value(&plain).map_err(|error| unwritten(error.to_string()))?);
        let text = toml::to_string(&value).map_err(|error| unwritten(error.to_string()))?;
        Ok(ndof_io::write_atomic(path, text.as_bytes())?)
    }

    /// Changes every path of a recording.
    fn paths(&mut self, change: impl Fn(&Path) -> PathBuf) {
        let Recorded { files, reading } = &mut self.recordings;
        for path in files.iter_mut().chain(&mut reading.align).chain(&mut reading.tare) {
            *path = change(path);
        }
        if let Some(Diagnose { held_out: HeldOut::Files(files), .. }) = &mut self.diagnose {
            files.iter_mut().for_each(|file| *file = change(Path::new(file)).display().to_string());
        }
    }
}

/// What is wrong with a key of `[recordings]`, in words: serde knows neither keys nor lines of what it flattens.
fn check_keys(recordings: &toml::Table) -> Result<(), String> {
    let options = Reading::augment_args(clap::Command::new(""));
    let known: Vec<&str> = options.get_arguments().filter_map(clap::Arg::get_long).collect();
    for (key, value) in recordings.iter().filter(|(key, _)| *key != "files") {
        if !known.contains(&key.as_str()) {
            let meant = nearest(key, known.iter().copied()).map(|near| format!(" (did you mean \"{near}\"?)")).unwrap_or_default();
            return Err(format!("[recordings] has no \"{key}\"{meant}; it takes `files` and the options of recordings by their long names"));
        }
        let alone = toml::Table::from_iter([(key.clone(), value.clone())]).try_into::<Reading>();
        alone.map_err(|error| format!("[recordings] {key}: {}", error.message()))?;
    }
    Ok(())
}

/// Leaves out of an object what another has alike, and what is nothing. That there is a diagnosis is said by an empty table.
fn without(value: &mut Value, plain: &Value) {
    let Value::Object(own) = value else { return };
    own.retain(|key, value| {
        let alike = plain.get(key).unwrap_or(&Value::Null);
        without(value, alike);
        value != alike && (key == "diagnose" || value.as_object().is_none_or(|table| !table.is_empty()))
    });
}
