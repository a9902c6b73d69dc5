//! Output-error fits by multiple shooting.

use super::Mechanism;
use super::simulate::Runner;
use crate::fit::{Information, t_quantile};
use crate::{LeastSquares, LevenbergMarquardt, MinimiseError, Minimum, Parameter, StopReason};
use faer::Mat;
use ndarray::Array2;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// Measured force and motion of one trial, one slice an axis.
#[derive(Clone, Debug)]
pub struct TimeTrial<'a> {
    /// Force on the mechanism (N, N m).
    pub force: Vec<&'a [f64]>,
    /// Its displacement (m, rad).
    pub motion: Vec<&'a [f64]>,
}

/// Settings of a free-run fit: minimises Σ (x − x̂(θ, x₀))² / σ² where x̂ runs free from the measured force over windows
/// with fitted initial states (multiple shooting without continuity), σ the rms residual of each axis (two passes).
///
/// A mechanism without a spring drifts away in long runs; windows of some seconds keep it in reach. Intervals come from
/// the scatter of the windows' scores (at least one every [`FreeRunFit::BLOCK_S`]), so coloured noise is allowed for.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct FreeRunFit {
    /// Sample rate.
    pub sample_rate_hz: f64,
    /// Length of a window; a whole trial if `None`.
    pub window_s: Option<f64>,
}

/// A mechanism fitted in time.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FreeRun {
    /// Parameters in the mechanism's order.
    pub theta: Vec<f64>,
    /// The same with intervals.
    pub parameters: Vec<Parameter>,
    /// Their covariance.
    pub covariance: Array2<f64>,
    /// rms(x − x̂)/std(x) of each axis.
    pub nrmse: Vec<f64>,
    /// 100 (1 − var(x − x̂)/var(x)) of each axis.
    pub vaf_percent: Vec<f64>,
    /// Condition number of the information matrix.
    pub condition: f64,
    /// Why the minimiser stopped.
    pub reason: StopReason,
}

/// Why a free-run fit is not possible.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum FreeRunError {
    /// Channels or lengths do not agree.
    #[error("trial {trial}: {force} force and {motion} motion channels for {axes} axes, or channels of unequal length; give one of each for every axis")]
    Shape {
        /// Number of the trial, from 1.
        trial: usize,
        /// Force channels.
        force: usize,
        /// Motion channels.
        motion: usize,
        /// Axes of the mechanism.
        axes: usize,
    },
    /// Nothing to fit.
    #[error("no trial, or none as long as two samples")]
    Empty,
    /// Start values do not fit.
    #[error("{found} start values, the mechanism has {expected} parameters")]
    StartLength {
        /// What was given.
        found: usize,
        /// What the mechanism has.
        expected: usize,
    },
    /// The minimiser refused.
    #[error(transparent)]
    Minimise(#[from] MinimiseError),
}

impl FreeRunFit {
    /// Longest stretch whose residuals count as one in the intervals (s).
    pub const BLOCK_S: f64 = 2.0;

