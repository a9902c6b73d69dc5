//! What the residuals of a fit say of a compliance in series that nobody has told it.

use super::{Fit, FitError, Transducer, WeightedFit};
use crate::{LeastSquares, ParametricModel};
use faer::Mat;
use ndof_sysid::FrequencyResponse;
use num_complex::Complex64;
use std::f64::consts::TAU;

/// A compliance in series with every axis, C + c, to first order from a fit without it.
#[derive(Clone, Debug, PartialEq)]
pub struct SeriesCompliance {
    /// c (m/N; rad/(N m)).
    pub compliance: f64,
    /// By how much χ² falls with it.
    pub chi2_less: f64,
    /// The parameters beside it.
    pub theta: Vec<f64>,
}

/// A change of compliance, as a share of the model's, over which a response is a straight line.
const SMALL: f64 = 1e-6;
/// Share of its derivative beside those of the parameters, below which it is one of them.
const OWN: f64 = 1e-6;

impl WeightedFit {
    /// Rao's score for a compliance in series with every axis: a force transducer's mount, a handle, a frame. To the force over a wide band it looks as if
    /// inertia and stiffness were larger, by M ω²/k, and the fit stays a good one.
    ///
    /// With J the derivatives by θ, g that by c and r the residuals, all whitened, one step of Gauss and Newton in θ and c together gives c and θ, and
    /// χ² falls by what of r lies along the part of g that is orthogonal to J. `None` where a transducer is known already, where the model has such a
    /// compliance itself, and where the residuals ask for one below zero.
    ///
    /// # Errors
    /// As [`WeightedFit::fit`].
    ///
    /// # References
    /// C. R. Rao (1948), Large sample tests of statistical hypotheses concerning several parameters, Proc. Cambridge Phil. Soc. 44, 50-57.
    pub fn series_compliance(&self, model: &dyn ParametricModel, response: &FrequencyResponse, fit: &Fit) -> Result<Option<SeriesCompliance>, FitError> {
        if self.transducer.is_some() {
            return Ok(None);
        }
        let (n, k) = (model.axes().len(), fit.theta.len());
        let mut stiffness = vec![Complex64::default(); n * n];
        model.stiffness(&fit.theta, Complex64::new(0.0, TAU * 0.5 * (fit.band_hz[0] + fit.band_hz[1])), &mut stiffness, None);
        let step = SMALL / stiffness.iter().map(|d| d.norm()).fold(0.0, f64::max);
        let moved = WeightedFit { transducer: Some(Transducer { stiffness: 1.0 / step, damping: 0.0 }), ..self.clone() };
        let problem = self.problem(model, response, &fit.theta)?;
        let residuals = problem.residuals(&fit.theta);
        let giving: Vec<f64> = moved.problem(model, response, &fit.theta)?.residuals(&fit.theta).iter().zip(&residuals).map(|(m, r)| (m - r) / step).collect();
        let jacobian = problem.jacobian(&fit.theta);
        let all = Mat::from_fn(residuals.len(), k + 2, |i, j| {
            if j < k {
                jacobian[(i, j)]
            } else if j == k {
                giving[i]
            } else {
                residuals[i]
            }
        });
        // What of χ² an estimated covariance makes is in the fit's, and not in the residuals.
        let scale = fit.chi2 / residuals.iter().map(|r| r * r).sum::<f64>();
        let triangle = all.qr().thin_R().to_owned();
        let (own, along) = (triangle[(k, k)], triangle[(k, k + 1)]);
        let compliance = -along / own;
        if !(own.abs() > OWN * giving.iter().map(|g| g * g).sum::<f64>().sqrt() && compliance > 0.0) {
            return Ok(None);
        }
        // What the parameters give up for it: R δ = -c R g, from the last row upwards.
        let mut theta = vec![0.0; k];
        for i in (0..k).rev() {
            let known: f64 = (i + 1..k).map(|j| triangle[(i, j)] * theta[j]).sum();
            theta[i] = (-compliance * triangle[(i, k)] - known) / triangle[(i, i)];
        }
        theta.iter_mut().zip(&fit.theta).for_each(|(shift, before)| *shift += before);
        Ok(Some(SeriesCompliance { compliance, chi2_less: scale * along * along, theta }).filter(|found| found.theta.iter().all(|v| v.is_finite())))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shared_tests::{add_noise, arm};
    use crate::{InertiaDampingStiffnessModel, Symmetry};
    use ndof_sysid::ResponseKind;

    /// An arm on a mount of 1e6 N/m, known to 0.1 %.
    fn mounted(stiffness: f64, kind: ResponseKind) -> (InertiaDampingStiffnessModel, Vec<f64>, FrequencyResponse) {
        let arm = arm();
        let model = InertiaDampingStiffnessModel::new(arm.axes.clone(), Symmetry::Symmetric);
        let hz: Vec<f64> = (1..=200).map(|k| 0.06 * k as f64).collect();
        let mut response = arm.response(&hz, ResponseKind::Compliance);
        for f in 0..hz.len() {
            (0..2).for_each(|i| response.value[[f, i, i]] += 1.0 / stiffness);
        }
        let mut response = response.to_kind(kind).expect("regular");
        add_noise(&mut response, 30.0, |_| 1e-3);
        let theta = model.theta(&arm);
        (model, theta, response)
    }

    #[test]
    fn a_mount_is_found_with_the_parameters_beside_it() {
        for kind in [ResponseKind::Compliance, ResponseKind::DynamicStiffness] {
            let (model, truth, response) = mounted(1e6, kind);
            let settings = WeightedFit { band_hz: [0.05, 12.5], ..WeightedFit::default() };
            let fit = settings.fit(&model, &response, &truth).expect("a fit");
            let found = settings.series_compliance(&model, &response, &fit).expect("whitened").expect("a compliance");
            assert!((found.compliance * 1e6 - 1.0).abs() < 0.02, "{found:?}");
            let off = |theta: &[f64]| theta.iter().zip(&truth).map(|(t, truth)| (t / truth - 1.0).abs()).fold(0.0, f64::max);
            assert!(off(&fit.theta) > 2e-3 && off(&found.theta) < 0.05 * off(&fit.theta), "{} {}", off(&fit.theta), off(&found.theta));
            // What a fit that knows the mount gains.
            let told = WeightedFit { transducer: Some(Transducer { stiffness: 1e6, damping: 0.0 }), ..settings.clone() };
            let known = told.fit(&model, &response, &truth).expect("a fit");
            assert!(((fit.chi2 - known.chi2) / found.chi2_less - 1.0).abs() < 0.02, "{} {} {}", fit.chi2, known.chi2, found.chi2_less);
            assert_eq!(told.series_compliance(&model, &response, &known), Ok(None));
        }
    }

    #[test]
    fn a_mount_that_does_not_give_is_not_found() {
        let (model, truth, response) = mounted(f64::INFINITY, ResponseKind::Compliance);
        let settings = WeightedFit { band_hz: [0.05, 12.5], ..WeightedFit::default() };
        let fit = settings.fit(&model, &response, &truth).expect("a fit");
        let found = settings.series_compliance(&model, &response, &fit).expect("whitened");
        assert!(found.is_none_or(|found| found.chi2_less < 1e-6));
    }
}
