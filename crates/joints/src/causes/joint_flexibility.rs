//! A gear or shaft that gives.

use super::{Card, Form, JointCause, Told, each_joint};
use crate::column::Column;
use crate::deflection::{Gear, Lets};
use crate::scene::Scene;
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
            gears(scene, j, &CAUSE, Lets::Give, &SWINGS.map(|times| 1.0 / (inertia * (TAU * scene.joints[j].pace_hz * times).powi(2))), &stiffness)
        })
    },
};

/// A gear in forms of these extents and one that is a line, each alone and with a rotor before it, without which a link's mass would stand in for the rotor's.
pub(super) fn gears(scene: &Scene<'_>, j: usize, cause: &'static JointCause, lets: Lets, extents: &[f64], told: &Told) -> Vec<Form> {
    let rotor = Told::new("rotor_kg_m2", "kg m^2", 1).on_top_of(scene.joints[j].rotor).positive();
    // The line is all of them where nothing is behind the joint, or nothing moves it.
    let extents = extents.iter().copied().filter(|x| x.is_finite() && *x > 0.0).chain([0.0]);
    extents
        .map(|extent| Column::Give(Gear::new(scene, j, lets, extent)))
        .flat_map(|gear| {
            let alone = Form::new(cause, Some(j), vec![gear.clone()], vec![told.clone()]);
            [alone, Form::new(cause, Some(j), vec![gear, Column::Acceleration(j)], vec![told.clone(), rotor.clone()])]
        })
        .collect()
}
