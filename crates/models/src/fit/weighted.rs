//! Weighted least squares on a frequency response, with the covariance that its estimator gave it.

use super::whitened::{Known, Whitened, bins};
use super::{COST_TOLERANCE, Fit, FitError, Prediction, Smoothing, Solved, Transducer, Width, check_shape};
use crate::ParametricModel;
use ndarray::Array3;
use ndof_signal::Kernel;
use ndof_sysid::{FrequencyResponse, ResponseKind};
use num_complex::Complex64;
use serde::{Deserialize, Serialize};

/// Settings of the weighted fit.
///
/// Minimises Σ_f s_f ‖√2 Lᴴ (Ĥ(f) − H(f, θ)) G‖² over the band, where (L Lᴴ)⁻¹ is the covariance of the estimate on its
/// output side and (G Gᴴ)⁻¹ on its input side, H is the model seen through the estimate's window, and
/// s_f = bin spacing / independent spacing counts neighbouring bins once. Where references drive inputs that the system's own motion reaches, too, the
/// estimate errs by E = R̂ − H T̂ divided by T̂, and N = \[1, −H\] Σ \[1, −H\]ᴴ is the covariance of E: it goes by the model, not by the estimate, since
/// lines whose estimate happens to be small would seem to be sure otherwise, and inertia, damping and stiffness would come out too large (sample maximum
/// likelihood with noise on both sides). Of a finer grid, four bins an independent one are used: what lies
/// between says nothing more, while thinning to independent bins would lose some.
///
/// The estimated covariance makes χ² larger by ν/(ν − p) and the scatter of θ by ν²/((ν − p)² − 1) (moments of the
/// inverse complex Wishart distribution); both are taken into account. With fewer than p + 4 degrees of freedom only the
/// variances are used, and the covariance of θ allows for what that ignores.
///
/// # References
/// R. Pintelon & J. Schoukens (2012), System identification: a frequency domain approach, ch. 9 and 12.
///
/// ```
/// use ndof_models::{Axis, InertiaDampingStiffnessModel, Symmetry, WeightedFit};
/// let settings = WeightedFit { band_hz: [0.5, 8.0], ..WeightedFit::default() };
/// let model = InertiaDampingStiffnessModel::new(vec![Axis::linear("x")], Symmetry::Symmetric);
/// # let _ = (settings, model);
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct WeightedFit {
    /// Lowest and highest frequency; 0 Hz is never used.
    pub band_hz: [f64; 2],
    /// How the estimate's window enters.
    pub smoothing: Smoothing,
    /// A known series compliance that the estimate contains and the model does not.
    pub transducer: Option<Transducer>,
    /// How the covariance of the parameters is found.
    pub covariance: CovarianceKind,
    /// The relative decrease of χ² at which the search ends.
    pub cost_tolerance: f64,
}

/// How the covariance of the parameters is found.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum CovarianceKind {
    /// From the covariance of the estimate: right if the model is.
    #[default]
    Model,
    /// From the residuals (sandwich): right also where the weights are not.
    Sandwich,
}

impl Default for WeightedFit {
    fn default() -> Self {
        WeightedFit {
            band_hz: [0.5, 8.0],
            smoothing: Smoothing::default(),
            transducer: None,
            covariance: CovarianceKind::default(),
            cost_tolerance: COST_TOLERANCE,
        }
    }
}

/// Degrees of freedom beyond the outputs that a full covariance needs to be worth its noise.
const FULL_COVARIANCE_MARGIN: f64 = 4.0;

impl WeightedFit {
    /// Fits `model` to `response` from `start`.
    ///
    /// The response is compared as the kind that it is; do not invert an estimate before.
    ///
    /// # Errors
    /// [`FitError`] if shape, kind, covariance or band do not serve.
    pub fn fit(&self, model: &dyn ParametricModel, response: &FrequencyResponse, start: &[f64]) -> Result<Fit, FitError> {
        let problem = self.problem(model, response, start)?;
        let [n, inputs] = problem.shape;
        let solved = Solved::new(&problem, model, start, self.cost_tolerance)?;

        let Known { degrees, full, independent } = problem.known;
        let rows = if full { n as f64 } else { 1.0 };
        let inflation = if degrees > rows + 1.0 { degrees * degrees / ((degrees - rows).powi(2) - 1.0) } else { f64::INFINITY };
        let covariance = match self.covariance {
            CovarianceKind::Sandwich => solved.covariance(Some(&problem.neighbour_meat(&solved)), 1.0),
            CovarianceKind::Model if full => solved.covariance(None, inflation),
            CovarianceKind::Model => solved.covariance(Some(&problem.known_meat(&solved.jacobian)), inflation),
        };
        // With as few averages as rows the noise is known from nothing else than what the model is judged by.
        let chi2 = if degrees > rows { 2.0 * solved.minimum.cost * (degrees - rows) / degrees } else { f64::NAN };
        let degrees_of_freedom = 2.0 * independent * (n * inputs) as f64 - problem.parameters as f64;
        let width = if self.covariance == CovarianceKind::Sandwich { Width::Residuals } else { Width::Covariance };
        Ok(Fit { width, ..solved.into_fit(model, covariance, &problem.frequency_hz(), chi2, degrees_of_freedom) })
    }

