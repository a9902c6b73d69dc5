//! What the sensors do to force and joint angles.

use serde::{Deserialize, Serialize};

/// What a sample stands for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Averaging {
    /// The mean of force and motion over the interval in which the command was held.
    #[default]
    Interval,
    /// The value just before the new command: the sampling trap, which biases the damping of a light limb.
    Instant,
}

/// Settings of the sensors; what is left out is the device's.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Sensors {
    /// White noise of each force channel (N rms, N m rms).
    pub force_noise_rms: Option<f64>,
    /// Resolution of the force channels (N, N m); 0 for none.
    pub force_quantum: Option<f64>,
    /// Bits of the encoders over a turn; 0 for ideal ones.
    pub encoder_bits: Option<u32>,
    /// What a sample stands for.
    pub averaging: Averaging,
}

impl Default for Sensors {
    fn default() -> Self {
        Sensors { force_noise_rms: None, force_quantum: None, encoder_bits: None, averaging: Averaging::Interval }
    }
}

/// Rounds to a multiple of `quantum`; 0 leaves the value as it is.
pub(crate) fn quantise(value: f64, quantum: f64) -> f64 {
    if quantum > 0.0 { (value / quantum).round() * quantum } else { value }
}

impl Sensors {
    /// Encoder steps a turn: the device's own count unless bits are given, infinite for ideal encoders.
    pub(crate) fn encoder_counts(&self, own: f64) -> f64 {
        match self.encoder_bits {
            None => own,
            Some(0) => f64::INFINITY,
            Some(bits) => 2f64.powi(bits.min(64) as i32),
        }
    }
}
