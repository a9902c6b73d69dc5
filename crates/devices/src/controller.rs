//! The hold: a sampled proportional-derivative controller at the end effector.

use crate::linearise::HoldGains;
use crate::movement::Movement;
use crate::velocity::Velocity;
use serde::{Deserialize, Serialize};

/// One number for all axes, or one an axis.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum PerAxis {
    /// The same on every axis.
    All(f64),
    /// In the order of the device's axes.
    Each(Vec<f64>),
}

impl PerAxis {
    /// The numbers of `axes` axes, `None` if a list has another length.
    pub fn values(&self, axes: usize) -> Option<Vec<f64>> {
        match self {
            PerAxis::All(v) => Some(vec![*v; axes]),
            PerAxis::Each(list) => (list.len() == axes).then(|| list.clone()),
        }
    }
}

/// Settings of the hold, F_c = F_Δ − k_p (d − d_des) − k_d v_f (Palazzolo et al. 2007, eq. 2); what is left out is the device's.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Controller {
    /// Stiffness (N/m, N m/rad).
    pub kp: Option<PerAxis>,
    /// Damping (N s/m, N m s/rad).
    pub kd: Option<PerAxis>,
    /// Whether the robot holds the posture at all; without, it applies the perturbation only and a limb's tone carries it off.
    pub hold: bool,
    /// Cut-off of the velocity's first-order Butterworth filter (Hz).
    pub velocity_cutoff_hz: f64,
    /// Whether the desired position is moved until the limb rests at the posture under its mean force.
    pub compensate_mean_force: bool,
    /// Largest commanded force, as the length of its vector (N, N m).
    pub force_limit: Option<f64>,
    /// Step of the digital-to-analogue converters, as torque at the joints (N m): 0.029 for 12 bits on an InMotion2; 0 for none.
    pub torque_quantum: f64,
    /// Where the desired position goes; it stays at the posture where absent.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub movement: Option<Movement>,
    /// Limits that end a trial.
    pub safety: Safety,
}

/// Limits as in a clinic: a trial that passes one of them ends with an error.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Safety {
    /// Largest force on the limb, as the length of its vector (N, N m).
    pub force: Option<f64>,
    /// Largest speed of the endpoint (m/s, rad/s).
    pub speed: Option<f64>,
    /// Farthest that the endpoint may come from the posture (m, rad).
    pub distance: Option<f64>,
}

impl Default for Controller {
    fn default() -> Self {
        Controller {
            kp: None,
            kd: None,
            hold: true,
            velocity_cutoff_hz: 20.0,
            compensate_mean_force: true,
            force_limit: None,
            torque_quantum: 0.0,
            movement: None,
            safety: Safety::default(),
        }
    }
}

/// The running controller.
pub(crate) struct Hold {
    gains: HoldGains,
    rest: Vec<f64>,
    bias: Vec<f64>,
    force_limit: f64,
    velocity: Vec<Velocity>,
    output: Vec<f64>,
}

impl Hold {
    /// A hold at the endpoint `rest`, which it measures as `measured` at the start, with a constant force `bias` (from the moved d_des).
    pub(crate) fn new(gains: HoldGains, rest: &[f64], measured: &[f64], bias: Vec<f64>, force_limit: f64) -> Self {
        let velocity = measured.iter().map(|d| Velocity::at_rest(*d, gains.velocity_cutoff_hz, gains.sample_rate_hz)).collect();
        Hold { gains, rest: rest.to_vec(), bias, force_limit, velocity, output: vec![0.0; rest.len()] }
    }

    /// One tick: the measured endpoint and how far the desired one has moved in, the commanded force out.
    pub(crate) fn step(&mut self, endpoint: &[f64], moved: impl Fn(usize) -> f64, perturbation: impl Fn(usize) -> f64) -> &mut [f64] {
        for i in 0..endpoint.len() {
            let velocity = self.velocity[i].step(endpoint[i]);
            self.output[i] = perturbation(i) + self.bias[i] - self.gains.kp[i] * (endpoint[i] - self.rest[i] - moved(i)) - self.gains.kd[i] * velocity;
        }
        let length = self.output.iter().map(|f| f * f).sum::<f64>().sqrt();
        if length > self.force_limit {
            self.output.iter_mut().for_each(|f| *f *= self.force_limit / length);
        }
        &mut self.output
    }
}
