//! A study of recordings as a file.

use super::Reading;
use crate::error::CliError;
use clap::Args;
use ndof_analysis::file::{self, KinematicsFile};
use ndof_analysis::{Diagnose, Fit, HeldOut, did_you_mean, nearest};
use ndof_study::file::{StudyDocument, StudyFile};
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::path::{Path, PathBuf};

/// The table `[recordings]` of a study, in place of `[experiment]`: which they are, and how they are read.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "toml::Table")]
pub struct Recordings {
    /// As seen from the study's folder.
    pub files: Vec<PathBuf>,
    #[serde(flatten)]
    pub reading: Reading,
}

impl Recordings {
    /// The study of a file, with the paths of its recordings as seen from here; `None` where it is one of what is simulated.
    pub fn study(path: &Path) -> Result<Option<StudyDocument<Self>>, CliError> {
        let (file, text) = file::read_text(path)?;
        let Some(mut study) = StudyDocument::of_recordings(&text, &file)? else { return Ok(None) };
        let folder = path.parent().unwrap_or_else(|| Path::new("")).to_owned();
        change_paths(&mut study, |path| folder.join(path));
        ndof_io::keep(path);
        Ok(Some(study))
    }

    /// Writes what was asked for, so that `ndof study PATH` gives the same numbers: what has its default is left out, and paths are as seen
    /// from the file's folder where they lie in it.
    pub fn write(mut study: StudyDocument<Self>, path: &Path) -> Result<(), CliError> {
        let absolute = |path: &Path| std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
        let folder = absolute(path).parent().map(Path::to_owned).unwrap_or_default();
        change_paths(&mut study, |path| {
            let path = absolute(path);
            path.strip_prefix(&folder).map(Path::to_owned).unwrap_or(path)
        });
        study.schema = Some(StudyFile::SCHEMA.to_owned());
        let fit = Fit { kinematics: study.fit.kinematics.as_ref().map(|_| KinematicsFile::default()), ..Fit::default() };
        let plain = StudyDocument::<Self> { fit, diagnose: study.diagnose.as_ref().map(|_| Diagnose::default()), ..StudyDocument::default() };
        let unwritten = |why: String| CliError::Usage(format!("--study {}: {why}", path.display()));
        let mut value = serde_json::to_value(&study).map_err(|error| unwritten(error.to_string()))?;
        without(&mut value, &serde_json::to_value(&plain).map_err(|error| unwritten(error.to_string()))?);
        if let Some(study) = value.as_object_mut() {
            let recordings = study.remove("experiment").unwrap_or_default();
            study.insert("recordings".to_owned(), recordings);
        }
        let text = toml::to_string(&value).map_err(|error| unwritten(error.to_string()))?;
        Ok(ndof_io::write_atomic(path, text.as_bytes())?)
    }
}

/// Changes every path of a recording.
fn change_paths(study: &mut StudyDocument<Recordings>, change: impl Fn(&Path) -> PathBuf) {
    let Recordings { files, reading } = &mut study.experiment;
    for path in files.iter_mut().chain(&mut reading.align).chain(&mut reading.tare) {
        *path = change(path);
    }
    if let Some(Diagnose { held_out: HeldOut::Files(files), .. }) = &mut study.diagnose {
        files.iter_mut().for_each(|file| *file = change(Path::new(file)).display().to_string());
    }
}

/// serde knows neither keys nor lines of what it flattens, so each key is read alone.
impl TryFrom<toml::Table> for Recordings {
    type Error = String;

    fn try_from(mut table: toml::Table) -> Result<Self, String> {
        let files: Option<Vec<PathBuf>> =
            table.remove("files").map(toml::Value::try_into).transpose().map_err(|error| format!("files: {}", error.message()))?;
        let files = files.filter(|files| !files.is_empty()).ok_or("[recordings] has no files; write files = [\"trial-1.csv\"]")?;
        let options = Reading::augment_args(clap::Command::new(""));
        let known: Vec<&str> = options.get_arguments().filter_map(clap::Arg::get_long).collect();
        for (key, value) in &table {
            if !known.contains(&key.as_str()) {
                let meant = did_you_mean(nearest(key, known.iter().copied()).as_deref());
                return Err(format!("[recordings] has no \"{key}\"{meant}; it takes `files` and the options of recordings by their long names"));
            }
            let alone = toml::Table::from_iter([(key.clone(), value.clone())]).try_into::<Reading>();
            alone.map_err(|error| format!("[recordings] {key}: {}", error.message()))?;
        }
        Ok(Recordings { files, reading: table.try_into().map_err(|error: toml::de::Error| error.message().to_owned())? })
    }
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
