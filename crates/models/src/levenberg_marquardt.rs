//! Bounded nonlinear least squares by the method of Levenberg and Marquardt.

use crate::secant::Secant;
use argmin::core::{Error as ArgminError, Executor, IterState, Jacobian, KV, Operator, Problem, Solver, State, TerminationReason, TerminationStatus};
use faer::{Mat, MatRef, prelude::SolveLstsq};
use ndof_linear::Cholesky;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::cmp::Ordering;

/// A sum of squares to minimise: ½ ‖r(x)‖².
pub trait LeastSquares {
    /// r(x), always of the same length; entries that are not finite mark an `x` that is not allowed.
    fn residuals(&self, x: &[f64]) -> Vec<f64>;

    /// ∂r/∂x at `x`, residuals × parameters.
    fn jacobian(&self, x: &[f64]) -> Mat<f64>;

    /// A matrix A of as many columns as [∂r/∂x r] with AᵀA = [∂r/∂x r]ᵀ[∂r/∂x r]: all that a step needs. Problems that
    /// know their structure can have it without the whole Jacobian.
    fn triangle(&self, x: &[f64], residuals: &[f64]) -> Mat<f64> {
        triangle(&self.jacobian(x), residuals)
    }

    /// What a step needs; the triangle, unless the problem knows more.
    fn slopes(&self, x: &[f64], residuals: &[f64]) -> Slopes {
        Slopes::Triangle(self.triangle(x, residuals))
    }
}

/// What a step needs of a problem about one place.
#[derive(Clone, Debug)]
pub enum Slopes {
    /// What [`LeastSquares::triangle`] gives.
    Triangle(Mat<f64>),
    /// JᵀJ and Jᵀr of a problem that knows Σ r ∂²r/∂x² too, what JᵀJ lacks of the cost's curvature. Where residuals stay large at the minimum,
    /// steps without it converge slowly; where they are noise, it changes nothing.
    Curved {
        /// JᵀJ, parameters × parameters.
        information: Mat<f64>,
        /// Jᵀr, one column.
        gradient: Mat<f64>,
        /// Σ r ∂²r/∂x², parameters × parameters.
        curvature: Mat<f64>,
    },
}

impl Slopes {
    /// Norms of the columns of J, and Jᵀr.
    fn first(&self, n: usize) -> (Vec<f64>, Mat<f64>) {
        match self {
            Slopes::Triangle(all) => ((0..n).map(|j| all.col(j).norm_l2()).collect(), all.subcols(0, n).transpose() * all.subcols(n, 1)),
            Slopes::Curved { information, gradient, .. } => ((0..n).map(|j| information[(j, j)].max(0.0).sqrt()).collect(), gradient.clone()),
        }
    }

    /// The same with the curvature that steps have told, where that is to be trusted and the problem does not know it itself.
    fn with_learned(&self, secant: &mut Secant, x: &[f64], gradient: &Mat<f64>) -> Option<Slopes> {
        let Slopes::Triangle(all) = self else { return None };
        let upper = all.subcols(0, x.len());
        let information = upper.transpose() * upper;
        let curvature = secant.arrive(x, gradient, &information)?.clone();
        Some(Slopes::Curved { information, gradient: gradient.clone(), curvature })
    }

    /// Of the parameters `free` alone: a triangle of their own, which is small work, or gradient and curvature.
    fn of(&self, free: &[usize], n: usize) -> Quadratic {
        match self {
            Slopes::Triangle(all) => {
                let chosen = Mat::from_fn(all.nrows(), free.len() + 1, |i, k| all[(i, free.get(k).copied().unwrap_or(n))]);
                Quadratic::Triangle(chosen.qr().thin_R().to_owned())
            }
            Slopes::Curved { information, gradient, curvature } => Quadratic::Curved {
                hessian: Mat::from_fn(free.len(), free.len(), |i, j| information[(free[i], free[j])] + curvature[(free[i], free[j])]),
                gradient: Mat::from_fn(free.len(), 1, |i, _| gradient[(free[i], 0)]),
            },
        }
    }
}

/// The cost about one place.
enum Quadratic {
    Triangle(Mat<f64>),
    Curved { hessian: Mat<f64>, gradient: Mat<f64> },
}

