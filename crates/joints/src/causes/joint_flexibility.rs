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
        each_joint(scene, |j| {
            let told = Told { inverse: true, ..Told::new("stiffness_nm_per_rad", "N m/rad", 0).positive() };
            vec![Form::new(&CAUSE, Some(j), vec![Column::Give { joint: j, compliance: 0.0 }], vec![told])]
        })
    },
};
