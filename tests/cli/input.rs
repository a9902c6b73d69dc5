//! What a recording is turned into before it is analysed: names, units, axes, clocks, posture; and what `check` says of it.

use crate::support::{csv, json, noise, oscillator, refuse, succeed, trial};
use serde_json::Value;
use std::path::Path;

fn stiffness(folder: &Path, arguments: &[&str]) -> f64 {
    let result = json(folder, &[&["fit"], arguments, &["--nperseg", "1024", "--band", "0.6-15"]].concat());
    result["parameters"].as_array().expect("a list").iter().find(|p| p["name"] == "K").expect("a stiffness")["value"].as_f64().expect("a value")
}

fn codes(result: &Value, list: &str) -> Vec<String> {
    result[list].as_array().expect("a list").iter().map(|entry| entry["code"].as_str().expect("a code").to_owned()).collect()
}

#[test]
fn columns_of_any_name_are_mapped_in_one_line_or_by_a_file() {
    let folder = tempfile::tempdir().expect("a folder");
    trial(folder.path());
    let text = std::fs::read_to_string(folder.path().join("trial.csv")).expect("there");
    std::fs::write(folder.path().join("lab.csv"), text.replace("force_x [N],pos_x [m]", "AI0,AI1")).expect("written");
    let truth = stiffness(folder.path(), &["trial.csv"]);
    assert_eq!(stiffness(folder.path(), &["lab.csv", "--channels", "force_x=AI0 [N],pos_x=AI1 [m]"]), truth);
    let file = "schema = \"ndof/channels/1\"\n[channels]\nforce_x = { from = \"AI0\", unit = \"kN\" }\npos_x = { from = \"AI1\", unit = \"m\" }\n";
    std::fs::write(folder.path().join("lab.toml"), file).expect("written");
    let kilo = stiffness(folder.path(), &["lab.csv", "--channels", "lab.toml"]);
    assert!((kilo / truth / 1000.0 - 1.0).abs() < 1e-9, "{kilo} is not a thousand times {truth}");
    let message = refuse(folder.path(), &["fit", "lab.csv", "--channels", "force_x=AI3,pos_x=AI1"]);
    assert!(message.contains("lab.csv") && message.contains("\"AI3\"") && message.contains("AI0, AI1"), "{message}");
    std::fs::write(folder.path().join("lab.toml"), file.replace("from", "form")).expect("written");
    assert!(refuse(folder.path(), &["fit", "lab.csv", "--channels", "lab.toml"]).contains("lab.toml:3"));
}

#[test]
fn strain_gauges_become_forces_by_a_matrix() {
    let folder = tempfile::tempdir().expect("a folder");
    let force = noise(1, 10_000);
    let other = noise(2, 10_000);
    // Gauges that each see both forces; their calibration is the inverse of [[2, 1], [1, 3]].
    let g1: Vec<f64> = force.iter().zip(&other).map(|(x, y)| 2.0 * x + y).collect();
    let g2: Vec<f64> = force.iter().zip(&other).map(|(x, y)| x + 3.0 * y).collect();
    csv(&folder.path().join("g.csv"), "# sample_rate_hz: 500\n", &[("g1 [V]", &g1), ("g2 [V]", &g2), ("pos_x [m]", &oscillator(&force))]);
    let file = "[transform]\nfrom = [\"g1\", \"g2\"]\nto = [\"force_x [N]\", \"force_y [N]\"]\nmatrix = [[0.6, -0.2], [-0.2, 0.4]]\n";
    std::fs::write(folder.path().join("c.toml"), file).expect("written");
    trial(folder.path());
    let (found, truth) = (stiffness(folder.path(), &["g.csv", "--channels", "c.toml", "--input", "force_x"]), stiffness(folder.path(), &["trial.csv"]));
    // Forces agree to round-off; a search ends where χ² no longer falls by a part in 10¹², parameters a part in 10⁶.
    assert!((found / truth - 1.0).abs() < 1e-6, "{found}, not {truth}");
}

