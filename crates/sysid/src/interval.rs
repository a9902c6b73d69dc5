//! Standard errors, confidence intervals and regions of a response.

use crate::response::FrequencyResponse;
use ndarray::Array2;
use num_complex::Complex64;
use serde::{Deserialize, Serialize};
use statrs::distribution::{ContinuousCDF, FisherSnedecor, StudentsT};

/// Gain and phase of one entry of a response with separate confidence intervals.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct GainPhase {
    /// |H|, in the response's unit.
    pub gain: f64,
    /// arg H, −π to π.
    pub phase_rad: f64,
    /// σ = √(E|δH|²/2).
    pub gain_std_error: f64,
    /// σ/|H|.
    pub phase_std_error_rad: f64,
    /// max(0, |H| − tσ) and |H| + tσ.
    pub gain_interval: [f64; 2],
    /// arg H ± asin(tσ/|H|); `None` is the full circle.
    pub phase_interval_rad: Option<[f64; 2]>,
}

/// Quantiles for one level of confidence and one number of degrees of freedom; made once, used at each frequency.
///
/// Intervals use Student's t with 2ν degrees of freedom, regions Fisher's F with 2 and 2ν, ν those of the noise
/// estimate ([`Uncertainty::degrees_of_freedom`](crate::Uncertainty)).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Confidence {
    level: f64,
    degrees_of_freedom: f64,
    t: f64,
    f: f64,
}

impl Confidence {
    /// Quantiles for `level` (0.95) and ν complex degrees of freedom; NaN outside of 0 < level < 1 or ν > 0.
    pub fn new(level: f64, degrees_of_freedom: f64) -> Self {
        let valid = level > 0.0 && level < 1.0 && degrees_of_freedom > 0.0;
        let quantile = |make: &dyn Fn() -> Option<f64>| if valid { make().unwrap_or(f64::NAN) } else { f64::NAN };
        Confidence {
            level,
            degrees_of_freedom,
            t: quantile(&|| StudentsT::new(0.0, 1.0, 2.0 * degrees_of_freedom).ok().map(|t| t.inverse_cdf(0.5 + level / 2.0))),
            f: quantile(&|| FisherSnedecor::new(2.0, 2.0 * degrees_of_freedom).ok().map(|f| f.inverse_cdf(level))),
        }
    }

    /// Gain, phase and their intervals for a value with complex variance E|δH|².
    ///
    /// ```
    /// use ndof_sysid::Confidence;
    /// use num_complex::Complex64;
    /// let entry = Confidence::new(0.95, 20.0).gain_phase(Complex64::new(0.0, 2.0), 0.02);
    /// assert!((entry.gain_std_error - 0.1).abs() < 1e-15);
    /// assert!((entry.gain_interval[1] - (2.0 + 2.0211 * 0.1)).abs() < 1e-5);
    /// ```
    pub fn gain_phase(&self, value: Complex64, variance: f64) -> GainPhase {
        let (gain, phase_rad, sigma) = (value.norm(), value.arg(), (variance / 2.0).sqrt());
        let half = self.t * sigma;
        GainPhase {
            gain,
            phase_rad,
            gain_std_error: sigma,
            phase_std_error_rad: sigma / gain,
            gain_interval: [if half.is_nan() { f64::NAN } else { (gain - half).max(0.0) }, gain + half],
            phase_interval_rad: (half < gain).then(|| [phase_rad - (half / gain).asin(), phase_rad + (half / gain).asin()]),
        }
    }

    /// Radius of the disc in the complex plane that holds the true entry: √(F(2, 2ν) E|δH|²).
    pub fn radius(&self, variance: f64) -> f64 {
        (self.f * variance).sqrt()
    }

