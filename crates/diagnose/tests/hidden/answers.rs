//! Whole answers, word by word and number by number, as they were when they were last looked at.
//!
//! `answers.json` holds what a diagnosis says of some short recordings, right or wrong: whether it is right the other files ask. A
//! change of this table is to be looked at; `NDOF_WRITE_ANSWERS=1 cargo test --release -p ndof-diagnose --test hidden answers` writes it anew.

use super::stored::held;
use ndof_challenge::{Case, Hidden, Plant, make};
use ndof_diagnose::{Baseline, HeldOut, Options, Part, Pictures, Status, diagnose_with_pictures};
use rayon::prelude::*;
use serde_json::{Value, json};

const PATH: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/hidden/answers.json");

/// By how much numbers may differ: searches stop at some 1e-5 of a parameter, wherever round-off leads them.
const RELATIVE: f64 = 1e-3;

struct Question {
    seed: u64,
    name: &'static str,
    plant: Plant,
    hidden: &'static [(&'static str, f64)],
    trials: usize,
    /// Whether laws have forms that the registry does not know.
    other: bool,
    options: Options,
    /// What is given of the mass, times its true value.
    mass: Option<(f64, Status)>,
}

fn questions() -> Vec<Question> {
    let ask = |seed, name, plant, hidden, trials| Question { seed, name, plant, hidden, trials, other: false, options: Options::default(), mass: None };
    let with = |question: Question, options: Options| Question { options, ..question };
    vec![
        ask(700, "nothing", Plant::Force, &[], 2),
        ask(701, "friction", Plant::Force, &[("coulomb-friction", 0.5)], 1),
        Question { mass: Some((1.0, Status::Fixed)), ..ask(702, "more mass than the baseline has", Plant::Force, &[("added-mass", 0.5)], 2) },
        ask(703, "what no registry has", Plant::Force, &[("x-quadratic-damping", 0.6)], 2),
        ask(704, "a hysteresis and a filter", Plant::Planar, &[("hysteresis", 0.4), ("channel-filter", 0.5)], 2),
        ask(705, "an arm that drifts", Plant::Planar, &[("posture-drift", 0.6)], 3),
        ask(706, "a reflex", Plant::Planar, &[("reflex-delay", 0.6)], 2),
        ask(707, "a tremor", Plant::Wrist, &[("periodic-disturbance", 0.6)], 2),
        ask(708, "an imposed angle", Plant::Motion, &[("viscoelastic", 0.6)], 2),
        ask(709, "a knock", Plant::Mass, &[("transient-disturbance", 0.6)], 2),
        with(
            ask(710, "a sensor that is late, seen in part, and what to do next", Plant::Planar, &[("measurement-delay", 0.6)], 2),
            Options { band_hz: Some((0.5, 8.0)), held_out: HeldOut::Time(9.0, 12.0), tolerance: 0.02, seed: 3, plan: true, ..Options::default() },
        ),
        ask(711, "play", Plant::Force, &[("dead-zone", 0.5)], 1),
        Question { mass: Some((1.2, Status::Nominal)), ..ask(712, "a mass that is wrong", Plant::Planar, &[], 2) },
        ask(713, "friction, and what no registry has", Plant::Force, &[("coulomb-friction", 0.3), ("x-quadratic-damping", 0.2)], 2),
        Question { other: true, ..ask(719, "a filter of another form", Plant::Force, &[("channel-filter", 0.8)], 2) },
    ]
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
    let made = make(&Case { plant, hidden, other: question.other, background: false, trials, duration_s: 12.0, seed: question.seed, command: (1.0, 1.0) });
    let given =
        |(times, status): (f64, Status)| Part { value: made.mass.iter().map(|row| row.iter().map(|m| times * m).collect()).collect(), status, symmetric: true };
    let baseline = question.mass.map(|mass| Baseline { mass: Some(given(mass)), ..Baseline::default() });
    let found = diagnose_with_pictures(&made.recordings, &made.ports, &question.options, baseline.as_ref(), &mut |_| {});
    match found {
        Ok((diagnosis, pictures)) => json!({ "of": question.name, "diagnosis": diagnosis, "pictures": outline(&pictures) }),
        Err(error) => json!({ "of": question.name, "refused": error.to_string() }),
    }
}

#[test]
fn answers_are_as_they_were() {
    let questions = questions();
    let found: Vec<Value> = questions.par_iter().map(answer).collect();
    held(&json!(found), PATH, RELATIVE, "NDOF_WRITE_ANSWERS");
}
