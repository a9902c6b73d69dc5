//! The search for the minimum of a free-run fit.

use super::Causality;
use super::error::FreeRunError;
use super::shooting::Shooting;
use crate::{LeastSquares, LevenbergMarquardt, Minimum};
use faer::Mat;

/// Relative decrease of the cost at which passes before the last one stop.
pub(super) const ROUGH: f64 = 1e-5;
/// Relative decrease of the cost at which the last pass stops: parameters to 1e-6 of their errors.
pub(super) const FINE: f64 = 1e-12;

/// The minimum from parameters and initial states.
pub(super) fn solve(problem: &Shooting<'_>, start: &[f64], cost_tolerance: f64) -> Result<Minimum, FreeRunError> {
    Ok(minimiser(problem, start.len()).stopping_at(cost_tolerance).minimise(problem, start)?)
}

fn minimiser(problem: &Shooting<'_>, unknowns: usize) -> LevenbergMarquardt {
    let mut bounds = if problem.fixed.is_some() { Vec::new() } else { problem.bounds() };
    bounds.resize(unknowns, (f64::NEG_INFINITY, f64::INFINITY));
    LevenbergMarquardt::new(bounds)
}

/// Damping of a search whose first steps are short.
const CAUTIOUS: f64 = 10.0;

/// The rough minimum from a start. A bold first step can throw a parameter against a bound where nothing depends on it any more (a
/// Stribeck velocity of nothing): then the search is made once more with short steps and from where the laws themselves would begin, and
/// the least of these is taken.
pub(super) fn begin(problem: &Shooting<'_>, start: &[f64]) -> Result<Minimum, FreeRunError> {
    let bold = solve(problem, &problem.beginning(start), ROUGH);
    let bounds = problem.bounds();
    let thrown = |m: &Minimum| {
        let flat: Vec<usize> = (0..start.len()).filter(|&k| m.jacobian.col(k).norm_l2() == 0.0).collect();
        // What was without effect from the beginning was not thrown there.
        (0..start.len()).any(|k| m.at_bound[k] && start[k] > bounds[k].0 && start[k] < bounds[k].1) || {
            let first = if flat.is_empty() { Mat::new() } else { problem.jacobian(&problem.beginning(start)) };
            flat.iter().any(|&k| first.col(k).norm_l2() > 0.0)
        }
    };
    if bold.as_ref().is_ok_and(|m| !thrown(m)) {
        return bold;
    }
    let mechanism = problem.mechanism;
    let mut starts = mechanism.starts(&start[..mechanism.baseline_parameters()]);
    starts.insert(0, start.to_vec());
    starts.iter().fold(bold, |best, start| {
        let x = problem.beginning(start);
        match (minimiser(problem, x.len()).stopping_at(ROUGH).damped_by(CAUTIOUS).minimise(problem, &x), best) {
            (Ok(found), Ok(kept)) if found.cost >= kept.cost => Ok(kept),
            (Ok(found), _) => Ok(found),
            (Err(_), best) => best,
        }
    })
}

impl Shooting<'_> {
    pub(super) fn bounds(&self) -> Vec<(f64, f64)> {
        self.mechanism.parameters().iter().map(|p| (p.lower, p.upper)).collect()
    }

    /// Parameters, with initial states read from the motion.
    pub(super) fn beginning(&self, theta: &[f64]) -> Vec<f64> {
        let mut start = theta.to_vec();
        if self.causality == Causality::MotionIn {
            return start;
        }
        for w in &self.windows {
            let motion = |i: usize| &self.trials[w.trial].output(i)[w.range.clone()];
            start.extend((0..self.axes()).map(|i| motion(i)[0]));
            start.extend((0..self.axes()).map(|i| {
                let c = motion(i);
                let reach = (c.len() - 1).min(5);
                (c[reach] - c[0]) / (reach as f64 * self.step_s)
            }));
        }
        start
    }
}
