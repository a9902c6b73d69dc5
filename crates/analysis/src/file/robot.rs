//! A robot's file.

use super::parse::read_text;
use crate::error::AnalysisError;
use ndof_devices::{DeviceError, RobotConfig};
use std::path::Path;

/// Reads the robot of a URDF, MJCF or TOML file, to the link `tip` where its chain has several ends.
///
/// # Errors
/// [`AnalysisError::Read`] if there is no such file, [`AnalysisError::Meaning`] with what it says that is no robot of this program.
pub fn robot(path: &Path, tip: Option<&str>) -> Result<RobotConfig, AnalysisError> {
    let (file, text) = read_text(path)?;
    let meaning = |error: DeviceError, notes: &[String]| match error {
        DeviceError::File { file, what } => AnalysisError::Meaning { file, what },
        other => {
            AnalysisError::Meaning { file: file.clone(), what: std::iter::once(other.to_string()).chain(notes.iter().cloned()).collect::<Vec<_>>().join("; ") }
        }
    };
    let robot = RobotConfig::parse(&file, &text, tip).map_err(|error| meaning(error, &[]))?;
    robot.chain().map_err(|error| meaning(error, &robot.notes))?;
    Ok(robot)
}
