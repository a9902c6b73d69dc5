//! The planar five-bar parallelogram of MIT-MANUS and InMotion2, in absolute joint angles.

use crate::device::{Device, DeviceEntry, LoopDefaults};
use crate::error::DeviceError;
use crate::parameters::{DeviceParameter, DeviceParameters, parameter};
use crate::transducer::translational;
use ndof_models::robot::{EndpointKinematics, Joints, Meaning, Robot, RobotError, RobotParameter};
use ndof_models::{Axis, planar_angles};

/// Five-bar robot: upper link on angle q₁, forearm driven to the absolute angle q₂ by crank and coupler.
///
/// d = b + l₁ (cos q₁, sin q₁) + l₂ (cos q₂, sin q₂),
/// [H₁₁, H₁₂ c; H₁₂ c, H₂₂] q̈ + H₁₂ s (q̇₂², −q̇₁²) = τ − Jᵀ F with c, s = cos, sin (q₁ − q₂). The plane is level: no gravity.
#[derive(Clone, Debug, PartialEq)]
pub struct FiveBar {
    /// Lengths of upper link and forearm (m).
    pub links_m: [f64; 2],
    /// Where the motors' common axis stands, in coordinates whose origin is the workspace's centre (m).
    pub base_m: [f64; 2],
    /// H₁₁, H₂₂, H₁₂ (kg m²).
    pub inertia_kg_m2: [f64; 3],
    joints: Joints,
    axes: Vec<Axis>,
}

impl FiveBar {
    /// A five-bar from its lengths, base, inertias and joints.
    ///
    /// # Errors
    /// [`RobotError`] if a length is not positive or the inertia is not positive definite in every posture.
    pub fn new(links_m: [f64; 2], base_m: [f64; 2], inertia_kg_m2: [f64; 3], joints: Joints) -> Result<Self, RobotError> {
        for (i, l) in links_m.iter().enumerate() {
            if !(l.is_finite() && *l > 0.0) {
                return Err(RobotError::Value { what: format!("link_{}_m", i + 1), value: *l, must: "a positive length" });
            }
        }
        let [h11, h22, h12] = inertia_kg_m2;
        if !(h11 > 0.0 && h22 > 0.0 && h12 * h12 < h11 * h22) {
            return Err(RobotError::Body(format!(
                "the five-bar's inertia H11 {h11}, H22 {h22}, H12 {h12} is not symmetric positive definite; an inertia has to be"
            )));
        }
        joints.check()?;
        let axes = ["x", "y"].map(Axis::linear).to_vec();
        Ok(FiveBar { links_m, base_m, inertia_kg_m2, joints, axes })
    }
}

impl Robot for FiveBar {
    fn axes(&self) -> &[Axis] {
        &self.axes
    }

    fn joints(&self) -> &Joints {
        &self.joints
    }

    fn kinematics(&self, q: &[f64], rates: &[f64], out: &mut EndpointKinematics) {
        let ((s1, c1), (s2, c2)) = (q[0].sin_cos(), q[1].sin_cos());
        let [l1, l2] = self.links_m;
        let (x1, y1, x2, y2) = (l1 * c1, l1 * s1, l2 * c2, l2 * s2);
        out.endpoint.copy_from_slice(&[self.base_m[0] + x1 + x2, self.base_m[1] + y1 + y2]);
        out.jacobian.copy_from_slice(&[-y1, -y2, x1, x2]);
        let (w1, w2) = (rates[0] * rates[0], rates[1] * rates[1]);
        out.jacobian_rate.copy_from_slice(&[-(x1 * w1 + x2 * w2), -(y1 * w1 + y2 * w2)]);
    }

    fn mass_matrix(&self, q: &[f64], out: &mut [f64]) {
        let [h11, h22, h12] = self.inertia_kg_m2;
        let coupling = h12 * (q[0] - q[1]).cos();
        out.copy_from_slice(&[h11, coupling, coupling, h22]);
    }

    fn bias(&self, q: &[f64], rates: &[f64], out: &mut [f64]) {
        let s = self.inertia_kg_m2[2] * (q[0] - q[1]).sin();
        out.copy_from_slice(&[s * rates[1] * rates[1], -s * rates[0] * rates[0]]);
    }

