//! Accuracy of the time stepping, against itself at fine steps.

use crate::common::{patient_arm, relative_error, sines, two_link_arm};
use ndof_devices::{Accuracy, Experiment, Extras, simulate_trial};
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
    for experiment in [patient_arm(), without_dry_friction(patient_arm()), two_link_arm()] {
        let error = relative_error(&run(&experiment, Accuracy::Relative(1e-6)), &run(&experiment, Accuracy::Fixed(7)));
        assert!(error < 1e-6, "{error:.2e}");
    }
}
