//! A serial robot as data.

use serde::{Deserialize, Serialize};

/// How a joint moves.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum JointKind {
    /// It turns about its axis.
    #[default]
    Revolute,
    /// It slides along its axis.
    Prismatic,
}

/// A joint and the body that it moves; lengths in m, angles in rad, and for prismatic joints N in place of N m.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct JointConfig {
    /// Its name.
    pub name: String,
    /// Turning or sliding.
    #[serde(default)]
    pub kind: JointKind,
    /// Direction in the joint's own frame.
    #[serde(default = "z_axis")]
    pub axis: [f64; 3],
    /// Origin of the joint in the frame of the body before it (m).
    #[serde(default)]
    pub origin_m: [f64; 3],
    /// Its orientation there: roll, pitch, yaw about the fixed axes x, y, z (rad).
    #[serde(default)]
    pub origin_rpy_rad: [f64; 3],
    /// Mass of the body (kg).
    #[serde(default)]
    pub mass_kg: f64,
    /// Centre of mass in the joint's frame (m).
    #[serde(default)]
    pub centre_m: [f64; 3],
    /// xx, yy, zz, xy, xz, yz of the inertia about the centre of mass (kg m²).
    #[serde(default)]
    pub inertia_kg_m2: [f64; 6],
    /// Motor turns for one turn of the joint.
    #[serde(default = "one")]
    pub gear_ratio: f64,
    /// Inertia of the rotor on the motor's side (kg m²).
    #[serde(default)]
    pub rotor_inertia_kg_m2: f64,
    /// Dry friction at the joint (N m).
    #[serde(default)]
    pub coulomb_nm: f64,
    /// Time by which dry friction turns before the joint does (s), as a simulator's that makes it a soft constraint: 1/b of MuJoCo's `solreffriction`.
    #[serde(default, skip_serializing_if = "nothing")]
    pub friction_ahead_s: f64,
    /// How soft that constraint is beside the joint's inertia, R/A in MuJoCo: (1 − d)/d of its `solimpfriction`.
    #[serde(default, skip_serializing_if = "nothing")]
    pub friction_softness: f64,
    /// Viscous friction at the joint (N m s/rad).
    #[serde(default)]
    pub viscous_nm_s_per_rad: f64,
    /// Stiffness of a spring at the joint (N m/rad): [`SerialChain::springs`](crate::SerialChain::springs); the simulation has none and refuses it.
    #[serde(default, skip_serializing_if = "nothing")]
    pub stiffness_nm_per_rad: f64,
    /// Where that spring rests (rad).
    #[serde(default, skip_serializing_if = "nothing")]
    pub spring_rest_rad: f64,
    /// Largest torque at the joint (N m).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub torque_limit_nm: Option<f64>,
    /// Largest rate (rad/s), which a design of motions keeps.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rate_limit_rad_per_s: Option<f64>,
    /// Range of the joint.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub range_rad: Option<[f64; 2]>,
    /// Where it stands at home.
    #[serde(default)]
    pub home_rad: f64,
}

fn z_axis() -> [f64; 3] {
    [0.0, 0.0, 1.0]
}

#[allow(clippy::trivially_copy_pass_by_ref, reason = "serde asks for a reference")]
fn nothing(value: &f64) -> bool {
    *value == 0.0
}

fn one() -> f64 {
    1.0
}

/// The end effector, where the limb is fastened.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct EndEffectorConfig {
    /// Its place in the last joint's frame (m).
    pub translation_m: [f64; 3],
}

/// The force transducer and its electronics; what is left out is chosen stiff enough for the robot.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct TransducerConfig {
    /// Stiffness (N/m, N m/rad).
    pub stiffness: Option<f64>,
    /// Damping (N s/m, N m s/rad).
    pub damping: Option<f64>,
    /// Noise (N rms, N m rms).
    pub noise_rms: Option<f64>,
    /// Resolution (N, N m).
    pub quantum: Option<f64>,
    /// Largest force that it shows on an axis (N, N m).
    pub range: Option<f64>,
}

/// The hold's default gains.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct HoldConfig {
    /// Stiffness (N/m, N m/rad).
    pub kp: Option<f64>,
    /// Damping (N s/m, N m s/rad).
    pub kd: Option<f64>,
    /// Largest commanded force (N, N m).
    pub force_limit: Option<f64>,
}

/// A serial robot: `schema = "ndof/robot/1"`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RobotConfig {
    /// `ndof/robot/1`.
    pub schema: String,
    /// What to call it.
    pub name: String,
    /// Coordinates of the end effector that are commanded and measured: some of x, y, z. Without, the joints themselves are.
    #[serde(default)]
    pub axes: Vec<String>,
    /// Gravity in the base's frame (m/s²).
    #[serde(default = "downward")]
    pub gravity_m_per_s2: [f64; 3],
    /// From the base outwards.
    pub joints: Vec<JointConfig>,
    /// Where the limb is fastened.
    #[serde(default)]
    pub end_effector: EndEffectorConfig,
    /// The force transducer.
    #[serde(default)]
    pub transducer: TransducerConfig,
    /// The hold.
    #[serde(default)]
    pub hold: HoldConfig,
    /// Ends of a URDF or MJCF that all stand still on the last body, where none was named: for its joints any will do, for axes at the tip one has to
    /// be chosen.
    #[serde(skip)]
    pub ends: Vec<String>,
    /// Joints of a URDF or MJCF that hang on the chain and are not in it.
    #[serde(skip)]
    pub held: Vec<String>,
    /// What a URDF or MJCF has that is not read, or read otherwise than it says, in sentences.
    #[serde(skip)]
    pub notes: Vec<String>,
}

fn downward() -> [f64; 3] {
    [0.0, 0.0, -9.81]
}
