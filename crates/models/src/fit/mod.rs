//! Fitting parametric models to frequency responses.

mod compare;
mod information;
mod jackknife;
mod loop_model;
mod misfit;
mod paper;
mod prediction;
mod result;
mod series;
mod start;
mod vaf;
mod weighted;
mod whitened;

pub use compare::{LikelihoodRatio, NullLaw, likelihood_ratio};
pub(crate) use information::Information;
pub use loop_model::{LoopModel, LoopModelError};
pub use misfit::Width;
pub use paper::PaperFit;
pub(crate) use prediction::Prediction;
pub use prediction::{Smoothing, Transducer};
pub(crate) use result::t_quantile;
pub use result::{Fit, FitError, Parameter};
pub use series::SeriesCompliance;
pub use start::{gains_start, linear_start};
pub use vaf::{Agreement, agreement};
pub use weighted::{CovarianceKind, WeightedFit};

use crate::{Gains, LeastSquares, LevenbergMarquardt, Minimum, ParametricModel, Slopes};
use faer::linalg::matmul::triangular::{BlockStructure, matmul};
use faer::{Accum, Mat, Par};
use ndarray::Array2;
use ndof_linear::square;
use ndof_sysid::{FrequencyResponse, ResponseKind};
use num_complex::Complex64;
use rayon::prelude::*;

/// The relative decrease of a cost that rounding allows.
const COST_TOLERANCE: f64 = 1e-12;

/// Rows and columns of the response, if it, model and start values belong together.
fn check_shape(model: &dyn ParametricModel, response: &FrequencyResponse, start: &[f64]) -> Result<[usize; 2], FitError> {
    let n = model.axes().len();
    let (outputs, inputs) = response.shape();
    let driven = model.gains().map_or(n, Gains::inputs);
    if (outputs, inputs) != (n, driven) {
        return Err(FitError::Shape { outputs, inputs, axes: n });
    }
    if response.kind == ResponseKind::Transfer || (driven != n && response.kind.is_effort_over_motion()) {
        return Err(FitError::NotMechanical);
    }
    let expected = model.parameters().len();
    if start.len() == expected { Ok([n, driven]) } else { Err(FitError::StartLength { found: start.len(), expected }) }
}

/// What part of an independent bin each frequency is: its distance to the next over the independent spacing, at most 1.
fn shares(frequency_hz: &[f64], independent_spacing_hz: f64) -> Vec<f64> {
    let gap = |a: usize, b: usize| frequency_hz.get(b).zip(frequency_hz.get(a)).map_or(f64::INFINITY, |(b, a)| b - a);
    (0..frequency_hz.len())
        .map(|k| {
            let gap = gap(k, k + 1).min(if k > 0 { gap(k - 1, k) } else { f64::INFINITY });
            if independent_spacing_hz > 0.0 { (gap / independent_spacing_hz).min(1.0) } else { 1.0 }
        })
        .collect()
}

/// A problem in the coordinates in which its model lets a minimiser move freely.
struct Internal<'a> {
    problem: &'a dyn LeastSquares,
    model: &'a dyn ParametricModel,
}

impl LeastSquares for Internal<'_> {
    fn residuals(&self, x: &[f64]) -> Vec<f64> {
        self.problem.residuals(&self.model.natural(x))
    }

    fn jacobian(&self, x: &[f64]) -> Mat<f64> {
        let natural = self.problem.jacobian(&self.model.natural(x));
        match self.model.natural_jacobian(x) {
            Some(turn) => natural * to_faer(&turn),
            None => natural,
        }
    }

    fn slopes(&self, x: &[f64], residuals: &[f64]) -> Slopes {
        let slopes = self.problem.slopes(&self.model.natural(x), residuals);
        let Some(turn) = self.model.natural_jacobian(x).map(|turn| to_faer(&turn)) else { return slopes };
        match slopes {
            Slopes::Triangle(triangle) => {
                let (moved, k) = (triangle.subcols(0, turn.nrows()) * &turn, turn.ncols());
                Slopes::Triangle(Mat::from_fn(triangle.nrows(), k + 1, |i, j| if j < k { moved[(i, j)] } else { triangle[(i, turn.nrows())] }))
            }
            Slopes::Curved { information, gradient, curvature } => Slopes::Curved {
                information: turn.transpose() * information * &turn,
                gradient: turn.transpose() * gradient,
                curvature: turn.transpose() * curvature * &turn,
            },
        }
    }
}

