//! What a user decides of a judgement.

use ndof_diagnose::HeldOut;

/// Settings of a judgement of joint logs.
#[derive(Clone, Debug, PartialEq)]
pub struct Options {
    /// What is held out.
    pub held_out: HeldOut,
    /// Torque that does not matter, as a share of each joint's standard deviation.
    pub tolerance: f64,
    /// Probability with which anything may be named where nothing is missing.
    pub false_alarms: f64,
    /// Causes that the search leaves out.
    pub without: Vec<String>,
}

impl Default for Options {
    fn default() -> Self {
        Options { held_out: HeldOut::Auto, tolerance: 0.01, false_alarms: 0.01, without: Vec::new() }
    }
}
