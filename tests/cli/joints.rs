//! `ndof diagnose --robot` from outside: what a robot's own file, or its simulator, gets wrong in a log of its joints.

use crate::support::{ARM_URDF, csv, json, ndof, noise, refuse, succeed};
use serde_json::Value;
use std::path::Path;

/// A log of the arm on a designed motion: torques of its file, more at will of speed and angle of each joint, noise of 20 mN m and encoders of 14 bits.
fn log(folder: &Path, name: &str, more: impl Fn(usize, f64, f64) -> f64) {
    std::fs::write(folder.join("arm.urdf"), ARM_URDF).expect("written");
    if !folder.join("motion.csv").exists() {
        let asked = ["design", "--robot", "arm.urdf", "--sample-rate", "200", "--speed-limit", "2", "--out", "motion.csv", "--quiet"];
        succeed(folder, &asked);
    }
    let text = std::fs::read_to_string(folder.join("motion.csv")).expect("written");
    let mut lines = text.lines().filter(|line| !line.starts_with('#'));
    let header: Vec<String> = lines.next().expect("a header").split(',').map(|name| name.split(' ').next().unwrap_or("").to_owned()).collect();
    let rows: Vec<Vec<f64>> = lines.map(|line| line.split(',').map(|cell| cell.parse().expect("a number")).collect()).collect();
    let column = |name: &str| -> Vec<f64> {
        let at = header.iter().position(|h| h == name).unwrap_or_else(|| panic!("{name} in {header:?}"));
        rows.iter().map(|row| row[at]).collect()
    };
    let step = std::f64::consts::TAU / f64::from(1 << 14);
    let mut channels: Vec<(String, Vec<f64>)> = Vec::new();
    for (j, joint) in ["shoulder", "elbow"].into_iter().enumerate() {
        let (angle, speed) = (column(&format!("angle_{joint}")), column(&format!("vel_{joint}")));
        let scatter = noise(7 + j as u64, angle.len());
        let torque = column(&format!("torque_{joint}"));
        // Uniform noise of that width has a deviation of 20 mN m.
        let logged = (0..angle.len()).map(|k| torque[k] + more(j, speed[k], angle[k]) + 0.02 * 3.0_f64.sqrt() * scatter[k]).collect();
        channels.push((format!("torque_{joint} [N m]"), logged));
        channels.push((format!("angle_{joint} [rad]"), angle.iter().map(|q| (q / step).round() * step).collect()));
    }
    let named: Vec<(&str, &[f64])> = channels.iter().map(|(name, x)| (name.as_str(), x.as_slice())).collect();
    csv(&folder.join(name), "# sample_rate_hz: 200\n", &named);
}

fn causes(result: &Value) -> Vec<(String, String)> {
    let text = |v: &Value| v.as_str().unwrap_or("").to_owned();
    result["causes"].as_array().expect("a list").iter().map(|c| (text(&c["effect"]), text(&c["site"]["axis"]))).collect()
}

/// Value and interval of a cause's parameter.
fn parameter(result: &Value, cause: usize, name: &str) -> (f64, [f64; 2]) {
    let all = result["causes"][cause]["parameters"].as_array().expect("a list");
    let own = all.iter().find(|p| p["name"] == name).unwrap_or_else(|| panic!("{name} in {all:?}"));
    let number = |v: &Value| v.as_f64().expect("a number");
    (number(&own["value"]), [number(&own["ci95"][0]), number(&own["ci95"][1])])
}

#[test]
fn what_the_file_says_is_adequate_and_a_hidden_friction_is_named_at_its_joint() {
    let folder = tempfile::tempdir().expect("a folder");
    log(folder.path(), "same.csv", |_, _, _| 0.0);
    let same = json(folder.path(), &["diagnose", "same.csv", "--robot", "arm.urdf"]);
    assert_eq!((same["verdict"].as_str(), causes(&same)), (Some("adequate"), vec![]));

    log(folder.path(), "dry.csv", |j, v, _| if j == 1 { 0.4 * (v / 0.01).tanh() } else { 0.0 });
    let dry = json(folder.path(), &["diagnose", "dry.csv", "--robot", "arm.urdf"]);
    assert_eq!((dry["verdict"].as_str(), causes(&dry)), (Some("explained"), vec![("coulomb-friction".to_owned(), "elbow".to_owned())]));
    // Near its turns the sign of a speed that is known to one per cent is not: the level is short by no more than that share of the time.
    let (level, interval) = parameter(&dry, 0, "level_nm");
    assert!((level / 0.4 - 1.0).abs() < 0.01 && interval[0] < level && level < interval[1], "{level} {interval:?}");
    let held = |which: &str| dry[which]["held_out"]["nrmse"][1].as_f64().expect("a number");
    assert!(held("extended") < 0.5 * held("baseline"), "the elbow's held-out error falls: {} to {}", held("baseline"), held("extended"));
}