/// Adds the lower triangle of factor · Re(s_r Ω s_cᴴ) of all scores s (p × q each, row by row) to `meat`, Ω being the covariance of an estimate:
/// Ω(ij, kl) = noise_ik input_lj, so that s Ω is noiseᵀ s inputᵀ.
fn add_scores(meat: &mut Mat<f64>, scores: &[Vec<Complex64>], [noise, input]: [&[Complex64]; 2], [p, q]: [usize; 2], factor: f64) {
    let transposed = |a: &[Complex64], n: usize| (0..n * n).map(|e| a[(e % n) * n + e / n]).collect::<Vec<_>>();
    let (left, right) = (transposed(noise, p), transposed(input, q));
    let [mut own, mut seen] = [(); 2].map(|()| Mat::zeros(2 * p * q, scores.len()));
    for (c, score) in scores.iter().enumerate() {
        let through = square::rectangular_product(&square::rectangular_product(&left, score, [p, q]), &right, [q, q]);
        for (column, of) in [(own.col_as_slice_mut(c), score), (seen.col_as_slice_mut(c), &through)] {
            column.chunks_exact_mut(2).zip(of).for_each(|(to, v)| (to[0], to[1]) = (v.re, v.im));
        }
    }
    add_lower(meat, &seen, &own, factor);
}

/// Adds the lower triangle of factor · Aᵀ B.
fn add_lower(to: &mut Mat<f64>, a: &Mat<f64>, b: &Mat<f64>, factor: f64) {
    let [whole, triangle] = [BlockStructure::Rectangular, BlockStructure::TriangularLower];
    matmul(to, triangle, Accum::Add, a.transpose(), whole, b, whole, factor, Par::Seq);
}

/// The sum over bins of what `add` adds to the lower triangle of a matrix of `k` rows, as the whole symmetric matrix.
fn summed_scores(bins: usize, k: usize, add: impl Fn(usize, &mut Mat<f64>) + Sync) -> Mat<f64> {
    let part = |first: usize| {
        let mut sum = Mat::zeros(k, k);
        (first..bins.min(first + TOGETHER)).for_each(|bin| add(bin, &mut sum));
        sum
    };
    let parts: Vec<Mat<f64>> = (0..bins).into_par_iter().step_by(TOGETHER).map(part).collect();
    let lower = parts.iter().fold(Mat::zeros(k, k), |sum: Mat<f64>, part| sum + part);
    Mat::from_fn(k, k, |i, j| lower[(i.max(j), i.min(j))])
}

/// Bins whose scores are summed by one thread.
const TOGETHER: usize = 32;

fn to_faer(a: &Array2<f64>) -> Mat<f64> {
    Mat::from_fn(a.nrows(), a.ncols(), |i, j| a[[i, j]])
}

/// The parameters of a minimum alone.
fn found(problem: &dyn LeastSquares, model: &dyn ParametricModel, start: &[f64], cost_tolerance: f64) -> Result<Vec<f64>, FitError> {
    let found = search(model, cost_tolerance).learning_curvature().descend(&Internal { problem, model }, &model.internal(start))?;
    Ok(model.natural(&found.x))
}

fn search(model: &dyn ParametricModel, cost_tolerance: f64) -> LevenbergMarquardt {
    LevenbergMarquardt::new(model.parameters().iter().map(|p| (p.lower, p.upper)).collect()).stopping_at(cost_tolerance)
}

/// A minimum with what its covariance is made of.
struct Solved {
    theta: Vec<f64>,
    minimum: Minimum,
    /// ∂r/∂θ.
    jacobian: Mat<f64>,
    information: Information,
    /// ∂θ/∂x, where the model has internal coordinates.
    turn: Option<Mat<f64>>,
}

