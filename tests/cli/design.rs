//! `ndof design` from outside: every kind, every limit, what is predicted and what is delivered, and the way on to an estimate.

use crate::support::{held_arm, json, ndof, refuse, succeed, violation};
use serde_json::Value;
use std::path::Path;

/// The columns of a designed file.
fn columns(file: &Path) -> Vec<Vec<f64>> {
    let text = std::fs::read_to_string(file).expect("written");
    let rows: Vec<Vec<f64>> =
        text.lines().filter(|line| !line.starts_with('#')).skip(1).map(|line| line.split(',').map(|cell| cell.parse().expect("a number")).collect()).collect();
    let width = rows[0].len();
    // The first column is time where there is one more than axes; the commands are the last two.
    (width.saturating_sub(2)..width).map(|c| rows.iter().map(|row| row[c]).collect()).collect()
}

fn made(folder: &Path, options: &[&str]) -> (Value, Vec<Vec<f64>>) {
    let all: Vec<&str> = ["design", "--duration", "20", "--out", "cmd.csv"].iter().chain(options).copied().collect();
    let result = json(folder, &all);
    (result, columns(&folder.join("cmd.csv")))
}

fn rms(signal: &[f64]) -> f64 {
    (signal.iter().map(|v| v * v).sum::<f64>() / signal.len() as f64).sqrt()
}

#[test]
fn a_binary_sequence_has_two_levels_and_the_autocorrelation_of_maximum_length() {
    let folder = tempfile::tempdir().expect("a folder");
    let (_, signals) = made(folder.path(), &["--kind", "prbs", "--rms", "3", "--period", "2", "--cutoff", "110"]);
    let x = &signals[0];
    assert!(x.iter().all(|v| v.abs() == 3.0), "two levels");
    // Reach 110 Hz of 500: two samples a bit; 2 s need the sequence of order 9: 511 bits.
    let n = 511 * 2;
    assert!(x[..n].chunks(2).all(|pair| pair[0] == pair[1]));
    for lag in [1, 2, 100, 255, 510] {
        let r: f64 = (0..511).map(|k| x[2 * k] * x[(2 * (k + lag)) % n]).sum();
        assert_eq!(r, -9.0, "lag {lag}");
    }
}

#[test]
fn a_chirp_sweeps_as_it_is_told() {
    let folder = tempfile::tempdir().expect("a folder");
    let crossings = |signal: &[f64]| signal.windows(2).filter(|pair| pair[0] < 0.0 && pair[1] >= 0.0).count() as f64;
    for (sweep, expected) in [("linear", 20.0 * 4.5), ("logarithmic", 20.0 * 7.0 / 8.0_f64.ln())] {
        let (_, signals) = made(folder.path(), &["--kind", "chirp", "--lines", "1-8", "--sweep", sweep]);
        // Cycles of the whole sweep: its mean frequency times 20 s.
        assert!((crossings(&signals[0]) - expected).abs() <= 1.0, "{sweep}: {}", crossings(&signals[0]));
        assert_eq!(rms(&signals[1]), 0.0, "one axis after the other");
    }
}

#[test]
fn crest_reduction_slope_and_harmonics_do_what_they_say() {
    let folder = tempfile::tempdir().expect("a folder");
    let multisine = |options: &[&str]| {
        let all: Vec<&str> = ["--kind", "multisine", "--axes", "x,y"].iter().chain(options).copied().collect();
        made(folder.path(), &all)
    };
    let crest = |result: &Value| result["trials"][0]["signals"][0]["crest_factor"].as_f64().expect("a number");
    let (random, _) = multisine(&["--crest-steps", "0", "--harmonics", "all"]);
    let (reduced, signals) = multisine(&["--crest-steps", "300", "--harmonics", "all"]);
    assert!(crest(&reduced) < crest(&random), "{} {}", crest(&reduced), crest(&random));
    // An odd multisine is antisymmetric about half of its period of 10 s, one of all harmonics is not.
    let antisymmetric = |x: &[f64]| (0..2500).all(|k| (x[k] + x[k + 2500]).abs() < 1e-6);
    assert!(!antisymmetric(&signals[0]));
    assert!(antisymmetric(&multisine(&["--harmonics", "odd"]).1[0]));
    // Amplitudes that fall with frequency make a slower signal of the same size.
    let slew = |result: &Value| result["trials"][0]["signals"][0]["slew_per_s"].as_f64().expect("a number");
    let (sloped, signals) = multisine(&["--slope", "-0.5", "--crest-steps", "0", "--harmonics", "all"]);
    assert!(slew(&sloped) < 0.8 * slew(&random) && (rms(&signals[0]) - 4.0).abs() < 1e-3, "{} {}", slew(&sloped), slew(&random));
}

