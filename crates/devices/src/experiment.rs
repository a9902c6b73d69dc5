//! An experiment as data: device, limb, posture, controller and sensors.

use crate::chain::{FileChoices, RobotConfig, read_robot};
use crate::controller::Controller;
use crate::device::Device;
use crate::error::DeviceError;
use crate::limb::{
    EndpointLinear, EndpointLinearConfig, Limb, MovingArm, PlanarTwoLink, PlanarTwoLinkConfig, SpringArray, SpringArrayConfig, Wrist, WristConfig,
};
use crate::linearise::{HoldGains, Linearised};
use crate::movement::Movement;
use crate::noise::LimbNoise;
use crate::parameters::DeviceParameters;
use crate::registry::device;
use crate::sensors::Sensors;
use ndof_models::robot::Robot;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Which device, with what overridden.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct DeviceConfig {
    /// A name of the registry; empty where a file is given.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub name: String,
    /// A robot's description in place of a name: TOML or URDF.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub file: Option<String>,
    /// A serial robot described on the spot in place of either: the keys of a robot's file.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub robot: Option<Box<RobotConfig>>,
    /// Overrides by the names that `ndof list devices` prints.
    pub parameters: BTreeMap<String, f64>,
    /// For a file: the end effector's coordinates that are commanded (some of x, y, z), in place of the file's.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub axes: Option<Vec<String>>,
    /// For a URDF: the link that carries the limb.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tip: Option<String>,
    /// For a file: the joints' home, in place of the file's.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub home_rad: Option<Vec<f64>>,
}

/// Which limb, with its figures.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "name", rename_all = "kebab-case")]
pub enum LimbConfig {
    /// Linear at the endpoint.
    EndpointLinear(EndpointLinearConfig),
    /// Upper arm and forearm in the plane.
    PlanarTwoLink(PlanarTwoLinkConfig),
    /// The paper's validation rig.
    SpringArray(SpringArrayConfig),
    /// Hand and handle in the wrist robot.
    Wrist(WristConfig),
}

/// Where robot and limb are held.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Posture {
    /// The hand, in the device's coordinates (m); the workspace's centre where absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub hand_m: Option<Vec<f64>>,
    /// Joint angles (rad): of a planar-two-link limb, else of the robot.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub joint_rad: Option<Vec<f64>>,
}

/// All that a simulation needs to know, except excitation and hidden effects.
#[derive(Clone, Debug, PartialEq)]
pub struct Experiment {
    /// Of all random signals.
    pub seed: u64,
    /// Repeated trials.
    pub trials: usize,
    /// Length of a trial's recording (s).
    pub duration_s: f64,
    /// Rate of controller and recording (Hz).
    pub sample_rate_hz: f64,
    /// Simulated before the recording begins (s).
    pub discard_s: f64,
    /// The robot.
    pub device: DeviceConfig,
    /// The limb.
    pub limb: LimbConfig,
    /// The posture.
    pub posture: Posture,
    /// The hold.
    pub controller: Controller,
    /// The sensors.
    pub sensors: Sensors,
}

impl DeviceConfig {
    /// A device of the registry with its defaults.
    pub fn named(name: &str) -> Self {
        DeviceConfig { name: name.to_owned(), ..DeviceConfig::default() }
    }

    /// A robot described in a file.
    pub fn from_file(file: &str) -> Self {
        DeviceConfig { file: Some(file.to_owned()), ..DeviceConfig::default() }
    }

    /// The robot with its transducer.
    ///
    /// # Errors
    /// [`DeviceError`] that names what is unknown, wrong in the file or out of range.
    pub fn build(&self) -> Result<Device, DeviceError> {
        let own_choices = self.axes.is_some() || self.tip.is_some() || self.home_rad.is_some();
        match (&self.file, self.name.as_str(), &self.robot) {
            (Some(file), "", None) => {
                self.no_overrides(file, "none; edit the file")?;
                let text = std::fs::read_to_string(file).map_err(|e| DeviceError::File { file: file.clone(), what: e.to_string() })?;
                let choices = FileChoices { axes: self.axes.as_deref(), tip: self.tip.as_deref(), home: self.home_rad.as_deref() };
                read_robot(file, &text, &choices)
            }
            (None, name, None) if !name.is_empty() => {
                if own_choices {
                    return Err(DeviceError::Missing(format!("device.axes, device.tip and device.home_rad belong to a device.file; \"{name}\" has its own")));
                }
                let entry = device(name)?;
                (entry.build)(&DeviceParameters::new(entry.name, entry.parameters, &self.parameters)?)
            }
            (None, "", Some(robot)) => {
                self.no_overrides(&robot.name, "none; edit device.robot")?;
                if own_choices {
                    return Err(DeviceError::Missing("device.axes, device.tip and device.home_rad belong to a device.file; edit device.robot".to_owned()));
                }
                robot.check_schema("device.robot")?;
                robot.build()
            }
            _ => Err(DeviceError::Missing("a device needs one of device.name (see `ndof list devices`), device.file and device.robot".to_owned())),
        }
    }

