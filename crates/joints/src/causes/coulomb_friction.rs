//! Dry friction, with or without Stribeck's excess at rest.

use super::{Card, Form, JointCause, Shape, Told, each_joint, geometric};
use crate::column::Column;
use ndof_models::robot::Robot;
use std::f64::consts::TAU;

/// Time by which dry friction turns ahead where it is a soft constraint, five times as soft as MuJoCo's by default (s).
const SOFTEST_S: f64 = 0.05;

/// How much firmer or looser than the file's a soft constraint is looked for.
const FIRMER: f64 = 4.0;

/// Name and unit of the speed over which the sign turns.
const TURNING: (&str, &str) = ("turning_speed_rad_per_s", "rad/s");

/// Dry friction as a soft constraint.
fn soft(form: &Form, shape: &[f64]) -> Column {
    Column::Soft { joint: form.joint.unwrap_or(0), ahead_s: shape[0], speed: shape[1] }
}

/// Dry friction whose sign turns over a speed.
fn turn(form: &Form, shape: &[f64]) -> Column {
    Column::Turn { joint: form.joint.unwrap_or(0), speed: shape[0] }
}

/// What it is more than one that turns at once.
fn less_the_sign(turn: Column) -> Column {
    Column::Otherwise(Box::new(turn))
}

/// What another level of the file's soft constraint adds.
fn firmer(form: &Form, shape: &[f64]) -> Column {
    match form.columns[0] {
        Column::Soft { joint, ahead_s, speed: own } | Column::Firmer { joint, ahead_s, own, .. } => Column::Firmer { joint, ahead_s, own, speed: shape[0] },
        ref other => other.clone(),
    }
}

pub(super) static CAUSE: JointCause = JointCause {
    card: Card {
        name: "coulomb-friction",
        what: "dry friction, with Stribeck's higher level near rest where the data show it",
        equation: "τ = [F_c + (F_s − F_c) exp(−(q̇/v_s)²)] sign q̇, or F_c tanh(q̇/v_t) where the sign turns over a speed, or F_c max(−1, min(1, (q̇ + t_a q̈)/v_t)) of a simulator with a soft constraint",
        side: "joint",
        look_alikes: &["gear-hysteresis", "viscous-friction", "load-friction"],
        next_experiment: "slow and fast stretches over the same path: dry friction is the same in both",
    },
    forms: |scene| {
        each_joint(scene, |j| {
            let file = scene.chain.joints().coulomb[j];
            let level = || Told::new("level_nm", "N m", 0).on_top_of(file).positive();
            let scale = &scene.joints[j];
            let own = if file > 0.0 { scene.own_turn(j) } else { Column::Sign(j) };
            let mut forms = vec![Form::new(&CAUSE, Some(j), vec![own.clone()], vec![level()])];
            // The speed over which a soft constraint turns grows with its level.
            if let Column::Soft { speed, .. } = own
                && speed > scale.speed_noise
            {
                let bounds = [speed / FIRMER, speed * FIRMER];
                forms.extend(forms[0].clone().over(TURNING, bounds, 4, |form, shape| vec![firmer(form, shape)]));
            }
            // From what the noise over which the sign is smoothed hides to an eighth of a period, where it is of the acceleration as much as of the speed.
            let times = [scale.speed_noise / scale.speed / TAU / scale.pace_hz, SOFTEST_S.min(0.125 / scale.pace_hz)];
            let speeds = [scale.speed_noise, 0.25 * scale.speed];
            // A file's friction that turns at once where the robot's does not is a third way: as much as turns so, with the level that the file has.
            let turns_at_once = matches!(own, Column::Sign(_));
            let otherwise = file > 0.0 && turns_at_once;
            let turning = || if otherwise { level().on_top_of(0.0) } else { level() };
            for time in if turns_at_once { geometric(times[0], times[1], 3) } else { vec![] } {
                for speed in geometric(speeds[0], speeds[1], 3) {
                    let shapes = vec![
                        Shape { name: "ahead_s", unit: "s", value: time, bounds: times },
                        Shape { name: TURNING.0, unit: TURNING.1, value: speed, bounds: speeds },
                    ];
                    let form = Form::new(&CAUSE, Some(j), vec![], vec![turning()]);
                    forms.push(
                        form.shaped(
                            shapes,
                            if otherwise { |form, shape| vec![less_the_sign(soft(form, shape))] } else { |form, shape| vec![soft(form, shape)] },
                        ),
                    );
                }
            }
            // From where the noise of the rate hides it no more to where it is a viscous friction that thins.
            let bounds = [2.0 * scale.speed_noise, 0.25 * scale.speed];
            let turned = |told: Told| Form::new(&CAUSE, Some(j), vec![], vec![told]);
            forms.extend(turned(level()).over(TURNING, bounds, 5, |form, shape| vec![turn(form, shape)]));
            if otherwise {
                forms.extend(turned(turning()).over(TURNING, bounds, 5, |form, shape| vec![less_the_sign(turn(form, shape))]));
            }
            // From where the sign is certain, three deviations of the noise to each side, to where the excess is no longer one near rest.
            let bounds = [6.0 * scale.speed_noise, 0.5 * scale.speed];
            let at_rest = Told { name: "stribeck_level_nm".to_owned(), parts: vec![(0, 1.0), (1, 1.0)], ..level() };
            // An excess: what is less at rest than in motion is no dry friction.
            let excess = Told { hidden: true, ..Told::new("excess_nm", "N m", 1).positive() };
            let form = Form::new(&CAUSE, Some(j), vec![], vec![level(), at_rest, excess]);
            forms.extend(form.over(("stribeck_velocity_rad_per_s", "rad/s"), bounds, 5, |form, shape| {
                let joint = form.joint.unwrap_or(0);
                vec![Column::Sign(joint), Column::Stribeck { joint, velocity: shape[0] }]
            }));
            forms
        })
    },
};
