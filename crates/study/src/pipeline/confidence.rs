//! Standard errors and 95 % intervals of gain and phase.

use crate::result::estimate::{IntervalSpectrum, Response, Spectrum};
use crate::result::{Number, number};
use ndof_sysid::FrequencyResponse;
use statrs::distribution::{ContinuousCDF, StudentsT};

/// Rearranges `[f][p][q]` by `value(f, i, j)` to `[p][q][f]`.
pub(super) fn spectrum<T>(frequencies: usize, rows: usize, columns: usize, value: impl Fn(usize, usize, usize) -> T) -> Vec<Vec<Vec<T>>> {
    (0..rows).map(|i| (0..columns).map(|j| (0..frequencies).map(|f| value(f, i, j)).collect()).collect()).collect()
}

/// The response with its errors: σ = √(E|δH|²/2), gain |H| ± tσ (not below 0), phase ∠H ± asin(tσ/|H|), the full circle
/// where tσ ≥ |H|; t is Student's quantile of 0.975 with 2ν degrees of freedom.
pub(super) fn response_with_errors(response: &FrequencyResponse) -> Response {
    let (p, q) = response.shape();
    let freedom = response.uncertainty.as_ref().map_or(f64::NAN, |u| u.degrees_of_freedom);
    let t = StudentsT::new(0.0, 1.0, 2.0 * freedom).map_or(f64::NAN, |student| student.inverse_cdf(0.975));
    let sigma = |f, i, j| (response.variance(f, i, j) / 2.0).sqrt();
    let at = |f: usize, i: usize, j: usize| response.value[[f, i, j]];
    let numbers = |value: &dyn Fn(usize, usize, usize) -> f64| -> Spectrum { spectrum(response.len(), p, q, |f, i, j| number(value(f, i, j))) };
    let gain_ci95: IntervalSpectrum = spectrum(response.len(), p, q, |f, i, j| {
        let (gain, reach) = (at(f, i, j).norm(), t * sigma(f, i, j));
        interval((gain - reach).max(0.0), gain + reach).filter(|_| reach.is_finite())
    });
    let phase_ci95_rad: IntervalSpectrum = spectrum(response.len(), p, q, |f, i, j| {
        let ratio = t * sigma(f, i, j) / at(f, i, j).norm();
        if ratio < 1.0 { interval(at(f, i, j).arg() - ratio.asin(), at(f, i, j).arg() + ratio.asin()) } else { None }
    });
    Response {
        re: numbers(&|f, i, j| at(f, i, j).re),
        im: numbers(&|f, i, j| at(f, i, j).im),
        gain_std_error: numbers(&sigma),
        phase_std_error_rad: numbers(&|f, i, j| sigma(f, i, j) / at(f, i, j).norm()),
        gain_ci95,
        phase_ci95_rad,
    }
}

/// An interval, if both ends are numbers.
pub(super) fn interval(low: f64, high: f64) -> Option<[f64; 2]> {
    let ends: (Number, Number) = (number(low), number(high));
    match ends {
        (Some(low), Some(high)) => Some([low, high]),
        _ => None,
    }
}
