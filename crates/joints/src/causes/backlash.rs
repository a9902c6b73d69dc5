//! Play between motor and link.

use super::{Card, JointCause, Told, each_joint, gears};
use crate::deflection::Lets;
use std::f64::consts::TAU;

pub(super) static CAUSE: JointCause = JointCause {
    card: Card {
        name: "backlash",
        what: "play between an encoder on the motor's side and the link, which falls to the side to which it is loaded and stays where it lands",
        equation: "q_link = q − δ; τ_link = 0 while |δ| < g/2",
        side: "joint",
        look_alikes: &["joint-flexibility", "gear-hysteresis"],
        next_experiment: "a movement on which the load of this joint changes its sign often, or an encoder on the link",
    },
    forms: |scene| {
        each_joint(scene, |j| {
            let joint = &scene.joints[j];
            // A load that grows in a line turns a link over so wide a play in that time.
            let grows = TAU * joint.pace_hz * joint.torque / joint.inertia;
            gears(scene, j, &CAUSE, Lets::Play, |rate| grows / rate.powi(3) / 6.0, &Told::new("gap_rad", "rad", 0).positive())
        })
    },
};