#[test]
fn two_clocks_are_joined_by_a_channel_that_both_have() {
    let folder = tempfile::tempdir().expect("a folder");
    // A force without power near the Nyquist frequency, so that it can be interpolated: means over eight samples.
    let rough = noise(3, 10_008);
    let force: Vec<f64> = (0..10_000).map(|k| rough[k..k + 8].iter().sum::<f64>() / 8.0).collect();
    let motion = oscillator(&force);
    csv(&folder.path().join("one.csv"), "# sample_rate_hz: 500\n", &[("force_x [N]", &force), ("pos_x [m]", &motion)]);
    csv(&folder.path().join("robot.csv"), "# sample_rate_hz: 500\n", &[("force_x [N]", &force)]);
    // The camera began 0.3 s later and calls the shared signal "sync".
    csv(&folder.path().join("camera.csv"), "# sample_rate_hz: 500\n", &[("sync [N]", &force[150..]), ("pos_x [m]", &motion[150..])]);
    let truth = stiffness(folder.path(), &["one.csv", "--start", "0.3"]);
    let found = stiffness(folder.path(), &["robot.csv", "--align", "camera.csv", "--align-by", "force_x=sync"]);
    assert!((found / truth - 1.0).abs() < 1e-3, "{found}, not {truth}");
    // Without units in the files: those of --channels belong to either of them.
    let hundred: Vec<f64> = motion.iter().map(|x| 100.0 * x).collect();
    csv(&folder.path().join("bare.csv"), "# sample_rate_hz: 500\n", &[("f", &force)]);
    csv(&folder.path().join("bare_camera.csv"), "# sample_rate_hz: 500\n", &[("sync [N]", &force[150..]), ("p", &hundred[150..])]);
    let channels = |text: &str| std::fs::write(folder.path().join("c.toml"), format!("[channels]\n{text}")).expect("written");
    let bare = ["bare.csv", "--align", "bare_camera.csv", "--align-by", "f=sync", "--channels", "c.toml"];
    channels("force_x = { from = \"f\", unit = \"N\" }\npos_x = { from = \"p\", unit = \"cm\" }\n");
    let named = stiffness(folder.path(), &bare);
    // An optimum is known to the root of round-off.
    assert!((named / found - 1.0).abs() < 1e-8, "{named}, not {found}");
    channels("force_x = { from = \"f\", unit = \"N\" }\npos_x = { from = \"q\", unit = \"cm\" }\n");
    let neither = refuse(folder.path(), &[&["fit"], &bare[..]].concat());
    assert!(neither.contains("no channel \"q\"") && neither.contains("bare.csv") && neither.contains("bare_camera.csv"), "{neither}");
    let wrong = ["fit", "robot.csv", "--align", "camera.csv", "--align-by"];
    assert!(refuse(folder.path(), &[&wrong[..], &["force_x=synk"]].concat()).contains("camera.csv: no channel \"synk\" (did you mean \"sync\"?)"));
    assert!(refuse(folder.path(), &[&wrong[..], &["force_x=pos_x"]].concat()).contains("correlate"));
    assert!(refuse(folder.path(), &["fit", "robot.csv", "robot.csv", "--align", "camera.csv", "--align-by", "force_x=sync"]).contains("once for each"));
}

