//! Standard errors, confidence intervals and regions of a response.

use crate::quantile::{fisher, two_sided_t};
use crate::response::{FrequencyResponse, places};
use num_complex::Complex64;
use serde::{Deserialize, Serialize};

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
    /// max(0, |H| − tσ) and |H| + tσ; of an inverted response [`Confidence::gain_phase_of_inverse`], the upper end infinite
    /// where what was inverted may be singular.
    pub gain_interval: [f64; 2],
    /// arg H ± asin(tσ/|H|), or of an inverted response [`Confidence::gain_phase_of_inverse`]; `None` is the full circle. May
    /// reach beyond ± π.
    pub phase_interval_rad: Option<[f64; 2]>,
}

/// Quantiles for one level of confidence and one number of degrees of freedom; made once, used at each frequency.
///
/// Intervals use Student's t with 2ν degrees of freedom, regions Fisher's F with 2 and 2ν, ν those of the noise
/// estimate ([`Uncertainty::degrees_of_freedom`](crate::Uncertainty)).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Confidence {
    t: f64,
    f: f64,
}

impl Confidence {
    /// Quantiles for `level` (0.95) and ν complex degrees of freedom; NaN outside of 0 < level < 1 or ν > 0.
    pub fn new(level: f64, degrees_of_freedom: f64) -> Self {
        Confidence { t: two_sided_t(level, 2.0 * degrees_of_freedom), f: fisher(level, 1, degrees_of_freedom) }
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

    /// The same for an entry X_ij of an inverse X = B⁻¹, whose errors are lopsided.
    ///
    /// Along the direction in which B moves X_ij most for its covariance, a step of tσ times any s with |s| ≤ 1 takes X_ij to
    ///
    /// X_ij (1 + ρs/(1 − ρκs)), ρ = tσ/|X_ij|, κ = X_ij \[P B N\]_ji / (N_ii P_jj),
    ///
    /// N and P the output and input side of the covariance of X. The ends of the gain are those at s = −1 and s = 1 along that
    /// direction, or at s = 0 where that lies beyond them. The image of all complex s is the disc around X_ij (1 + ρ²κ*/(1 − ρ²|κ|²)) with the radius |X_ij| ρ/(1 − ρ²|κ|²), and the phase lies in the
    /// angle that this disc subtends; for a complex κ the disc reaches beyond the gain's ends, which are those that hold 95 % of
    /// simulated truths (the book, Spectral estimates). For one input and one output κ = 1, and both are those of B, inverted (Fieller 1954).
    /// Where ρ|κ| ≥ 1, B may be singular: the gain has no upper end, the phase is any. `bend` is κ; 0 gives
    /// [`gain_phase`](Self::gain_phase).
    pub fn gain_phase_of_inverse(&self, value: Complex64, variance: f64, bend: Complex64) -> GainPhase {
        let straight = self.gain_phase(value, variance);
        let share = self.t * straight.phase_std_error_rad;
        let low = 1.0 - share / (1.0 + bend * share);
        let high = 1.0 + share / (1.0 - bend * share);
        let regular = 1.0 - (share * bend.norm()).powi(2);
        let gain_interval = [
            if low.is_nan() {
                f64::NAN
            } else if low.re > 0.0 {
                straight.gain * low.norm().min(1.0)
            } else {
                0.0
            },
            if regular <= 0.0 { f64::INFINITY } else { straight.gain * high.norm() },
        ];
        let centre = 1.0 + bend.conj() * share * share / regular;
        let sine = share / regular / centre.norm();
        let (middle, half) = (straight.phase_rad + centre.arg(), sine.asin());
        let phase_interval_rad = (regular > 0.0 && sine < 1.0).then_some([middle - half, middle + half]);
        GainPhase { gain_interval, phase_interval_rad, ..straight }
    }

    /// Radius of the disc in the complex plane that holds the true entry: √(F(2, 2ν) E|δH|²).
    pub fn radius(&self, variance: f64) -> f64 {
        (self.f * variance).sqrt()
    }
}

impl FrequencyResponse {
    /// Gain, phase and intervals of one entry at every frequency; intervals are NaN without a covariance.
    pub fn gain_phase(&self, output: usize, input: usize, level: f64) -> Vec<GainPhase> {
        let confidence = Confidence::new(level, self.uncertainty.as_ref().map_or(f64::NAN, |u| u.degrees_of_freedom));
        (0..self.len())
            .map(|f| confidence.gain_phase_of_inverse(self.value[[f, output, input]], self.variance(f, output, input), self.bend(f, output, input)))
            .collect()
    }

