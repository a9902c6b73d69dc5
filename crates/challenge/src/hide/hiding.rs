//! What is hidden in one recording.

use crate::laws::Law;
use crate::stages::Stage;

/// True parameters by name.
pub type Truth = Vec<(&'static str, f64)>;

/// Everything that is hidden in one recording.
#[derive(Default)]
pub struct Hiding {
    pub axis: usize,
    pub laws: Vec<Law>,
    pub truth: Vec<Truth>,
    /// What stands before all channels of effort, before that of the axis, and before its motion.
    pub efforts: Vec<Stage>,
    pub effort: Vec<Stage>,
    pub motion: Vec<Stage>,
    /// Stiffness in series with the sensor.
    pub series: Option<f64>,
    /// Angle of the force sensor, and whether only its second axis reads the first.
    pub angle: f64,
    pub one_way: bool,
    pub tremor: Tremor,
    pub reflex_delay: f64,
    pub added_mass: f64,
    /// rms of the limb's own force on the axis.
    pub own: f64,
    pub robot_friction: Vec<f64>,
    pub x_step: Option<f64>,
    /// Steps that are not alike.
    pub uneven_steps: bool,
    pub(super) sizes: Sizes,
}

/// A force from outside near one frequency.
#[derive(Clone, Copy, Default)]
pub struct Tremor {
    pub amplitude: f64,
    pub frequency: f64,
    pub form: &'static str,
}

/// Typical numbers of the hidden axis: stiffness, mass, damping, displacement, effort, velocity, and a trial's length.
#[derive(Clone, Copy, Default)]
pub(super) struct Sizes {
    pub k: f64,
    pub m: f64,
    pub b: f64,
    pub x: f64,
    pub f: f64,
    pub speed: f64,
    pub duration: f64,
    /// Length of all trials.
    pub total: f64,
}
