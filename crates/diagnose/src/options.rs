//! What a user may ask of a diagnosis.

use crate::linear_fit::LinearFit;
use crate::movement::Schedule;
use ndof_models::ForceLaw;
use ndof_models::effects::Effect;
use std::sync::Arc;

/// Which part of the recordings the fit does not see.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum HeldOut {
    /// Of several trials the last third, of one the last 30 % of its time.
    #[default]
    Auto,
    /// The trials with these indices.
    Trials(Vec<usize>),
    /// From the first to the second time of every trial, in seconds since its first sample.
    Time(f64, f64),
}

/// The arm whose hand the recording shows, with the hand at the mean of the displacements.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KnownArm {
    /// Upper arm and forearm to the hand (m).
    pub link_lengths_m: [f64; 2],
    /// Angle of the upper arm from +x and of the forearm from the upper arm (rad).
    pub posture_rad: [f64; 2],
    /// Mean force on the hand (N); that of the recording where it is not given.
    pub mean_force_n: Option<[f64; 2]>,
}

/// Settings of a diagnosis.
#[derive(Clone)]
pub struct Options {
    /// The band that is analysed; found from the data where it is not given.
    pub band_hz: Option<(f64, f64)>,
    /// What is held out.
    pub held_out: HeldOut,
    /// Discrepancy that does not matter, as a share of the signal's standard deviation.
    pub tolerance: f64,
    /// Seed of the bootstrap on the robot's side, and of what a plan simulates.
    pub seed: u64,
    /// Effects that the search leaves out.
    pub without: Vec<String>,
    /// Whether the experiment that would tell confusable causes apart is looked for by simulating it.
    pub plan: bool,
    /// Effects that are tried beside those of the registry.
    pub own: Vec<&'static Effect>,
    /// Forces that every model has, the baseline, too; displacements are taken from their mean.
    pub known: Vec<Arc<dyn ForceLaw>>,
    /// The linear model that is judged where no baseline is given; without it the one that balances the forces best.
    pub linear: Option<LinearFit>,
    /// What stiffness and damping may follow; without it nothing of the kind is tried.
    pub schedule: Option<Schedule>,
    /// The arm, whose geometry is then a cause like any other; without it nothing of the kind is tried.
    pub arm: Option<KnownArm>,
    /// Whether the effort that the causes add along every whole trial is computed, for a simulator that is to run with it.
    pub added: bool,
}

impl Default for Options {
    fn default() -> Self {
        Options {
            band_hz: None,
            held_out: HeldOut::Auto,
            tolerance: 0.01,
            seed: 0,
            without: Vec::new(),
            plan: false,
            own: Vec::new(),
            known: Vec::new(),
            linear: None,
            schedule: None,
            arm: None,
            added: false,
        }
    }
}
