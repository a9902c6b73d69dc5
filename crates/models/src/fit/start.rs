//! Start values by linear least squares.

use crate::{Gains, InertiaDampingStiffness, InertiaDampingStiffnessModel, ParametricModel};
use ndarray::{Array1, Array2, Array3};
use ndof_sysid::{FrequencyResponse, ResponseError, ResponseKind};
use num_complex::Complex64;
use std::f64::consts::TAU;

/// Start values of M, B and K: D = M s² + B s + K is linear in them.
///
/// Each element of the dynamic stiffness is fitted by itself, weighted with its inverse variance, or with the inverse
/// square of the matrix's norm where the response has no covariance.
///
/// # Errors
/// [`ResponseError`] if the response is no mechanical one, cannot be inverted, or is of another size than the model.
///
/// ```
/// use ndarray::arr2;
/// use ndof_models::{Axis, InertiaDampingStiffness, InertiaDampingStiffnessModel, Symmetry, linear_start};
/// use ndof_sysid::ResponseKind;
///
/// let limb = InertiaDampingStiffness { axes: vec![Axis::linear("x")], inertia: arr2(&[[2.0]]), damping: arr2(&[[12.0]]), stiffness: arr2(&[[300.0]]) };
/// let compliance = limb.response(&[0.5, 1.0, 2.0, 4.0], ResponseKind::Compliance);
/// let model = InertiaDampingStiffnessModel::new(limb.axes.clone(), Symmetry::Symmetric);
/// let start = linear_start(&model, &compliance)?; // M, B, K
/// assert!(start.iter().zip([2.0, 12.0, 300.0]).all(|(found, true_value)| (found / true_value - 1.0).abs() < 1e-9));
/// # Ok::<(), ndof_sysid::ResponseError>(())
/// ```
pub fn linear_start(model: &InertiaDampingStiffnessModel, response: &FrequencyResponse) -> Result<Vec<f64>, ResponseError> {
    let stiffness = response.to_kind(ResponseKind::DynamicStiffness)?;
    let (n, (_, outputs, inputs)) = (model.axes().len(), stiffness.value.dim());
    if (outputs, inputs) != (n, n) {
        return Err(ResponseError::Size { outputs, inputs, axes: n });
    }
    let mut matrices = InertiaDampingStiffness {
        axes: model.axes().to_vec(),
        inertia: Array2::zeros((n, n)),
        damping: Array2::zeros((n, n)),
        stiffness: Array2::zeros((n, n)),
    };
    for i in 0..n {
        for j in 0..n {
            // Re D = K − ω² M and Im D = ω B: a 2 × 2 and a 1 × 1 system.
            let (mut a, mut b) = ([0.0; 5], [0.0; 2]);
            for f in 0..stiffness.len() {
                let (d, variance) = (stiffness.value[[f, i, j]], stiffness.variance(f, i, j));
                let norm: f64 = stiffness.value.index_axis(ndarray::Axis(0), f).iter().map(|v| v.norm_sqr()).sum();
                let weight = if variance > 0.0 { 1.0 / variance } else { 1.0 / norm };
                if !(d.is_finite() && weight.is_finite()) || stiffness.frequency_hz[f] <= 0.0 {
                    continue;
                }
                let w = TAU * stiffness.frequency_hz[f];
                let x = -w * w;
                [1.0, x, x * x, d.re, x * d.re].iter().zip(&mut a).for_each(|(v, a)| *a += weight * v);
                [w * w, w * d.im].iter().zip(&mut b).for_each(|(v, b)| *b += weight * v);
            }
            let determinant = a[0] * a[2] - a[1] * a[1];
            matrices.inertia[[i, j]] = (a[0] * a[4] - a[1] * a[3]) / determinant;
            matrices.stiffness[[i, j]] = (a[2] * a[3] - a[1] * a[4]) / determinant;
            matrices.damping[[i, j]] = b[1] / b[0];
        }
    }
    Ok(model.theta(&matrices))
}

/// Rounds in which gains and the response to sums of efforts follow from each other at most, and the change that ends them: a fit goes on from
/// there.
const ROUNDS: usize = 50;
const SETTLED: f64 = 1e-6;

/// Start values of the gains with which inputs add up, from the response to each: those with which one response to the sums explains all.
///
/// First that to the inputs of gain 1 stands for the response to the sums, then what the gains make of all ([`FrequencyResponse::to_sums`]).
pub fn gains_start(gains: &Gains, response: &FrequencyResponse) -> Vec<f64> {
    let mut found = gains_onto(gains, response, &response.value.select(ndarray::Axis(2), gains.reference()));
    for _ in 0..ROUNDS {
        let next = gains_onto(gains, response, &response.to_sums(&gains.matrix(&found)).value);
        let largest = |of: &dyn Fn(usize) -> f64| (0..next.len()).map(of).fold(0.0_f64, |most, v| most.max(v.abs()));
        let settled = largest(&|k| next[k] - found[k]) <= SETTLED * largest(&|k| next[k]);
        found = next;
        if settled {
            break;
        }
    }
    found
}

/// The real gains with which `compliance` (axes × axes) explains the columns of all other inputs best: least squares over frequencies and
/// outputs, weighted by their variance. 0 where nothing tells.
fn gains_onto(gains: &Gains, response: &FrequencyResponse, compliance: &Array3<Complex64>) -> Vec<f64> {
    let n = compliance.dim().1;
    let of_input = |input: usize| -> Vec<f64> {
        let (mut normal, mut right) = (Array2::<f64>::zeros((n, n)), Array1::<f64>::zeros(n));
        for (f, i) in (0..response.len()).flat_map(|f| (0..n).map(move |i| (f, i))) {
            let (target, variance) = (response.value[[f, i, input]], response.variance(f, i, input));
            let row: Vec<Complex64> = (0..n).map(|k| compliance[[f, i, k]]).collect();
            if !target.is_finite() || !row.iter().all(|v| v.is_finite()) {
                continue;
            }
            let weight = if variance > 0.0 { 1.0 / variance } else { 1.0 };
            for a in 0..n {
                right[a] += weight * (row[a].conj() * target).re;
                (0..n).for_each(|b| normal[[a, b]] += weight * (row[a].conj() * row[b]).re);
            }
        }
        ndof_linear::inverse(&normal).map_or_else(|| vec![0.0; n], |inverse| inverse.dot(&right).to_vec())
    };
    gains.others().iter().flat_map(|&input| of_input(input)).collect()
}
