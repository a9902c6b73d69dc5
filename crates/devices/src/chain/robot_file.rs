//! A robot described in a TOML file.

use super::{Link, SerialChain, Space, urdf};
use crate::error::DeviceError;
use crate::matrix::inverse;
use crate::registry::{Device, LoopDefaults};
use crate::robot::{Axis, Joints, Kinematics, Robot};
use crate::transducer::Transducer;
use crate::vector3::{dot, roll_pitch_yaw, scale};
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
    /// Viscous friction at the joint (N m s/rad).
    #[serde(default)]
    pub viscous_nm_s_per_rad: f64,
    /// Largest torque at the joint (N m).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub torque_limit_nm: Option<f64>,
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

fn one() -> f64 {
    1.0
}

/// The end effector, where the limb is fastened.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct EndEffectorConfig {
    /// Its place in the last joint's frame (m).
    #[serde(default)]
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
}

fn downward() -> [f64; 3] {
    [0.0, 0.0, -9.81]
}

/// What an experiment says about a robot in a file.
pub(crate) struct FileChoices<'a> {
    /// Commanded coordinates, in place of the file's.
    pub(crate) axes: Option<&'a [String]>,
    /// The link of a URDF that carries the limb.
    pub(crate) tip: Option<&'a str>,
    /// Home posture, in place of the file's.
    pub(crate) home: Option<&'a [f64]>,
}

/// Reads a robot from the text of a TOML or URDF file called `file`.
pub(crate) fn read_robot(file: &str, text: &str, choices: &FileChoices<'_>) -> Result<Device, DeviceError> {
    let wrong = |what: String| DeviceError::File { file: file.to_owned(), what };
    let mut config = RobotConfig::parse(file, text, choices.tip)?;
    if let Some(axes) = choices.axes {
        config.axes = axes.to_vec();
    }
    if let Some(home) = choices.home {
        if home.len() != config.joints.len() {
            return Err(DeviceError::size("device.home_rad", home.len(), config.joints.len()));
        }
        config.joints.iter_mut().zip(home).for_each(|(joint, home)| joint.home_rad = *home);
    }
    config.build().map_err(|error| match error {
        error @ DeviceError::File { .. } => error,
        error => wrong(error.to_string()),
    })
}

impl RobotConfig {
    /// Refuses another schema, in the name of `file`.
    pub(crate) fn check_schema(&self, file: &str) -> Result<(), DeviceError> {
        match self.schema.as_str() {
            "ndof/robot/1" => Ok(()),
            other => Err(DeviceError::File { file: file.to_owned(), what: format!("schema is \"{other}\", expected \"ndof/robot/1\"") }),
        }
    }

    /// A robot from the text of a TOML or URDF file called `file`; `tip` is the link of a URDF that carries the limb.
    ///
    /// # Errors
    /// [`DeviceError::File`] that says what is wrong and where.
    pub fn parse(file: &str, text: &str, tip: Option<&str>) -> Result<Self, DeviceError> {
        let wrong = |what: String| DeviceError::File { file: file.to_owned(), what };
        if text.trim_start().starts_with('<') {
            return urdf::read(text, tip).map_err(wrong);
        }
        let config: RobotConfig = toml::from_str(text).map_err(|e| wrong(e.to_string()))?;
        config.check_schema(file)?;
        Ok(config)
    }

    /// The chain, its transducer and its hold.
    ///
    /// # Errors
    /// [`DeviceError`] that names the joint and the number.
    pub fn build(&self) -> Result<Device, DeviceError> {
        let (links, joints) = (self.links()?, self.joint_figures());
        let axis = |name: &str, rotational| Axis { name: name.to_owned(), rotational };
        let space = if self.axes.is_empty() {
            (Space::Joints, self.joints.iter().map(|j| axis(&j.name, j.kind == JointKind::Revolute)).collect())
        } else {
            let component = |name: &String| ["x", "y", "z"].iter().position(|known| known == name);
            let components: Option<Vec<usize>> = self.axes.iter().map(component).collect();
            let components = components.ok_or_else(|| DeviceError::size("axes", self.axes.join(", "), "some of x, y, z, or none for the joints"))?;
            (Space::Tip(components), self.axes.iter().map(|name| axis(name, false)).collect())
        };
        let home = self.joints.iter().map(|j| j.home_rad).collect();
        let range = self.joints.iter().map(|j| j.range_rad.unwrap_or([f64::NEG_INFINITY, f64::INFINITY])).collect();
        let chain = SerialChain::new(links, self.end_effector.translation_m, self.gravity_m_per_s2, space, (home, range), joints)?;
        let inertia = endpoint_inertia(&chain)?;
        let translational = !self.axes.is_empty();
        // A mode near 200 Hz, damped by a third: what 1e6 N/m and 800 N s/m are to a planar robot of 0.65 kg.
        let stiff = (std::f64::consts::TAU * 200.0).powi(2) * inertia;
        let stiffness = self.transducer.stiffness.unwrap_or(if translational { stiff.max(1e6) } else { stiff });
        let damping = self.transducer.damping.unwrap_or(0.6 * (stiffness * inertia).sqrt());
        for (what, value) in [("transducer.stiffness", stiffness), ("transducer.damping", damping)] {
            if !(value.is_finite() && value > 0.0) {
                return Err(DeviceError::value(what, value, "positive"));
            }
        }
        let transducer = if translational { Transducer::new(stiffness, damping)? } else { Transducer { stiffness, damping } };
        // Natural frequency of 1.5 Hz, damping ratio 0.25: gentle beside the limb, as on the planar robot.
        let slow = std::f64::consts::TAU * 1.5;
        let defaults = LoopDefaults {
            kp: self.hold.kp.unwrap_or(slow * slow * inertia),
            kd: self.hold.kd.unwrap_or(0.5 * slow * inertia),
            force_limit: self.hold.force_limit.unwrap_or(f64::INFINITY),
            force_noise_rms: self.transducer.noise_rms.unwrap_or(if translational { 0.03 } else { 0.003 }),
            force_quantum: self.transducer.quantum.unwrap_or(0.0),
            force_range: self.transducer.range.unwrap_or(f64::INFINITY),
            stiffness_limit: f64::INFINITY,
        };
        Ok(Device { robot: Box::new(chain), transducer, defaults })
    }

