//! A base that does not stand as the file says.

use super::{Card, Form, JointCause, Told};
use crate::column::Column;

pub(super) static CAUSE: JointCause = JointCause {
    card: Card {
        name: "base-tilt",
        what: "a base that is not mounted as the file says, or a first joint whose zero is elsewhere: weight pulls elsewhere",
        equation: "g' = g + g × θ",
        side: "environment",
        look_alikes: &["torque-offset", "angle-offset", "link-parameters"],
        next_experiment: "a turn of the first joint by half a turn: what the base does changes its sign",
    },
    forms: |scene| {
        let g = scene.chain.gravity();
        let size = (g[0] * g[0] + g[1] * g[1] + g[2] * g[2]).sqrt();
        // Turning about gravity itself changes nothing, nor any turn where there is none.
        let axes: Vec<usize> = (0..3).filter(|k| g[*k].abs() < 0.999 * size).collect();
        if axes.is_empty() {
            return vec![];
        }
        let told = axes.iter().enumerate().map(|(i, k)| Told::new(format!("tilt_{}_rad", ["x", "y", "z"][*k]), "rad", i)).collect();
        vec![Form::new(&CAUSE, None, axes.iter().map(|axis| Column::Tilt { axis: *axis, at: [0.0; 3] }).collect(), told)]
    },
};
