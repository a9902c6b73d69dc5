//! Cables, hoses and springs across a joint.

use super::{Card, Form, JointCause, Told, each_joint};
use crate::column::Column;
use std::f64::consts::TAU;

pub(super) static CAUSE: JointCause = JointCause {
    card: Card {
        name: "cable-force",
        what: "a torque that follows the angle: cables, hoses, a spring",
        equation: "τ = k (q − q₀), or c₁ u + c₂ u² + c₃ u³, u the angle from the middle over half its range",
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
            // Together with the file's own it is one spring: its stiffness, and what it pulls at nought over that.
            let ([stiffness, rest], middle) = (scene.chain.springs()[j], 0.5 * (low + high));
            let (spring, pulls) = (vec![(1, 1.0 / half)], vec![(0, -1.0), (1, middle / half)]);
            // A joint that turns is at most a turn from where its spring rests: what pulls alike everywhere is an offset.
            let turn = if scene.chain.slides(j) { f64::INFINITY } else { TAU };
            let anywhere = [f64::NEG_INFINITY, f64::INFINITY];
            // A file's spring that is not there rests nowhere.
            let (reach, some) = if stiffness > 0.0 { (anywhere, anywhere) } else { ([low - turn, high + turn], [0.0, f64::INFINITY]) };
            let at_rest =
                Told { file: stiffness * rest, parts: pulls, over: Some((stiffness, spring.clone())), ..Told::new("rest_rad", "rad", 0) }.within(reach);
            let spring = Told { file: stiffness, parts: spring, ..Told::new("spring_nm_per_rad", "N m/rad", 1) }.within(some);
            // What rests elsewhere pulls in the middle: as an offset of the sensor it would be a second cause.
            let powers = |most: i32| (1..=most).map(|power| Column::Power { joint: j, power }).collect::<Vec<_>>();
            let told = (0..3).map(|k| Told::new(format!("force_{}_nm", k + 1), "N m", k)).collect();
            let of_a_spring = [vec![Column::Constant(j)], powers(1)].concat();
            vec![Form::new(&CAUSE, Some(j), of_a_spring, vec![spring, at_rest]), Form::new(&CAUSE, Some(j), powers(3), told)]
        })
    },
};
