//! What a diagnosis of joint logs finds where little of the log shows it.

use ndof_devices::{Corrected, Correction, RobotConfig, SerialChain};
use ndof_diagnose::{Diagnosis, Verdict};
use ndof_joints::{Options, corrections, diagnose};
use ndof_models::robot::Robot;
use ndof_signal::{Channel, Quantity, Recording, Unit};
use ndof_sysid::Ports;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use swinging::swinging;

mod swinging;

const PENDULUM: &str = r#"
schema = "ndof/robot/1"
name = "pendulum"
joints = [{ name = "elbow", axis = [0.0, 1.0, 0.0], mass_kg = 2.0, centre_m = [0.3, 0.0, 0.0] }]
"#;
const RATE_HZ: f64 = 100.0;
/// Of the torque's noise (N m).
const NOISE: f64 = 0.05;

/// A log of so many samples of a pendulum: the encoder's angle and the torque without noise at a time, and the noise's next value.
fn log(samples: u32, angle: impl Fn(f64) -> f64, torque: impl Fn(f64) -> f64, mut noise: impl FnMut() -> f64) -> Recording {
    let step = std::f64::consts::TAU / 4096.0;
    let times = || (0..samples).map(|k| f64::from(k) / RATE_HZ);
    let angles = times().map(|t| (angle(t) / step).round() * step).collect();
    let torques = times().map(|t| torque(t) + noise()).collect();
    let channel = |name: &str, quantity, samples| Channel::new(name, Unit::si(quantity, true), samples);
    let channels = vec![channel("torque_elbow", Quantity::Effort, torques), channel("angle_elbow", Quantity::Displacement, angles)];
    Recording::new(RATE_HZ, channels).expect("channels of one length")
}

fn found(logs: &[Recording]) -> Diagnosis {
    let ports = Ports { references: vec![], inputs: vec![0], outputs: vec![1] };
    let chain = RobotConfig::parse("pendulum.toml", PENDULUM, None).and_then(|c| c.chain()).expect("a robot");
    diagnose(&chain, logs, &[], &ports, &Options::default(), &mut |_| {}).expect("an answer").0
}

/// What is found in one such log.
fn logged(samples: u32, angle: impl Fn(f64) -> f64, torque: impl Fn(f64) -> f64, noise: impl FnMut() -> f64) -> Diagnosis {
    found(&[log(samples, angle, torque, noise)])
}

/// Half of the time over which derivatives are differences (s).
const H: f64 = 1e-3;

fn rate(f: impl Fn(f64) -> f64, t: f64) -> f64 {
    (f(t + H) - f(t - H)) / (2.0 * H)
}

fn acceleration(f: impl Fn(f64) -> f64, t: f64) -> f64 {
    (f(t + H) - 2.0 * f(t) + f(t - H)) / (H * H)
}

/// What the file's body needs on a path.
fn needed(path: impl Fn(f64) -> f64, t: f64) -> f64 {
    0.18 * acceleration(&path, t) - 2.0 * 9.81 * 0.3 * path(t).cos()
}

/// White, of this standard deviation.
fn white(deviation: f64, seed: u64) -> impl FnMut() -> f64 {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    move || deviation * 12_f64.sqrt() * (rng.random::<f64>() - 0.5)
}

/// A minute on `path`, with `beyond` of the angle on top of what its body needs.
fn judged(path: impl Fn(f64) -> f64, beyond: impl Fn(f64) -> f64) -> Diagnosis {
    logged(6000, &path, |t| needed(&path, t) + beyond(path(t)), white(NOISE, 7))
}

fn interval(diagnosis: &Diagnosis, effect: &str, name: &str) -> Option<[f64; 2]> {
    diagnosis.causes.iter().find(|c| c.effect == effect)?.parameters.iter().find(|p| p.name == name)?.ci95
}

fn wave(t: f64) -> f64 {
    0.5 * (1.3 * t).sin() + 0.3 * (2.9 * t).sin()
}

/// What acts in one block of time scatters over the blocks as much as it gains.
#[test]
fn a_stop_that_is_touched_once_in_what_was_held_out_is_found() {
    let swell = |t: f64| 1.0 + 0.4 * (-((t - 20.0) / 3.0).powi(2)).exp() + 0.4 * (-((t - 54.6) / 1.5).powi(2)).exp();
    let found = judged(|t| swell(t) * wave(t), |q| 12.0 * (q - 0.85).max(0.0));
    let named: Vec<&str> = found.causes.iter().map(|c| c.effect.as_str()).collect();
    assert_eq!(named, ["end-stop"], "{:?} {:?}", found.verdict, found.minor);
    let [low, high] = interval(&found, "end-stop", "stop_rad").expect("an interval");
    assert!(low < 0.85 && 0.85 < high, "{low} {high}");
}

/// As rubber is, and a simulator's soft constraint: what its damping takes is no torque that is logged at another time.
#[test]
fn a_stop_that_is_damped_is_one_cause() {
    for (stiffness, ahead_s) in [(25.0, 0.04), (8.0, 0.15)] {
        let push = |t: f64| if wave(t) > 0.55 { stiffness * (wave(t) - 0.55 + ahead_s * rate(wave, t)).max(0.0) } else { 0.0 };
        let found = logged(6000, wave, |t| needed(wave, t) + push(t), white(NOISE, 7));
        let named: Vec<&str> = found.causes.iter().map(|c| c.effect.as_str()).collect();
        assert_eq!((named, found.verdict), (vec!["end-stop"], Verdict::Explained), "{stiffness} {:?}", found.minor);
        for (name, truth) in [("stiffness_nm_per_rad", stiffness), ("stop_rad", 0.55), ("ahead_s", ahead_s)] {
            let [low, high] = interval(&found, "end-stop", name).expect("an interval");
            assert!(low < truth && truth < high, "{name} {truth} {low} {high}");
        }
    }
}

