//! How recordings are read, which channels are what, and which stretches are used.

use super::channels::Channels;
use crate::error::CliError;
use clap::Args;
use ndof_analysis::options::{not_negative, number, pair};
use ndof_analysis::result::given;
use ndof_analysis::{AnalysisError, MeasuredResponse, RoleNames, Trial, Trials, Trim, axis_of};
use ndof_io::{ColumnsFile, IoError, PrepareError, ReadOptions, ReadRecording, Resample};
use ndof_signal::{Quantity, Recording};
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// How recordings are read. The fields are long options, and the keys of the table `[recordings]` of a study.
#[derive(Clone, Debug, Default, PartialEq, Args, Serialize, Deserialize)]
#[serde(default, rename_all = "kebab-case")]
pub struct Reading {
    #[command(flatten)]
    #[serde(flatten)]
    pub channels: Channels,
    /// Interpolate irregular samples onto a regular grid, at HZ or at the file's median rate
    #[arg(long, value_name = "HZ", num_args = 0..=1, require_equals = true, default_missing_value = "auto", value_parser = resample, help_heading = "Recordings")]
    pub resample: Option<Resample>,
    /// File that names the columns of a table without a header: `[columns]` with lines NAME = { number = K, unit = "N" }
    #[arg(long, value_name = "FILE", value_parser = columns, help_heading = "Recordings")]
    pub columns: Option<ColumnsFile>,
    /// Read only this trial, by name or number, of a file that holds several
    #[arg(long, value_name = "NAME", help_heading = "Recordings")]
    pub trial: Option<String>,
    /// Join a recording of the same trial by another clock; give one for each recording, in their order
    #[arg(long, value_name = "FILE", requires = "align_by", help_heading = "Recordings")]
    pub align: Vec<PathBuf>,
    /// Channel that both recordings have, or its name in each
    #[arg(long, value_name = "CHANNEL[=OTHER]", requires = "align", help_heading = "Recordings")]
    pub align_by: Option<String>,
    /// A recording without load; its mean forces are subtracted
    #[arg(long, value_name = "FILE", help_heading = "Recordings")]
    pub tare: Option<PathBuf>,
    /// Mass of the handle beyond the transducer (kg; kg m² for rotations); its inertial force is subtracted
    #[arg(long, value_name = "KG", value_parser = not_negative, help_heading = "Recordings")]
    pub handle_mass: Option<f64>,
    /// Use the recording from this time on, in seconds
    #[arg(long, value_name = "S", value_parser = number, allow_hyphen_values = true, help_heading = "Recordings")]
    pub start: Option<f64>,
    /// Use the recording up to this time, in seconds
    #[arg(long, value_name = "S", value_parser = number, allow_hyphen_values = true, help_heading = "Recordings")]
    pub stop: Option<f64>,
    /// Leave this stretch out, in seconds; may be given several times
    #[arg(long, value_name = "FROM-TO", value_parser = pair, allow_hyphen_values = true, help_heading = "Recordings")]
    pub exclude: Vec<[f64; 2]>,
}

fn resample(text: &str) -> Result<Resample, String> {
    match text {
        "auto" => Ok(Resample::Auto),
        hz => hz.parse().map(Resample::Hz).map_err(|_| "write --resample, or --resample=HZ with a number".to_owned()),
    }
}

fn columns(text: &str) -> Result<ColumnsFile, String> {
    let path = Path::new(text);
    ndof_io::keep(path);
    let read = std::fs::read_to_string(path).map_err(|source| IoError::Read { file: text.to_owned(), source });
    read.and_then(|toml| ColumnsFile::parse(&toml, text)).map_err(|error| error.to_string())
}

/// Reads a frequency response and what its channels are.
pub fn measured(file: &Path) -> Result<MeasuredResponse, CliError> {
    ndof_io::keep(file);
    Ok(MeasuredResponse::of(&ndof_io::read_response(file)?, &file.display().to_string())?)
}

impl Reading {
    /// The frequency response in place of recordings, where the file is one.
    pub fn response(&self, files: &[PathBuf]) -> Result<Option<MeasuredResponse>, CliError> {
        let held = files.iter().map(|file| ndof_io::holds_response(file)).collect::<Result<Vec<_>, _>>()?;
        match (files, held.contains(&true) && self.channels.sample_rate.is_none()) {
            (_, false) => Ok(None),
            ([file], true) => {
                if let Some(option) = given(self).first() {
                    return Err(CliError::Usage(format!("{} is a frequency response, and --{option} is about recordings; leave it out", file.display())));
                }
                measured(file).map(Some)
            }
            _ => Err(CliError::Usage("a frequency response is fitted alone; give one file, and put fits beside each other with `ndof compare`".to_owned())),
        }
    }

