//! The devices and limbs that there are.

use crate::error::DeviceError;
use crate::five_bar::FiveBar;
use crate::parameters::{Parameter, Parameters, parameter};
use crate::robot::{Joints, Robot};
use crate::transducer::Transducer;
use crate::wrist::{WRIST, build_wrist};

/// What an experiment takes from its device where it says nothing itself.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LoopDefaults {
    /// Stiffness of the hold (N/m, N m/rad).
    pub kp: f64,
    /// Damping of the hold (N s/m, N m s/rad).
    pub kd: f64,
    /// Largest commanded force (N, N m).
    pub force_limit: f64,
    /// Noise of the force channels (N rms, N m rms).
    pub force_noise_rms: f64,
    /// Resolution of the force channels (N, N m).
    pub force_quantum: f64,
    /// Largest force that the transducer shows on an axis (N, N m).
    pub force_range: f64,
    /// Largest stiffness of the hold that the robot is made for (N/m, N m/rad).
    pub stiffness_limit: f64,
}

/// A robot with its transducer and its habits.
pub struct Device {
    /// The rigid-body model.
    pub robot: Box<dyn Robot>,
    /// The force transducer.
    pub transducer: Transducer,
    /// Settings that an experiment may leave out.
    pub defaults: LoopDefaults,
}

/// One entry of [`DEVICES`].
pub struct DeviceEntry {
    /// The name in an experiment.
    pub name: &'static str,
    /// What it is.
    pub description: &'static str,
    /// Its parameters.
    pub parameters: &'static [Parameter],
    /// Where its numbers come from.
    pub source: &'static str,
    /// Builds it.
    pub build: fn(&Parameters) -> Result<Device, DeviceError>,
}

/// One entry of [`LIMBS`].
pub struct LimbEntry {
    /// The name in an experiment.
    pub name: &'static str,
    /// What it is.
    pub description: &'static str,
    /// Its keys; the default is NaN where a key must be given or is a matrix.
    pub parameters: &'static [Parameter],
    /// Where its numbers come from.
    pub source: &'static str,
}

