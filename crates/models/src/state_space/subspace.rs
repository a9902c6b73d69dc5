//! Predictor-based subspace identification.

use super::error::SubspaceError;
use super::output_error::fit_inputs;
use super::{LinearTrial, StateSpace};
use faer::linalg::solvers::Solve;
use faer::{Mat, Side};
use ndarray::Array2;
use serde::{Deserialize, Serialize};

/// Settings of the subspace fit.
///
/// A long predictor y_k = Σ_j Ψ_j (u, y)_(k−j) + D u_k is fitted by least squares, which is right also within a control
/// loop; the singular values of what it says of the future are the states, and A, C follow by least squares. B, D, a
/// constant and the initial states then minimise the error of the simulation, in which they are linear. Consistent, but
/// with more scatter than a maximum-likelihood fit of the same order.
///
/// # References
/// A. Chiuso (2007), The role of vector autoregressive modeling in predictor-based subspace identification. T. McKelvey,
/// H. Akçay & L. Ljung (1996) for the last step.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Subspace {
    /// Samples of past (and of future) that the predictor sees.
    pub past: usize,
}

/// What all orders have in common: the states by their singular values.
pub(super) struct States {
    /// Singular values, largest first.
    pub singular_values: Vec<f64>,
    /// One matrix a trial: states × samples, from sample `past` on.
    pub x: Vec<Mat<f64>>,
}

/// Share of the largest diagonal that keeps nearly dependent pasts apart.
const RIDGE: f64 = 1e-12;

/// Σ r rᵀ of the rows.
fn gram(rows: &[Vec<f64>], columns: usize) -> Mat<f64> {
    let wide = Mat::from_fn(rows.len(), columns, |i, j| rows[i][j]);
    wide.transpose() * &wide
}

