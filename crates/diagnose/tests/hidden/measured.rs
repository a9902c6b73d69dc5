//! Measured recordings of others whose cause is known; skipped where they are not at hand.

use crate::records::Record;
use ndof_challenge::{Case, Hidden, Plant, make};
use ndof_diagnose::{Diagnosis, Options, Verdict, diagnose};
use ndof_signal::{Channel, Quantity, Recording, Unit};
use ndof_sysid::Ports;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

fn answer(name: &str, record: Record) -> Option<Diagnosis> {
    let Some((trials, ports)) = record else {
        println!("{name}: skipped, the record is not at hand");
        return None;
    };
    Some(diagnose(&trials, &ports, &Options::default(), None, &mut |_| {}).expect("a diagnosis"))
}

fn record(name: &str) -> Record {
    crate::records::ALL.iter().find(|r| r.0 == name).and_then(|r| r.1())
}

#[test]
fn the_positioning_drive_has_dry_friction() {
    let Some(d) = answer("emps", record("emps")) else { return };
    assert_eq!(d.causes[0].effect, "coulomb-friction", "{:?}", d.causes);
    let ndof_models::effects::Value::Number(level) = d.causes[0].parameters[0].value else { panic!("a number") };
    // 20.39 N is published; the low-pass on the velocity biases by some per cent.
    assert!((level / 20.39 - 1.0).abs() < 0.1, "{level}");
    let mass = d.extended.parameters.iter().find(|p| p.name == "M").expect("M").value;
    assert!((mass / 95.11 - 1.0).abs() < 0.03, "{mass}");
}

#[test]
fn the_damper_has_hysteresis() {
    let Some(d) = answer("mr-damper", record("mr-damper")) else { return };
    assert_eq!(d.causes[0].effect, "hysteresis", "{:?}", d.causes);
    assert!(d.extended.held_out.vaf_percent[0].expect("finite") > 90.0);
}

#[test]
fn the_quiet_ankle_lacks_little_and_gets_no_confident_friction_or_hysteresis() {
    let Some(d) = answer("ankle-df2", record("ankle-df2")) else { return };
    for c in &d.causes {
        assert!(!["coulomb-friction", "hysteresis"].contains(&c.effect.as_str()) || c.probability <= 0.9, "{c:?}");
    }
    // 94.4 to 96.1 % are reached by models of the intrinsic path without a fixed order.
    let (before, after) = (d.baseline.held_out.vaf_percent[0].expect("finite"), d.extended.held_out.vaf_percent[0].expect("finite"));
    assert!(before > 85.0 && after > 94.0, "{before} -> {after}");
    assert!(d.discrepancy.notes.iter().any(|n| n.starts_with("little is missing")), "{:?}", d.discrepancy.notes);
}

/// It rings for longer than the part that no fit saw lasts, which therefore proves little.
#[test]
fn the_flexible_arm_has_another_resonance_that_is_never_sure() {
    let Some(d) = answer("robot-arm", record("robot-arm")) else { return };
    let found: Vec<&str> = d.causes.iter().map(|c| c.effect.as_str()).chain(d.minor.iter().map(|m| m.effect.as_str())).collect();
    assert!(found.contains(&"extra-resonance"), "{:?}", d.minor);
    assert!(d.causes.iter().all(|c| c.probability <= 0.5), "{:?}", d.causes);
    assert!([Verdict::Unexplained, Verdict::PartlyExplained].contains(&d.verdict));
}

/// Torque to acceleration of a mass that carries another one on a light spring, 1000 samples at 1 Hz.
fn two_masses() -> (Vec<Recording>, Ports) {
    let (own, carried, omega, damping) = (0.2, 0.12, std::f64::consts::TAU * 0.07, 0.02);
    let (steps, dt) = (200, 1.0 / 200.0);
    let mut random = ChaCha8Rng::seed_from_u64(5);
    let (mut x, mut v, mut y, mut u) = (0.0, 0.0, 0.0, 0.0);
    let (mut torque, mut acceleration) = (vec![], vec![]);
    let mut smooth = 0.0;
    for _ in 0..1000 {
        let white: f64 = random.sample(StandardNormal);
        smooth += 0.7 * (white - smooth);
        let before: f64 = v;
        for _ in 0..steps {
            let pull = carried * (omega * omega * (x - y) + 2.0 * damping * omega * (v - u));
            v += dt * (smooth - pull - 0.01 * v) / own;
            u += dt * pull / carried;
            x += dt * v;
            y += dt * u;
        }
        let noise: f64 = random.sample(StandardNormal);
        torque.push(smooth);
        acceleration.push(v - before + 0.02 * noise);
    }
    let channel = |name: &str, quantity, samples| Channel::new(name, Unit::si(quantity, true), samples);
    let channels = vec![channel("torque_arm", Quantity::Effort, torque), channel("acc_arm", Quantity::Acceleration, acceleration)];
    (vec![Recording::new(1.0, channels).expect("one length")], Ports { references: vec![], inputs: vec![0], outputs: vec![1] })
}

