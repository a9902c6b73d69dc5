//! Motions by which a robot's parameters show.

use ndof_devices::RobotConfig;
use ndof_joints::{Excitation, ExcitationError, ExcitationSearch, JointLimits, RANDOM_MOTIONS, excite};
use ndof_models::robot::Robot;

/// Samples of each harmonic, by which sums over a period are integrals.
const FINE: usize = 160;

/// Shoulder and elbow that lift, on a base that turns, with limits that hold.
const ARM: &str = r#"
schema = "ndof/robot/1"
name = "arm"
[[joints]]
name = "base"
mass_kg = 3.0
centre_m = [0.0, 0.02, 0.1]
inertia_kg_m2 = [0.02, 0.02, 0.015, 0.001, 0.0, 0.002]
viscous_nm_s_per_rad = 0.4
coulomb_nm = 0.6
range_rad = [-2.0, 2.0]
rate_limit_rad_per_s = 2.0
torque_limit_nm = 20.0
[[joints]]
name = "shoulder"
axis = [0.0, 1.0, 0.0]
origin_m = [0.0, 0.05, 0.2]
mass_kg = 4.0
centre_m = [0.15, 0.01, 0.0]
inertia_kg_m2 = [0.01, 0.05, 0.05, 0.0, 0.002, 0.0]
viscous_nm_s_per_rad = 0.5
coulomb_nm = 0.8
range_rad = [-1.5, 0.7]
rate_limit_rad_per_s = 1.5
torque_limit_nm = 24.0
[[joints]]
name = "elbow"
axis = [0.0, 1.0, 0.0]
origin_m = [0.35, 0.0, 0.0]
mass_kg = 2.0
centre_m = [0.12, 0.0, 0.02]
inertia_kg_m2 = [0.004, 0.02, 0.02, 0.0, 0.0, 0.001]
viscous_nm_s_per_rad = 0.2
coulomb_nm = 0.3
range_rad = [0.0, 2.4]
rate_limit_rad_per_s = 3.0
torque_limit_nm = 8.0
"#;

fn robot(text: &str) -> RobotConfig {
    RobotConfig::parse("arm.toml", text, None).expect("reads")
}

fn asked() -> ExcitationSearch {
    ExcitationSearch { starts: 2, rounds: 6, ..ExcitationSearch::default() }
}

fn found(text: &str, asked: &ExcitationSearch) -> Result<Excitation, ExcitationError> {
    let robot = robot(text);
    let (limits, _) = JointLimits::of(&robot, None, None)?;
    excite(&robot.chain().expect("builds"), &limits, asked)
}

#[test]
fn no_limit_is_passed_between_the_samples_and_the_margin_is_left() {
    let robot = robot(ARM);
    let chain = robot.chain().expect("builds");
    let (limits, _) = JointLimits::of(&robot, None, Some(&[6.0])).expect("limits");
    let found = excite(&chain, &limits, &asked()).expect("a motion");
    let (share, mut torque) = (1.0 - asked().margin, [0.0; 3]);
    // Ten times as fine as what the search checks in the end.
    let samples = 10 * FINE * asked().harmonics;
    for m in 0..samples {
        let at = found.motion.at(found.motion.period_s * m as f64 / samples as f64);
        chain.inverse_dynamics(&at.angles, &at.rates, &at.accelerations, &mut torque);
        for (j, torque) in torque.iter().enumerate() {
            let [low, high] = limits.range[j];
            let (middle, half) = (0.5 * (low + high), 0.5 * (high - low));
            let whole = torque + chain.joints().friction(j, at.rates[j]);
            // A torque is sampled; between two of 800 samples it turns within 1e-4 of its size.
            for (what, value, limit, more) in [
                ("angle", at.angles[j] - middle, half, 1e-12),
                ("rate", at.rates[j], limits.rate[j], 1e-12),
                ("acceleration", at.accelerations[j], 6.0, 1e-12),
                ("torque", whole, limits.torque[j], 1e-3),
            ] {
                assert!(value.abs() <= share * limit * (1.0 + more), "{what} of joint {j} at sample {m}: {value} of {limit}");
            }
        }
    }
    // A limit is what ends it: something of each joint is used to the full.
    for (j, used) in found.used.iter().enumerate() {
        let [low, high] = limits.range[j];
        let shares = [(used.angle[1] - used.angle[0]) / (high - low), used.rate / limits.rate[j], used.acceleration / 6.0, used.torque / limits.torque[j]];
        assert!(shares.iter().any(|s| *s > 0.7 * share), "{used:?}");
    }
}

#[test]
fn it_is_better_conditioned_than_any_random_motion_and_errors_are_smaller() {
    let (found, start) = (found(ARM, &asked()).expect("a motion"), found(ARM, &ExcitationSearch { rounds: 0, ..asked() }).expect("a motion"));
    assert_eq!(found.random_conditions.len(), RANDOM_MOTIONS);
    assert!(found.random_conditions.iter().all(|random| found.condition < *random), "{} of {:?}", found.condition, found.random_conditions);
    let size = |e: &Excitation| e.parameters.iter().map(|p| p.error_of_one_sample.ln()).sum::<f64>() / e.parameters.len() as f64 + e.condition.ln();
    assert!(size(&found) < size(&start));
}

