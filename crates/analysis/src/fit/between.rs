//! What efforts do between their samples: as it is asked for, or as the data have it beyond doubt.

use super::evidence::Evidence;
use super::result::Between;
use super::ticks::{self, Tick};
use crate::error::AnalysisError;
use crate::result::number;
use ndof_models::blocks::Composite;
use ndof_models::{Fit, Held, Hold, InertiaDampingStiffnessModel, Sampling, Ticks, WeightedFit};
use ndof_sysid::FrequencyResponse;

/// Odds against what only seems the better model; 2 ln of them is a difference of χ² that is beyond doubt.
pub(super) const ODDS: f64 = 1000.0;

/// Deviations of χ² from its mean that one in a thousand exceeds, by the normal law.
const SPREAD: f64 = 3.09;

/// Share of the misfit of a curve without jumps that a loop at ticks may leave: what answers the motion half a tick late is an inertia to the first order
/// of that, and the second, (ωT/2)²/2, is less than a tenth at a tenth of the sample rate; χ² goes by squares.
const LEFT: f64 = 0.01;

/// Fits after which what acts at ticks follows from the limb no further. At a tenth of the sample rate each leaves a tenth of the error of that before.
const ROUNDS: usize = 5;

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

impl Tried {
    /// The mean of χ² by its law.
    fn noise(&self) -> f64 {
        self.fit.chi2 / self.fit.chi2_reduced
    }

    /// By how much χ² is beyond that by chance, and may differ for the errors of a response that is read in one way or another.
    fn chance(&self) -> f64 {
        SPREAD * (2.0 * self.noise()).sqrt()
    }
}

/// Fits of one model under one hold after the other.
struct Search<'a> {
    rough: WeightedFit,
    model: Held<Composite>,
    evidence: &'a Evidence<'a>,
    /// Whether independent frequencies carry no fit, and all are taken.
    all: bool,
}

