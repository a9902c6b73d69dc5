//! Bad input: exit code 2, one message that names file, place and remedy, nothing overwritten.

use crate::support::{csv, json, ndof, noise, oscillator, refuse, succeed, trial};
use std::path::Path;

/// Runs `estimate` on `bad.csv` with a result file that exists already; the file must be untouched. Returns the message.
fn refused(folder: &Path, text: &str, extra: &[&str]) -> String {
    std::fs::write(folder.join("bad.csv"), text).expect("written");
    std::fs::write(folder.join("kept.json"), "as it was").expect("written");
    let arguments: Vec<&str> = ["estimate", "bad.csv", "--json", "kept.json"].iter().copied().chain(extra.iter().copied()).collect();
    let message = refuse(folder, &arguments);
    assert_eq!(std::fs::read_to_string(folder.join("kept.json")).expect("there"), "as it was");
    let entries = std::fs::read_dir(folder).expect("a folder").count();
    assert!(entries <= 3, "no half-written file is left: {entries} entries");
    message
}

fn says(message: &str, parts: &[&str]) {
    for part in parts {
        assert!(message.contains(part), "\"{part}\" is missing in: {message}");
    }
}

fn good_rows(rows: usize) -> Vec<String> {
    let force = noise(3, rows);
    let motion = oscillator(&force);
    (0..rows).map(|k| format!("{},{},{}", k as f64 * 0.002, force[k], motion[k])).collect()
}

fn with_rows(rows: &[String]) -> String {
    format!("t [s],force_x [N],pos_x [m]\n{}\n", rows.join("\n"))
}

#[test]
fn a_missing_file_is_named() {
    let folder = tempfile::tempdir().expect("a folder");
    says(&refuse(folder.path(), &["estimate", "nowhere.csv"]), &["nowhere.csv"]);
}

#[test]
fn an_empty_file_is_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    says(&refused(folder.path(), "", &[]), &["bad.csv", "empty"]);
    says(&refused(folder.path(), "t [s],force_x [N],pos_x [m]\n", &[]), &["bad.csv", "line 1"]);
}

#[test]
fn a_missing_column_is_named_with_the_nearest_one() {
    let folder = tempfile::tempdir().expect("a folder");
    let text = with_rows(&good_rows(3000));
    says(&refused(folder.path(), &text, &["--input", "force_z"]), &["bad.csv", "force_z", "did you mean \"force_x\"?"]);
    let headless = text.replace("force_x", "emg");
    says(&refused(folder.path(), &headless, &[]), &["bad.csv", "no input channel", "--input"]);
}

#[test]
fn a_missing_number_is_placed() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut rows = good_rows(3000);
    rows[1234] = "2.468,NaN,0.001".to_owned();
    says(&refused(folder.path(), &with_rows(&rows), &[]), &["bad.csv", "force_x", "1234", "cut"]);
}

#[test]
fn a_missing_number_that_is_not_used_does_no_harm() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut rows = good_rows(3000);
    rows[10] = "0.02,NaN,0.001".to_owned();
    std::fs::write(folder.path().join("bad.csv"), with_rows(&rows)).expect("written");
    succeed(folder.path(), &["estimate", "bad.csv", "--start", "0.03"]);
}

#[test]
fn text_in_a_number_is_placed() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut rows = good_rows(3000);
    rows[41] = "0.082,oops,0.001".to_owned();
    says(&refused(folder.path(), &with_rows(&rows), &[]), &["bad.csv", "line 43", "force_x", "oops"]);
}

#[test]
fn irregular_time_is_placed_and_can_be_repaired() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut rows = good_rows(3000);
    rows.remove(700);
    let text = with_rows(&rows);
    says(&refused(folder.path(), &text, &[]), &["bad.csv", "line 702", "--resample"]);
    let output = ndof(folder.path(), &["estimate", "bad.csv", "--resample"]);
    assert!(output.status.success());
    assert!(String::from_utf8_lossy(&output.stderr).contains("warning[resampled]"), "{}", String::from_utf8_lossy(&output.stderr));
}

#[test]
fn one_segment_is_not_enough() {
    let folder = tempfile::tempdir().expect("a folder");
    let text = with_rows(&good_rows(3000));
    says(&refused(folder.path(), &text, &["--nperseg", "3000"]), &["bad.csv", "averages", "--nperseg"]);
    says(&refused(folder.path(), &text, &["--nperseg", "4000"]), &["bad.csv", "3000 samples", "nperseg"]);
}

