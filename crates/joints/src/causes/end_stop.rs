//! A stop within the movement.

use super::{Card, Form, JointCause, Shape, Told, each_joint, geometric};
use crate::column::Column;
use std::f64::consts::TAU;

pub(super) static CAUSE: JointCause = JointCause {
    card: Card {
        name: "end-stop",
        what: "a stop that the joint runs into, with a damping of its own where the data show it",
        equation: "τ = k (q − q_stop) beyond the stop, or k (q − q_stop + t q̇) as long as that pushes",
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
            // From a sample, below which it is hardly seen, to where it is of the speed as much as of the way.
            let times = [1.0 / scene.rate_hz, 1.0 / (TAU * scene.joints[j].pace_hz)];
            let told = || Told::new("stiffness_nm_per_rad", "N m/rad", 0).positive();
            let mut forms = Vec::new();
            for (above, from, toward) in [(true, high, -travel), (false, low, travel)] {
                let mut bounds = [from + toward * 0.002, from + toward * 0.45];
                bounds.sort_by(f64::total_cmp);
                let place = |share: f64| Shape { name: "stop_rad", unit: "rad", value: from + toward * share, bounds };
                let reshape = if above { above_it } else { below_it };
                forms.extend(places.iter().map(|share| Form::new(&CAUSE, Some(j), vec![], vec![told()]).shaped(vec![place(*share)], reshape)));
                for share in &places {
                    // Two between the ends, of which neither is another form.
                    for time in if times[0] < times[1] { geometric(times[0], times[1], 4)[1..3].to_vec() } else { vec![] } {
                        let shapes = vec![place(*share), Shape { name: "ahead_s", unit: "s", value: time, bounds: times }];
                        forms.push(Form::new(&CAUSE, Some(j), vec![], vec![told()]).shaped(shapes, reshape));
                    }
                }
            }
            forms
        })
    },
};

fn above_it(form: &Form, shape: &[f64]) -> Vec<Column> {
    stop(form, shape, true)
}

fn below_it(form: &Form, shape: &[f64]) -> Vec<Column> {
    stop(form, shape, false)
}

fn stop(form: &Form, shape: &[f64], above: bool) -> Vec<Column> {
    vec![Column::Stop { joint: form.joint.unwrap_or(0), from: shape[0], above, ahead_s: shape.get(1).copied().unwrap_or(0.0) }]
}
