//! What unit tests share.

use crate::{Axis, Fit, InertiaDampingStiffness, InertiaDampingStiffnessModel, PaperFit, ParametricModel, Symmetry};
use ndarray::{Array3, arr2};
use ndof_sysid::{FrequencyResponse, ResponseKind, Uncertainty};
use num_complex::Complex64;
use std::ops::{Div, Sub};

/// The patient-like arm P1.
pub(crate) fn arm() -> InertiaDampingStiffness {
    InertiaDampingStiffness {
        axes: vec![Axis::linear("x"), Axis::linear("y")],
        inertia: arr2(&[[2.1, -0.55], [-0.55, 1.9]]),
        damping: arr2(&[[11.0, -2.0], [-2.0, 15.0]]),
        stiffness: arr2(&[[300.0, -60.0], [-60.0, 520.0]]),
    }
}

/// A limb of one axis: 2 kg, 12 N s/m, 300 N/m.
pub(crate) fn limb() -> (InertiaDampingStiffnessModel, InertiaDampingStiffness) {
    let axes = vec![Axis::linear("x")];
    let limb = InertiaDampingStiffness { axes: axes.clone(), inertia: arr2(&[[2.0]]), damping: arr2(&[[12.0]]), stiffness: arr2(&[[300.0]]) };
    (InertiaDampingStiffnessModel::new(axes, Symmetry::Symmetric), limb)
}

/// The paper's fit of that limb to its own compliance.
pub(crate) fn fitted_limb() -> (InertiaDampingStiffnessModel, FrequencyResponse, Fit) {
    let (model, limb) = limb();
    let response = limb.response(&[0.5, 1.0, 2.0, 4.0], ResponseKind::Compliance);
    let fit = PaperFit::default().fit(&model, &response, &Array3::ones(response.value.dim()), &model.theta(&limb)).expect("a fit");
    (model, response, fit)
}

/// Gives a response noise of this share of each element of its diagonal, by frequency, from so many averages at each line.
pub(crate) fn add_noise(response: &mut FrequencyResponse, degrees_of_freedom: f64, share: impl Fn(f64) -> f64) {
    let spacing = response.frequency_hz[1] - response.frequency_hz[0];
    let diagonal =
        |value: &dyn Fn(usize, usize) -> f64| Array3::from_shape_fn(response.value.dim(), |(f, i, j)| Complex64::from(if i == j { value(f, i) } else { 0.0 }));
    response.uncertainty = Some(Uncertainty {
        noise: diagonal(&|f, i| (share(response.frequency_hz[f]) * response.value[[f, i, i]].norm()).powi(2)),
        input_inverse: diagonal(&|_, _| 1.0),
        degrees_of_freedom,
        independent_spacing_hz: spacing,
        kernel: ndof_signal::Kernel::default(),
        unexplained: None,
        inverted: false,
    });
}

/// ∂f/∂x_k at `x`, [f(x + h e_k) − f(x − h e_k)]/2h.
pub(crate) fn difference<T: Sub<Output = T> + Div<f64, Output = T>>(x: &[f64], k: usize, h: f64, f: impl Fn(&[f64]) -> Vec<T>) -> Vec<T> {
    let moved = |by: f64| {
        let mut x = x.to_vec();
        x[k] += by;
        f(&x)
    };
    moved(h).into_iter().zip(moved(-h)).map(|(up, down)| (up - down) / (2.0 * h)).collect()
}

/// Asserts that the slopes of a model at `s` are those of differences.
pub(crate) fn assert_slopes(model: &dyn ParametricModel, theta: &[f64], s: Complex64) {
    let size = model.axes().len().pow(2);
    let (mut value, mut slopes) = (vec![Complex64::default(); size], vec![Complex64::default(); size * theta.len()]);
    model.stiffness(theta, s, &mut value, Some(&mut slopes));
    let at = |theta: &[f64]| {
        let mut d = vec![Complex64::default(); size];
        model.stiffness(theta, s, &mut d, None);
        d
    };
    assert_eq!(value, at(theta));
    let largest = value.iter().map(|v| v.norm()).fold(0.0, f64::max);
    for (k, own) in theta.iter().enumerate() {
        for (e, difference) in difference(theta, k, 1e-5 * own.abs(), at).into_iter().enumerate() {
            assert!((slopes[size * k + e] - difference).norm() < 1e-8 * largest / own.abs(), "{} {k} {e}", model.name());
        }
    }
}