#[test]
fn zippered_axes_take_turns_at_the_lines_of_one_trial() {
    let folder = tempfile::tempdir().expect("a folder");
    let (_, signals) = made(folder.path(), &["--kind", "multisine", "--axis-plan", "zippered"]);
    let inner: f64 = signals[0].iter().zip(&signals[1]).map(|(x, y)| x * y).sum();
    // No line in common, so no correlation over whole periods, but for the digits of the file.
    assert!(inner.abs() < 1e-6 * 16.0 * signals[0].len() as f64, "{inner}");
}

#[test]
fn it_fades_in_and_out_and_keeps_peak_and_slew() {
    let folder = tempfile::tempdir().expect("a folder");
    let (result, signals) = made(folder.path(), &["--fade", "2", "--peak", "7", "--slew", "300", "--candidates", "2"]);
    for (k, signal) in signals.iter().enumerate() {
        assert!(signal[0].abs() < 0.05 && signal[signal.len() - 1].abs() < 0.05);
        assert!(rms(&signal[..500]) < 0.5 * rms(&signal[2000..8000]), "fades");
        let peak = signal.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
        let slew = signal.windows(2).fold(0.0_f64, |m, w| m.max((w[1] - w[0]).abs() * 500.0));
        // The file has its digits; the limits are kept before they are cut.
        assert!(peak <= 7.0 + 1e-6 && slew <= 300.0 + 1e-3, "{peak} {slew}");
        assert!((result["trials"][0]["signals"][k]["peak"].as_f64().expect("a number") - peak).abs() < 1e-6);
    }
}

#[test]
fn motion_is_printed_for_a_soft_and_a_stiff_limb_and_too_much_is_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    let text = succeed(folder.path(), &["design", "--candidates", "2", "--out", "cmd.csv"]);
    assert!(text.contains("soft limb, x") && text.contains("stiff limb, y") && text.contains("peak velocity m/s"), "{text}");
    std::fs::remove_file(folder.path().join("cmd.csv")).expect("written");
    let message = refuse(folder.path(), &["design", "--candidates", "2", "--max-displacement", "0.005", "--out", "cmd.csv"]);
    assert!(message.contains("soft limb's displacement on axis") && message.contains("lower --rms to"), "{message}");
    assert!(refuse(folder.path(), &["design", "--experiment", "arm", "--max-velocity", "0.01", "--out", "cmd.csv"]).contains("velocity"));
    assert!(!folder.path().join("cmd.csv").exists(), "nothing is written");
    // The factor that it names is enough.
    let factor: f64 = message.split("lower --rms to ").nth(1).and_then(|rest| rest.split(' ').next()).and_then(|word| word.parse().ok()).expect("a factor");
    let lower = (4.0 * factor * 0.999).to_string();
    succeed(folder.path(), &["design", "--candidates", "2", "--rms", &lower, "--max-displacement", "0.005", "--out", "cmd.csv"]);
    // A limb of one's own: at rest it yields by F/K, so a stiffer one moves less.
    let peak = |limb: &str| {
        let result = json(folder.path(), &["design", "--candidates", "2", "--soft", limb, "--out", "cmd.csv"]);
        result["motion"][0]["displacement_peak"].as_f64().expect("a number")
    };
    assert!(peak("2,20,200") > peak("2,20,2000"));
}

#[test]
fn nonsense_is_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    for (options, part) in [
        (&["--target-ci", "Q=0.1"][..], "K=0.1"),
        (&["--target-ci", "K=0.1"], "experiment"),
        (&["--experiment", "arm", "--target-ci", "K_a_b=0.1"], "K_x_y"),
        (&["--experiment", "arm", "--axes", "x,z"], "x, y"),
        (&["--kind", "prbs", "--decorrelate"], "filtered-noise"),
        (&["--soft", "1,2"], "three numbers"),
        (&["--precompensate", "nothing"], "no study"),
    ] {
        let arguments: Vec<&str> = ["design", "--out", "cmd.csv"].iter().chain(options).copied().collect();
        let output = ndof(folder.path(), &arguments);
        let message = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(2), "{options:?}: {message}");
        assert!(message.contains(part), "{options:?}: {message}");
        assert!(!folder.path().join("cmd.csv").exists());
    }
}

/// The largest coherence between the axes at a stage, all trials pooled.
fn pooled(result: &Value, stage: &str) -> f64 {
    result["pooled"][stage]["max"].as_f64().unwrap_or_else(|| panic!("{stage}: {}", result["pooled"]))
}

