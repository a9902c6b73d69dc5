//! What efforts do between their samples: as it is asked for, or as the data have it beyond doubt.

use super::evidence::Evidence;
use super::result::Between;
use crate::error::AnalysisError;
use crate::result::number;
use ndof_models::blocks::Composite;
use ndof_models::{Held, Hold, Sampling, WeightedFit};

/// Odds against what only seems the better model; 2 ln of them is a difference of χ² that is beyond doubt.
pub(super) const ODDS: f64 = 1000.0;

/// Relative decrease of χ² at which the search for a hold ends: nothing to a difference that is beyond doubt.
const ROUGHLY: f64 = 1e-4;

/// How channels were sampled, where the search for the model of that sampling ended, and what the result says of it.
pub(super) struct Sampled {
    pub sampling: Sampling,
    pub theta: Vec<f64>,
    pub said: Option<Between>,
}

/// Fits `model` with each hold to independent frequencies, and takes the plainest that no other beats. Where the model leaves more than noise, a
/// hold must explain more of it than it leaves: a delay or a filter that the model lacks makes one hold look better than another.
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
    let comparison = &WeightedFit { cost_tolerance: ROUGHLY, ..comparison.clone() };
    let few = evidence.response.independent();
    let (response, first) = match comparison.fit_from(&model, &few, starts) {
        Ok(first) => (&few, first),
        // What few frequencies cannot carry, all may.
        Err(_) => (&*evidence.response, comparison.fit_from(&model, &evidence.response, starts)?),
    };
    let plain = Sampled { sampling: model.sampling, theta: first.theta.clone(), said: None };
    if let Some(hold) = asked {
        return Ok(Sampled { said: Some(Between { hold, chi2_less: None }), ..plain });
    }
    if evidence.sampled.is_none() || !evidence.errors_known() {
        return Ok(plain);
    }
    let mut fits = vec![(model.sampling, first)];
    for hold in [Hold::Zero, Hold::Linear] {
        model.sampling = held(hold);
        // A hold under which the model cannot be fitted is none.
        let from: Vec<Vec<f64>> = std::iter::once(fits[0].1.theta.clone()).chain(starts.iter().filter(|_| starts.len() > 1).cloned()).collect();
        fits.extend(comparison.fit_from(&model, response, &from).ok().map(|fit| (model.sampling, fit)));
    }
    let chi2 = |k: usize| fits[k].1.chi2;
    let best = (1..fits.len()).fold(0, |best, k| if chi2(k) < chi2(best) { k } else { best });
    let other = (0..fits.len()).filter(|k| *k != best).map(chi2).fold(f64::INFINITY, f64::min);
    let noise = fits[best].1.chi2 / fits[best].1.chi2_reduced;
    let doubt = (2.0 * ODDS.ln() * fits[best].1.chi2_reduced.max(1.0)).max(fits[best].1.chi2 - noise);
    let taken = if chi2(0) - chi2(best) > doubt { best } else { 0 };
    let (sampling, fit) = fits.swap_remove(taken);
    let chi2_less = (taken == best).then_some(other - fit.chi2).filter(|less| *less > doubt).and_then(number);
    Ok(Sampled { sampling, theta: fit.theta, said: Some(Between { hold: sampling.hold, chi2_less }) })
}
