//! Are the fitted matrices symmetric?

use super::{Derived, product};
use crate::{Fit, InertiaDampingStiffnessModel, ParametricModel, Symmetry};
use ndarray::{Array1, Array2};
use ndof_linear::inverse;
use serde::{Deserialize, Serialize};
use statrs::distribution::{ChiSquared, ContinuousCDF};

/// Half the difference of two mirrored entries.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Antisymmetric {
    /// `M_x_y` for (M_xy − M_yx)/2.
    pub name: String,
    /// Its value and interval.
    pub half_difference: Derived,
}

/// Whether one matrix of a free fit is symmetric.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SymmetryTest {
    /// `M`, `B` or `K`.
    pub matrix: String,
    /// One for each pair of axes.
    pub antisymmetric: Vec<Antisymmetric>,
    /// Probability of so large an antisymmetric part if the matrix were symmetric (χ² test); NaN where a direction is not determined.
    pub p_value: f64,
    /// What a violation means.
    pub meaning: String,
}

/// Tests M, B and K of a fit with [`Symmetry::Free`]; empty for symmetric models and single axes.
///
/// χ² = aᵀ Cov(a)⁻¹ a with a the half differences of mirrored entries.
pub fn symmetry_test(model: &InertiaDampingStiffnessModel, fit: &Fit) -> Vec<SymmetryTest> {
    let n = model.axes().len();
    if model.symmetry() != Symmetry::Free || n < 2 {
        return Vec::new();
    }
    let names = model.parameters();
    let pairs: Vec<(usize, usize)> = (0..n).flat_map(|i| (i + 1..n).map(move |j| (i, j))).collect();
    ["M", "B", "K"]
        .iter()
        .enumerate()
        .map(|(m, matrix)| {
            let at = |i: usize, j: usize| m * n * n + i * n + j;
            let gradients: Vec<Vec<f64>> = pairs
                .iter()
                .map(|&(i, j)| {
                    let mut g = vec![0.0; fit.theta.len()];
                    g[at(i, j)] = 0.5;
                    g[at(j, i)] = -0.5;
                    g
                })
                .collect();
            let antisymmetric: Vec<Antisymmetric> = pairs
                .iter()
                .zip(&gradients)
                .map(|(&(i, j), g)| Antisymmetric {
                    name: names[at(i, j)].name.clone(),
                    half_difference: Derived::new(0.5 * (fit.theta[at(i, j)] - fit.theta[at(j, i)]), g, &fit.covariance, fit.interval_quantile),
                })
                .collect();
            let p_value = p_value(&antisymmetric, &gradients, &fit.covariance);
            let meaning = match *matrix {
                _ if p_value.is_nan() => format!("the data do not tell whether {matrix} is symmetric"),
                _ if p_value >= 0.05 => format!("{matrix} is symmetric within its interval, as a passive mechanical system requires"),
                "M" => {
                    "M is not symmetric: no mechanism has such an inertia; a turned or cross-talking sensor does (then B and K are turned by the same angle)"
                        .to_owned()
                }
                "B" => "B is not symmetric: gyroscopic or velocity-dependent active force, or a turned sensor if M is not symmetric either".to_owned(),
                _ => "K is not symmetric: the force has curl, as an active one (reflex, muscle) may; a turned sensor if M is not symmetric either".to_owned(),
            };
            SymmetryTest { matrix: (*matrix).to_owned(), antisymmetric, p_value, meaning }
        })
        .collect()
}

fn p_value(parts: &[Antisymmetric], gradients: &[Vec<f64>], covariance: &Array2<f64>) -> f64 {
    let n = parts.len();
    let matrix = Array2::from_shape_fn((n, n), |(i, j)| product(&gradients[i], covariance, &gradients[j]));
    let a = Array1::from_shape_fn(n, |i| parts[i].half_difference.value);
    let chi2 = inverse(&matrix).map_or(f64::NAN, |inverse| a.dot(&inverse.dot(&a)));
    ChiSquared::new(n as f64).map_or(f64::NAN, |d| if chi2.is_finite() { d.sf(chi2) } else { f64::NAN })
}
