//! How sure a name is: a logistic function of what the search saw.
//!
//! The coefficients have the signs that physics demands (a rival or a gain of the generic model lowers, a margin or a share raises).
//! Their sizes are set by hand: a fit to 257 names was calibrated no better, neither on names left out nor on another seed. How well they hold is
//! counted by the exam (`bash tests/exam/run`).

use serde::{Deserialize, Serialize};

/// Number of features.
pub const FEATURES: usize = 7;

/// What the search saw of the cause that it names.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Features(pub [f64; FEATURES]);

/// Coefficients of the logistic function, the constant first.
const COEFFICIENTS: [f64; FEATURES + 1] = [1.0, 0.25, -0.8, 0.35, -3.0, -1.0, 1.0, 0.2];

impl Features {
    /// Features from penalised gains of the best and of the next other effect, from the gate, and from shares of the residual.
    pub(crate) fn new(best: f64, next: f64, beyond: f64, named: f64, generic_share: f64, share: f64, size: f64) -> Self {
        let (best, next) = (best.max(1e-3), next.max(1e-3));
        Features([
            best.ln().clamp(-2.0, 10.0),
            (next / best).clamp(0.0, 1.0),
            (best - next).max(0.0).ln_1p(),
            (beyond.max(0.0) / (named.max(1.0) + beyond.max(0.0))).clamp(0.0, 1.0),
            generic_share.clamp(0.0, 1.0),
            share.clamp(0.0, 1.0),
            size.max(1e-6).log10().clamp(-4.0, 1.0),
        ])
    }

    /// The probability that the name is right.
    pub fn probability(&self) -> f64 {
        let sum = COEFFICIENTS[0] + self.0.iter().zip(&COEFFICIENTS[1..]).map(|(f, c)| f * c).sum::<f64>();
        (1.0 / (1.0 + (-sum).exp())).clamp(0.001, 0.999)
    }
}
