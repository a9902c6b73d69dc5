//! A wrist robot of InMotion3's kind: a gimbal whose last two axes share two motors through a differential.

use crate::chain::{Link, SerialChain, Space};
use crate::device::{Device, DeviceEntry, LoopDefaults};
use crate::error::DeviceError;
use crate::parameters::{DeviceParameter, DeviceParameters, parameter};
use ndof_models::Axis;
use ndof_models::Transducer;
use ndof_models::robot::{EndpointKinematics, Joints, Meaning, Robot, RobotError, RobotParameter, quantise};

/// The wrist robot.
pub(crate) static WRIST: DeviceEntry = DeviceEntry {
    name: "wrist",
    description: "wrist robot of InMotion3's kind: pronation/supination, flexion/extension, abduction/adduction, in joint angles",
    parameters: &PARAMETERS,
    source: "differential, ratios and encoders from the robot's public control software; inertias, friction and gravity are ours",
    build,
};

static PARAMETERS: [DeviceParameter; 13] = [
    parameter("differential_ratio", "1", 7.0, "motor turns for one turn of flexion or abduction, both motors together"),
    parameter("pronation_ratio", "1", 10.5, "motor turns for one turn of pronation"),
    parameter("motor_torque_limit_nm", "N m", 0.116, "largest torque of one motor"),
    parameter("encoder_counts", "1", 40_960.0, "encoder steps in one motor turn"),
    parameter("rotor_inertia_kg_m2", "kg m^2", 7e-6, "inertia of one rotor"),
    parameter("moving_mass_kg", "kg", 0.3, "mass that turns with the handle"),
    parameter("moving_centre_m", "m", 0.03, "its centre of mass, from the wrist along the forearm"),
    parameter("gravity_compensation", "1", 1.0, "share of its own weight that the controller carries"),
    parameter("coulomb_nm", "N m", 0.005, "dry friction of each axis"),
    parameter("viscous_nm_s_per_rad", "N m s/rad", 0.001, "viscous friction of each axis"),
    parameter("torque_limit_nm", "N m", 1.8, "largest commanded torque, as the length of its vector"),
    parameter("transducer_stiffness_nm_per_rad", "N m/rad", 3000.0, "stiffness of the torque transducer"),
    parameter("transducer_damping_nm_s_per_rad", "N m s/rad", 2.4, "damping of the torque transducer"),
];

/// Pronation/supination (PS) about the forearm x, then flexion/extension (FE) about z, then abduction/adduction (AA) about y:
/// R = R_x(φ) R_z(θ) R_y(ψ). Endpoint coordinates are these angles, endpoint efforts the torques conjugate to them.
///
/// Motors: FE = (m_L + m_R)/(2 g), AA = (m_L − m_R)/(2 g), PS = m_P/g_P.
#[derive(Clone, Debug, PartialEq)]
pub struct WristRobot {
    chain: SerialChain,
    differential: f64,
    pronation: f64,
    motor_limit: f64,
    compensation: f64,
    parameters: DeviceParameters,
}

impl WristRobot {
    /// The gimbal with its motors.
    ///
    /// # Errors
    /// [`DeviceError`] that names the number out of range.
    fn new(p: &DeviceParameters) -> Result<Self, DeviceError> {
        let v = |name| p.value(name);
        for name in ["differential_ratio", "pronation_ratio", "motor_torque_limit_nm", "encoder_counts"] {
            DeviceError::positive(name, v(name))?;
        }
        for name in ["rotor_inertia_kg_m2", "moving_mass_kg", "gravity_compensation"] {
            DeviceError::not_negative(name, v(name))?;
        }
        let (differential, pronation, rotor) = (v("differential_ratio"), v("pronation_ratio"), v("rotor_inertia_kg_m2"));
        let link = |axis, [xx, yy, zz]: [f64; 3], rotor| Link { axis, inertia: [[xx, 0.0, 0.0], [0.0, yy, 0.0], [0.0, 0.0, zz]], rotor, ..Link::default() };
        // Both motors turn in flexion and in abduction, at g times the angle each: 2 g² J on either axis.
        let shared = 2.0 * differential * differential * rotor;
        let mut links = vec![
            link([1.0, 0.0, 0.0], [5e-4, 4e-4, 4e-4], pronation * pronation * rotor),
            link([0.0, 0.0, 1.0], [4e-4, 4e-4, 5e-4], shared),
            link([0.0, 1.0, 0.0], [1.3e-3, 1.8e-3, 1.3e-3], shared),
        ];
        links[2].mass = v("moving_mass_kg");
        links[2].centre = [v("moving_centre_m"), 0.0, 0.0];
        let names = ["ps", "fe", "aa"];
        let joints = Joints {
            coulomb: vec![v("coulomb_nm"); 3],
            viscous: vec![v("viscous_nm_s_per_rad"); 3],
            encoder_counts: v("encoder_counts"),
            ..Joints::ideal(&names)
        };
        // Ranges of the human joint that the robot covers: 70°/70°, 60°/60°, 30°/45°.
        let range = [[-70.0, 70.0], [-60.0, 60.0], [-30.0, 45.0_f64]].map(|r| r.map(f64::to_radians)).to_vec();
        let axes = names.map(Axis::rotational).to_vec();
        let chain = SerialChain::new(links, [0.0; 3], [0.0, 0.0, -9.81], (Space::Joints, axes), (vec![0.0; 3], range), joints)?;
        Ok(WristRobot {
            chain,
            differential,
            pronation,
            motor_limit: v("motor_torque_limit_nm"),
            compensation: v("gravity_compensation"),
            parameters: p.clone(),
        })
    }
}

