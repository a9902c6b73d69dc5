//! Recordings with something hidden, made by a generator of its own, and what the diagnosis says of them.

use ndof_challenge::{Case, Hidden, Made, Plant, make};
use ndof_diagnose::{Baseline, Diagnosis, Options, Part, Status, Verdict, diagnose};
use ndof_models::effects::{Injection, Parameters, Setting, find};

fn case(plant: Plant, hidden: &[(&'static str, f64)], seed: u64) -> Case {
    let hidden = hidden.iter().map(|&(name, severity)| Hidden { name, severity }).collect();
    Case { plant, hidden, other: false, background: false, trials: 2, duration_s: 40.0, seed, command: (1.0, 1.0) }
}

fn answer(made: &Made) -> Diagnosis {
    diagnose(&made.recordings, &made.ports, &Options::default(), None, &mut |_| {}).expect("a diagnosis")
}

fn names(d: &Diagnosis) -> Vec<&str> {
    d.causes.iter().map(|c| c.effect.as_str()).filter(|e| *e != "limb-noise").collect()
}

fn number(d: &Diagnosis, cause: usize, parameter: &str) -> (f64, [f64; 2]) {
    let p = d.causes[cause].parameters.iter().find(|p| p.name.starts_with(parameter)).expect("the parameter");
    let ndof_models::effects::Value::Number(value) = p.value else { panic!("{parameter} is no number") };
    (value, p.ci95.expect("an interval"))
}

#[test]
fn each_strong_effect_is_named_first_on_one_axis() {
    for (k, (hidden, name)) in [
        ("coulomb-friction", "coulomb-friction"),
        ("hysteresis", "hysteresis"),
        ("cubic-stiffness", "cubic-stiffness"),
        ("asymmetric-stiffness", "asymmetric-stiffness"),
        ("dead-zone", "dead-zone"),
        ("end-stop", "end-stop"),
        ("reflex-delay", "reflex-delay"),
        ("reflex-one", "reflex-delay"),
        ("extra-resonance", "extra-resonance"),
        ("viscoelastic", "viscoelastic"),
        ("stiffness-drift", "stiffness-drift"),
        ("measurement-delay", "measurement-delay"),
        ("channel-filter", "channel-filter"),
        ("periodic-disturbance", "periodic-disturbance"),
    ]
    .into_iter()
    .enumerate()
    {
        let d = answer(&make(&case(Plant::Force, &[(hidden, 0.4)], 40 + k as u64)));
        assert_eq!(names(&d).first(), Some(&name), "{hidden}: {:?} {:?} {:?} {:?} {:?}", d.verdict, d.causes, d.minor, d.confusable, d.considered.first());
        assert!(d.causes[0].p_value < 1e-6);
    }
}

#[test]
fn a_hysteresis_is_measured_and_its_gain_is_nearly_all_there_is() {
    let made = make(&case(Plant::Force, &[("hysteresis", 0.3)], 7));
    let d = answer(&made);
    assert_eq!(names(&d), ["hysteresis"]);
    assert_eq!(d.verdict, Verdict::Explained);
    let (k, interval) = number(&d, 0, "stiffness");
    assert!((interval[0]..interval[1]).contains(&made.truth[0][0].1), "{k} {interval:?} {:?}", made.truth);
    assert!(d.causes[0].gain.explained_fraction.expect("a share") > 0.9);
    let (before, after) = (d.baseline.held_out.nrmse[0].expect("finite"), d.extended.held_out.nrmse[0].expect("finite"));
    assert!(after < 0.4 * before, "{before} -> {after}");
    // Without the hysteresis its loss had gone into the damping.
    assert!(d.extended.parameter_shift.iter().any(|s| s.name == "B" && s.before > s.after));
}

/// At rest a strong friction is anything between its levels: a balance of forces along a measured velocity takes it for more than it is.
#[test]
fn a_friction_that_sticks_is_measured_by_its_free_run() {
    for seed in 31..35 {
        let made = make(&case(Plant::Force, &[("coulomb-friction", 1.0)], seed));
        let d = answer(&made);
        assert_eq!(names(&d), ["coulomb-friction"]);
        let ((level, [low, high]), truth) = (number(&d, 0, "level"), made.truth[0][0].1);
        assert!(low <= truth && truth <= high && (level / truth - 1.0).abs() < 0.02, "{seed}: {level} ({low} … {high}) for {truth}");
        let own = d.extended.parameters.iter().find(|p| p.name == "M").expect("the mass");
        assert!((own.value - made.mass[0][0]).abs() < 3.0 * own.std_error.expect("an error"), "{seed}: {own:?} for {:?}", made.mass);
        let before = d.baseline.held_out.nrmse[0].expect("finite");
        assert!(d.extended.held_out.nrmse[0].is_some_and(|after| after < 0.3 * before), "{seed}: {before} -> {:?}", d.extended.held_out);
    }
}

/// K (1 + r D (0.6 - e^{-t / 0.4 D})): its slope is told over K(D / 2), and how fast it settles.
#[test]
fn a_stiffness_that_settles_is_told_with_its_rate() {
    for seed in [51, 52] {
        let made = make(&Case { other: true, ..case(Plant::Force, &[("stiffness-drift", 0.5)], seed) });
        let (d, duration) = (answer(&made), made.recordings[0].duration_s());
        assert_eq!(names(&d).first(), Some(&"stiffness-drift"), "{:?} {:?}", d.causes, d.minor);
        let rate = made.truth[0][0].1;
        let fraction = 2.5 * rate / (1.0 + rate * duration * (0.6 - (-1.25f64).exp()));
        for (parameter, truth) in [("settling", 2.5 / duration), ("fraction", fraction)] {
            let (value, [low, high]) = number(&d, 0, parameter);
            assert!(low <= truth && truth <= high, "{seed}: {parameter} {value} ({low} … {high}) for {truth}");
        }
    }
}

/// A damping that grows with the displacement is no wall without a stiffness, and not nothing either.
#[test]
fn a_wall_that_is_not_there_is_not_named_and_the_simulation_is_not_adequate() {
    for seed in [62, 63, 64] {
        let d = answer(&make(&case(Plant::Force, &[("x-van-der-pol", 0.5)], seed)));
        let wall = d.minor.iter().find(|m| m.effect == "end-stop").expect("what it was found by");
        assert!(wall.why.contains("its stiffness_n_per_m cannot be told from zero"), "{}", wall.why);
        assert!(names(&d).is_empty() && d.verdict == Verdict::Unexplained, "{:?} {:?}", d.verdict, names(&d));
    }
}

#[test]
fn a_law_that_is_known_is_no_cause() {
    let made = make(&case(Plant::Force, &[("coulomb-friction", 0.4)], 40));
    let (before, level) = (answer(&made), made.truth[0][0].1);
    let rows = |m: &[Vec<f64>]| m.to_vec();
    let setting = Setting {
        axes: 1,
        axis: Some(0),
        mass: rows(&made.mass),
        stiffness: rows(&made.stiffness),
        duration_s: 40.0,
        sample_rate_hz: made.recordings[0].sample_rate_hz(),
        seed: 0,
    };
    let friction = find("coulomb-friction").expect("an effect").inject(&Parameters::new([("level_n", level)]), &setting);
    let Ok(Injection::Force(law)) = friction else { panic!("a force") };
    let options = Options { known: vec![law.into()], ..Options::default() };
    let d = diagnose(&made.recordings, &made.ports, &options, None, &mut |_| {}).expect("a diagnosis");
    assert!(names(&d).is_empty() && d.verdict == Verdict::Adequate, "{:?} {:?}", d.verdict, d.causes);
    // The baseline runs with it as the extended model does that had to find it.
    let (known, found) = (d.baseline.held_out.nrmse[0].expect("finite"), before.extended.held_out.nrmse[0].expect("finite"));
    assert!(known < 1.1 * found, "{known} and {found}");
}

#[test]
fn nothing_hidden_is_adequate() {
    for (plant, seed) in [(Plant::Force, 1), (Plant::Force, 2), (Plant::Motion, 3), (Plant::Mass, 4), (Plant::Planar, 5)] {
        let d = answer(&make(&case(plant, &[], seed)));
        assert!(names(&d).is_empty() && d.verdict != Verdict::Unexplained, "{plant:?}: {:?} {:?} {:?}", d.verdict, d.causes, d.discrepancy.notes);
    }
}

#[test]
fn the_axis_is_right_in_a_loop() {
    let made = make(&case(Plant::Planar, &[("coulomb-friction", 0.4)], 11));
    let d = answer(&made);
    assert_eq!(names(&d).first(), Some(&"coulomb-friction"), "{:?}", d.causes);
    assert_eq!(d.causes[0].site.axis, ["x", "y"][made.axis]);
    assert_eq!(d.causes[0].site.side, "limb");
}

#[test]
fn motion_imposed_and_a_free_mass_are_taken_as_they_are() {
    for (plant, hidden) in [(Plant::Motion, "hysteresis"), (Plant::Mass, "coulomb-friction")] {
        let d = answer(&make(&case(plant, &[(hidden, 0.4)], 21)));
        assert_eq!(names(&d).first(), Some(&hidden), "{plant:?}: {:?} {:?}", d.verdict, d.causes);
        assert_eq!(d.split.windows_s.is_some(), plant == Plant::Mass);
    }
}

#[test]
fn two_effects_are_both_named() {
    let d = answer(&make(&case(Plant::Force, &[("hysteresis", 0.3), ("measurement-delay", 0.4)], 31)));
    let found = names(&d);
    assert!(found.contains(&"hysteresis") && found.iter().any(|n| ["measurement-delay", "channel-filter"].contains(n)), "{found:?}");
}

#[test]
fn what_no_registry_knows_is_not_given_a_confident_name() {
    let d = answer(&make(&case(Plant::Force, &[("x-quadratic-damping", 0.6)], 41)));
    assert!(matches!(d.verdict, Verdict::Unexplained | Verdict::PartlyExplained), "{:?} {:?}", d.verdict, d.causes);
    assert!(d.causes.iter().all(|c| c.probability <= 0.9), "{:?}", d.causes);
}

#[test]
fn a_hypothesis_that_is_taken_away_is_not_replaced_by_another_name() {
    let made = make(&case(Plant::Force, &[("coulomb-friction", 0.6)], 51));
    let options = Options { without: vec!["coulomb-friction".to_owned()], ..Options::default() };
    let d = diagnose(&made.recordings, &made.ports, &options, None, &mut |_| {}).expect("a diagnosis");
    assert_ne!(d.verdict, Verdict::Explained, "{:?}", d.causes);
    assert!(d.causes.iter().all(|c| c.probability <= 0.9), "{:?}", d.causes);
}

#[test]
fn mass_that_the_baseline_lacks_is_named_against_a_nominal_baseline() {
    let made = make(&case(Plant::Force, &[("added-mass", 0.5)], 61));
    let part = |value: &Vec<Vec<f64>>, status| Part { value: value.clone(), status, symmetric: true };
    let baseline = Baseline { mass: Some(part(&made.mass, Status::Fixed)), damping: None, stiffness: None };
    let d = diagnose(&made.recordings, &made.ports, &Options::default(), Some(&baseline), &mut |_| {}).expect("a diagnosis");
    // On one axis whose damping and stiffness are fitted, a gain of the effort is a mass that is missing, and the answer says so.
    let both = ["added-mass", "sensor-scale"];
    assert!(d.confusable.iter().any(|k| both.iter().all(|name| k.effects.iter().any(|e| e == name))), "{:?}", d.confusable);
    let share = 0.5 * 0.3;
    let told = match names(&d)[0] {
        "added-mass" => number(&d, 0, "mass_kg").0 / made.mass[0][0],
        "sensor-scale" => number(&d, 0, "factor").0 - 1.0,
        other => panic!("{other} {:?}", d.causes),
    };
    assert!((told / share - 1.0).abs() < 0.05, "{told}");
}

#[test]
fn units_do_not_matter() {
    let made = make(&case(Plant::Force, &[("cubic-stiffness", 0.3)], 71));
    let d = answer(&made);
    let mut small = made.recordings.clone();
    for r in &mut small {
        for name in r.names() {
            r.map_channel(&name, |v| v * 1e-3).expect("a channel");
        }
    }
    let e = diagnose(&small, &made.ports, &Options::default(), None, &mut |_| {}).expect("a diagnosis");
    assert_eq!(names(&d), names(&e));
    let (a, b) = (d.causes[0].gain.delta_bic, e.causes[0].gain.delta_bic);
    assert!((a - b).abs() < 1e-3 * a.abs(), "{a} {b}");
}

#[test]
fn threads_do_not_change_a_byte() {
    let made = make(&case(Plant::Force, &[("hysteresis", 0.2)], 81));
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
        pool.install(|| serde_json::to_string(&answer(&made)).expect("JSON"))
    };
    assert_eq!(on(1), on(2));
}