/// What the held-out part does not show cannot be judged by it; to call that adequate would be wrong.
#[test]
fn a_stop_that_is_touched_in_what_was_fitted_alone_is_told() {
    let swell = |t: f64| 1.0 + 0.4 * (-((t - 20.0) / 3.0).powi(2)).exp();
    let found = judged(|t| swell(t) * wave(t), |q| 12.0 * (q - 0.85).max(0.0));
    assert_eq!((found.causes.len(), found.verdict), (0, Verdict::Unexplained), "{:?}", found.minor);
    let why: Vec<&str> = found.minor.iter().filter(|m| m.effect == "end-stop").map(|m| m.why.as_str()).collect();
    assert!(why.len() == 1 && why[0].contains("hold out another stretch"), "{:?}", found.minor);
    let quiet = judged(wave, |_| 0.0);
    assert_eq!((quiet.causes.len(), quiet.verdict), (0, Verdict::Adequate), "{:?}", quiet.minor);
}

/// From place to place and a rest at each, as robots are programmed: a weight that is held is no torque that moves.
#[test]
fn a_late_torque_of_a_joint_that_rests_now_and_then_is_a_delay() {
    const PERIOD_S: f64 = 4.0;
    const MOVING_S: f64 = 2.2;
    let place = |k: f64| 0.7 * (2.3 * k).sin();
    let path = |t: f64| {
        let k = (t / PERIOD_S).floor();
        let u = ((t - k * PERIOD_S) / MOVING_S).min(1.0);
        place(k) + (place(k + 1.0) - place(k)) * u.powi(3) * (10.0 - 15.0 * u + 6.0 * u * u)
    };
    for late_s in [0.013, 0.05] {
        let found = logged(6000, path, |t| needed(path, t - late_s), white(NOISE, 7));
        let named: Vec<&str> = found.causes.iter().map(|c| c.effect.as_str()).collect();
        assert_eq!((named, found.verdict), (vec!["torque-delay"], Verdict::Explained), "{late_s} {:?}", found.minor);
        let [low, high] = interval(&found, "torque-delay", "delay_s").expect("an interval");
        assert!(low < late_s && late_s < high && high - low < 0.5 / RATE_HZ, "{late_s}: {low} {high}");
    }
}

#[test]
fn what_a_joint_that_slides_lacks_is_of_newtons_and_metres() {
    let file = PENDULUM.replace("axis = [0.0, 1.0, 0.0]", "kind = \"prismatic\", axis = [1.0, 0.0, 0.0]");
    let chain = RobotConfig::parse("slide.toml", &file, None).and_then(|c| c.chain()).expect("a robot");
    let own = log(6000, wave, |t| 2.0 * acceleration(wave, t) + 0.9 * rate(wave, t), white(NOISE, 7));
    let ports = Ports { references: vec![], inputs: vec![0], outputs: vec![1] };
    let found = diagnose(&chain, &[own], &[], &ports, &Options::default(), &mut |_| {}).expect("an answer").0;
    let units: Vec<&str> = found.causes.iter().flat_map(|c| &c.parameters).map(|p| p.unit.as_str()).collect();
    let file: Vec<&str> = found.baseline.parameters.iter().map(|p| p.unit.as_str()).collect();
    assert_eq!((units, file), (vec!["N s/m"], vec!["N", "N s/m", "kg", "kg"]));
}

/// As MuJoCo's dry friction is one: what turns before the joint does is no torque that is logged early.
#[test]
fn friction_that_is_a_soft_constraint_is_one_cause() {
    let (ahead_s, speed) = (0.0095, 0.03);
    let soft = |t: f64| ((rate(wave, t) + ahead_s * acceleration(wave, t)) / speed).clamp(-1.0, 1.0);
    let found = logged(6000, wave, |t| needed(wave, t) + 1.2 * soft(t), white(NOISE, 7));
    let named: Vec<&str> = found.causes.iter().map(|c| c.effect.as_str()).collect();
    assert_eq!((named, found.verdict), (vec!["coulomb-friction"], Verdict::Explained), "{:?}", found.minor);
    for (name, truth) in [("level_nm", 1.2), ("ahead_s", ahead_s), ("turning_speed_rad_per_s", speed)] {
        let [low, high] = interval(&found, "coulomb-friction", name).expect("an interval");
        assert!(low < truth && truth < high, "{name} {low} {high}");
    }
}

/// What it pulls in the middle of the movement is its own, not an offset of the sensor.
#[test]
fn a_spring_that_rests_elsewhere_is_one_cause_with_its_rest() {
    let found = judged(wave, |q| 4.0 * (q - 0.7));
    let named: Vec<&str> = found.causes.iter().map(|c| c.effect.as_str()).collect();
    assert_eq!((named, found.verdict), (vec!["cable-force"], Verdict::Explained), "{:?}", found.minor);
    for (name, truth) in [("spring_nm_per_rad", 4.0), ("rest_rad", 0.7)] {
        let [low, high] = interval(&found, "cable-force", name).expect("an interval");
        assert!(low < truth && truth < high && high - low < 0.05 * truth, "{name} {low} {high}");
    }
}