#[test]
fn a_friction_is_the_robots_whatever_a_simulator_has_of_it() {
    let folder = tempfile::tempdir().expect("a folder");
    // Measured: 0.9 N m s/rad at the shoulder, of which the simulator has two thirds, and the file nothing.
    log(folder.path(), "log.csv", |j, v, _| if j == 0 { 0.9 * v } else { 0.0 });
    log(folder.path(), "sim.csv", |j, v, _| if j == 0 { 0.6 * v } else { 0.0 });
    for (options, before) in [(vec![], 0.0), (vec!["--simulated", "sim.csv"], 0.6)] {
        let all: Vec<&str> = ["diagnose", "log.csv", "--robot", "arm.urdf"].into_iter().chain(options).collect();
        let found = json(folder.path(), &all);
        assert_eq!(causes(&found), vec![("viscous-friction".to_owned(), "shoulder".to_owned())], "{all:?}");
        let (viscous, _) = parameter(&found, 0, "viscous_nm_s_per_rad");
        let shift = &found["extended"]["parameter_shift"][0];
        let was = shift["before"].as_f64().expect("a number");
        assert!((viscous - 0.9).abs() < 0.02 && (was - before).abs() < 0.02, "{viscous} {shift}");
    }
}

/// A finger that hangs on the chain pulls at the joints before it.
#[test]
fn what_moves_beside_the_chain_is_told_and_no_name_is_sure() {
    let folder = tempfile::tempdir().expect("a folder");
    log(folder.path(), "log.csv", |j, v, _| if j == 1 { 0.4 * v } else { 0.0 });
    let finger = r#"<link name="finger"><inertial><mass value="0.1"/><inertia ixx="0.001" iyy="0.001" izz="0.001"/></inertial></link>
  <joint name="grip" type="continuous"><parent link="upper"/><child link="finger"/><axis xyz="0 0 1"/></joint>
</robot>"#;
    let text = std::fs::read_to_string(folder.path().join("arm.urdf")).expect("written");
    std::fs::write(folder.path().join("hand.urdf"), text.replace("</robot>", finger)).expect("written");
    let own = std::fs::read_to_string(folder.path().join("log.csv")).expect("written");
    let mut rows = own.lines().filter(|line| !line.starts_with('#'));
    let names = rows.next().expect("a header");
    let rows: Vec<&str> = rows.collect();
    for (reach, moves) in [(0.0, false), (0.8, true)] {
        let angle = |k: usize| reach * (0.02 * k as f64).sin();
        let with: Vec<String> = rows.iter().enumerate().map(|(k, row)| format!("{row},{:.6},0.0{}", angle(k), k % 2)).collect();
        let text = format!("# sample_rate_hz: 200\n{names},angle_grip [rad],torque_grip [N m]\n{}\n", with.join("\n"));
        std::fs::write(folder.path().join("held.csv"), text).expect("written");
        let found = json(folder.path(), &["diagnose", "held.csv", "--robot", "hand.urdf", "--tip", "fore"]);
        let told = found["warnings"].as_array().expect("a list").iter().any(|warning| warning["code"] == "moves-beside");
        let sure = found["causes"][0]["probability"].as_f64().expect("a number") > 0.6;
        assert_eq!((told, sure), (moves, !moves), "{reach}: {}", found["warnings"]);
    }
}

#[test]
fn a_joint_that_stands_still_leaves_the_others_to_be_judged() {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("arm.urdf"), ARM_URDF).expect("written");
    let swing: Vec<f64> = (0..4000).map(|k| (0.01 * f64::from(k)).sin()).collect();
    let channels: [(&str, &[f64]); 4] = [
        ("torque_shoulder [N m]", &noise(1, 4000)),
        ("torque_elbow [N m]", &noise(2, 4000)),
        ("angle_shoulder [rad]", &swing),
        ("angle_elbow [rad]", &vec![0.0; 4000]),
    ];
    csv(&folder.path().join("locked.csv"), "# sample_rate_hz: 200\n", &channels);
    let found = json(folder.path(), &["diagnose", "locked.csv", "--robot", "arm.urdf"]);
    // What the still link weighs is felt at the other joint, and may be wrong; a friction or gear of its own does nothing.
    let at_rest = |c: &Value| c["site"]["side"] == "joint" && c["site"]["axis"] == "elbow";
    assert!(!found["causes"].as_array().expect("a list").iter().any(at_rest), "{:?}", causes(&found));
}

