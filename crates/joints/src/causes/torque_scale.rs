//! A wrong torque constant.

use super::{Card, Form, JointCause, Told, each_joint};
use crate::column::Column;

pub(super) static CAUSE: JointCause = JointCause {
    card: Card {
        name: "torque-scale",
        what: "a torque channel with a wrong gain: a motor's torque constant, a gear ratio",
        equation: "τ_logged = s τ",
        side: "sensor",
        look_alikes: &["link-parameters", "payload", "load-friction"],
        next_experiment: "a known weight at the flange: the gain follows from it",
    },
    forms: |scene| each_joint(scene, |j| vec![Form::new(&CAUSE, Some(j), vec![Column::Torque(j)], vec![Told::new("scale", "", 0).on_top_of(1.0).positive()])]),
};