/// Where a file's spring rests and where its torque's sensor has its zero are one number.
#[test]
fn a_rest_of_the_files_spring_is_not_told_from_an_offset() {
    let text = PENDULUM.replace("mass_kg", "stiffness_nm_per_rad = 12.0, mass_kg");
    let chain = RobotConfig::parse("pendulum.toml", &text, None).and_then(|c| c.chain()).expect("a robot");
    let own = log(6000, wave, |t| needed(wave, t) + 12.0 * (wave(t) - 0.3), white(NOISE, 7));
    let ports = Ports { references: vec![], inputs: vec![0], outputs: vec![1] };
    let found = diagnose(&chain, std::slice::from_ref(&own), &[], &ports, &Options::default(), &mut |_| {}).expect("an answer").0;
    let named: Vec<(&str, f64)> = found.causes.iter().map(|c| (c.effect.as_str(), c.probability)).collect();
    assert_eq!((named, found.verdict), (vec![("spring-rest", 0.5)], Verdict::Explained), "{:?}", found.minor);
    assert!(found.confusable[0].effects.contains(&"torque-offset at elbow".to_owned()), "{:?}", found.confusable);
    let [low, high] = interval(&found, "spring-rest", "rest_rad").expect("an interval");
    assert!(low < 0.3 && 0.3 < high, "{low} {high}");
    let written = corrections(&chain, &[own], &ports, &found, &Options::default()).expect("of these");
    assert!(written.list.is_empty() && written.left_out[0].contains("the same torque"), "{written:?}");
}

/// One that takes most of the weight away is no controller that takes all of it.
#[test]
fn an_offset_of_about_the_weight_is_an_offset() {
    for offset in [-5.0, -3.0, 5.0] {
        let found = judged(wave, |_| -offset);
        let named: Vec<&str> = found.causes.iter().map(|c| c.effect.as_str()).collect();
        assert_eq!((named, found.verdict), (vec!["torque-offset"], Verdict::Explained), "{offset} {:?}", found.discrepancy.notes);
    }
}

/// A soft spring that rests many turns away pulls alike everywhere, and is none.
#[test]
fn a_torque_that_is_alike_everywhere_is_an_offset_and_no_spring() {
    for seed in [7, 8, 9] {
        let found = logged(6000, wave, |t| needed(wave, t) + 0.4, white(NOISE, seed));
        let named: Vec<(&str, bool)> = found.causes.iter().map(|c| (c.effect.as_str(), c.probability > 0.95)).collect();
        assert_eq!(named, [("torque-offset", true)], "{:?}", found.confusable);
    }
}

/// A file with such a friction whose level is wrong: the speed over which it turns is wrong with it, and is no second cause.
#[test]
fn another_level_of_a_soft_constraint_is_one_cause() {
    let (ahead_s, own, level) = (0.0095, 0.8, 1.2);
    // It turns over 0.02 rad/s at its own level; the mobility is 1/0.18.
    let softness = 0.02 * 0.18 / (own * ahead_s);
    let file = PENDULUM.replace("mass_kg", &format!("coulomb_nm = {own}, friction_ahead_s = {ahead_s}, friction_softness = {softness}, mass_kg"));
    let chain = RobotConfig::parse("soft.toml", &file, None).and_then(|c| c.chain()).expect("a robot");
    let soft = |t: f64| ((rate(wave, t) + ahead_s * acceleration(wave, t)) / (0.02 * level / own)).clamp(-1.0, 1.0);
    let own = log(6000, wave, |t| needed(wave, t) + level * soft(t), white(0.01, 7));
    let ports = Ports { references: vec![], inputs: vec![0], outputs: vec![1] };
    let found = diagnose(&chain, &[own], &[], &ports, &Options::default(), &mut |_| {}).expect("an answer").0;
    let named: Vec<&str> = found.causes.iter().map(|c| c.effect.as_str()).collect();
    assert_eq!((named, found.verdict), (vec!["coulomb-friction"], Verdict::Explained), "{:?} {:?}", found.causes, found.minor);
    let [low, high] = interval(&found, "coulomb-friction", "level_nm").expect("an interval");
    assert!(low < level && level < high && high - low < 0.05, "{low} {high}");
}

/// A file whose friction turns at once, as URDF knows no other, beside a robot's that turns over a speed or ahead: the level is right, and how it turns is what is missing.
#[test]
fn a_friction_of_the_file_that_turns_otherwise_is_that_and_its_level_stays() {
    let (level, ahead_s, speed) = (1.2, 0.0095, 0.03);
    let chain = RobotConfig::parse("hard.toml", &PENDULUM.replace("mass_kg", &format!("coulomb_nm = {level}, mass_kg")), None)
        .and_then(|c| c.chain())
        .expect("a robot");
    let soft = |t: f64| ((rate(wave, t) + ahead_s * acceleration(wave, t)) / speed).clamp(-1.0, 1.0);
    let own = log(6000, wave, |t| needed(wave, t) + level * soft(t), white(0.01, 7));
    let ports = Ports { references: vec![], inputs: vec![0], outputs: vec![1] };
    let found = diagnose(&chain, &[own], &[], &ports, &Options::default(), &mut |_| {}).expect("an answer").0;
    let named: Vec<&str> = found.causes.iter().map(|c| c.effect.as_str()).collect();
    assert_eq!((named, found.verdict), (vec!["coulomb-friction"], Verdict::Explained), "{:?} {:?}", found.causes, found.minor);
    for (name, truth) in [("level_nm", level), ("ahead_s", ahead_s), ("turning_speed_rad_per_s", speed)] {
        let [low, high] = interval(&found, "coulomb-friction", name).expect("an interval");
        assert!(low < truth && truth < high, "{name} {low} {high}");
    }
}