const fn planar(h11: f64, h22: f64, h12: f64, stiffness_limit: f64) -> [Parameter; 18] {
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

static MIT_MANUS: [Parameter; 18] = planar(0.215, 0.180, 0.030, 2000.0);
static IN_MOTION_2: [Parameter; 18] = planar(0.391, 0.228, 0.227, 5000.0);

fn build_planar(p: &Parameters) -> Result<Device, DeviceError> {
    let v = |name| p.value(name);
    let joints = Joints {
        coulomb: vec![v("coulomb_1_nm"), v("coulomb_2_nm")],
        viscous: vec![v("viscous_1_nm_s_per_rad"), v("viscous_2_nm_s_per_rad")],
        smoothing: vec![v("friction_velocity_rad_per_s"); 2],
        torque_limit: vec![v("torque_limit_nm"); 2],
        ..Joints::ideal(2)
    };
    joints.check()?;
    let inertia = [v("inertia_11_kg_m2"), v("inertia_22_kg_m2"), v("inertia_12_kg_m2")];
    let robot = FiveBar::new([v("link_1_m"), v("link_2_m")], [v("base_x_m"), v("base_y_m")], inertia, joints)?;
    let transducer = Transducer::new(v("transducer_stiffness_n_per_m"), v("transducer_damping_n_s_per_m"))?;
    for name in ["stiffness_limit_n_per_m", "force_range_n", "force_limit_n"] {
        if v(name) <= 0.0 {
            return Err(DeviceError::value(name, v(name), "positive"));
        }
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

/// The devices that there are.
pub static DEVICES: &[DeviceEntry] = &[
    DeviceEntry {
        name: "mit-manus",
        description: "planar five-bar robot, endpoint inertia about 1 kg, anisotropy at most 2:1 within 5 cm of the centre",
        parameters: &MIT_MANUS,
        source: "Palazzolo et al., IEEE Trans. Neural Syst. Rehabil. Eng. 15 (2007) 92; inertias tuned to its endpoint figures",
        build: build_planar,
    },
    DeviceEntry {
        name: "inmotion2",
        description: "planar five-bar robot, commercial successor of MIT-MANUS, with its sensor and handle; holds up to 5000 N/m in place of 2000",
        parameters: &IN_MOTION_2,
        source: "inertias, links and limits from the robot's public control software",
        build: build_planar,
    },
    DeviceEntry {
        name: "wrist",
        description: "wrist robot of InMotion3's kind: pronation/supination, flexion/extension, abduction/adduction, in joint angles",
        parameters: &WRIST,
        source: "differential, ratios and encoders from the robot's public control software; inertias, friction and gravity are ours",
        build: build_wrist,
    },
];

/// The limbs that there are.
pub static LIMBS: &[LimbEntry] = &[
    LimbEntry {
        name: "endpoint-linear",
        description: "M, B, K at the endpoint, for any device",
        parameters: &[
            parameter("M", "kg", f64::NAN, "inertia matrix"),
            parameter("B", "N s/m", f64::NAN, "damping matrix"),
            parameter("K", "N/m", f64::NAN, "stiffness matrix"),
            parameter("mean_force_n", "N", 0.0, "force on the limb that holds it at the posture, one number an axis"),
            parameter("handle_mass_kg", "kg", 0.0, "mass fastened to the hand beyond the transducer"),
            parameter("noise", "", f64::NAN, "force made by the limb itself: rms_n, cutoff_hz"),
        ],
        source: "",
    },
    LimbEntry {
        name: "planar-two-link",
        description: "upper arm and forearm with joint inertia, damping and stiffness, nonlinear geometry",
        parameters: &[
            parameter("height_m", "m", f64::NAN, "body height, sets the segments with body_mass_kg"),
            parameter("body_mass_kg", "kg", f64::NAN, "body mass"),
            parameter("link_lengths_m", "m", f64::NAN, "upper arm and forearm; 0.33 and 0.34 without height and mass"),
            parameter("link_masses_kg", "kg", f64::NAN, "1.93 and 1.52 without height and mass"),
            parameter("link_centres_m", "m", f64::NAN, "joint to centre of mass; 0.165 and 0.19 without height and mass"),
            parameter("link_inertias_kg_m2", "kg m^2", f64::NAN, "about the centre of mass; 0.0141 and 0.0188 without height and mass"),
            parameter("K", "N m/rad", f64::NAN, "joint stiffness matrix, [[15, 6], [6, 16]] by default"),
            parameter("B", "N m s/rad", f64::NAN, "joint damping matrix, [[2.3, 0.9], [0.9, 2.4]] by default"),
            parameter("mean_force_n", "N", f64::NAN, "force on the hand that holds the arm at the posture; by default that of the tone"),
            parameter("tone", "", f64::NAN, "\"normal\", \"mild-hypertonia\" (K x 2, B x 1.5, pull 4 N) or \"severe-hypertonia\" (K x 4, B x 2, pull 10 N)"),
            parameter("handle_mass_kg", "kg", 0.0, "mass moving with the hand"),
            parameter("shoulder_m", "m", f64::NAN, "place of the shoulder, in place of posture.joint_rad"),
            parameter("arm", "", f64::NAN, "\"right\" or \"left\""),
            parameter("noise", "", f64::NAN, "force made by the limb itself: rms_n, cutoff_hz"),
        ],
        source: "Shadmehr and Mussa-Ivaldi, J. Neurosci. 14 (1994) 3208; Winter, Biomechanics and Motor Control of Human Movement (2009), table 4.1",
    },
    LimbEntry {
        name: "spring-array",
        description: "handle on up to eight springs between two squares, configurations sa1 to sa9, for planar devices",
        parameters: &[
            parameter("configuration", "", f64::NAN, "sa1 to sa9"),
            parameter("springs_n_per_m", "N/m", f64::NAN, "stiffness at E, NE, N, NW, W, SW, S, SE in place of a configuration"),
            parameter("outer_half_m", "m", 0.23, "half of the outer square's side"),
            parameter("inner_half_m", "m", 0.05, "half of the inner square's side"),
            parameter("rest_length_m", "m", 0.1, "length of a spring at its initial tension"),
            parameter("initial_tension_n", "N", 0.0, "tension at the rest length"),
            parameter("mass_kg", "kg", 0.429, "mass of handle and inner square"),
            parameter("damping_ratio", "1", 0.01, "damping ratio of each axis"),
            parameter("noise", "", f64::NAN, "force made by the array itself: rms_n, cutoff_hz"),
        ],
        source: "Palazzolo et al., IEEE Trans. Neural Syst. Rehabil. Eng. 15 (2007) 92, fig. 5; stiffnesses are ours",
    },
    LimbEntry {
        name: "wrist",
        description: "hand with handle in a gimbal: coupled passive impedance in pronation, flexion and abduction, and the hand's weight",
        parameters: &[
            parameter("M", "kg m^2", f64::NAN, "inertia matrix of hand and handle in ps, fe, aa"),
            parameter("B", "N m s/rad", f64::NAN, "damping matrix"),
            parameter("K", "N m/rad", f64::NAN, "passive stiffness matrix, gravity not included"),
            parameter("hand_mass_kg", "kg", 0.45, "mass of hand and handle"),
            parameter("hand_centre_m", "m", f64::NAN, "its centre from the wrist along the forearm and across, [0.06, 0, 0]"),
            parameter("gravity_m_per_s2", "m/s^2", f64::NAN, "gravity in the forearm's frame, [0, 0, -9.81]"),
            parameter("misalignment_rpy_rad", "rad", f64::NAN, "turn of the forearm, and so of the axes of M, B, K, in the robot: roll, pitch, yaw"),
            parameter("noise", "", f64::NAN, "torque made by the limb itself: rms_n, cutoff_hz"),
        ],
        source: "Drake and Charles, Ann. Biomed. Eng. 42 (2014), for the order of the passive stiffness; figures to be confirmed",
    },
];

/// The entry called `name`.
///
/// # Errors
/// [`DeviceError::UnknownDevice`] with the names that there are.
///
/// ```
/// use ndof_devices::device;
/// assert!(device("mit-manus")?.parameters.iter().any(|p| p.name == "coulomb_1_nm" && p.unit == "N m"));
/// assert!(device("mit-manos").is_err_and(|error| error.to_string().contains("mit-manus")));
/// # Ok::<(), ndof_devices::DeviceError>(())
/// ```
pub fn device(name: &str) -> Result<&'static DeviceEntry, DeviceError> {
    DEVICES
        .iter()
        .find(|d| d.name == name)
        .ok_or_else(|| DeviceError::UnknownDevice { name: name.to_owned(), available: DEVICES.iter().map(|d| d.name).collect::<Vec<_>>().join(", ") })
}
