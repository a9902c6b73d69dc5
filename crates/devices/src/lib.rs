//! Rehabilitation robots, limbs, controllers and sensors, simulated.
//!
//! An [`Experiment`] is data: device, limb, posture, controller, sensors. [`simulate_trial`] turns it and a commanded
//! excitation into a recording; [`linearise`] gives the linear model that the simulation follows for small motions.

#![allow(clippy::needless_range_loop, reason = "kernels over several arrays at one index read better with the index")]

mod chain;
mod controller;
mod coupled;
mod error;
mod experiment;
mod exponential;
mod five_bar;
mod history;
mod integrate;
mod limb;
mod linearise;
mod matrix;
mod noise;
mod parameters;
mod posture_hold;
mod registry;
mod robot;
mod safety;
mod sensors;
mod simulate;
mod transducer;
mod vector3;
mod wrist;

pub use chain::{EndEffectorConfig, HoldConfig, JointConfig, JointKind, MAX_JOINTS, RobotConfig, SerialChain, TransducerConfig};
pub use controller::{Controller, PerAxis, Safety};
pub use error::DeviceError;
pub use experiment::{Bench, DeviceConfig, Experiment, LimbConfig, Posture, linearise};
pub use five_bar::FiveBar;
pub use integrate::Accuracy;
pub use limb::{
    EndpointLinear, EndpointLinearConfig, Impedance, Limb, PlanarTwoLink, PlanarTwoLinkConfig, SPRING_CONFIGURATIONS, Side, SpringArray, SpringArrayConfig,
    SpringConfiguration, Tone, Wrist, WristConfig,
};
pub use linearise::{HoldGains, Linearised};
pub use noise::LimbNoise;
pub use parameters::{Parameter, Parameters};
pub use registry::{DEVICES, Device, DeviceEntry, LIMBS, LimbEntry, LoopDefaults, device};
pub use robot::{Axis, Joints, Kinematics, Robot};
pub use sensors::{Averaging, Sensors};
pub use simulate::{Extras, StageMaker, simulate_trial};
pub use transducer::Transducer;
pub use wrist::WristRobot;