/// Issue 3, "It must show" 6: between the forces that the simulated device delivers, friction included, 0.25 to 15 Hz.
#[test]
fn delivered_forces_of_arm_and_wrist_are_incoherent() {
    let folder = tempfile::tempdir().expect("a folder");
    let schema: Value = serde_json::from_str(&succeed(folder.path(), &["schema", "design"])).expect("JSON");
    // The wrist robot has next to no dry friction, so that its linear model is good enough without corrections.
    for (study, axes, corrections) in [("arm", 2, "4"), ("wrist", 3, "0")] {
        let design = |options: &[&str]| {
            let all: Vec<&str> = ["design", "--precompensate", study, "--out", "cmd.csv"].iter().chain(options).copied().collect();
            json(folder.path(), &all)
        };
        let noise = design(&["--decorrelate", "--candidates", "1", "--corrections", corrections]);
        assert_eq!(violation(&noise, &schema, &schema, ""), None);
        assert_eq!((noise["trials"].as_array().map(Vec::len), noise["axes"].as_array().map(Vec::len)), (Some(6), Some(axes)));
        assert!(pooled(&noise, "delivered") < 0.05, "{study}: {}", noise["pooled"]);
        for trial in noise["trials"].as_array().expect("trials") {
            assert!(trial["coherence"]["delivered"]["max"].as_f64().expect("a number") <= 0.10, "{study}: {}", trial["coherence"]);
        }
        let multisine = design(&["--kind", "multisine", "--corrections", corrections]);
        assert_eq!(multisine["analysis"]["name"], "lines");
        assert!(pooled(&multisine, "delivered") < 0.01, "{study}: {}", multisine["pooled"]);
    }
}

#[test]
fn without_compensation_a_stiff_hold_couples_the_forces_and_a_warning_says_so() {
    let folder = tempfile::tempdir().expect("a folder");
    let experiment =
        held_arm("trials = 2\nduration_s = 30.0", "[controller]\nkp = 400.0").replace("[300.0, -60.0], [-60.0, 520.0]", "[150.0, -100.0], [-100.0, 300.0]");
    std::fs::write(folder.path().join("stiff.toml"), experiment).expect("written");
    let of = |flag: &str| json(folder.path(), &["design", flag, "stiff.toml", "--decorrelate", "--out", "cmd.csv"]);
    let (plain, compensated) = (of("--experiment"), of("--precompensate"));
    assert!(pooled(&plain, "delivered_linear") > 0.3, "{}", plain["pooled"]);
    assert_eq!(plain["warnings"][0]["code"], "coherent-forces");
    assert!(pooled(&compensated, "delivered_linear") < 0.01, "{}", compensated["pooled"]);
}

#[test]
fn a_multisine_shorter_than_two_periods_is_refused_with_what_to_do() {
    let folder = tempfile::tempdir().expect("folder");
    let message = refuse(folder.path(), &["design", "--kind", "multisine", "--duration", "15", "--period", "10", "--out", "cmd.csv"]);
    for part in ["1.50 periods of 10 s", "--duration 20", "--period 7.5"] {
        assert!(message.contains(part), "{message}");
    }
    succeed(folder.path(), &["design", "--kind", "multisine", "--axes", "x", "--duration", "15", "--period", "7.5", "--out", "cmd.csv"]);
}

#[test]
fn what_was_designed_is_replayed_and_estimated() {
    let folder = tempfile::tempdir().expect("a folder");
    let experiment = held_arm("trials = 3\nduration_s = 20.0\ndiscard_s = 1.0", "[excitation]");
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).expect("written");
    write("plan.toml", &format!("{experiment}rms = 4.0\n"));
    write("measure.toml", &format!("{experiment}file = \"cmd.csv\"\n"));
    succeed(folder.path(), &["design", "--precompensate", "plan.toml", "--decorrelate", "--out", "cmd.csv"]);
    succeed(folder.path(), &["simulate", "measure.toml", "--out", "trial.csv"]);
    // What was recorded as commanded is what was designed, less the second before the recording.
    let (designed, recorded) = (columns(&folder.path().join("cmd-2.csv")), std::fs::read_to_string(folder.path().join("trial-2.csv")).expect("written"));
    assert_eq!(designed[0].len(), 21 * 500);
    let head = recorded.lines().find(|line| line.contains("cmd_x")).expect("a header");
    let column = head.split(',').position(|cell| cell.starts_with("cmd_x")).expect("a column");
    let first: f64 = recorded
        .lines()
        .skip_while(|line| *line != head)
        .nth(1)
        .and_then(|row| row.split(',').nth(column))
        .and_then(|cell| cell.parse().ok())
        .expect("a number");
    assert!((first - designed[0][500]).abs() < 1e-9, "{first} {}", designed[0][500]);
    let fit = json(folder.path(), &["fit", "trial-1.csv", "trial-2.csv", "trial-3.csv", "--nperseg", "2048", "--noverlap", "1536", "--band", "0.5-8"]);
    for (name, truth) in [("K_x_x", 300.0), ("K_y_y", 520.0), ("M_x_x", 2.1)] {
        let p = fit["parameters"].as_array().expect("parameters").iter().find(|p| p["name"] == name).expect("a parameter");
        let (value, error) = (p["value"].as_f64().expect("a value"), p["std_error"].as_f64().expect("an error"));
        // Four standard errors, and 2 % for the transducer's own compliance, which the fit is not told of.
        assert!((value - truth).abs() < 4.0 * error + 0.02 * truth, "{name}: {value} ± {error} against {truth}");
    }
    // Too short a file is refused with what to do.
    write("long.toml", &format!("{}file = \"cmd.csv\"\n", experiment.replace("duration_s = 20.0", "duration_s = 60.0")));
    assert!(refuse(folder.path(), &["simulate", "long.toml", "--out", "trial.csv"]).contains("lower duration_s"));
}

