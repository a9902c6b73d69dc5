//! The best that a linear model can do, whatever its structure: a state-space model of any order by a subspace method.
//!
//! What it leaves on held-out data is not linear, not time-invariant, or noise.

mod error;
mod output_error;
mod select;
mod subspace;

pub use error::SubspaceError;
pub use select::{Candidate, Selection, select};
pub use subspace::Subspace;

use ndarray::Array2;
use ndof_linear::eigen;
use ndof_linear::square;
use num_complex::Complex64;
use serde::{Deserialize, Serialize};

/// x⁺ = A x + B u, y = C x + D u, in samples.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StateSpace {
    /// n × n.
    pub a: Array2<f64>,
    /// n × inputs.
    pub b: Array2<f64>,
    /// outputs × n.
    pub c: Array2<f64>,
    /// outputs × inputs.
    pub d: Array2<f64>,
    /// Constant of each output.
    pub offset: Vec<f64>,
}

/// Inputs and outputs of one trial, one slice a channel.
#[derive(Clone, Debug)]
pub struct LinearTrial<'a> {
    /// u.
    pub inputs: Vec<&'a [f64]>,
    /// y.
    pub outputs: Vec<&'a [f64]>,
}

impl LinearTrial<'_> {
    fn samples(&self) -> usize {
        self.outputs.first().map_or(0, |y| y.len())
    }
}

impl StateSpace {
    /// Number of states.
    pub fn order(&self) -> usize {
        self.a.nrows()
    }

    /// Outputs from the inputs alone, from an initial state.
    ///
    /// ```
    /// use ndarray::array;
    /// use ndof_models::state_space::StateSpace;
    /// let lag = StateSpace { a: array![[0.5]], b: array![[1.0]], c: array![[1.0]], d: array![[0.0]], offset: vec![0.0] };
    /// assert_eq!(lag.simulate(&[&[1.0, 0.0, 0.0]], &[0.0]), [[0.0, 1.0, 0.5]]);
    /// ```
    pub fn simulate(&self, inputs: &[&[f64]], initial: &[f64]) -> Vec<Vec<f64>> {
        let (n, p, q) = (self.order(), self.c.nrows(), inputs.len());
        let samples = inputs.first().map_or(0, |u| u.len());
        let mut x = initial.to_vec();
        let mut out = vec![Vec::with_capacity(samples); p];
        let mut u = vec![0.0; q];
        for k in 0..samples {
            u.iter_mut().zip(inputs).for_each(|(u, channel)| *u = channel[k]);
            for (i, y) in out.iter_mut().enumerate() {
                let own: f64 = (0..n).map(|j| self.c[[i, j]] * x[j]).sum();
                y.push(own + (0..q).map(|j| self.d[[i, j]] * u[j]).sum::<f64>() + self.offset[i]);
            }
            x = (0..n).map(|i| (0..n).map(|j| self.a[[i, j]] * x[j]).sum::<f64>() + (0..q).map(|j| self.b[[i, j]] * u[j]).sum::<f64>()).collect();
        }
        out
    }

    /// C (z I − A)⁻¹ B + D at a frequency, outputs × inputs; `None` at a pole.
    pub fn response(&self, frequency_hz: f64, sample_rate_hz: f64) -> Option<Vec<Vec<Complex64>>> {
        let (n, z) = (self.order(), Complex64::from_polar(1.0, std::f64::consts::TAU * frequency_hz / sample_rate_hz));
        let flat: Vec<Complex64> = (0..n * n).map(|e| if e / n == e % n { z } else { Complex64::default() } - self.a[[e / n, e % n]]).collect();
        let inverse = square::inverse(&flat, n)?;
        let cell = |i: usize, j: usize| -> Complex64 {
            let sum: Complex64 = (0..n * n).map(|e| self.c[[i, e / n]] * inverse[e] * self.b[[e % n, j]]).sum();
            sum + self.d[[i, j]]
        };
        Some((0..self.c.nrows()).map(|i| (0..self.b.ncols()).map(|j| cell(i, j)).collect()).collect())
    }

    /// Eigenvalues of A; inside the unit circle if the model is stable.
    pub fn poles(&self) -> Vec<Complex64> {
        eigen(&self.a).map_or_else(Vec::new, |(values, _)| values)
    }

    /// Frequency (in the unit of the rate) and damping ratio of each oscillating mode, in order of frequency.
    pub fn modes(&self, sample_rate_hz: f64) -> Vec<[f64; 2]> {
        let mut out: Vec<[f64; 2]> = self
            .poles()
            .into_iter()
            .filter(|z| z.im > 1e-9)
            .map(|z| {
                let s = z.ln() * sample_rate_hz;
                [s.norm() / std::f64::consts::TAU, -s.re / s.norm()]
            })
            .collect();
        out.sort_by(|a, b| a[0].total_cmp(&b[0]));
        out
    }
}
