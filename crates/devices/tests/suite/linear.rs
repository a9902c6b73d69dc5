//! The nonlinear simulation against the linear model that is derived from the same parts.

use crate::common::{patient_arm, sines};
use ndof_devices::{Extras, linearise, simulate_trial};
use num_complex::Complex64;

/// Five-bar at the centre of the workspace: endpoint inertia of the parameter set, to its printed digits.
#[test]
fn the_endpoint_inertia_at_the_centre_is_that_of_the_design() {
    let model = linearise(&patient_arm()).expect("builds");
    for ((i, j), expected) in [((0, 0), 0.932), ((0, 1), -0.305), ((1, 0), -0.305), ((1, 1), 1.050)] {
        assert!((model.robot_inertia[[i, j]] - expected).abs() < 6e-4, "{}", model.robot_inertia);
    }
}

/// Eq. (3) with a transducer of 1e6 N/m against the rigid limit D_h (D_h + Z_r)⁻¹: the flexible mode lies near 250 Hz, so the
/// difference at 12 Hz is of the order (12/250)² = 2e-3.
#[test]
fn the_eight_state_model_approaches_the_rigid_limit() {
    let model = linearise(&patient_arm()).expect("builds");
    assert_eq!(model.a.nrows(), 8);
    for f in [0.5, 2.0, 5.0, 12.0] {
        let c = model.limb_compliance(f).expect("regular");
        let z = model.robot_stiffness(f).expect("regular");
        let t = model.force_response(f).expect("regular");
        let r = model.motion_response(f).expect("regular");
        // T (1 + Z_r (C + Z_f⁻¹)) = 1, exactly; without Z_f⁻¹ in the rigid limit.
        let with = model.compliance_with_transducer(f).expect("regular");
        let exact = t.dot(&(ndarray::Array2::<Complex64>::eye(2) + z.dot(&with)));
        let rigid = t.dot(&(ndarray::Array2::<Complex64>::eye(2) + z.dot(&c)));
        let motion = with.dot(&t) - &r;
        for i in 0..2 {
            for j in 0..2 {
                let one = Complex64::new(f64::from(u8::from(i == j)), 0.0);
                assert!((exact[[i, j]] - one).norm() < 1e-9, "{f} Hz: {exact}");
                assert!((rigid[[i, j]] - one).norm() < 4e-3, "{f} Hz: {rigid}");
                assert!(motion[[i, j]].norm() < 1e-9 * r[[i, j]].norm().max(1e-6), "{f} Hz");
            }
        }
    }
}

/// Amplitude of `signal` on the line `f`, over an integer number of its periods.
fn line(signal: &[f64], f: f64, fs: f64) -> Complex64 {
    let n = signal.len() as f64;
    signal.iter().enumerate().map(|(k, v)| v * Complex64::new(0.0, -std::f64::consts::TAU * f * k as f64 / fs).exp()).sum::<Complex64>() * (2.0 / n)
}

/// One sine at a time, too small for friction-free geometry to matter: the sampled linear model is exact up to the
/// nonlinearity, of the order of displacement over arm length (1e-5 m / 0.5 m), and the transient that is left after 6 s.
#[test]
fn small_motions_follow_the_sampled_linear_model() {
    let mut experiment = patient_arm();
    experiment.discard_s = 6.0;
    for name in ["coulomb_1_nm", "coulomb_2_nm"] {
        experiment.device.parameters.insert(name.to_owned(), 0.0);
    }
    let model = linearise(&experiment).expect("builds");
    for f in [0.5, 3.0, 11.0] {
        let (t, r) = model.sampled_responses(f).expect("regular");
        for axis in 0..2 {
            let mut commands = sines(&experiment, 0.0);
            for (k, c) in commands[axis].iter_mut().enumerate() {
                *c = 1e-3 * (std::f64::consts::TAU * f * k as f64 / 500.0).sin();
            }
            let recording = simulate_trial(&experiment, &commands, &Extras::default(), 0).expect("runs");
            let column = |name: &str| line(&recording.channel(name).expect("exists").samples, f, 500.0);
            let command = column(["cmd_x", "cmd_y"][axis]);
            for (i, name) in ["x", "y"].iter().enumerate() {
                let force = column(&format!("force_{name}")) / command;
                let motion = column(&format!("pos_{name}")) / command;
                assert!((force - t[[i, axis]]).norm() < 2e-4, "T {f} Hz {name}: {force} for {}", t[[i, axis]]);
                assert!((motion - r[[i, axis]]).norm() < 2e-4 * r[[axis, axis]].norm(), "R {f} Hz {name}: {motion} for {}", r[[i, axis]]);
            }
        }
    }
}