#[test]
fn copied_inputs_are_named() {
    let folder = tempfile::tempdir().expect("a folder");
    let force = noise(5, 6000);
    let motion = oscillator(&force);
    let path = folder.path().join("two.csv");
    csv(&path, "# sample_rate_hz: 500\n", &[("force_x [N]", &force), ("force_y [N]", &force), ("pos_x [m]", &motion), ("pos_y [m]", &motion)]);
    says(&refuse(folder.path(), &["estimate", "two.csv"]), &["force_x", "force_y", "--input"]);
}

#[test]
fn unknown_words_get_a_suggestion() {
    let folder = tempfile::tempdir().expect("a folder");
    trial(folder.path());
    says(&refuse(folder.path(), &["estimate", "trial.csv", "--nperseq", "256"]), &["--nperseq", "--nperseg"]);
    says(&refuse(folder.path(), &["study", "arn"]), &["arn", "did you mean \"arm\"?"]);
    says(&refuse(folder.path(), &["schema", "estimat"]), &["estimat", "did you mean \"estimate\"?"]);
    for (option, slip, meant) in [
        ("--response", "complianc", "'compliance'"),
        ("--method", "welsh", "'welch'"),
        ("--detrend", "linar", "'linear'"),
        ("--window", "haming", "did you mean \"hamming\"?"),
    ] {
        says(&refuse(folder.path(), &["estimate", "trial.csv", option, slip]), &[option, slip, meant]);
    }
    for (option, slip, meant) in [
        ("--cost", "wieghted", "'weighted'"),
        ("--vaf-weight", "gama", "'gamma'"),
        ("--arm", "rigth", "'right'"),
        ("--negate", "force_X", "did you mean \"force_x\"?"),
    ] {
        says(&refuse(folder.path(), &["fit", "trial.csv", option, slip]), &[option.trim_start_matches("--negate"), slip, meant]);
    }
    let message = refuse(folder.path(), &["fit", "trial.csv", "--model", "inertia-damping-stifness"]);
    says(&message, &["no model", "inertia-damping-stifness", "did you mean \"inertia-damping-stiffness\"?"]);
    says(&refuse(folder.path(), &["diagnose", "trial.csv", "--without", "histeresis"]), &["--without", "did you mean \"hysteresis\"?"]);
    says(&refuse(folder.path(), &["list", "efects"]), &["efects", "'effects'"]);
    let model = include_str!("../../examples/studies/arm.toml").replace("[fit]", "[fit]\nmodel = \"inertia-damping-stifness\"");
    std::fs::write(folder.path().join("model.toml"), model).expect("written");
    let message = refuse(folder.path(), &["study", "model.toml", "--recording", "trial.csv"]);
    says(&message, &["inertia-damping-stifness", "did you mean \"inertia-damping-stiffness\"?"]);
}

#[test]
fn a_wrong_study_file_is_placed() {
    let folder = tempfile::tempdir().expect("a folder");
    let text = include_str!("../../examples/studies/arm.toml").replace("band_hz", "band_hertz");
    let line = text.lines().position(|line| line.starts_with("band_hertz")).expect("it is there") + 1;
    std::fs::write(folder.path().join("s.toml"), text).expect("written");
    says(&refuse(folder.path(), &["study", "s.toml"]), &[&format!("s.toml:{line}:"), "band_hertz", "did you mean \"band_hz\"?"]);
    assert!(!folder.path().join("ndof-out").exists(), "nothing is written on an error");
}

#[test]
fn an_input_is_never_overwritten() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = trial(folder.path());
    let before = std::fs::read(&path).expect("there");
    says(&refuse(folder.path(), &["convert", "trial.csv", "trial.csv"]), &["trial.csv", "never changed"]);
    for option in ["--json", "--report"] {
        for command in ["check", "estimate", "fit"] {
            if (command, option) != ("check", "--report") {
                says(&refuse(folder.path(), &[command, "trial.csv", option, "./trial.csv"]), &["trial.csv", "never overwritten"]);
            }
        }
    }
    assert_eq!(std::fs::read(&path).expect("there"), before);
}

