//! Whole answers on short experiments with a few effects to choose from.

use super::{At, Experiment, PLAIN, RATE_HZ, SAMPLES, held, motion, only, outline};
use crate::{
    Baseline, DiagnoseError, Endpoint, HeldOut, Mechanism, MechanismParameter, Options, Part, RobotSide, Status, diagnose_robot, diagnose_with_pictures,
};
use ndof_signal::{Channel, Quantity, Recording, Unit};
use ndof_sysid::Ports;
use num_complex::Complex64;
use serde_json::{Value, json};
use std::f64::consts::TAU;

fn answer(experiment: &Experiment, options: &Options, baseline: Option<&Baseline>) -> Value {
    let (trials, ports) = experiment.recordings();
    let (diagnosis, p) = diagnose_with_pictures(&trials, &ports, options, baseline, &mut |_| {}).unwrap();
    let lines = |lines: &[Vec<f64>]| -> Vec<Vec<f64>> { lines.iter().map(|l| outline(l)).collect() };
    let pictures = [&p.measured, &p.baseline, &p.extended, &p.position, &p.velocity, &p.missing, &p.explained].map(|l| lines(l));
    json!({
        "diagnosis": diagnosis,
        "names": [json!([p.outputs, p.axes, p.output_unit, p.units]), json!([p.start_s, p.sample_rate_hz, p.band_hz[0], p.band_hz[1]])],
        "pictures": pictures,
    })
}

fn first(answer: &Value) -> &str {
    answer["diagnosis"]["causes"][0]["effect"].as_str().unwrap_or("none")
}

const THREE: Experiment = Experiment { trials: 3, ..PLAIN };
const DRY: fn(&At) -> [f64; 2] = |at| [2.0 * (at.v[0] / 0.002).tanh(), 0.0];

#[test]
fn friction_of_a_pushed_mass() {
    let found = answer(&Experiment { extra: DRY, ..THREE }, &only(&["coulomb-friction", "cubic-stiffness", "measurement-delay"]), None);
    assert_eq!(first(&found), "coulomb-friction");
    held("answer-friction", &found);
}

#[test]
fn a_cubic_spring_of_an_imposed_angle() {
    let experiment = Experiment { imposed: true, rotational: true, extra: |at| [4e5 * at.x[0].powi(3), 0.0], ..THREE };
    let found = answer(&experiment, &only(&["cubic-stiffness", "asymmetric-stiffness"]), None);
    assert_eq!(first(&found), "cubic-stiffness");
    held("answer-cubic", &found);
}

#[test]
fn a_late_effort_and_its_filter_with_what_would_tell_them_apart() {
    let options = Options { plan: true, held_out: HeldOut::Trials(vec![0]), ..only(&["measurement-delay", "channel-filter"]) };
    let found = answer(&Experiment { late_s: 0.008, noise: 0.4, ..PLAIN }, &options, None);
    assert_eq!(first(&found), "measurement-delay");
    held("answer-late", &found);
}

#[test]
fn a_tone_and_a_knock_in_a_loop_of_two_axes() {
    let extra: fn(&At) -> [f64; 2] = |at| {
        let knock = if at.trial == 1 && (9.0..9.5).contains(&at.t) { 4.0 * (TAU * (at.t - 9.0)).sin() } else { 0.0 };
        [0.4 * (TAU * 4.37 * at.t).sin(), knock]
    };
    let found = answer(&Experiment { axes: 2, robot: Some(true), noise: 0.1, extra, ..THREE }, &only(&["periodic-disturbance", "transient-disturbance"]), None);
    held("answer-tone", &found);
}

#[test]
fn what_no_registry_has_on_one_of_two_axes() {
    let extra: fn(&At) -> [f64; 2] = |at| [0.0, 4e3 * at.x[0] * at.x[1]];
    let found = answer(&Experiment { axes: 2, extra, ..THREE }, &only(&["coulomb-friction"]), None);
    held("answer-unknown", &found);
}

