//! A stop within the movement.

use super::{Card, Form, JointCause, Shape, Told, each_joint, geometric};
use crate::column::Column;

pub(super) static CAUSE: JointCause = JointCause {
    card: Card {
        name: "end-stop",
        what: "a stop that the joint runs into",
        equation: "τ = k (q − q_stop) beyond the stop",
        side: "joint",
        look_alikes: &["cable-force"],
        next_experiment: "a movement that ends before the stop: what it adds must vanish",
    },
    forms: |scene| {
        each_joint(scene, |j| {
            let [low, high] = scene.joints[j].range;
            let travel = high - low;
            // From half a percent of the range, of which some samples are beyond, to nearly half of it, where it is a spring.
            let places = geometric(0.005, 0.45, 8);
            let forms = |above: bool| {
                let (from, bounds) =
                    if above { (high, [high - 0.45 * travel, high - 0.002 * travel]) } else { (low, [low + 0.002 * travel, low + 0.45 * travel]) };
                let toward = if above { -travel } else { travel };
                places.iter().map(move |place| {
                    let shape = Shape { name: "stop_rad", unit: "rad", value: from + toward * place, bounds };
                    let told = Told::new("stiffness_nm_per_rad", "N m/rad", 0).positive();
                    let reshape: fn(&Form, &[f64]) -> Vec<Column> = if above {
                        |form, shape| vec![Column::Stop { joint: form.joint.unwrap_or(0), from: shape[0], above: true }]
                    } else {
                        |form, shape| vec![Column::Stop { joint: form.joint.unwrap_or(0), from: shape[0], above: false }]
                    };
                    Form::new(&CAUSE, Some(j), vec![], vec![told]).shaped(vec![shape], reshape)
                })
            };
            forms(true).chain(forms(false)).collect()
        })
    },
};