#[test]
fn a_mode_that_rings_for_half_of_a_record_without_a_spring_gets_no_other_name_for_sure() {
    let (trials, ports) = two_masses();
    let d = diagnose(&trials, &ports, &Options::default(), None, &mut |_| {}).expect("a diagnosis");
    assert_ne!(d.verdict, Verdict::Explained, "{:?}", d.causes);
    assert!(d.causes.iter().all(|c| c.effect == "extra-resonance" || c.probability <= 0.6), "{:?}", d.causes);
}

#[test]
fn a_resonance_is_seen_in_a_measured_acceleration_too() {
    let hidden = vec![Hidden { name: "extra-resonance", severity: 0.6 }];
    let made = make(&Case { plant: Plant::Force, hidden, other: false, background: false, trials: 2, duration_s: 40.0, seed: 8, command: (1.0, 1.0) });
    let differentiated = |recording: &Recording| {
        let rate = recording.sample_rate_hz();
        let channels = recording.channels().iter().map(|c| {
            if c.name != "pos_x" {
                return c.clone();
            }
            let x = &c.samples;
            let at = |k: usize| x[k.min(x.len() - 1)];
            let second = (0..x.len()).map(|k| (at(k + 1) - 2.0 * at(k) + at(k.saturating_sub(1))) * rate * rate).collect();
            Channel::new("acc_x", Unit::si(Quantity::Acceleration, false), second)
        });
        Recording::new(rate, channels.collect()).expect("one length")
    };
    let recordings: Vec<Recording> = made.recordings.iter().map(differentiated).collect();
    let d = diagnose(&recordings, &made.ports, &Options::default(), None, &mut |_| {}).expect("a diagnosis");
    assert_eq!(d.causes.first().map(|c| c.effect.as_str()), Some("extra-resonance"), "{:?} {:?}", d.causes, d.considered.first());
}

#[test]
fn noise_of_an_imposed_motion_beyond_the_band_is_no_torque() {
    let made = make(&Case { plant: Plant::Motion, hidden: vec![], other: false, background: false, trials: 2, duration_s: 40.0, seed: 3, command: (1.0, 1.0) });
    let mut random = ChaCha8Rng::seed_from_u64(6);
    let mut recordings = made.recordings;
    for recording in &mut recordings {
        // A tenth of a milliradian makes torques many times as large as the true ones where it is differentiated up to half of the rate.
        let name = recording.names().into_iter().find(|n| n.starts_with("angle")).expect("an angle");
        recording
            .map_channel(&name, |x| {
                let noise: f64 = random.sample(StandardNormal);
                x + 1e-4 * noise
            })
            .expect("a channel");
    }
    let d = diagnose(&recordings, &made.ports, &Options::default(), None, &mut |_| {}).expect("a diagnosis");
    assert!(d.baseline.held_out.vaf_percent[0].expect("finite") > 90.0, "{:?}", d.baseline.held_out);
    assert!(d.causes.iter().all(|c| c.effect == "limb-noise"), "{:?}", d.causes);
}

#[test]
fn the_disc_player_gets_no_cause_that_is_over_claimed() {
    let Some(d) = answer("cd-player", record("cd-player")) else { return };
    assert!(d.causes.iter().all(|c| c.probability <= 0.9), "{:?}", d.causes);
}

#[test]
fn the_ankle_has_a_reflex_in_one_direction() {
    let Some(d) = answer("ankle-pf", record("ankle-pf")) else { return };
    let reflex = d.causes.first().filter(|c| c.effect == "reflex-delay").expect("a reflex first");
    let value = |name: &str| reflex.parameters.iter().find(|p| p.name == name).map(|p| p.value.clone()).expect("a parameter");
    assert_eq!(value("one_directional"), ndof_models::effects::Value::Flag(true));
    let ndof_models::effects::Value::Number(delay) = value("delay_s") else { panic!("a number") };
    assert!((0.038..0.06).contains(&delay), "{delay}");
    let (before, after) = (d.baseline.held_out.vaf_percent[0].expect("finite"), d.extended.held_out.vaf_percent[0].expect("finite"));
    assert!(after > before + 20.0, "{before} -> {after}");
}
