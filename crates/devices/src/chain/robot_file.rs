//! A robot described in a TOML, URDF or MJCF file, read and built.

use super::body::tensor;
use super::config::{JointConfig, JointKind, RobotConfig};
use super::link::Link;
use super::serial::{SerialChain, Space};
use super::{mjcf, urdf, xml};
use crate::device::{Device, LoopDefaults};
use crate::error::DeviceError;
use crate::linearise::rigid_body;
use crate::transducer::translational;
use crate::vector3::{dot, roll_pitch_yaw, scale};
use ndof_linear::inverse;
use ndof_models::robot::{Joints, RobotError};
use ndof_models::{Axis, Transducer};

/// What an experiment says about a robot in a file.
pub(crate) struct FileChoices<'a> {
    /// Commanded coordinates, in place of the file's.
    pub(crate) axes: Option<&'a [String]>,
    /// The link or body that carries the limb.
    pub(crate) tip: Option<&'a str>,
    /// Home posture, in place of the file's.
    pub(crate) home: Option<&'a [f64]>,
}

/// Reads a robot from the text of a TOML, URDF or MJCF file called `file`.
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

    /// A robot from the text of a TOML, URDF or MJCF file called `file`; `tip` is the link of a URDF, or the body of an
    /// MJCF, that carries the limb.
    ///
    /// # Errors
    /// [`DeviceError::File`] that says what is wrong and where.
    pub fn parse(file: &str, text: &str, tip: Option<&str>) -> Result<Self, DeviceError> {
        let wrong = |what: String| DeviceError::File { file: file.to_owned(), what };
        if text.trim_start().starts_with('<') {
            let root = xml::parse(text).map_err(wrong)?;
            let read = match root.name.as_str() {
                "robot" => urdf::read(&root, tip),
                "mujoco" => mjcf::read(&root, tip),
                other => Err(format!("line {}: the root is <{other}>, a URDF has <robot>, an MJCF <mujoco>", root.line)),
            };
            return read.map_err(wrong);
        }
        let config: RobotConfig = toml::from_str(text).map_err(|e| wrong(e.to_string()))?;
        config.check_schema(file)?;
        Ok(config)
    }

    /// The bodies and joints alone.
    ///
    /// # Errors
    /// [`DeviceError`] that names the joint and the number.
    pub fn chain(&self) -> Result<SerialChain, DeviceError> {
        let (links, joints) = (self.links()?, self.joint_figures());
        let twice = self.joints.iter().enumerate().find(|(k, joint)| self.joints[..*k].iter().any(|other| other.name == joint.name));
        if let Some((_, joint)) = twice {
            return Err(DeviceError::size("joints", format!("two called \"{}\"", joint.name), "each with a name of its own"));
        }
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
        let springs = self.joints.iter().map(|j| [j.stiffness_nm_per_rad, j.spring_rest_rad]).collect();
        let chain = SerialChain::new(links, self.end_effector.translation_m, self.gravity_m_per_s2, space, (home, range), joints)?;
        for joint in &self.joints {
            for (what, value) in [("friction_ahead_s", joint.friction_ahead_s), ("friction_softness", joint.friction_softness)] {
                if !(value.is_finite() && value >= 0.0) {
                    return Err(DeviceError::value(format!("{what} of joint \"{}\"", joint.name), value, "zero or more"));
                }
            }
        }
        let soft: Vec<[f64; 2]> = self.joints.iter().map(|j| [j.friction_ahead_s, j.friction_softness]).collect();
        Ok(chain.with_springs(springs).with_soft_friction(&soft))
    }

    /// The chain, its transducer and its hold.
    ///
    /// # Errors
    /// [`DeviceError`] that names the joint and the number.
    pub fn build(&self) -> Result<Device, DeviceError> {
        if let Some(joint) = self.joints.iter().find(|j| j.stiffness_nm_per_rad != 0.0) {
            return Err(DeviceError::value(
                format!("stiffness of joint \"{}\"", joint.name),
                joint.stiffness_nm_per_rad,
                "zero: no spring at a joint is simulated",
            ));
        }
        let at_the_tip = !self.axes.is_empty();
        if at_the_tip && !self.ends.is_empty() {
            return Err(DeviceError::Missing(format!("{} are ends of the last body; say with `tip` which carries the limb", self.ends.join(", "))));
        }
        let chain = self.chain()?;
        let inertia = endpoint_inertia(&chain)?;
        // A mode near 200 Hz, damped by a third: what 1e6 N/m and 800 N s/m are to a planar robot of 0.65 kg.
        let stiff = (std::f64::consts::TAU * 200.0).powi(2) * inertia;
        let stiffness = self.transducer.stiffness.unwrap_or(if at_the_tip { stiff.max(1e6) } else { stiff });
        let damping = self.transducer.damping.unwrap_or(0.6 * (stiffness * inertia).sqrt());
        for (what, value) in [("transducer.stiffness", stiffness), ("transducer.damping", damping)] {
            DeviceError::positive(what, value)?;
        }
        let transducer = if at_the_tip { translational(stiffness, damping)? } else { Transducer { stiffness, damping } };
        // Natural frequency of 1.5 Hz, damping ratio 0.25: gentle beside the limb, as on the planar robot.
        let slow = std::f64::consts::TAU * 1.5;
        let defaults = LoopDefaults {
            kp: self.hold.kp.unwrap_or(slow * slow * inertia),
            kd: self.hold.kd.unwrap_or(0.5 * slow * inertia),
            force_limit: self.hold.force_limit.unwrap_or(f64::INFINITY),
            force_noise_rms: self.transducer.noise_rms.unwrap_or(if at_the_tip { 0.03 } else { 0.003 }),
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
                DeviceError::positive(named("the length of the axis"), length)?;
                DeviceError::positive(named("gear_ratio"), joint.gear_ratio)?;
                Ok(Link {
                    slides: joint.kind == JointKind::Prismatic,
                    axis: scale(joint.axis, 1.0 / length),
                    rotation: roll_pitch_yaw(joint.origin_rpy_rad),
                    origin: joint.origin_m,
                    mass: joint.mass_kg,
                    centre: joint.centre_m,
                    inertia: tensor(joint.inertia_kg_m2),
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
            torque_limit: of(|j| j.torque_limit_nm.unwrap_or(f64::INFINITY)),
            encoder_range: of(|j| std::f64::consts::TAU / j.gear_ratio),
            ..Joints::ideal(&self.joints.iter().map(|j| &j.name).collect::<Vec<_>>())
        }
    }
}

/// The largest diagonal entry of Λ = (J H⁻¹ Jᵀ)⁻¹ at home: the scale for defaults.
fn endpoint_inertia(chain: &SerialChain) -> Result<f64, DeviceError> {
    let (mass, jacobian) = rigid_body(chain, &chain.home);
    let mobility = inverse(&mass).map(|h| jacobian.dot(&h).dot(&jacobian.t()));
    let smallest = mobility.as_ref().map_or(0.0, |a| a.diag().iter().fold(f64::INFINITY, |s, v| s.min(*v)));
    let inertia = mobility.as_ref().and_then(inverse).map(|a| a.diag().iter().fold(0.0_f64, |s, v| s.max(*v)));
    match inertia {
        Some(inertia) if inertia > 0.0 && inertia * smallest < 1e6 && smallest > 0.0 => Ok(inertia),
        _ => Err(RobotError::Reach {
            who: "the robot".to_owned(),
            target: chain.home.clone(),
            why: "its home posture is singular for the axes asked for; give another home_rad".to_owned(),
        }
        .into()),
    }
}
