//! `ndof diagnose --simulated` from outside: a simulator that is known by its log alone.

use crate::support::{csv, json, refuse};
use ndof::signal::FilteredNoise;
use serde_json::Value;
use std::path::Path;

const RATE: usize = 500;
const SUBSTEPS: usize = 20;

/// Stiffness of a mass of 2 kg on a damper of 12 N s/m, its dry friction, and how much later than recorded it is pushed (s).
#[derive(Default)]
struct Limb {
    stiffness: f64,
    dry: f64,
    late: f64,
}

/// Writes 50 s of a force of 4 N rms, and what the limb makes of it; the limb pushes back with `own` N rms.
fn log(folder: &Path, name: &str, limb: &Limb, own: f64) {
    let made = |rms: f64, seed| FilteredNoise { axes: 1, samples: 50 * RATE, rms, ..FilteredNoise::default() }.generate(seed).expect("noise").remove(0);
    let (force, push) = (made(4.0, 1), made(1.0, 2));
    let (mut x, mut v) = (0.0_f64, 0.0_f64);
    let step = 1.0 / (RATE * SUBSTEPS) as f64;
    let mut moved = |f: f64| {
        v += (f - 12.0 * v - limb.stiffness * x - limb.dry * (v / 0.0005).tanh()) / 2.0 * step;
        x += v * step;
        x
    };
    let mut mean = |f: f64| (0..SUBSTEPS).map(|_| moved(f)).sum::<f64>() / SUBSTEPS as f64;
    let late = (limb.late * RATE as f64) as usize;
    let motion: Vec<f64> = (0..force.len()).map(|k| mean(if k < late { 0.0 } else { force[k - late] } + own * push[k])).collect();
    csv(&folder.join(name), &format!("# sample_rate_hz: {RATE}\n"), &[("force_x [N]", &force), ("pos_x [m]", &motion)]);
}

fn names(result: &Value) -> Vec<&str> {
    result["causes"].as_array().expect("a list").iter().filter_map(|c| c["effect"].as_str()).collect()
}

#[test]
fn a_simulator_of_any_make_is_told_what_it_lacks_by_its_log() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    log(folder, "sim.csv", &Limb { stiffness: 300.0, ..Limb::default() }, 0.0);
    log(folder, "same.csv", &Limb { stiffness: 300.0, ..Limb::default() }, 0.1);
    log(folder, "dry.csv", &Limb { stiffness: 300.0, dry: 1.0, ..Limb::default() }, 0.1);
    log(folder, "stiff.csv", &Limb { stiffness: 360.0, ..Limb::default() }, 0.1);

    let same = json(folder, &["diagnose", "same.csv", "--simulated", "sim.csv"]);
    assert_eq!((same["verdict"].as_str(), names(&same)), (Some("adequate"), vec![]));

    let dry = json(folder, &["diagnose", "dry.csv", "--simulated", "sim.csv"]);
    assert_eq!(names(&dry)[0], "coulomb-friction");
    let error = |which: &str| dry[which]["held_out"]["nrmse"][0].as_f64().expect("a number");
    assert!(error("extended") < 0.3 * error("baseline"), "{} of {}", error("extended"), error("baseline"));

    let stiff = json(folder, &["diagnose", "stiff.csv", "--simulated", "sim.csv"]);
    assert_eq!(names(&stiff)[0], "parameter-error");
    let shifts = stiff["extended"]["parameter_shift"].as_array().expect("a list");
    let stiffness = shifts.iter().find(|s| s["name"] == "K_x_x").or(shifts.iter().find(|s| s["name"] == "K")).expect("the stiffness");
    let number = |key: &str| stiffness[key].as_f64().expect("a number");
    // 1 % is the tolerance of what matters.
    assert!((number("before") / 300.0 - 1.0).abs() < 0.01 && (number("after") / 360.0 - 1.0).abs() < 0.01, "{stiffness}");
}

