//! Every form that a search tries, written out: what it may be, where the search starts, what it does to a motion and what it is called.
//!
//! `reference/forms.txt` holds them for a planar arm, a wrist whose motion is imposed and a slow actuator with given matrices, and
//! how a simulation hides each effect. The laws themselves are held by the oracle beside this; a change of this table is to be looked at: `NDOF_WRITE_FORMS=1 cargo test --release -p
//! ndof-models --test effects` writes it anew.

use super::planar;
use ndof_models::Motion;
use ndof_models::effects::{Action, EFFECTS, Evidence, Form, Injection, Knob, Matrix, Parameters, Scale, Setting, Value, find};
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

/// Three angles of which some entries are given: an inertia, and stiffness that is held at nothing, once on one side of the diagonal only.
fn angles() -> Scale {
    let zero = |i, j| (Matrix::Stiffness, i, j, 0.0);
    Scale {
        position: vec![0.4, 0.09, 0.3],
        centre: vec![0.2, -0.1, 0.7],
        velocity: vec![1.1, 0.8, 0.9],
        effort: vec![4.0, 3.0, 2.0],
        mass: vec![vec![0.2, 0.01, 0.0], vec![0.01, 0.15, 0.0], vec![0.0, 0.0, 0.1]],
        stiffness: vec![vec![0.0, 0.0, 3.0], vec![0.0, 30.0, 0.0], vec![0.0, 0.0, 20.0]],
        rotational: true,
        effort_names: ["tau_a", "tau_b", "tau_c"].map(str::to_owned).to_vec(),
        motion_names: ["a", "b", "c"].map(str::to_owned).to_vec(),
        nominal: vec![(Matrix::Mass, 1, 1, 0.15), zero(0, 0), zero(0, 1), zero(1, 0), zero(0, 2), zero(1, 2)],
        held: vec![zero(2, 1)],
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
                for (time_s, position, velocity) in [(0.3, [0.011, -0.004, 0.3], [0.02, 0.03, -0.4]), (17.0, [-0.007, 0.009, -0.5], [-0.2, -0.03, 0.7])] {
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

/// How a simulation of two axes hides an effect: what its force is at some places, what its stage makes of a channel.
fn hidden(name: &str, parameters: &str, out: &mut String) -> std::fmt::Result {
    let parameters: Parameters = serde_json::from_str(parameters).expect("JSON");
    for axis in [Some(1), None] {
        let (mass, stiffness) = (vec![vec![2.0, 0.1], vec![0.2, 1.5]], vec![vec![400.0, -30.0], vec![-20.0, 300.0]]);
        let setting = Setting { axes: 2, axis, mass, stiffness, duration_s: 3.0, sample_rate_hz: 200.0, seed: 9 };
        write!(out, "{name} axis {axis:?}: ")?;
        match find(name).expect("an effect").inject(&parameters, &setting) {
            Err(error) => writeln!(out, "{error}")?,
            Ok(Injection::Mass(mass)) => writeln!(out, "mass {}", number(mass))?,
            Ok(Injection::Mixing(rows)) => writeln!(out, "mixing {}", value(&Value::Matrix(rows)))?,
            Ok(Injection::Parameter { name, value }) => writeln!(out, "parameter {name} {}", number(value))?,
            Ok(Injection::Stage(mut stage)) => {
                let channel = (0..40).map(|k| stage.step(1.0 + (0.3 * f64::from(k)).sin()));
                writeln!(out, "stage {}", numbers(channel))?;
            }
            Ok(Injection::Force(law)) => {
                writeln!(out, "states {}, delay {}", law.states(), number(law.delay_s()))?;
                // The last place is one that states reach in no run.
                for (time_s, angle, size) in
                    [(0.0, 0.3, 2e-3), (0.503, 2.0, -3e-3), (1.011, 4.0, 1e-3), (1.742, 5.0, -1e-3), (2.9, 1.0, 60.0), (40.01, 3.0, -70.0)]
                {
                    let (x, v) = ([0.012 * f64::sin(angle), -0.01 * f64::cos(angle)], [0.2 * f64::cos(angle), 0.15 * f64::sin(angle)]);
                    let (xd, vd) = (x.map(|x| 0.6 * x), v.map(|v| -0.5 * v));
                    let motion = Motion { time_s, position: &x, velocity: &v, delayed_position: &xd, delayed_velocity: &vd };
                    let states: Vec<f64> = (0..law.states()).map(|k| size * (1.0 + k as f64)).collect();
                    let (mut force, mut rates) = (vec![0.0; 2], vec![0.0; states.len()]);
                    law.evaluate(&motion, &states, &mut force, &mut rates);
                    writeln!(out, "  force {} | rates {} | fastest {}", numbers(force), numbers(rates), number(law.fastest_rate(&motion)))?;
                }
            }
        }
    }
    Ok(())
}

/// Each effect as a simulation is asked for it, and some as they are refused.
const HIDDEN: [(&str, &str); 40] = [
    ("parameter-error", r#"{"name": "robot_mass_kg", "value": 2.5}"#),
    ("added-mass", r#"{"mass_kg": 0.7}"#),
    ("coulomb-friction", r#"{"level_n": 1.5, "stribeck_level_n": 2.0, "stribeck_velocity_m_per_s": 0.02}"#),
    ("hysteresis", r#"{"stiffness_n_per_m": 300, "yield_m": 0.003, "shape": 0.7}"#),
    ("cubic-stiffness", r#"{"k3_n_per_m3": 2e5}"#),
    ("asymmetric-stiffness", r#"{"k2_n_per_m2": 3000}"#),
    ("dead-zone", r#"{"half_gap_m": 0.003}"#),
    ("end-stop", r#"{"position_m": 0.006, "stiffness_n_per_m": 900}"#),
    ("end-stop", r#"{"position_m": -0.006, "stiffness_n_per_m": 900}"#),
    ("viscoelastic", r#"{"modulus_n_per_m": 250, "time_s": 0.12}"#),
    ("viscoelastic", r#"{"coefficient": 40, "order": 0.3}"#),
    ("viscoelastic", r#"{}"#),
    ("extra-resonance", r#"{"frequency_hz": 5.0, "damping_ratio": 0.06, "mass_share": 0.2}"#),
    ("reflex-delay", r#"{"delay_s": 0.04, "stiffness_n_per_m": 100, "damping_n_s_per_m": 6, "cutoff_hz": 3.0}"#),
    ("reflex-delay", r#"{"delay_s": 0.04, "damping_n_s_per_m": 6, "one_directional": -1}"#),
    ("measurement-delay", r#"{"delay_s": 0.0137}"#),
    ("measurement-delay", r#"{"delay_s": -0.01}"#),
    ("channel-filter", r#"{"cutoff_hz": 20}"#),
    ("channel-filter", r#"{"cutoff_hz": 20, "order": 2}"#),
    ("channel-filter", r#"{"cutoff_hz": 20, "order": 5}"#),
    ("actuation-delay", r#"{"delay_s": 0.0137}"#),
    ("actuator-saturation", r#"{"level_n": 1.3}"#),
    ("sensor-misalignment", r#"{"angle_rad": 0.2}"#),
    ("sensor-misalignment", r#"{"matrix": [[1.0, 0.1], [0.0, 0.9]]}"#),
    ("sensor-scale", r#"{"factor": 1.2, "channel": "force_x"}"#),
    ("sensor-scale", r#"{"factor": "much"}"#),
    ("sensor-offset-drift", r#"{"rate_per_s": 0.4}"#),
    ("quantisation", r#"{"step": 0.25}"#),
    ("quantisation", r#"{"step": 0}"#),
    ("periodic-disturbance", r#"{"frequency_hz": 6.0, "amplitude_n": 0.8}"#),
    ("limb-noise", r#"{"rms_n": 0.5, "cutoff_hz": 1.5}"#),
    ("limb-noise", r#"{"rms_n": 0.5, "cutoff_hz": 8}"#),
    ("transient-disturbance", r#"{"time_s": 0.45, "impulse_n_s": 0.3}"#),
    ("stiffness-drift", r#"{"fraction_per_s": 0.02}"#),
    ("posture-drift", r#"{"rate_m_per_s": 0.001}"#),
    ("gravity", r#"{"torque_nm": 2.5, "direction_rad": 0.3}"#),
    ("geometry-error", r#"{"name": "link_1_m", "value": 0.3}"#),
    ("cross-coupling", r#"{"matrix": [[0.0, 30.0], [-20.0, 5.0]]}"#),
    ("cross-coupling", r#"{"matrix": [[0.0, 30.0], [-20.0]]}"#),
    ("cross-coupling", r#"{"matrix": [[0.0, 30.0]]}"#),
];

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
    writeln!(out, "# three angles, some entries given: what asks for that")?;
    for name in ["gravity", "cross-coupling", "sensor-scale", "added-mass", "parameter-error", "sensor-misalignment"] {
        writeln!(out, "{name}")?;
        for form in find(name).expect("an effect").forms(&angles()) {
            describe(&form, 3, &mut out)?;
        }
    }
    writeln!(out, "# how a simulation hides them")?;
    for (name, parameters) in HIDDEN {
        hidden(name, parameters, &mut out)?;
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
