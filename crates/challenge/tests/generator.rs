//! What the exam's generator promises; no diagnosis is called.

use ndof_challenge::exam::families::{Family, Kind, OTHER, OUTSIDE, PAIRS, REGISTRY};
use ndof_challenge::exam::{Aim, Class, Question, Set, paper, pose, write};
use ndof_challenge::{Case, Hidden, Made, Plant, Setting, make_with, make_with_truth};
use std::collections::BTreeSet;

fn case(plant: Plant, hidden: &[(&'static str, f64)], duration_s: f64) -> Case {
    let hidden = hidden.iter().map(|&(name, severity)| Hidden { name, severity }).collect();
    Case { plant, hidden, other: false, background: false, trials: 1, duration_s, seed: 5, command: (1.0, 1.0) }
}

fn quiet() -> Setting {
    Setting { quiet: true, ..Setting::default() }
}

fn channels(made: &Made) -> Vec<(String, Vec<f64>)> {
    made.recordings.iter().flat_map(|r| r.channels()).map(|c| (c.name.clone(), c.samples.clone())).collect()
}

fn families() -> impl Iterator<Item = &'static Family> {
    REGISTRY.iter().chain(OTHER).chain(OUTSIDE)
}

/// Severity that vanishes, and the share of a channel's size that it may change: a thousand times as much, for what a law divides by.
const VANISHING: f64 = 1e-9;
const UNCHANGED: f64 = 1e-6;

#[test]
fn what_vanishes_leaves_the_linear_plant() {
    for family in families() {
        let plant = family.on.plants()[0].0;
        let with = channels(&make_with(&case(plant, &[(family.name, VANISHING)], 6.0), &quiet()));
        let without = channels(&make_with(&case(plant, &[], 6.0), &quiet()));
        for ((name, a), (_, b)) in with.iter().zip(&without) {
            let size = b.iter().fold(0.0, |most: f64, v| most.max(v.abs()));
            let change = a.iter().zip(b).fold(0.0, |most: f64, (a, b)| most.max((a - b).abs()));
            assert!(change <= UNCHANGED * size, "{}: {name} changes by {change:e} of {size:e}", family.name);
        }
    }
}

#[test]
fn what_is_strong_does_not() {
    for family in families() {
        let plant = family.on.plants()[0].0;
        let with = channels(&make_with(&case(plant, &[(family.name, 0.5)], 20.0), &quiet()));
        let without = channels(&make_with(&case(plant, &[], 20.0), &quiet()));
        let changed = with.iter().zip(&without).any(|((_, a), (_, b))| {
            let size = b.iter().fold(0.0, |most: f64, v| most.max(v.abs()));
            a.iter().zip(b).any(|(a, b)| (a - b).abs() > 1e-2 * size)
        });
        assert!(changed, "{}", family.name);
        assert!(with.iter().all(|(_, samples)| samples.iter().all(|v| v.is_finite())), "{}", family.name);
    }
}

/// The true model is the same plant on another grid and without the robot: what is left is the integrator's error, of second order in steps
/// of 0.25 ms at motions below 15 Hz: (2 π 15 · 0.25 ms)² / 24 of the motion, some tens of times over for stiff laws.
const ANOTHER_GRID: f64 = 2e-3;

#[test]
fn the_true_model_predicts_a_quiet_recording() {
    let hidden = ["coulomb-friction", "hysteresis", "dead-zone", "reflex-delay", "reflex-one", "extra-resonance", "viscoelastic", "stiffness-drift"];
    for plant in [Plant::Force, Plant::Planar] {
        for name in hidden {
            let (_, truth) = make_with_truth(&case(plant, &[(name, 0.3)], 20.0), &quiet());
            let truth = truth.expect("what can be predicted");
            assert!(truth.nrmse.iter().all(|e| *e < ANOTHER_GRID), "{name} on {}: {:?}", plant.word(), truth.nrmse);
        }
    }
}

#[test]
fn the_true_model_leaves_the_limbs_own_force_and_the_sensors_noise() {
    let (made, truth) = make_with_truth(&case(Plant::Force, &[], 50.0), &Setting::default());
    let truth = truth.expect("what can be predicted");
    let motion = &made.recordings[0].channels()[made.ports.outputs[0]].samples;
    let rms = (motion.iter().map(|v| v * v).sum::<f64>() / motion.len() as f64).sqrt();
    // Steps of 50 µm, noise of a quarter of one, and the force's noise through the plant, which is less than 0.3 %.
    let sensors = 5e-5 * (1.0 / 12f64 + 1.0 / 16.0).sqrt() / rms + 3e-3;
    assert!(truth.nrmse[0] <= (truth.own[0].powi(2) + sensors.powi(2)).sqrt() * 1.05, "{:?} {:?} {sensors}", truth.nrmse, truth.own);
    assert!(truth.nrmse[0] >= 0.9 * truth.own[0]);
}

#[test]
fn the_same_case_gives_the_same_bytes_and_a_twin_the_same_noise() {
    for plant in Plant::ALL {
        let once = make_with(&case(plant, &[("coulomb-friction", 0.3)], 3.0), &Setting::default());
        let again = make_with(&case(plant, &[("coulomb-friction", 0.3)], 3.0), &Setting::default());
        assert_eq!(channels(&once), channels(&again), "{}", plant.word());
    }
    let commands = |hidden: &[(&'static str, f64)]| {
        let made = make_with(&case(Plant::Planar, hidden, 3.0), &Setting::default());
        channels(&made).into_iter().filter(|c| c.0.starts_with("cmd")).collect::<Vec<_>>()
    };
    assert_eq!(commands(&[]), commands(&[("hysteresis", 0.5)]));
}

#[test]
fn half_of_the_families_are_held_back() {
    assert!(OUTSIDE.len() >= 20 && OUTSIDE.iter().map(|f| f.group).collect::<BTreeSet<_>>().len() >= 6);
    for list in [OTHER, OUTSIDE] {
        let held_back = list.iter().filter(|f| f.held_back).count();
        assert!(2 * held_back >= list.len(), "{held_back} of {}", list.len());
    }
    let names: BTreeSet<&str> = families().map(|f| f.name).collect();
    assert_eq!(names.len(), families().count(), "a family twice");
    let asked = |set: Set, kind: &str| -> BTreeSet<Vec<&'static str>> { paper(set).into_iter().filter(|q| q.kind == kind).map(|q| q.hidden).collect() };
    for kind in ["other", "outside", "pair"] {
        let (tuning, last) = (asked(Set::Tuning, kind), asked(Set::Final, kind));
        assert!(tuning.is_disjoint(&last) && !tuning.is_empty() && !last.is_empty(), "{kind}");
        assert!(asked(Set::Quick, kind).is_subset(&tuning) && asked(Set::Practice, kind).is_subset(&tuning), "{kind}");
    }
    let seeds = |set: Set| -> BTreeSet<u64> { paper(set).iter().map(|q| q.seed).collect() };
    let sets = [Set::Tuning, Set::Practice, Set::Final].map(seeds);
    assert!((0..3).all(|k| sets[k].is_disjoint(&sets[(k + 1) % 3])));
    assert!(PAIRS.iter().filter(|p| p.2).count() == PAIRS.len() / 2);
    assert!(paper(Set::Final).iter().filter(|q| q.kind == "null").count() >= 500);
}

#[test]
fn what_is_outside_has_no_name_of_the_registry() {
    for family in OUTSIDE {
        assert!(family.kind == Kind::Outside && family.name.starts_with("x-"));
        assert!(REGISTRY.iter().all(|f| f.effect() != family.effect()), "{}", family.name);
    }
}

fn question(hidden: &'static str, aim: Aim) -> Question {
    let family = REGISTRY.iter().find(|f| f.name == hidden).expect("a family");
    Question {
        id: format!("trial-{hidden}"),
        kind: "single",
        hidden: vec![hidden],
        families: vec![family],
        aim,
        plant: Plant::Force,
        setting: Setting { rate_hz: 200.0, ..Setting::default() },
        trials: 1,
        duration_s: 40.0,
        seed: 9,
    }
}

#[test]
fn strengths_are_what_was_aimed_at_and_the_truth_is_written() {
    let folder = tempfile::tempdir().expect("a folder");
    for (hidden, aim, class) in [("hysteresis", Aim::Clear, Class::Clear), ("dead-zone", Aim::Weak, Class::Weak)] {
        let posed = pose(&question(hidden, aim));
        assert_eq!(posed.class(), class, "{hidden}: {:?}", posed.strength);
        write(&posed, folder.path()).expect("files");
        let text = std::fs::read_to_string(folder.path().join(format!("trial-{hidden}.truth.json"))).expect("the truth");
        let truth: serde_json::Value = serde_json::from_str(&text).expect("JSON");
        for key in [
            "schema",
            "id",
            "generator",
            "kind",
            "family",
            "held_back",
            "class",
            "plant",
            "axes",
            "files",
            "arguments",
            "baseline",
            "trials",
            "duration_s",
            "sample_rate_hz",
            "effects",
            "strength",
            "present",
            "true_model",
        ] {
            assert!(truth.get(key).is_some(), "{key}");
        }
        let effect = &truth["effects"][0];
        assert_eq!(effect["effect"], hidden);
        assert!(effect["parameters"].as_object().is_some_and(|p| !p.is_empty() && p.values().all(serde_json::Value::is_number)));
        assert!(!effect["names"].as_array().expect("names").is_empty() && !effect["sides"].as_array().expect("sides").is_empty());
        let csv = std::fs::read_to_string(folder.path().join(truth["files"][0].as_str().expect("a file"))).expect("a recording");
        assert_eq!(csv.lines().count(), 2 + 40 * 200);
        assert!(csv.starts_with("# sample_rate_hz: 200\nforce_x [N],pos_x [m],cmd_x [N]\n"));
    }
}
