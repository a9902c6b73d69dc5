//! Bands about a curve: at each place by itself, and for all places at once.

use statrs::distribution::{ContinuousCDF, Normal};
use std::f64::consts::PI;

/// 95 % of what bands are to hold.
const OUTSIDE: f64 = 0.05;

/// Standard errors at the places whose spline values are `rows`, and by how many of them a band is wide that holds the whole curve.
///
/// With T(u) the unit vector along which the curve at u depends on its coefficients, and κ the length of its path,
/// P(outside anywhere) ≤ 2 (1 − Φ(c)) + κ/π exp(−c²/2). A step of the path is √(2 − 2ρ), ρ the correlation of the curve at two places.
///
/// # References
/// H. Hotelling (1939); J. Sun & C. R. Loader (1994), Simultaneous confidence bands for linear regression and smoothing; T. Krivobokova,
/// T. Kneib & G. Claeskens (2010), Simultaneous confidence bands for penalized spline estimators.
pub(super) fn standard_errors(rows: &[Vec<f64>], covariance: impl Fn(usize, usize) -> f64) -> (Vec<f64>, f64) {
    let product = |a: &[f64], b: &[f64]| -> f64 {
        let used = |v: &[f64]| -> Vec<usize> { (0..v.len()).filter(|k| v[*k] != 0.0).collect() };
        let right = used(b);
        used(a).iter().map(|i| right.iter().map(|j| a[*i] * covariance(*i, *j) * b[*j]).sum::<f64>()).sum()
    };
    let errors: Vec<f64> = rows.iter().map(|row| product(row, row).max(0.0).sqrt()).collect();
    let step = |k: usize| {
        let correlation = product(&rows[k], &rows[k + 1]) / (errors[k] * errors[k + 1]);
        (2.0 - 2.0 * correlation).max(0.0).sqrt()
    };
    let path: f64 = (0..rows.len().saturating_sub(1)).map(step).filter(|s| s.is_finite()).sum();
    (errors, critical(path))
}

/// c of 2 (1 − Φ(c)) + κ/π exp(−c²/2) = 5 %, by halving.
fn critical(path: f64) -> f64 {
    let normal = Normal::standard();
    let outside = |c: f64| 2.0 * normal.sf(c) + path / PI * (-0.5 * c * c).exp();
    let (mut low, mut high) = (1.0, 10.0);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if outside(middle) > OUTSIDE { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_constant_has_one_band_and_a_curve_that_turns_a_wider_one() {
        // Nothing but one number: the 95 % of a normal variable.
        let (errors, wide) = standard_errors(&vec![vec![1.0]; 50], |_, _| 4.0);
        assert!(errors.iter().all(|e| (e - 2.0).abs() < 1e-12) && (wide - 1.959_963_984_540_054).abs() < 1e-9);
        // a cos u + b sin u with equal errors is R cos(u − v) with R² = χ²_2: outside with exp(−c²/2), which the path of 2π gives twice over,
        // once for each sign; c² = 2 ln(1/0.05) then is a lower end.
        let rows: Vec<Vec<f64>> = (0..=400).map(|k| 2.0 * PI * f64::from(k) / 400.0).map(|u| vec![u.cos(), u.sin()]).collect();
        let (_, wide) = standard_errors(&rows, |i, j| f64::from(u8::from(i == j)));
        let exact = (2.0 * 20.0_f64.ln()).sqrt();
        assert!(wide > exact && wide < 1.25 * exact, "{wide} for {exact}");
    }
}
