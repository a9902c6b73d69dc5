//! What the channels of a recording are.

use crate::error::CliError;
use clap::Args;
use ndof_analysis::file::{self, ChannelsFile};
use ndof_analysis::options::positive;
use ndof_analysis::{AnalysisError, RoleNames};
use ndof_io::ReadOptions;
use ndof_signal::Recording;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// What the channels of a recording are.
#[derive(Clone, Debug, Default, PartialEq, Args, Serialize, Deserialize)]
#[serde(default, rename_all = "kebab-case")]
pub struct Channels {
    /// Sample rate of files that do not say it
    #[arg(long, value_name = "HZ", value_parser = positive, help_heading = "Recordings")]
    pub sample_rate: Option<f64>,
    /// New names for columns: NEW=OLD pairs, such as force_x=Fx,pos_x="x [mm]", or a file with [channels] and [transform]
    #[arg(long, value_name = "NEW=OLD,…|FILE.toml", value_parser = channels_file, help_heading = "Recordings")]
    pub channels: Option<ChannelsFile>,
    /// Commanded perturbations; `none` for the direct estimate alone [default: channels cmd_…]
    #[arg(long, value_name = "CHANNELS", value_delimiter = ',', help_heading = "Recordings")]
    pub reference: Option<Vec<String>>,
    /// Inputs [default: channels force_… and torque_…]
    #[arg(long, value_name = "CHANNELS", value_delimiter = ',', help_heading = "Recordings")]
    pub input: Option<Vec<String>>,
    /// Outputs [default: channels pos_… and angle_…, else vel_…, else acc_…]
    #[arg(long, value_name = "CHANNELS", value_delimiter = ',', help_heading = "Recordings")]
    pub output: Option<Vec<String>>,
    /// Change the sign of these channels, for example of a transducer that measures the reaction
    #[arg(long, value_name = "CHANNELS", value_delimiter = ',', help_heading = "Recordings")]
    pub negate: Vec<String>,
}

/// Pairs, or the file of that name.
fn channels_file(text: &str) -> Result<ChannelsFile, String> {
    let read = || {
        if text.contains('=') && !Path::new(text).exists() {
            return ChannelsFile::from_pairs(text);
        }
        ndof_io::keep(Path::new(text));
        let file: ChannelsFile = file::read(Path::new(text))?;
        file.check(text)?;
        Ok(file)
    };
    read().map_err(|error: AnalysisError| error.to_string())
}

impl Channels {
    /// How a file with these channels is read.
    pub fn reading(&self) -> ReadOptions {
        let (units, time) = self.channels.as_ref().map(|channels| (channels.units(), channels.time())).unwrap_or_default();
        ReadOptions { sample_rate_hz: self.sample_rate, allow_nan: true, units, time, ..ReadOptions::default() }
    }

    /// Turns what was recorded into what the analysis needs; `file` names it in errors.
    pub fn apply(&self, recording: &mut Recording, file: &str) -> Result<(), CliError> {
        if let Some(channels) = &self.channels {
            *recording = channels.apply(recording, file)?;
        }
        for name in &self.negate {
            let available = recording.names();
            recording.map_channel(name, |sample| -sample).map_err(|_| AnalysisError::no_channel(file, name, available))?;
        }
        Ok(())
    }

    /// The roles that are asked for.
    pub fn roles(&self) -> RoleNames {
        let none = |names: &[String]| matches!(names, [name] if name == "none");
        let references = self.reference.as_ref().map(|names| if none(names) { Vec::new() } else { names.clone() });
        RoleNames { references, inputs: self.input.clone(), outputs: self.output.clone(), ..RoleNames::default() }
    }
}
