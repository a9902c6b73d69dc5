//! What a diagnosis of joint logs finds where little of the log shows it.

use ndof_devices::RobotConfig;
use ndof_diagnose::{Diagnosis, Verdict};
use ndof_joints::{Options, diagnose};
use ndof_signal::{Channel, Quantity, Recording, Unit};
use ndof_sysid::Ports;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

const PENDULUM: &str = r#"
schema = "ndof/robot/1"
name = "pendulum"
joints = [{ name = "elbow", axis = [0.0, 1.0, 0.0], mass_kg = 2.0, centre_m = [0.3, 0.0, 0.0] }]
"#;
const RATE_HZ: f64 = 100.0;
/// Of the torque's noise (N m).
const NOISE: f64 = 0.05;

/// A minute of a pendulum on `path`, with `beyond` on top of what its bodies need.
fn judged(path: impl Fn(f64) -> f64, beyond: impl Fn(f64) -> f64) -> Diagnosis {
    geared(path, beyond, |_| 0.0, 0.0)
}

/// The same behind a gear that gives by `compliance(torque)`, with an encoder and a rotor before it.
fn geared(path: impl Fn(f64) -> f64, beyond: impl Fn(f64) -> f64, compliance: impl Fn(f64) -> f64, rotor: f64) -> Diagnosis {
    let mut rng = ChaCha8Rng::seed_from_u64(7);
    let step = std::f64::consts::TAU / 16384.0;
    let (mut angle, mut torque) = (Vec::new(), Vec::new());
    for k in 0..6000 {
        let (t, h) = (f64::from(k) / RATE_HZ, 1e-3);
        let curve = |f: &dyn Fn(f64) -> f64, t: f64| (f(t + h) - 2.0 * f(t) + f(t - h)) / (h * h);
        let link = |t: f64| 0.18 * curve(&path, t) - 2.0 * 9.81 * 0.3 * path(t).cos() + beyond(path(t));
        let motor = |t: f64| path(t) + compliance(link(t));
        let noise = 12_f64.sqrt() * (rng.random::<f64>() - 0.5);
        angle.push((motor(t) / step).round() * step);
        torque.push(link(t) + rotor * curve(&motor, t) + NOISE * noise);
    }
    let channel = |name: &str, quantity, samples| Channel::new(name, Unit::si(quantity, true), samples);
    let channels = vec![channel("torque_elbow", Quantity::Effort, torque), channel("angle_elbow", Quantity::Displacement, angle)];
    let log = Recording::new(RATE_HZ, channels).expect("channels of one length");
    let ports = Ports { references: vec![], inputs: vec![0], outputs: vec![1] };
    let chain = RobotConfig::parse("pendulum.toml", PENDULUM, None).and_then(|c| c.chain()).expect("a robot");
    diagnose(&chain, &[log], &[], &ports, &Options::default(), &mut |_| {}).expect("an answer").0
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
    let [low, high] = found.causes[0].parameters.iter().find(|p| p.name == "stop_rad").and_then(|p| p.ci95).expect("an interval");
    assert!(low < 0.85 && 0.85 < high, "{low} {high}");
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

/// Noise is asked for once more beside what was found: a spring is no straight line in its compliance, and what it leaves at first is no noise.
#[test]
fn a_gear_that_gives_is_one_cause_with_the_rotor_before_it() {
    let found = geared(wave, |_| 0.0, |torque| torque / 40.0, 0.05);
    let named: Vec<&str> = found.causes.iter().map(|c| c.effect.as_str()).collect();
    assert_eq!(named, ["joint-flexibility"], "{:?}", found.minor);
    for (name, truth) in [("stiffness_nm_per_rad", 40.0), ("rotor_kg_m2", 0.05)] {
        let [low, high] = found.causes[0].parameters.iter().find(|p| p.name == name).and_then(|p| p.ci95).expect("an interval");
        assert!(low < truth && truth < high, "{name} {low} {high}");
    }
}
