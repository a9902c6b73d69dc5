//! Natural frequencies and damping ratios of M, B, K.

use super::Derived;
use crate::{InertiaDampingStiffness, InertiaDampingStiffnessModel};
use ndarray::Array2;
use ndof_linear::{eigen, inverse};
use num_complex::Complex64;
use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;

/// One solution of (M s² + B s + K) v = 0.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Mode {
    /// s, with a positive imaginary part where it is complex.
    pub pole: Complex64,
    /// |s| / 2π.
    pub natural_frequency_hz: f64,
    /// −Re s / |s|: below 1 it swings, at 1 it creeps back, below 0 it grows.
    pub damping_ratio: f64,
    /// v, one entry an axis, its largest entry 1.
    pub shape: Vec<Complex64>,
}

/// The modes, slowest first: one of each complex pair, and each real one. Empty if M is singular.
///
/// Poles are the eigenvalues of [[0, I], [−M⁻¹K, −M⁻¹B]].
pub fn modes(matrices: &InertiaDampingStiffness) -> Vec<Mode> {
    let n = matrices.axes.len();
    let Some(mobility) = inverse(&matrices.inertia) else { return Vec::new() };
    let (stiffness, damping) = (mobility.dot(&matrices.stiffness), mobility.dot(&matrices.damping));
    let companion = Array2::from_shape_fn((2 * n, 2 * n), |(i, j)| match (i < n, j < n) {
        (true, _) => f64::from(u8::from(j == i + n)),
        (false, true) => -stiffness[[i - n, j]],
        (false, false) => -damping[[i - n, j - n]],
    });
    let Some((poles, vectors)) = eigen(&companion) else { return Vec::new() };
    let mut out: Vec<Mode> = (0..2 * n)
        .filter_map(|k| {
            let pole = poles[k];
            let shape: Vec<Complex64> = (0..n).map(|i| vectors[[i, k]]).collect();
            let largest = shape.iter().copied().max_by(|a, b| a.norm().total_cmp(&b.norm()))?;
            (pole.im >= 0.0).then(|| Mode {
                pole,
                natural_frequency_hz: pole.norm() / TAU,
                damping_ratio: -pole.re / pole.norm(),
                shape: shape.iter().map(|v| v / largest).collect(),
            })
        })
        .collect();
    out.sort_by(|a, b| a.natural_frequency_hz.total_cmp(&b.natural_frequency_hz));
    out
}

/// The modes of a fitted model with natural frequency (Hz) and damping ratio and their standard errors, by central
/// differences in each parameter.
pub fn fitted_modes(model: &InertiaDampingStiffnessModel, theta: &[f64], covariance: &Array2<f64>, quantile: f64) -> Vec<(Mode, Derived, Derived)> {
    let own = modes(&model.matrices(theta));
    let mut slopes = vec![(vec![0.0; theta.len()], vec![0.0; theta.len()]); own.len()];
    for (k, value) in theta.iter().enumerate() {
        let step =
            1e-5 * if covariance[[k, k]].is_finite() && covariance[[k, k]] > 0.0 { covariance[[k, k]].sqrt() } else { value.abs().max(f64::MIN_POSITIVE) };
        let at = |sign: f64| {
            let mut moved = theta.to_vec();
            moved[k] += sign * step;
            modes(&model.matrices(&moved))
        };
        let (up, down) = (at(1.0), at(-1.0));
        if up.len() == own.len() && down.len() == own.len() {
            for (m, slope) in slopes.iter_mut().enumerate() {
                slope.0[k] = (up[m].natural_frequency_hz - down[m].natural_frequency_hz) / (2.0 * step);
                slope.1[k] = (up[m].damping_ratio - down[m].damping_ratio) / (2.0 * step);
            }
        }
    }
    own.into_iter()
        .zip(slopes)
        .map(|(mode, (frequency, damping))| {
            let frequency = Derived::new(mode.natural_frequency_hz, &frequency, covariance, quantile);
            let damping = Derived::new(mode.damping_ratio, &damping, covariance, quantile);
            (mode, frequency, damping)
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Axis, Symmetry};
    use ndarray::arr2;

    #[test]
    fn one_axis_has_the_textbook_frequency_and_damping() {
        let single =
            |b: f64| InertiaDampingStiffness { axes: vec![Axis::linear("x")], inertia: arr2(&[[2.0]]), damping: arr2(&[[b]]), stiffness: arr2(&[[800.0]]) };
        let found = modes(&single(8.0));
        assert_eq!(found.len(), 1);
        assert!((found[0].natural_frequency_hz - 20.0 / TAU).abs() < 1e-12 && (found[0].damping_ratio - 0.1).abs() < 1e-12);
        let slow = modes(&single(400.0));
        assert!(slow.len() == 2 && slow.iter().all(|m| (m.damping_ratio - 1.0).abs() < 1e-12));
    }

    #[test]
    fn the_patient_like_arm_swings_as_known_and_its_errors_are_exact_for_one_axis() {
        let arm = InertiaDampingStiffness {
            axes: vec![Axis::linear("x"), Axis::linear("y")],
            inertia: arr2(&[[2.1, -0.55], [-0.55, 1.9]]),
            damping: arr2(&[[11.0, -2.0], [-2.0, 15.0]]),
            stiffness: arr2(&[[300.0, -60.0], [-60.0, 520.0]]),
        };
        let found = modes(&arm);
        // SCIENCE C.5: 1.90 and 2.71 Hz, ζ 0.22 and 0.25.
        for (mode, (hz, ratio)) in found.iter().zip([(1.90, 0.22), (2.71, 0.25)]) {
            assert!((mode.natural_frequency_hz - hz).abs() < 0.006 && (mode.damping_ratio - ratio).abs() < 0.006, "{mode:?}");
            let at = arm.dynamic_stiffness(mode.pole);
            let rest: f64 = (0..2).map(|i| (0..2).map(|j| at[[i, j]] * mode.shape[j]).sum::<Complex64>().norm()).sum();
            assert!(rest < 1e-9 * 500.0);
        }
        let single = InertiaDampingStiffnessModel::new(vec![Axis::linear("x")], Symmetry::Symmetric);
        let covariance = Array2::from_diag(&ndarray::arr1(&[0.0, 0.0, 25.0]));
        let (_, frequency, _) = fitted_modes(&single, &[2.0, 8.0, 800.0], &covariance, 2.0)[0].clone();
        // f = √(K/M)/2π: df/dK = f/(2K).
        assert!((frequency.std_error / (5.0 * frequency.value / 1600.0) - 1.0).abs() < 1e-6);
    }
}