/// Why the iteration stopped.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum StopReason {
    /// The cost no longer falls, relative to itself.
    CostConverged,
    /// The parameters no longer move, relative to themselves.
    StepConverged,
    /// The residual is orthogonal to every column of the Jacobian that a bound leaves free.
    GradientConverged,
    /// The iteration limit was reached first; the result is not a minimum.
    IterationLimit,
}

impl StopReason {
    /// Whether a minimum was found.
    pub fn converged(self) -> bool {
        self != StopReason::IterationLimit
    }
}

/// Why a minimisation cannot run.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[allow(missing_docs, reason = "a message says what its fields are")]
pub enum MinimiseError {
    /// Start and bounds disagree in length.
    #[error("{parameters} start values but {bounds} bounds; give one pair of bounds for each parameter")]
    BoundsLength { parameters: usize, bounds: usize },
    /// A lower bound that is not below its upper bound.
    #[error("parameter {parameter}: bounds {lower} to {upper} leave nothing between them; drop the parameter or widen its bounds")]
    EmptyBounds { parameter: usize, lower: f64, upper: f64 },
    /// The model cannot be evaluated where the search begins.
    #[error("residual {residual} is not finite at the start values; start where the model exists")]
    StartNotFinite { residual: usize },
    /// More parameters than equations.
    #[error("{parameters} parameters but only {residuals} equations; fit fewer parameters or a wider band")]
    Underdetermined { parameters: usize, residuals: usize },
}

/// A minimum of ½ ‖r(x)‖².
#[derive(Clone, Debug)]
pub struct Minimum {
    /// The parameters.
    pub x: Vec<f64>,
    /// The residuals there.
    pub residuals: Vec<f64>,
    /// Their Jacobian there.
    pub jacobian: Mat<f64>,
    /// ½ ‖r‖².
    pub cost: f64,
    /// Which parameters lie on a bound.
    pub at_bound: Vec<bool>,
    /// Why the iteration stopped.
    pub reason: StopReason,
    /// Accepted steps.
    pub iterations: u64,
}

/// Levenberg-Marquardt with bounds, as an `argmin` [`Solver`].
///
/// Each step solves min ‖J p + r‖² + λ ‖D p‖² by QR, with D the largest norms that the columns of J have had (Moré
/// 1978), so that the result does not depend on the units of the parameters. Parameters that a bound holds back are
/// left out of the step, the others are clipped to their bounds. λ follows the ratio of achieved to predicted decrease
/// (Nielsen 1999). Where the problem knows what JᵀJ lacks of the cost's curvature, the step takes it along ([`LeastSquares::slopes`]).
/// All tests of convergence are relative.
///
/// # References
/// J. J. Moré (1978), The Levenberg-Marquardt algorithm: implementation and theory. H. B. Nielsen (1999), Damping
/// parameter in Marquardt's method. J. E. Dennis & R. B. Schnabel (1983), Numerical Methods for Unconstrained Optimization, ch. 10, on residuals that
/// stay large.
#[derive(Clone, Debug)]
pub struct LevenbergMarquardt {
    /// Lower and upper bound of each parameter, infinite where there is none.
    pub bounds: Vec<(f64, f64)>,
    /// Relative decrease of the cost, predicted and achieved, at which to stop.
    pub cost_tolerance: f64,
    /// Relative length of a step at which to stop.
    pub step_tolerance: f64,
    /// Largest cosine between residual and Jacobian columns at which to stop.
    pub gradient_tolerance: f64,
    /// Largest number of accepted steps.
    pub max_iterations: u64,
    damping: f64,
    scale: Vec<f64>,
    secant: Option<Secant>,
    reason: Option<StopReason>,
}

/// The decrease that must be achieved for a step to count, relative to the prediction.
const ACCEPT: f64 = 1e-4;
/// Rejections in a row after which the damping exceeds every finite model (2^(k(k+1)/2) of the start).
const MAX_REJECTIONS: u32 = 30;

impl LevenbergMarquardt {
    /// No bounds but those given; tolerances near what rounding allows.
    pub fn new(bounds: Vec<(f64, f64)>) -> Self {
        LevenbergMarquardt {
            bounds,
            cost_tolerance: 1e-12,
            step_tolerance: 1e-10,
            gradient_tolerance: 1e-12,
            max_iterations: 200,
            damping: 1e-3,
            scale: Vec::new(),
            secant: None,
            reason: None,
        }
    }