#[test]
fn a_spring_that_changes_in_a_way_that_no_cause_describes() {
    let extra: fn(&At) -> [f64; 2] = |at| [40.0 * (TAU * 0.22 * at.t + at.trial as f64).sin() * at.x[0], 0.0];
    let found = answer(&Experiment { extra, ..THREE }, &only(&["coulomb-friction"]), None);
    assert!(found["diagnosis"]["discrepancy"]["notes"].to_string().contains("changes slowly with time"), "{}", found["diagnosis"]["discrepancy"]["notes"]);
    held("answer-varying", &found);
}

#[test]
fn a_force_of_the_limbs_own() {
    // Slow and of other lines than the motion.
    let extra: fn(&At) -> [f64; 2] =
        |at| [0.0, (0..9).map(|q| 0.25 * (TAU * (0.07 + 0.083 * q as f64) * at.t + (7 * q * q + 3 * at.trial) as f64).sin()).sum::<f64>()];
    for (name, rotational) in [("n", false), ("nm", true)] {
        let found = answer(&Experiment { axes: 2, extra, rotational, ..THREE }, &only(&["limb-noise", "coulomb-friction"]), None);
        assert_eq!(first(&found), "limb-noise");
        held(&format!("answer-own-{name}"), &found);
    }
}

#[test]
fn several_causes_a_small_one_and_too_many_of_one_size() {
    let extra: fn(&At) -> [f64; 2] = |at| [1.0 * (at.v[0] / 0.002).tanh() + 1e5 * at.x[0].powi(3), 0.3 * (at.v[1] / 0.002).tanh() + 2.0 * at.x[0].max(0.0)];
    let experiment = Experiment { axes: 2, late_s: 0.006, extra, ..THREE };
    let found =
        answer(&experiment, &Options { tolerance: 0.03, ..only(&["coulomb-friction", "cubic-stiffness", "measurement-delay", "asymmetric-stiffness"]) }, None);
    held("answer-several", &found);
}

#[test]
fn a_reflex_and_a_spring_behind_a_damper() {
    // 20 N s/m in series with 200 N/m: what it does to each sine is known, as is what a reflex of 0.15 s does.
    let maxwell: fn(&At) -> [f64; 2] = |at| [(0..32).map(|q| behind(at.trial, q, at.t)).sum::<f64>(), 0.0];
    let found = answer(&Experiment { extra: maxwell, ..THREE }, &only(&["viscoelastic", "coulomb-friction"]), None);
    assert_eq!(first(&found), "viscoelastic");
    held("answer-maxwell", &found);
    let reflex: fn(&At) -> [f64; 2] = |at| {
        let [x, v, _] = motion(at.trial, 0, at.t - 0.15);
        [25.0 * x + 3.0 * v, 0.0]
    };
    let found = answer(&Experiment { extra: reflex, ..THREE }, &only(&["reflex-delay", "coulomb-friction"]), None);
    assert_eq!(first(&found), "reflex-delay");
    held("answer-reflex", &found);
}

/// The force that one sine of the first axis' motion makes in the spring behind the damper.
fn behind(trial: usize, q: usize, t: f64) -> f64 {
    let w = TAU * (0.15 + 0.183 * q as f64);
    let s = Complex64::new(0.0, w);
    let h = 200.0 * s * 20.0 / (200.0 + s * 20.0);
    let phase = w * t + TAU * (0.618_034 * ((q + 1) * (q + 3 + 7 * trial)) as f64).fract();
    0.008 / (1.0 + w / TAU) * (h * Complex64::from_polar(1.0, phase)).im
}

#[test]
fn channels_in_steps_on_a_wrist() {
    let experiment = Experiment { rotational: true, noise: 0.1, extra: |at| [0.5 * (TAU * 4.37 * at.t).sin(), 0.0], ..PLAIN };
    let (mut trials, ports) = experiment.recordings();
    for r in &mut trials {
        r.map_channel("force_x", |f| 0.25 * (f / 0.25).round()).unwrap();
        r.map_channel("pos_x", |x| 5e-4 * (x / 5e-4).round()).unwrap();
    }
    let options = Options { band_hz: None, ..only(&["quantisation", "periodic-disturbance", "transient-disturbance"]) };
    let (d, _) = diagnose_with_pictures(&trials, &ports, &options, None, &mut |_| {}).unwrap();
    held("answer-steps", &json!(d));
}

