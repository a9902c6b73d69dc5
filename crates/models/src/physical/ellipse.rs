//! The ellipse of a stiffness (or inertia, or damping) matrix in a plane.

use super::{Derived, symmetric_eigen};
use ndarray::{Array2, arr2};
use serde::{Deserialize, Serialize};
use std::f64::consts::PI;

/// The force to a unit displacement turned once around: an ellipse whose half axes are the eigenvalues.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Ellipse {
    /// Larger half axis: stiffness in the stiffest direction.
    pub major: Derived,
    /// Smaller half axis.
    pub minor: Derived,
    /// Direction of the larger one from the first axis, within ±π/2 (rad).
    pub orientation_rad: Derived,
    /// π · major · minor.
    pub area: Derived,
    /// major / minor.
    pub shape: Derived,
}

/// The ellipse of the symmetric part of a 2 × 2 matrix, with intervals by the delta method:
///
/// dλ_i = v_iᵀ dK v_i,  dθ = v_minorᵀ dK v_major / (λ_major − λ_minor)
///
/// `parameters` says for each parameter behind `covariance` which matrix it stands for (∂K/∂θ_k); `quantile` is the
/// half width of an interval in standard errors. `None` if the matrix is not 2 × 2 or not finite.
///
/// # References
/// F. A. Mussa-Ivaldi, N. Hogan & E. Bizzi (1985), Neural, mechanical, and geometric factors subserving arm posture in
/// humans, J. Neurosci. 5(10).
pub fn ellipse(matrix: &Array2<f64>, parameters: &[Array2<f64>], covariance: &Array2<f64>, quantile: f64) -> Option<Ellipse> {
    if matrix.dim() != (2, 2) || matrix.iter().any(|v| !v.is_finite()) {
        return None;
    }
    let (values, vectors) = symmetric_eigen(matrix)?;
    let (minor, major) = (values[0], values[1]);
    let (low, mut high) = ([vectors[[0, 0]], vectors[[1, 0]]], [vectors[[0, 1]], vectors[[1, 1]]]);
    if high[0] < 0.0 {
        high = [-high[0], -high[1]];
    }
    // `low` at a right angle to `high`, counter-clockwise.
    let low = if high[0] * low[1] - high[1] * low[0] < 0.0 { [-low[0], -low[1]] } else { low };
    let form = |a: [f64; 2], d: &Array2<f64>, b: [f64; 2]| -> f64 { (0..4).map(|e| a[e / 2] * 0.5 * (d[[e / 2, e % 2]] + d[[e % 2, e / 2]]) * b[e % 2]).sum() };
    let gradient =
        |of: &dyn Fn(f64, f64, f64) -> f64| -> Vec<f64> { parameters.iter().map(|d| of(form(high, d, high), form(low, d, low), form(low, d, high))).collect() };
    let derived = |value: f64, of: &dyn Fn(f64, f64, f64) -> f64| Derived::new(value, &gradient(of), covariance, quantile);
    Some(Ellipse {
        major: derived(major, &|d, _, _| d),
        minor: derived(minor, &|_, d, _| d),
        orientation_rad: derived(high[1].atan2(high[0]), &|_, _, turn| turn / (major - minor)),
        area: derived(PI * major * minor, &|a, b, _| PI * (a * minor + major * b)),
        shape: derived(major / minor, &|a, b, _| a / minor - major * b / (minor * minor)),
    })
}

/// ∂K/∂θ for the upper triangle (`symmetric`) or all entries of a 2 × 2 matrix, row by row.
pub fn unit_matrices(symmetric: bool) -> Vec<Array2<f64>> {
    if symmetric {
        vec![arr2(&[[1.0, 0.0], [0.0, 0.0]]), arr2(&[[0.0, 1.0], [1.0, 0.0]]), arr2(&[[0.0, 0.0], [0.0, 1.0]])]
    } else {
        (0..4).map(|e| Array2::from_shape_fn((2, 2), |(i, j)| f64::from(u8::from(2 * i + j == e)))).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_ellipse_of_a_turned_diagonal_is_that_diagonal() {
        for degrees in [0.0f64, 30.0, -70.0] {
            let (s, c) = degrees.to_radians().sin_cos();
            let turn = arr2(&[[c, -s], [s, c]]);
            let k = turn.dot(&arr2(&[[500.0, 0.0], [0.0, 200.0]])).dot(&turn.t());
            let found = ellipse(&k, &unit_matrices(true), &Array2::eye(3), 1.96).expect("2 × 2");
            assert!((found.major.value - 500.0).abs() < 1e-10 && (found.minor.value - 200.0).abs() < 1e-10);
            assert!((found.orientation_rad.value - degrees.to_radians()).abs() < 1e-12, "{degrees}: {found:?}");
            assert!((found.area.value - PI * 1e5).abs() < 1e-7 && (found.shape.value - 2.5).abs() < 1e-12);
        }
    }

    #[test]
    fn standard_errors_are_those_of_differences() {
        let k = arr2(&[[300.0, -60.0], [-60.0, 520.0]]);
        let covariance = arr2(&[[9.0, 1.0, 0.5], [1.0, 4.0, -1.0], [0.5, -1.0, 16.0]]);
        let found = ellipse(&k, &unit_matrices(true), &covariance, 2.0).expect("2 × 2");
        let read = |e: &Ellipse| [e.major.value, e.minor.value, e.orientation_rad.value, e.area.value, e.shape.value];
        let h = 1e-4;
        let slopes: Vec<[f64; 5]> = unit_matrices(true)
            .iter()
            .map(|d| {
                let at = |sign: f64| read(&ellipse(&(&k + &(d * (sign * h))), &[], &Array2::zeros((0, 0)), 2.0).expect("2 × 2"));
                let (up, down) = (at(1.0), at(-1.0));
                std::array::from_fn(|q| (up[q] - down[q]) / (2.0 * h))
            })
            .collect();
        let errors = [found.major, found.minor, found.orientation_rad, found.area, found.shape];
        for (q, error) in errors.iter().enumerate() {
            let expected: f64 = (0..9).map(|e| slopes[e / 3][q] * covariance[[e / 3, e % 3]] * slopes[e % 3][q]).sum::<f64>().sqrt();
            assert!((error.std_error / expected - 1.0).abs() < 1e-6, "{q}: {error:?} {expected}");
        }
    }
}
