//! A torque sensor whose zero is not zero.

use super::{Card, Form, JointCause, Told, each_joint};
use crate::column::Column;

pub(super) static CAUSE: JointCause = JointCause {
    card: Card {
        name: "torque-offset",
        what: "a torque channel whose zero is not zero",
        equation: "τ = c",
        side: "sensor",
        look_alikes: &["base-tilt", "link-parameters", "cable-force", "spring-rest"],
        next_experiment: "a rest with the brakes on, where the torque is known",
    },
    forms: |scene| each_joint(scene, |j| vec![Form::new(&CAUSE, Some(j), vec![Column::Constant(j)], vec![Told::new("offset_nm", "N m", 0)])]),
};
