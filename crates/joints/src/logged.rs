//! What may be wrong with a log itself.

/// What is taken off a log before it is compared.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Logged {
    /// How late each torque is logged (s).
    pub late_s: Vec<f64>,
    /// How many times too large it is.
    pub gain: Vec<f64>,
    /// How far the zero of each angle is off (rad).
    pub zero: Vec<f64>,
    /// How the base is turned: axis times angle (rad).
    pub tilt: [f64; 3],
}

impl Logged {
    pub fn as_it_is(joints: usize) -> Self {
        Logged { late_s: vec![0.0; joints], gain: vec![1.0; joints], zero: vec![0.0; joints], tilt: [0.0; 3] }
    }
}