#[test]
fn a_late_motion_that_is_imposed_and_what_would_tell_it_from_a_filter() {
    let options = Options { plan: true, band_hz: Some((0.5, 6.0)), ..only(&["measurement-delay", "channel-filter"]) };
    let found = answer(&Experiment { late_s: -0.006, noise: 0.4, imposed: true, ..PLAIN }, &options, None);
    held("answer-late-imposed", &found);
}

#[test]
fn small_causes_beside_large_ones_and_causes_that_help_little() {
    // A cubic spring of a tenth of the gain of friction is named, one of less than a twentieth is not.
    let small: fn(&At) -> [f64; 2] = |at| [2.0 * (at.v[0] / 0.002).tanh() + 0.3e5 * at.x[0].powi(3), 0.0];
    let smaller: fn(&At) -> [f64; 2] = |at| [2.0 * (at.v[0] / 0.002).tanh() + 0.2e5 * at.x[0].powi(3), 0.0];
    let options = Options { tolerance: 1e-3, ..only(&["coulomb-friction", "cubic-stiffness"]) };
    let (named, minor) = (
        answer(&Experiment { extra: small, noise: 0.1, ..THREE }, &options, None),
        answer(&Experiment { extra: smaller, noise: 0.1, ..THREE }, &options, None),
    );
    assert_eq!((named["diagnosis"]["causes"].as_array().unwrap().len(), minor["diagnosis"]["minor"].as_array().unwrap().len()), (2, 1));
    held("answer-small", &json!([named, minor]));
    // A little friction, and much that nobody knows.
    let little: fn(&At) -> [f64; 2] = |at| [0.5 * (at.v[0] / 0.002).tanh() + 12.0 * at.v[0].powi(2) + 3e3 * at.x[0].powi(2), 0.0];
    let found = answer(&Experiment { extra: little, ..THREE }, &only(&["coulomb-friction", "measurement-delay"]), None);
    held("answer-little", &found);
}

#[test]
fn as_large_a_cause_with_a_smaller_gain_and_what_is_known_in_part() {
    // The same friction on both axes, on the second under a force that is all over the band.
    let same: fn(&At) -> [f64; 2] = |at| {
        let dry = |v: f64| 1.5 * (v / 0.002).tanh();
        [dry(at.v[0]), dry(at.v[1]) + 3.0 * (40.0 * at.t * at.t + at.trial as f64).sin()]
    };
    let found = answer(&Experiment { axes: 2, extra: same, noise: 0.01, ..THREE }, &only(&["coulomb-friction"]), None);
    // Friction, and a force beside it that nobody knows.
    let some: fn(&At) -> [f64; 2] = |at| [2.0 * (at.v[0] / 0.002).tanh() + 0.8e3 * at.x[0].powi(2), 0.0];
    let more: fn(&At) -> [f64; 2] = |at| [2.0 * (at.v[0] / 0.002).tanh() + 2.4e3 * at.x[0].powi(2), 0.0];
    // One that only one of the trials has, which the other does not confirm.
    let once: fn(&At) -> [f64; 2] = |at| [(1.0 + 3.0 * at.trial as f64) * 2e3 * at.x[0].powi(2), 0.0];
    let rest: Vec<Value> = [some, more, once].map(|extra| answer(&Experiment { extra, noise: 0.1, ..THREE }, &only(&["coulomb-friction"]), None)).to_vec();
    // The same where so much does not matter: the name is still not sure.
    let careless = Options { tolerance: 0.06, ..only(&["coulomb-friction"]) };
    let small = answer(&Experiment { extra: some, noise: 0.1, ..THREE }, &careless, None);
    // A line that makes next to nothing of what is missing is no cause.
    let faint: fn(&At) -> [f64; 2] = |at| [2.0 * (at.v[0] / 0.002).tanh() + 0.08 * (TAU * 4.9 * at.t).sin(), 0.0];
    let line = answer(&Experiment { extra: faint, noise: 0.02, ..THREE }, &only(&["coulomb-friction", "periodic-disturbance"]), None);
    held("answer-parts", &json!([found, rest, small, line]));
}