    /// The same that stops at another relative decrease of the cost.
    pub fn stopping_at(self, cost_tolerance: f64) -> Self {
        LevenbergMarquardt { cost_tolerance, ..self }
    }

    /// The same that learns what JᵀJ lacks of the cost's curvature from the steps themselves; what is nearly a straight line is found sooner, and where
    /// residuals stay large, in a fraction of the steps.
    pub fn learning_curvature(self) -> Self {
        LevenbergMarquardt { secant: Some(Secant::new()), ..self }
    }

    /// The same with another damping of the first step; 1 about halves it.
    pub(crate) fn damped_by(self, damping: f64) -> Self {
        LevenbergMarquardt { damping, ..self }
    }

    /// Minimises ½ ‖r(x)‖² from `start`, clipped to the bounds.
    ///
    /// # Errors
    /// [`MinimiseError`] if bounds and start do not fit together or the residuals are not finite at the start.
    pub fn minimise(self, problem: &dyn LeastSquares, start: &[f64]) -> Result<Minimum, MinimiseError> {
        let found = self.descend(problem, start)?;
        Ok(Minimum { jacobian: problem.jacobian(&found.x), ..found })
    }

    /// The same without the Jacobian at the end, which may cost as much as a step.
    pub(crate) fn descend(mut self, problem: &dyn LeastSquares, start: &[f64]) -> Result<Minimum, MinimiseError> {
        if self.bounds.len() != start.len() {
            return Err(MinimiseError::BoundsLength { parameters: start.len(), bounds: self.bounds.len() });
        }
        if let Some((parameter, &(lower, upper))) = self.bounds.iter().enumerate().find(|(_, b)| b.0.partial_cmp(&b.1) != Some(Ordering::Less)) {
            return Err(MinimiseError::EmptyBounds { parameter, lower, upper });
        }
        let x = self.clip(start);
        let residuals = problem.residuals(&x);
        if let Some(residual) = residuals.iter().position(|r| !r.is_finite()) {
            return Err(MinimiseError::StartNotFinite { residual });
        }
        if residuals.len() < start.len() {
            return Err(MinimiseError::Underdetermined { parameters: start.len(), residuals: residuals.len() });
        }
        let limit = std::mem::replace(&mut self.max_iterations, u64::MAX);
        let cost = half_square(&residuals);
        let run = Executor::new(Adapter(problem), self.clone())
            .configure(|state| state.param(x.clone()).residuals(residuals.clone()).cost(cost).max_iters(limit))
            .timer(false)
            .run();
        // The adapter never returns an error; if argmin itself did, the start is what is left.
        let (solver, x, residuals, iterations) = match run {
            Ok(mut run) => {
                let iterations = run.state.get_iter();
                (run.solver, run.state.take_param().unwrap_or(x), run.state.take_residuals().unwrap_or(residuals), iterations)
            }
            Err(_) => (self, x, residuals, 0),
        };
        let at_bound = x.iter().zip(&solver.bounds).map(|(&v, b)| v <= b.0 || v >= b.1).collect();
        let reason = solver.reason.unwrap_or(StopReason::IterationLimit);
        Ok(Minimum { cost: half_square(&residuals), x, residuals, jacobian: Mat::new(), at_bound, reason, iterations })
    }

    fn clip(&self, x: &[f64]) -> Vec<f64> {
        x.iter().zip(&self.bounds).map(|(v, b)| v.clamp(b.0, b.1)).collect()
    }