#[test]
fn a_torque_with_its_sign_turned_round_is_a_gain_below_zero() {
    let found = logged(6000, wave, |t| -needed(wave, t), white(NOISE, 7));
    assert_eq!((found.verdict, found.causes.len()), (Verdict::Explained, 1), "{:?}", found.causes);
    let [low, high] = interval(&found, "torque-scale", "scale").expect("an interval");
    assert!(low < -1.0 && -1.0 < high && high - low < 0.05, "{low} {high}");
    // What is corrected is no suspicion any more.
    assert!(found.discrepancy.notes.iter().all(|note| !note.contains("goes against")), "{:?}", found.discrepancy.notes);
}

/// Of both joints: two masses and two frictions too large by as much would be four causes that are not there.
#[test]
fn one_gain_of_all_torques_is_one_cause() {
    let friction = [0.4, 0.2];
    let text = r#"
schema = "ndof/robot/1"
name = "two"
joints = [
  { name = "shoulder", axis = [0.0, 1.0, 0.0], mass_kg = 2.0, centre_m = [0.3, 0.0, 0.0], viscous_nm_s_per_rad = 0.4 },
  { name = "elbow", origin_m = [0.6, 0.0, 0.0], axis = [0.0, 1.0, 0.0], mass_kg = 1.0, centre_m = [0.2, 0.0, 0.0], viscous_nm_s_per_rad = 0.2 },
]
"#;
    let found = of_two(text, |[q, v, _], torque| ([0, 1].map(|j| 2.0 * (torque[j] + friction[j] * v[j])), q));
    assert_eq!((found.verdict, found.causes.len()), (Verdict::Explained, 1), "{:?}", found.causes);
    assert!(found.causes[0].site.axis.is_empty(), "{:?}", found.causes[0].site);
    let [low, high] = interval(&found, "torque-scale", "scale").expect("an interval");
    assert!((0.5 * (low + high) - 2.0).abs() < 1e-3 && high - low < 5e-3, "{low} {high}");
}

/// Of a link on an axis that meets the upright one before it, a first moment along the second axis makes no torque but for round-off.
#[test]
fn what_no_joint_feels_of_a_link_is_not_told() {
    let text = |mass: f64| {
        format!(
            r#"
schema = "ndof/robot/1"
name = "two"
joints = [
  {{ name = "shoulder", axis = [0.0, 0.0, 1.0], mass_kg = 2.0, centre_m = [0.0, 0.0, 0.1], inertia_kg_m2 = [0.01, 0.01, 0.01, 0.0, 0.0, 0.0] }},
  {{ name = "elbow", origin_m = [0.0, 0.0, 0.2], axis = [0.0, 1.0, 0.0], mass_kg = {mass}, centre_m = [0.2, 0.0, 0.0], inertia_kg_m2 = [0.001, 0.01, 0.01, 0.0, 0.0, 0.0] }},
]
"#
        )
    };
    let heavier = chain_of(&text(1.4));
    let found = of_two(&text(1.0), |[q, v, a], _| {
        let mut torque = [0.0; 2];
        heavier.inverse_dynamics(&q, &v, &a, &mut torque);
        // A little of what the file's shape cannot say.
        (torque.map(|t| t + 0.02), q)
    });
    assert_eq!((found.causes[0].effect.as_str(), found.causes[0].site.axis.as_str()), ("link-parameters", "elbow"), "{:?}", found.causes);
    let names = || found.causes.iter().flat_map(|cause| &cause.parameters);
    assert!(names().all(|p| !p.name.ends_with("moment_y_kg_m")), "{:?}", names().collect::<Vec<_>>());
}

/// What was found beside a simulator's own friction is the robot's, whatever the file says: the simulator has none of the file's, or more than the robot.
#[test]
fn frictions_are_the_robots_whatever_a_simulator_has() {
    let file = PENDULUM.replace("mass_kg", "viscous_nm_s_per_rad = 0.5, mass_kg");
    let chain = RobotConfig::parse("pendulum.toml", &file, None).and_then(|c| c.chain()).expect("a robot");
    let ports = Ports { references: vec![], inputs: vec![0], outputs: vec![1] };
    let of = |slope: f64, dry: f64, noise: f64| {
        log(6000, wave, move |t| needed(wave, t) + slope * rate(wave, t) + dry * (rate(wave, t) / 0.05).tanh(), white(noise, 9))
    };
    for (robot, simulator) in [([0.5, 0.0], [0.0, 0.0]), ([0.5, 0.0], [1.4, 0.0]), ([0.5, 0.0], [0.5, 1.0])] {
        let (log, simulated) = (of(robot[0], robot[1], NOISE), of(simulator[0], simulator[1], 0.0));
        let found = diagnose(&chain, std::slice::from_ref(&log), &[simulated], &ports, &Options::default(), &mut |_| {}).expect("an answer").0;
        assert_eq!((found.verdict, found.causes.len()), (Verdict::Explained, 1), "{simulator:?} {:?}", found.causes);
        let slope = robot[0] != simulator[0];
        let (effect, name, truth) = if slope { ("viscous-friction", "viscous_nm_s_per_rad", robot[0]) } else { ("coulomb-friction", "level_nm", robot[1]) };
        let [low, high] = interval(&found, effect, name).expect("an interval");
        // The sign of the simulator's friction turns over a speed, and its level is read without that.
        assert!(high - low < 0.1 && (0.5 * (low + high) - truth).abs() < 0.05, "{simulator:?} {low} {high}");
        let more = simulator[0] > robot[0] || simulator[1] > robot[1];
        assert_eq!(found.causes[0].evidence.iter().any(|said| said.contains("the simulation has more of it")), more, "{:?}", found.causes[0].evidence);
        if slope {
            let asked = corrections(&chain, &[log], &ports, &found, &Options::default()).expect("corrections");
            assert!(asked.list.is_empty() && asked.left_out.len() == 1, "the file is right: {asked:?}");
        }
    }
}

