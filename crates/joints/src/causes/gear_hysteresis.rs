//! A gear whose friction builds up over a way.

use super::{Card, Form, JointCause, Told, each_joint};
use crate::column::Column;

pub(super) static CAUSE: JointCause = JointCause {
    card: Card {
        name: "gear-hysteresis",
        what: "friction that builds up over a way, as in a preloaded gear: stiff until it slips",
        equation: "τ = F z, ż = q̇/δ while |z| < 1",
        side: "joint",
        look_alikes: &["coulomb-friction", "backlash"],
        next_experiment: "small movements to and fro about one posture: the loop's slope is its stiffness",
    },
    forms: |scene| {
        each_joint(scene, |j| {
            let scale = &scene.joints[j];
            let travel = scale.range[1] - scale.range[0];
            // A way of some speed noise in the time that the band resolves cannot be told from dry friction; one of a third of the range is a spring.
            let least = (4.0 * scale.angle_noise).max(0.25 * scale.speed / scene.fastest_hz).min(0.1 * travel);
            let slip = |form: &Form, shape: &[f64]| vec![Column::Slip { joint: form.joint.unwrap_or(0), way: shape[0] }];
            let form = Form::new(&CAUSE, Some(j), vec![], vec![Told::new("level_nm", "N m", 0).positive()]);
            form.over(("way_rad", "rad"), [least, 0.35 * travel], 6, slip).collect()
        })
    },
};
