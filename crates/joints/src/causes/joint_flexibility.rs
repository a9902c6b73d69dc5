//! A gear or shaft that gives.

use super::{Card, JointCause, Told, each_joint, gears};
use crate::deflection::Lets;

pub(super) static CAUSE: JointCause = JointCause {
    card: Card {
        name: "joint-flexibility",
        what: "a gear or shaft between encoder and link that gives with the torque on it",
        equation: "k (q − q_link) + d (q̇ − q̇_link) = τ_link",
        side: "joint",
        look_alikes: &["backlash", "torque-delay", "link-parameters"],
        next_experiment: "fast movements of this joint alone, or an encoder on the link",
    },
    forms: |scene| {
        each_joint(scene, |j| {
            let inertia = scene.joints[j].inertia;
            let stiffness = Told { inverse: true, ..Told::new("stiffness_nm_per_rad", "N m/rad", 0).positive() };
            gears(scene, j, &CAUSE, Lets::Give, |rate| 1.0 / (inertia * rate.powi(2)), &stiffness)
        })
    },
};