/// A gear that would give the other way fits the noise of derivatives as well, and is none.
#[test]
fn a_rotor_before_a_slide_has_no_rival_that_cannot_be() {
    let file = PENDULUM.replace("axis = [0.0, 1.0, 0.0]", "kind = \"prismatic\", axis = [0.0, 0.0, 1.0]");
    let chain = RobotConfig::parse("slide.toml", &file, None).and_then(|c| c.chain()).expect("a robot");
    let own = log(6000, wave, |t| (2.0 + 1.5) * acceleration(wave, t) + 2.0 * 9.81, white(NOISE, 7));
    let ports = Ports { references: vec![], inputs: vec![0], outputs: vec![1] };
    let found = diagnose(&chain, &[own], &[], &ports, &Options::default(), &mut |_| {}).expect("an answer").0;
    assert!(found.causes.len() == 1 && found.causes[0].effect == "motor-inertia" && found.causes[0].probability > 0.9, "{:?}", found.causes);
}

#[test]
fn an_angle_in_degrees_that_is_called_radians_is_said() {
    let chain = |limits: &str| {
        let text = PENDULUM.replace("mass_kg", &format!("{limits} mass_kg"));
        RobotConfig::parse("pendulum.toml", &text, None).and_then(|c| c.chain()).expect("a robot")
    };
    let ports = Ports { references: vec![], inputs: vec![0], outputs: vec![1] };
    for (scale, said) in [(1.0, false), (180.0 / std::f64::consts::PI, true)] {
        let own = log(6000, |t| scale * wave(t), |t| needed(wave, t), white(NOISE, 7));
        let found = diagnose(&chain("range_rad = [-1.5, 1.5],"), &[own], &[], &ports, &Options::default(), &mut |_| {}).expect("an answer").0;
        assert_eq!(found.discrepancy.notes.iter().any(|n| n.contains("angle_elbow [deg]")), said, "{:?}", found.discrepancy.notes);
    }
}

/// Behind a gear that gives, before which the encoder and a rotor are.
#[test]
fn a_gear_that_gives_is_one_cause_with_the_rotor_before_it() {
    let motor = |t: f64| wave(t) + needed(wave, t) / 40.0;
    let found = logged(6000, motor, |t| needed(wave, t) + 0.05 * acceleration(motor, t), white(NOISE, 7));
    let named: Vec<&str> = found.causes.iter().map(|c| c.effect.as_str()).collect();
    assert_eq!(named, ["joint-flexibility"], "{:?}", found.minor);
    for (name, truth) in [("stiffness_nm_per_rad", 40.0), ("rotor_kg_m2", 0.05)] {
        let [low, high] = interval(&found, "joint-flexibility", name).expect("an interval");
        assert!(low < truth && truth < high, "{name} {low} {high}");
    }
}

/// In twelve seconds the columns of all causes leave too little to know a coloured noise by; what was found leaves enough.
#[test]
fn intervals_of_short_logs_in_coloured_noise_hold_the_truth() {
    const LOGS: u64 = 100;
    let holds = |seed: &u64| {
        let (mut random, mut noise) = (white(0.0866, *seed), 0.0);
        let coloured = || {
            noise = 0.7 * noise + random();
            noise
        };
        let found = logged(1200, wave, |t| needed(wave, t) + 0.4 * rate(wave, t), coloured);
        // One that is not named has no interval that holds it.
        interval(&found, "viscous-friction", "viscous_nm_s_per_rad").is_some_and(|[low, high]| low < 0.4 && 0.4 < high)
    };
    let inside = (0..LOGS).filter(holds).count() as f64;
    // Three standard errors of a hundred below what is asked.
    assert!(inside >= LOGS as f64 * 0.95 - 3.0 * (LOGS as f64 * 0.95 * 0.05).sqrt(), "{inside}");
}

/// The torque of a gear of this stiffness and damping whose link, so many times as long as the file's, swings on it, and was let go five seconds before, so
/// far from where it would hang.
fn on_a_gear(stiffness: f64, damping: f64, long: f64, away: f64) -> Vec<f64> {
    let spring = |t: f64, [q, v]: [f64; 2]| stiffness * (wave(t) - q) + damping * (rate(wave, t) - v);
    let acceleration = |t: f64, x: [f64; 2]| spring(t, x) / (0.18 * long * long) + 9.81 / (0.3 * long) * x[0].cos();
    let link = swinging(RATE_HZ, 6500, -5.0, [wave(-5.0) + 5.886 / stiffness + away, 0.0], acceleration);
    link.into_iter().enumerate().skip(500).map(|(k, x)| spring(k as f64 / RATE_HZ - 5.0, x)).collect()
}

/// Whether a flexible joint is all that is named, by a stiffness whose interval, of less than a tenth, has the true one.
fn assert_gear(found: &Diagnosis, stiffness: f64) {
    let named: Vec<&str> = found.causes.iter().map(|c| c.effect.as_str()).collect();
    assert_eq!((named, found.verdict), (vec!["joint-flexibility"], Verdict::Explained), "{:?} {:?}", found.minor, found.discrepancy.notes);
    let [low, high] = interval(found, "joint-flexibility", "stiffness_nm_per_rad").expect("an interval");
    assert!(low < stiffness && stiffness < high && high < 1.1 * low, "{low} {high}");
}