impl Subspace {
    /// Checks the trials and returns numbers of inputs and outputs.
    fn shape(&self, trials: &[LinearTrial<'_>]) -> Result<(usize, usize), SubspaceError> {
        let Some(first) = trials.first() else { return Err(SubspaceError::TooShort { samples: 0, unknowns: 1 }) };
        let (q, p) = (first.inputs.len(), first.outputs.len());
        for (k, t) in trials.iter().enumerate() {
            if t.inputs.len() != q || t.outputs.len() != p || t.inputs.iter().chain(&t.outputs).any(|c| c.len() != t.samples()) {
                return Err(SubspaceError::Shape { trial: k + 1 });
            }
        }
        Ok((q, p))
    }

    /// The states, from centred channels.
    pub(super) fn states(&self, trials: &[LinearTrial<'_>]) -> Result<States, SubspaceError> {
        let (q, p) = self.shape(trials)?;
        let (s, m) = (self.past.max(1), q + p);
        let unknowns = s * m + q;
        let samples: usize = trials.iter().map(|t| t.samples().saturating_sub(s)).sum();
        if samples <= 2 * unknowns {
            return Err(SubspaceError::TooShort { samples, unknowns });
        }
        // Rows: the past from the latest to the earliest (outputs, inputs), the inputs of now, the outputs of now.
        let centre = |c: &[f64]| c.iter().sum::<f64>() / c.len().max(1) as f64;
        let means: Vec<(Vec<f64>, Vec<f64>)> =
            trials.iter().map(|t| (t.inputs.iter().map(|c| centre(c)).collect(), t.outputs.iter().map(|c| centre(c)).collect())).collect();
        let row = |t: usize, k: usize| -> Vec<f64> {
            let trial = &trials[t];
            let mut out = Vec::with_capacity(unknowns + p);
            for j in 1..=s {
                out.extend((0..p).map(|i| trial.outputs[i][k - j] - means[t].1[i]));
                out.extend((0..q).map(|i| trial.inputs[i][k - j] - means[t].0[i]));
            }
            out.extend((0..q).map(|i| trial.inputs[i][k] - means[t].0[i]));
            out.extend((0..p).map(|i| trial.outputs[i][k] - means[t].1[i]));
            out
        };
        let rows: Vec<Vec<f64>> = (0..trials.len()).flat_map(|t| (s..trials[t].samples()).map(move |k| (t, k))).map(|(t, k)| row(t, k)).collect();
        let all = gram(&rows, unknowns + p);
        let largest = (0..unknowns).map(|i| all[(i, i)]).fold(0.0, f64::max);
        let left = Mat::from_fn(unknowns, unknowns, |i, j| all[(i, j)] + if i == j { RIDGE * largest } else { 0.0 });
        let right = Mat::from_fn(unknowns, p, |i, j| all[(i, unknowns + j)]);
        let psi = left.llt(Side::Lower).map_err(|_| SubspaceError::NotExcited)?.solve(&right);
        // Future i sees the past through Ψ moved by i: what the states must say.
        let past = s * m;
        let reach = Mat::from_fn(s * p, past, |r, c| {
            let (i, output) = (r / p, r % p);
            let (j, channel) = (c / m, c % m);
            if i + j < s { psi[((i + j) * m + channel, output)] } else { 0.0 }
        });
        // Singular values of reach · Z through its Gram matrix.
        let covariance = Mat::from_fn(past, past, |i, j| all[(i, j)]);
        let square = &reach * &covariance * reach.transpose();
        let eigen = square.self_adjoint_eigen(Side::Lower).map_err(|_| SubspaceError::NotExcited)?;
        let size = s * p;
        let singular_values: Vec<f64> = (0..size).rev().map(|k| eigen.S()[k].max(0.0).sqrt()).collect();
        let keep = singular_values.iter().take_while(|v| **v > 1e-10 * singular_values[0]).count().min(past);
        let project = Mat::from_fn(keep, size, |k, r| eigen.U()[(r, size - 1 - k)] / singular_values[k].sqrt());
        let onto = &project * &reach;
        let mut at = 0;
        let x = trials
            .iter()
            .map(|t| {
                let count = t.samples().saturating_sub(s);
                let z = Mat::from_fn(past, count, |i, k| rows[at + k][i]);
                at += count;
                &onto * z
            })
            .collect();
        Ok(States { singular_values, x })
    }

    /// A model with `order` states, as far as the data have them.
    ///
    /// # Errors
    /// [`SubspaceError`] if the trials are too short, do not fit together or do not move the plant.
    pub fn fit(&self, trials: &[LinearTrial<'_>], order: usize) -> Result<StateSpace, SubspaceError> {
        let states = self.states(trials)?;
        self.of_order(trials, &states, order)
    }

    pub(super) fn of_order(&self, trials: &[LinearTrial<'_>], states: &States, order: usize) -> Result<StateSpace, SubspaceError> {
        let (q, p) = self.shape(trials)?;
        let s = self.past.max(1);
        let n = order.min(states.x.first().map_or(0, Mat::nrows));
        // [x⁺; y] on [x; u; 1], and the innovation y − C x − D u once more on x⁺.
        let mut rows = Vec::new();
        for (trial, x) in trials.iter().zip(&states.x) {
            for k in 0..x.ncols().saturating_sub(1) {
                let mut row: Vec<f64> = (0..n).map(|i| x[(i, k)]).collect();
                row.extend((0..q).map(|j| trial.inputs[j][s + k]));
                row.push(1.0);
                row.extend((0..p).map(|i| trial.outputs[i][s + k]));
                row.extend((0..n).map(|i| x[(i, k + 1)]));
                rows.push(row);
            }
        }
        let known = n + q + 1;
        let outputs = regress(&gram(&rows, known + p + n), known, known..known + p)?;
        // The innovation joins what is known of x⁺.
        let mut extended = Vec::with_capacity(rows.len());
        for row in &rows {
            let mut own = row[..known].to_vec();
            own.extend((0..p).map(|i| row[known + i] - (0..known).map(|c| outputs[(c, i)] * row[c]).sum::<f64>()));
            own.extend(&row[known + p..]);
            extended.push(own);
        }
        let next = regress(&gram(&extended, known + p + n), known + p, known + p..known + p + n)?;
        let a = Array2::from_shape_fn((n, n), |(i, j)| next[(j, i)]);
        let c = Array2::from_shape_fn((p, n), |(i, j)| outputs[(j, i)]);
        fit_inputs(a, c, trials)
    }
}

/// Least squares of columns `of` on the first `known` ones, from their Gram matrix.
fn regress(gram: &Mat<f64>, known: usize, of: std::ops::Range<usize>) -> Result<Mat<f64>, SubspaceError> {
    let largest = (0..known).map(|i| gram[(i, i)]).collect::<Vec<_>>();
    // Scaled to a unit diagonal: states and inputs may differ by orders of magnitude.
    let scale: Vec<f64> = largest.iter().map(|v| if *v > 0.0 { v.sqrt().recip() } else { 0.0 }).collect();
    let left = Mat::from_fn(known, known, |i, j| gram[(i, j)] * scale[i] * scale[j] + if i == j { RIDGE } else { 0.0 });
    let right = Mat::from_fn(known, of.len(), |i, j| gram[(i, of.start + j)] * scale[i]);
    let solved = left.llt(Side::Lower).map_err(|_| SubspaceError::NotExcited)?.solve(&right);
    Ok(Mat::from_fn(known, of.len(), |i, j| solved[(i, j)] * scale[i]))
}