    /// One accepted step from `x`, or a reason to stop.
    fn step(&mut self, problem: &dyn LeastSquares, x: &[f64], residuals: &[f64]) -> Option<(Vec<f64>, Vec<f64>)> {
        let n = x.len();
        let slopes = problem.slopes(x, residuals);
        let (norms, gradient) = slopes.first(n);
        self.scale.resize(n, 0.0);
        self.scale.iter_mut().zip(&norms).for_each(|(s, v)| *s = s.max(*v));
        let scale: Vec<f64> = self.scale.iter().map(|&s| if s > 0.0 { s } else { 1.0 }).collect();
        let cost = half_square(residuals);
        let held = |j: usize| (x[j] <= self.bounds[j].0 && gradient[(j, 0)] > 0.0) || (x[j] >= self.bounds[j].1 && gradient[(j, 0)] < 0.0);
        let free: Vec<usize> = (0..n).filter(|&j| !held(j) && norms[j] > 0.0).collect();
        let length = (2.0 * cost).sqrt();
        if cost == 0.0 || free.iter().all(|&j| gradient[(j, 0)].abs() <= self.gradient_tolerance * norms[j] * length) {
            self.reason = Some(StopReason::GradientConverged);
            return None;
        }
        let learned = self.secant.as_mut().and_then(|secant| slopes.with_learned(secant, x, &gradient));
        let (mut quadratic, k) = (learned.as_ref().unwrap_or(&slopes).of(&free, n), free.len());
        let size = x.iter().zip(&scale).map(|(v, s)| (v * s).powi(2)).sum::<f64>().sqrt();
        let of_free: Vec<f64> = free.iter().map(|&j| scale[j]).collect();
        let mut growth = 2.0;
        for _ in 0..MAX_REJECTIONS {
            let Some(p) = quadratic.damped_step(&of_free, self.damping) else {
                self.damping *= growth;
                growth *= 2.0;
                continue;
            };
            let mut trial = x.to_vec();
            free.iter().enumerate().for_each(|(i, &j)| trial[j] += p[i]);
            let trial = self.clip(&trial);
            let h = Mat::from_fn(k, 1, |i, _| trial[free[i]] - x[free[i]]);
            let sloped = -(0..k).map(|i| h[(i, 0)] * gradient[(free[i], 0)]).sum::<f64>();
            let predicted = sloped - quadratic.curved(&h);
            let moved = (0..k).map(|i| (h[(i, 0)] * scale[free[i]]).powi(2)).sum::<f64>().sqrt();
            let new = problem.residuals(&trial);
            let new_cost = half_square(&new);
            let achieved = cost - new_cost;
            let gain = achieved / predicted;
            let accepted = predicted > 0.0 && gain > ACCEPT;
            if achieved.abs() <= self.cost_tolerance * cost && predicted.abs() <= self.cost_tolerance * cost {
                self.reason = Some(StopReason::CostConverged);
            } else if moved <= self.step_tolerance * size {
                self.reason = Some(StopReason::StepConverged);
            }
            if accepted {
                self.damping = (self.damping * (1.0 - (2.0 * gain - 1.0).powi(3)).max(1.0 / 3.0)).max(1e-15);
                if let Some(secant) = &mut self.secant {
                    let whole: Vec<f64> = trial.iter().zip(x).map(|(to, from)| to - from).collect();
                    let plain = if learned.is_some() { slopes.of(&free, n).curved(&h) } else { quadratic.curved(&h) };
                    secant.judge(&whole, sloped - plain, achieved);
                }
                return Some((trial, new));
            }
            if self.secant.as_mut().is_some_and(Secant::doubt) {
                (quadratic, self.reason) = (slopes.of(&free, n), None);
                continue;
            }
            if self.reason.is_some() {
                return None;
            }
            self.damping *= growth;
            growth *= 2.0;
        }
        self.reason = Some(StopReason::StepConverged);
        None
    }
}

impl Quadratic {
    /// ½ hᵀ H h.
    fn curved(&self, h: &Mat<f64>) -> f64 {
        match self {
            Quadratic::Triangle(triangle) => 0.5 * (triangle.submatrix(0, 0, h.nrows(), h.nrows()) * h).squared_norm_l2(),
            Quadratic::Curved { hessian, .. } => 0.5 * (h.transpose() * hessian * h)[(0, 0)],
        }
    }