    fn links(&self) -> Result<Vec<Link>, DeviceError> {
        self.joints
            .iter()
            .map(|joint| {
                let length = dot(joint.axis, joint.axis).sqrt();
                let named = |what: &str| format!("{what} of joint \"{}\"", joint.name);
                if !(length.is_finite() && length > 0.0) {
                    return Err(DeviceError::value(named("the length of the axis"), length, "positive"));
                }
                for (what, value) in [("mass_kg", joint.mass_kg), ("rotor_inertia_kg_m2", joint.rotor_inertia_kg_m2)] {
                    if !(value.is_finite() && value >= 0.0) {
                        return Err(DeviceError::value(named(what), value, "zero or positive"));
                    }
                }
                if !(joint.gear_ratio.is_finite() && joint.gear_ratio > 0.0) {
                    return Err(DeviceError::value(named("gear_ratio"), joint.gear_ratio, "positive"));
                }
                let [xx, yy, zz, xy, xz, yz] = joint.inertia_kg_m2;
                // Principal moments are those of a body where none exceeds the other two's sum; necessary for the diagonal in any frame.
                if [xx, yy, zz].iter().any(|v| !(v.is_finite() && *v >= 0.0))
                    || xx > (yy + zz) * (1.0 + 1e-9)
                    || yy > (xx + zz) * (1.0 + 1e-9)
                    || zz > (xx + yy) * (1.0 + 1e-9)
                {
                    return Err(DeviceError::Inertia(named("inertia_kg_m2 (no diagonal moment may exceed the sum of the other two)")));
                }
                Ok(Link {
                    slides: joint.kind == JointKind::Prismatic,
                    axis: scale(joint.axis, 1.0 / length),
                    rotation: roll_pitch_yaw(joint.origin_rpy_rad),
                    origin: joint.origin_m,
                    mass: joint.mass_kg,
                    centre: joint.centre_m,
                    inertia: [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]],
                    rotor: joint.rotor_inertia_kg_m2 * joint.gear_ratio.powi(2),
                })
            })
            .collect()
    }

    fn joint_figures(&self) -> Joints {
        let of = |f: fn(&JointConfig) -> f64| self.joints.iter().map(f).collect::<Vec<_>>();
        Joints {
            coulomb: of(|j| j.coulomb_nm),
            viscous: of(|j| j.viscous_nm_s_per_rad),
            smoothing: vec![0.005; self.joints.len()],
            torque_limit: of(|j| j.torque_limit_nm.unwrap_or(f64::INFINITY)),
            encoder_range: of(|j| std::f64::consts::TAU / j.gear_ratio),
            encoder_counts: 65_536.0,
        }
    }
}

/// The largest diagonal entry of Λ = (J H⁻¹ Jᵀ)⁻¹ at home: the scale for defaults.
fn endpoint_inertia(chain: &SerialChain) -> Result<f64, DeviceError> {
    let (q, n, m) = (chain.home.clone(), chain.joints().coulomb.len(), chain.axes().len());
    let (mut mass, mut kinematics) = (vec![0.0; n * n], Kinematics::new(m, n));
    chain.mass_matrix(&q, &mut mass);
    chain.kinematics(&q, &vec![0.0; n], &mut kinematics);
    let square = |data: &[f64], rows: usize| ndarray::Array2::from_shape_fn((rows, n), |(i, j)| data[i * n + j]);
    let (mass, jacobian) = (square(&mass, n), square(&kinematics.jacobian, m));
    let mobility = inverse(&mass).map(|h| jacobian.dot(&h).dot(&jacobian.t()));
    let smallest = mobility.as_ref().map_or(0.0, |a| a.diag().iter().fold(f64::INFINITY, |s, v| s.min(*v)));
    let inertia = mobility.as_ref().and_then(inverse).map(|a| a.diag().iter().fold(0.0_f64, |s, v| s.max(*v)));
    match inertia {
        Some(inertia) if inertia > 0.0 && inertia * smallest < 1e6 && smallest > 0.0 => Ok(inertia),
        _ => Err(DeviceError::Reach {
            who: "the robot".to_owned(),
            target: q,
            why: "its home posture is singular for the axes asked for; give another home_rad".to_owned(),
        }),
    }
}
