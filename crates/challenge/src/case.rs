//! What is to be made, and what was made.

use crate::clock::FS;
use crate::plants::Plant;
use ndof_signal::{Quantity, Recording};
use ndof_sysid::Ports;

/// Something hidden.
#[derive(Clone, Debug)]
pub struct Hidden {
    /// Its name: an effect of the registry, a variety of one, or `x-…` for what no registry has; after a `/` its functional form.
    pub name: &'static str,
    /// 1 is strong.
    pub severity: f64,
}

/// What to make.
#[derive(Clone, Debug)]
pub struct Case {
    /// The experiment.
    pub plant: Plant,
    /// What is hidden in it.
    pub hidden: Vec<Hidden>,
    /// Functional forms that the registry does not have, for effects whose name has no form.
    pub other: bool,
    /// Small imperfections in every channel.
    pub background: bool,
    /// Number of recordings.
    pub trials: usize,
    /// Length of each.
    pub duration_s: f64,
    /// Of everything that is drawn.
    pub seed: u64,
    /// The commanded perturbation as a multiple of the plant's own: its size, and the end of its band.
    pub command: (f64, f64),
}

/// What was made.
pub struct Made {
    /// The trials.
    pub recordings: Vec<Recording>,
    /// Their roles.
    pub ports: Ports,
    /// Axis index of the hidden effects.
    pub axis: usize,
    /// Its name.
    pub axis_name: &'static str,
    /// True parameters, by hidden effect: (name, value).
    pub truth: Vec<Vec<(&'static str, f64)>>,
    /// The true inertia of the plant by rows, its
    pub mass: Vec<Vec<f64>>,
    /// damping,
    pub damping: Vec<Vec<f64>>,
    /// and stiffness.
    pub stiffness: Vec<Vec<f64>>,
}

/// How a case is recorded.
#[derive(Clone, Debug)]
pub struct Setting {
    /// Sample rate of the recordings; a whole fraction of 4 kHz.
    pub rate_hz: f64,
    /// What is measured of the motion.
    pub measured: Quantity,
    /// The limb's own force as a multiple of the plant's.
    pub own: f64,
    /// Whether the command swells and fades.
    pub bursts: bool,
    /// No force of the limb's own, no noise and no steps but those that are hidden.
    pub quiet: bool,
}

impl Default for Setting {
    fn default() -> Self {
        Setting { rate_hz: FS, measured: Quantity::Displacement, own: 1.0, bursts: false, quiet: false }
    }
}