#[test]
fn laterality_and_posture_follow_from_shoulder_and_hand() {
    let folder = tempfile::tempdir().expect("a folder");
    succeed(folder.path(), &["simulate", "arm", "--out", "arm.csv"]);
    let fit = |extra: &[&str]| json(folder.path(), &[&["fit", "arm-1.csv", "--band", "0.5-8"], extra].concat())["joint"].clone();
    let (lengths, at) = (["--link-lengths", "0.33,0.34"], ["--shoulder", "-0.1,-0.45", "--hand", "0.0,0.0"]);
    let (right, left) = (fit(&[&lengths[..], &at].concat()), fit(&[&lengths[..], &at, &["--arm", "left"]].concat()));
    let elbow = |joint: &Value| joint["posture_rad"][1].as_f64().expect("an angle");
    assert!(elbow(&right) > 0.0 && (elbow(&right) + elbow(&left)).abs() < 1e-12, "{right} {left}");
    let text = "kind = \"planar-two-link\"\narm = \"right\"\nlink_lengths_m = [0.33, 0.34]\nshoulder_m = [-0.1, -0.45]\nhand_m = [0.0, 0.0]\n";
    std::fs::write(folder.path().join("arm.toml"), text).expect("written");
    assert_eq!(fit(&["--kinematics", "arm.toml"]), right);
    assert_eq!(fit(&["--kinematics", "arm.toml", "--arm", "left"]), left, "the command line goes before the file");
    let far = refuse(folder.path(), &[&["fit", "arm-1.csv", "--shoulder", "5,5", "--hand", "0,0"], &lengths[..]].concat());
    assert!(far.contains("reach") && far.contains("--shoulder"), "{far}");
    std::fs::write(folder.path().join("arm.toml"), text.replace("[0.33, 0.34]", "[0.33]")).expect("written");
    assert!(refuse(folder.path(), &["fit", "arm-1.csv", "--kinematics", "arm.toml"]).contains("arm.toml: link_lengths_m has 1"));
}

#[test]
fn check_says_what_is_wrong_with_the_clock() {
    let folder = tempfile::tempdir().expect("a folder");
    let force = noise(4, 4000);
    let motion = oscillator(&force);
    let file = |name: &str, time: &dyn Fn(usize) -> f64, keep: &dyn Fn(usize) -> bool| {
        let rows: String = (0..4000).filter(|k| keep(*k)).map(|k| format!("{:.6},{},{}\n", time(k), force[k], motion[k])).collect();
        std::fs::write(folder.path().join(name), format!("t [s],force_x [N],pos_x [m]\n{rows}")).expect("written");
    };
    let regular = |k: usize| k as f64 * 0.002;
    file("good.csv", &regular, &|_| true);
    file("gap.csv", &regular, &|k| !(1000..1007).contains(&k));
    file("jitter.csv", &|k| regular(k) + if k % 3 == 1 { 0.0004 } else { 0.0 }, &|_| true);
    let found = |name: &str| json(folder.path(), &["check", name]);
    assert!(!codes(&found("good.csv"), "findings").contains(&"sample-timing".to_owned()));
    for (name, parts) in [("gap.csv", ["7 samples lost", "line 1002"]), ("jitter.csv", ["jitter", "% of the median step"])] {
        let result = found(name);
        assert_eq!((&result["verdict"], &result["trials"][0]["sample_rate_hz"]), (&"faulty".into(), &500.0.into()), "{name}");
        let finding = result["findings"].as_array().expect("a list").iter().find(|f| f["code"] == "sample-timing").expect("a finding");
        let message = finding["message"].as_str().expect("text");
        assert!(parts.iter().all(|part| message.contains(part)), "{name}: {message}");
        assert!(finding["action"].as_str().expect("text").contains("--resample"), "{name}");
        assert!(refuse(folder.path(), &["estimate", name]).contains("irregular time"), "an estimate refuses what check tells");
    }
    // What lies in the part that is left out does no harm.
    let cut = json(folder.path(), &["estimate", "gap.csv", "--exclude", "1.9-2.1", "--nperseg", "256"]);
    assert_eq!(cut["trials"], 2);
}