    /// Refuses overrides, which only devices of the registry have.
    fn no_overrides(&self, device: &str, available: &str) -> Result<(), DeviceError> {
        match self.parameters.keys().next() {
            Some(name) => Err(DeviceError::UnknownParameter { device: device.to_owned(), name: name.clone(), available: available.to_owned() }),
            None => Ok(()),
        }
    }
}

impl LimbConfig {
    /// The limb's own force noise.
    pub fn noise(&self) -> Option<&LimbNoise> {
        let (LimbConfig::EndpointLinear(EndpointLinearConfig { noise, .. })
        | LimbConfig::PlanarTwoLink(PlanarTwoLinkConfig { noise, .. })
        | LimbConfig::SpringArray(SpringArrayConfig { noise, .. })
        | LimbConfig::Wrist(WristConfig { noise, .. })) = self;
        noise.as_ref()
    }

    /// The same limb without force of its own.
    pub fn silent(mut self) -> Self {
        let (LimbConfig::EndpointLinear(EndpointLinearConfig { noise, .. })
        | LimbConfig::PlanarTwoLink(PlanarTwoLinkConfig { noise, .. })
        | LimbConfig::SpringArray(SpringArrayConfig { noise, .. })
        | LimbConfig::Wrist(WristConfig { noise, .. })) = &mut self;
        *noise = None;
        self
    }

    /// The names of the limb's joints in order; none where it has no joints.
    pub fn joint_names(&self) -> Vec<String> {
        let names: &[&str] = match self {
            LimbConfig::PlanarTwoLink(_) => &["shoulder", "elbow"],
            LimbConfig::Wrist(_) => &["pronation", "flexion", "abduction"],
            LimbConfig::EndpointLinear(_) | LimbConfig::SpringArray(_) => &[],
        };
        names.iter().map(|n| (*n).to_owned()).collect()
    }

    fn build(&self, axes: usize, hand: &[f64], posture: &Posture, movement: Option<&Movement>) -> Result<Box<dyn Limb>, DeviceError> {
        Ok(match self {
            LimbConfig::EndpointLinear(config) => Box::new(EndpointLinear::new(config, axes)?),
            LimbConfig::SpringArray(config) => Box::new(SpringArray::new(config)?),
            LimbConfig::Wrist(config) => {
                let &[ps, fe, aa] = hand else { return Err(DeviceError::size("the device of a wrist limb", format!("{axes} axes"), "3 axes")) };
                Box::new(Wrist::new(config, [ps, fe, aa])?)
            }
            LimbConfig::PlanarTwoLink(config) => {
                let &[x, y] = hand else { return Err(DeviceError::size("the device of a planar-two-link limb", format!("{axes} axes"), "2 axes")) };
                let angles = match posture.joint_rad.as_deref() {
                    None => None,
                    Some(&[shoulder, elbow]) => Some([shoulder, elbow]),
                    Some(list) => return Err(DeviceError::size("posture.joint_rad", list.len(), 2)),
                };
                let arm = PlanarTwoLink::new(config, [x, y], angles)?;
                match movement {
                    Some(movement) => Box::new(MovingArm::new(arm, config, movement)?),
                    None if config.K_over_cycle.is_some() || config.B_over_cycle.is_some() => {
                        return Err(DeviceError::Missing("limb.K_over_cycle and limb.B_over_cycle follow controller.movement; give that too".to_owned()));
                    }
                    None => Box::new(arm),
                }
            }
        })
    }
}

/// The parts of an experiment, built and checked.
pub struct Bench {
    /// Robot and transducer.
    pub device: Device,
    /// The limb.
    pub limb: Box<dyn Limb>,
    /// The robot's joint coordinates at the posture.
    pub rest: Vec<f64>,
    /// Gains of the hold.
    pub hold: HoldGains,
}

impl Bench {
    /// The endpoint's coordinates at the posture (m, rad).
    pub fn rest_endpoint(&self) -> Vec<f64> {
        self.device.robot.endpoint(&self.rest)
    }
}

impl Experiment {
    /// One trial of 50 s at 500 Hz behind 2 s that are discarded; posture, hold and sensors are the device's.
    pub fn new(device: DeviceConfig, limb: LimbConfig) -> Self {
        let (posture, controller, sensors) = (Posture::default(), Controller::default(), Sensors::default());
        Experiment { seed: 1, trials: 1, duration_s: 50.0, sample_rate_hz: 500.0, discard_s: 2.0, device, limb, posture, controller, sensors }
    }

