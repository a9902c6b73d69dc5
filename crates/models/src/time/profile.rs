//! Intervals by the profile of the likelihood: right where a threshold makes Wald's wrong.

use super::error::FreeRunError;
use super::shooting::Shooting;
use super::{FreeRun, FreeRunFit, Mechanism, TimeTrial};
use crate::fit::Information;
use crate::{LeastSquares, LevenbergMarquardt};
use faer::Mat;
use faer::prelude::SolveLstsq;

/// Minima of the others that are looked for to each side.
const EVALUATIONS: usize = 30;
/// Relative decrease of the cost at which such a search stops: on the way, and from that rise on, where it decides (the valley is long where
/// profiles are asked for).
const ROUGH: f64 = 1e-5;
const PROFILED: f64 = 1e-8;
const NEAR: f64 = 0.85;
/// The rise at which such a search may begin, and how often a step is halved before it begins all the same.
const HIGH: f64 = 4.0;
const HALVINGS: usize = 8;
/// How near to the quantile the end of an interval has to be.
const CLOSE: f64 = 0.02;
/// How far the likelihood's fall at an end of Wald's interval may be from what that interval takes it for.
const STRAIGHT: f64 = 0.1;
/// The rise, in units of the quantile, of a place where the model does not exist.
const NOWHERE: f64 = 10.0;

/// A problem with one parameter held.
struct Held<'a, 'b> {
    problem: &'a Shooting<'b>,
    index: usize,
    value: f64,
}

impl Held<'_, '_> {
    fn whole(&self, x: &[f64]) -> Vec<f64> {
        x[..self.index].iter().copied().chain([self.value]).chain(x[self.index..].iter().copied()).collect()
    }

    fn without(&self, all: &Mat<f64>) -> Mat<f64> {
        Mat::from_fn(all.nrows(), all.ncols() - 1, |i, j| all[(i, if j < self.index { j } else { j + 1 })])
    }
}

impl LeastSquares for Held<'_, '_> {
    fn residuals(&self, x: &[f64]) -> Vec<f64> {
        self.problem.residuals(&self.whole(x))
    }

    fn jacobian(&self, x: &[f64]) -> Mat<f64> {
        self.without(&self.problem.jacobian(&self.whole(x)))
    }

    fn triangle(&self, x: &[f64], residuals: &[f64]) -> Mat<f64> {
        self.without(&self.problem.triangle(&self.whole(x), residuals))
    }
}

/// A fit with all that its profiles have in common.
struct Profiler<'a, 'b> {
    problem: &'a Shooting<'b>,
    /// Parameters and initial states.
    best: Vec<f64>,
    bounds: Vec<(f64, f64)>,
    /// Their covariance up to a factor.
    spread: Mat<f64>,
    square: f64,
    variance: f64,
}

impl<'a, 'b> Profiler<'a, 'b> {
    fn new(problem: &'a Shooting<'b>, best: Vec<f64>) -> Self {
        let residuals = problem.residuals(&best);
        let square: f64 = residuals.iter().map(|r| r * r).sum();
        let mut bounds: Vec<(f64, f64)> = problem.mechanism.parameters().iter().map(|p| (p.lower, p.upper)).collect();
        bounds.resize(best.len(), (f64::NEG_INFINITY, f64::INFINITY));
        let spread = Information::new(&problem.jacobian(&best)).inverse();
        let variance = square / (residuals.len() - best.len()) as f64;
        Profiler { problem, best, bounds, spread, square, variance }
    }

    /// The root of the rise of the sum of squares at a place in standard deviations of a residual; infinite where the model does not exist.
    fn rise(&self, square: f64) -> f64 {
        if square.is_finite() { ((square - self.square).max(0.0) / self.variance).sqrt() } else { f64::INFINITY }
    }

    fn square_at(&self, x: &[f64]) -> f64 {
        self.problem.residuals(x).iter().map(|r| r * r).sum()
    }

    /// Where a straight line through the best values goes on which the others follow the one as their covariance says.
    fn along(&self, parameter: usize, by: f64) -> Vec<f64> {
        let own = self.spread[(parameter, parameter)];
        (0..self.best.len())
            .map(|k| (self.best[k] + if own > 0.0 { by * self.spread[(k, parameter)] / own } else { 0.0 }).clamp(self.bounds[k].0, self.bounds[k].1))
            .collect()
    }

    /// Whether a parameter's ends by Wald are such by the likelihood too, as far as a straight line shows it: where the valley is bent or a
    /// bound stands in it, the likelihood falls faster or slower.
    fn is_straight(&self, parameter: usize, half: f64, quantile: f64) -> bool {
        [-half, half].iter().all(|&by| {
            let at = self.best[parameter] + by;
            (self.bounds[parameter].0..=self.bounds[parameter].1).contains(&at)
                && (self.rise(self.square_at(&self.along(parameter, by))) / quantile - 1.0).abs() < STRAIGHT
        })
    }