    /// Fits the mechanism's parameters and every window's initial state.
    ///
    /// # Errors
    /// [`FreeRunError`] if the trials do not fit the mechanism, or the model is not finite at the start.
    pub fn fit(&self, mechanism: &Mechanism, trials: &[TimeTrial<'_>], start: &[f64]) -> Result<FreeRun, FreeRunError> {
        let expected = mechanism.parameters().len();
        if start.len() != expected {
            return Err(FreeRunError::StartLength { found: start.len(), expected });
        }
        let mut problem = self.problem(mechanism, trials, None)?;
        let first = problem.solve(start)?;
        problem.reweight(&first.residuals);
        let minimum = problem.solve_from(&first.x)?;
        let theta = minimum.x[..expected].to_vec();
        let information = Information::new(&minimum.jacobian);
        let (meat, blocks) = problem.meat(&minimum, (Self::BLOCK_S * self.sample_rate_hz).max(1.0) as usize);
        // Few blocks scatter less than many would.
        let factor = blocks as f64 / (blocks.max(2) - 1) as f64;
        let all = information.sandwich(&meat, factor);
        let covariance = Array2::from_shape_fn((expected, expected), |(r, c)| all[[r, c]]);
        let quantile = t_quantile((blocks.max(2) - 1) as f64);
        let (nrmse, vaf_percent) = problem.scores(&minimum.residuals);
        let parameters = mechanism
            .parameters()
            .into_iter()
            .enumerate()
            .map(|(k, info)| {
                let (value, std_error) = (theta[k], covariance[[k, k]].sqrt());
                let half = quantile * std_error;
                Parameter {
                    name: info.name,
                    unit: info.unit,
                    site: info.site,
                    value,
                    std_error,
                    ci95: [value - half, value + half],
                    identifiable: half <= value.abs(),
                }
            })
            .collect();
        Ok(FreeRun { theta, parameters, covariance, nrmse, vaf_percent, condition: information.condition(), reason: minimum.reason })
    }

    /// NRMSE and VAF (percent) of each axis on trials that were not fitted: only initial states are.
    ///
    /// # Errors
    /// As [`FreeRunFit::fit`].
    pub fn validate(&self, mechanism: &Mechanism, theta: &[f64], trials: &[TimeTrial<'_>]) -> Result<(Vec<f64>, Vec<f64>), FreeRunError> {
        let problem = self.problem(mechanism, trials, Some(theta.to_vec()))?;
        let minimum = problem.solve(&[])?;
        Ok(problem.scores(&minimum.residuals))
    }

    fn problem<'a>(&self, mechanism: &'a Mechanism, trials: &[TimeTrial<'a>], fixed: Option<Vec<f64>>) -> Result<Shooting<'a>, FreeRunError> {
        let n = mechanism.axes.len();
        let mut windows = Vec::new();
        for (index, trial) in trials.iter().enumerate() {
            let samples = trial.force.first().map_or(0, |f| f.len());
            if trial.force.len() != n || trial.motion.len() != n || trial.force.iter().chain(&trial.motion).any(|c| c.len() != samples) {
                return Err(FreeRunError::Shape { trial: index + 1, force: trial.force.len(), motion: trial.motion.len(), axes: n });
            }
            let length = self.window_s.map_or(samples, |s| ((s * self.sample_rate_hz) as usize).clamp(2, samples.max(2)));
            let mut at = 0;
            while at + length <= samples && length >= 2 {
                // What is left behind the last whole window belongs to it.
                let end = if at + 2 * length > samples { samples } else { at + length };
                windows.push(Window { force: trial.force.iter().map(|c| &c[at..end]).collect(), motion: trial.motion.iter().map(|c| &c[at..end]).collect() });
                at = end;
            }
        }
        if windows.is_empty() {
            return Err(FreeRunError::Empty);
        }
        let sigma = (0..n).map(|i| deviation(windows.iter().flat_map(|w| w.motion[i].iter().copied())).max(f64::MIN_POSITIVE)).collect();
        Ok(Shooting { mechanism, windows, sigma, fixed, step_s: 1.0 / self.sample_rate_hz })
    }
}

fn deviation(values: impl Iterator<Item = f64> + Clone) -> f64 {
    let count = values.clone().count() as f64;
    let mean = values.clone().sum::<f64>() / count;
    (values.map(|v| (v - mean).powi(2)).sum::<f64>() / count).sqrt()
}

struct Window<'a> {
    force: Vec<&'a [f64]>,
    motion: Vec<&'a [f64]>,
}

/// Parameters (unless fixed) and then each window's initial state.
struct Shooting<'a> {
    mechanism: &'a Mechanism,
    windows: Vec<Window<'a>>,
    sigma: Vec<f64>,
    fixed: Option<Vec<f64>>,
    step_s: f64,
}

impl Shooting<'_> {
    fn axes(&self) -> usize {
        self.mechanism.axes.len()
    }

    fn parameters(&self) -> usize {
        if self.fixed.is_some() { 0 } else { self.mechanism.parameters().len() }
    }

