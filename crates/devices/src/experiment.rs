//! An experiment as data: device, limb, posture, controller and sensors.

use crate::controller::Controller;
use crate::error::DeviceError;
use crate::limb::{EndpointLinear, EndpointLinearConfig, Limb, PlanarTwoLink, PlanarTwoLinkConfig, SpringArray, SpringArrayConfig};
use crate::linearise::{HoldGains, Linearised};
use crate::noise::LimbNoise;
use crate::parameters::Parameters;
use crate::registry::{Device, device};
use crate::sensors::Sensors;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Which device, with what overridden.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DeviceConfig {
    /// A name of the registry.
    pub name: String,
    /// Overrides by the names that `ndof list devices` prints.
    #[serde(default)]
    pub parameters: BTreeMap<String, f64>,
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
}

/// Where robot and limb are held.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Posture {
    /// The hand, in the device's coordinates (m); the workspace's centre where absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub hand_m: Option<Vec<f64>>,
    /// The limb's joint angles (rad), for limbs with joints.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub joint_rad: Option<Vec<f64>>,
}

/// All that a simulation needs to know, except excitation and hidden effects.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
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
    #[serde(default)]
    pub posture: Posture,
    /// The hold.
    #[serde(default)]
    pub controller: Controller,
    /// The sensors.
    #[serde(default)]
    pub sensors: Sensors,
}

impl LimbConfig {
    /// The limb's own force noise.
    pub fn noise(&self) -> Option<&LimbNoise> {
        match self {
            LimbConfig::EndpointLinear(c) => c.noise.as_ref(),
            LimbConfig::PlanarTwoLink(c) => c.noise.as_ref(),
            LimbConfig::SpringArray(c) => c.noise.as_ref(),
        }
    }

    /// The names of the limb's joints in order; none where it has no joints.
    pub fn joint_names(&self) -> Vec<String> {
        let names: &[&str] = match self {
            LimbConfig::PlanarTwoLink(_) => &["shoulder", "elbow"],
            LimbConfig::EndpointLinear(_) | LimbConfig::SpringArray(_) => &[],
        };
        names.iter().map(|n| (*n).to_owned()).collect()
    }

    fn build(&self, axes: usize, hand: &[f64], posture: &Posture) -> Result<Box<dyn Limb>, DeviceError> {
        Ok(match self {
            LimbConfig::EndpointLinear(config) => Box::new(EndpointLinear::new(config, axes)?),
            LimbConfig::SpringArray(config) => Box::new(SpringArray::new(config)?),
            LimbConfig::PlanarTwoLink(config) => {
                let &[x, y] = hand else { return Err(DeviceError::size("the device of a planar-two-link limb", format!("{axes} axes"), "2 axes")) };
                let angles = match posture.joint_rad.as_deref() {
                    None => None,
                    Some(&[shoulder, elbow]) => Some([shoulder, elbow]),
                    Some(list) => return Err(DeviceError::size("posture.joint_rad", list.len(), 2)),
                };
                Box::new(PlanarTwoLink::new(config, [x, y], angles)?)
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

impl Experiment {
    /// Builds robot and limb at their posture.
    ///
    /// # Errors
    /// [`DeviceError`] that names what does not fit.
    pub fn build(&self) -> Result<Bench, DeviceError> {
        for (what, value) in [("duration_s", self.duration_s), ("sample_rate_hz", self.sample_rate_hz)] {
            if !(value.is_finite() && value > 0.0) {
                return Err(DeviceError::value(what, value, "positive"));
            }
        }
        if !(self.discard_s.is_finite() && self.discard_s >= 0.0) {
            return Err(DeviceError::value("discard_s", self.discard_s, "zero or positive"));
        }
        let entry = device(&self.device.name)?;
        let device = (entry.build)(&Parameters::new(entry.name, entry.parameters, &self.device.parameters)?)?;
        let axes = device.robot.axes().len();
        let hand = self.posture.hand_m.clone().unwrap_or_else(|| vec![0.0; axes]);
        if hand.len() != axes {
            return Err(DeviceError::size("posture.hand_m", hand.len(), axes));
        }
        let rest = device.robot.inverse_kinematics(&hand)?;
        let limb = self.limb.build(axes, &hand, &self.posture)?;
        if limb.axes() != axes {
            return Err(DeviceError::size(format!("device \"{}\"", entry.name), format!("{axes} axes"), format!("{} for this limb", limb.axes())));
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
        let hold = HoldGains {
            kp: gains("kp", &self.controller.kp, device.defaults.kp)?,
            kd: gains("kd", &self.controller.kd, device.defaults.kd)?,
            velocity_cutoff_hz: cutoff,
            sample_rate_hz: self.sample_rate_hz,
        };
        Ok(Bench { device, limb, rest, hold })
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