    /// What is to be minimised.
    pub(super) fn problem<'a>(&'a self, model: &'a dyn ParametricModel, response: &'a FrequencyResponse, start: &[f64]) -> Result<Whitened<'a>, FitError> {
        let shape = check_shape(model, response, start)?;
        let [n, inputs] = shape;
        let parameters = model.parameters().len();
        let uncertainty = response.uncertainty.as_ref().ok_or(FitError::NoCovariance)?;
        let degrees = uncertainty.degrees_of_freedom;
        let full = degrees >= n as f64 + FULL_COVARIANCE_MARGIN;
        let bins = bins(self.band_hz, response, uncertainty, full);
        // No bins are worth 0, where a sum of none is −0.
        let independent = bins.iter().fold(0.0, |sum, b| sum + b.share);
        if bins.is_empty() || 2.0 * independent * (n * inputs) as f64 <= parameters as f64 {
            let needed = parameters / (2 * n * inputs) + 1;
            return Err(FitError::TooFewBins { bins: bins.len(), independent, needed, low_hz: self.band_hz[0], high_hz: self.band_hz[1] });
        }
        let frequency_hz: Vec<f64> = bins.iter().map(|b| b.hz).collect();
        let prediction = Prediction::new(model, response.kind, &frequency_hz, &uncertainty.kernel, &self.smoothing, self.transducer);
        Ok(Whitened { prediction, bins, gains: model.gains(), shape, parameters, known: Known { degrees, full, independent } })
    }

    /// The model as an estimate of this kind would show it on average: through the window's `kernel`, in the loop that
    /// `smoothing` describes, with the transducer's give; `H[f][row][column]`, NaN where the model does not exist.
    ///
    /// ```
    /// use ndof_models::{Axis, InertiaDampingStiffnessModel, Smoothing, Symmetry, WeightedFit};
    /// use ndof_signal::Kernel;
    /// use ndof_sysid::ResponseKind;
    ///
    /// let model = InertiaDampingStiffnessModel::new(vec![Axis::linear("x")], Symmetry::Symmetric);
    /// let settings = WeightedFit { smoothing: Smoothing::None, ..WeightedFit::default() };
    /// let seen = settings.seen(&model, &[2.0, 11.0, 300.0], ResponseKind::Compliance, &[0.0], &Kernel::default());
    /// assert!((seen[[0, 0, 0]].re - 1.0 / 300.0).abs() < 1e-15);
    /// ```
    pub fn seen(&self, model: &dyn ParametricModel, theta: &[f64], kind: ResponseKind, frequency_hz: &[f64], kernel: &Kernel) -> Array3<Complex64> {
        let n = model.axes().len();
        let (values, _) = Prediction::new(model, kind, frequency_hz, kernel, &self.smoothing, self.transducer).evaluate(theta, false);
        Array3::from_shape_fn((frequency_hz.len(), n, n), |(f, i, j)| values[(f * n + i) * n + j])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shared_tests::{add_noise, arm, difference};
    use crate::{InertiaDampingStiffnessModel, LeastSquares, Symmetry};
    use num_complex::Complex64;

    /// Jᵀ r is the slope of ½ ‖r‖² where the weights follow the model, although J is not ∂r/∂θ.
    #[test]
    fn where_weights_follow_the_model_the_slope_of_the_cost_is_right() {
        let mut response = arm().response(&[1.0, 2.0, 3.5, 5.0, 7.0], ResponseKind::Compliance);
        add_noise(&mut response, 20.0, |_| 0.2);
        let number = |k: usize| Complex64::new((1.3 * k as f64).sin(), (0.7 * k as f64).cos());
        let size = |i: usize| if i < 2 { 1e-3 } else { 0.5 };
        let half = Array3::from_shape_fn((5, 4, 4), |(f, i, j)| number(16 * f + 4 * i + j) * size(i));
        let product = |f: usize, i: usize, j: usize| (0..4).map(|l| half[[f, i, l]] * half[[f, j, l]].conj()).sum::<Complex64>();
        response.uncertainty.as_mut().expect("errors").unexplained = Some(Array3::from_shape_fn((5, 4, 4), |(f, i, j)| product(f, i, j)));
        let model = InertiaDampingStiffnessModel::new(arm().axes, Symmetry::Free);
        let theta: Vec<f64> = model.theta(&arm()).iter().enumerate().map(|(k, v)| v * (1.0 + 0.2 * (k as f64).sin())).collect();
        let settings = WeightedFit { smoothing: Smoothing::None, ..WeightedFit::default() };
        let mut problem = settings.problem(&model, &response, &theta).expect("a problem");
        problem.weigh(&[1.0, 0.5, 2.0, 1.0, 0.1]);
        let cost = |theta: &[f64]| vec![0.5 * problem.residuals(theta).iter().map(|r| r * r).sum::<f64>()];
        let (jacobian, residuals) = (problem.jacobian(&theta), problem.residuals(&theta));
        for k in 0..theta.len() {
            let slope: f64 = (0..residuals.len()).map(|i| jacobian[(i, k)] * residuals[i]).sum();
            let expected = difference(&theta, k, 1e-5 * theta[k].abs(), cost)[0];
            // Second differences of a cost whose slopes change by their own size over a fifth of a parameter.
            assert!((slope - expected).abs() < 1e-6 * (expected.abs() + cost(&theta)[0] / theta[k].abs()), "{k}: {slope} {expected}");
        }
    }
}
