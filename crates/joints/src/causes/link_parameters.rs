//! Mass, centre of mass and inertia of a link.

use super::{Card, Form, JointCause, Told, each_joint};
use crate::column::Column;
use ndof_devices::TERMS_OF_A_LINK;

/// Names of the inertial parameters of a body, in their order.
pub(crate) const NAMES: [&str; TERMS_OF_A_LINK] =
    ["mass_kg", "moment_x_kg_m", "moment_y_kg_m", "moment_z_kg_m", "xx_kg_m2", "xy_kg_m2", "yy_kg_m2", "xz_kg_m2", "yz_kg_m2", "zz_kg_m2"];

/// Of the k-th of them.
pub(crate) fn unit_of(k: usize) -> &'static str {
    ["kg", "kg m", "kg m^2"][if k == 0 { 0 } else { 1 + usize::from(k > 3) }]
}

pub(super) static CAUSE: JointCause = JointCause {
    card: Card {
        name: "link-parameters",
        what: "mass, centre of mass or inertia of a link that are not what the file says, in the combinations that the data fix",
        equation: "τ = Y(q, q̇, q̈) Δπ",
        side: "link",
        look_alikes: &["payload", "torque-scale", "motor-inertia"],
        next_experiment: "a movement designed for it (`ndof design --robot`)",
    },
    forms: |scene| {
        let inertial = scene.chain.inertial_parameters();
        each_joint(scene, |j| {
            let own: [f64; TERMS_OF_A_LINK] = std::array::from_fn(|k| inertial[TERMS_OF_A_LINK * j + k]);
            let mut forms = Vec::new();
            if own.iter().any(|x| *x != 0.0) {
                let scaled = Column::Body { link: j, parts: own };
                forms.push(Form::new(&CAUSE, Some(j), vec![scaled], vec![Told::new("mass_scale", "", 0).on_top_of(1.0).positive()]));
            }
            let told =
                |terms: &[usize]| terms.iter().enumerate().map(|(k, term)| Told::new(format!("change_of_{}", NAMES[*term]), unit_of(*term), k)).collect();
            for terms in [vec![0, 1, 2, 3], (0..TERMS_OF_A_LINK).collect::<Vec<_>>()] {
                forms.push(Form::new(&CAUSE, Some(j), terms.iter().map(|t| Column::term(j, *t)).collect(), told(&terms)));
            }
            forms
        })
    },
};
