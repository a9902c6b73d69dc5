//! Intervals whose width comes from how much the trials disagree.

use super::{Fit, FitError, Parameter, WeightedFit, Width, found, result::t_quantile};
use crate::ParametricModel;
use ndof_sysid::FrequencyResponse;
use rayon::prelude::*;

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
        let left = left_out(without, |r| found(&self.problem(model, r, &fit.theta)?, model, &fit.theta, self.cost_tolerance))?;
        Ok(rescale_by_trials(model, fit, &left))
    }
}

/// The parameters that `found` gives without each trial.
pub(crate) fn left_out(
    without: &[FrequencyResponse],
    found: impl Fn(&FrequencyResponse) -> Result<Vec<f64>, FitError> + Sync + Send,
) -> Result<Vec<Vec<f64>>, FitError> {
    without.par_iter().map(found).collect::<Vec<_>>().into_iter().collect()
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
    fit.width = Width::Trials;
    fit.interval_quantile = t_quantile(freedom);
    fit.parameters = Parameter::describe(&model.parameters(), &fit.theta, &fit.covariance, |_| fit.interval_quantile, &model.scales(&fit.theta));
    fit
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shared_tests::fitted_limb;
    use ndarray::arr2;

    #[test]
    fn the_width_is_the_jackknifes_and_the_shape_the_models() {
        let (model, _, own) = fitted_limb();
        let fit = |covariance: [[f64; 3]; 3]| Fit { covariance: arr2(&covariance), ..own.clone() };
        let plain = fit([[4.0, 1.0, 0.0], [1.0, 1.0, 0.0], [0.0, 0.0, 9.0]]);
        let left = [[1.0, 5.0, 10.0], [2.0, 5.0, 14.0], [3.0, 8.0, 12.0], [2.0, 2.0, 16.0]].map(|l| l.to_vec());
        // Sums of squares about the means 2, 5 and 13: 2, 18 and 20; (m − 1)/m = 3/4 of them over the model's variances.
        let ratio = (0.75 * 2.0 / 4.0 + 0.75 * 18.0 / 1.0 + 0.75 * 20.0 / 9.0) / 3.0;
        // One pair of parameters is correlated, by ρ² = 1/4.
        let freedom = 3.0 * 9.0 / (3.0 + 2.0 * 0.25);
        let found = rescale_by_trials(&model, plain.clone(), &left);
        assert!((found.covariance_scale / ratio - 1.0).abs() < 1e-12 && (found.interval_quantile / t_quantile(freedom) - 1.0).abs() < 1e-12);
        assert!(found.covariance.iter().zip(&plain.covariance).all(|(a, b)| (a - ratio * b).abs() < 1e-12));
        assert!((found.parameters[2].std_error - (9.0 * ratio).sqrt()).abs() < 1e-12);
        // Three trials are enough, two are not.
        assert_ne!(rescale_by_trials(&model, plain.clone(), &left[..3]).covariance, plain.covariance);
        assert_eq!(rescale_by_trials(&model, plain.clone(), &left[..2]), plain);
        // What the data do not determine has no say.
        let open = fit([[4.0, 0.0, 0.0], [0.0, f64::INFINITY, 0.0], [0.0, 0.0, 9.0]]);
        let ratio = (0.75 * 2.0 / 4.0 + 0.75 * 20.0 / 9.0) / 2.0;
        let found = rescale_by_trials(&model, open, &left);
        assert!((found.covariance_scale / ratio - 1.0).abs() < 1e-12 && (found.interval_quantile / t_quantile(6.0) - 1.0).abs() < 1e-12);
        let nothing = fit([[0.0, 0.0, 0.0], [0.0, f64::INFINITY, 0.0], [0.0, 0.0, f64::INFINITY]]);
        assert_eq!(rescale_by_trials(&model, nothing.clone(), &left).covariance_scale, nothing.covariance_scale);
    }
}