    /// Builds robot and limb at their posture.
    ///
    /// # Errors
    /// [`DeviceError`] that names what does not fit.
    pub fn build(&self) -> Result<Bench, DeviceError> {
        for (what, value) in [("duration_s", self.duration_s), ("sample_rate_hz", self.sample_rate_hz)] {
            DeviceError::positive(what, value)?;
        }
        DeviceError::not_negative("discard_s", self.discard_s)?;
        let device = self.device.build()?;
        let axes = device.robot.axes().len();
        let rest = self.rest(device.robot.as_ref())?;
        let movement = self.controller.movement.as_ref();
        movement.map_or(Ok(()), |movement| movement.check(axes))?;
        let limb = self.limb.build(axes, &device.robot.endpoint(&rest), &self.posture, movement)?;
        if limb.axes() != axes {
            return Err(DeviceError::size("the device", format!("{axes} axes"), format!("{} for this limb", limb.axes())));
        }
        let gains = |what: &str, given: &Option<crate::controller::PerAxis>, default: f64| {
            let values = match given {
                None => vec![default; axes],
                Some(given) => given.values(axes).ok_or_else(|| DeviceError::size(format!("controller.{what}"), "another number of axes", axes))?,
            };
            match values.iter().find(|v| !(v.is_finite() && **v >= 0.0)) {
                Some(v) => Err(DeviceError::value(format!("controller.{what}"), *v, "zero or positive")),
                None => Ok(if self.controller.hold { values } else { vec![0.0; axes] }),
            }
        };
        let cutoff = self.controller.velocity_cutoff_hz;
        if !(cutoff > 0.0 && cutoff < self.sample_rate_hz / 2.0) {
            return Err(DeviceError::value("controller.velocity_cutoff_hz", cutoff, "between 0 and half of the sample rate"));
        }
        let kp = gains("kp", &self.controller.kp, device.defaults.kp)?;
        if let Some(kp) = kp.iter().find(|kp| **kp > device.defaults.stiffness_limit) {
            return Err(DeviceError::value("controller.kp", *kp, "at most what the device is made for (2000 N/m on mit-manus, 5000 on inmotion2)"));
        }
        let hold = HoldGains { kp, kd: gains("kd", &self.controller.kd, device.defaults.kd)?, velocity_cutoff_hz: cutoff, sample_rate_hz: self.sample_rate_hz };
        Ok(Bench { device, limb, rest, hold })
    }

    /// The robot's joint coordinates at the posture.
    fn rest(&self, robot: &dyn Robot) -> Result<Vec<f64>, DeviceError> {
        let joints = robot.joints().count();
        match (&self.posture.hand_m, &self.posture.joint_rad, &self.limb) {
            (Some(hand), _, _) if hand.len() != robot.axes().len() => Err(DeviceError::size("posture.hand_m", hand.len(), robot.axes().len())),
            (Some(hand), None, _) | (Some(hand), _, LimbConfig::PlanarTwoLink(_)) => Ok(robot.inverse_kinematics(hand)?),
            (Some(_), Some(_), _) => {
                Err(DeviceError::Missing("posture.hand_m and posture.joint_rad both set the robot's posture; give one of them".to_owned()))
            }
            (None, Some(_), LimbConfig::PlanarTwoLink(_)) | (None, None, _) => Ok(robot.home()?),
            (None, Some(angles), _) if angles.len() == joints => Ok(angles.clone()),
            (None, Some(angles), _) => Err(DeviceError::size("posture.joint_rad", angles.len(), joints)),
        }
    }

    /// The samples of one trial: discarded, recorded.
    pub fn samples(&self) -> (usize, usize) {
        ((self.discard_s * self.sample_rate_hz).round() as usize, (self.duration_s * self.sample_rate_hz).round() as usize)
    }

    /// The names of the device's axes, in the order of commands and channels.
    ///
    /// # Errors
    /// As [`Experiment::build`].
    pub fn axes(&self) -> Result<Vec<String>, DeviceError> {
        Ok(self.build()?.device.robot.axes().iter().map(|a| a.name.clone()).collect())
    }
}

/// The linear model of an experiment about its posture.
///
/// # Errors
/// As [`Experiment::build`], and if the robot is singular at the posture.
pub fn linearise(experiment: &Experiment) -> Result<Linearised, DeviceError> {
    let bench = experiment.build()?;
    Linearised::new(bench.device.robot.as_ref(), bench.limb.as_ref(), bench.device.transducer, bench.hold, &bench.rest)
}
