//! Friction that grows with speed.

use super::{Card, Form, JointCause, Told, each_joint};
use crate::column::Column;
use ndof_models::robot::Robot;

pub(super) static CAUSE: JointCause = JointCause {
    card: Card {
        name: "viscous-friction",
        what: "friction that grows with speed",
        equation: "τ = b q̇, or b v₀ asinh(q̇/v₀) where a lubricant thins with speed (Eyring)",
        side: "joint",
        look_alikes: &["coulomb-friction", "torque-delay"],
        next_experiment: "the same path at half the speed: viscous friction halves, dry friction stays",
    },
    forms: |scene| {
        each_joint(scene, |j| {
            let told = Told::new("viscous_nm_s_per_rad", "N m s/rad", 0).on_top_of(scene.chain.joints().viscous[j]).positive();
            let mut forms = vec![Form::new(&CAUSE, Some(j), vec![Column::Velocity(j)], vec![told.clone()])];
            let scale = &scene.joints[j];
            // Far below the speeds of the movement it is dry friction by another name, far above them a straight line.
            let bounds = [0.25 * scale.speed, 3.0 * scale.speed];
            let thinning = |form: &Form, shape: &[f64]| vec![Column::Thinning { joint: form.joint.unwrap_or(0), speed: shape[0] }];
            forms.extend(Form::new(&CAUSE, Some(j), vec![], vec![told]).over(("thinning_speed_rad_per_s", "rad/s"), bounds, 4, thinning));
            forms
        })
    },
};