#[test]
fn a_force_that_the_motion_does_not_follow_leaves_no_prediction() {
    let found = answer(&Experiment { noise: 20.0, ..THREE }, &only(&["coulomb-friction"]), None);
    assert_eq!(found["diagnosis"]["verdict"], "unexplained");
    let dry: fn(&At) -> [f64; 2] = |at| [60.0 * (at.v[0] / 0.002).tanh(), 0.0];
    let named = answer(&Experiment { extra: dry, ..THREE }, &only(&["coulomb-friction"]), None);
    held("answer-adrift", &json!([found, named]));
}

#[test]
fn a_resonance_that_may_stand_for_a_delay() {
    // A filter that is a delay within the band is one for another cause, and says so.
    let both = only(&["channel-filter", "measurement-delay", "extra-resonance"]);
    held("answer-alike", &answer(&Experiment { late_s: 0.004, noise: 0.5, ..THREE }, &both, None));
    let options = only(&["extra-resonance", "channel-filter", "actuation-delay", "sensor-scale"]);
    let found = answer(&Experiment { late_s: 0.015, robot: Some(true), ..THREE }, &options, None);
    held("answer-stand-in", &found);
}

#[test]
fn a_velocity_in_steps_and_a_mass_that_is_wrong() {
    let given = |value: f64, status| Baseline { mass: Some(Part { value: vec![vec![value]], status, symmetric: true }), ..Baseline::default() };
    let options = only(&["added-mass", "parameter-error", "quantisation"]);
    for (name, status) in [("nominal", Status::Nominal), ("fixed", Status::Fixed)] {
        let found = answer(&Experiment { order: 1, ..THREE }, &options, Some(&given(1.1, status)));
        held(&format!("answer-mass-{name}"), &found);
    }
}

#[test]
fn a_plant_without_a_spring_that_friction_hides() {
    let extra: fn(&At) -> [f64; 2] = |at| [1.5 * (at.v[0] / 0.002).tanh() - 120.0 * at.x[0], 0.0];
    let options = Options { held_out: HeldOut::Time(14.0, 24.0), tolerance: 0.02, most_causes: 1, ..only(&["coulomb-friction", "hysteresis"]) };
    let found = answer(&Experiment { extra, ..THREE }, &options, None);
    assert_eq!(first(&found), "coulomb-friction");
    held("answer-free", &found);
}

#[test]
fn an_effort_that_is_counted_the_other_way() {
    let experiment = Experiment { noise: 0.02, ..THREE };
    let (mut trials, ports) = experiment.recordings();
    trials.iter_mut().for_each(|r| r.map_channel("force_x", |f| -f).unwrap());
    let (d, _) = diagnose_with_pictures(&trials, &ports, &only(&["coulomb-friction"]), None, &mut |_| {}).unwrap();
    assert!(d.causes.is_empty() && d.discrepancy.notes.iter().any(|n| n.contains("force-sign")), "{:?}", d.discrepancy.notes);
    for (name, truth) in [("M", 1.5), ("B", 9.0), ("K", 120.0)] {
        let p = d.baseline.parameters.iter().find(|p| p.name == name).unwrap();
        assert!((p.value / truth - 1.0).abs() < 0.01, "{p:?}");
    }
    held("answer-turned", &json!(d));
}

/// A cart of two axes on a sampled spring: mass, damping, and a spring with the other axis.
struct Cart(Vec<MechanismParameter>);

struct Place(Vec<f64>);

const HOLD: [f64; 2] = [60.0, 2.0];
const CART: [f64; 4] = [1.3, 0.9, 2.0, 5.0];
impl Mechanism for Cart {
    fn parameters(&self) -> &[MechanismParameter] {
        &self.0
    }

