//! The place at which a file's spring pulls nothing.

use super::{Card, Form, JointCause, Told, each_joint};
use crate::column::Column;

pub(super) static CAUSE: JointCause = JointCause {
    card: Card {
        name: "spring-rest",
        what: "a spring of the file that rests elsewhere",
        equation: "τ = k (q₀,file − q₀)",
        side: "joint",
        look_alikes: &["torque-offset", "cable-force"],
        next_experiment: "the same movement with the spring taken off: an offset of the sensor stays",
    },
    forms: |scene| {
        each_joint(scene, |j| {
            let [stiffness, rest] = scene.chain.springs()[j];
            let told = Told { parts: vec![(0, -1.0 / stiffness)], ..Told::new("rest_rad", "rad", 0) }.on_top_of(rest);
            if stiffness > 0.0 { vec![Form::new(&CAUSE, Some(j), vec![Column::Constant(j)], vec![told])] } else { vec![] }
        })
    },
};
