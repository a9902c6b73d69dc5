//! Recordings with something hidden in them, made by an integrator, a controller and sensors of their own.
//!
//! Nothing here comes from the crates under test: laws, integrator (explicit midpoint at 4 kHz), discrete controller with
//! filtered velocity, interval-averaging sensors, noise and quantisation are written again. With `other` the effects take functional forms
//! that the registry does not have.

mod balance;
pub mod draw;
pub mod exam;

mod hide;
mod laws;
mod motion;
mod plants;
mod record;
mod sensors;
mod stages;
pub mod strength;
mod true_model;

pub use plants::Plant;
pub use record::Setting;
pub use true_model::TrueModel;

use ndof_signal::Recording;
use ndof_sysid::Ports;

/// Ticks of the controller in a second, and the usual sample rate of the recordings.
pub const FS: f64 = 500.0;
/// Steps of the integrator in a tick.
pub const SUB: usize = 8;
/// Steps of the integrator in a second.
pub const FINE_HZ: f64 = FS * SUB as f64;

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

/// Makes a case. Plant, effects and noise are drawn from streams of their own, so that a case without its effect differs in nothing else.
pub fn make(case: &Case) -> Made {
    make_with(case, &Setting::default())
}

/// Makes a case that is recorded otherwise than usual.
pub fn make_with(case: &Case, setting: &Setting) -> Made {
    record::Scene::new(case, setting).play().0
}

/// Makes a case, and what the true model would predict of its held-out part.
pub fn make_with_truth(case: &Case, setting: &Setting) -> (Made, Option<TrueModel>) {
    let scene = record::Scene::new(case, setting);
    let (made, played) = scene.play();
    let truth = true_model::judged(&scene, &made, &played);
    (made, truth)
}
