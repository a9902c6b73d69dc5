//! Cycles by the clock and by a file of times: the same curves, and the same cause.

use crate::support::{json, noise, refuse};
use serde_json::Value;
use std::f64::consts::TAU;
use std::fmt::Write;
use std::path::Path;

/// 40 cycles of 1.25 s at 100 Hz: an imposed motion, and the force of 1 kg, 10 N s/m and a stiffness from 100 to 500 N/m and back.
fn record(folder: &Path) {
    let sines: Vec<(f64, f64)> = (0..12).map(|k| (0.53 + 0.71 * f64::from(k), 2.4 * f64::from(k * k))).collect();
    let sum = |term: &dyn Fn(f64, f64) -> f64| sines.iter().map(|(hz, phase)| 0.004 * term(TAU * hz, *phase)).sum::<f64>();
    let mut text = "# sample_rate_hz: 100\nforce_x [N],pos_x [m]\n".to_owned();
    for (k, error) in noise(3, 5000).iter().enumerate() {
        let t = k as f64 / 100.0;
        let [x, v, a] = [sum(&|w, p| (w * t + p).sin()), sum(&|w, p| w * (w * t + p).cos()), sum(&|w, p| -w * w * (w * t + p).sin())];
        writeln!(text, "{},{x}", a + 10.0 * v + (300.0 - 200.0 * (TAU * t / 1.25).cos()) * x + 0.2 * error).expect("a string");
    }
    std::fs::write(folder.join("trial.csv"), text).expect("written");
    let times: String = (0..=40).map(|k| format!("{}\n", 1.25 * f64::from(k))).collect();
    std::fs::write(folder.join("begins.txt"), format!("time\n{times}")).expect("written");
}

/// The real part at each phase is K(φ) − M ω², K smoothed by the window: a quarter of the cycle leaves sin(π/4)/(π/4) of its wave, and as much again
/// may be wrong by what changes within the window.
#[test]
fn the_response_over_the_cycle_follows_the_stiffness() {
    let folder = tempfile::tempdir().expect("a folder");
    record(folder.path());
    let asked = |more: &[&str]| json(folder.path(), &[&["estimate", "trial.csv", "--input", "pos_x", "--output", "force_x"], more].concat());
    let course = asked(&["--cycle", "1.25", "--band", "2-8"])["course"].clone();
    assert_eq!((course["cycles"].as_u64(), course["window_s"].as_f64()), (Some(40), Some(0.3125)));
    let numbers = |value: &Value| -> Vec<f64> { value.as_array().expect("a list").iter().map(|v| v.as_f64().expect("a number")).collect() };
    let (time_s, hz) = (numbers(&course["time_s"]), numbers(&course["frequency_hz"]));
    assert_eq!((time_s.len(), time_s[4]), (8, 0.625));
    for (k, t) in time_s.iter().enumerate() {
        let response = &course["response"][k];
        let w = TAU * hz[0];
        let re = response["re"][0][0][0].as_f64().expect("a number");
        let left = (TAU / 8.0).sin() / (TAU / 8.0);
        let truth = 300.0 - left * 200.0 * (TAU * t / 1.25).cos() - w * w;
        let half = 0.5 * (response["gain_ci95"][0][0][0][1].as_f64().expect("a number") - response["gain_ci95"][0][0][0][0].as_f64().expect("a number"));
        assert!((re - truth).abs() < (1.0 - left) * 200.0 + 2.0 * half, "{re} for {truth} at {t}");
        let coherence = course["multiple_coherence"][k][0][0].as_f64().expect("a number");
        // Chance alone gives 0.08 once in twenty with 39 averages.
        assert!((0.08..=1.0).contains(&coherence), "{coherence} at {t}");
    }
    // Without cycles nothing of the stiffness is seen to change.
    assert!(asked(&[])["course"].is_null());
    let by_file = asked(&["--event", "begins.txt", "--band", "2-8", "--sliding", "0.3125"])["course"].clone();
    assert_eq!(by_file["cycles"], 40);
    for (more, said) in [
        (&["--cycle", "1.25", "--sliding", "2"][..], "longer than a cycle"),
        (&["--sliding-step", "1"], "--sliding"),
        (&["--cycle", "1.25", "--stream"], "--stream"),
    ] {
        let message = refuse(folder.path(), &[&["estimate", "trial.csv", "--input", "pos_x", "--output", "force_x"], more].concat());
        assert!(message.contains(said), "{message}");
    }
}

#[test]
fn a_file_of_times_begins_cycles_as_the_clock_does() {
    let folder = tempfile::tempdir().expect("a folder");
    record(folder.path());
    let asked = |command: &str, more: &[&str]| {
        let options = [command, "trial.csv", "--input", "pos_x", "--output", "force_x", "--schedule", "phase"];
        json(folder.path(), &[&options, more].concat())
    };
    let [clock, file] = [["--cycle", "1.25"], ["--event", "begins.txt"]].map(|cycles| asked("fit", &cycles)["schedule"].clone());
    assert_eq!((clock["entries"].as_array().map(Vec::len), clock["blocks"].as_u64()), (Some(3), Some(40)));
    // Phases of the two differ by rounding, and so does what follows from them.
    let stiffness = |schedule: &Value| -> Vec<f64> { schedule["entries"][0]["value"].as_array().expect("a curve").iter().filter_map(Value::as_f64).collect() };
    let (by_clock, by_file) = (stiffness(&clock), stiffness(&file));
    assert!(by_clock.iter().zip(&by_file).all(|(a, b)| (a - b).abs() < 1e-6 * a.abs()) && by_file.len() == 101);
    assert!((by_clock[0] - 100.0).abs() < 20.0 && (by_clock[50] - 500.0).abs() < 20.0, "{} {}", by_clock[0], by_clock[50]);
    // The perturbation has no mean, and so the mean movement is what 40 cycles leave of 10 mm.
    let mean = clock["mean_movement"][0]["value"].as_array().expect("a curve").iter().filter_map(Value::as_f64);
    assert!(mean.clone().count() == 101 && mean.map(f64::abs).fold(0.0, f64::max) < 0.01);
    let [clock, file] = [["--cycle", "1.25"], ["--event", "begins.txt"]].map(|cycles| asked("diagnose", &cycles)["causes"].clone());
    assert_eq!(clock[0]["effect"], "varying-stiffness");
    assert_eq!(file[0]["effect"], "varying-stiffness");
    // Times of half of the cycles are a cycle of twice the length: another curve.
    let sparse: String = (0..=20).map(|k| format!("{}\n", 2.5 * f64::from(k))).collect();
    std::fs::write(folder.path().join("begins.txt"), sparse).expect("written");
    let sparse = asked("fit", &["--event", "begins.txt"])["schedule"].clone();
    assert!(sparse["blocks"] == 20 && (stiffness(&sparse)[25] - 500.0).abs() < 20.0, "{}", stiffness(&sparse)[25]);
    for command in ["fit", "diagnose"] {
        let message = refuse(folder.path(), &[command, "trial.csv", "--schedule", "phase", "--cycle", "1.25", "--event", "begins.txt"]);
        assert!(message.contains("--event"), "{message}");
    }
    let message =
        refuse(folder.path(), &["fit", "trial.csv", "--input", "pos_x", "--output", "force_x", "--schedule", "phase", "--cycle", "1.25", "--knots", "3"]);
    assert!(message.contains("--knots is 3, and curves have 4 at least"), "{message}");
}
