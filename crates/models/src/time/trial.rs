//! What a fit in time is given, and what of it drives the model.

use super::error::FreeRunError;
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slopes_of_a_parabola_are_exact_inside_and_one_sided_at_the_ends() {
        let x: Vec<f64> = (0..9).map(|k| 3.0 + 0.5 * f64::from(k * k)).collect();
        let v = slope(&x, 10.0);
        assert!((1..8).all(|k| (v[k] - 10.0 * k as f64).abs() < 1e-12) && (v[0], v[8]) == (5.0, 75.0), "{v:?}");
        assert_eq!((slope(&[4.0], 10.0), slope(&[], 10.0)), (vec![0.0], vec![]));
    }

    #[test]
    fn the_integral_of_a_rising_velocity_is_a_parabola_about_its_mean() {
        let v: Vec<f64> = (0..5).map(|k| 2.0 + f64::from(k)).collect();
        // Trapezoids of 2 to 6 at 4 Hz: 0, 2.5, 6, 10.5, 16 quarters, less their mean of 7.
        let want = [0.0, 2.5, 6.0, 10.5, 16.0].map(|x| (x - 7.0) / 4.0);
        assert!(sum(&v, 4.0).iter().zip(want).all(|(a, b)| (a - b).abs() < 1e-12), "{:?}", sum(&v, 4.0));
        assert!(sum(&[], 4.0).is_empty());
    }

    #[test]
    fn what_moves_has_one_channel_an_axis_of_one_length() {
        let (long, short) = ([0.0; 8], [0.0; 7]);
        let fits = |causality, force: &[&[f64]], motion: &[&[f64]], velocity: &[&[f64]]| {
            let trial = TimeTrial { force: force.to_vec(), motion: motion.to_vec(), velocity: velocity.to_vec() };
            Prepared::new(&trial, 1, 1, causality, 10.0, None).is_ok()
        };
        let l: &[f64] = &long;
        let s: &[f64] = &short;
        for (motion, velocity, expected) in [
            (&[l][..], &[][..], true),
            (&[l], &[l], true),
            (&[], &[l], true),
            (&[], &[], false),
            (&[s], &[l], false),
            (&[l], &[s], false),
            (&[s], &[], false),
            (&[l, l], &[], false),
        ] {
            assert_eq!(fits(Causality::MotionIn, &[l], motion, velocity), expected, "{} {}", motion.len(), velocity.len());
        }
        assert!(fits(Causality::ForceIn, &[l], &[l], &[]) && !fits(Causality::ForceIn, &[l], &[], &[l]) && !fits(Causality::ForceIn, &[l, l], &[l], &[]));
    }
}
