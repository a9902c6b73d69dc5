//! A gear or shaft that gives.

use super::{Card, Form, JointCause, Told, each_joint};
use crate::column::Column;
use crate::deflection::Gear;
use std::f64::consts::TAU;

/// How many times as fast as its joint moves a link swings on its gear where it is searched. A slower one would resonate with the movement itself; at
/// eight times it follows its load but for 1/8². Neighbours are 2.6 times as stiff as each other.
const SWINGS: [f64; 4] = [2.0, 3.2, 5.0, 8.0];

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
            let rotor = Told::new("rotor_kg_m2", "kg m^2", 1).on_top_of(scene.joints[j].rotor).positive();
            let swinging = SWINGS.map(|times| 1.0 / (inertia * (TAU * scene.joints[j].pace_hz * times).powi(2)));
            // The last follows its load, as stiff ones do, and is all of them where nothing is behind the joint, or nothing moves it.
            let gears = swinging.into_iter().filter(|c| c.is_finite() && *c > 0.0).chain([0.0]).map(|compliance| Column::Give(Gear::new(scene, j, compliance)));
            // A rotor that turns before the gear gives is no inertia of the link: without it a link's mass would stand in for it.
            gears
                .flat_map(|gear| {
                    let alone = Form::new(&CAUSE, Some(j), vec![gear.clone()], vec![stiffness.clone()]);
                    [alone, Form::new(&CAUSE, Some(j), vec![gear, Column::Acceleration(j)], vec![stiffness.clone(), rotor.clone()])]
                })
                .collect()
        })
    },
};