    fn runner<'b>(&'b self, x: &[f64]) -> Runner<'b> {
        Runner::new(self.mechanism, self.fixed.as_deref().unwrap_or(&x[..self.parameters()]))
    }

    /// Minimises from parameters, with initial states read from the motion.
    fn solve(&self, theta: &[f64]) -> Result<Minimum, FreeRunError> {
        let mut start = theta.to_vec();
        for w in &self.windows {
            start.extend(w.motion.iter().map(|c| c[0]));
            start.extend(w.motion.iter().map(|c| {
                let reach = (c.len() - 1).min(5);
                (c[reach] - c[0]) / (reach as f64 * self.step_s)
            }));
        }
        self.solve_from(&start)
    }

    fn solve_from(&self, start: &[f64]) -> Result<Minimum, FreeRunError> {
        let own = if self.fixed.is_some() { Vec::new() } else { self.mechanism.parameters() };
        let mut bounds: Vec<(f64, f64)> = own.iter().map(|p| (p.lower, p.upper)).collect();
        bounds.resize(start.len(), (f64::NEG_INFINITY, f64::INFINITY));
        Ok(LevenbergMarquardt::new(bounds).minimise(self, start)?)
    }

    /// Divides each axis by its rms residual.
    fn reweight(&mut self, residuals: &[f64]) {
        let n = self.axes();
        for i in 0..n {
            let own = residuals.iter().skip(i).step_by(n);
            let rms = (own.clone().map(|r| r * r).sum::<f64>() / own.count() as f64).sqrt();
            self.sigma[i] *= rms.max(1e-12);
        }
    }

    /// Where each window's residuals begin.
    fn offsets(&self) -> Vec<usize> {
        let mut at = 0;
        self.windows
            .iter()
            .map(|w| {
                let own = at;
                at += self.axes() * w.motion[0].len();
                own
            })
            .collect()
    }

    /// Σ over blocks of score scoreᵀ, and the number of blocks.
    fn meat(&self, minimum: &Minimum, block: usize) -> (Mat<f64>, usize) {
        let columns = minimum.x.len();
        let (mut meat, mut blocks) = (Mat::zeros(columns, columns), 0);
        let offsets = self.offsets();
        for (w, offset) in self.windows.iter().zip(offsets) {
            let rows = self.axes() * w.motion[0].len();
            for first in (0..rows).step_by(block * self.axes()) {
                let last = (first + block * self.axes()).min(rows);
                let score: Vec<f64> =
                    (0..columns).map(|c| (offset + first..offset + last).map(|r| minimum.jacobian[(r, c)] * minimum.residuals[r]).sum()).collect();
                (0..columns).for_each(|r| (0..columns).for_each(|c| meat[(r, c)] += score[r] * score[c]));
                blocks += 1;
            }
        }
        (meat, blocks)
    }

    fn scores(&self, residuals: &[f64]) -> (Vec<f64>, Vec<f64>) {
        let n = self.axes();
        (0..n)
            .map(|i| {
                let own = residuals.iter().skip(i).step_by(n).map(|r| r * self.sigma[i]);
                let spread = deviation(self.windows.iter().flat_map(|w| w.motion[i].iter().copied()));
                let rms = (own.clone().map(|r| r * r).sum::<f64>() / own.clone().count() as f64).sqrt();
                (rms / spread, 100.0 * (1.0 - (deviation(own) / spread).powi(2)))
            })
            .unzip()
    }

    /// (x − x̂)/σ of each window, sample after sample.
    fn motion_errors(&self, x: &[f64]) -> Vec<Vec<f64>> {
        let (n, p) = (self.axes(), self.parameters());
        let runner = self.runner(x);
        self.windows
            .par_iter()
            .zip(x[p..].par_chunks_exact(2 * n))
            .map(|(w, initial)| {
                let mut out = Vec::with_capacity(n * w.motion[0].len());
                let mut sample = 0;
                runner.run(initial, &w.force, self.step_s, false, |block| {
                    out.extend((0..n).map(|i| (w.motion[i][sample] - block[i]) / self.sigma[i]));
                    sample += 1;
                });
                out
            })
            .collect()
    }
}

impl LeastSquares for Shooting<'_> {
    fn residuals(&self, x: &[f64]) -> Vec<f64> {
        self.motion_errors(x).concat()
    }

    fn jacobian(&self, x: &[f64]) -> Mat<f64> {
        let (n, p) = (self.axes(), self.parameters());
        let runner = self.runner(x);
        let all = self.mechanism.parameters().len();
        let parts: Vec<Vec<f64>> = self
            .windows
            .par_iter()
            .zip(x[p..].par_chunks_exact(2 * n))
            .map(|(w, initial)| {
                let mut out = Vec::with_capacity(n * w.motion[0].len() * (p + 2 * n));
                runner.run(initial, &w.force, self.step_s, true, |block| {
                    for (i, row) in block.chunks_exact(1 + all + 2 * n).enumerate() {
                        out.extend(row[1 + all - p..].iter().map(|v| -v / self.sigma[i]));
                    }
                });
                out
            })
            .collect();
        let rows = parts.iter().map(|v| v.len() / (p + 2 * n)).sum();
        let mut jacobian = Mat::zeros(rows, x.len());
        let mut at = 0;
        for (w, part) in parts.iter().enumerate() {
            for row in part.chunks_exact(p + 2 * n) {
                (0..p).for_each(|c| jacobian[(at, c)] = row[c]);
                (0..2 * n).for_each(|c| jacobian[(at, p + 2 * n * w + c)] = row[p + c]);
                at += 1;
            }
        }
        jacobian
    }
}