#[test]
fn the_number_of_threads_changes_nothing_and_the_seed_does() {
    let with = |threads: usize, seed: u64| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        pool.install(|| found(ARM, &ExcitationSearch { seed, ..asked() }).expect("a motion"))
    };
    let one = with(1, 1);
    assert_eq!(one, with(2, 1));
    assert_ne!(one.motion, with(1, 2).motion);
}

#[test]
fn the_error_of_a_lone_inertia_is_the_noise_over_the_acceleration() {
    // Over a period ∫ q̈ f(q̇) dt = 0 for every f: friction takes nothing from the inertia, and its error is σ / rms q̈.
    let lone =
        "schema = \"ndof/robot/1\"\nname = \"wheel\"\n[[joints]]\nname = \"hub\"\ninertia_kg_m2 = [0.1, 0.1, 0.1, 0.0, 0.0, 0.0]\nrate_limit_rad_per_s = 3.0\n";
    let found = found(lone, &ExcitationSearch { torque_noise: Some(0.02), ..asked() }).expect("a motion");
    let names: Vec<&str> = found.parameters.iter().map(|p| p.name.as_str()).collect();
    assert_eq!(names, ["inertia_zz_hub_kg_m2 + rotor_hub_kg_m2", "viscous_hub", "coulomb_hub"]);
    let square: f64 = (0..FINE * 5).map(|m| found.motion.at(10.0 * m as f64 / (FINE * 5) as f64).accelerations[0].powi(2)).sum::<f64>() / (FINE * 5) as f64;
    let closed = 0.02 / square.sqrt();
    // The sign of the rate turns between two samples, which leaves a share of 1/samples of each turn.
    assert!((found.parameters[0].error_of_one_sample / closed - 1.0).abs() < 1e-3, "{} {closed}", found.parameters[0].error_of_one_sample);
    assert!((found.parameters[0].value - 0.1).abs() < 1e-12);
}

#[test]
fn parameters_of_interest_are_determined_better_than_beside_all_others() {
    let of_elbow = ExcitationSearch { interest: vec!["viscous_elbow".to_owned(), "coulomb_elbow".to_owned()], ..asked() };
    let (all, some) = (found(ARM, &asked()).expect("a motion"), found(ARM, &of_elbow).expect("a motion"));
    let marked: Vec<usize> = (0..some.parameters.len()).filter(|k| some.parameters[*k].of_interest).collect();
    assert_eq!(marked.iter().map(|k| some.parameters[*k].name.as_str()).collect::<Vec<_>>(), ["viscous_elbow", "coulomb_elbow"]);
    let size = |e: &Excitation| marked.iter().map(|k| e.parameters[*k].error_of_one_sample.ln()).sum::<f64>();
    assert!(size(&some) < size(&all), "{} {}", size(&some), size(&all));
    let by_joint = found(ARM, &ExcitationSearch { interest: vec!["elbow".to_owned()], ..asked() }).expect("a motion");
    assert!(by_joint.parameters.iter().filter(|p| p.of_interest).all(|p| p.name.split(" + ").next().is_some_and(|first| first.contains("elbow"))));
}

#[test]
fn what_cannot_be_is_refused_in_words() {
    let refused = |text: &str, asked: &ExcitationSearch| found(text, asked).expect_err("refused").to_string();
    let without = |line: &str| ARM.replacen(line, "", 1);
    assert!(refused(&ARM.replace("[0.0, 2.4]", "[0.5, 0.5]"), &asked()).contains("joint \"elbow\" cannot move: its range in the file is 0.5 to 0.5"));
    assert!(refused(&without("rate_limit_rad_per_s = 1.5"), &asked()).contains("joint \"shoulder\" has no speed limit"));
    assert!(refused(&ARM.replace("torque_limit_nm = 24.0", "torque_limit_nm = 1.0"), &asked()).contains("\"shoulder\" needs"));
    for (wrong, part) in [
        (ExcitationSearch { harmonics: 1, ..asked() }, "`fourier_terms=1`"),
        (ExcitationSearch { period_s: 0.0, ..asked() }, "`period=0`"),
        (ExcitationSearch { margin: 1.0, ..asked() }, "`margin=1`"),
        (ExcitationSearch { torque_noise: Some(-1.0), ..asked() }, "`torque_noise=-1`"),
        (ExcitationSearch { interest: vec!["wrist".to_owned()], ..asked() }, "called \"wrist\"; there are: base, shoulder, elbow, inertia"),
    ] {
        assert!(refused(ARM, &wrong).contains(part), "{wrong:?}: {}", refused(ARM, &wrong));
    }
    let robot = robot(&without("range_rad = [-2.0, 2.0]"));
    let (limits, assumed) = JointLimits::of(&robot, Some(&[1.0, 9.0, 1.0]), None).expect("limits");
    assert_eq!((limits.range[0], assumed), ([-std::f64::consts::PI, std::f64::consts::PI], vec!["base".to_owned()]));
    assert_eq!(limits.rate, [1.0, 1.5, 1.0]);
    assert!(JointLimits::of(&robot, Some(&[1.0, 2.0]), None).expect_err("refused").to_string().contains("has 2 values"));
    assert!(JointLimits::of(&robot, None, Some(&[0.0])).expect_err("refused").to_string().contains("above zero"));
}