    /// How the others follow a parameter at a place on its profile, by least squares on the residuals' slopes; those at a bound stay.
    fn tangent(&self, x: &[f64], parameter: usize) -> Vec<f64> {
        let jacobian = self.problem.jacobian(x);
        let free: Vec<usize> =
            (0..x.len()).filter(|&k| k != parameter && x[k] > self.bounds[k].0 && x[k] < self.bounds[k].1 && jacobian.col(k).norm_l2() > 0.0).collect();
        let columns = Mat::from_fn(jacobian.nrows(), free.len(), |i, j| jacobian[(i, free[j])]);
        let own = Mat::from_fn(jacobian.nrows(), 1, |i, _| -jacobian[(i, parameter)]);
        let solved = columns.qr().solve_lstsq(own);
        let mut out = vec![0.0; x.len()];
        out[parameter] = 1.0;
        free.iter().enumerate().for_each(|(j, &k)| out[k] = if solved[(j, 0)].is_finite() { solved[(j, 0)] } else { 0.0 });
        out
    }

    /// One end of a parameter's interval, `side` being its sign and `first` the distance at which to begin: the profile is followed outwards
    /// along its tangent, by steps so short that the valley's floor is not lost, and from the outermost place within.
    fn end(&self, parameter: usize, side: f64, first: f64, quantile: f64) -> Result<f64, FreeRunError> {
        let value = self.best[parameter];
        let limit = if side < 0.0 { self.bounds[parameter].0 } else { self.bounds[parameter].1 };
        let reach = (limit - value) * side;
        if reach <= 0.0 {
            return Ok(limit);
        }
        let mut others = self.bounds.clone();
        others.remove(parameter);
        let without = |x: &[f64]| -> Vec<f64> { x.iter().enumerate().filter(|(k, _)| *k != parameter).map(|(_, v)| *v).collect() };
        // Distance from the best value, how far the root of the rise has come there in units of the quantile, and the place.
        let (mut inside, mut outside) = ((0.0, 0.0, self.best.clone()), None);
        let mut tangent = self.tangent(&inside.2, parameter);
        let mut step = first.min(reach);
        for _ in 0..EVALUATIONS {
            let ahead = |step: f64| -> Vec<f64> {
                let by = side * (step - inside.0);
                (0..tangent.len()).map(|k| (inside.2[k] + by * tangent[k]).clamp(self.bounds[k].0, self.bounds[k].1)).collect()
            };
            let height = |step: f64| self.rise(self.square_at(&ahead(step))) / quantile;
            let mut start = height(step);
            for _ in 0..HALVINGS {
                if start < HIGH {
                    break;
                }
                step = 0.5 * (inside.0 + step);
                start = height(step);
            }
            let mut rise = NOWHERE;
            if start.is_finite() {
                let held = Held { problem: self.problem, index: parameter, value: value + side * step };
                let search = |tolerance: f64, from: &[f64]| LevenbergMarquardt::new(others.clone()).stopping_at(tolerance).descend(&held, from);
                let mut minimum = search(ROUGH, &without(&ahead(step)))?;
                if self.rise(2.0 * minimum.cost) / quantile > NEAR {
                    minimum = search(PROFILED, &minimum.x)?;
                }
                rise = self.rise(2.0 * minimum.cost) / quantile;
                if rise < 1.0 {
                    inside = (step, rise, held.whole(&minimum.x));
                }
            }
            if (rise - 1.0).abs() < CLOSE || (rise < 1.0 && step >= reach) {
                return Ok(value + side * step);
            }
            if rise >= 1.0 {
                outside = Some((step, rise));
            } else {
                tangent = self.tangent(&inside.2, parameter);
            }
            step = match outside {
                Some((far, _)) if far - inside.0 < CLOSE * far => return Ok(value + side * far),
                Some((far, high)) => inside.0 + ((1.0 - inside.1) / (high - inside.1)).clamp(0.1, 0.9) * (far - inside.0),
                None => (inside.0 * (1.0 / inside.1.max(0.1)).clamp(1.3, 4.0)).min(reach),
            };
        }
        // Not found: the nearest place that is known to lie beyond, or as far as can be.
        Ok(outside.map_or(limit, |(far, _)| value + side * far))
    }
}

