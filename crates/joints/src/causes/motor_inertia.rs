//! Inertia of a motor's rotor.

use super::{Card, Form, JointCause, Told, each_joint};
use crate::column::Column;

pub(super) static CAUSE: JointCause = JointCause {
    card: Card {
        name: "motor-inertia",
        what: "inertia of the motor's rotor, as the joint feels it through the gear",
        equation: "τ = J q̈",
        side: "joint",
        look_alikes: &["link-parameters", "payload", "torque-scale"],
        next_experiment: "faster movements: what grows with the acceleration and not with the posture is the rotor",
    },
    forms: |scene| {
        each_joint(scene, |j| {
            let told = Told::new("rotor_kg_m2", "kg m^2", 0).on_top_of(scene.joints[j].rotor).positive();
            vec![Form::new(&CAUSE, Some(j), vec![Column::Acceleration(j)], vec![told])]
        })
    },
};
