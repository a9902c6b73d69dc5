//! A wrong torque constant.

use super::{Card, Form, JointCause, Told, each_joint};
use crate::column::Column;

pub(super) static CAUSE: JointCause = JointCause {
    card: Card {
        name: "torque-scale",
        what: "a torque channel with a wrong gain or sign: a motor's torque constant, a gear ratio; or all of them with one, as a unit makes it",
        equation: "τ_logged = s τ",
        side: "sensor",
        look_alikes: &["link-parameters", "payload", "load-friction"],
        next_experiment: "a known weight at the flange: the gain follows from it",
    },
    // One supply or one unit of all torques is one number. Below zero it is where a torque goes against what the bodies need (`Form::turned_round`).
    forms: |scene| {
        let of = |joint: Option<usize>, column: Column| {
            Form::new(&CAUSE, joint, vec![column], vec![Told::new("scale", "", 0).on_top_of(1.0).within([0.0, f64::INFINITY])])
        };
        let all = (scene.joints.len() > 1).then(|| of(None, Column::Torques));
        all.into_iter().chain(each_joint(scene, |j| vec![of(Some(j), Column::Torque(j))])).collect()
    },
};
