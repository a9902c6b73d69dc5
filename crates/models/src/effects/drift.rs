//! Forces that change with the time since a recording began.

use super::form::{Action, Scale};
use crate::force_law::{ForceLaw, Motion};
use num_complex::Complex64;

/// f = (t - middle) (stiffness x + force), axis by axis.
pub(super) struct Drift {
    pub middle_s: f64,
    pub stiffness: Vec<Vec<f64>>,
    pub force: Vec<f64>,
}

impl ForceLaw for Drift {
    fn evaluate(&self, motion: &Motion<'_>, _states: &[f64], force: &mut [f64], _rates: &mut [f64]) {
        let time = motion.time_s - self.middle_s;
        for (i, f) in force.iter_mut().enumerate() {
            let spring: f64 = self.stiffness.get(i).map_or(0.0, |row| row.iter().zip(motion.position).map(|(k, x)| k * x).sum());
            *f += time * (spring + self.force.get(i).copied().unwrap_or(0.0));
        }
    }
}

/// A matrix with one entry.
pub(super) fn single(n: usize, i: usize, value: f64) -> Vec<Vec<f64>> {
    (0..n).map(|r| (0..n).map(|c| if r == i && c == i { value } else { 0.0 }).collect()).collect()
}

/// A force of one axis that grows with time; it follows time whatever the motion does.
pub(super) fn ramp(axis: usize, scale: &Scale) -> Action {
    let (n, middle_s) = (scale.axes(), scale.duration_s / 2.0);
    let law = move |_: &[f64], c: &[f64]| Drift { middle_s, stiffness: vec![], force: (0..n).map(|i| if i == axis { c[0] } else { 0.0 }).collect() };
    Action::tangent(law, |_, _| Complex64::ZERO)
}
