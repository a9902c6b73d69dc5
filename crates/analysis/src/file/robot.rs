//! A robot's file.

use super::parse::read_text;
use crate::error::AnalysisError;
use ndof_devices::RobotConfig;
use std::path::Path;

/// Reads the robot of a URDF, MJCF or TOML file, to the link `tip` where its chain has several ends.
///
/// # Errors
/// [`AnalysisError::Read`] if there is no such file, [`AnalysisError::Device`] with what it says that is no robot of this program.
pub fn robot(path: &Path, tip: Option<&str>) -> Result<RobotConfig, AnalysisError> {
    let (file, text) = read_text(path)?;
    Ok(RobotConfig::parse(&file, &text, tip)?)
}
