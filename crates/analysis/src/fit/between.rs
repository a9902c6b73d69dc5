//! What efforts do between their samples: as it is asked for, or as the data have it beyond doubt.

use super::evidence::Evidence;
use super::result::Between;
use super::ticks::{Tick, Ticks};
use crate::error::AnalysisError;
use crate::result::number;
use ndof_models::blocks::Composite;
use ndof_models::{Fit, Held, Hold, InertiaDampingStiffnessModel, Sampling, WeightedFit};

/// Odds against what only seems the better model; 2 ln of them is a difference of χ² that is beyond doubt.
pub(super) const ODDS: f64 = 1000.0;

/// Deviations of χ² from its mean that one in a thousand exceeds, by the normal law.
const SPREAD: f64 = 3.09;

/// Fits from which the share of a command that jumps follows: each leaves some thousandths of the error of that before.
const ROUNDS: usize = 2;

/// Relative decrease of χ² at which the search for a hold ends: nothing to a difference that is beyond doubt.
const ROUGHLY: f64 = 1e-4;

/// How channels were sampled, where the search for the model of that sampling ended, and what the result says of it.
pub(super) struct Sampled {
    pub sampling: Sampling,
    /// What jumps at the ticks, where something does.
    pub ticks: Option<Ticks>,
    pub theta: Vec<f64>,
    pub said: Option<Between>,
    /// Holds that may be the true one as well.
    rivals: Vec<Rival>,
}

/// A hold that the data do not exclude: its share of the likelihood, and how far its parameters are from those that were taken.
struct Rival {
    hold: Hold,
    share: f64,
    apart: Vec<f64>,
}

impl Sampled {
    /// Gives intervals what is unknown of the hold, Σ p_h (θ_h − θ)(θ_h − θ)ᵀ over holds of likelihood p_h, and says so where that is
    /// more than there was.
    pub(super) fn widen(&mut self, fit: &mut Fit) {
        let moves = |rival: &&Rival| rival.apart.iter().zip(&fit.parameters).any(|(apart, p)| rival.share * apart * apart > p.std_error * p.std_error);
        if let Some(said) = &mut self.said {
            said.also = self.rivals.iter().filter(moves).map(|rival| rival.hold).filter(|hold| *hold != said.hold).collect();
            said.also.dedup();
        }
        let entry = |rival: &Rival, k: usize| rival.apart.get(k).copied().unwrap_or(0.0);
        fit.add_covariance(|r, c| self.rivals.iter().map(|rival| rival.share * entry(rival, r) * entry(rival, c)).sum());
    }
}

/// A hold with the fit under it.
struct Tried {
    hold: Hold,
    ticks: Option<Ticks>,
    fit: Fit,
}