/// A link that swings some three times as fast as it is moved does not follow its load (as one that did, the first two would be cables and a link of other
/// mass), and it still swings from before the log began.
#[test]
fn a_link_that_swings_on_its_gear_is_one_cause_with_its_stiffness() {
    for (stiffness, damping) in [(16.0, 0.15), (40.0, 0.3), (150.0, 0.5)] {
        let torque = on_a_gear(stiffness, damping, 1.0, 0.0);
        assert_gear(&logged(6000, wave, |t| torque[(t * RATE_HZ).round() as usize], white(NOISE, 7)), stiffness);
    }
}

/// A gear carries the link as it is, not as the file has it.
#[test]
fn a_longer_link_on_a_gear_that_gives_is_two_causes() {
    for (stiffness, damping) in [(16.0, 0.15), (40.0, 0.3), (150.0, 0.5)] {
        let torque = on_a_gear(stiffness, damping, 1.1, 0.0);
        let found = logged(6000, wave, |t| torque[(t * RATE_HZ).round() as usize], white(NOISE, 7));
        let mut named: Vec<&str> = found.causes.iter().map(|c| c.effect.as_str()).collect();
        named.sort_unstable();
        assert_eq!((named, found.verdict), (vec!["joint-flexibility", "link-parameters"], Verdict::Explained), "{stiffness} {:?}", found.minor);
        let told = [
            ("joint-flexibility", "stiffness_nm_per_rad", stiffness),
            ("link-parameters", "change_of_moment_x_kg_m", 2.0 * 0.3 * 0.1),
            ("link-parameters", "change_of_yy_kg_m2", 0.18 * (1.1 * 1.1 - 1.0)),
        ];
        for (effect, name, truth) in told {
            let [low, high] = interval(&found, effect, name).expect("an interval");
            assert!(low < truth && truth < high && high < 1.3 * low, "{name} {low} {high}");
        }
    }
}

/// The torque of a gear with play, whose link falls from side to side of it: each side is a spring that takes what falls on it and does not pull. What is
/// logged is the mean over the two samples beside it, as a landing is over within one.
fn in_a_play(path: impl Fn(f64) -> f64, gap: f64) -> Vec<f64> {
    let stiffness = 0.18 * 1e3_f64.powi(2);
    let damping = 2.0 * 0.18 * 1e3;
    let side = |beyond: f64, rate: f64| if beyond > 0.0 { (stiffness * beyond + damping * rate).max(0.0) } else { 0.0 };
    let contact = |t: f64, [q, v]: [f64; 2]| {
        let (bent, rate) = (path(t) - q, rate(&path, t) - v);
        side(bent - 0.5 * gap, rate) - side(-bent - 0.5 * gap, -rate)
    };
    let link = swinging(RATE_HZ, 6002, -1.0 / RATE_HZ, [path(0.0) + 0.5 * gap, 0.0], |t, x| (contact(t, x) + 5.886 * x[0].cos()) / 0.18);
    let mean = |w: &[[f64; 2]]| 0.18 * (w[2][1] - w[0][1]) * RATE_HZ / 2.0 - 5.886 * (w[0][0].cos() + 2.0 * w[1][0].cos() + w[2][0].cos()) / 4.0;
    link.windows(3).map(mean).collect()
}

/// A link in its play falls and lands; as one that were always on the side to which it is loaded, wide plays would be friction and links of other mass.
#[test]
fn play_is_one_cause_with_its_width() {
    for gap in [0.02, 0.08] {
        let swing = |t: f64| 1.4 + wave(t);
        let torque = in_a_play(swing, gap);
        let found = logged(6000, swing, |t| torque[(t * RATE_HZ).round() as usize], white(NOISE, 7));
        let named: Vec<&str> = found.causes.iter().map(|c| c.effect.as_str()).collect();
        assert_eq!((named, found.verdict), (vec!["backlash"], Verdict::Explained), "{:?}", found.minor);
        let [low, high] = interval(&found, "backlash", "gap_rad").expect("an interval");
        assert!(low < gap && gap < high && high < 1.1 * low, "{low} {high}");
    }
}

/// Each trial begins as it may, one that is held out as well.
#[test]
fn links_that_swing_otherwise_in_each_trial_are_of_one_gear() {
    let (stiffness, damping) = (40.0, 0.1);
    let logs: Vec<Recording> = [0.3, -0.2, 0.4]
        .iter()
        .enumerate()
        .map(|(k, away)| {
            let torque = on_a_gear(stiffness, damping, 1.0, *away);
            log(3000, wave, |t| torque[(t * RATE_HZ).round() as usize], white(NOISE, k as u64))
        })
        .collect();
    assert_gear(&found(&logs), stiffness);
}

/// Beside a cause that shows little stand others that predict as well, gears too: one that follows its load, whose compliance the data may choose. That of
/// a heavier link would have to give the other way.
#[test]
fn a_gear_that_gives_a_little_is_not_told_from_a_link_that_is_a_little_lighter() {
    let hanging = |t: f64| 1.4 + wave(t);
    let confusable = |share: f64, noise: f64| {
        let found = logged(6000, hanging, |t| share * needed(hanging, t), white(noise, 7));
        found.confusable.into_iter().flat_map(|c| c.effects).collect::<Vec<String>>()
    };
    for (share, noise, gives) in [(0.988, 3.0 * NOISE, true), (1.012, 3.0 * NOISE, false), (1.012, NOISE, false)] {
        let effects = confusable(share, noise);
        let has = |name: &str| effects.iter().any(|effect| effect == name);
        assert_eq!([has("link-parameters at elbow"), has("joint-flexibility at elbow")], [true, gives], "{share} {noise} {effects:?}");
    }
}

