//! How recordings are read, which channels are what, and which stretches are used.

use super::pair;
use crate::error::CliError;
use clap::Args;
use ndof_io::{PrepareError, ReadOptions, ReadRecording, Resample};
use ndof_signal::Quantity;
use ndof_study::{RoleNames, StudyError, Trial, Trials, Trim, axis_of, nearest};
use std::path::{Path, PathBuf};

/// How recordings are read.
#[derive(Clone, Debug, Args)]
pub struct Reading {
    /// Sample rate of files that say nothing about time
    #[arg(long, value_name = "HZ", help_heading = "Recordings")]
    pub sample_rate: Option<f64>,
    /// Interpolate irregular time onto a regular grid, of the file's median rate or of HZ
    #[arg(long, value_name = "HZ", num_args = 0..=1, require_equals = true, default_missing_value = "auto", value_parser = resample, help_heading = "Recordings")]
    pub resample: Option<Resample>,
    /// Commanded perturbations [default: channels cmd_…]
    #[arg(long, value_name = "CHANNELS", value_delimiter = ',', help_heading = "Recordings")]
    pub reference: Option<Vec<String>>,
    /// Inputs [default: channels force_… and torque_…]
    #[arg(long, value_name = "CHANNELS", value_delimiter = ',', help_heading = "Recordings")]
    pub input: Option<Vec<String>>,
    /// Outputs [default: channels pos_… and angle_…, else vel_…, else acc_…]
    #[arg(long, value_name = "CHANNELS", value_delimiter = ',', help_heading = "Recordings")]
    pub output: Option<Vec<String>>,
    /// Turn the sign of these channels, such as a transducer that reads the reaction
    #[arg(long, value_name = "CHANNELS", value_delimiter = ',', help_heading = "Recordings")]
    pub negate: Vec<String>,
    /// A recording without load, whose mean forces are taken off
    #[arg(long, value_name = "FILE", help_heading = "Recordings")]
    pub tare: Option<PathBuf>,
    /// Mass of the handle beyond the transducer (kg; kg m² for rotations), whose inertial force is taken off
    #[arg(long, value_name = "KG", help_heading = "Recordings")]
    pub handle_mass: Option<f64>,
    /// Use the recording from this time on, in seconds
    #[arg(long, value_name = "S", allow_hyphen_values = true, help_heading = "Recordings")]
    pub start: Option<f64>,
    /// Use the recording up to this time, in seconds
    #[arg(long, value_name = "S", allow_hyphen_values = true, help_heading = "Recordings")]
    pub stop: Option<f64>,
    /// Leave this stretch out, in seconds; may be given several times
    #[arg(long, value_name = "FROM-TO", value_parser = pair, allow_hyphen_values = true, help_heading = "Recordings")]
    pub exclude: Vec<(f64, f64)>,
}

fn resample(text: &str) -> Result<Resample, String> {
    match text {
        "auto" => Ok(Resample::Auto),
        hz => hz.parse().map(Resample::Hz).map_err(|_| "write --resample, or --resample=HZ with a number".to_owned()),
    }
}

impl Reading {
    /// Reads one recording, signs turned.
    pub fn read(&self, path: &Path) -> Result<ReadRecording, CliError> {
        let options = ReadOptions { sample_rate_hz: self.sample_rate, resample: self.resample, allow_nan: true, ..ReadOptions::default() };
        let mut read = ndof_io::read(path, &options)?;
        for name in &self.negate {
            let available = read.recording.names();
            read.recording.map_channel(name, |sample| -sample).map_err(|_| StudyError::NoChannel {
                file: read.file.clone(),
                name: name.clone(),
                suggestion: nearest(name, available.iter().map(String::as_str)),
                available,
            })?;
        }
        Ok(read)
    }

    /// The roles that are asked for.
    pub fn roles(&self) -> RoleNames {
        RoleNames { references: self.reference.clone(), inputs: self.input.clone(), outputs: self.output.clone() }
    }

    /// Reads several recordings, offsets and handle taken off.
    pub fn read_all(&self, files: &[PathBuf]) -> Result<Vec<Trial>, CliError> {
        files
            .iter()
            .map(|path| {
                let mut read = self.read(path)?;
                self.correct(&mut read)?;
                Ok(Trial { file: read.file, recording: read.recording, warnings: read.notes.into_iter().map(Into::into).collect() })
            })
            .collect()
    }

    /// Takes off what lies beyond the transducer.
    fn correct(&self, read: &mut ReadRecording) -> Result<(), CliError> {
        let of = |quantity: Quantity| -> Vec<String> {
            read.recording.channels().iter().filter(|c| c.unit.quantity() == quantity && !c.name.starts_with("cmd_")).map(|c| c.name.clone()).collect()
        };
        let (efforts, motions) = (of(Quantity::Effort), of(Quantity::Displacement));
        let wrong = |why: PrepareError| CliError::Usage(format!("{}: {why}", read.file));
        let mut recording = read.recording.clone();
        if let Some(path) = &self.tare {
            let names: Vec<&str> = efforts.iter().map(String::as_str).collect();
            recording = ndof_io::tare(&recording, &self.read(path)?.recording, &names).map_err(wrong)?;
        }
        if let Some(mass) = self.handle_mass {
            for effort in &efforts {
                if let Some(motion) = motions.iter().find(|motion| axis_of(motion) == axis_of(effort)) {
                    recording = ndof_io::without_handle(&recording, effort, motion, mass).map_err(wrong)?;
                }
            }
        }
        read.recording = recording;
        Ok(())
    }

    /// Reads trials of one experiment, with roles and stretches.
    pub fn trials(&self, files: &[PathBuf]) -> Result<Trials, CliError> {
        let trim = Trim { start_s: self.start, stop_s: self.stop, exclude_s: self.exclude.clone() };
        let trials = self.read_all(files)?;
        Ok(Trials::new(trials, &self.roles(), &trim)?)
    }
}
