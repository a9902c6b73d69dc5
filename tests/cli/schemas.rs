//! Every JSON that any command writes follows the schema that it names.

use crate::support::{ARM_URDF, csv, ndof, noise, oscillator, succeed, trial, violation};
use serde_json::Value;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// Three short trials of an arm, and what to do with them.
const STUDY: &str = r#"
    [experiment]
    trials = 3
    duration_s = 20.0
    [experiment.device]
    name = "mit-manus"
    [experiment.limb]
    name = "planar-two-link"
    K = [[67.0, 28.0], [28.0, 40.5]]
    B = [[2.46, 1.05], [1.05, 1.27]]
    [experiment.posture]
    joint_rad = [0.785, 1.571]
    [fit]
    band_hz = [0.5, 8.0]
    [kinematics]
    kind = "planar-two-link"
    link_lengths_m = [0.33, 0.34]
    posture_rad = [0.785, 1.571]
    [diagnose]
    [sensitivity]
    simulate = false
"#;

fn every_json(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).expect("a folder") {
        let path = entry.expect("an entry").path();
        if path.is_dir() {
            every_json(&path, found);
        } else if path.extension().is_some_and(|suffix| suffix == "json") {
            found.push(path);
        }
    }
}

#[test]
fn every_json_that_a_command_writes_follows_its_schema() {
    let folder = tempfile::tempdir().expect("a folder");
    let here = folder.path();
    trial(here);
    let force = noise(9, 10_000);
    csv(&here.join("other.csv"), "# sample_rate_hz: 500\n", &[("force_x [N]", &force), ("pos_x [m]", &oscillator(&force))]);
    std::fs::write(here.join("s.toml"), STUDY).expect("written");
    let run = |line: &str| {
        let words: Vec<&str> = line.split_whitespace().collect();
        succeed(here, &words);
    };
    run("check trial.csv --json check.json --quiet");
    run("estimate trial.csv other.csv --nperseg 1024 --spectra --robust --json estimate.json --quiet");
    run("estimate trial.csv --response impedance --json impedance.json --quiet");
    run("fit trial.csv --json fit.json --quiet");
    run("fit other.csv --cost paper --json other.json --quiet");
    run("compare fit.json other.json --json compare.json --quiet");
    run("compare fit.json other.json fit.json other.json --sessions 2 --json sessions.json --quiet");
    run("diagnose trial.csv other.csv --json diagnosis.json --quiet");
    run("live trial.csv --wait 0.1 --every 10 --json live.json --quiet");
    run("design --axes x,y --duration 20 --out cmd.csv --json design.json --quiet");
    std::fs::write(here.join("arm.urdf"), ARM_URDF).expect("written");
    run("design --robot arm.urdf --duration 20 --out motion.csv --json motion.json --quiet");
    run("study s.toml --out study --quiet --json study-fit.json");
    run("simulate s.toml --out sim.csv --quiet");
    let mut files = Vec::new();
    every_json(here, &mut files);
    let mut used = BTreeSet::new();
    for file in &files {
        let value: Value = serde_json::from_str(&std::fs::read_to_string(file).expect("text")).expect("JSON");
        let name = value["schema"].as_str().unwrap_or_else(|| panic!("{} names its schema", file.display())).to_owned();
        let schema: Value = serde_json::from_str(&succeed(here, &["schema", &name])).expect("JSON");
        assert_eq!(violation(&value, &schema, &schema, ""), None, "{}", file.display());
        assert!(value["ndof_version"].is_string(), "{}", file.display());
        used.insert(name);
    }
    println!("{} files of {used:?}", files.len());
    let known = String::from_utf8(ndof(here, &["schema", "nothing"]).stderr).expect("UTF-8");
    let listed: Vec<&str> = known.rsplit("there are: ").next().expect("a list").trim().split(", ").collect();
    for name in listed {
        assert!(used.contains(&format!("ndof/{name}/1")), "no command wrote {name}");
        // Each type that a table names has a table, records and words alike.
        let schema: Value = serde_json::from_str(&succeed(here, &["schema", name])).expect("JSON");
        let tables = succeed(here, &["schema", name, "--format", "markdown"]);
        for inner in schema["$defs"].as_object().into_iter().flatten().map(|(inner, _)| inner) {
            assert!(tables.contains(&format!("\n### {inner} in {name}\n")), "{inner} of {name} is told nowhere");
        }
    }
}