    /// Size of the region that holds a whole row of q entries at once: the row δ is inside where
    /// δ P⁻¹ δᴴ ≤ q F(2q, 2ν) · noise, P the input inverse of the covariance.
    pub fn simultaneous(&self, inputs: usize) -> f64 {
        let q = inputs as f64;
        FisherSnedecor::new(2.0 * q, 2.0 * self.degrees_of_freedom).map_or(f64::NAN, |f| q * f.inverse_cdf(self.level))
    }
}

impl FrequencyResponse {
    /// Gain, phase and intervals of one entry at every frequency; intervals are NaN without a covariance.
    pub fn gain_phase(&self, output: usize, input: usize, level: f64) -> Vec<GainPhase> {
        let confidence = Confidence::new(level, self.uncertainty.as_ref().map_or(f64::NAN, |u| u.degrees_of_freedom));
        (0..self.len()).map(|f| confidence.gain_phase(self.value[[f, output, input]], self.variance(f, output, input))).collect()
    }

    /// Whether `candidate` row of `output` at frequency index `f` lies in the region that holds the whole true row with
    /// this confidence. `None` where there is no covariance.
    pub fn row_is_inside(&self, f: usize, output: usize, candidate: &[Complex64], level: f64) -> Option<bool> {
        let own = self.uncertainty.as_ref()?;
        let q = self.inputs.len();
        let inverse = Array2::from_shape_fn((q, q), |(i, j)| own.input_inverse[[f, i, j]]);
        let input = crate::matrix::inverse(&inverse)?;
        let delta = |j: usize| candidate[j] - self.value[[f, output, j]];
        let distance: Complex64 = (0..q).flat_map(|i| (0..q).map(move |j| (i, j))).map(|(i, j)| delta(i) * input[[i, j]] * delta(j).conj()).sum();
        let bound = Confidence::new(level, own.degrees_of_freedom).simultaneous(q) * own.noise[[f, output, output]].re;
        Some(distance.re <= bound)
    }
}

/// The paper's normalised random error of gain (and of phase in rad) for two inputs,
/// {(1 − γ²) / (2 (N − 1) γ²)}^½ with the partial coherence γ² and the number of segments N.
///
/// It takes overlapping segments for independent ones, so its error bars are too small (by 1.39 in the paper's second
/// setting); for comparison with the paper only.
///
/// Palazzolo et al., IEEE TNSRE 15(1), 2007.
pub fn paper_random_error(partial_coherence: f64, segments: usize) -> f64 {
    ((1.0 - partial_coherence) / (2.0 * (segments as f64 - 1.0) * partial_coherence)).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// SciPy 1.17: stats.t.ppf(0.975, 2*22), stats.f.ppf(0.95, 2, 44), 2*stats.f.ppf(0.95, 4, 44).
    #[test]
    fn quantiles_equal_those_of_scipy() {
        let c = Confidence::new(0.95, 22.0);
        let entry = c.gain_phase(Complex64::new(1.0, 0.0), 2.0 * 0.01);
        assert!((entry.gain_interval[1] - 1.0 - 0.1 * 2.015_367_574_443_76).abs() < 1e-10);
        assert!((c.radius(1.0) - 3.209_278_020_049_201_f64.sqrt()).abs() < 1e-10);
        assert!((c.simultaneous(2) - 2.0 * 2.583_667_426_803_002).abs() < 1e-10);
    }

    #[test]
    fn a_gain_within_its_error_has_no_phase() {
        let entry = Confidence::new(0.95, 10.0).gain_phase(Complex64::new(0.1, 0.0), 1.0);
        assert_eq!(entry.phase_interval_rad, None);
        assert_eq!(entry.gain_interval[0], 0.0);
    }

    #[test]
    fn what_does_not_exist_is_nan_and_not_zero() {
        let entry = Confidence::new(0.95, 10.0).gain_phase(Complex64::new(f64::NAN, f64::NAN), f64::NAN);
        assert!(entry.gain.is_nan() && entry.gain_interval[0].is_nan() && entry.phase_interval_rad.is_none());
        assert!(Confidence::new(0.95, 0.0).radius(1.0).is_nan());
    }
}
