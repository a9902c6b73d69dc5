//! Which parameters are wrong: forward steps with a backward check.

use super::balance::{Balance, Fitted, rms};
use crate::baseline::Status;
use crate::search::ENOUGH;
use crate::whittle::whitened_power;
use rayon::prelude::*;

/// Rounds of a fit that only compares, and of one that counts.
const SCREEN: usize = 3;
const SETTLE: usize = 4;
/// Parameters named at most.
const MOST: usize = 6;

/// A parameter as tried in a step.
#[derive(Clone)]
pub(super) struct Tried {
    pub parameter: usize,
    pub value: f64,
    /// Log-likelihood gained, less the price.
    pub net: f64,
    /// Share of the whitened power that it removes.
    pub share: f64,
}

/// The outcome.
pub(super) struct Found {
    /// With the free parameters fitted and all nominal ones as given.
    pub start: Fitted,
    /// Parameters that are wrong, the first found first.
    pub wrong: Vec<usize>,
    /// The step of each.
    pub steps: Vec<Vec<Tried>>,
    pub end: Fitted,
    /// Parameters that `end` fitted, in the order of its covariance.
    pub fitted: Vec<usize>,
    /// Net log-likelihood lost without each.
    pub worth: Vec<f64>,
    /// Root of the power that each removes, as a share of the force's rms on the axis where it is largest.
    pub size: Vec<f64>,
    /// With every nominal parameter free.
    pub all: Option<Fitted>,
}

fn size(balance: &Balance<'_>, without: &Fitted, with: &Fitted) -> f64 {
    let pairs = without.residual.iter().zip(&with.residual).zip(&balance.given_rms);
    pairs.map(|((b, a), f)| (rms(b).powi(2) - rms(a).powi(2)).max(0.0).sqrt() / f.max(f64::MIN_POSITIVE)).fold(0.0, f64::max)
}

/// Tries every nominal parameter, again and again, until none gains enough.
pub(super) fn search(balance: &Balance<'_>) -> Option<Found> {
    let parameters = balance.mechanism.parameters();
    let nominal: Vec<usize> = (0..parameters.len()).filter(|&p| parameters[p].status == Status::Nominal).collect();
    let free: Vec<usize> = (0..parameters.len()).filter(|&p| parameters[p].status == Status::Free).collect();
    let values: Vec<f64> = parameters.iter().map(|p| p.value).collect();
    let start = balance.fit(&values, &free, SETTLE)?;
    let mut found = Found { start: start.clone(), wrong: vec![], steps: vec![], end: start, fitted: free.clone(), worth: vec![], size: vec![], all: None };
    let fitted = |wrong: &[usize]| -> Vec<usize> { free.iter().chain(wrong).copied().collect() };
    loop {
        let level = &found.end;
        let whitened = |fit: &Fitted| whitened_power(&fit.residual, &level.power);
        let before = whitened(level);
        let mut step: Vec<Tried> = nominal
            .par_iter()
            .filter(|p| !found.wrong.contains(p))
            .filter_map(|&p| {
                let moved = fitted(&[found.wrong.as_slice(), &[p]].concat());
                let fit = balance.fit(&level.values, &moved, SCREEN)?;
                let net = fit.log_likelihood - level.log_likelihood - balance.layout.price(1);
                Some(Tried { parameter: p, value: fit.values[p], net, share: 1.0 - whitened(&fit) / before })
            })
            .collect();
        step.sort_by(|a, b| b.net.total_cmp(&a.net).then(a.parameter.cmp(&b.parameter)));
        let lead = step.first().cloned();
        found.steps.push(step);
        let Some(lead) = lead.filter(|l| l.net > ENOUGH && found.wrong.len() < MOST) else { break };
        found.wrong.push(lead.parameter);
        let mut from = found.end.values.clone();
        from[lead.parameter] = lead.value;
        found.end = balance.fit(&from, &fitted(&found.wrong), SETTLE)?;
    }
    // Backward: what the later ones have made needless goes.
    loop {
        let judged: Vec<(f64, f64)> = (0..found.wrong.len())
            .into_par_iter()
            .map(|k| {
                let rest: Vec<usize> = found.wrong.iter().enumerate().filter(|(q, _)| *q != k).map(|(_, p)| *p).collect();
                let mut from = found.end.values.clone();
                from[found.wrong[k]] = values[found.wrong[k]];
                let without = balance.fit(&from, &fitted(&rest), SCREEN);
                without.map_or((f64::INFINITY, f64::INFINITY), |f| {
                    (found.end.log_likelihood - f.log_likelihood - balance.layout.price(1), size(balance, &f, &found.end))
                })
            })
            .collect();
        (found.worth, found.size) = judged.into_iter().unzip();
        let Some(weak) = (0..found.wrong.len()).filter(|&k| found.worth[k] <= ENOUGH).min_by(|&a, &b| found.worth[a].total_cmp(&found.worth[b])) else { break };
        let p = found.wrong.remove(weak);
        found.steps.remove(weak);
        let mut from = found.end.values.clone();
        from[p] = values[p];
        found.end = balance.fit(&from, &fitted(&found.wrong), SETTLE)?;
    }
    found.fitted = fitted(&found.wrong);
    found.all = balance.fit(&found.end.values, &fitted(&nominal), SCREEN);
    Some(found)
}
