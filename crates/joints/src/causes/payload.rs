//! Something heavy at the flange.

use super::{Card, Form, JointCause, Told};
use crate::column::Column;
use ndof_devices::TERMS_OF_A_LINK;

pub(super) static CAUSE: JointCause = JointCause {
    card: Card {
        name: "payload",
        what: "a mass at the flange that the file does not have",
        equation: "τ = Jᵀ m (ẍ − g)",
        side: "environment",
        look_alikes: &["link-parameters", "torque-scale", "motor-inertia"],
        next_experiment: "the same movement without the tool",
    },
    forms: |scene| {
        let Some(last) = scene.joints.len().checked_sub(1) else { return vec![] };
        let mass = || Told::new("mass_kg", "kg", 0).positive();
        let at_tip = Column::Body { link: last, parts: point(scene.chain.tip()) };
        let told = ["x", "y", "z"].iter().enumerate().map(|(k, axis)| Told::new(format!("moment_{axis}_kg_m"), "kg m", k + 1));
        vec![
            Form::new(&CAUSE, None, vec![at_tip], vec![mass()]),
            Form::new(&CAUSE, None, (0..4).map(|k| Column::term(last, k)).collect(), std::iter::once(mass()).chain(told).collect()),
        ]
    },
};

/// Inertial parameters of a point of 1 kg.
pub(crate) fn point([x, y, z]: [f64; 3]) -> [f64; TERMS_OF_A_LINK] {
    [1.0, x, y, z, y * y + z * z, -x * y, x * x + z * z, -x * z, -y * z, x * x + y * y]
}
