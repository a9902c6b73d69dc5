//! Rehabilitation robots, limbs, controllers and sensors, simulated.
//!
//! An [`Experiment`] is data: device, limb, posture, controller, sensors. [`simulate_trial`] turns it and a commanded
//! excitation into a recording; [`linearise`] gives the linear model that the simulation follows for small motions.
//!
//! A robot is a constant model behind the trait [`Robot`], a limb one behind [`Limb`]; between them sits a stiff [`Transducer`](ndof_models::Transducer), and
//! time is stepped by an exponential Runge-Kutta method of order 4 whose linear part, that coupling included, is exact.
//! Hidden effects come as force laws and stages in [`Extras`]: no effect is known here by name.
//!
//! ```
//! use ndof_devices::{DeviceConfig, EndpointLinearConfig, Experiment, Extras, LimbConfig, linearise, simulate_trial};
//!
//! let limb = LimbConfig::EndpointLinear(EndpointLinearConfig {
//!     M: vec![vec![2.1, -0.55], vec![-0.55, 1.9]],
//!     B: vec![vec![11.0, -2.0], vec![-2.0, 15.0]],
//!     K: vec![vec![300.0, -60.0], vec![-60.0, 520.0]],
//!     ..EndpointLinearConfig::default()
//! });
//! let experiment = Experiment { duration_s: 0.2, discard_s: 0.0, ..Experiment::new(DeviceConfig::named("mit-manus"), limb) };
//! let push = vec![vec![4.0; 100], vec![0.0; 100]]; // 4 N along x
//! let recording = simulate_trial(&experiment, &push, &Extras::default(), 0)?;
//! assert_eq!(recording.names(), ["cmd_x", "cmd_y", "force_x", "force_y", "pos_x", "pos_y"]);
//! assert!(recording.channel("pos_x").is_ok_and(|x| x.samples[99] > 0.0));
//! assert_eq!(linearise(&experiment)?.limb.inertia[[0, 0]], 2.1);
//! # Ok::<(), ndof_devices::DeviceError>(())
//! ```

#![allow(clippy::needless_range_loop, reason = "kernels over several arrays at one index read better with the index")]

mod chain;
mod controller;
mod coupled;
mod device;
mod error;
mod experiment;
mod five_bar;
mod history;
mod integrate;
mod limb;
mod linearise;
mod movement;
mod noise;
mod parameters;
mod posture_hold;
mod registry;
mod safety;
mod sensors;
mod simulate;
mod transducer;
mod vector3;
mod velocity;
mod wrist;

pub use chain::{
    BaseParameter, Corrected, Correction, EndEffectorConfig, HoldConfig, JointConfig, JointKind, MAX_JOINTS, RobotConfig, SerialChain, TERMS_OF_A_LINK,
    TransducerConfig, Written, base_parameters, write_back, write_back_chain,
};
pub use controller::{Controller, PerAxis, Safety};
pub use device::{Device, DeviceEntry, LimbEntry, LoopDefaults};
pub use error::DeviceError;
pub use experiment::{Bench, DeviceConfig, Experiment, LimbConfig, Posture, linearise};
pub use five_bar::FiveBar;
pub use integrate::Accuracy;
pub use limb::{
    EndpointLinear, EndpointLinearConfig, Impedance, Limb, MovingArm, PlanarTwoLink, PlanarTwoLinkConfig, SPRING_CONFIGURATIONS, SpringArray,
    SpringArrayConfig, SpringConfiguration, Tone, Wrist, WristConfig, anatomical_axes, hand_gravity_stiffness,
};
pub use linearise::{HoldGains, Linearised};
pub use movement::Movement;
pub use ndof_models::robot::Robot;
pub use noise::LimbNoise;
pub use parameters::{DeviceParameter, DeviceParameters};
pub use registry::{DEVICES, LIMBS, device};
pub use sensors::{Averaging, Sensors};
pub use simulate::{Extras, StageMaker, simulate_trial};
pub use wrist::WristRobot;
