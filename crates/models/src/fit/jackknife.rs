//! Intervals whose width comes from how much the trials disagree.

use super::{Fit, FitError, Parameter, WeightedFit, result::t_quantile};
use crate::ParametricModel;
use ndof_sysid::FrequencyResponse;

/// Fewest trials whose disagreement says something.
const FEWEST_TRIALS: usize = 3;

impl WeightedFit {
    /// Fits `model` to the pooled `response` as [`WeightedFit::fit`] does, and sets the width of the intervals by the
    /// jackknife over trials: `without[t]` is the same estimate from all trials but trial t.
    ///
    /// The model's covariance counts the whole residual as noise, but part of it is leakage, which cancels between
    /// overlapping segments and between bins: where there is little noise it makes intervals several times too wide.
    /// The scatter of the leave-one-out fits has no such assumption but few degrees of freedom a parameter. So the
    /// shape of the covariance is kept and its size becomes
    ///
    /// c² = mean over parameters of (jackknife variance / model variance),  Var_J = (m − 1)/m Σ_t (θ_t − θ̄)²
    ///
    /// with Student's t for (m − 1) k² / Σ ρ_ij² degrees of freedom (Satterthwaite; ρ the correlations of the k
    /// parameters). With fewer than three trials, this is the plain fit.
    ///
    /// # Errors
    /// As [`WeightedFit::fit`].
    ///
    /// # References
    /// B. Efron & R. Tibshirani (1993), An Introduction to the Bootstrap, ch. 11. F. E. Satterthwaite (1946).
    pub fn fit_trials(&self, model: &dyn ParametricModel, response: &FrequencyResponse, without: &[FrequencyResponse], start: &[f64]) -> Result<Fit, FitError> {
        let fit = self.fit(model, response, start)?;
        let left = without.iter().map(|r| self.fit(model, r, &fit.theta).map(|f| f.theta)).collect::<Result<Vec<_>, _>>()?;
        Ok(rescale_by_trials(model, fit, &left))
    }
}

/// `fit` with its covariance scaled to the scatter of `left`, the parameters without each trial.
pub(crate) fn rescale_by_trials(model: &dyn ParametricModel, mut fit: Fit, left: &[Vec<f64>]) -> Fit {
    let sound: Vec<usize> = (0..fit.theta.len()).filter(|&k| fit.covariance[[k, k]].is_finite() && fit.covariance[[k, k]] > 0.0).collect();
    if left.len() < FEWEST_TRIALS || sound.is_empty() {
        return fit;
    }
    let trials = left.len() as f64;
    let variance = |k: usize| {
        let mean = left.iter().map(|l| l[k]).sum::<f64>() / trials;
        left.iter().map(|l| (l[k] - mean).powi(2)).sum::<f64>() * (trials - 1.0) / trials
    };
    let ratio = sound.iter().map(|&k| variance(k) / fit.covariance[[k, k]]).sum::<f64>() / sound.len() as f64;
    let covariance = &fit.covariance;
    let squared_correlations: f64 =
        sound.iter().flat_map(|&i| sound.iter().map(move |&j| covariance[[i, j]].powi(2) / (covariance[[i, i]] * covariance[[j, j]]))).sum();
    let freedom = (trials - 1.0) * (sound.len() * sound.len()) as f64 / squared_correlations;
    fit.covariance.mapv_inplace(|v| v * ratio);
    fit.covariance_scale = ratio;
    fit.interval_quantile = t_quantile(freedom);
    fit.parameters = Parameter::describe(&model.parameters(), &fit.theta, &fit.covariance, |_| fit.interval_quantile, |k| model.scale(&fit.theta, k));
    fit
}
