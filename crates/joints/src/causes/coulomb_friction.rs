//! Dry friction, with or without Stribeck's excess at rest.

use super::{Card, Form, JointCause, Shape, Told, each_joint, geometric};
use crate::column::Column;
use ndof_models::robot::Robot;

pub(super) static CAUSE: JointCause = JointCause {
    card: Card {
        name: "coulomb-friction",
        what: "dry friction, with Stribeck's higher level near rest where the data show it",
        equation: "τ = [F_c + (F_s − F_c) exp(−(q̇/v_s)²)] sign q̇, or F_c tanh(q̇/v_t) where the sign turns over a speed",
        side: "joint",
        look_alikes: &["gear-hysteresis", "viscous-friction", "load-friction"],
        next_experiment: "slow and fast stretches over the same path: dry friction is the same in both",
    },
    forms: |scene| {
        each_joint(scene, |j| {
            let file = scene.chain.joints().coulomb[j];
            let level = || Told::new("level_nm", "N m", 0).on_top_of(file).positive();
            let mut forms = vec![Form::new(&CAUSE, Some(j), vec![Column::Sign(j)], vec![level()])];
            let scale = &scene.joints[j];
            // From where the noise of the rate hides it no more to where it is a viscous friction that thins.
            let (least, most) = (2.0 * scale.speed_noise, 0.25 * scale.speed);
            for value in geometric(least, most, 5) {
                let shape = Shape { name: "turning_speed_rad_per_s", unit: "rad/s", value, bounds: [least, most] };
                let form = Form::new(&CAUSE, Some(j), vec![], vec![level()]);
                forms.push(form.shaped(shape, |form, shape| vec![Column::Turn { joint: form.joint.unwrap_or(0), speed: shape[0] }]));
            }
            // From where the sign is certain, three deviations of the noise to each side, to where the excess is no longer one near rest.
            let (least, most) = (6.0 * scale.speed_noise, 0.5 * scale.speed);
            for value in geometric(least, most, 5) {
                let at_rest = Told { name: "stribeck_level_nm".to_owned(), parts: vec![(0, 1.0), (1, 1.0)], ..level() };
                let shape = Shape { name: "stribeck_velocity_rad_per_s", unit: "rad/s", value, bounds: [least, most] };
                // An excess: what is less at rest than in motion is no dry friction.
                let excess = Told { hidden: true, ..Told::new("excess_nm", "N m", 1).positive() };
                let form = Form::new(&CAUSE, Some(j), vec![], vec![level(), at_rest, excess]);
                forms.push(form.shaped(shape, |form, shape| {
                    let joint = form.joint.unwrap_or(0);
                    vec![Column::Sign(joint), Column::Stribeck { joint, velocity: shape[0] }]
                }));
            }
            forms
        })
    },
};
