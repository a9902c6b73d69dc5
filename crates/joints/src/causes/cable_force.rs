//! Cables, hoses and springs across a joint.

use super::{Card, Form, JointCause, Told, each_joint};
use crate::column::Column;

pub(super) static CAUSE: JointCause = JointCause {
    card: Card {
        name: "cable-force",
        what: "a torque that follows the angle: cables, hoses, a spring",
        equation: "τ = c₁ u + c₂ u² + c₃ u³, u the angle from the middle over half its range",
        side: "joint",
        look_alikes: &["link-parameters", "base-tilt", "end-stop"],
        next_experiment: "the same posture of this joint with the others elsewhere: cables do not feel it, weights do",
    },
    forms: |scene| {
        each_joint(scene, |j| {
            let [low, high] = scene.joints[j].range;
            let half = 0.5 * (high - low);
            if half <= 0.0 {
                return vec![];
            }
            let spring = Told { parts: vec![(0, 1.0 / half)], ..Told::new("spring_nm_per_rad", "N m/rad", 0) };
            let powers = |most: i32| (1..=most).map(|power| Column::Power { joint: j, power }).collect::<Vec<_>>();
            let told = (0..3).map(|k| Told::new(format!("force_{}_nm", k + 1), "N m", k)).collect();
            vec![Form::new(&CAUSE, Some(j), powers(1), vec![spring]), Form::new(&CAUSE, Some(j), powers(3), told)]
        })
    },
};