    /// The step p of (H + λ D²) p = −Jᵀr; none where that matrix has no minimum. Of a triangle by QR, which sees its condition and not the square.
    fn damped_step(&self, scale: &[f64], damping: f64) -> Option<Vec<f64>> {
        let k = scale.len();
        match self {
            Quadratic::Triangle(triangle) => {
                let (upper, rotated) = (triangle.submatrix(0, 0, k, k), triangle.submatrix(0, k, k, 1));
                let root = damping.sqrt();
                let system = Mat::from_fn(2 * k, k, |i, j| if i < k { upper[(i, j)] } else { f64::from(u8::from(i - k == j)) * root * scale[j] });
                let right = Mat::from_fn(2 * k, 1, |i, _| if i < k { -rotated[(i, 0)] } else { 0.0 });
                Some(system.qr().solve_lstsq(right).col(0).iter().copied().collect())
            }
            Quadratic::Curved { hessian, gradient } => {
                let mut factor = Cholesky::new(k);
                if !factor.factor(|i, j| hessian[(i, j)] / (scale[i] * scale[j]) + if i == j { damping } else { 0.0 }) {
                    return None;
                }
                let mut p: Vec<f64> = (0..k).map(|i| -gradient[(i, 0)] / scale[i]).collect();
                factor.solve(&mut p);
                Some(p.iter().zip(scale).map(|(p, s)| p / s).collect())
            }
        }
    }
}

type LmState = IterState<Vec<f64>, (), Mat<f64>, (), Vec<f64>, f64>;

impl Solver<Adapter<'_>, LmState> for LevenbergMarquardt {
    fn name(&self) -> &str {
        "bounded Levenberg-Marquardt"
    }

    fn next_iter(&mut self, problem: &mut Problem<Adapter<'_>>, mut state: LmState) -> Result<(LmState, Option<KV>), ArgminError> {
        let (Some(x), Some(residuals), Some(adapter)) = (state.take_param(), state.take_residuals(), problem.problem.as_ref()) else {
            return Err(argmin::core::ArgminError::NotInitialized { text: "start values".to_owned() }.into());
        };
        Ok(match self.step(adapter.0, &x, &residuals) {
            Some((x, residuals)) => {
                let cost = half_square(&residuals);
                (state.param(x).residuals(residuals).cost(cost), None)
            }
            None => (state.param(x).residuals(residuals), None),
        })
    }

    fn terminate(&mut self, _state: &LmState) -> TerminationStatus {
        if self.reason.is_some() { TerminationStatus::Terminated(TerminationReason::SolverConverged) } else { TerminationStatus::NotTerminated }
    }
}

/// A least-squares problem as `argmin` sees it.
struct Adapter<'a>(&'a dyn LeastSquares);

impl Operator for Adapter<'_> {
    type Param = Vec<f64>;
    type Output = Vec<f64>;
    fn apply(&self, x: &Vec<f64>) -> Result<Vec<f64>, ArgminError> {
        Ok(self.0.residuals(x))
    }
}

impl Jacobian for Adapter<'_> {
    type Param = Vec<f64>;
    type Jacobian = Mat<f64>;
    fn jacobian(&self, x: &Vec<f64>) -> Result<Mat<f64>, ArgminError> {
        Ok(self.0.jacobian(x))
    }
}

/// Rows whose triangle is taken at once: J of a long record never leaves the cache.
const ROWS: usize = 1024;

/// A pivot of JᵀJ, its columns of unit length, above which its root is as good for a step as the triangle of J: off by a hundred-millionth at most.
const WELL_POSED: f64 = 1e-8;

/// The triangle from [J r]ᵀ[J r], for a fraction of the work; `None` where squaring the condition of J would cost digits that a step needs.
pub(crate) fn root(products: &Mat<f64>) -> Option<Mat<f64>> {
    let n = products.nrows() - 1;
    let scale: Vec<f64> = (0..n).map(|j| products[(j, j)].sqrt()).collect();
    let mut factor = Cholesky::new(n);
    let sound = factor.factor(|i, j| products[(i, j)] / (scale[i] * scale[j]));
    let lower = factor.lower();
    if !(sound && (0..n).all(|j| lower[j * n + j].powi(2) > WELL_POSED)) {
        return None;
    }
    let mut rotated = vec![0.0; n];
    for j in 0..n {
        let known: f64 = (0..j).map(|i| lower[j * n + i] * rotated[i]).sum();
        rotated[j] = (products[(n, j)] / scale[j] - known) / lower[j * n + j];
    }
    let left = (products[(n, n)] - rotated.iter().map(|v| v * v).sum::<f64>()).max(0.0).sqrt();
    Some(Mat::from_fn(n + 1, n + 1, |i, j| match (i < n, j < n) {
        (_, true) if i <= j => lower[j * n + i] * scale[j],
        (true, false) => rotated[i],
        (false, false) => left,
        _ => 0.0,
    }))
}

