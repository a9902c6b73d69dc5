//! What efforts do between their samples: as it is asked for, or as the data have it beyond doubt.

use super::evidence::Evidence;
use super::result::Between;
use crate::error::AnalysisError;
use crate::result::number;
use ndof_models::blocks::Composite;
use ndof_models::{Fit, Held, Hold, Sampling, WeightedFit};

/// Odds against what only seems the better model; 2 ln of them is a difference of χ² that is beyond doubt.
pub(super) const ODDS: f64 = 1000.0;

/// Relative decrease of χ² at which the search for a hold ends: nothing to a difference that is beyond doubt.
const ROUGHLY: f64 = 1e-4;

/// How channels were sampled, where the search for the model of that sampling ended, and what the result says of it.
pub(super) struct Sampled {
    pub sampling: Sampling,
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
            said.also = self.rivals.iter().filter(moves).map(|rival| rival.hold).collect();
        }
        let entry = |rival: &Rival, k: usize| rival.apart.get(k).copied().unwrap_or(0.0);
        fit.add_covariance(|r, c| self.rivals.iter().map(|rival| rival.share * entry(rival, r) * entry(rival, c)).sum());
    }
}

/// Fits `model` with each hold to independent frequencies, and takes the plainest that no other beats. Where the model leaves more than noise, a
/// hold must explain more of it than it leaves: a delay or a filter that the model lacks makes one hold look better than another. What is not taken
/// and not a thousand times less likely remains a rival.
pub(super) fn sampled(
    comparison: &WeightedFit,
    model: Composite,
    starts: &[Vec<f64>],
    evidence: &Evidence<'_>,
    asked: Option<Hold>,
) -> Result<Sampled, AnalysisError> {
    let held = |hold| evidence.sampled.map_or(Sampling::CONTINUOUS, |(sample_rate_hz, derivatives)| Sampling { hold, sample_rate_hz, derivatives });
    if evidence.sampled.is_none() && asked.is_some_and(|hold| hold != Hold::BandLimited) {
        return Err(AnalysisError::Hold);
    }
    let mut model = Held { model, sampling: held(asked.unwrap_or_default()) };
    let rough = &WeightedFit { cost_tolerance: ROUGHLY, ..comparison.clone() };
    let few = evidence.response.independent();
    let (response, first) = match rough.fit_from(&model, &few, starts) {
        Ok(first) => (&few, first),
        // What few frequencies cannot carry, all may.
        Err(_) => (&*evidence.response, rough.fit_from(&model, &evidence.response, starts)?),
    };
    let plain = Sampled { sampling: model.sampling, theta: first.theta.clone(), said: None, rivals: Vec::new() };
    if let Some(hold) = asked {
        return Ok(Sampled { said: Some(Between { hold, chi2_less: None, also: Vec::new() }), ..plain });
    }
    if evidence.sampled.is_none() || !evidence.errors_known() {
        return Ok(plain);
    }
    let mut fits = vec![(model.sampling, first)];
    for hold in [Hold::Zero, Hold::Linear] {
        model.sampling = held(hold);
        // A hold under which the model cannot be fitted is none.
        let from: Vec<Vec<f64>> = std::iter::once(fits[0].1.theta.clone()).chain(starts.iter().filter(|_| starts.len() > 1).cloned()).collect();
        fits.extend(rough.fit_from(&model, response, &from).ok().map(|fit| (model.sampling, fit)));
    }
    let chi2 = |k: usize| fits[k].1.chi2;
    let best = (1..fits.len()).fold(0, |best, k| if chi2(k) < chi2(best) { k } else { best });
    let other = (0..fits.len()).filter(|k| *k != best).map(chi2).fold(f64::INFINITY, f64::min);
    let noise = fits[best].1.chi2 / fits[best].1.chi2_reduced;
    let doubt = (2.0 * ODDS.ln() * fits[best].1.chi2_reduced.max(1.0)).max(fits[best].1.chi2 - noise);
    let taken = if chi2(0) - chi2(best) > doubt { best } else { 0 };
    let chi2_less = (taken == best).then_some(other - chi2(best)).filter(|less| *less > doubt).and_then(number);
    let likelihood = |k: usize| (0.5 * (chi2(best) - chi2(k)) / fits[best].1.chi2_reduced.max(1.0)).exp();
    let all: f64 = (0..fits.len()).map(likelihood).sum();
    let open: Vec<(usize, f64)> = (0..fits.len()).filter(|k| *k != taken).map(|k| (k, likelihood(k) / all)).filter(|(_, share)| share * ODDS > 1.0).collect();
    let mut settled = |k: usize| {
        model.sampling = fits[k].0;
        comparison.fit(&model, response, &fits[k].1.theta).map_or_else(|_| fits[k].1.theta.clone(), |fit| fit.theta)
    };
    let own = if open.is_empty() { Vec::new() } else { settled(taken) };
    let mut rival =
        |(k, share): (usize, f64)| Rival { hold: fits[k].0.hold, share, apart: settled(k).iter().zip(&own).map(|(there, own)| there - own).collect() };
    let rivals = open.into_iter().map(&mut rival).collect();
    let (sampling, fit) = fits.swap_remove(taken);
    Ok(Sampled { sampling, theta: fit.theta, said: Some(Between { hold: sampling.hold, chi2_less, also: Vec::new() }), rivals })
}
