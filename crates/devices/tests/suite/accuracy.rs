//! Accuracy of the time stepping, against itself at fine steps.

use crate::common::{patient_arm, relative_error, sines};
use ndof_devices::{Accuracy, Extras, simulate_trial};

#[test]
fn explore() {
    for friction in [true, false] {
        let mut experiment = patient_arm();
        if !friction {
            for name in ["coulomb_1_nm", "coulomb_2_nm"] {
                experiment.device.parameters.insert(name.to_owned(), 0.0);
            }
        }
        let commands = sines(&experiment, 4.0);
        let run = |accuracy| {
            let start = std::time::Instant::now();
            let r = simulate_trial(&experiment, &commands, &Extras { accuracy, ..Extras::default() }, 0).expect("runs");
            (r, start.elapsed().as_secs_f64())
        };
        let (reference, _) = run(Accuracy::Fixed(9));
        for k in 0..9 {
            let (r, t) = run(Accuracy::Fixed(k));
            println!("friction {friction} 2^{k}: error {:.2e}, {:.0}x real time", relative_error(&r, &reference), 4.0 / t);
        }
        for tol in [1e-4, 1e-5, 1e-6, 1e-7] {
            let (r, t) = run(Accuracy::Relative(tol));
            println!("friction {friction} {tol:e}: error {:.2e}, {:.0}x real time", relative_error(&r, &reference), 4.0 / t);
        }
    }
}
