//! An encoder whose zero is not where the file has it.

use super::{Card, Form, JointCause, Told, each_joint};
use crate::column::Column;

pub(super) static CAUSE: JointCause = JointCause {
    card: Card {
        name: "angle-offset",
        what: "an angle whose zero is not where the file has it: all that the joint carries stands elsewhere",
        equation: "q_logged = q + c",
        side: "sensor",
        look_alikes: &["link-parameters", "base-tilt", "torque-offset"],
        next_experiment: "a posture that is measured from outside, with a level or against a stop",
    },
    forms: |scene| {
        // That of the first joint turns the whole robot, as a tilt of its base does.
        let behind_another = |j: usize| {
            if j == 0 { vec![] } else { vec![Form::new(&CAUSE, Some(j), vec![Column::Zero { joint: j, at: 0.0 }], vec![Told::new("offset_rad", "rad", 0)])] }
        };
        each_joint(scene, behind_another)
    },
};