impl Search<'_> {
    fn held(&self, hold: Hold) -> Sampling {
        self.evidence.sampled.map_or(Sampling::CONTINUOUS, |(sample_rate_hz, derivatives)| Sampling { hold, sample_rate_hz, derivatives })
    }

    /// The response to efforts as they act.
    fn response(&self, hold: Hold, ticks: Option<&Ticks>) -> FrequencyResponse {
        let response = if self.all { self.evidence.response.clone().into_owned() } else { self.evidence.response.independent() };
        match ticks {
            Some(ticks) => response.to_parts(&ticks::read(ticks, self.held(hold), &response.frequency_hz)),
            None => response,
        }
    }

    /// A hold under which the model cannot be fitted is none.
    fn under(&mut self, hold: Hold, ticks: Option<Ticks>, starts: &[Vec<f64>]) -> Option<Tried> {
        self.model.sampling = self.held(hold);
        let fit = self.rough.fit_from(&self.model, &self.response(hold, ticks.as_ref()), starts).ok()?;
        Some(Tried { hold, ticks, fit })
    }

    /// What acts follows from the limb, and the limb, a little, from what acts: until χ² changes by less than a standard error makes.
    fn at_ticks(&mut self, tick: &Tick<'_>, (hold, motors): (Hold, bool), start: &[f64]) -> Option<Tried> {
        let mut next = |theta: &[f64]| self.under(hold, Some(tick.at(theta, motors)?), &[theta.to_vec()]);
        let mut found = next(start)?;
        for _ in 1..ROUNDS {
            let better = next(&found.fit.theta)?;
            let settled = (better.fit.chi2 - found.fit.chi2).abs() < 1.0;
            found = better;
            if settled {
                break;
            }
        }
        Some(found)
    }

    /// Where the search ends that was rough.
    fn settled(&mut self, comparison: &WeightedFit, Tried { hold, ticks, fit }: &Tried) -> Vec<f64> {
        self.model.sampling = self.held(*hold);
        comparison.fit(&self.model, &self.response(*hold, ticks.as_ref()), &fit.theta).map_or_else(|_| fit.theta.clone(), |fit| fit.theta)
    }
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
    if evidence.sampled.is_none() && asked.is_some_and(|hold| hold != Hold::BandLimited) {
        return Err(AnalysisError::Hold);
    }
    let rough = WeightedFit { cost_tolerance: ROUGHLY, ..comparison.clone() };
    let mut search = Search { rough, model: Held { model, sampling: Sampling::CONTINUOUS }, evidence, all: false };
    let own = asked.unwrap_or_default();
    let first = match search.under(own, None, starts) {
        Some(first) => first,
        None => {
            search.all = true;
            let fit = search.rough.fit_from(&search.model, &evidence.response, starts)?;
            Tried { hold: own, ticks: None, fit }
        }
    };
    let ticked = matches!(asked, Some(Hold::ReadAfter | Hold::ReadBefore));
    if !ticked && (asked.is_some() || evidence.sampled.is_none() || !evidence.errors_known()) {
        let said = asked.map(|hold| Between { hold, chi2_less: None, also: Vec::new() });
        return Ok(Sampled { sampling: search.held(own), ticks: None, theta: first.fit.theta, said, rivals: Vec::new() });
    }
    let begin = first.fit.theta.clone();
    let from: Vec<Vec<f64>> = std::iter::once(begin.clone()).chain(starts.iter().filter(|_| starts.len() > 1).cloned()).collect();
    let mut fits = vec![first];
    fits.extend([Hold::Zero, Hold::Linear].into_iter().filter(|_| !ticked).filter_map(|hold| search.under(hold, None, &from)));
    if let Some(tick) = Tick::of(base, evidence, (&search.rough, &begin)) {
        let places = [Hold::ReadAfter, Hold::ReadBefore].into_iter().filter(|hold| asked.is_none_or(|asked| asked == *hold));
        fits.extend(places.flat_map(|hold| [(hold, true), (hold, false)]).filter_map(|place| search.at_ticks(&tick, place, &begin)));
    }
    let fits = if ticked { fits.split_off(1) } else { possible(fits) };
    // Whether all that the motors do is held, or the command alone, changes M and B and little of what is left, and neither is quite what a controller does:
    // they are as likely as each other.
    let levels: Vec<f64> = fits.iter().map(|tried| least(&fits, tried.hold)).collect();
    let order = |a: &usize, b: &usize| levels[*a].total_cmp(&levels[*b]).then(fits[*a].fit.chi2.total_cmp(&fits[*b].fit.chi2));
    let best = (0..fits.len()).min_by(order).unwrap_or_default();
    let Some(Tried { hold, fit, .. }) = fits.get(best) else { return Err(AnalysisError::Ticks) };
    let misfit = fit.chi2_reduced.max(1.0);
    let other = (0..fits.len()).filter(|k| fits[*k].hold != *hold).map(|k| levels[k]).fold(f64::INFINITY, f64::min);
    let doubt = (2.0 * ODDS.ln() * misfit).max(levels[best] - fits[best].noise());
    let taken = if ticked || levels[0] - levels[best] > doubt { best } else { 0 };
    let chi2_less = (taken == best).then_some(other - levels[best]).filter(|less| *less > doubt).and_then(number);
    let alike = |k: usize| fits.iter().filter(|tried| tried.hold == fits[k].hold).count() as f64;
    let likelihoods: Vec<f64> = (0..fits.len()).map(|k| (0.5 * (levels[best] - levels[k]) / misfit).exp() / alike(k)).collect();
    let all: f64 = likelihoods.iter().sum();
    let open: Vec<usize> = (0..fits.len()).filter(|k| *k != taken && likelihoods[*k] / all * ODDS > 1.0).collect();
    let settled = if open.is_empty() { Vec::new() } else { search.settled(comparison, &fits[taken]) };
    let mut rival = |k: usize| {
        let apart = search.settled(comparison, &fits[k]).iter().zip(&settled).map(|(there, own)| there - own).collect();
        Rival { hold: fits[k].hold, share: likelihoods[k] / all, apart }
    };
    let rivals = open.into_iter().map(&mut rival).collect();
    let Tried { hold, ticks, fit } = &fits[taken];
    let said = Some(Between { hold: *hold, chi2_less, also: Vec::new() });
    Ok(Sampled { sampling: search.held(*hold), ticks: ticks.clone(), theta: fit.theta.clone(), said, rivals })
}

/// Without what cannot be.
fn possible(mut fits: Vec<Tried>) -> Vec<Tried> {
    // What is read at ticks has nothing that is free: where more than noise is left, and more than its equations leave, it is not that, or not that alone.
    let left = |tried: &Tried| tried.fit.chi2 - tried.noise();
    let otherwise = left(&fits[0]);
    let enough = |tried: &Tried| left(tried) < tried.chance().max(LEFT * otherwise);
    let explained: Vec<Hold> = fits.iter().filter(|tried| enough(tried)).map(|tried| tried.hold).collect();
    fits.retain(|tried| tried.ticks.is_none() || explained.contains(&tried.hold));
    // What stays whole until the next is the limit in which nothing is before the effort; inertia has said how much is.
    let after = least(&fits, Hold::ReadAfter);
    fits.retain(|tried| tried.hold != Hold::Zero || after - tried.fit.chi2 > tried.chance() * tried.fit.chi2_reduced.max(1.0));
    fits
}

/// The least χ² of a hold.
fn least(fits: &[Tried], hold: Hold) -> f64 {
    fits.iter().filter(|tried| tried.hold == hold).map(|tried| tried.fit.chi2).fold(f64::INFINITY, f64::min)
}