    /// Reads one recording, its channels named and turned.
    pub fn read(&self, path: &Path) -> Result<ReadRecording, CliError> {
        self.read_with(path, &self.options())
    }

    fn options(&self) -> ReadOptions {
        ReadOptions { resample: self.resample, columns: self.columns.clone(), trial: self.trial.clone(), ..self.channels.reading() }
    }

    fn read_with(&self, path: &Path, options: &ReadOptions) -> Result<ReadRecording, CliError> {
        ndof_io::keep(path);
        let mut read = ndof_io::read(path, options)?;
        self.channels.apply(&mut read.recording, &read.file)?;
        Ok(read)
    }

    /// Reads every trial of a file, its channels named and turned.
    fn read_each(&self, path: &Path, options: &ReadOptions) -> Result<Vec<ReadRecording>, CliError> {
        ndof_io::keep(path);
        let mut trials = ndof_io::read_trials(path, options)?;
        trials.iter_mut().try_for_each(|read| self.channels.apply(&mut read.recording, &read.file))?;
        Ok(trials)
    }

    /// Reads a recording and joins `other`, which another clock took, to it.
    fn read_aligned(&self, path: &Path, other: &Path, by: &str) -> Result<ReadRecording, CliError> {
        [path, other].into_iter().for_each(ndof_io::keep);
        // Units are given for the channels of both together.
        let options = ReadOptions { units_elsewhere: true, ..self.options() };
        let (mut read, second) = (ndof_io::read(path, &options)?, ndof_io::read(other, &options)?);
        let both: Vec<String> = read.recording.names().into_iter().chain(second.recording.names()).collect();
        if let Some(name) = options.units.keys().find(|name| !both.contains(name)) {
            return Err(AnalysisError::no_channel(&format!("{} and {}", read.file, second.file), name, both).into());
        }
        let shared = by.split_once('=').unwrap_or((by, by));
        let wrong = |why: PrepareError| CliError::Usage(format!("--align {}: {why} (with {})", other.display(), read.file));
        for (file, recording, name) in [(&read.file, &read.recording, shared.0), (&second.file, &second.recording, shared.1)] {
            if recording.channel(name).is_err() {
                return Err(AnalysisError::no_channel(file, name, recording.names()).into());
            }
        }
        let aligned = ndof_io::align(&read.recording, &second.recording, shared).map_err(wrong)?;
        read.notes.push(aligned.note(&read.file, &second.file, shared.0));
        read.notes.extend(second.notes);
        read.recording = aligned.recording;
        self.channels.apply(&mut read.recording, &read.file)?;
        Ok(read)
    }

    /// The roles that are asked for.
    pub fn roles(&self) -> RoleNames {
        self.channels.roles()
    }

    /// The stretches that are asked for.
    fn trim(&self) -> Trim {
        Trim { start_s: self.start, stop_s: self.stop, exclude_s: self.exclude.clone() }
    }

    /// Reads several recordings, offsets and handle taken off.
    pub fn read_all(&self, files: &[PathBuf]) -> Result<Vec<Trial>, CliError> {
        if !self.align.is_empty() && self.align.len() != files.len() {
            return Err(CliError::Usage(format!(
                "{} recordings and {} files with --align; give --align once for each recording, in their order",
                files.len(),
                self.align.len()
            )));
        }
        let mut trials = Vec::with_capacity(files.len());
        for (k, path) in files.iter().enumerate() {
            let read = match (self.align.get(k), &self.align_by) {
                (Some(other), Some(by)) => vec![self.read_aligned(path, other, by)?],
                _ => self.or_stretches(path, self.read_each(path, &self.options()))?,
            };
            for mut read in read {
                self.correct(&mut read)?;
                trials.push(Trial { file: read.file, recording: read.recording, warnings: read.notes });
            }
        }
        Ok(trials)
    }

    /// Reads one recording, offsets and handle taken off, and cuts out the stretches that are asked for.
    pub fn stretches(&self, path: &Path) -> Result<Vec<Recording>, CliError> {
        let read = match (self.align.as_slice(), &self.align_by) {
            ([], _) => self.or_stretches(path, self.read(path).map(|read| vec![read]))?,
            ([other], Some(by)) => vec![self.read_aligned(path, other, by)?],
            _ => return Err(CliError::Usage("one recording is read here; give --align once".to_owned())),
        };
        let mut stretches = Vec::new();
        for mut read in read {
            self.correct(&mut read)?;
            stretches.extend(self.trim().apply(read.recording, &read.file)?);
        }
        Ok(stretches)
    }