#[test]
fn an_option_that_would_do_nothing_is_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    trial(folder.path());
    for (command, option) in [("check", "--report"), ("check", "--plots"), ("live", "--report"), ("cohort", "--plots"), ("cohort", "--schedule")] {
        says(&refuse(folder.path(), &[command, "trial.csv", option, "out"]), &[command, option, "no use"]);
    }
    says(&refuse(folder.path(), &["check", "trial.csv", "--band", "1-2"]), &["check", "--band"]);
    says(&refuse(folder.path(), &["estimate", "trial.csv", "--json", "x", "--report", "x"]), &["--json", "--report", "overwrite"]);
    says(&refuse(folder.path(), &["estimate", "trial.csv", "--report", "-"]), &["--report", "only --json"]);
    says(&refuse(folder.path(), &["estimate", "trial.csv", "--plots", "trial.csv"]), &["--plots trial.csv", "folder"]);
    says(&refuse(folder.path(), &["estimate", "trial.csv", "--sliding", "1000"]), &["1000 s", "longest recording", "20"]);
    assert!(!succeed(folder.path(), &["check", "--help"]).contains("--report"), "help shows what works");
    let output = ndof(folder.path(), &["estimate", "trial.csv", "--verbose"]);
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success());
    says(&said, &["read trial.csv", "20 s at 500 Hz", "inputs: force_x", "outputs: pos_x", "references: none"]);
}

#[test]
fn a_folder_that_cannot_be_written_is_the_machines_fault() {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("file"), "").expect("written");
    let output = ndof(folder.path(), &["study", "arm", "--out", "file/inside"]);
    assert_eq!(output.status.code(), Some(3), "{}", String::from_utf8_lossy(&output.stderr));
}

#[test]
fn a_design_of_nothing_is_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    for (options, part) in [
        (&["--trials", "0"][..], "--trials"),
        (&["--candidates", "0"], "--candidates"),
        (&["--axes", " "], "--axes"),
        (&["--peak", "0"], "--peak"),
        (&["--duration", "10", "--fade", "6"], "--fade"),
    ] {
        let arguments: Vec<&str> = ["design", "--out", "cmd.csv"].iter().chain(options).copied().collect();
        says(&refuse(folder.path(), &arguments), &[part]);
        assert!(!folder.path().join("cmd.csv").exists(), "{options:?}");
    }
}

#[test]
fn a_local_polynomial_of_absurd_degree_is_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("trial.csv"), with_rows(&good_rows(4000))).expect("written");
    says(&refuse(folder.path(), &["estimate", "trial.csv", "--method", "local-polynomial", "--order", "99"]), &["99", "8"]);
}

#[test]
fn a_value_that_cannot_be_is_refused_with_its_option() {
    let folder = tempfile::tempdir().expect("a folder");
    trial(folder.path());
    for (option, value, part) in [
        ("--sample-rate", "-1", "above zero"),
        ("--nperseg", "0", "1 or more"),
        ("--nperseg", "-5", "1 or more"),
        ("--threads", "abc", "1 or more"),
        ("--threads", "0", "1 or more"),
        ("--seed", "-3", "0 or more"),
        ("--period", "0", "above zero"),
        ("--start", "abc", "write a number"),
        ("--handle-mass", "-1", "not negative"),
        ("--band", "10", "two numbers"),
        ("--band", "5--1", "smaller number first"),
        ("--window", "hamn", "hamming"),
    ] {
        says(&refuse(folder.path(), &["estimate", "trial.csv", option, value]), &[option, value, part]);
    }
    succeed(folder.path(), &["estimate", "trial.csv", "--band", "-1-5"]);
}

#[test]
fn what_cannot_be_read_or_written_is_said_with_a_remedy() {
    let folder = tempfile::tempdir().expect("a folder");
    trial(folder.path());
    says(&refuse(folder.path(), &["estimate", "nowhere.csv"]), &["nowhere.csv", "no such file", "check the path"]);
    says(&refuse(folder.path(), &["estimate", "."]), &[".", "it is a folder", "*.csv"]);
    // A folder that is not there is a wrong path, and no failure of the machine.
    says(&refuse(folder.path(), &["estimate", "trial.csv", "--json", "none/out.json"]), &["none/out.json", "its folder does not exist"]);
    std::fs::write(folder.path().join("tare.csv"), "# sample_rate_hz: 500\nforce_z [N]\n1\n2\n").expect("written");
    says(&refuse(folder.path(), &["fit", "trial.csv", "--tare", "tare.csv"]), &["tare.csv", "force_x", "did you mean \"force_z\"?"]);
    says(&refuse(folder.path(), &["fit", "trial.csv", "--kinematics", "none.toml"]), &["none.toml", "no such file"]);
    std::fs::write(folder.path().join("k.toml"), "link_lengths_m = [0.3, 0.3]\n").expect("written");
    says(&refuse(folder.path(), &["fit", "trial.csv", "--kinematics", "k.toml"]), &["k.toml:1", "kind", "add this key"]);
    says(&refuse(folder.path(), &["estimate", "trial.csv", "--input", "force_x", "--output", "force_x"]), &["trial.csv", "force_x", "one role", "--output"]);
    std::fs::write(folder.path().join("s.toml"), include_str!("../../examples/studies/arm.toml").replace("duration_s = 50.0", "duration_s = 0.01"))
        .expect("written");
    says(&refuse(folder.path(), &["study", "s.toml"]), &["s.toml", "duration_s = 0.01"]);
}

