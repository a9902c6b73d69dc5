//! A simulation of the MIT-MANUS whose numbers are wrong: the wrong one is named and corrected, alone and two together.

use ndof_analysis::diagnose::result::DiagnosisResult;
use ndof_analysis::{Diagnose, Trial, Trials, diagnose};
use ndof_diagnose::{Cause, Verdict};
use ndof_models::effects::Value;
use ndof_study::file::{BaselineFile, ExperimentFile, parse};
use ndof_study::simulate;
use std::sync::OnceLock;

const EXPERIMENT: &str = include_str!("../../../examples/experiments/mit-manus.toml");
const WRONG: &str = include_str!("../../../examples/experiments/wrong-simulation.toml");
/// The line of the example that holds the robot's wrong numbers.
const NUMBERS: &str = "parameters = { link_2_m = 0.5400675, coulomb_1_nm = 0.54 }";

/// What the robot that made the recordings has.
const TRUTH: [(&str, f64); 4] = [("link_1_m", 0.4064), ("link_2_m", 0.51435), ("coulomb_1_nm", 0.27), ("coulomb_2_nm", 0.34)];

fn trials() -> &'static Trials {
    static TRIALS: OnceLock<Trials> = OnceLock::new();
    TRIALS.get_or_init(|| {
        let experiment: ExperimentFile = parse(EXPERIMENT, "mit-manus.toml").expect("understood");
        let made = simulate(&experiment, &|_, _, _| {}).expect("simulated");
        Trials::of(&Trial::numbered("trial", made.recordings)).expect("roles")
    })
}

/// The diagnosis against a simulation with these numbers wrong, with or without the handle.
fn judged(numbers: &[(&str, f64)], handle: bool) -> DiagnosisResult {
    let list = numbers.iter().map(|(name, value)| format!("{name} = {value}")).collect::<Vec<_>>().join(", ");
    let text = WRONG.replace(NUMBERS, &format!("parameters = {{ {list} }}"));
    let text = if handle { text.replace("[limb]\n", "[limb]\nhandle_mass_kg = 0.4\n") } else { text };
    let baseline: BaselineFile = parse(&text, "wrong-simulation.toml").expect("understood");
    baseline.check("wrong-simulation.toml").expect("makes sense");
    diagnose(trials(), &Diagnose { baseline: Some(baseline), ..Diagnose::default() }, &mut |_| {}).expect("a diagnosis").result
}

/// The parameter that a cause corrects, its value and interval.
fn corrected(cause: &Cause) -> (String, f64, [f64; 2]) {
    let number = |name: &str| {
        let p = cause.parameters.iter().find(|p| p.name == name).expect("the parameter");
        let Value::Number(value) = p.value else { panic!("{name} is no number") };
        (value, p.ci95.expect("an interval"))
    };
    if cause.effect == "added-mass" {
        let (value, interval) = number("mass_kg");
        return ("handle".to_owned(), value, interval);
    }
    let Some(Value::Text(name)) = cause.parameters.iter().find(|p| p.name == "name").map(|p| p.value.clone()) else { panic!("{cause:?}") };
    let (value, interval) = number("value");
    (name, value, interval)
}

fn asked(numbers: &[(&str, f64)], handle: bool) {
    let d = judged(numbers, handle).diagnosis;
    let mut found: Vec<(String, f64, [f64; 2])> = d.causes.iter().filter(|c| c.effect != "limb-noise").map(corrected).collect();
    found.sort_by(|a, b| a.0.cmp(&b.0));
    let mut wanted: Vec<&str> = numbers.iter().map(|n| n.0).chain((!handle).then_some("handle")).collect();
    wanted.sort_unstable();
    let names: Vec<&str> = found.iter().map(|f| f.0.as_str()).collect();
    println!("{numbers:?}, handle {handle}: {:?} {:?} {:?}", d.verdict, found, d.discrepancy.notes);
    for cause in &d.causes {
        println!("  {} {:?} {:?} {:?} {:?}", cause.effect, cause.probability, cause.gain.nrmse_before, cause.gain.nrmse_after, cause.evidence);
    }
    println!("  minor {:?} confusable {:?}", d.minor.iter().map(|m| &m.why).collect::<Vec<_>>(), d.confusable);
    assert_eq!(names, wanted, "{numbers:?}, handle {handle}: {:?}", d.minor);
    for (name, value, interval) in &found {
        let truth = TRUTH.iter().find(|t| t.0 == name).map_or(0.4, |t| t.1);
        assert!((interval[0]..interval[1]).contains(&truth), "{name} = {value} {interval:?}, {truth} is right");
    }
    for cause in d.causes.iter().filter(|c| c.effect != "limb-noise") {
        let side = if cause.effect == "added-mass" { "limb" } else { "robot" };
        let effect = if corrected(cause).0.starts_with("link") { "geometry-error" } else { cause.effect.as_str() };
        assert_eq!((cause.site.side.as_str(), cause.effect.as_str()), (side, effect));
        assert!(cause.probability >= 0.9, "{cause:?}");
    }
}

#[test]
fn a_right_simulation_is_adequate() {
    let d = judged(&[], true).diagnosis;
    assert!(d.causes.iter().all(|c| c.effect == "limb-noise"), "{:?}", d.causes);
    assert!(matches!(d.verdict, Verdict::Adequate | Verdict::Explained), "{} {:?}", d.verdict, d.discrepancy.notes);
}

#[test]
fn one_wrong_number_is_named_and_corrected() {
    asked(&[("link_1_m", 0.4064 * 1.05)], true);
    asked(&[("link_2_m", 0.51435 * 0.95)], true);
    asked(&[("coulomb_1_nm", 0.54)], true);
    asked(&[("coulomb_2_nm", 0.68)], true);
    asked(&[], false);
}

#[test]
fn two_wrong_numbers_are_both_named_and_corrected() {
    asked(&[("link_2_m", 0.51435 * 1.05), ("coulomb_1_nm", 0.54)], true);
    asked(&[("coulomb_1_nm", 0.54), ("coulomb_2_nm", 0.68)], true);
    asked(&[("link_1_m", 0.4064 * 0.95)], false);
    asked(&[("coulomb_2_nm", 0.68)], false);
}

#[test]
fn the_example_has_three_of_them() {
    asked(&[("link_2_m", 0.5400675), ("coulomb_1_nm", 0.54)], false);
}

#[test]
fn threads_do_not_change_a_byte_of_either_side() {
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
        pool.install(|| serde_json::to_string(&judged(&[("link_2_m", 0.5400675), ("coulomb_1_nm", 0.54)], true)).expect("JSON"))
    };
    let one = on(1);
    assert!(one.contains("\"robot\"") && one.contains("coulomb_1_nm"), "the robot's side is judged: {one}");
    assert_eq!(one, on(2));
}
