//! `ndof/kinematics/1`: where the joints are.

use super::parse::check_schema;
use crate::error::AnalysisError;
use serde::{Deserialize, Serialize};

/// How joints move the endpoint.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct KinematicsFile {
    /// What errors call it; empty for the table `[kinematics]` of a study.
    #[serde(skip)]
    pub origin: String,
    /// `ndof/kinematics/1`.
    pub schema: Option<String>,
    /// `planar-two-link`, `wrist` or `jacobian`.
    pub kind: String,
    /// `right` (elbow angle positive) or `left`.
    pub arm: Option<String>,
    /// Upper arm and forearm.
    pub link_lengths_m: Option<Vec<f64>>,
    /// Joint angles; of a wrist those of the robot.
    pub posture_rad: Option<Vec<f64>>,
    /// Where the shoulder is, with `hand_m` in place of joint angles.
    pub shoulder_m: Option<Vec<f64>>,
    /// Where the hand is.
    pub hand_m: Option<Vec<f64>>,
    /// Endpoint rows, joint columns, of kind `jacobian`.
    pub matrix: Option<Vec<Vec<f64>>>,
    /// Mass of hand and handle beyond the torque sensor, whose weight adds to the stiffness of a wrist.
    #[serde(default)]
    pub hand_mass_kg: f64,
    /// Its centre from the wrist, in the hand's frame.
    #[serde(default)]
    pub hand_centre_m: [f64; 3],
    /// Gravity in the robot's frame; [0, 0, -9.81] where absent.
    pub gravity_m_per_s2: Option<[f64; 3]>,
    /// Turn of the forearm, and with it of the anatomical axes, in the robot: roll, pitch, yaw.
    #[serde(default)]
    pub misalignment_rpy_rad: [f64; 3],
    /// Names of the joints; `shoulder`, `elbow` for the planar arm, `pronation`, `flexion`, `abduction` for the wrist.
    pub joints: Option<Vec<String>>,
    /// Mean force on the hand, in newtons or `"measured"`.
    pub mean_force_n: Option<MeanForce>,
    /// Standard deviations of what was measured with a tape.
    #[serde(default)]
    pub sd: KinematicsSd,
}

impl KinematicsFile {
    /// The schema's name.
    pub const SCHEMA: &str = "ndof/kinematics/1";

    /// Checks what the types do not.
    ///
    /// # Errors
    /// [`AnalysisError::Meaning`] in the name of `file`.
    pub fn check(&self, file: &str) -> Result<(), AnalysisError> {
        check_schema(self.schema.as_deref(), Self::SCHEMA, file)?;
        let (planar, wrist, jacobian) = ("planar-two-link", "wrist", "jacobian");
        let sd = &self.sd;
        let said: [(&str, bool, &[&str]); 14] = [
            ("arm", self.arm.is_some(), &[planar]),
            ("link_lengths_m", self.link_lengths_m.is_some(), &[planar]),
            ("shoulder_m", self.shoulder_m.is_some(), &[planar]),
            ("hand_m", self.hand_m.is_some(), &[planar]),
            ("posture_rad", self.posture_rad.is_some(), &[planar, wrist]),
            ("matrix", self.matrix.is_some(), &[jacobian]),
            ("mean_force_n", self.mean_force_n.is_some(), &[planar, jacobian]),
            ("hand_mass_kg", self.hand_mass_kg != 0.0, &[wrist]),
            ("hand_centre_m", self.hand_centre_m != [0.0; 3], &[wrist]),
            ("gravity_m_per_s2", self.gravity_m_per_s2.is_some(), &[wrist]),
            ("misalignment_rpy_rad", self.misalignment_rpy_rad != [0.0; 3], &[wrist]),
            ("sd.link_lengths_m", sd.link_lengths_m != 0.0, &[planar]),
            ("sd.posture_rad", sd.posture_rad != 0.0, &[planar]),
            ("sd.hand_mass_kg and sd.hand_centre_m", sd.hand_mass_kg != 0.0 || sd.hand_centre_m != 0.0, &[wrist]),
        ];
        let known = [planar, wrist, jacobian].contains(&self.kind.as_str());
        match said.iter().find(|(_, given, kinds)| known && *given && !kinds.contains(&self.kind.as_str())) {
            Some((name, ..)) => {
                Err(AnalysisError::Meaning { file: file.to_owned(), what: format!("kind = \"{}\" has no use for {name}; leave it out", self.kind) })
            }
            None => Ok(()),
        }
    }
}

/// The mean force on the hand.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum MeanForce {
    /// Known, axis by axis.
    Known(Vec<f64>),
    /// `"measured"`: the mean of the inputs.
    Word(String),
}

/// Standard deviations of the geometry.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct KinematicsSd {
    /// Of each link's length.
    pub link_lengths_m: f64,
    /// Of each joint angle.
    pub posture_rad: f64,
    /// Of each component of the mean force.
    pub mean_force_n: f64,
    /// Of the hand's mass.
    pub hand_mass_kg: f64,
    /// Of each coordinate of the hand's centre.
    pub hand_centre_m: f64,
}
