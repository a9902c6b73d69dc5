//! A torque channel that comes late.

use super::{Card, Form, JointCause, Told, each_joint};
use crate::column::Column;

pub(super) static CAUSE: JointCause = JointCause {
    card: Card {
        name: "torque-delay",
        what: "torque and angle that are not of one time: the torque is logged late, or early where it is below zero",
        equation: "τ_logged(t) = τ(t − d)",
        side: "sensor",
        look_alikes: &["viscous-friction", "joint-flexibility"],
        next_experiment: "a faster movement: a delay turns phase with frequency",
    },
    forms: |scene| each_joint(scene, |j| vec![Form::new(&CAUSE, Some(j), vec![Column::Falling(j)], vec![Told::new("delay_s", "s", 0)])]),
};
