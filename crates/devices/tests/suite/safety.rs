//! Limits that end a trial, and the arm that drifts where nothing holds it.

use crate::common::{patient_arm, sines};
use ndof_devices::{Controller, DeviceError, EndpointLinearConfig, Experiment, Extras, LimbConfig, PerAxis, Safety, linearise, simulate_trial};

#[test]
fn a_passed_limit_ends_the_trial_with_its_time_and_size() {
    let mut experiment = patient_arm();
    let commands = sines(&experiment, 8.0);
    let mut run = |safety| {
        experiment.controller.safety = safety;
        simulate_trial(&experiment, &commands, &Extras::default(), 1)
    };
    run(Safety::default()).expect("no limits");
    run(Safety { force: Some(60.0), speed: Some(3.0), distance: Some(0.2) }).expect("wide limits");
    for (safety, named) in [
        (Safety { force: Some(2.0), ..Safety::default() }, "force"),
        (Safety { speed: Some(0.01), ..Safety::default() }, "speed"),
        (Safety { distance: Some(0.002), ..Safety::default() }, "distance"),
    ] {
        match run(safety).unwrap_err() {
            DeviceError::Stopped { trial: 1, time_s, what, value, limit } => {
                assert!(what.contains(named) && value > limit && time_s < 1.0, "{what} {value} {limit} {time_s}");
            }
            other => panic!("{other}"),
        }
    }
}

#[test]
fn a_joint_at_the_end_of_its_range_ends_the_trial() {
    let mut experiment = patient_arm();
    experiment.device = ndof_devices::DeviceConfig::named("wrist");
    experiment.limb = LimbConfig::Wrist(Default::default());
    experiment.posture.joint_rad = Some(vec![0.0, 0.0, 0.7]);
    let mut commands = vec![vec![0.0; 2000]; 3];
    commands[2] = vec![1.0; 2000];
    let error = simulate_trial(&experiment, &commands, &Extras::default(), 0).unwrap_err();
    assert!(matches!(error, DeviceError::Range { joint: 3, .. }), "{error}");
}

/// An arm of stiffness 100 N/m whose tone pulls with `tone_n`.
fn toned(tone_n: f64) -> Experiment {
    let mut experiment = patient_arm();
    let diagonal = |v: f64| vec![vec![v, 0.0], vec![0.0, v]];
    experiment.limb = LimbConfig::EndpointLinear(EndpointLinearConfig {
        M: diagonal(2.0),
        B: diagonal(15.0),
        K: diagonal(100.0),
        mean_force_n: Some(vec![0.6 * tone_n, -0.8 * tone_n]),
        ..EndpointLinearConfig::default()
    });
    experiment
}

fn final_distance(experiment: &Experiment) -> f64 {
    let recording = simulate_trial(experiment, &sines(experiment, 0.0), &Extras::default(), 0).expect("runs");
    let last = |name: &str| recording.channel(name).expect("exists").samples.last().copied().expect("samples");
    last("pos_x").hypot(last("pos_y"))
}

#[test]
fn without_the_hold_tone_carries_the_arm_off_and_with_it_the_arm_stays() {
    // Tone between 4.4 and 12.3 N against 100 N/m carries the hand 4.4 to 12.3 cm, less what dry friction of about 0.8 N keeps.
    for tone_n in [4.4, 7.8, 12.3] {
        let held = toned(tone_n);
        assert!(final_distance(&held) < 1e-6);
        let mut free = held.clone();
        free.controller = Controller { hold: false, ..Controller::default() };
        let distance = final_distance(&free);
        assert!((distance - tone_n / 100.0).abs() < 0.013, "{distance} m for {tone_n} N");
        // A hold whose target stays put gives way by the force over both stiffnesses.
        let mut soft = held.clone();
        soft.controller = Controller { compensate_mean_force: false, kp: Some(PerAxis::All(300.0)), ..Controller::default() };
        let distance = final_distance(&soft);
        assert!((distance - tone_n / 400.0).abs() < 0.004, "{distance} m for {tone_n} N");
    }
}

#[test]
fn steps_of_mass_at_the_handle_are_steps_of_the_limb_s_inertia() {
    let inertia = |mass: f64| {
        let mut experiment = patient_arm();
        let LimbConfig::EndpointLinear(limb) = &mut experiment.limb else { unreachable!() };
        limb.handle_mass_kg = mass;
        linearise(&experiment).expect("builds").limb.inertia
    };
    for k in 1..4 {
        let added = 0.2 * f64::from(k);
        let step = inertia(added) - inertia(0.0);
        assert!((step[[0, 0]] - added).abs() < 1e-12 && (step[[1, 1]] - added).abs() < 1e-12 && step[[0, 1]].abs() < 1e-15, "{step}");
    }
}

#[test]
fn force_and_torque_stay_within_what_the_robot_can_give() {
    let mut experiment = patient_arm();
    experiment.controller.hold = false;
    experiment.device.parameters.extend(["coulomb_1_nm", "coulomb_2_nm"].map(|n| (n.to_owned(), 0.0)));
    let final_force = |experiment: &Experiment| {
        let commands = vec![vec![36.0; 2000], vec![48.0; 2000]];
        let recording = simulate_trial(experiment, &commands, &Extras::default(), 0).expect("runs");
        ["force_x", "force_y"].map(|name| recording.channel(name).expect("exists").samples[1999])
    };
    // 60 N asked for, 45 N given, in the same direction; after 4 s the slowest mode of the arm has died away to e⁻¹⁰.
    let [x, y] = final_force(&experiment);
    assert!((x - 27.0).abs() < 0.01 && (y - 36.0).abs() < 0.01, "{x} {y}");
    experiment.controller.force_limit = Some(20.0);
    let [x, y] = final_force(&experiment);
    assert!((x - 12.0).abs() < 0.01 && (y - 16.0).abs() < 0.01, "{x} {y}");
    // 2 N m at either motor, through lever arms of at least 0.2 m: no direction gets more than 2·2/0.2 N.
    experiment.controller.force_limit = None;
    experiment.device.parameters.insert("torque_limit_nm".to_owned(), 2.0);
    let [x, y] = final_force(&experiment);
    assert!(x.hypot(y) < 20.0 && x.hypot(y) > 2.0, "{x} {y}");
}
