//! Intervals of a model that is wrong: as wide as what it leaves.

use super::result::t_quantile;
use super::{Fit, Parameter};
use crate::ParametricModel;
use serde::{Deserialize, Serialize};
use statrs::distribution::{ChiSquared, ContinuousCDF};

/// Where the width of the intervals comes from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Width {
    /// From the covariance of the estimate.
    #[default]
    Covariance,
    /// From the residuals.
    Residuals,
    /// From the disagreement of the trials.
    Trials,
    /// From one of these and, added to it, from a χ² that is larger than noise makes it.
    Misfit,
}

/// Share of right models whose χ² is taken for a misfit.
const FALSE_ALARM: f64 = 1e-3;

impl Fit {
    /// Whether χ² is larger than its law allows one right model in a thousand.
    pub fn misfits(&self) -> bool {
        ChiSquared::new(self.degrees_of_freedom).is_ok_and(|law| law.sf(self.chi2) < FALSE_ALARM)
    }

    /// The same with the covariance Σ scaled to Σ (c + χ²_ν − 1)/c, where χ² is larger than its law allows; c is what the trials made of it and
    /// χ²_ν the reduced χ².
    ///
    /// A model that lacks something leaves an error that no average takes away. Its size is known, what it does to a parameter is not: as much
    /// as noise of that size would.
    ///
    /// # References
    /// R. T. Birge (1932), The calculation of errors by the method of least squares, Physical Review 40.
    #[must_use]
    pub fn widened_by_misfit(mut self, model: &dyn ParametricModel) -> Fit {
        if !self.misfits() {
            return self;
        }
        let factor = 1.0 + (self.chi2_reduced - 1.0).max(0.0) / self.covariance_scale;
        self.covariance.mapv_inplace(|v| v * factor);
        self.covariance_scale *= factor;
        self.width = Width::Misfit;
        // Of two sources with freedoms of their own, that of the smaller one is the careful choice.
        self.interval_quantile = self.interval_quantile.max(t_quantile(self.degrees_of_freedom));
        self.parameters = Parameter::describe(&model.parameters(), &self.theta, &self.covariance, |_| self.interval_quantile, |k| model.scale(&self.theta, k));
        self
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Axis, InertiaDampingStiffness, InertiaDampingStiffnessModel, Symmetry};
    use ndarray::arr2;

    #[test]
    fn what_is_left_widens_and_chance_does_not() {
        let model = InertiaDampingStiffnessModel::new(vec![Axis::linear("x")], Symmetry::Symmetric);
        let limb = InertiaDampingStiffness { axes: model.axes().to_vec(), inertia: arr2(&[[2.0]]), damping: arr2(&[[12.0]]), stiffness: arr2(&[[300.0]]) };
        let response = limb.response(&[0.5, 1.0, 2.0, 4.0], ndof_sysid::ResponseKind::Compliance);
        let weight = ndarray::Array3::from_elem(response.value.dim(), 1.0);
        let fit = crate::PaperFit::default().fit(&model, &response, &weight, &model.theta(&limb)).expect("a fit");
        let of = |chi2: f64, scale: f64| Fit {
            covariance: ndarray::Array2::eye(3) * scale,
            covariance_scale: scale,
            chi2,
            degrees_of_freedom: 100.0,
            chi2_reduced: chi2 / 100.0,
            ..fit.clone()
        };
        // The 99.9 % quantile of χ² with 100 degrees of freedom is 149.449.
        assert!(!of(149.4, 1.0).misfits() && of(149.5, 1.0).misfits());
        assert_eq!(of(149.0, 1.0).widened_by_misfit(&model), of(149.0, 1.0));
        for (scale, wide) in [(1.0, 4.0), (0.25, 3.25), (5.0, 8.0)] {
            let found = of(400.0, scale).widened_by_misfit(&model);
            assert!((found.covariance[[0, 0]] - wide).abs() < 1e-12 && (found.parameters[0].std_error - f64::sqrt(wide)).abs() < 1e-12);
            assert_eq!((found.width, found.covariance_scale), (Width::Misfit, wide));
        }
    }
}
