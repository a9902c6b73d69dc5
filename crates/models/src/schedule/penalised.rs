//! Least squares with a penalty on roughness, whose weights the data choose.

use super::ScheduleError;
use super::moments::Normal;
use faer::linalg::solvers::{DenseSolveCore, Solve};
use faer::{Mat, Side};
use ndarray::Array2;

/// How far a weight may go from where penalty and data have the same say: a billion either way is nothing, or all.
const REACH: f64 = 1e9;
/// Weights that change by less than a thousandth are found: a curve then moves by far less than its band.
const SETTLED: f64 = 1e-3;
/// Steps at most; each at least holds the likelihood.
const STEPS: usize = 100;
/// A step that goes on in one direction is lengthened to this power at most.
const LONGEST: f64 = 8.0;

/// A penalised fit of one row of the matrices.
pub(super) struct Penalised {
    /// Coefficients of the columns, those of the mean behind them.
    pub beta: Mat<f64>,
    /// Covariance of those without the mean: σ² (DᵀD + Σ λ_g S_g)⁻¹, the posterior one under the penalty as a prior.
    pub covariance: Mat<f64>,
    /// Variance of what is left.
    pub variance: f64,
    /// Weight of the penalty of each group.
    pub weights: Vec<f64>,
    /// Effective number of coefficients of each group.
    pub degrees: Vec<f64>,
    /// Rows less all effective coefficients.
    pub freedom: f64,
}

/// The normal equations with the mean taken out, which nothing penalises.
struct Reduced {
    own: Mat<f64>,
    right: Mat<f64>,
    mean: Mat<f64>,
    mean_right: Mat<f64>,
    size: usize,
}

impl Reduced {
    fn new(normal: &Normal, size: usize) -> Result<Self, ScheduleError> {
        let all = normal.dd.nrows();
        let block = |r: usize, c: usize, m: usize, n: usize| normal.dd.submatrix(r, c, m, n).to_owned();
        let (own, cross) = (block(0, 0, size, size), block(0, size, size, all - size));
        let factor = block(size, size, all - size, all - size).llt(Side::Lower).map_err(|_| ScheduleError::Undetermined)?;
        let mean = factor.solve(cross.transpose().to_owned());
        let mean_right = factor.solve(normal.dy.submatrix(size, 0, all - size, 1).to_owned());
        let right = normal.dy.submatrix(0, 0, size, 1).to_owned() - &cross * &mean_right;
        Ok(Reduced { own: own - &cross * &mean, right, mean, mean_right, size })
    }

    fn whole(&self, own: &Mat<f64>) -> Mat<f64> {
        let mean = &self.mean_right - &self.mean * own;
        Mat::from_fn(self.size + mean.nrows(), 1, |i, _| if i < self.size { own[(i, 0)] } else { mean[(i - self.size, 0)] })
    }
}

/// Minimises ‖y − Dβ‖² + Σ_g λ_g β_gᵀ S β_g, with λ of the largest restricted likelihood, begun at `start` where weights are known.
///
/// λ_g ← λ_g σ² (r/λ_g − tr(V S_g))/(β_gᵀ S β_g), V = (DᵀD + Σ λ S)⁻¹ and r the rank of S: each step raises the likelihood.
///
/// # References
/// S. N. Wood & M. Fasiolo (2017), A generalized Fellner-Schall method for smoothing parameter optimization; G. Wahba (1983) and
/// D. Nychka (1988) on the posterior covariance as that of bands that hold on average over the curve.
pub(super) fn penalised(normal: &Normal, size: usize, groups: &[usize], roughness: &Array2<f64>, start: Option<&[f64]>) -> Result<Penalised, ScheduleError> {
    let reduced = Reduced::new(normal, size)?;
    let count = roughness.nrows();
    let balance: Vec<f64> = groups.iter().map(|g| (0..count).map(|k| reduced.own[(g + k, g + k)]).sum::<f64>() / count as f64).collect();
    let mut weights = start.map_or_else(|| balance.clone(), <[f64]>::to_vec);
    let mut going = vec![(0.0_f64, 1.0_f64); groups.len()];
    let mut fit = solve(normal, &reduced, groups, roughness, &weights)?;
    for _ in 0..STEPS {
        let mut moved = 0.0_f64;
        for (g, first) in groups.iter().enumerate() {
            let quadratic =
                |m: &dyn Fn(usize, usize) -> f64| -> f64 { (0..count * count).map(|e| roughness[[e / count, e % count]] * m(e / count, e % count)).sum() };
            let roughness_of_fit = quadratic(&|i, j| fit.beta[(first + i, 0)] * fit.beta[(first + j, 0)]);
            let trace = quadratic(&|i, j| fit.covariance[(first + i, first + j)]) / fit.variance;
            let step = (fit.variance * ((count - 1) as f64 / weights[g] - trace).max(0.0) / roughness_of_fit).ln();
            let step = if step.is_nan() { 0.0 } else { step.clamp(-2.0, 2.0) };
            let (before, power) = going[g];
            going[g] = (step, if before * step > 0.0 { (2.0 * power).min(LONGEST) } else { 1.0 });
            let new = (weights[g] * (step * going[g].1).exp()).clamp(balance[g] / REACH, balance[g] * REACH);
            moved = moved.max((new / weights[g]).ln().abs());
            weights[g] = new;
        }
        fit = solve(normal, &reduced, groups, roughness, &weights)?;
        if moved < SETTLED {
            break;
        }
    }
    Ok(fit)
}

/// The fit with given weights.
fn solve(normal: &Normal, reduced: &Reduced, groups: &[usize], roughness: &Array2<f64>, weights: &[f64]) -> Result<Penalised, ScheduleError> {
    let (size, count) = (reduced.size, roughness.nrows());
    let mut system = reduced.own.clone();
    for (first, weight) in groups.iter().zip(weights) {
        roughness.indexed_iter().for_each(|((i, j), s)| system[(first + i, first + j)] += weight * s);
    }
    let factor = system.llt(Side::Lower).map_err(|_| ScheduleError::Undetermined)?;
    let own = factor.solve(&reduced.right);
    let inverse = factor.inverse();
    let influence = |range: std::ops::Range<usize>| -> f64 { range.map(|i| (0..size).map(|j| inverse[(i, j)] * reduced.own[(j, i)]).sum::<f64>()).sum() };
    let freedom = normal.rows as f64 - influence(0..size) - (normal.dd.nrows() - size) as f64;
    let beta = reduced.whole(&own);
    let variance = normal.left(&beta) / freedom;
    if !(variance > 0.0 && freedom >= 1.0) {
        return Err(ScheduleError::TooShort { rows: normal.rows, needed: normal.dd.nrows() + 1 });
    }
    let degrees = groups.iter().map(|first| influence(*first..first + count)).collect();
    Ok(Penalised { beta, covariance: inverse * faer::Scale(variance), variance, weights: weights.to_vec(), degrees, freedom })
}
