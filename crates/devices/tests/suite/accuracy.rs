//! Accuracy of the time stepping, against motions by other engines (tests/reference_devices) and against itself at fine steps.

use crate::common::{patient_arm, relative_error, sines, two_link_arm};
use crate::dynamics::{reference_file, table};
use ndof_devices::{Accuracy, Controller, DeviceConfig, EndpointLinearConfig, Experiment, Extras, LimbConfig, SpringArrayConfig, simulate_trial};
use ndof_signal::Recording;

fn run(experiment: &Experiment, accuracy: Accuracy) -> Recording {
    simulate_trial(experiment, &sines(experiment, 4.0), &Extras { accuracy, ..Extras::default() }, 0).expect("runs")
}

fn without_dry_friction(mut experiment: Experiment) -> Experiment {
    for name in ["coulomb_1_nm", "coulomb_2_nm"] {
        experiment.device.parameters.insert(name.to_owned(), 0.0);
    }
    experiment
}

#[test]
fn halving_the_step_shows_order_four() {
    for experiment in [patient_arm(), without_dry_friction(patient_arm()), without_dry_friction(two_link_arm())] {
        let mut experiment = experiment;
        experiment.duration_s = 2.0;
        let reference = run(&experiment, Accuracy::Fixed(8));
        let errors: Vec<f64> = (2..6).map(|k| relative_error(&run(&experiment, Accuracy::Fixed(k)), &reference)).collect();
        for pair in errors.windows(2) {
            let order = (pair[0] / pair[1]).log2();
            // Dry friction bends within a step or two: the order settles within a fifth of four there.
            assert!((order - 4.0).abs() < 0.3, "order {order:.2} from {errors:?}");
        }
    }
}

#[test]
fn the_default_accuracy_is_kept() {
    let mut springs = patient_arm();
    springs.limb = LimbConfig::SpringArray(SpringArrayConfig { configuration: Some("sa1".to_owned()), ..SpringArrayConfig::default() });
    for experiment in [patient_arm(), without_dry_friction(patient_arm()), two_link_arm(), springs] {
        let error = relative_error(&run(&experiment, Accuracy::Relative(1e-6)), &run(&experiment, Accuracy::Fixed(7)));
        assert!(error < 1e-6, "{error:.2e}");
    }
}

fn diagonal(values: [f64; 3]) -> Vec<Vec<f64>> {
    (0..3).map(|i| (0..3).map(|j| if i == j { values[i] } else { 0.0 }).collect()).collect()
}

/// A robot without a hold whose endpoint is pushed for 20 samples and then left alone for the rest of a second.
fn struck(device: DeviceConfig, limb: EndpointLinearConfig) -> Experiment {
    let controller = Controller { hold: false, ..Controller::default() };
    Experiment { device, limb: LimbConfig::EndpointLinear(limb), controller, duration_s: 1.0, discard_s: 0.0, ..patient_arm() }
}

/// The worst relative rms error of position and force against a reference of `motion_*.csv`, whose positions begin at `shift`.
fn against_reference(experiment: &Experiment, push: &[f64], file: &str, shift: &[f64], accuracy: Accuracy) -> f64 {
    let m = push.len();
    let commands: Vec<Vec<f64>> = push.iter().map(|p| (0..500).map(|k| if k < 20 { *p } else { 0.0 }).collect()).collect();
    let found = simulate_trial(experiment, &commands, &Extras { accuracy, ..Extras::default() }, 0).expect(file);
    let (_, rows) = table(file);
    assert_eq!((rows.len(), rows[0].len()), (500, 2 * m), "{file}");
    let mut worst: f64 = 0.0;
    for c in 0..2 * m {
        // The reference has positions first, a recording commands, forces, positions.
        let samples = &found.channels()[if c < m { 2 * m + c } else { c }].samples;
        let reference: Vec<f64> = rows.iter().map(|row| row[c] + if c < m { shift[c] } else { 0.0 }).collect();
        let mean = reference.iter().sum::<f64>() / 500.0;
        let size: f64 = reference.iter().map(|v| (v - mean).powi(2)).sum();
        let error: f64 = samples.iter().zip(&reference).map(|(a, b)| (a - b).powi(2)).sum();
        worst = worst.max((error / size).sqrt());
    }
    worst
}

#[test]
fn free_motions_agree_with_mujoco_and_pinocchio_over_one_second() {
    let planar = EndpointLinearConfig {
        M: vec![vec![2.1, -0.55], vec![-0.55, 1.9]],
        B: vec![vec![11.0, -2.0], vec![-2.0, 15.0]],
        K: vec![vec![300.0, -60.0], vec![-60.0, 520.0]],
        ..EndpointLinearConfig::default()
    };
    let mut five_bar = struck(DeviceConfig::named("mit-manus"), planar);
    five_bar.device.parameters.extend(["coulomb_1_nm", "coulomb_2_nm", "viscous_1_nm_s_per_rad", "viscous_2_nm_s_per_rad"].map(|n| (n.to_owned(), 0.0)));

    let turning = EndpointLinearConfig {
        M: diagonal([0.0042, 0.0049, 0.0052]),
        B: diagonal([0.03, 0.03, 0.05]),
        K: diagonal([0.756, 0.992, 2.92]),
        ..EndpointLinearConfig::default()
    };
    let mut wrist = struck(DeviceConfig::named("wrist"), turning);
    wrist.device.parameters.extend(["coulomb_nm", "gravity_compensation"].map(|n| (n.to_owned(), 0.0)));
    wrist.posture.joint_rad = Some(vec![0.3, -0.2, 0.1]);

    let spatial = EndpointLinearConfig {
        M: diagonal([1.5, 1.2, 1.0]),
        B: diagonal([12.0, 10.0, 9.0]),
        K: diagonal([300.0, 250.0, 200.0]),
        ..EndpointLinearConfig::default()
    };
    let chain = DeviceConfig {
        axes: Some(["x", "y", "z"].map(str::to_owned).to_vec()),
        home_rad: Some(vec![0.3, 0.1, 0.8]),
        ..DeviceConfig::from_file(&reference_file("three_link.urdf"))
    };
    let chain = struck(chain, spatial);
    for (experiment, push, file, shift) in [
        (&five_bar, [20.0, -15.0].as_slice(), "motion_five_bar.csv", [0.0, -0.65].as_slice()),
        (&wrist, &[0.6, -0.5, 0.7], "motion_wrist.csv", &[0.0; 3]),
        (&chain, &[15.0, -10.0, 8.0], "motion_three_link.csv", &[0.0; 3]),
    ] {
        let error = |accuracy| against_reference(experiment, push, file, shift, accuracy);
        let stated = error(Accuracy::Relative(1e-6));
        let [two, four] = [1, 2].map(|halvings| error(Accuracy::Fixed(halvings)));
        println!("{file}: {stated:.2e} at 1e-6; {two:.2e} at 2 steps a sample, {four:.2e} at 4");
        // Halving the step of a method of order 4 divides its error by 16, by more than 8 before that has settled.
        assert!(two / four > 8.0, "{file}: {two:.2e} {four:.2e}");
        // What the integrator states of itself.
        assert!(stated < 1e-6, "{file}: {stated:.2e}");
    }
}