#[test]
fn a_force_or_a_motion_in_an_unknown_unit_is_refused_and_can_be_told() {
    let folder = tempfile::tempdir().expect("a folder");
    trial(folder.path());
    let text = std::fs::read_to_string(folder.path().join("trial.csv")).expect("there");
    std::fs::write(folder.path().join("u.csv"), text.replace("pos_x [m]", "pos_x [furlong]")).expect("written");
    says(&refuse(folder.path(), &["estimate", "u.csv"]), &["u.csv", "pos_x", "furlong", "output", "--channels"]);
    succeed(folder.path(), &["estimate", "u.csv", "--channels", "pos_x=pos_x [m]"]);
    // A channel that is called nothing may be in volts.
    std::fs::write(folder.path().join("v.csv"), text.replace("force_x [N],pos_x [m]", "u [V],y [V]")).expect("written");
    succeed(folder.path(), &["estimate", "v.csv", "--input", "u", "--output", "y"]);
}

#[test]
fn what_would_give_a_wrong_number_is_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    let (force, flat) = (noise(1, 10_000), vec![0.3; 10_000]);
    let motion = oscillator(&force);
    let write = |name: &str, columns: &[(&str, &[f64])]| csv(&folder.path().join(name), "# sample_rate_hz: 500\n", columns);
    write("good.csv", &[("force_x [N]", &force), ("pos_x [m]", &motion)]);
    write("same.csv", &[("force_x [N]", &force), ("pos_x [m]", &motion)]);
    write("dead.csv", &[("force_x [N]", &force), ("pos_x [m]", &flat)]);
    write("mixed.csv", &[("force_x [N]", &force), ("angle_x [rad]", &motion)]);
    for (files, words) in [
        (&["good.csv", "same.csv"][..], &["same.csv", "good.csv", "each recording once"][..]),
        (&["dead.csv"], &["pos_x", "0.3 throughout", "sensor"]),
        (&["mixed.csv"], &["force_x", "angle_x", "one turns"]),
    ] {
        for command in ["fit", "estimate"] {
            says(&refuse(folder.path(), &[&[command], files].concat()), words);
        }
    }
    let slow: Vec<f64> = (0..10_000).map(|k| f64::from(2 * k)).collect();
    csv(&folder.path().join("ms.csv"), "", &[("time", &slow), ("force_x [N]", &force), ("pos_x [m]", &motion)]);
    let warned = ndof(folder.path(), &["check", "ms.csv"]);
    says(&String::from_utf8_lossy(&warned.stderr), &["unit-inferred", "time", "[ms]"]);
    std::fs::write(folder.path().join("wrist.toml"), "schema = \"ndof/kinematics/1\"\nkind = \"wrist\"\n").expect("written");
    let wrist = refuse(folder.path(), &["fit", "good.csv", "--kinematics", "wrist.toml", "--arm", "left", "--nperseg", "1024"]);
    says(&wrist, &["wrist.toml", "no use for arm"]);
}

#[test]
fn an_angle_that_begins_anew_after_a_turn_is_a_fault() {
    let folder = tempfile::tempdir().expect("a folder");
    let torque = noise(1, 10_000);
    let angle: Vec<f64> = oscillator(&torque).iter().map(|x| (x * 2000.0).rem_euclid(std::f64::consts::TAU)).collect();
    csv(&folder.path().join("wrap.csv"), "# sample_rate_hz: 500\n", &[("torque_fe [N m]", &torque), ("angle_fe [rad]", &angle)]);
    let result = json(folder.path(), &["check", "wrap.csv"]);
    let codes: Vec<_> = result["findings"].as_array().expect("a list").iter().map(|finding| finding["code"].clone()).collect();
    assert!(codes.iter().any(|code| code == "angle-wrapped") && result["verdict"] == "faulty", "{result}");
}
