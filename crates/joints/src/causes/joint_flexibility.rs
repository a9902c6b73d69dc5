//! A gear or shaft that gives.

use super::{Card, Form, JointCause, Told, each_joint};
use crate::column::Column;

pub(super) static CAUSE: JointCause = JointCause {
    card: Card {
        name: "joint-flexibility",
        what: "a gear or shaft between encoder and link that gives with the torque on it",
        equation: "q_link = q − τ_link/k",
        side: "joint",
        look_alikes: &["backlash", "torque-delay", "link-parameters"],
        next_experiment: "fast movements of this joint alone, or an encoder on the link",
    },
    forms: |scene| {
        let rotors = scene.chain.inertial_parameters().split_off(ndof_devices::TERMS_OF_A_LINK * scene.joints.len());
        each_joint(scene, |j| {
            let give = Column::Give { joint: j, compliance: 0.0 };
            let stiffness = Told { inverse: true, ..Told::new("stiffness_nm_per_rad", "N m/rad", 0).positive() };
            let rotor = Told::new("rotor_kg_m2", "kg m^2", 1).on_top_of(rotors[j]).positive();
            // A rotor that turns before the gear gives is no inertia of the link: without it a link's mass would stand in for it.
            vec![
                Form::new(&CAUSE, Some(j), vec![give.clone()], vec![stiffness.clone()]),
                Form::new(&CAUSE, Some(j), vec![give, Column::Acceleration(j)], vec![stiffness, rotor]),
            ]
        })
    },
};