fn build(p: &DeviceParameters) -> Result<Device, DeviceError> {
    let v = |name| p.value(name);
    DeviceError::positive("torque_limit_nm", v("torque_limit_nm"))?;
    let transducer = Transducer { stiffness: v("transducer_stiffness_nm_per_rad"), damping: v("transducer_damping_nm_s_per_rad") };
    if !(transducer.stiffness >= 1000.0 && transducer.damping > 0.0) {
        return Err(DeviceError::value("transducer_stiffness_nm_per_rad", transducer.stiffness, "at least 1000 N m/rad, with positive damping"));
    }
    let defaults = LoopDefaults {
        kp: 0.5,
        kd: 0.02,
        force_limit: v("torque_limit_nm"),
        force_noise_rms: 0.003,
        force_quantum: 0.0,
        force_range: 10.0,
        stiffness_limit: f64::INFINITY,
    };
    Ok(Device { robot: Box::new(WristRobot::new(p)?), transducer, defaults })
}

/// Numbers of the table that are the robot's own, and what they mean.
const OWN: [(&str, Meaning); 8] = [
    ("differential_ratio", Meaning::Setting),
    ("pronation_ratio", Meaning::Setting),
    ("rotor_inertia_kg_m2", Meaning::Inertia),
    ("moving_mass_kg", Meaning::Inertia),
    ("moving_centre_m", Meaning::Inertia),
    ("gravity_compensation", Meaning::Setting),
    ("coulomb_nm", Meaning::Friction),
    ("viscous_nm_s_per_rad", Meaning::Friction),
];

impl Robot for WristRobot {
    fn axes(&self) -> &[Axis] {
        self.chain.axes()
    }

    fn joints(&self) -> &Joints {
        self.chain.joints()
    }

    fn kinematics(&self, q: &[f64], rates: &[f64], out: &mut EndpointKinematics) {
        self.chain.kinematics(q, rates, out);
    }

    fn mass_matrix(&self, q: &[f64], out: &mut [f64]) {
        self.chain.mass_matrix(q, out);
    }

    fn bias(&self, q: &[f64], rates: &[f64], out: &mut [f64]) {
        self.chain.bias(q, rates, out);
    }

    fn inverse_kinematics(&self, target: &[f64]) -> Result<Vec<f64>, RobotError> {
        self.chain.inverse_kinematics(target)
    }

    fn inverse_dynamics(&self, q: &[f64], rates: &[f64], accelerations: &[f64], out: &mut [f64]) {
        self.chain.inverse_dynamics(q, rates, accelerations, out);
    }

    fn parameters(&self) -> Vec<RobotParameter> {
        let unit = |name: &str| PARAMETERS.iter().find(|p| p.name == name).map_or("", |p| p.unit);
        OWN.iter().map(|(name, meaning)| RobotParameter::new(*name, unit(name), self.parameters.value(name), *meaning)).collect()
    }

