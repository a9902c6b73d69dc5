//! Whole answers, word by word and number by number, as they were when they were last looked at.
//!
//! `answers/` holds what a diagnosis says of some short recordings, right or wrong: whether it is right the other files ask. A
//! change of this table is to be looked at; `NDOF_WRITE_ANSWERS=1 cargo test --release -p ndof-diagnose --test hidden answers` writes it anew.

use super::stored::{held, nudge};
use ndof_challenge::{Case, Hidden, Plant, make};
use ndof_diagnose::{Baseline, HeldOut, Options, Part, Pictures, Status, diagnose_with_pictures};
use serde_json::{Value, json};

/// By how much numbers may differ: searches stop at some 1e-5 of a parameter, wherever round-off leads them.
const RELATIVE: f64 = 1e-3;

struct Question {
    seed: u64,
    plant: Plant,
    hidden: &'static [(&'static str, f64)],
    trials: usize,
    /// Whether laws have forms that the registry does not know.
    other: bool,
    options: Options,
    /// What is given of the mass, times its true value.
    mass: Option<(f64, Status)>,
}

fn ask(seed: u64, plant: Plant, hidden: &'static [(&'static str, f64)], trials: usize) -> Question {
    Question { seed, plant, hidden, trials, other: false, options: Options::default(), mass: None }
}

/// Of each picture its outline: the size of its lines, and a number in each.
fn outline(pictures: &Pictures) -> Value {
    let lines = |lines: &[Vec<f64>]| -> Value {
        let rms = |line: &Vec<f64>| (line.iter().map(|x| x * x).sum::<f64>() / line.len() as f64).sqrt();
        lines.iter().map(|line| json!([line.len(), rms(line), line.get(line.len() / 3)])).collect()
    };
    json!({
        "from": [pictures.start_s, pictures.sample_rate_hz, pictures.band_hz[0], pictures.band_hz[1]],
        "names": [pictures.outputs, pictures.axes, pictures.output_unit, pictures.units],
        "measured": lines(&pictures.measured),
        "baseline": lines(&pictures.baseline),
        "extended": lines(&pictures.extended),
        "position": lines(&pictures.position),
        "velocity": lines(&pictures.velocity),
        "missing": lines(&pictures.missing),
        "explained": lines(&pictures.explained),
    })
}

fn answer(question: &Question) -> Value {
    let hidden = question.hidden.iter().map(|&(name, severity)| Hidden { name, severity }).collect();
    let (plant, trials) = (question.plant, question.trials);
    let mut made = make(&Case { plant, hidden, other: question.other, background: false, trials, duration_s: 12.0, seed: question.seed, command: (1.0, 1.0) });
    for recording in &mut made.recordings {
        let names: Vec<String> = recording.channels().iter().map(|c| c.name.clone()).collect();
        for name in names {
            let mut at = 0;
            let nudged = |x: f64| {
                at += 1;
                x * nudge(at)
            };
            recording.map_channel(&name, nudged).expect("a channel of it");
        }
    }
    let given =
        |(times, status): (f64, Status)| Part { value: made.mass.iter().map(|row| row.iter().map(|m| times * m).collect()).collect(), status, symmetric: true };
    let baseline = question.mass.map(|mass| Baseline { mass: Some(given(mass)), ..Baseline::default() });
    let found = diagnose_with_pictures(&made.recordings, &made.ports, &question.options, baseline.as_ref(), &mut |_| {});
    match found {
        Ok((diagnosis, pictures)) => json!({ "diagnosis": diagnosis, "pictures": outline(&pictures) }),
        Err(error) => json!({ "refused": error.to_string() }),
    }
}

/// A test for each question, and a file for each answer.
macro_rules! answers {
    ($($name:ident: $question:expr;)*) => { $(
        #[test]
        fn $name() {
            held(&answer(&$question), concat!(env!("CARGO_MANIFEST_DIR"), "/tests/hidden/answers/", stringify!($name), ".json"), RELATIVE, "NDOF_WRITE_ANSWERS");
        }
    )* };
}

answers! {
    nothing: ask(700, Plant::Force, &[], 2);
    friction: ask(701, Plant::Force, &[("coulomb-friction", 0.5)], 1);
    more_mass_than_the_baseline_has: Question { mass: Some((1.0, Status::Fixed)), ..ask(702, Plant::Force, &[("added-mass", 0.5)], 2) };
    what_no_registry_has: ask(703, Plant::Force, &[("x-quadratic-damping", 0.6)], 2);
    a_hysteresis_and_a_filter: ask(704, Plant::Planar, &[("hysteresis", 0.4), ("channel-filter", 0.5)], 2);
    an_arm_that_drifts: ask(705, Plant::Planar, &[("posture-drift", 0.6)], 3);
    a_reflex: ask(706, Plant::Planar, &[("reflex-delay", 0.6)], 2);
    a_tremor: ask(707, Plant::Wrist, &[("periodic-disturbance", 0.6)], 2);
    an_imposed_angle: ask(708, Plant::Motion, &[("viscoelastic", 0.6)], 2);
    a_knock: ask(709, Plant::Mass, &[("transient-disturbance", 0.6)], 2);
    a_sensor_that_is_late_seen_in_part_and_what_to_do_next: Question {
        options: Options { band_hz: Some((0.5, 8.0)), held_out: HeldOut::Time(9.0, 12.0), tolerance: 0.02, seed: 3, plan: true, ..Options::default() },
        ..ask(710, Plant::Planar, &[("measurement-delay", 0.6)], 2)
    };
    play: ask(711, Plant::Force, &[("dead-zone", 0.5)], 1);
    a_mass_that_is_wrong: Question { mass: Some((1.2, Status::Nominal)), ..ask(712, Plant::Planar, &[], 2) };
    friction_and_what_no_registry_has: ask(713, Plant::Force, &[("coulomb-friction", 0.3), ("x-quadratic-damping", 0.2)], 2);
    a_filter_of_another_form: Question { other: true, ..ask(719, Plant::Force, &[("channel-filter", 0.8)], 2) };
}