/// Fits `model` with each hold to independent frequencies, and takes the plainest that no other beats. Where the model leaves more than noise, a
/// hold must explain more of it than it leaves: a delay or a filter that the model lacks makes one hold look better than another. What is not taken
/// and not a thousand times less likely remains a rival.
pub(super) fn sampled(
    comparison: &WeightedFit,
    (base, model): (&InertiaDampingStiffnessModel, Composite),
    starts: &[Vec<f64>],
    evidence: &Evidence<'_>,
    asked: Option<Hold>,
) -> Result<Sampled, AnalysisError> {
    let held = |hold| evidence.sampled.map_or(Sampling::CONTINUOUS, |(sample_rate_hz, derivatives)| Sampling { hold, sample_rate_hz, derivatives });
    if evidence.sampled.is_none() && asked.is_some_and(|hold| hold != Hold::BandLimited) {
        return Err(AnalysisError::Hold);
    }
    let read_at_ticks = |hold: Hold| matches!(hold, Hold::ReadAfter | Hold::ReadBefore);
    let mut model = Held { model, sampling: held(asked.unwrap_or_default()) };
    let rough = &WeightedFit { cost_tolerance: ROUGHLY, ..comparison.clone() };
    let few = evidence.response.independent();
    let (all, first) = match rough.fit_from(&model, &few, starts) {
        Ok(first) => (false, first),
        // What few frequencies cannot carry, all may.
        Err(_) => (true, rough.fit_from(&model, &evidence.response, starts)?),
    };
    let plain = |theta, chi2_less| {
        let said = asked.map(|hold| Between { hold, chi2_less, also: Vec::new() });
        Sampled { sampling: model.sampling, ticks: None, theta, said, rivals: Vec::new() }
    };
    let ticked = asked.is_some_and(read_at_ticks);
    if !ticked && (asked.is_some() || evidence.sampled.is_none() || !evidence.errors_known()) {
        return Ok(plain(first.theta, None));
    }
    let on = |ticks: Option<&Ticks>| {
        let own = ticks.map(|ticks| evidence.on(ticks));
        let response = &own.as_ref().unwrap_or(evidence).response;
        if all { response.clone().into_owned() } else { response.independent() }
    };
    let mut fits = vec![Tried { hold: model.sampling.hold, ticks: None, fit: first }];
    let others = [Hold::Zero, Hold::Linear].into_iter().filter(|_| asked.is_none());
    for hold in others {
        model.sampling = held(hold);
        // A hold under which the model cannot be fitted is none.
        let from: Vec<Vec<f64>> = std::iter::once(fits[0].fit.theta.clone()).chain(starts.iter().filter(|_| starts.len() > 1).cloned()).collect();
        fits.extend(rough.fit_from(&model, &on(None), &from).ok().map(|fit| Tried { hold, ticks: None, fit }));
    }
    let tick = Tick::of(base, evidence, (rough, &fits[0].fit.theta));
    let places = [Hold::ReadAfter, Hold::ReadBefore].into_iter().filter(|hold| asked.is_none_or(|asked| asked == *hold));
    for (hold, motors) in places.flat_map(|hold| [(hold, true), (hold, false)]) {
        model.sampling = held(hold);
        // The share that jumps follows from the inertia, and the inertia, a little, from what jumps.
        let mut found: Option<Tried> = None;
        for _ in 0..ROUNDS {
            let theta = &found.as_ref().unwrap_or(&fits[0]).fit.theta;
            let Some(ticks) = tick.as_ref().and_then(|tick| tick.at(theta, evidence, hold, motors)) else { break };
            let fit = rough.fit(&model, &on(Some(&ticks)), theta).ok();
            found = fit.map(|fit| Tried { hold, ticks: Some(ticks), fit });
            if found.is_none() {
                break;
            }
        }
        fits.extend(found);
    }
    if ticked {
        // Fitted as it is only to begin with.
        fits.remove(0);
        if fits.is_empty() {
            return Err(AnalysisError::Ticks);
        }
    }
    // By how much χ² may be less for the errors of a sampling, which each shapes otherwise, and for no better model.
    let noise = |fit: &Fit| fit.chi2 / fit.chi2_reduced;
    let spread = |fit: &Fit| SPREAD * (2.0 * noise(fit)).sqrt();
    // What is read at ticks has nothing that is free: where more than noise is left it is not that, or not that alone.
    fits.retain(|Tried { ticks, fit, .. }| ticked || ticks.is_none() || fit.chi2 - noise(fit) < spread(fit));
    let least = |fits: &[Tried], hold: Hold| fits.iter().filter(|tried| tried.hold == hold).map(|tried| tried.fit.chi2).fold(f64::INFINITY, f64::min);
    // What stays whole until the next is the limit in which nothing is before the effort; inertia has said how much is.
    let after = least(&fits, Hold::ReadAfter);
    fits.retain(|tried| tried.hold != Hold::Zero || after - tried.fit.chi2 > spread(&tried.fit) * tried.fit.chi2_reduced.max(1.0));
    // Whether all that the motors do is held, or the command alone, changes M and B and hardly what is left: they are as likely as each other.
    let as_likely = |tried: &Tried| {
        let least = least(&fits, tried.hold);
        if tried.fit.chi2 - least < spread(&tried.fit) * tried.fit.chi2_reduced.max(1.0) { least } else { tried.fit.chi2 }
    };
    let levels: Vec<f64> = fits.iter().map(as_likely).collect();
    let chi2 = |k: usize| levels[k];
    let best = (1..fits.len()).fold(0, |best, k| if chi2(k) < chi2(best) { k } else { best });
    let other = (0..fits.len()).filter(|k| fits[*k].hold != fits[best].hold).map(chi2).fold(f64::INFINITY, f64::min);
    let doubt = (2.0 * ODDS.ln() * fits[best].fit.chi2_reduced.max(1.0)).max(chi2(best) - noise(&fits[best].fit));
    let taken = if ticked || chi2(0) - chi2(best) > doubt { best } else { 0 };
    let chi2_less = (taken == best).then_some(other - chi2(best)).filter(|less| *less > doubt).and_then(number);
    let likelihood = |k: usize| (0.5 * (chi2(best) - chi2(k)) / fits[best].fit.chi2_reduced.max(1.0)).exp();
    let sum: f64 = (0..fits.len()).map(likelihood).sum();
    let open: Vec<(usize, f64)> = (0..fits.len()).filter(|k| *k != taken).map(|k| (k, likelihood(k) / sum)).filter(|(_, share)| share * ODDS > 1.0).collect();
    let mut settled = |k: usize| {
        let Tried { hold, ticks, fit } = &fits[k];
        model.sampling = held(*hold);
        comparison.fit(&model, &on(ticks.as_ref()), &fit.theta).map_or_else(|_| fit.theta.clone(), |fit| fit.theta)
    };
    let own = if open.is_empty() { Vec::new() } else { settled(taken) };
    let mut rival =
        |(k, share): (usize, f64)| Rival { hold: fits[k].hold, share, apart: settled(k).iter().zip(&own).map(|(there, own)| there - own).collect() };
    let rivals = open.into_iter().map(&mut rival).collect();
    let Tried { hold, ticks, fit } = fits.swap_remove(taken);
    Ok(Sampled { sampling: held(hold), ticks, theta: fit.theta, said: Some(Between { hold, chi2_less, also: Vec::new() }), rivals })
}
