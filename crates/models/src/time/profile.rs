//! Intervals by the profile of the likelihood: right where a threshold makes Wald's wrong.

use super::fit::{FINE, FreeRunError};
use super::shooting::Shooting;
use super::{FreeRun, FreeRunFit, Mechanism, TimeTrial};
use crate::{LeastSquares, LevenbergMarquardt};
use faer::Mat;

/// Evaluations to each side.
const EVALUATIONS: usize = 12;
/// How near to the quantile the end of an interval has to be.
const CLOSE: f64 = 0.02;

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
        let mut problem = self.problem(mechanism, trials, None)?;
        problem.sigma.clone_from(&fit.sigma);
        problem.coloured.clone_from(&fit.coloured);
        let best: Vec<f64> = fit.theta.iter().chain(&fit.initial).copied().collect();
        if let Some(noise) = &fit.limb_noise {
            problem.disturbed_as(&best, noise);
        }
        let residuals = problem.residuals(&best);
        let square: f64 = residuals.iter().map(|r| r * r).sum();
        let degrees = (residuals.len() - best.len()) as f64;
        let quantile = fit.profile_quantiles[parameter];
        let info = &mechanism.parameters()[parameter];
        let mut bounds: Vec<(f64, f64)> = mechanism.parameters().iter().map(|p| (p.lower, p.upper)).collect();
        bounds.resize(best.len(), (f64::NEG_INFINITY, f64::INFINITY));
        bounds.remove(parameter);
        let std_error = fit.parameters[parameter].std_error;
        let mut out = [f64::NEG_INFINITY, f64::INFINITY];
        if !std_error.is_finite() || std_error <= 0.0 {
            return Ok(out);
        }
        for (end, side) in out.iter_mut().zip([-1.0, 1.0]) {
            let limit = if side < 0.0 { info.lower } else { info.upper };
            let mut rest: Vec<f64> = best.iter().enumerate().filter(|(k, _)| *k != parameter).map(|(_, v)| *v).collect();
            // Steps away from the best value and how far the root of the rise has come, in units of the quantile.
            let (mut inside, mut outside) = ((0.0, 0.0), None);
            let mut step = quantile * std_error;
            for _ in 0..EVALUATIONS {
                let at = best[parameter] + side * step;
                if (at - limit) * side >= 0.0 {
                    *end = limit;
                    break;
                }
                let held = Held { problem: &problem, index: parameter, value: at };
                let minimum = LevenbergMarquardt::new(bounds.clone()).stopping_at(FINE.sqrt()).minimise(&held, &rest)?;
                let rise = ((2.0 * minimum.cost - square).max(0.0) / (square / degrees)).sqrt() / quantile;
                if (rise - 1.0).abs() < CLOSE {
                    *end = at;
                    break;
                }
                if rise < 1.0 {
                    rest = minimum.x;
                    inside = (step, rise);
                } else {
                    outside = Some((step, rise));
                }
                step = match outside {
                    Some((far, high)) => {
                        let share = ((1.0 - inside.1) / (high - inside.1)).clamp(0.1, 0.9);
                        inside.0 + share * (far - inside.0)
                    }
                    None => inside.0 * (1.0 / inside.1.max(0.1)).clamp(1.3, 4.0),
                };
                *end = best[parameter] + side * step;
            }
        }
        Ok(out)
    }
}