impl FreeRunFit {
    /// 95 % interval of one parameter of a fit with a noise model ([`Noise::Laguerre`](super::Noise::Laguerre)) by its profile:
    /// the values at which the best sum of squares of all other parameters has risen by s² t², t that of Wald's interval, the noise model's own uncertainty included.
    ///
    /// Where an end lies beyond a bound or cannot be found, it is that bound or infinite.
    ///
    /// # Errors
    /// As [`FreeRunFit::fit`].
    ///
    /// # References
    /// D. M. Bates & D. G. Watts (1988), Nonlinear regression analysis and its applications, ch. 6.
    pub fn profile(&self, mechanism: &Mechanism, trials: &[TimeTrial<'_>], fit: &FreeRun, parameter: usize) -> Result<[f64; 2], FreeRunError> {
        let problem = self.problem_of(mechanism, trials, fit)?;
        interval(&Profiler::new(&problem, fit.unknowns()), fit, parameter)
    }

    /// Whether a parameter's profile interval ([`FreeRunFit::profile`]) holds the value that `theta` gives it, at the cost of one search: all other
    /// parameters are fitted from `theta` with this one held, and the sum of squares may have risen by s² t².
    ///
    /// # Errors
    /// As [`FreeRunFit::fit`].
    pub fn holds(&self, mechanism: &Mechanism, trials: &[TimeTrial<'_>], fit: &FreeRun, parameter: usize, theta: &[f64]) -> Result<bool, FreeRunError> {
        if theta.len() != fit.theta.len() {
            return Err(FreeRunError::StartLength { found: theta.len(), expected: fit.theta.len() });
        }
        let problem = self.problem_of(mechanism, trials, fit)?;
        let profiler = Profiler::new(&problem, fit.unknowns());
        let held = Held { problem: &problem, index: parameter, value: theta[parameter] };
        let drop = |k: &usize| *k != parameter;
        let start: Vec<f64> = (0..profiler.best.len()).filter(drop).map(|k| *theta.get(k).unwrap_or(&profiler.best[k])).collect();
        let bounds = (0..profiler.best.len()).filter(drop).map(|k| profiler.bounds[k]).collect();
        let minimum = LevenbergMarquardt::new(bounds).stopping_at(PROFILED).descend(&held, &start)?;
        Ok(profiler.rise(2.0 * minimum.cost) <= fit.profile_quantiles[parameter])
    }

    /// The fit with profiles ([`FreeRunFit::profile`]) in the place of Wald's intervals that the likelihood does not bear out: each parameter
    /// is moved to the ends of its own along the straight line on which Wald has the others follow; where the fall there is more than a tenth
    /// off, or an end lies beyond a bound, the valley is bent (a banana) or closed by a bound. A parameter whose profile ends at a bound, or is
    /// wider to each side than it is large, is not identifiable. A fit without a noise model ([`Noise::Blocks`](super::Noise::Blocks)) has no
    /// likelihood, and stays as it is.
    ///
    /// # Errors
    /// As [`FreeRunFit::fit`].
    pub fn profiled(&self, mechanism: &Mechanism, trials: &[TimeTrial<'_>], mut fit: FreeRun) -> Result<FreeRun, FreeRunError> {
        if self.noise.whitener().is_none() {
            return Ok(fit);
        }
        let problem = self.problem_of(mechanism, trials, &fit)?;
        let profiler = Profiler::new(&problem, fit.unknowns());
        for (k, scale) in mechanism.scales(&fit.theta).into_iter().enumerate() {
            let std_error = fit.parameters[k].std_error;
            let half = 0.5 * (fit.parameters[k].ci95[1] - fit.parameters[k].ci95[0]);
            if !std_error.is_finite() || profiler.is_straight(k, half, fit.profile_quantiles[k]) {
                continue;
            }
            let [low, high] = interval(&profiler, &fit, k)?;
            let open = low <= profiler.bounds[k].0 || high >= profiler.bounds[k].1;
            fit.parameters[k].ci95 = [low, high];
            fit.parameters[k].identifiable = !open && 0.5 * (high - low) <= scale;
            fit.profiled[k] = true;
        }
        Ok(fit)
    }

    /// The problem weighted as the fit weighted it.
    fn problem_of<'a>(&self, mechanism: &'a Mechanism, trials: &[TimeTrial<'_>], fit: &FreeRun) -> Result<Shooting<'a>, FreeRunError> {
        let mut problem = self.problem(mechanism, trials, None)?;
        problem.sigma.clone_from(&fit.sigma);
        problem.coloured.clone_from(&fit.coloured);
        if let Some(noise) = &fit.limb_noise {
            problem.disturbed_as(&fit.unknowns(), noise);
        }
        Ok(problem)
    }
}

impl FreeRun {
    fn unknowns(&self) -> Vec<f64> {
        self.theta.iter().chain(&self.initial).copied().collect()
    }
}

fn interval(profiler: &Profiler<'_, '_>, fit: &FreeRun, parameter: usize) -> Result<[f64; 2], FreeRunError> {
    let (std_error, quantile) = (fit.parameters[parameter].std_error, fit.profile_quantiles[parameter]);
    if !std_error.is_finite() || std_error <= 0.0 {
        return Ok([f64::NEG_INFINITY, f64::INFINITY]);
    }
    let end = |side: f64| profiler.end(parameter, side, quantile * std_error, quantile);
    Ok([end(-1.0)?, end(1.0)?])
}
