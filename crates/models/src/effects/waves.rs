//! Curves over a schedule, and entries of a matrix that follow them.

use super::matrix::Matrix;
use crate::force_law::{ForceLaw, Motion};
use std::f64::consts::{PI, TAU};

/// A curve about zero over u from 0 to 1: cos 2πu, sin 2πu, cos 4πu … over a cycle, else cos πu, cos 2πu … from end to end.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Waves {
    /// How many.
    pub count: usize,
    /// Whether the end is the beginning.
    pub closed: bool,
}

impl Waves {
    /// Wave `k` at `u`.
    pub fn at(self, k: usize, u: f64) -> f64 {
        match (self.closed, k % 2) {
            (false, _) => (PI * (k + 1) as f64 * u).cos(),
            (true, 0) => (TAU * (k / 2 + 1) as f64 * u).cos(),
            (true, _) => (TAU * (k / 2 + 1) as f64 * u).sin(),
        }
    }

    /// The curve with these coefficients at `u`.
    pub fn sum(self, coefficients: &[f64], u: f64) -> f64 {
        coefficients.iter().enumerate().filter(|(_, c)| **c != 0.0).map(|(k, c)| c * self.at(k, u)).sum()
    }
}

/// Entries of a matrix that follow the schedule about the value that the baseline gives them.
#[derive(Clone, Debug, PartialEq)]
pub struct ScheduledMatrix {
    /// Which matrix: stiffness or damping.
    pub matrix: Matrix,
    /// Places of each entry: two where the matrix is symmetric.
    pub entries: Vec<Vec<(usize, usize)>>,
    /// The curve of each entry.
    pub waves: Waves,
}

impl ScheduledMatrix {
    /// The force law with these coefficients, those of one entry side by side: f_i = κ(s) x_j, or κ(s) ẋ_j.
    pub fn law(&self, coefficients: &[f64]) -> Box<dyn ForceLaw> {
        let (own, coefficients) = (self.clone(), coefficients.to_vec());
        Box::new(move |motion: &Motion<'_>, force: &mut [f64]| {
            let of = if own.matrix == Matrix::Damping { motion.velocity } else { motion.position };
            for (entry, places) in own.entries.iter().enumerate().filter(|_| motion.schedule.is_finite()) {
                let value = own.curve(&coefficients, entry, motion.schedule);
                places.iter().filter(|_| value != 0.0).for_each(|(i, j)| force[*i] += value * of[*j]);
            }
        })
    }

    /// The curve of an entry at `u`, its mean left out.
    pub fn curve(&self, coefficients: &[f64], entry: usize, u: f64) -> f64 {
        self.waves.sum(&coefficients[entry * self.waves.count..(entry + 1) * self.waves.count], u)
    }
}