    fn with_parameters(&self, values: &[f64]) -> Result<Box<dyn Robot>, RobotError> {
        if values.len() != OWN.len() {
            return Err(RobotError::Length { what: "the list of parameters", found: values.len(), expected: OWN.len() });
        }
        let mut parameters = self.parameters.clone();
        OWN.iter().zip(values).for_each(|((name, _), value)| parameters.set(name, *value));
        match WristRobot::new(&parameters) {
            Ok(robot) => Ok(Box::new(robot)),
            Err(DeviceError::Robot(error)) => Err(error),
            Err(other) => Err(RobotError::Body(other.to_string())),
        }
    }

    fn home(&self) -> Result<Vec<f64>, RobotError> {
        self.chain.home()
    }

    fn range(&self) -> &[[f64; 2]] {
        self.chain.range()
    }

    fn gravity_compensation(&self) -> f64 {
        self.compensation
    }

    fn encode(&self, q: &[f64], counts: f64, out: &mut [f64]) {
        let (step, g) = (std::f64::consts::TAU / counts, self.differential);
        let (left, right) = (quantise(g * (q[1] + q[2]), step), quantise(g * (q[1] - q[2]), step));
        out[0] = quantise(self.pronation * q[0], step) / self.pronation;
        out[1] = (left + right) / (2.0 * g);
        out[2] = (left - right) / (2.0 * g);
    }

    fn limit_torque(&self, torque: &mut [f64]) {
        let (limit, g) = (self.motor_limit, 2.0 * self.differential);
        let (left, right) = (((torque[1] + torque[2]) / g).clamp(-limit, limit), ((torque[1] - torque[2]) / g).clamp(-limit, limit));
        torque[0] = (torque[0] / self.pronation).clamp(-limit, limit) * self.pronation;
        torque[1] = (left + right) * self.differential;
        torque[2] = (left - right) * self.differential;
    }

    fn acceleration(&self, q: &[f64], rates: &[f64], kinematics: &EndpointKinematics, torque: &[f64], work: &mut [f64], out: &mut [f64]) {
        self.chain.acceleration(q, rates, kinematics, torque, work, out);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::registry::device;

    fn wrist() -> Device {
        let entry = device("wrist").expect("known");
        (entry.build)(&DeviceParameters::new("wrist", entry.parameters, &Default::default()).expect("defaults")).expect("builds")
    }

    #[test]
    fn the_total_inertia_is_that_of_the_design() {
        let mut h = [0.0; 9];
        wrist().robot.mass_matrix(&[0.0; 3], &mut h);
        // Rotors 110.25·7e-6 and 98·7e-6 with the gimbal's bodies, and 0.3 kg at 3 cm on the last two axes.
        for (i, expected) in [(0, 2.2e-3 + 7.7175e-4), (4, 1.8e-3 + 6.86e-4 + 2.7e-4), (8, 1.8e-3 + 6.86e-4 + 2.7e-4)] {
            assert!((h[i] - expected).abs() < 1e-12, "{h:?}");
        }
    }

    #[test]
    fn one_motor_alone_bounds_two_axes_together() {
        let robot = wrist().robot;
        let mut torque = [5.0, 2.0, 0.0];
        robot.limit_torque(&mut torque);
        // 0.116 N m at the motors: 1.218 N m in pronation, 1.624 N m in pure flexion.
        assert!((torque[0] - 1.218).abs() < 1e-12 && (torque[1] - 1.624).abs() < 1e-12 && torque[2].abs() < 1e-12);
        let mut torque = [0.0, 1.0, 1.0];
        robot.limit_torque(&mut torque);
        assert!((torque[1] - 0.812).abs() < 1e-12 && (torque[2] - 0.812).abs() < 1e-12);
    }

    #[test]
    fn encoders_see_the_angles_through_the_differential() {
        let (robot, mut seen) = (wrist().robot, [0.0; 3]);
        robot.encode(&[0.1234, -0.2, 0.05], 40_960.0, &mut seen);
        // Half a motor step through the gears: 7.3 µrad in pronation, twice half of 11 µrad in the others.
        assert!((seen[0] - 0.1234).abs() <= 7.4e-6 && (seen[1] + 0.2).abs() <= 1.1e-5 && (seen[2] - 0.05).abs() <= 1.1e-5, "{seen:?}");
        assert!(seen[0] != 0.1234);
        robot.encode(&[0.1234, -0.2, 0.05], f64::INFINITY, &mut seen);
        assert!((seen[0] - 0.1234).abs() < 1e-15 && (seen[2] - 0.05).abs() < 1e-15);
    }
}