    /// What was read or, where the clock is irregular, the stretches that are asked for.
    fn or_stretches(&self, path: &Path, read: Result<Vec<ReadRecording>, CliError>) -> Result<Vec<ReadRecording>, CliError> {
        match read {
            Err(CliError::Io(error @ (IoError::IrregularTime { .. } | IoError::Gap { .. }))) => self.read_stretches(path, error),
            read => read,
        }
    }

    /// What --start, --stop and --exclude leave of a recording whose clock is irregular elsewhere.
    fn read_stretches(&self, path: &Path, error: IoError) -> Result<Vec<ReadRecording>, CliError> {
        if path.as_os_str() == "-" || self.trim() == Trim::default() {
            return Err(error.into());
        }
        let read = |window| self.read_with(path, &ReadOptions { window_s: Some(window), ..self.options() });
        let (found, empty): (Vec<_>, Vec<_>) =
            self.trim().stretches_s().into_iter().map(read).partition(|read| !matches!(read, Err(CliError::Io(IoError::OneSample { .. }))));
        if found.is_empty() { empty } else { found }.into_iter().collect()
    }

    /// Reads recordings to look at them: what is wrong with their clock becomes a warning.
    pub fn look_at(&self, files: &[PathBuf]) -> Result<Vec<Trial>, CliError> {
        let read = |path: &PathBuf| {
            let mut trials = Vec::new();
            for mut read in self.read_each(path, &ReadOptions { any_timing: true, ..self.options() })? {
                self.correct(&mut read)?;
                let stretches = self.trim().apply(read.recording, &read.file)?;
                trials.extend(stretches.into_iter().map(|recording| Trial { file: read.file.clone(), recording, warnings: read.notes.clone() }));
            }
            Ok(trials)
        };
        if self.align.is_empty() {
            let read: Vec<Vec<Trial>> = files.iter().map(read).collect::<Result<_, CliError>>()?;
            Ok(read.into_iter().flatten().collect())
        } else {
            self.read_all(files)
        }
    }

    /// Takes off what lies beyond the transducer.
    fn correct(&self, read: &mut ReadRecording) -> Result<(), CliError> {
        if self.tare.is_none() && self.handle_mass.is_none() {
            return Ok(());
        }
        let of = |quantity: Quantity| -> Vec<String> {
            read.recording.channels().iter().filter(|c| c.unit.quantity() == quantity && !c.name.starts_with("cmd_")).map(|c| c.name.clone()).collect()
        };
        let (efforts, motions) = (of(Quantity::Effort), of(Quantity::Displacement));
        let wrong = |why: PrepareError| CliError::Usage(format!("{}: {why}", read.file));
        let mut recording = read.recording.clone();
        if let Some(path) = &self.tare {
            let names: Vec<&str> = efforts.iter().map(String::as_str).collect();
            let unloaded = self.read(path)?;
            let available = unloaded.recording.names();
            if let Some(name) = names.iter().find(|name| !available.iter().any(|own| own == *name)) {
                return Err(AnalysisError::no_channel(&unloaded.file, name, available).into());
            }
            let wrong = |why: PrepareError| CliError::Usage(format!("--tare {}: {why}", unloaded.file));
            recording = ndof_io::tare(&recording, &unloaded.recording, &names).map_err(wrong)?;
        }
        if let Some(mass) = self.handle_mass {
            for effort in &efforts {
                if let Some(motion) = motions.iter().find(|motion| axis_of(motion) == axis_of(effort)) {
                    let note;
                    (recording, note) = ndof_io::without_handle(&recording, effort, motion, mass).map_err(wrong)?;
                    read.notes.extend(note);
                }
            }
        }
        read.recording = recording;
        Ok(())
    }

    /// Reads trials of one experiment, with roles and stretches.
    pub fn trials(&self, files: &[PathBuf]) -> Result<Trials, CliError> {
        self.trials_with(files, &[])
    }

    /// The same with channels that are kept though they have no role.
    pub fn trials_with(&self, files: &[PathBuf], kept: &[String]) -> Result<Trials, CliError> {
        let names = RoleNames { kept: kept.to_vec(), ..self.roles() };
        Ok(Trials::new(self.read_all(files)?, &names, &self.trim())?)
    }

    /// The same of what a simulator logged.
    pub fn simulated_with(&self, files: &[PathBuf], kept: &[String]) -> Result<Trials, CliError> {
        let names = RoleNames { kept: kept.to_vec(), ..self.roles() };
        Ok(Trials::simulated(self.read_all(files)?, &names, &self.trim())?)
    }
}
