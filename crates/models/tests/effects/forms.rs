//! Every form that a search tries, written out: what it may be, where the search starts, what it does to a motion and what it is called.
//!
//! `reference/forms.txt` holds them for a planar arm, a wrist whose motion is imposed and a slow actuator with given matrices. The laws
//! themselves are held by the oracle beside this; a change of this table is to be looked at: `NDOF_WRITE_FORMS=1 cargo test --release -p
//! ndof-models --test effects` writes it anew.

use super::planar;
use ndof_models::Motion;
use ndof_models::effects::{Action, EFFECTS, Evidence, Form, Knob, Matrix, Scale, Value};
use num_complex::Complex64;
use std::fmt::Write;

/// Six digits: what a compiler may order otherwise does not show.
fn number(x: f64) -> String {
    if x != 0.0 && x.abs() < 1e-14 { "~0".to_owned() } else { format!("{x:.5e}") }
}

fn numbers(x: impl IntoIterator<Item = f64>) -> String {
    x.into_iter().map(number).collect::<Vec<_>>().join(" ")
}

fn value(value: &Value) -> String {
    match value {
        Value::Flag(flag) => flag.to_string(),
        Value::Number(x) => number(*x),
        Value::Text(text) => format!("\"{text}\""),
        Value::Matrix(rows) => rows.iter().map(|row| format!("[{}]", numbers(row.iter().copied()))).collect(),
    }
}

fn wrist() -> Scale {
    Scale {
        position: vec![0.05],
        centre: vec![0.0],
        velocity: vec![0.7],
        effort: vec![0.3],
        time_s: 0.7,
        duration_s: 30.0,
        mass: vec![vec![0.003]],
        stiffness: vec![vec![1.5]],
        rotational: true,
        motion_imposed: true,
        effort_is_command: false,
        effort_names: vec!["torque".to_owned()],
        motion_names: vec!["angle".to_owned()],
        ..planar()
    }
}

fn actuator() -> Scale {
    let mut nominal = Vec::new();
    for (matrix, size) in [(Matrix::Mass, 2.0), (Matrix::Damping, 14.0), (Matrix::Stiffness, 400.0)] {
        for (i, j) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
            nominal.push((matrix, i, j, if i == j { size } else { -0.1 * size }));
        }
    }
    let held = nominal.clone();
    Scale { time_s: 12.0, spring: false, effort_is_command: false, nominal, held, ..planar() }
}

/// Between the ends, where the search takes its steps.
fn middle(knob: &Knob) -> f64 {
    if knob.log { (knob.lo * knob.hi).sqrt() } else { 0.4 * knob.lo + 0.6 * knob.hi }
}

fn describe(form: &Form, axes: usize, out: &mut String) -> std::fmt::Result {
    writeln!(
        out,
        "  {} | side {:?}, axis {:?}, cost {}, signs {:?}, floor {}",
        form.label,
        form.side,
        form.axis,
        form.cost(),
        form.signs,
        numbers([form.floor.0, form.floor.1])
    )?;
    for knob in &form.knobs {
        writeln!(out, "    knob {} log {} telling {}", numbers([knob.lo, knob.hi]), knob.log, knob.telling)?;
    }
    for point in &form.grid {
        if !point.is_empty() {
            writeln!(out, "    start {}", numbers(point.iter().copied()))?;
        }
    }
    let knobs: Vec<f64> = form.knobs.iter().map(middle).collect();
    let coefficients: Vec<f64> = (0..form.signs.len()).map(|k| 1.5 - 0.4 * k as f64).collect();
    for (name, named) in (form.naming)(&knobs, &coefficients) {
        writeln!(out, "    called {name} = {}", value(&named))?;
    }
    let at = [0.8, 5.0].map(|hz| Complex64::new(0.0, std::f64::consts::TAU * hz));
    let operator = |name: &str, operator: &dyn Fn(Complex64) -> Complex64, out: &mut String| {
        let [low, high] = at.map(operator);
        writeln!(out, "    {name} {}", numbers([low.re, low.im, high.re, high.im]))
    };
    match &form.action {
        Action::Force { law, exact, tangent } => {
            for term in 0..coefficients.len() {
                let unit: Vec<f64> = (0..coefficients.len()).map(|k| if k == term { 1.0 } else { 0.0 }).collect();
                let law = law(&knobs, &unit);
                writeln!(out, "    law {term}: states {}, delay {}", law.states(), number(law.delay_s()))?;
                for (time_s, position, velocity) in [(0.3, [0.011, -0.004], [0.02, 0.03]), (17.0, [-0.007, 0.009], [-0.2, -0.03])] {
                    let delayed = (position.map(|x| 0.6 * x), velocity.map(|v| -0.5 * v));
                    let motion = Motion {
                        time_s,
                        position: &position[..axes],
                        velocity: &velocity[..axes],
                        delayed_position: &delayed.0[..axes],
                        delayed_velocity: &delayed.1[..axes],
                    };
                    let states: Vec<f64> = (0..law.states()).map(|k| 0.002 * (1.0 + k as f64)).collect();
                    let (mut force, mut rates) = (vec![0.0; axes], vec![0.0; states.len()]);
                    law.evaluate(&motion, &states, &mut force, &mut rates);
                    writeln!(out, "      force {} | rates {} | fastest {}", numbers(force), numbers(rates), number(law.fastest_rate(&motion)))?;
                }
            }
            for (term, exact) in exact.iter().enumerate() {
                operator(&format!("exact {term}"), &|s| exact(s, &knobs), out)?;
            }
            if let Some(tangent) = tangent {
                operator("tangent", &|s| tangent(s, &knobs), out)?;
            }
        }
        Action::Entries { matrix, entries } => {
            for (i, j, weight) in entries {
                writeln!(out, "    entry {matrix:?} {i} {j} {}", number(*weight))?;
            }
        }
        Action::Effort(made) => operator("effort", &|s| made(s, &knobs), out)?,
        Action::Motion(made) => operator("motion", &|s| made(s, &knobs), out)?,
        Action::Series(made) => operator("series", &|s| made(s, &knobs), out)?,
        Action::Mix(made) => writeln!(out, "    mix {}", value(&Value::Matrix(made(&knobs))))?,
        Action::Clip => writeln!(out, "    clip")?,
    }
    Ok(())
}

