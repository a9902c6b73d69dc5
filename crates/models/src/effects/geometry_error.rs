//! A wrong length or angle in the kinematics.

use super::parameter_error::{NAME, VALUE, replaced};
use super::vocabulary::*;

const CARD: Card = Card {
    name: "geometry-error",
    what: "a wrong link length or posture in the kinematics",
    sides: &[Side::Robot, Side::Limb],
    parameters: &[NAME, VALUE],
    signature: "endpoint responses are right, joint matrices do not have the structure of two links",
    look_alikes: &["parameter-error", "sensor-misalignment"],
    next_experiment: "the same limb in a second posture: the joint inertia changes with the wrong geometry and stays with the right one",
    equation: "M_q = Jᵀ M J must keep the structure α + 2 β cos φ2, δ + β cos φ2, δ",
    source: "Hogan 1985, The mechanics of multi-joint posture and movement control",
    trace: Trace::Plant,
};

/// A wrong parameter of the geometry. It can be named only against a plant that has the parameter.
pub(super) const EFFECT: Effect = Effect::new(&CARD, |parameters, _| replaced(&CARD, parameters));