#[test]
fn check_knows_swapped_and_crossed_columns_and_late_ones() {
    let folder = tempfile::tempdir().expect("a folder");
    let (fx, fy) = (noise(5, 8000), noise(6, 8000));
    let (x, y) = (oscillator(&fx), oscillator(&fy));
    // As a tachometer that is two samples late.
    let speed: Vec<f64> = (0..8000).map(|k| if k < 3 { 0.0 } else { (x[k - 2] - x[k - 3]) * 500.0 }).collect();
    let head = "# sample_rate_hz: 500\n";
    let write = |name: &str, columns: &[(&str, &[f64])]| csv(&folder.path().join(name), head, columns);
    write("good.csv", &[("force_x [N]", &fx), ("force_y [N]", &fy), ("pos_x [m]", &x), ("pos_y [m]", &y)]);
    write("swapped.csv", &[("force_x [N]", &x), ("pos_x [m]", &fx)]);
    write("crossed.csv", &[("force_x [N]", &fx), ("force_y [N]", &fy), ("pos_x [m]", &y), ("pos_y [m]", &x)]);
    write("late.csv", &[("force_x [N]", &fx), ("pos_x [m]", &x), ("vel_x [m/s]", &speed)]);
    let check = |name: &str| json(folder.path(), &["check", name]);
    let good = codes(&check("good.csv"), "findings");
    assert!(["channels-swapped", "axes-crossed", "lag"].iter().all(|code| !good.contains(&(*code).to_owned())), "{good:?}");
    for (name, code) in [("swapped.csv", "channels-swapped"), ("crossed.csv", "axes-crossed"), ("late.csv", "lag")] {
        assert!(codes(&check(name), "findings").contains(&code.to_owned()), "{name}: {:?}", codes(&check(name), "findings"));
    }
    // Two samples, and half a sample by which a difference of neighbours lies behind.
    let lag = check("late.csv")["trials"][0]["lags"][0]["lag_s"].as_f64().expect("a lag");
    assert!((lag - 0.005).abs() < 2e-4, "{lag}");
    // The analyses carry it.
    for command in ["estimate", "fit"] {
        assert!(codes(&json(folder.path(), &[command, "swapped.csv", "--band", "1-20"]), "warnings").contains(&"channels-swapped".to_owned()), "{command}");
    }
}

#[test]
fn without_a_reference_the_direct_estimate_is_what_is_fitted() {
    let folder = tempfile::tempdir().expect("a folder");
    let (command, other) = (noise(7, 8000), noise(8, 8000));
    let force: Vec<f64> = command.iter().zip(&other).map(|(c, o)| c + 0.3 * o).collect();
    let motion = oscillator(&force);
    csv(&folder.path().join("trial.csv"), "# sample_rate_hz: 500\n", &[("cmd_x [N]", &command), ("force_x [N]", &force), ("pos_x [m]", &motion)]);
    let estimate = |more: &[&str]| json(folder.path(), &[&["estimate", "trial.csv", "--nperseg", "1024"], more].concat());
    let (derived, direct) = (estimate(&[]), estimate(&["--reference", "none"]));
    assert!(derived["derived"].is_object() && direct["derived"].is_null() && direct["references"].as_array().is_some_and(Vec::is_empty));
    assert_eq!(derived["direct"]["re"], direct["direct"]["re"], "the direct estimate is the same");
}

#[test]
fn what_is_irregular_at_an_end_is_cut_off_by_exclude() {
    let folder = tempfile::tempdir().expect("a folder");
    let force = noise(5, 12_000);
    let motion = oscillator(&force);
    let time: Vec<f64> = (0..force.len()).map(|k| k as f64 * 0.002 + if k < 1000 && k % 3 == 0 { 0.0007 } else { 0.0 }).collect();
    csv(&folder.path().join("late.csv"), "", &[("t [s]", &time), ("force_x [N]", &force), ("pos_x [m]", &motion)]);
    assert!(refuse(folder.path(), &["estimate", "late.csv"]).contains("late.csv"));
    let cut = json(folder.path(), &["estimate", "late.csv", "--exclude", "0-2", "--nperseg", "1024"]);
    let start = json(folder.path(), &["estimate", "late.csv", "--start", "2", "--nperseg", "1024"]);
    assert_eq!(cut["direct"], start["direct"]);
}