fn table() -> Result<String, std::fmt::Error> {
    let mut out = String::new();
    for (name, scale) in [("planar arm, commanded", planar()), ("wrist, motion imposed", wrist()), ("slow actuator, given matrices", actuator())] {
        writeln!(out, "# {name}")?;
        for effect in EFFECTS {
            let forms = effect.forms(&scale);
            if !forms.is_empty() {
                writeln!(out, "{}", effect.name())?;
            }
            for form in &forms {
                describe(form, scale.axes(), &mut out)?;
            }
        }
    }
    writeln!(out, "# what a finding may be in truth: parameters and coefficients of this size, among all others, worth of its gain")?;
    let scale = planar();
    let names: Vec<&str> = EFFECTS.iter().map(|effect| effect.name()).collect();
    for effect in EFFECTS {
        let others: Vec<&str> = names.iter().copied().filter(|name| *name != effect.name()).collect();
        for among in [&[][..], &others] {
            for gain in [None, Some(0.0), Some(100.0)] {
                let mut last: &[&str] = &[];
                for power in -60..=60 {
                    let size = 10f64.powf(f64::from(power) / 10.0);
                    let parameters: Vec<(&str, f64)> = effect.card().parameters.iter().map(|p| (p.name, size)).collect();
                    let coefficients: [&[f64]; 1] = [&[1.0, size / scale.position[1]]];
                    let gain_worth = || gain;
                    let evidence =
                        Evidence { parameters: &parameters, coefficients: &coefficients, axis: Some(1), scale: &scale, beside: among, gain_worth: &gain_worth };
                    let found = effect.stands_for(&evidence);
                    if found != last {
                        writeln!(out, "{} from {size:.1e} among {}, gain {gain:?}: {found:?}", effect.name(), among.len())?;
                        last = found;
                    }
                }
            }
        }
    }
    Ok(out)
}

#[test]
fn every_form_is_as_the_table_has_it() {
    let (found, path) = (table().expect("text"), concat!(env!("CARGO_MANIFEST_DIR"), "/tests/reference/forms.txt"));
    if std::env::var_os("NDOF_WRITE_FORMS").is_some() {
        std::fs::write(path, &found).expect("written");
    }
    let stored = std::fs::read_to_string(path).expect("the table");
    for (k, (found, stored)) in found.lines().zip(stored.lines()).enumerate() {
        assert_eq!(found, stored, "line {} of {path}", k + 1);
    }
    assert_eq!(found.lines().count(), stored.lines().count());
}

#[test]
fn every_search_starts_where_the_form_makes_sense() {
    for scale in [planar(), wrist(), actuator()] {
        for effect in EFFECTS {
            let forms = effect.forms(&scale);
            let mut texts = Vec::new();
            for form in &forms {
                let of = format!("{} {} {:?}", effect.name(), form.label, form.axis);
                assert!(!form.label.is_empty() && !form.grid.is_empty(), "{of}");
                assert!(form.knobs.iter().all(|knob| knob.lo < knob.hi && (!knob.log || knob.lo > 0.0)), "{of}");
                let coefficients: Vec<f64> = form.signs.iter().map(|_| 0.0).collect();
                assert!(form.grid.iter().all(|start| start.len() == form.knobs.len() && form.admits(start, &coefficients)), "{of}: {:?}", form.grid);
                assert!(form.admits(&form.knobs.iter().map(middle).collect::<Vec<_>>(), &coefficients), "{of}");
                assert!(
                    !form.admits(&form.knobs.iter().map(|knob| 2.0 * knob.hi.abs() + 1.0).collect::<Vec<_>>(), &coefficients) || form.knobs.is_empty(),
                    "{of}"
                );
                let known: Vec<&str> = effect.card().parameters.iter().map(|p| p.name).collect();
                for (name, _) in (form.naming)(&form.grid[0], &coefficients) {
                    assert!(known.contains(&name), "{of} calls {name}, the card has {known:?}");
                }
                let mut text = String::new();
                describe(form, scale.axes(), &mut text).expect("text");
                assert!(!texts.contains(&text), "{of} twice");
                texts.push(text);
            }
        }
    }
}
