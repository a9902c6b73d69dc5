//! The numbers that a robot is described by.

use crate::Status;
use serde::{Deserialize, Serialize};

/// What kind of number it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Meaning {
    /// A length or an angle of the kinematics.
    Geometry,
    /// A mass, a centre of mass, an inertia.
    Inertia,
    /// Friction of a joint.
    Friction,
    /// A limit or a scale that does not show in how the robot moves, or that no recording tells.
    Setting,
}

/// A number of a robot.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RobotParameter {
    /// Its name, unit last: `link_1_m`.
    pub name: String,
    /// Its SI unit.
    pub unit: String,
    /// What it is taken to be.
    pub value: f64,
    /// Whether it may be wrong.
    pub status: Status,
    /// What kind of number it is.
    pub meaning: Meaning,
}

impl RobotParameter {
    /// A nominal number, or a fixed one where it is a setting.
    pub fn new(name: impl Into<String>, unit: &str, value: f64, meaning: Meaning) -> Self {
        let status = if meaning == Meaning::Setting { Status::Fixed } else { Status::Nominal };
        RobotParameter { name: name.into(), unit: unit.to_owned(), value, status, meaning }
    }
}
