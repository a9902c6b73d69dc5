//! The built-in study of an arm that moves: what is found over the phase beside what was simulated.

use ndof_study::{file::StudyFile, run_study};

/// Four curves of about eight independent places each: the share of places that 95 % intervals hold scatters by 4 %, four times that is allowed.
const LEAST_HELD: f64 = 0.95 - 4.0 * 0.039;

#[test]
fn the_stiffness_over_the_movement_is_found_at_the_hand_and_at_the_joints() {
    let mut study = StudyFile::parse(include_str!("../../../examples/studies/arm_moving.toml"), "arm_moving.toml").expect("a study");
    study.experiment.trials = 3;
    let outcome = run_study(&study, None, None, &|_, _, _| ()).expect("a study");
    let found = outcome.fitted.result.schedule.expect("a schedule");
    assert_eq!((found.blocks, found.entries.len(), found.joint.len()), (60, 12, 12));
    for (entries, unit) in [(&found.entries, "N/m"), (&found.joint, "N m/rad")] {
        let stiffness: Vec<_> = entries.iter().filter(|entry| entry.name.starts_with('K')).collect();
        assert!(stiffness.iter().all(|entry| entry.unit == unit));
        let held: Vec<f64> = stiffness.iter().map(|entry| entry.holds().expect("simulated")).collect();
        assert!(held.iter().sum::<f64>() / 4.0 > LEAST_HELD, "{held:?} in {unit}");
        let range = |values: &[f64]| values.iter().fold(f64::NEG_INFINITY, |m, v| m.max(*v)) - values.iter().fold(f64::INFINITY, |m, v| m.min(*v));
        // The curve is one: it rises by more than its bands are wide.
        assert!(range(&stiffness[0].value) > 4.0 * stiffness[0].std_error.iter().sum::<f64>() / 101.0);
    }
    assert!(found.joint.iter().any(|entry| entry.name == "K_shoulder_elbow"));
}

#[test]
fn matrices_over_a_cycle_without_a_movement_are_refused() {
    let text = include_str!("../../../examples/studies/arm_moving.toml").replace("movement = {", "# movement = {");
    let study = StudyFile::parse(&text, "arm_moving.toml").expect("a study");
    let error = run_study(&study, None, None, &|_, _, _| ()).expect_err("refused").to_string();
    assert!(error.contains("controller.movement"), "{error}");
}