#[test]
fn what_cannot_be_judged_is_refused_with_what_to_do() {
    let folder = tempfile::tempdir().expect("a folder");
    log(folder.path(), "log.csv", |_, _, _| 0.0);
    let said = |arguments: &[&str]| refuse(folder.path(), &[&["diagnose", "log.csv"], arguments].concat());
    assert!(said(&["--robot", "none.urdf"]).contains("none.urdf: cannot be read"));
    assert!(
        said(&["--robot", "arm.urdf", "--band", "0.5-8"]).contains("it is not for a `robot`")
            || said(&["--robot", "arm.urdf", "--band", "0.5-8"]).contains("--band")
    );
    assert!(said(&["--robot", "arm.urdf", "--without", "hysterese"]).contains("ndof list joints"));
    assert!(said(&["--robot", "arm.urdf", "--input", "torque_elbow", "--output", "angle_elbow"]).contains("2 moving joints"));
    log(folder.path(), "mad.csv", |_, v, _| if v > 1.0 { 1e200 } else { 0.0 });
    let mad = refuse(folder.path(), &["diagnose", "mad.csv", "--robot", "arm.urdf"]);
    assert!(mad.contains("beyond all bounds") && mad.contains("--exclude"), "{mad}");
    csv(&folder.path().join("short.csv"), "# sample_rate_hz: 200\n", &[("torque_shoulder [N m]", &noise(1, 100))]);
    assert!(said(&["--robot", "arm.urdf", "--simulated", "short.csv"]).contains("short.csv"));
    log(folder.path(), "one.csv", |_, v, _| 0.1 * v);
    log(folder.path(), "two.csv", |_, v, _| 0.2 * v);
    assert!(said(&["--robot", "arm.urdf", "--simulated", "one.csv", "two.csv"]).contains("1 measured recordings and 2 simulated ones"));
}

#[test]
fn what_is_wrong_with_a_robot_s_file_is_said_with_its_place_and_what_to_do() {
    let folder = tempfile::tempdir().expect("a folder");
    log(folder.path(), "log.csv", |_, _, _| 0.0);
    let said = |text: &[u8]| {
        std::fs::write(folder.path().join("wrong.urdf"), text).expect("written");
        let message = refuse(folder.path(), &["diagnose", "log.csv", "--robot", "wrong.urdf"]);
        assert!(!message.contains("simulating") && message.contains("wrong.urdf"), "{message}");
        message
    };
    assert!(said(ARM_URDF.replace("<robot", "<robot xmlns:xacro=\"x\"").replacen("value=\"", "value=\"${m} ", 1).as_bytes()).contains("run xacro first"));
    let latin: Vec<u8> = ARM_URDF.replacen("<link", "<!-- \u{e9} --><link", 1).chars().map(|c| c as u8).collect();
    assert!(said(&latin).contains("not UTF-8 but probably Latin-1"));
    let wide: Vec<u8> = std::iter::once(0xfeff).chain(ARM_URDF.encode_utf16()).flat_map(u16::to_le_bytes).collect();
    assert!(said(&wide).contains("line 1: the text is not UTF-8 but UTF-16"));
}

#[test]
fn a_joint_log_without_a_robot_says_what_is_missing() {
    let folder = tempfile::tempdir().expect("a folder");
    log(folder.path(), "log.csv", |_, _, _| 0.0);
    let told = |arguments: &[&str]| String::from_utf8_lossy(&ndof(folder.path(), &[&["diagnose", "log.csv"], arguments].concat()).stderr).into_owned();
    assert!(told(&[]).contains("warning[no-robot]") && told(&[]).contains("--robot"), "{}", told(&[]));
    assert!(!told(&["--robot", "arm.urdf"]).contains("no-robot"));
}

/// With a finger that slides on the hand and is not in the log.
#[test]
fn a_gripper_that_is_not_logged_is_held_still_with_a_note() {
    let folder = tempfile::tempdir().expect("a folder");
    log(folder.path(), "log.csv", |_, _, _| 0.0);
    let tip = ARM_URDF.rsplit_once("<child link=\"").and_then(|(_, rest)| rest.split_once('"')).expect("a last link").0;
    let finger = format!(
        "<link name=\"finger\"/><joint name=\"slide\" type=\"prismatic\"><parent link=\"{tip}\"/><child link=\"finger\"/><mimic joint=\"elbow\"/></joint></robot>"
    );
    std::fs::write(folder.path().join("grip.urdf"), ARM_URDF.replace("</robot>", &finger)).expect("written");
    let found = json(folder.path(), &["diagnose", "log.csv", "--robot", "grip.urdf"]);
    let warned =
        found["warnings"].as_array().expect("a list").iter().any(|w| w["code"] == "robot-file" && w["message"].as_str().is_some_and(|m| m.contains("slide")));
    assert!(warned && found["verdict"] == "adequate", "{} {}", found["verdict"], found["warnings"]);
}
