//! A device of the devices crate as the simulated robot that a diagnosis judges.

use crate::error::AnalysisError;
use crate::file::{BaselineFile, Value};
use ndof_devices::{DeviceConfig, EndpointLinearConfig, Experiment, HoldGains, LimbConfig};
use ndof_diagnose::{Endpoint, Mechanism, MechanismParameter};
use ndof_models::robot::{EndpointForce, Meaning, Robot};
use num_complex::Complex64;

/// An experiment that only holds the limb at its posture: enough to linearise it.
pub(super) fn held(device: DeviceConfig, limb: LimbConfig, file: &BaselineFile, sample_rate_hz: f64) -> Experiment {
    Experiment { sample_rate_hz, posture: file.posture.clone(), controller: file.controller.clone(), ..Experiment::new(device, limb) }
}

/// A device with its numbers and its hold.
pub(super) struct SimulatedRobot {
    robot: Box<dyn Robot>,
    parameters: Vec<MechanismParameter>,
    hold: HoldGains,
}

impl SimulatedRobot {
    /// The robot of a baseline file; `None` without a device, or where its joints do not follow from the endpoint.
    pub fn new(file: &BaselineFile, sample_rate_hz: f64) -> Result<Option<Self>, AnalysisError> {
        let Some(config) = &file.device else { return Ok(None) };
        let built = config.build()?;
        let axes = built.robot.axes().len();
        let unit: Vec<Vec<f64>> = (0..axes).map(|i| (0..axes).map(|j| f64::from(u8::from(i == j))).collect()).collect();
        let limb = EndpointLinearConfig { M: unit.clone(), B: unit.clone(), K: unit, ..EndpointLinearConfig::default() };
        let bench = held(config.clone(), LimbConfig::EndpointLinear(limb), file, sample_rate_hz).build()?;
        if bench.rest.len() != axes || built.robot.inverse_kinematics(&bench.rest_endpoint()).is_err() {
            return Ok(None);
        }
        // A robot in a file has bodies by the dozen; which of them may be wrong is for joint coordinates to say.
        let own = if config.name.is_empty() { Vec::new() } else { built.robot.parameters() };
        let parameters = own
            .into_iter()
            .map(|own| {
                let written = file.parameters.get(&own.name);
                let value = match written.map(|w| &w.value) {
                    Some(Value::Scalar(value)) => *value,
                    _ => own.value,
                };
                let status = written.map_or(own.status, |w| w.status);
                MechanismParameter { geometry: own.meaning == Meaning::Geometry, name: own.name, unit: own.unit, value, status }
            })
            .collect();
        Ok(Some(SimulatedRobot { robot: built.robot, parameters, hold: bench.hold }))
    }
}

impl Mechanism for SimulatedRobot {
    fn parameters(&self) -> &[MechanismParameter] {
        &self.parameters
    }

    fn with(&self, values: &[f64]) -> Option<Box<dyn Endpoint + '_>> {
        let own: Vec<f64> = if values.is_empty() { self.robot.parameters().iter().map(|p| p.value).collect() } else { values.to_vec() };
        Some(Box::new(AtEndpoint(EndpointForce::new(self.robot.with_parameters(&own).ok()?)?)))
    }

    fn hold(&self, axis: usize, s: Complex64) -> Complex64 {
        self.hold.at_ticks(axis, s)
    }
}

/// A robot seen at its endpoint.
struct AtEndpoint(EndpointForce);

impl Endpoint for AtEndpoint {
    fn needed(&mut self, position: &[f64], velocity: &[f64], acceleration: &[f64], force: &mut [f64]) -> bool {
        self.0.needed(position, velocity, acceleration, force)
    }
}