    fn inverse_kinematics(&self, target: &[f64]) -> Result<Vec<f64>, RobotError> {
        let &[x, y] = target else { return Err(RobotError::Length { what: "hand_m", found: target.len(), expected: 2 }) };
        let ([l1, l2], x, y) = (self.links_m, x - self.base_m[0], y - self.base_m[1]);
        let Some([first, elbow]) = planar_angles(self.links_m, 1.0, [x, y]) else {
            let (near, far) = ((l1 - l2).abs(), l1 + l2);
            let why = format!("it lies {:.3} m from the base, links of {l1} m and {l2} m reach {near:.3} to {far:.3} m", x.hypot(y));
            return Err(RobotError::Reach { who: "the robot".to_owned(), target: target.to_vec(), why });
        };
        Ok(vec![first, first + elbow])
    }

    /// Under the names of the registry's table.
    fn parameters(&self) -> Vec<RobotParameter> {
        let ([l1, l2], [x, y], [h11, h22, h12]) = (self.links_m, self.base_m, self.inertia_kg_m2);
        let joints = &self.joints;
        [
            ("link_1_m", "m", l1, Meaning::Geometry),
            ("link_2_m", "m", l2, Meaning::Geometry),
            ("base_x_m", "m", x, Meaning::Setting),
            ("base_y_m", "m", y, Meaning::Setting),
            ("inertia_11_kg_m2", "kg m^2", h11, Meaning::Inertia),
            ("inertia_22_kg_m2", "kg m^2", h22, Meaning::Inertia),
            ("inertia_12_kg_m2", "kg m^2", h12, Meaning::Inertia),
            ("coulomb_1_nm", "N m", joints.coulomb[0], Meaning::Friction),
            ("coulomb_2_nm", "N m", joints.coulomb[1], Meaning::Friction),
            ("friction_velocity_rad_per_s", "rad/s", joints.smoothing[0], Meaning::Setting),
            ("viscous_1_nm_s_per_rad", "N m s/rad", joints.viscous[0], Meaning::Friction),
            ("viscous_2_nm_s_per_rad", "N m s/rad", joints.viscous[1], Meaning::Friction),
        ]
        .map(|(name, unit, value, meaning)| RobotParameter::new(name, unit, value, meaning))
        .to_vec()
    }

    fn with_parameters(&self, values: &[f64]) -> Result<Box<dyn Robot>, RobotError> {
        let &[l1, l2, x, y, h11, h22, h12, c1, c2, smooth, v1, v2] = values else {
            return Err(RobotError::Length { what: "the list of parameters", found: values.len(), expected: 12 });
        };
        let joints = Joints { coulomb: vec![c1, c2], viscous: vec![v1, v2], smoothing: vec![smooth; 2], ..self.joints.clone() };
        Ok(Box::new(FiveBar::new([l1, l2], [x, y], [h11, h22, h12], joints)?))
    }

    fn gravity_compensation(&self) -> f64 {
        0.0
    }

    /// The workspace's centre.
    fn home(&self) -> Result<Vec<f64>, RobotError> {
        self.inverse_kinematics(&[0.0, 0.0])
    }

    fn acceleration(&self, _q: &[f64], rates: &[f64], kinematics: &EndpointKinematics, torque: &[f64], _work: &mut [f64], out: &mut [f64]) {
        // The Jacobian's columns are the links as vectors, turned by 90°: their products hold cos and sin of q₁ − q₂.
        let j = &kinematics.jacobian;
        let [h11, h22, h12] = self.inertia_kg_m2;
        let scale = h12 / (self.links_m[0] * self.links_m[1]);
        let (c, s) = (scale * (j[0] * j[1] + j[2] * j[3]), scale * (j[1] * j[2] - j[0] * j[3]));
        let (t1, t2) = (torque[0] - s * rates[1] * rates[1], torque[1] + s * rates[0] * rates[0]);
        let scale = 1.0 / (h11 * h22 - c * c);
        out[0] = (h22 * t1 - c * t2) * scale;
        out[1] = (h11 * t2 - c * t1) * scale;
    }
}

/// The robot of the published recordings.
pub(crate) static MIT_MANUS: DeviceEntry = DeviceEntry {
    name: "mit-manus",
    description: "planar five-bar robot, endpoint inertia about 1 kg, anisotropy at most 2:1 within 5 cm of the centre",
    parameters: &MIT_MANUS_PARAMETERS,
    source: "Palazzolo et al., IEEE Trans. Neural Syst. Rehabil. Eng. 15 (2007) 92; inertias tuned to its endpoint figures",
    build: build_planar,
};