    fn with(&self, values: &[f64]) -> Option<Box<dyn Endpoint + '_>> {
        values[..2].iter().all(|m| *m > 0.0).then(|| Box::new(Place(values.to_vec())) as Box<dyn Endpoint>)
    }

    fn hold(&self, axis: usize, s: Complex64) -> Complex64 {
        HOLD[0] * (1 + axis) as f64 + HOLD[1] * s
    }
}

impl Endpoint for Place {
    fn needed(&mut self, x: &[f64], v: &[f64], a: &[f64], force: &mut [f64]) -> bool {
        for i in 0..2 {
            force[i] = self.0[i] * a[i] + self.0[2] * v[i] + 0.2 * self.0[3].powi(2) * (x[1 - i] - x[i]) + self.0[4] * a[i] * (1 - i) as f64;
        }
        x.iter().all(|x| x.abs() < 1.0)
    }
}

fn side(parameters: &[(f64, Status)], noise: f64, spoil: fn(f64) -> f64) -> RobotSide {
    let parameters = parameters.iter().zip(["mass_x_kg", "mass_y_kg", "damping", "length_m", "load_x_kg"]).enumerate();
    let cart = Cart(
        parameters
            .map(|(k, ((value, status), name))| MechanismParameter {
                name: name.to_owned(),
                unit: "u".to_owned(),
                value: *value,
                status: *status,
                geometry: k == 3,
            })
            .collect(),
    );
    let trials: Vec<Recording> = (0..2)
        .map(|trial| {
            let mut channels = Vec::new();
            for (axis, name) in ["x", "y"].into_iter().enumerate() {
                let (mut command, mut force, mut place) = (vec![], vec![], vec![]);
                for k in 0..SAMPLES / 2 {
                    let t = k as f64 / RATE_HZ;
                    let [x, v, a] = motion(trial, axis, t);
                    let other = motion(trial, 1 - axis, t)[0];
                    let [held_x, held_v, _] = motion(trial, axis, t - 0.5 / RATE_HZ);
                    let measured = 2.0 * a + 12.0 * v + 300.0 * x;
                    let needed = CART[axis] * a + CART[2] * v + CART[3] * (other - x) + spoil(v);
                    force.push(measured);
                    command.push(measured + needed + HOLD[0] * (1 + axis) as f64 * held_x + HOLD[1] * held_v + noise * ((k * k) as f64).sin());
                    place.push(x);
                }
                for (word, quantity, samples) in
                    [("cmd", Quantity::Effort, command), ("force", Quantity::Effort, force), ("pos", Quantity::Displacement, place)]
                {
                    channels.push(Channel::new(format!("{word}_{name}"), Unit::si(quantity, false), samples));
                }
            }
            Recording::new(RATE_HZ, channels).unwrap()
        })
        .collect();
    let ports = Ports { references: vec![0, 3], inputs: vec![1, 4], outputs: vec![2, 5] };
    diagnose_robot(&trials, &ports, &Options { held_out: HeldOut::Time(0.0, 4.0), ..only(&[]) }, &cart).unwrap()
}

fn told(side: &RobotSide) -> Value {
    json!({
        "causes": side.causes, "considered": side.considered, "minor": side.minor, "confusable": side.confusable, "nominal": side.nominal,
        "corrected": side.corrected, "shift": side.shift, "held_out": side.held_out, "rest": side.rest, "notes": side.notes,
    })
}

