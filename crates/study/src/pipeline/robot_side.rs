//! A device of the devices crate as the simulated robot that a diagnosis judges.

use crate::error::StudyError;
use crate::file::{BaselineFile, Status, Value};
use ndof_devices::{Device, DeviceConfig, EndpointLinearConfig, Experiment, HoldGains, Kinematics, LimbConfig, Sensors, device};
use ndof_diagnose::{Endpoint, Mechanism, MechanismParameter};
use num_complex::Complex64;

/// Words in the name of a parameter that says nothing about the motion between command and transducer, or that no recording tells.
const SETTINGS: [&str; 8] = ["limit", "range", "transducer", "velocity", "base_", "counts", "ratio", "compensation"];

/// A device with its numbers and its hold.
pub(super) struct SimulatedRobot {
    config: DeviceConfig,
    parameters: Vec<MechanismParameter>,
    hold: HoldGains,
}

impl SimulatedRobot {
    /// The robot of a baseline file; `None` without a device, or where its joints do not follow from the endpoint.
    ///
    /// # Errors
    /// [`StudyError`] if the device cannot be built.
    pub fn new(file: &BaselineFile, sample_rate_hz: f64) -> Result<Option<Self>, StudyError> {
        let Some(config) = &file.device else { return Ok(None) };
        let built = config.build()?;
        let axes = built.robot.axes().len();
        let unit: Vec<Vec<f64>> = (0..axes).map(|i| (0..axes).map(|j| f64::from(u8::from(i == j))).collect()).collect();
        let limb = EndpointLinearConfig { M: unit.clone(), B: unit.clone(), K: unit, ..EndpointLinearConfig::default() };
        let bench = Experiment {
            seed: 1,
            trials: 1,
            duration_s: 1.0,
            sample_rate_hz,
            discard_s: 0.0,
            device: config.clone(),
            limb: LimbConfig::EndpointLinear(limb),
            posture: file.posture.clone(),
            controller: file.controller.clone(),
            sensors: Sensors::default(),
        }
        .build()?;
        if bench.rest.len() != axes || built.robot.inverse_kinematics(&bench.rest_endpoint()).is_err() {
            return Ok(None);
        }
        let table = if config.name.is_empty() { &[][..] } else { device(&config.name)?.parameters };
        let parameters = table
            .iter()
            .map(|entry| {
                let written = file.parameters.get(entry.name);
                let value = match written.map(|w| &w.value) {
                    Some(Value::Scalar(value)) => *value,
                    _ => config.parameters.get(entry.name).copied().unwrap_or(entry.default),
                };
                let setting = SETTINGS.iter().any(|word| entry.name.contains(word));
                let status = match written.map(|w| w.status) {
                    Some(Status::Fixed) => ndof_diagnose::Status::Fixed,
                    Some(Status::Nominal) => ndof_diagnose::Status::Nominal,
                    Some(Status::Free) => ndof_diagnose::Status::Free,
                    None if setting => ndof_diagnose::Status::Fixed,
                    None => ndof_diagnose::Status::Nominal,
                };
                MechanismParameter { name: entry.name.to_owned(), unit: entry.unit.to_owned(), value, status, geometry: matches!(entry.unit, "m" | "rad") }
            })
            .collect();
        Ok(Some(SimulatedRobot { config: config.clone(), parameters, hold: bench.hold }))
    }
}

impl Mechanism for SimulatedRobot {
    fn parameters(&self) -> &[MechanismParameter] {
        &self.parameters
    }

    fn with(&self, values: &[f64]) -> Option<Box<dyn Endpoint + '_>> {
        let mut config = self.config.clone();
        config.parameters.extend(self.parameters.iter().zip(values).map(|(p, v)| (p.name.clone(), *v)));
        let device = config.build().ok()?;
        let n = self.hold.kp.len();
        Some(Box::new(AtEndpoint {
            device,
            place: Kinematics::new(n, n),
            rates: vec![0.0; n],
            turning: vec![0.0; n],
            torque: vec![0.0; n],
            carried: vec![0.0; n],
            mass: vec![0.0; n * n],
            work: vec![0.0; n * n],
        }))
    }

    fn hold(&self, axis: usize, s: Complex64) -> Complex64 {
        self.hold.at_ticks(axis, s)
    }
}

/// A robot's balance of forces at its endpoint.
struct AtEndpoint {
    device: Device,
    place: Kinematics,
    rates: Vec<f64>,
    turning: Vec<f64>,
    torque: Vec<f64>,
    carried: Vec<f64>,
    mass: Vec<f64>,
    work: Vec<f64>,
}

/// Solves a x = b (or aᵀ x = b) by elimination with pivoting; `b` becomes x, `work` is used up.
fn solve(a: &[f64], transposed: bool, b: &mut [f64], work: &mut [f64]) -> bool {
    let n = b.len();
    for i in 0..n {
        for j in 0..n {
            work[i * n + j] = if transposed { a[j * n + i] } else { a[i * n + j] };
        }
    }
    for column in 0..n {
        let pivot = (column..n).max_by(|&p, &q| work[p * n + column].abs().total_cmp(&work[q * n + column].abs())).unwrap_or(column);
        let head = work[pivot * n + column];
        if head.is_nan() || head.abs() < 1e-12 {
            return false;
        }
        (0..n).for_each(|k| work.swap(pivot * n + k, column * n + k));
        b.swap(pivot, column);
        for row in column + 1..n {
            let share = work[row * n + column] / head;
            (column..n).for_each(|k| work[row * n + k] -= share * work[column * n + k]);
            b[row] -= share * b[column];
        }
    }
    for row in (0..n).rev() {
        b[row] = (b[row] - (row + 1..n).map(|k| work[row * n + k] * b[k]).sum::<f64>()) / work[row * n + row];
    }
    true
}

impl Endpoint for AtEndpoint {
    /// J⁻ᵀ (H q̈ + h − c h₀ + τ_f), with q from the inverse kinematics, q̇ = J⁻¹ ẋ, q̈ = J⁻¹ (ẍ − J̇ q̇), and c h₀ the weight that the controller carries.
    fn needed(&mut self, position: &[f64], velocity: &[f64], acceleration: &[f64], force: &mut [f64]) -> bool {
        let robot = self.device.robot.as_ref();
        let Ok(q) = robot.inverse_kinematics(position) else { return false };
        let n = q.len();
        self.rates.fill(0.0);
        robot.kinematics(&q, &self.rates, &mut self.place);
        let carried = robot.gravity_compensation();
        if carried > 0.0 {
            robot.bias(&q, &self.rates, &mut self.carried);
        } else {
            self.carried.fill(0.0);
        }
        self.rates.copy_from_slice(velocity);
        if !solve(&self.place.jacobian, false, &mut self.rates, &mut self.work) {
            return false;
        }
        robot.kinematics(&q, &self.rates, &mut self.place);
        for ((turning, a), rate) in self.turning.iter_mut().zip(acceleration).zip(&self.place.jacobian_rate) {
            *turning = a - rate;
        }
        if !solve(&self.place.jacobian, false, &mut self.turning, &mut self.work) {
            return false;
        }
        robot.mass_matrix(&q, &mut self.mass);
        robot.bias(&q, &self.rates, &mut self.torque);
        let joints = robot.joints();
        for i in 0..n {
            self.torque[i] += joints.friction(i, self.rates[i]) - carried * self.carried[i];
            self.torque[i] += (0..n).map(|j| self.mass[i * n + j] * self.turning[j]).sum::<f64>();
        }
        force.copy_from_slice(&self.torque);
        solve(&self.place.jacobian, true, force, &mut self.work)
    }
}
