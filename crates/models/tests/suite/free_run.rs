//! Free-run fits of the simulated arm.

use crate::support;
use ndof_models::time::{FreeRunFit, Mechanism, TimeTrial};

#[test]
fn the_arm_is_recovered_from_three_trials_within_its_intervals() {
    let limb = support::patient();
    let trials: Vec<Vec<Vec<f64>>> = (0..3).map(|t| support::trial(&limb, support::TRANSDUCER, 0.0, 40 + t)).collect();
    let trials: Vec<TimeTrial<'_>> =
        trials.iter().map(|t| TimeTrial { force: vec![&t[2], &t[3]], motion: vec![&t[4], &t[5]], ..TimeTrial::default() }).collect();
    let mechanism = Mechanism::new(limb.axes.clone()).with_offset();
    let start = [1.0, 0.0, 1.0, 8.0, 0.0, 8.0, 200.0, 0.0, 200.0, 0.0, 0.0];
    let fit = FreeRunFit::new(support::RATE_HZ).fit(&mechanism, &trials, &start).expect("fit");
    assert!(fit.reason.converged() && fit.score.vaf_percent.iter().all(|v| *v > 99.9));
    let truth = [2.1, -0.55, 1.9, 11.0, -2.0, 15.0, 300.0, -60.0, 520.0];
    for (k, (p, t)) in fit.parameters.iter().zip(truth).enumerate() {
        // The transducer's compliance, 1e-6 m/N, is not in the model: K and M differ by K²/k and 2 K M/k, 0.1 %.
        assert!((p.value - t).abs() < 4.0 * p.std_error + 2e-3 * truth[k / 3 * 3 + 2], "{}: {} against {t}", p.name, p.value);
    }
}