#[test]
fn the_length_for_an_interval_grows_as_the_interval_shrinks() {
    let folder = tempfile::tempdir().expect("a folder");
    let averages = |target: &str| {
        let result = json(folder.path(), &["design", "--experiment", "arm", "--candidates", "1", "--target-ci", target, "--out", "cmd.csv"]);
        result["length"]["wanted"][0]["effective_averages"].as_f64().expect("reached")
    };
    let (wide, narrow) = (averages("K=2%"), averages("K=1%"));
    // Half the width takes four times the averages, less what estimating the noise costs where they are few: (1 − 2/n)² of some 50.
    assert!((3.6..4.05).contains(&(narrow / wide)), "{wide}, {narrow}");
    let text = succeed(folder.path(), &["design", "--experiment", "arm", "--candidates", "1", "--target-ci", "K=5%,gain@2=5%", "--out", "cmd.csv"]);
    assert!(text.contains("wanted 95 % interval") && text.contains("gain@2") && text.contains("trial(s) of"), "{text}");
}

#[test]
fn a_robots_motion_keeps_its_limits_and_is_the_same_on_any_number_of_threads() {
    let folder = tempfile::tempdir().expect("a folder");
    let arm = "schema = \"ndof/robot/1\"\nname = \"arm\"\n[[joints]]\nname = \"shoulder\"\naxis = [0.0, 1.0, 0.0]\nmass_kg = 2.0\ncentre_m = [0.2, 0.0, 0.0]\nrate_limit_rad_per_s = 2.0\ntorque_limit_nm = 12.0\nviscous_nm_s_per_rad = 0.2\n";
    std::fs::write(folder.path().join("arm.toml"), arm).expect("written");
    let all = ["design", "--robot", "arm.toml", "--duration", "8", "--period", "4", "--sample-rate", "100", "--seed", "3", "--out"];
    fn with<'a>(all: &[&'a str], options: &[&'a str]) -> Vec<&'a str> {
        [all, options].concat()
    }
    let result = json(folder.path(), &with(&all, &["one.csv", "--threads", "1"]));
    succeed(folder.path(), &with(&all, &["two.csv", "--threads", "2", "--report", "page.html"]));
    let [one, two] = ["one.csv", "two.csv"].map(|file| std::fs::read_to_string(folder.path().join(file)).expect("written"));
    assert_eq!(one, two);
    let schema: Value = serde_json::from_str(&succeed(folder.path(), &["schema", "excitation"])).expect("JSON");
    assert_eq!(violation(&result, &schema, &schema, ""), None);
    let rows: Vec<&str> = one.lines().filter(|line| !line.starts_with('#')).collect();
    assert_eq!(rows[0], "angle_shoulder [rad],vel_shoulder [rad/s],acc_shoulder [rad/s^2],torque_shoulder [N m]");
    let values: Vec<Vec<f64>> = rows[1..].iter().map(|row| row.split(',').map(|cell| cell.parse().expect("a number")).collect()).collect();
    assert_eq!(values.len(), 801);
    let (first, last) = (&values[0], &values[800]);
    assert!(first[1].abs() < 1e-12 && last[1].abs() < 1e-9 && (first[0] - last[0]).abs() < 1e-9, "from rest to rest, where it began");
    assert!(values.iter().all(|v| v[0].abs() < std::f64::consts::PI && v[1].abs() <= 1.8 + 1e-9 && v[3].abs() <= 12.0));
    assert!(result["condition"].as_f64() < result["condition_random_best"].as_f64());
    let warning = ndof(folder.path(), &with(&all, &["three.csv"]));
    assert!(String::from_utf8_lossy(&warning.stderr).contains("no range for shoulder"));
    for (options, part) in
        [(&["--rms", "3"][..], "--rms"), (&["--duration", "7"], "--duration 8"), (&["--interest", "knee"], "\"knee\""), (&["--band", "1-2"], "--band")]
    {
        let asked: Vec<&str> = ["design", "--robot", "arm.toml", "--period", "4", "--out", "no.csv"].iter().chain(options).copied().collect();
        assert!(refuse(folder.path(), &asked).contains(part), "{options:?}");
        assert!(!folder.path().join("no.csv").exists());
    }
}
