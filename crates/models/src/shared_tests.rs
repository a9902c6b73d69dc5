//! What unit tests share.

use crate::{Axis, InertiaDampingStiffness};
use ndarray::arr2;
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

/// ∂f/∂x_k at `x`, [f(x + h e_k) − f(x − h e_k)]/2h.
pub(crate) fn difference<T: Sub<Output = T> + Div<f64, Output = T>>(x: &[f64], k: usize, h: f64, f: impl Fn(&[f64]) -> Vec<T>) -> Vec<T> {
    let moved = |by: f64| {
        let mut x = x.to_vec();
        x[k] += by;
        f(&x)
    };
    moved(h).into_iter().zip(moved(-h)).map(|(up, down)| (up - down) / (2.0 * h)).collect()
}
