//! A robot's file.

use crate::error::AnalysisError;
use ndof_devices::RobotConfig;
use std::path::Path;

/// Reads the robot of a URDF, MJCF or TOML file, to the link `tip` where its chain has several ends.
///
/// # Errors
/// [`AnalysisError::Read`] if there is no such file, [`AnalysisError::Device`] with what it says that is no robot of this program.
pub fn robot(path: &Path, tip: Option<&str>) -> Result<RobotConfig, AnalysisError> {
    let file = path.display().to_string();
    let text = std::fs::read_to_string(path).map_err(|source| AnalysisError::Read { file: file.clone(), source })?;
    Ok(RobotConfig::parse(&file, &text, tip)?)
}
