//! Which of several models the data prefer.

use super::{Fit, FitError, WeightedFit};
use crate::ParametricModel;
use ndof_sysid::FrequencyResponse;
use serde::{Deserialize, Serialize};
use statrs::distribution::{ChiSquared, ContinuousCDF};

/// Two nested models on the same data.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct LikelihoodRatio {
    /// χ² of the smaller model less that of the larger.
    pub statistic: f64,
    /// Parameters more.
    pub parameters: usize,
    /// Probability of so large a statistic if the smaller model were right.
    pub p_value: f64,
}

/// The likelihood-ratio test: χ²₀ − χ²₁ is χ² distributed with as many degrees of freedom as the larger model has
/// parameters more, if the smaller one is right and lies within the larger one as a pure delay of zero does. Where it is the larger
/// one at a bound, or leaves some of its parameters without effect (a flexible mode without mass, a reflex without gain), the law is
/// another and p is a guide only: compare [`Fit::bic`], or the errors on held-out data.
pub fn likelihood_ratio(smaller: &Fit, larger: &Fit) -> LikelihoodRatio {
    let parameters = larger.theta.len().saturating_sub(smaller.theta.len());
    let statistic = smaller.chi2 - larger.chi2;
    let p_value = ChiSquared::new(parameters as f64).map_or(1.0, |d| 1.0 - d.cdf(statistic.max(0.0)));
    LikelihoodRatio { statistic, parameters, p_value }
}

impl Fit {
    /// Real data behind the fit, correlated bins counted once.
    pub fn data(&self) -> f64 {
        self.degrees_of_freedom + self.theta.len() as f64
    }

    /// Akaike's criterion χ² + 2 k.
    pub fn aic(&self) -> f64 {
        self.chi2 + 2.0 * self.theta.len() as f64
    }

    /// Schwarz's criterion χ² + k ln N; the smaller, the better, and 10 less is strong evidence.
    pub fn bic(&self) -> f64 {
        self.chi2 + self.theta.len() as f64 * self.data().max(1.0).ln()
    }
}

impl WeightedFit {
    /// The best of fits from several starts, in the order given; ties go to the earlier one.
    ///
    /// # Errors
    /// That of the last start if every one fails.
    pub fn fit_from<M: ParametricModel + ?Sized>(&self, model: &M, response: &FrequencyResponse, starts: &[Vec<f64>]) -> Result<Fit, FitError> {
        let mut best: Result<Fit, FitError> = Err(FitError::StartLength { found: 0, expected: model.parameters().len() });
        for start in starts {
            match (self.fit(model, response, start), &best) {
                (Ok(fit), Ok(kept)) if fit.chi2 >= kept.chi2 => {}
                (Err(_), Ok(_)) => {}
                (other, _) => best = other,
            }
        }
        best
    }
}
