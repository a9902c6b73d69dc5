//! Corrections written back into the file of a robot.

use super::config::RobotConfig;
use super::correction::{Correction, check};
use super::edits::{Edits, one_line};
use super::{toml_edit, xml, xml_edit};
use crate::error::DeviceError;

/// A robot's file with corrections in it.
#[derive(Clone, Debug, PartialEq)]
pub struct Written {
    /// The whole file.
    pub text: String,
    /// What changed, as a unified diff under the reasons.
    pub patch: String,
    /// Sentences about what the format has no word for.
    pub left_out: Vec<String>,
}

/// Writes corrections into the text of a robot's `file`: URDF, MJCF or TOML. Comments, order and format of everything else stay; a comment before each change
/// says why. Where several links make up a body, that of its joint takes the difference, so that the whole is right.
///
/// # Errors
/// [`DeviceError::File`] that names a joint that is not there, a number that cannot be, or a body that no masses make.
///
/// ```
/// use ndof_devices::{Corrected, Correction, write_back};
///
/// let text = r#"<robot name="arm">
///   <link name="base"/><link name="upper"><inertial><mass value="1"/><inertia ixx="0.1" iyy="0.1" izz="0.1"/></inertial></link>
///   <joint name="shoulder" type="continuous"><parent link="base"/><child link="upper"/><dynamics damping="0.1"/></joint>
/// </robot>"#;
/// let less = Correction { joint: "shoulder".into(), what: Corrected::Viscous, value: 0.06, why: "0.06 ± 0.01 in ten trials".into() };
/// let written = write_back("arm.urdf", text, &[less])?;
/// assert!(written.text.contains(r#"<!-- 0.06 ± 0.01 in ten trials -->"#) && written.text.contains(r#"damping="0.06""#));
/// # Ok::<(), ndof_devices::DeviceError>(())
/// ```
pub fn write_back(file: &str, text: &str, corrections: &[Correction]) -> Result<Written, DeviceError> {
    write_back_chain(file, text, &[], corrections)
}

/// [`write_back`] for a chain of some of a robot's joints: what others carry is part of the body on which they hang.
///
/// # Errors
/// As there.
pub fn write_back_chain(file: &str, text: &str, chain: &[String], corrections: &[Correction]) -> Result<Written, DeviceError> {
    let wrong = |what: String| DeviceError::File { file: file.to_owned(), what };
    corrections.iter().try_for_each(check).map_err(wrong)?;
    let (mut edits, mut left_out) = (Edits::new(text), Vec::new());
    if text.trim_start().starts_with('<') {
        let root = xml::parse(text).map_err(wrong)?;
        xml_edit::into_xml(&root, chain, corrections, &mut edits, &mut left_out).map_err(wrong)?;
    } else {
        let config = RobotConfig::parse(file, text, None)?;
        toml_edit::into_toml(text, config, corrections, &mut edits, &mut left_out).map_err(wrong)?;
    }
    let text = edits.applied();
    let reasons: String = corrections.chunk_by(|a, b| a.why == b.why).map(reason).collect();
    Ok(Written { text, patch: reasons + &edits.patch(file), left_out })
}

/// Corrections for one reason.
fn reason(alike: &[Correction]) -> String {
    let called: Vec<String> = alike.iter().map(Correction::called).collect();
    format!("{}: {}\n", called.join(", "), one_line(&alike[0].why))
}