#[test]
fn what_a_simulator_has_of_its_own_is_no_cause() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    let dry = Limb { stiffness: 300.0, dry: 1.0, ..Limb::default() };
    log(folder, "sim.csv", &dry, 0.0);
    log(folder, "log.csv", &dry, 0.05);
    assert_eq!(names(&json(folder, &["diagnose", "log.csv"]))[0], "coulomb-friction");
    let found = json(folder, &["diagnose", "log.csv", "--simulated", "sim.csv"]);
    assert_eq!((found["verdict"].as_str(), names(&found)), (Some("adequate"), vec![]));

    // Beside a friction of its own a hidden one moves the limb otherwise: its own log says how its friction follows.
    log(folder, "more.csv", &Limb { dry: 1.6, ..dry }, 0.05);
    let more = json(folder, &["diagnose", "more.csv", "--simulated", "sim.csv"]);
    assert_eq!(names(&more), ["coulomb-friction"]);
    let level = &more["causes"][0]["parameters"][0];
    let number = |value: &Value| value.as_f64().expect("a number");
    assert!(number(&level["ci95"][0]) < 0.6 && 0.6 < number(&level["ci95"][1]), "{level}");
    assert!(!warned(&more), "{}", more["warnings"]);
}

/// What a simulator does to its force before it moves is no law along a motion: where that matters, it is said.
#[test]
fn a_simulator_that_is_late_is_known_to_first_order_only() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    let late = Limb { stiffness: 300.0, dry: 1.0, late: 0.02 };
    log(folder, "sim.csv", &late, 0.0);
    log(folder, "log.csv", &Limb { stiffness: 400.0, ..late }, 0.05);
    let found = json(folder, &["diagnose", "log.csv", "--simulated", "sim.csv"]);
    assert!(warned(&found), "{}", found["warnings"]);
}

fn warned(result: &Value) -> bool {
    result["warnings"].as_array().expect("a list").iter().any(|w| w["code"] == "simulator-not-linear")
}

#[test]
fn a_simulator_logs_the_same_at_the_same_commands() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    log(folder, "sim-1.csv", &Limb { stiffness: 300.0, ..Limb::default() }, 0.0);
    std::fs::copy(folder.join("sim-1.csv"), folder.join("sim-2.csv")).expect("copied");
    log(folder, "log-1.csv", &Limb { stiffness: 300.0, ..Limb::default() }, 0.1);
    log(folder, "log-2.csv", &Limb { stiffness: 300.0, ..Limb::default() }, 0.09);
    let found = json(folder, &["diagnose", "log-1.csv", "log-2.csv", "--simulated", "sim-1.csv", "sim-2.csv"]);
    assert_eq!((found["verdict"].as_str(), names(&found)), (Some("adequate"), vec![]));
}

#[test]
fn logs_that_do_not_belong_together_are_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    let limb = Limb { stiffness: 300.0, ..Limb::default() };
    log(folder, "log.csv", &limb, 0.1);
    csv(&folder.join("short.csv"), "# sample_rate_hz: 500\n", &[("force_x [N]", &[1.0, 2.0, 0.0]), ("pos_x [m]", &[0.0, 0.1, 0.2])]);
    csv(&folder.join("other.csv"), "# sample_rate_hz: 500\n", &[("force_y [N]", &vec![1.0; 25_000]), ("pos_y [m]", &vec![0.0; 25_000])]);
    let said = |simulated: &[&str]| refuse(folder, &[&["diagnose", "log.csv", "--simulated"], simulated].concat());
    assert!(said(&["short.csv"]).contains("let the simulator log the same commands at the same times"));
    for again in ["again.csv", "once_more.csv"] {
        std::fs::copy(folder.join("log.csv"), folder.join(again)).expect("copied");
    }
    assert!(said(&["again.csv", "once_more.csv"]).contains("1 measured recordings and 2 simulated ones"));
    assert!(said(&["other.csv"]).contains("other.csv"));
}
