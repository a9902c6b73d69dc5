//! Whole answers, word by word and number by number, as they were when they were last looked at.
//!
//! `answers.json` holds what a diagnosis says of a dozen short recordings, right or wrong: whether it is right the other files ask. A
//! change of this table is to be looked at; `NDOF_WRITE_ANSWERS=1 cargo test --release -p ndof-diagnose --test hidden answers` writes it anew.

use ndof_challenge::{Case, Hidden, Plant, make};
use ndof_diagnose::{Baseline, HeldOut, Options, Part, Pictures, Status, diagnose_with_pictures};
use rayon::prelude::*;
use serde_json::{Value, json};

const PATH: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/hidden/answers.json");

/// By how much numbers may differ: searches stop at some 1e-5 of a parameter, wherever round-off leads them.
const RELATIVE: f64 = 1e-3;

/// Below this a number is zero; probabilities of chance are, mostly.
const ZERO: f64 = 1e-9;

struct Question {
    name: &'static str,
    plant: Plant,
    hidden: &'static [(&'static str, f64)],
    trials: usize,
    options: Options,
    known_mass: bool,
}

fn questions() -> Vec<Question> {
    let ask = |name, plant, hidden, trials| Question { name, plant, hidden, trials, options: Options::default(), known_mass: false };
    let with = |question: Question, options: Options| Question { options, ..question };
    vec![
        ask("nothing", Plant::Force, &[], 2),
        ask("friction", Plant::Force, &[("coulomb-friction", 0.5)], 1),
        Question { known_mass: true, ..ask("more mass than the baseline has", Plant::Force, &[("added-mass", 0.5)], 2) },
        ask("what no registry has", Plant::Force, &[("x-quadratic-damping", 0.6)], 2),
        ask("a hysteresis and a filter", Plant::Planar, &[("hysteresis", 0.4), ("channel-filter", 0.5)], 2),
        ask("an arm that drifts", Plant::Planar, &[("posture-drift", 0.6)], 3),
        ask("a reflex", Plant::Planar, &[("reflex-delay", 0.6)], 2),
        ask("a tremor", Plant::Wrist, &[("periodic-disturbance", 0.6)], 2),
        ask("an imposed angle", Plant::Motion, &[("viscoelastic", 0.6)], 2),
        ask("a knock", Plant::Mass, &[("transient-disturbance", 0.6)], 2),
        with(
            ask("a sensor that is late, seen in part, and what to do next", Plant::Planar, &[("measurement-delay", 0.6)], 2),
            Options { band_hz: Some((0.5, 8.0)), held_out: HeldOut::Time(9.0, 12.0), tolerance: 0.02, seed: 3, plan: true, ..Options::default() },
        ),
        ask("play", Plant::Force, &[("dead-zone", 0.5)], 1),
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

fn answer(number: usize, question: &Question) -> Value {
    let hidden = question.hidden.iter().map(|&(name, severity)| Hidden { name, severity }).collect();
    let (plant, trials) = (question.plant, question.trials);
    let made = make(&Case { plant, hidden, other: false, background: false, trials, duration_s: 12.0, seed: 700 + number as u64, command: (1.0, 1.0) });
    let part = Part { value: made.mass.clone(), status: Status::Fixed, symmetric: true };
    let baseline = Baseline { mass: question.known_mass.then_some(part), ..Baseline::default() };
    let found = diagnose_with_pictures(&made.recordings, &made.ports, &question.options, question.known_mass.then_some(&baseline), &mut |_| {});
    match found {
        Ok((diagnosis, pictures)) => json!({ "of": question.name, "diagnosis": diagnosis, "pictures": outline(&pictures) }),
        Err(error) => json!({ "of": question.name, "refused": error.to_string() }),
    }
}

/// With six digits of each number.
fn rounded(value: Value) -> Value {
    match value {
        Value::Number(number) => number.as_f64().map_or(Value::Null, |x| json!(format!("{x:.5e}").parse::<f64>().expect("a number"))),
        Value::Array(values) => values.into_iter().map(rounded).collect(),
        Value::Object(entries) => Value::Object(entries.into_iter().map(|(key, value)| (key, rounded(value))).collect()),
        other => other,
    }
}

/// A text without its numbers, and these.
fn apart(text: &str) -> (String, Vec<f64>) {
    let (mut words, mut numbers) = (String::new(), Vec::new());
    let mut rest = text;
    while let Some(start) = rest.find(|c: char| c.is_ascii_digit()) {
        words += &rest[..start];
        words.push('#');
        let end = rest[start..].find(|c: char| !(c.is_ascii_digit() || c == '.')).map_or(rest.len(), |end| start + end);
        // A full stop behind a number ends the sentence.
        let number = rest[start..end].trim_end_matches('.');
        numbers.push(number.parse().expect("digits"));
        rest = &rest[start + number.len()..];
    }
    (words + rest, numbers)
}

fn close(found: f64, stored: f64, relative: f64) -> bool {
    (found - stored).abs() <= relative * found.abs().max(stored.abs()) + ZERO
}

fn compare(found: &Value, stored: &Value, place: &str) {
    match (found, stored) {
        (Value::Number(a), Value::Number(b)) => {
            let (a, b) = (a.as_f64().expect("a number"), b.as_f64().expect("a number"));
            assert!(close(a, b, RELATIVE), "{place}: {a}, was {b}");
        }
        // Numbers in sentences are rounded to two or three digits.
        (Value::String(a), Value::String(b)) => {
            let ((a_words, a_numbers), (b_words, b_numbers)) = (apart(a), apart(b));
            let alike = a_numbers.iter().zip(&b_numbers).all(|(a, b)| close(*a, *b, 0.1));
            assert!(a_words == b_words && alike, "{place}: \"{a}\", was \"{b}\"");
        }
        (Value::Array(a), Value::Array(b)) => {
            assert_eq!(a.len(), b.len(), "{place}: {a:?}, was {b:?}");
            a.iter().zip(b).enumerate().for_each(|(k, (a, b))| compare(a, b, &format!("{place}[{k}]")));
        }
        (Value::Object(a), Value::Object(b)) => {
            assert!(a.keys().eq(b.keys()), "{place}: {:?}, was {:?}", a.keys(), b.keys());
            a.iter().zip(b.values()).for_each(|((key, a), b)| compare(a, b, &format!("{place}.{key}")));
        }
        (a, b) => assert_eq!(a, b, "{place}"),
    }
}

#[test]
fn answers_are_as_they_were() {
    let questions = questions();
    let found: Vec<Value> = questions.par_iter().enumerate().map(|(number, question)| answer(number, question)).collect();
    let text = serde_json::to_string_pretty(&rounded(json!(found))).expect("text");
    if std::env::var_os("NDOF_WRITE_ANSWERS").is_some() {
        std::fs::write(PATH, text.clone() + "\n").expect("written");
    }
    let found: Value = serde_json::from_str(&text).expect("what was written");
    let stored: Value = serde_json::from_str(&std::fs::read_to_string(PATH).expect("the table")).expect("a table");
    compare(&found, &stored, "");
}