fn chain_of(text: &str) -> SerialChain {
    RobotConfig::parse("two.toml", text, None).and_then(|c| c.chain()).expect("a robot")
}

/// What is found in 40 s of a robot of two joints: `logged` makes torques and angles of angles, rates and accelerations, and of what the file's bodies need.
fn of_two(text: &str, logged: impl Fn([[f64; 2]; 3], [f64; 2]) -> ([f64; 2], [f64; 2])) -> Diagnosis {
    let chain = chain_of(text);
    let paths: [fn(f64) -> f64; 2] = [|t| 0.8 * (2.1 * t).sin() + 0.3 * (5.3 * t).cos(), |t| 0.9 * (1.7 * t + 0.4).cos() + 0.4 * (4.4 * t).sin()];
    let (samples, step) = (4000_u32, std::f64::consts::TAU / 16384.0);
    let mut random = ChaCha8Rng::seed_from_u64(12);
    let mut series = vec![Vec::new(); 4];
    for k in 0..samples {
        let t = f64::from(k) / RATE_HZ;
        let mut needed = [0.0; 2];
        let moves = [paths.map(|p| p(t)), paths.map(|p| rate(p, t)), paths.map(|p| acceleration(p, t))];
        chain.inverse_dynamics(&moves[0], &moves[1], &moves[2], &mut needed);
        let (torque, angle) = logged(moves, needed);
        let angle = angle.map(|q| (q / step).round() * step);
        let mut noise = || 0.03 * (random.random::<f64>() + random.random::<f64>() + random.random::<f64>() - 1.5) * 2.0;
        series.iter_mut().zip([torque[0] + noise(), torque[1] + noise(), angle[0], angle[1]]).for_each(|(s, x)| s.push(x));
    }
    let names = ["torque_shoulder", "torque_elbow", "angle_shoulder", "angle_elbow"];
    let unit = |name: &str| Unit::si(if name.starts_with("torque") { Quantity::Effort } else { Quantity::Displacement }, true);
    let channels = names.into_iter().zip(series).map(|(name, samples)| Channel::new(name, unit(name), samples)).collect();
    let log = Recording::new(RATE_HZ, channels).expect("channels of one length");
    let ports = Ports { references: vec![], inputs: vec![0, 1], outputs: vec![2, 3] };
    diagnose(&chain, &[log], &[], &ports, &Options::default(), &mut |_| {}).expect("an answer").0
}

/// An elbow whose zero is three degrees off moves the weight of all that hangs on it; its own link's masses may stay as they are.
#[test]
fn the_zero_of_an_angle_is_no_link() {
    let file = r#"
schema = "ndof/robot/1"
name = "two"
joints = [
    { name = "shoulder", axis = [0.0, 1.0, 0.0], mass_kg = 2.0, centre_m = [0.15, 0.0, 0.02], inertia_kg_m2 = [0.002, 0.02, 0.02, 0.0, 0.0, 0.0] },
    { name = "elbow", axis = [0.0, 1.0, 0.0], origin_m = [0.3, 0.0, 0.0], mass_kg = 1.2, centre_m = [0.12, 0.0, 0.01], inertia_kg_m2 = [0.001, 0.01, 0.01, 0.0, 0.0, 0.0], stiffness_nm_per_rad = 4.0, spring_rest_rad = 0.1 },
]
"#;
    let off = 0.05;
    // The spring of the file feels the elbow as it stands, too.
    let found = of_two(file, |[q, ..], torque| ([torque[0], torque[1] + 4.0 * (q[1] - 0.1)], [q[0], q[1] + off]));
    let first = &found.causes[0];
    assert_eq!((first.effect.as_str(), first.site.axis.as_str(), found.causes.len()), ("angle-offset", "elbow", 1), "{found:#?}");
    let [low, high] = first.parameters[0].ci95.expect("an interval");
    assert!(low < off && off < high && high - low < 0.01, "{low} … {high}");
    assert_eq!(found.verdict, Verdict::Explained);
}

/// The end of the file's range that is written is on the side of the movement on which the stop is.
#[test]
fn a_stop_below_is_the_lower_end() {
    let text = PENDULUM.replace("mass_kg", "range_rad = [-1.5, 1.5], mass_kg");
    let chain = RobotConfig::parse("pendulum.toml", &text, None).and_then(|c| c.chain()).expect("a robot");
    let own = log(6000, wave, |t| needed(wave, t) + 12.0 * (wave(t) + 0.6).min(0.0), white(NOISE, 7));
    let ports = Ports { references: vec![], inputs: vec![0], outputs: vec![1] };
    let found = diagnose(&chain, std::slice::from_ref(&own), &[], &ports, &Options::default(), &mut |_| {}).expect("an answer").0;
    let written = corrections(&chain, &[own], &ports, &found, &Options::default()).expect("corrections").list;
    assert!(matches!(written[..], [Correction { what: Corrected::Range(0), value: -0.61..-0.59, .. }]), "{written:?}");
}