/// R of the QR decomposition of [J r], rows reduced in blocks and the blocks' triangles once more, in a fixed order.
pub(crate) fn triangle(jacobian: &Mat<f64>, residuals: &[f64]) -> Mat<f64> {
    let (m, n) = (residuals.len(), jacobian.ncols());
    let reduce = |rows: usize, at: &dyn Fn(usize, usize) -> f64| -> Mat<f64> {
        let block = Mat::from_fn(rows, n + 1, at);
        if rows > n + 1 { block.qr().thin_R().to_owned() } else { block }
    };
    let parts: Vec<Mat<f64>> = (0..m.div_ceil(ROWS))
        .into_par_iter()
        .map(|b| reduce((m - b * ROWS).min(ROWS), &|i, j| if j < n { jacobian[(b * ROWS + i, j)] } else { residuals[b * ROWS + i] }))
        .collect();
    let index: Vec<(usize, usize)> = parts.iter().enumerate().flat_map(|(b, p)| (0..p.nrows()).map(move |i| (b, i))).collect();
    reduce(index.len(), &|i, j| parts[index[i].0][(index[i].1, j)])
}

/// R of the QR decomposition of rows of `width`, one behind the other, reduced in blocks that stay in the cache.
pub(crate) fn triangle_of_rows(rows: &[f64], width: usize) -> Mat<f64> {
    const BLOCK: usize = 256;
    let parts: Vec<Mat<f64>> = rows
        .chunks(BLOCK * width)
        .map(|block| {
            let block = MatRef::from_row_major_slice(block, block.len() / width, width);
            if block.nrows() > width { block.qr().thin_R().to_owned() } else { block.to_owned() }
        })
        .collect();
    let total: usize = parts.iter().map(Mat::nrows).sum();
    if parts.len() == 1 || total <= width {
        return stacked(&parts, width, total);
    }
    stacked(&parts, width, total).qr().thin_R().to_owned()
}

fn stacked(parts: &[Mat<f64>], width: usize, total: usize) -> Mat<f64> {
    let mut out = Mat::zeros(total, width);
    let mut at = 0;
    for part in parts {
        out.submatrix_mut(at, 0, part.nrows(), width).copy_from(part);
        at += part.nrows();
    }
    out
}

fn half_square(r: &[f64]) -> f64 {
    0.5 * r.iter().map(|v| v * v).sum::<f64>()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Columns of unlike size, the last two so near each other.
    fn columns(apart: f64) -> (Mat<f64>, Vec<f64>) {
        let wave = |i: usize, k: f64| (k * i as f64 + k).sin();
        let jacobian = Mat::from_fn(40, 3, |i, j| match j {
            0 => 1e6 * wave(i, 0.7),
            1 => wave(i, 1.3),
            _ => wave(i, 1.3) + apart * wave(i, 2.9),
        });
        (jacobian, (0..40).map(|i| wave(i, 0.2)).collect())
    }

    #[test]
    fn a_root_of_products_is_the_triangle_where_that_is_well_posed() {
        let with_residuals = |apart: f64| {
            let (jacobian, residuals) = columns(apart);
            let all = Mat::from_fn(40, 4, |i, j| if j < 3 { jacobian[(i, j)] } else { residuals[i] });
            (root(&(all.transpose() * &all)), triangle(&jacobian, &residuals))
        };
        let (found, want) = with_residuals(0.1);
        let found = found.expect("well posed");
        for (j, i) in (0..4).flat_map(|j| (0..4).map(move |i| (j, i))) {
            // Signs of rows are free; the smallest pivot is 0.1² of its column, so squaring costs two digits.
            let (found, want) = (found[(i, j)] * found[(i, i)].signum(), if i <= j { want[(i, j)] * want[(i, i)].signum() } else { 0.0 });
            assert!((found - want).abs() < 1e-12 * (1.0 + want.abs()), "{i} {j}: {found} {want}");
        }
        assert!(with_residuals(1e-5).0.is_none());
        assert!(root(&Mat::zeros(4, 4)).is_none() && root(&Mat::full(4, 4, f64::NAN)).is_none());
    }
}
