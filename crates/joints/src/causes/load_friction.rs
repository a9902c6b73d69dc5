//! Dry friction that grows with the load on a gear.

use super::{Card, Form, JointCause, Told, each_joint};
use crate::column::Column;

pub(super) static CAUSE: JointCause = JointCause {
    card: Card {
        name: "load-friction",
        what: "dry friction that grows with the torque that a gear passes on",
        equation: "τ = μ |τ_load| sign q̇",
        side: "joint",
        look_alikes: &["coulomb-friction"],
        next_experiment: "the same path with and without a payload: this friction grows with it",
    },
    forms: |scene| each_joint(scene, |j| vec![Form::new(&CAUSE, Some(j), vec![Column::Load(j)], vec![Told::new("coefficient", "", 0).positive()])]),
};
