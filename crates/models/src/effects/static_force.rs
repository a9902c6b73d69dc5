//! Forces that depend on where an axis is and on nothing else.

use super::evidence::Evidence;
use super::form::Action;
use crate::force_law::{ForceLaw, Motion};

/// A static force of one axis.
pub(super) fn of_place(axis: usize, of: impl Fn(f64) -> f64 + Send + Sync) -> impl ForceLaw {
    move |motion: &Motion<'_>, force: &mut [f64]| force[axis] += of(motion.position[axis])
}

/// A static force of one axis by knobs and coefficients.
pub(super) fn shape(axis: usize, force: impl Fn(&[f64], &[f64], f64) -> f64 + Copy + Send + Sync + 'static) -> Action {
    Action::force(move |knobs, coefficients| {
        let (knobs, coefficients) = (knobs.to_vec(), coefficients.to_vec());
        of_place(axis, move |x| force(&knobs, &coefficients, x))
    })
}

/// Shapes of a spring's force, each with the others: any two of them on one axis make what a third is.
const SHAPES: [(&str, &[&str]); 4] = [
    ("cubic-stiffness", &["asymmetric-stiffness", "dead-zone", "end-stop"]),
    ("asymmetric-stiffness", &["cubic-stiffness", "dead-zone", "end-stop"]),
    ("dead-zone", &["cubic-stiffness", "asymmetric-stiffness", "end-stop"]),
    ("end-stop", &["cubic-stiffness", "asymmetric-stiffness", "dead-zone"]),
];

/// The other shapes of a spring, where one of them was found beside this one.
pub(super) fn other_shapes(shape: &str, evidence: &Evidence<'_>) -> &'static [&'static str] {
    let others = SHAPES.iter().find(|(name, _)| *name == shape).map_or(&[][..], |(_, others)| *others);
    if others.iter().any(|other| evidence.beside.contains(other)) { others } else { &[] }
}