#[test]
fn a_robots_numbers_are_found() {
    use Status::{Fixed, Free, Nominal};
    let right = told(&side(&[(1.3, Nominal), (0.9, Nominal), (1.0, Free), (5.0, Nominal), (0.0, Fixed)], 0.02, |_| 0.0));
    assert!(right["causes"].as_array().unwrap().is_empty() && right["minor"].as_array().unwrap().is_empty(), "{}", right["causes"]);
    let damping = right["corrected"].as_array().unwrap().iter().find(|p| p["name"] == "damping").unwrap()["value"].as_f64().unwrap();
    assert!((damping - 2.0).abs() < 0.02, "{damping}");
    let wrong = told(&side(&[(1.0, Nominal), (0.9, Nominal), (1.0, Free), (4.0, Nominal), (0.0, Fixed)], 0.02, |_| 0.0));
    assert_eq!(wrong["causes"][0]["effect"], "parameter-error");
    let one = told(&side(&[(1.3, Fixed), (0.7, Nominal), (2.0, Nominal), (5.0, Fixed), (0.0, Fixed)], 0.02, |v| 2.0 * (v / 0.01).tanh()));
    // A mass and a load are one.
    let alike = told(&side(&[(1.0, Nominal), (0.9, Fixed), (2.0, Free), (5.0, Fixed), (0.0, Nominal)], 0.05, |_| 0.0));
    assert_eq!(alike["confusable"].as_array().unwrap().len(), 1);
    // Little beside much noise; friction that is most of it.
    let faint = told(&side(&[(1.27, Nominal), (0.92, Nominal), (2.0, Free), (5.0, Fixed), (0.0, Fixed)], 1.0, |_| 0.0));
    let much = told(&side(&[(0.5, Nominal), (0.9, Nominal), (2.0, Fixed), (5.0, Fixed), (0.0, Fixed)], 0.02, |v| 4.0 * (v / 0.01).tanh()));
    assert!(much["rest"][0].as_f64().unwrap() > 0.25 && much["causes"].as_array().unwrap().iter().all(|c| c["probability"].as_f64().unwrap() <= 0.5));
    held("robot", &json!([right, wrong, one, alike, faint, much]));
}

#[test]
fn a_robots_side_needs_a_commanded_and_a_measured_force_and_a_displacement() {
    let cart = Cart(vec![]);
    let refused = |experiment: Experiment, change: fn(&mut Ports)| {
        let (trials, mut ports) = experiment.recordings();
        change(&mut ports);
        diagnose_robot(&trials, &ports, &only(&[]), &cart).err()
    };
    let loose = Experiment { axes: 2, robot: Some(true), ..PLAIN };
    for (experiment, change) in [
        (Experiment { imposed: true, ..loose }, (|_| {}) as fn(&mut Ports)),
        (Experiment { order: 1, ..loose }, |_| {}),
        (Experiment { robot: Some(false), ..loose }, |_| {}),
        (Experiment { robot: None, ..loose }, |_| {}),
        (loose, |ports| ports.references.truncate(1)),
    ] {
        assert!(matches!(refused(experiment, change), Some(DiagnoseError::NoRobotSide)));
    }
}

#[test]
fn a_verdict_of_both_sides() {
    use crate::Verdict::{Adequate, Explained, PartlyExplained, Unexplained};
    use Status::{Fixed, Nominal};
    let fixed = [(1.3, Fixed), (0.9, Fixed), (2.0, Fixed), (5.0, Fixed), (0.0, Fixed)];
    let fine = side(&fixed, 0.02, |_| 0.0);
    let named = side(&[(1.0, Nominal), fixed[1], fixed[2], fixed[3], fixed[4]], 0.02, |_| 0.0);
    let lost = side(&fixed, 0.02, |v| 6.0 * (v / 0.01).tanh());
    assert!(fine.causes.is_empty() && named.causes.len() == 1 && lost.causes.is_empty());
    let (trials, ports) = Experiment { extra: DRY, ..THREE }.recordings();
    let (mut plant, _) = diagnose_with_pictures(&trials, &ports, &only(&["coulomb-friction"]), None, &mut |_| {}).unwrap();
    for (verdict, of_fine, of_named, of_lost) in [
        (Adequate, Adequate, Explained, Unexplained),
        (Explained, Explained, Explained, PartlyExplained),
        (PartlyExplained, PartlyExplained, PartlyExplained, PartlyExplained),
        (Unexplained, Unexplained, PartlyExplained, Unexplained),
    ] {
        plant.verdict = verdict;
        for (side, want) in [(&fine, of_fine), (&named, of_named), (&lost, of_lost)] {
            let both = plant.clone().with_robot(side.clone());
            assert_eq!(both.verdict, want, "{verdict:?}");
            assert_eq!(both.causes.len(), plant.causes.len() + side.causes.len());
            assert!(both.causes.windows(2).all(|w| w[0].gain.delta_bic >= w[1].gain.delta_bic));
        }
    }
}
