//! Play between motor and link.

use super::{Card, Form, JointCause, Told, each_joint};
use crate::column::Column;

pub(super) static CAUSE: JointCause = JointCause {
    card: Card {
        name: "backlash",
        what: "play between an encoder on the motor's side and the link, which falls to the side to which it is loaded",
        equation: "q_link = q − (g/2) sign τ_link",
        side: "joint",
        look_alikes: &["joint-flexibility", "gear-hysteresis"],
        next_experiment: "a movement on which the load of this joint changes its sign often, or an encoder on the link",
    },
    forms: |scene| each_joint(scene, |j| vec![Form::new(&CAUSE, Some(j), vec![Column::Play(j)], vec![Told::new("gap_rad", "rad", 0).positive()])]),
};