impl Solved {
    fn new(problem: &dyn LeastSquares, model: &dyn ParametricModel, start: &[f64], cost_tolerance: f64) -> Result<Self, FitError> {
        Self::by(search(model, cost_tolerance).learning_curvature(), problem, model, start)
    }

    fn by(search: LevenbergMarquardt, problem: &dyn LeastSquares, model: &dyn ParametricModel, start: &[f64]) -> Result<Self, FitError> {
        let minimum = search.minimise(&Internal { problem, model }, &model.internal(start))?;
        let theta = model.natural(&minimum.x);
        let turn = model.natural_jacobian(&minimum.x).map(|t| to_faer(&t));
        let jacobian = if turn.is_some() { problem.jacobian(&theta) } else { minimum.jacobian.clone() };
        let information = Information::new(&minimum.jacobian);
        Ok(Solved { theta, minimum, jacobian, information, turn })
    }

    /// factor · (JᵀJ)⁻¹, or with `meat` in the middle; constraints that hold take their directions out.
    fn covariance(&self, meat: Option<&Mat<f64>>, factor: f64) -> Array2<f64> {
        let Some(turn) = &self.turn else {
            return meat.map_or_else(|| self.information.covariance(factor), |meat| self.information.sandwich(meat, factor));
        };
        let inverse = self.information.inverse();
        let inner = match meat {
            Some(meat) => &inverse * (turn.transpose() * meat * turn) * &inverse,
            None => inverse,
        };
        let outer = turn * inner * turn.transpose();
        Array2::from_shape_fn((self.theta.len(), self.theta.len()), |(r, c)| factor * outer[(r, c)])
    }

    /// The fit of `model` that this minimum is, from data at `frequency_hz`.
    fn into_fit(self, model: &dyn ParametricModel, covariance: Array2<f64>, frequency_hz: &[f64], chi2: f64, degrees_of_freedom: f64) -> Fit {
        let interval_quantile = t_quantile(degrees_of_freedom);
        let ends = frequency_hz.iter().fold([f64::INFINITY, 0.0], |[low, high]: [f64; 2], hz| [low.min(*hz), high.max(*hz)]);
        Fit {
            model: model.name().to_owned(),
            parameters: Parameter::describe(&model.parameters(), &self.theta, &covariance, |_| interval_quantile, &model.scales(&self.theta)),
            theta: self.theta,
            covariance,
            covariance_scale: 1.0,
            width: Width::Covariance,
            interval_quantile,
            band_hz: ends,
            bins: frequency_hz.len(),
            chi2,
            degrees_of_freedom,
            chi2_reduced: chi2 / degrees_of_freedom,
            condition: self.information.condition,
            reason: self.minimum.reason,
            iterations: self.minimum.iterations,
        }
    }

    /// (JᵀJ)⁻¹ in θ, zero in directions that the data or a constraint leave out.
    fn inverse(&self) -> Mat<f64> {
        let inverse = self.information.inverse();
        match &self.turn {
            Some(turn) => turn * inverse * turn.transpose(),
            None => inverse,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scores_are_summed_over_every_pair_of_elements() {
        let n = 2;
        let entry = |k: usize| Complex64::new((1.3 * k as f64).sin(), (0.7 * k as f64).cos());
        let hermitian = |k: usize| [Complex64::new(2.0, 0.0), entry(k), entry(k).conj(), Complex64::new(3.0, 0.0)];
        let (noise, input) = (hermitian(1), hermitian(2));
        let scores: Vec<Vec<Complex64>> = (0..3).map(|r| (0..4).map(|e| entry(10 * r + e + 5)).collect()).collect();
        let meat = summed_scores(1, 3, |_, meat| add_scores(meat, &scores, [&noise, &input], [n, n], 0.5));
        for r in 0..3 {
            for c in 0..3 {
                let pair = |x: usize, y: usize| scores[r][x] * scores[c][y].conj() * noise[(x / n) * n + y / n] * input[(y % n) * n + x % n];
                let sum: Complex64 = (0..16).map(|e| pair(e / 4, e % 4)).sum();
                // Sixteen products of size ten at most.
                assert!((meat[(r, c)] - 0.5 * sum.re).abs() < 1e-13, "{r} {c}");
            }
        }
    }
}