/// Its commercial successor.
pub(crate) static IN_MOTION_2: DeviceEntry = DeviceEntry {
    name: "inmotion2",
    description: "planar five-bar robot, commercial successor of MIT-MANUS, with its sensor and handle; holds up to 5000 N/m in place of 2000",
    parameters: &IN_MOTION_2_PARAMETERS,
    source: "inertias, links and limits from the robot's public control software",
    build: build_planar,
};

const fn planar(h11: f64, h22: f64, h12: f64, stiffness_limit: f64) -> [DeviceParameter; 18] {
    [
        parameter("link_1_m", "m", 0.4064, "length of the upper link"),
        parameter("link_2_m", "m", 0.51435, "length of the forearm link"),
        parameter("base_x_m", "m", 0.0, "motor axis, from the workspace's centre"),
        parameter("base_y_m", "m", -0.65, "motor axis, from the workspace's centre"),
        parameter("inertia_11_kg_m2", "kg m^2", h11, "inertia on the upper link's angle"),
        parameter("inertia_22_kg_m2", "kg m^2", h22, "inertia on the forearm's angle"),
        parameter("inertia_12_kg_m2", "kg m^2", h12, "coupling inertia, times the cosine of the angle between"),
        parameter("coulomb_1_nm", "N m", 0.27, "dry friction of the upper link's motor"),
        parameter("coulomb_2_nm", "N m", 0.34, "dry friction of the forearm's motor"),
        parameter("friction_velocity_rad_per_s", "rad/s", 0.005, "speed over which dry friction builds up"),
        parameter("viscous_1_nm_s_per_rad", "N m s/rad", 0.01, "viscous friction of the upper link's motor"),
        parameter("viscous_2_nm_s_per_rad", "N m s/rad", 0.01, "viscous friction of the forearm's motor"),
        parameter("torque_limit_nm", "N m", 29.0, "largest motor torque"),
        parameter("force_limit_n", "N", 45.0, "largest commanded force"),
        parameter("stiffness_limit_n_per_m", "N/m", stiffness_limit, "largest stiffness of the hold"),
        parameter("force_range_n", "N", 130.0, "range of the force transducer on each axis (ATI Gamma US-30-100)"),
        parameter("transducer_stiffness_n_per_m", "N/m", 1e6, "stiffness of the force transducer"),
        parameter("transducer_damping_n_s_per_m", "N s/m", 800.0, "damping of the force transducer"),
    ]
}

static MIT_MANUS_PARAMETERS: [DeviceParameter; 18] = planar(0.215, 0.180, 0.030, 2000.0);
static IN_MOTION_2_PARAMETERS: [DeviceParameter; 18] = planar(0.391, 0.228, 0.227, 5000.0);

fn build_planar(p: &DeviceParameters) -> Result<Device, DeviceError> {
    let v = |name| p.value(name);
    let joints = Joints {
        coulomb: vec![v("coulomb_1_nm"), v("coulomb_2_nm")],
        viscous: vec![v("viscous_1_nm_s_per_rad"), v("viscous_2_nm_s_per_rad")],
        smoothing: vec![v("friction_velocity_rad_per_s"); 2],
        torque_limit: vec![v("torque_limit_nm"); 2],
        ..Joints::ideal(&["1", "2"])
    };
    let inertia = [v("inertia_11_kg_m2"), v("inertia_22_kg_m2"), v("inertia_12_kg_m2")];
    let robot = FiveBar::new([v("link_1_m"), v("link_2_m")], [v("base_x_m"), v("base_y_m")], inertia, joints)?;
    let transducer = translational(v("transducer_stiffness_n_per_m"), v("transducer_damping_n_s_per_m"))?;
    for name in ["stiffness_limit_n_per_m", "force_range_n", "force_limit_n"] {
        DeviceError::positive(name, v(name))?;
    }
    let defaults = LoopDefaults {
        kp: 100.0,
        kd: 5.0,
        force_limit: v("force_limit_n"),
        force_noise_rms: 0.03,
        force_quantum: 0.025,
        force_range: v("force_range_n"),
        stiffness_limit: v("stiffness_limit_n_per_m"),
    };
    Ok(Device { robot: Box::new(robot), transducer, defaults })
}