/// What the file says of a stop stands beside what the data say; of one that the motion does not reach nothing is said.
#[test]
fn a_stop_is_told_beside_the_files_range() {
    let of = |range: &str, stopped: bool| {
        let text = PENDULUM.replace("mass_kg", &format!("range_rad = {range}, mass_kg"));
        let chain = RobotConfig::parse("pendulum.toml", &text, None).and_then(|c| c.chain()).expect("a robot");
        let own = log(6000, wave, |t| needed(wave, t) + if stopped { 12.0 * (wave(t) - 0.6).max(0.0) } else { 0.0 }, white(NOISE, 7));
        let ports = Ports { references: vec![], inputs: vec![0], outputs: vec![1] };
        let found = diagnose(&chain, std::slice::from_ref(&own), &[], &ports, &Options::default(), &mut |_| {}).expect("an answer").0;
        let written = corrections(&chain, &[own], &ports, &found, &Options::default()).expect("corrections").list;
        assert!(
            if stopped { matches!(written[..], [Correction { what: Corrected::Range(1), value: 0.59..0.61, .. }]) } else { written.is_empty() },
            "{written:?}"
        );
        found
    };
    let told = |found: &Diagnosis| {
        found
            .causes
            .iter()
            .flat_map(|c| &c.evidence)
            .any(|said| said.contains("the file says that the joint goes to 1.5000 rad, the data that it is stopped at 0.6"))
    };
    let passed = |found: &Diagnosis| found.discrepancy.notes.iter().filter(|note| note.contains("no stop is felt")).count();
    let (stopped, free, narrow) = (of("[-1.5, 1.5]", true), of("[-1.5, 1.5]", false), of("[-1.5, 0.5]", false));
    assert!(told(&stopped) && stopped.causes[0].effect == "end-stop", "{:?}", stopped.causes);
    assert_eq!((free.causes.len(), passed(&stopped), passed(&free), passed(&narrow)), (0, 0, 0, 1), "{:?}", narrow.discrepancy.notes);
}

/// A range has two ends: the other one of a joint that turns is a turn away, of one that slides nothing says where.
#[test]
fn a_stop_of_a_joint_without_a_range_becomes_one() {
    const TOML: &str = r#"schema = "ndof/robot/1"
name = "one"
[[joints]]
name = "elbow"
axis = [0.0, 1.0, 0.0]
mass_kg = 2.0
centre_m = [0.3, 0.0, 0.0]
"#;
    const URDF: &str = r#"<robot name="one"><link name="base"/>
  <link name="fore"><inertial><origin xyz="0.3 0 0"/><mass value="2"/><inertia ixx="0" ixy="0" ixz="0" iyy="0" iyz="0" izz="0"/></inertial></link>
  <joint name="elbow" type="continuous"><parent link="base"/><child link="fore"/><axis xyz="0 1 0"/><limit effort="50" velocity="5"/></joint>
</robot>"#;
    const MJCF: &str = r#"<mujoco><compiler angle="radian"/><worldbody><body name="fore">
  <joint name="elbow" axis="0 1 0"/><inertial pos="0.3 0 0" mass="2" diaginertia="1e-9 1e-9 1e-9"/>
</body></worldbody></mujoco>"#;
    let ports = Ports { references: vec![], inputs: vec![0], outputs: vec![1] };
    let read = |name: &str, text: &str| RobotConfig::parse(name, text, None).and_then(|c| c.chain()).expect("a robot");
    let own = log(6000, wave, |t| needed(wave, t) + 12.0 * (wave(t) - 0.6).max(0.0), white(NOISE, 7));
    for (name, text) in [("one.toml", TOML), ("one.urdf", URDF), ("one.xml", MJCF)] {
        let chain = read(name, text);
        assert!(chain.ranges()[0].iter().all(|end| end.is_infinite()), "{name}");
        let found = diagnose(&chain, std::slice::from_ref(&own), &[], &ports, &Options::default(), &mut |_| {}).expect("an answer").0;
        let written =
            corrections(&chain, std::slice::from_ref(&own), &ports, &found, &Options::default()).expect("corrections").write(name, text).expect("written");
        let [low, high] = read(name, &written.text).ranges()[0];
        assert!((high - 0.6).abs() < 0.01 && (high - low - std::f64::consts::TAU).abs() < 1e-9, "{name} {low} {high}\n{}", written.text);
    }
    // Without the effort and velocity that a URDF's range stands beside, words are all that there is.
    let bare = URDF.replace(r#"<limit effort="50" velocity="5"/>"#, "");
    let found = diagnose(&read("one.urdf", &bare), std::slice::from_ref(&own), &[], &ports, &Options::default(), &mut |_| {}).expect("an answer").0;
    let asked = corrections(&read("one.urdf", &bare), &[own], &ports, &found, &Options::default()).expect("corrections");
    let written = asked.write("one.urdf", &bare).expect("written");
    assert!(written.left_out.iter().any(|said| said.contains("upper end of the range") && said.contains("not written")), "{:?}", written.left_out);
    // A slide.
    let slide = read("slide.toml", &PENDULUM.replace("axis = [0.0, 1.0, 0.0]", "kind = \"prismatic\", axis = [1.0, 0.0, 0.0]"));
    let own = log(6000, wave, |t| 2.0 * acceleration(wave, t) + 12.0 * (wave(t) - 0.6).max(0.0), white(NOISE, 7));
    let found = diagnose(&slide, std::slice::from_ref(&own), &[], &ports, &Options::default(), &mut |_| {}).expect("an answer").0;
    let asked = corrections(&slide, &[own], &ports, &found, &Options::default()).expect("corrections");
    assert!(asked.list.is_empty() && asked.left_out.iter().any(|said| said.contains("not written")), "{asked:?}");
}
