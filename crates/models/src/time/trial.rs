//! What a fit in time is given, and what of it drives the model.

use super::fit::FreeRunError;
use super::simulate::Drive;
use ndof_signal::{Passband, SosFilter};
use serde::{Deserialize, Serialize};
use std::ops::Range;

/// Measured force and motion of one trial, one slice an axis.
#[derive(Clone, Debug, Default)]
pub struct TimeTrial<'a> {
    /// Force on the mechanism (N, N m).
    pub force: Vec<&'a [f64]>,
    /// Its displacement (m, rad); empty where only the velocity was measured.
    pub motion: Vec<&'a [f64]>,
    /// Its velocity, where that was measured; else it follows from the displacement. Only for [`Causality::MotionIn`].
    pub velocity: Vec<&'a [f64]>,
}

/// What is imposed and what answers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Causality {
    /// The force is given; the model's motion is compared with the measured one.
    #[default]
    ForceIn,
    /// The motion is given; the model's force is compared with the measured one.
    MotionIn,
}

/// Order of the low-pass that smooths a motion before it is differentiated, forwards and backwards.
const SMOOTHING_ORDER: usize = 4;

/// A trial ready to drive a run: force, position, velocity and acceleration, one vector an axis.
pub(super) struct Prepared {
    force: Vec<Vec<f64>>,
    motion: [Vec<Vec<f64>>; 3],
    causality: Causality,
}

impl Prepared {
    pub(super) fn new(
        trial: &TimeTrial<'_>,
        number: usize,
        axes: usize,
        causality: Causality,
        rate_hz: f64,
        smooth_hz: Option<f64>,
    ) -> Result<Self, FreeRunError> {
        let samples = trial.force.first().map_or(0, |f| f.len());
        let given = |c: &Vec<&[f64]>| c.len() == axes && c.iter().all(|c| c.len() == samples);
        let moves = match causality {
            Causality::ForceIn => given(&trial.motion),
            Causality::MotionIn => {
                (given(&trial.motion) || trial.motion.is_empty()) && (given(&trial.velocity) || (trial.velocity.is_empty() && given(&trial.motion)))
            }
        };
        if !given(&trial.force) || !moves {
            return Err(FreeRunError::Shape { trial: number, force: trial.force.len(), motion: trial.motion.len(), axes });
        }
        let own = |c: &[&[f64]]| -> Vec<Vec<f64>> { c.iter().map(|c| c.to_vec()).collect() };
        let force = own(&trial.force);
        if causality == Causality::ForceIn {
            return Ok(Prepared { force, motion: [own(&trial.motion), Vec::new(), Vec::new()], causality });
        }
        let filter = smooth_hz.map(|hz| SosFilter::butterworth(SMOOTHING_ORDER, Passband::Low(hz), rate_hz)).transpose()?;
        let smooth = |c: Vec<Vec<f64>>| -> Result<Vec<Vec<f64>>, FreeRunError> {
            c.into_iter().map(|c| filter.as_ref().map_or(Ok(c.clone()), |f| f.filter_zero_phase(&c)).map_err(FreeRunError::from)).collect()
        };
        let (position, velocity) = if trial.velocity.is_empty() {
            let position = smooth(own(&trial.motion))?;
            let velocity = position.iter().map(|x| slope(x, rate_hz)).collect();
            (position, velocity)
        } else {
            let velocity = smooth(own(&trial.velocity))?;
            let position = if trial.motion.is_empty() { velocity.iter().map(|v| sum(v, rate_hz)).collect() } else { smooth(own(&trial.motion))? };
            (position, velocity)
        };
        let acceleration = velocity.iter().map(|v| slope(v, rate_hz)).collect();
        Ok(Prepared { force, motion: [position, velocity, acceleration], causality })
    }

    pub(super) fn samples(&self) -> usize {
        self.force.first().map_or(0, Vec::len)
    }

    /// What is compared with the model.
    pub(super) fn output(&self, axis: usize) -> &[f64] {
        match self.causality {
            Causality::ForceIn => &self.motion[0][axis],
            Causality::MotionIn => &self.force[axis],
        }
    }

    /// What drives the model over a stretch.
    pub(super) fn drive(&self, range: &Range<usize>) -> Drive<'_> {
        fn cut<'a>(c: &'a [Vec<f64>], range: &Range<usize>) -> Vec<&'a [f64]> {
            c.iter().map(|c| &c[range.clone()]).collect()
        }
        match self.causality {
            Causality::ForceIn => Drive::Force(cut(&self.force, range)),
            Causality::MotionIn => Drive::Motion([0, 1, 2].map(|k| cut(&self.motion[k], range))),
        }
    }
}

/// Central differences, one-sided at the ends.
pub(super) fn slope(x: &[f64], rate_hz: f64) -> Vec<f64> {
    let last = x.len().saturating_sub(1);
    (0..x.len())
        .map(|k| {
            let (a, b) = (k.saturating_sub(1), (k + 1).min(last));
            if b > a { (x[b] - x[a]) * rate_hz / (b - a) as f64 } else { 0.0 }
        })
        .collect()
}

/// The integral by the trapezoidal rule, without its mean.
fn sum(v: &[f64], rate_hz: f64) -> Vec<f64> {
    let mut total = 0.0;
    let x: Vec<f64> = (0..v.len())
        .map(|k| {
            total += if k > 0 { 0.5 * (v[k] + v[k - 1]) / rate_hz } else { 0.0 };
            total
        })
        .collect();
    let mean = x.iter().sum::<f64>() / x.len().max(1) as f64;
    x.iter().map(|x| x - mean).collect()
}