    /// κ of [`Confidence::gain_phase_of_inverse`]; 0 for a response that was estimated as it stands.
    fn bend(&self, f: usize, i: usize, j: usize) -> Complex64 {
        let straight = Complex64::default();
        let (n, columns) = self.shape();
        let Some(u) = self.uncertainty.as_ref().filter(|u| u.inverted && n == columns) else { return straight };
        let Some(estimated) = ndof_linear::inverse(&self.at(f)) else { return straight };
        let inner: Complex64 = places(n, n).map(|(a, b)| u.input_inverse[[f, j, a]] * estimated[[a, b]] * u.noise[[f, b, i]]).sum();
        let bend = self.value[[f, i, j]] * inner / (u.noise[[f, i, i]].re * u.input_inverse[[f, j, j]].re);
        if bend.is_finite() { bend } else { straight }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndarray::Array2;

    /// SciPy 1.17: stats.t.ppf(0.975, 2*22), stats.f.ppf(0.95, 2, 44).
    #[test]
    fn quantiles_equal_those_of_scipy() {
        let c = Confidence::new(0.95, 22.0);
        let entry = c.gain_phase(Complex64::new(1.0, 0.0), 2.0 * 0.01);
        assert!((entry.gain_interval[1] - 1.0 - 0.1 * 2.015_367_574_443_76).abs() < 1e-10);
        assert!((c.radius(1.0) - 3.209_278_020_049_201_f64.sqrt()).abs() < 1e-10);
    }

    #[test]
    fn the_interval_of_an_inverse_is_the_inverse_of_the_interval() {
        let estimated = FrequencyResponse {
            frequency_hz: vec![1.0, 2.0],
            inputs: vec!["u".into()],
            outputs: vec!["y".into()],
            kind: crate::ResponseKind::Transfer,
            value: ndarray::arr3(&[[[Complex64::new(0.3, 0.4)]], [[Complex64::new(0.01, 0.0)]]]),
            uncertainty: Some(crate::Uncertainty {
                noise: ndarray::Array3::from_elem((2, 1, 1), Complex64::from(0.02)),
                input_inverse: ndarray::Array3::from_elem((2, 1, 1), Complex64::from(0.5)),
                degrees_of_freedom: 9.0,
                independent_spacing_hz: 0.1,
                unexplained: None,
                kernel: ndof_signal::Kernel::default(),
                inverted: false,
            }),
        };
        let inverse = estimated.inverse().expect("square");
        let ([low, high], [inverse_low, inverse_high]) = (estimated.gain_phase(0, 0, 0.95)[0].gain_interval, inverse.gain_phase(0, 0, 0.95)[0].gain_interval);
        assert!(low > 0.0 && (inverse_low * high - 1.0).abs() < 1e-13 && (inverse_high * low - 1.0).abs() < 1e-13);
        assert_eq!(inverse.gain_phase(0, 0, 0.95)[1].gain_interval[1], f64::INFINITY, "what was estimated may be zero");
        let ([early, late], turned) =
            (estimated.gain_phase(0, 0, 0.95)[0].phase_interval_rad.expect("known"), inverse.gain_phase(0, 0, 0.95)[0].phase_interval_rad.expect("known"));
        assert!((turned[0] + late).abs() < 1e-13 && (turned[1] + early).abs() < 1e-13, "the phase of an inverse is that of what it inverts, turned back");
        assert_eq!(inverse.gain_phase(0, 0, 0.95)[1].phase_interval_rad, None);
        let back = inverse.inverse().expect("square");
        assert!((back.gain_phase(0, 0, 0.95)[0].gain_interval[1] / high - 1.0).abs() < 1e-13);
    }

    /// X = B⁻¹ of two by two: every X_ij that a step along the steepest direction of B reaches has its phase in the interval, and
    /// some reach its ends.
    #[test]
    fn the_phase_of_an_inverse_is_the_angle_of_what_b_can_be() {
        let c = |re: f64, im: f64| Complex64::new(re, im);
        let b = ndarray::arr2(&[[c(2.0, 0.3), c(-0.4, 0.9)], [c(-0.5, 0.6), c(1.5, -0.7)]]);
        let noise = ndarray::arr2(&[[c(0.09, 0.0), c(0.02, 0.03)], [c(0.02, -0.03), c(0.05, 0.0)]]);
        let input = ndarray::arr2(&[[c(1.0, 0.0), c(0.2, 0.4)], [c(0.2, -0.4), c(0.7, 0.0)]]);
        let hermitian = |a: &Array2<Complex64>| a.t().mapv(|v| v.conj());
        let x = ndof_linear::inverse(&b).expect("regular");
        let (of_noise, of_input) = (x.dot(&noise).dot(&hermitian(&x)), hermitian(&x).dot(&input).dot(&x));
        let (i, j) = (0, 1);
        let variance = of_noise[[i, i]].re * of_input[[j, j]].re;
        let bend = x[[i, j]] * of_input.dot(&b).dot(&of_noise)[[j, i]] / variance;
        let confidence = Confidence::new(0.95, 12.0);
        let interval = confidence.gain_phase_of_inverse(x[[i, j]], variance, bend).phase_interval_rad.expect("known");
        // The step of B is N x_i^H x_j^H P over the root of the variance.
        let column = noise.dot(&x.row(i).mapv(|v| v.conj()));
        let row = x.column(j).mapv(|v| v.conj()).dot(&input);
        let step = Array2::from_shape_fn((2, 2), |(k, l)| column[k] * row[l] * (-confidence.t / (2.0 * variance).sqrt()));
        let turned: Vec<f64> = (0..3600)
            .map(|k| ndof_linear::inverse(&(&b + &step.mapv(|v| v * Complex64::from_polar(1.0, f64::from(k) * 1.745_329_251_994_33e-3)))))
            .map(|moved| (moved.expect("regular")[[i, j]] / x[[i, j]]).arg() + x[[i, j]].arg())
            .collect();
        let (low, high) = turned.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), &v| (low.min(v), high.max(v)));
        // 3600 steps miss the ends of a circle by less than (π/3600)²/2 of its radius.
        assert!((low - interval[0]).abs() < 1e-6 && (high - interval[1]).abs() < 1e-6, "{low} {high} {interval:?}");
    }

    #[test]
    fn a_phase_interval_is_the_angle_that_the_disc_of_the_gain_subtends() {
        let entry = Confidence::new(0.95, 10.0).gain_phase(Complex64::from_polar(2.0, 0.7), 0.5);
        let [low, high] = entry.phase_interval_rad.expect("known");
        let half = entry.gain_interval[1] - entry.gain;
        assert!(((low + high) / 2.0 - 0.7).abs() < 1e-14 && (((high - low) / 2.0).sin() - half / 2.0).abs() < 1e-14, "{entry:?}");
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

    #[test]
    fn an_interval_of_an_inverse_holds_the_value_that_it_belongs_to() {
        // Found by fuzzing: where what was inverted may be singular, the lower end lay above the gain.
        for (re, im) in (-8..=8).flat_map(|re| (-8..=8).map(move |im| (f64::from(re) / 4.0, f64::from(im) / 4.0))) {
            let entry = Confidence::new(0.95, 20.0).gain_phase_of_inverse(Complex64::ONE, 2.0, Complex64::new(re, im));
            assert!(entry.gain_interval[0] <= 1.0 && entry.gain_interval[1] >= 1.0, "{re} {im}: {entry:?}");
        }
    }
}
