//! Which of several models the data prefer.

use super::{Fit, FitError, WeightedFit};
use crate::ParametricModel;
use crate::blocks::{Block, Vanishing};
use ndof_sysid::FrequencyResponse;
use serde::{Deserialize, Serialize};
use statrs::distribution::{ChiSquared, ContinuousCDF};

/// What χ²₀ − χ²₁ is distributed as where the smaller model is right.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum NullLaw {
    /// χ² with as many degrees of freedom as there are parameters more: the smaller model lies within the larger one.
    #[default]
    ChiSquared,
    /// ½ χ²(k − 1) + ½ χ²(k): the smaller model is the larger one with one of k parameters at a bound; noise that asks for a value beyond it is
    /// half of all noise.
    HalfAtBound,
    /// None that is known: some of the parameters have no effect in the smaller model. p is that of χ²(k) and a guide only.
    Unknown,
}

/// Two nested models on the same data.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct LikelihoodRatio {
    /// χ² of the smaller model less that of the larger.
    pub statistic: f64,
    /// Parameters more.
    pub parameters: usize,
    /// Probability of so large a statistic if the smaller model were right.
    pub p_value: f64,
    /// The law by which that was found.
    pub law: NullLaw,
}

/// The likelihood-ratio test where the smaller model lies within the larger one, as a delay of nothing does; else see
/// [`LikelihoodRatio::under`].
pub fn likelihood_ratio(smaller: &Fit, larger: &Fit) -> LikelihoodRatio {
    let parameters = larger.theta.len().saturating_sub(smaller.theta.len());
    let statistic = smaller.chi2 - larger.chi2;
    LikelihoodRatio { statistic, parameters, p_value: f64::NAN, law: NullLaw::ChiSquared }.under(NullLaw::ChiSquared)
}

impl NullLaw {
    /// What a result file calls it.
    pub fn name(self) -> &'static str {
        match self {
            NullLaw::ChiSquared => "chi-squared",
            NullLaw::HalfAtBound => "half-at-bound",
            NullLaw::Unknown => "unknown",
        }
    }

    /// The law of a ratio between two models of which the larger has these blocks more. Two blocks that are at the bound together, or one there
    /// beside another, are not of the known kind: filters and delays that vanish have the same slope.
    pub fn of(added: &[&dyn Block]) -> NullLaw {
        match added {
            [] => NullLaw::ChiSquared,
            [only] => match only.vanishes() {
                Vanishing::Inside => NullLaw::ChiSquared,
                Vanishing::AtBound => NullLaw::HalfAtBound,
                Vanishing::WithoutEffect => NullLaw::Unknown,
            },
            more if more.iter().all(|b| b.vanishes() == Vanishing::Inside) => NullLaw::ChiSquared,
            _ => NullLaw::Unknown,
        }
    }
}

impl LikelihoodRatio {
    /// The same with the probability under another law.
    ///
    /// # References
    /// S. G. Self & K.-Y. Liang (1987), Asymptotic properties of maximum likelihood estimators and likelihood ratio tests under nonstandard
    /// conditions, cases 5 and 6. For parameters without effect R. B. Davies (1987), Hypothesis testing when a nuisance parameter is present only under
    /// the alternative: compare [`Fit::bic`], or the errors on held-out data.
    pub fn under(self, law: NullLaw) -> LikelihoodRatio {
        // χ² of no degrees of freedom is nothing but zero.
        let beyond = |degrees: usize| ChiSquared::new(degrees as f64).map_or(0.0, |d| d.sf(self.statistic));
        let p_value = match law {
            // Not a number either way of comparing.
            _ if self.statistic.is_nan() => f64::NAN,
            _ if self.statistic <= 0.0 || self.parameters == 0 => 1.0,
            NullLaw::HalfAtBound => 0.5 * (beyond(self.parameters - 1) + beyond(self.parameters)),
            NullLaw::ChiSquared | NullLaw::Unknown => beyond(self.parameters),
        };
        LikelihoodRatio { p_value, law, ..self }
    }
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
    pub fn fit_from(&self, model: &dyn ParametricModel, response: &FrequencyResponse, starts: &[Vec<f64>]) -> Result<Fit, FitError> {
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::blocks::{Delay, FirstOrderFilter, Reflex};
    use crate::shared_tests::fitted_limb;

    #[test]
    fn several_blocks_have_a_known_law_only_where_each_vanishes_inside() {
        assert_eq!(NullLaw::of(&[]), NullLaw::ChiSquared);
        assert_eq!(NullLaw::of(&[&Delay]), NullLaw::ChiSquared);
        assert_eq!(NullLaw::of(&[&FirstOrderFilter]), NullLaw::HalfAtBound);
        assert_eq!(NullLaw::of(&[&Reflex]), NullLaw::Unknown);
        assert_eq!(NullLaw::of(&[&Delay, &Delay]), NullLaw::ChiSquared);
        assert_eq!(NullLaw::of(&[&Delay, &FirstOrderFilter]), NullLaw::Unknown);
        assert_eq!(NullLaw::of(&[&FirstOrderFilter, &FirstOrderFilter]), NullLaw::Unknown);
        assert_eq!([NullLaw::ChiSquared, NullLaw::HalfAtBound, NullLaw::Unknown].map(NullLaw::name), ["chi-squared", "half-at-bound", "unknown"]);
    }

    #[test]
    fn probabilities_are_those_of_their_laws() {
        let p = |statistic: f64, parameters: usize, law: NullLaw| {
            let found = LikelihoodRatio { statistic, parameters, p_value: f64::NAN, law: NullLaw::ChiSquared }.under(law);
            assert_eq!(found.law, law);
            found.p_value
        };
        // χ²(2) has the tail e^(−x/2); χ²(1) that of a normal at both ends; χ²(3) has √(2x/π) e^(−x/2) more.
        let (one, two) = (0.05, (-0.5f64 * 3.841_458_820_694_124).exp());
        let three = one + (2.0 * 3.841_458_820_694_124 / std::f64::consts::PI).sqrt() * two;
        let x = 3.841_458_820_694_124;
        for (parameters, law, want) in [
            (1, NullLaw::ChiSquared, one),
            (2, NullLaw::Unknown, two),
            (1, NullLaw::HalfAtBound, 0.5 * one),
            (2, NullLaw::HalfAtBound, 0.5 * (one + two)),
            (3, NullLaw::HalfAtBound, 0.5 * (two + three)),
            (0, NullLaw::ChiSquared, 1.0),
        ] {
            assert!((p(x, parameters, law) - want).abs() < 1e-9, "{parameters} {law:?}");
        }
        assert_eq!(p(-1.0, 2, NullLaw::ChiSquared), 1.0);
        assert_eq!(p(0.0, 2, NullLaw::HalfAtBound), 1.0);
        assert!(p(f64::NAN, 2, NullLaw::ChiSquared).is_nan());
    }

    #[test]
    fn criteria_add_to_chi_squared_what_they_say() {
        let (.., mut fit) = fitted_limb();
        (fit.chi2, fit.degrees_of_freedom) = (50.0, 17.0);
        assert_eq!((fit.data(), fit.aic()), (20.0, 56.0));
        assert!((fit.bic() - 50.0 - 3.0 * 20f64.ln()).abs() < 1e-12);
        let first = fit.marginal(2);
        assert_eq!((first.theta.len(), first.parameters.len(), first.covariance.dim(), first.chi2), (2, 2, (2, 2), 50.0));
        assert_eq!((&first.theta[..], first.covariance[[1, 0]]), (&fit.theta[..2], fit.covariance[[1, 0]]));
    }
}
