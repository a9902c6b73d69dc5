//! Free-run fits: a measured carriage with dry friction, and the simulated arm.

mod support;

use ndof_models::Axis;
use ndof_models::time::{FreeRunFit, Mechanism, TimeTrial};

#[test]
fn the_carriage_of_emps_has_its_published_mass_and_friction() {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data/emps/DATA_EMPS.csv");
    let Ok(text) = std::fs::read_to_string(&path) else {
        println!("skipped: no {}", path.display());
        return;
    };
    let rows: Vec<Vec<f64>> = text.lines().filter(|l| !l.starts_with('#')).skip(1).map(|l| l.split(',').filter_map(|v| v.parse().ok()).collect()).collect();
    let (force, position): (Vec<f64>, Vec<f64>) = rows.iter().filter(|r| r.len() == 4).map(|r| (r[2], r[3])).unzip();
    let mechanism = Mechanism { axes: vec![Axis::linear("carriage")], spring: false, coulomb: true, offset: true, stick_velocity: 1e-3 };
    // A free mass integrates every error of the motor's force twice: short windows keep that out of the fit.
    let settings = FreeRunFit { sample_rate_hz: 1000.0, window_s: Some(0.3) };
    let cut = force.len() * 7 / 10;
    let part = |range: std::ops::Range<usize>| [TimeTrial { force: vec![&force[range.clone()]], motion: vec![&position[range]] }];
    let fit = settings.fit(&mechanism, &part(0..force.len()), &[80.0, 100.0, 5.0, 0.0]).expect("fit");
    println!("{:?} ± {:?}", fit.theta, fit.parameters.iter().map(|p| p.std_error).collect::<Vec<_>>());
    // Janot, Gautier & Brunot (2019): 95.11 kg, 203.5 N s/m, 20.39 N, −3.16 N.
    for (found, published) in fit.parameters.iter().zip([95.11, 203.5, 20.39, -3.16]) {
        assert!((found.ci95[0]..=found.ci95[1]).contains(&published), "{found:?} against {published}");
        assert!((found.value / published - 1.0).abs() < 0.03, "{found:?} against {published}");
    }
    let estimated = settings.fit(&mechanism, &part(0..cut), &[80.0, 100.0, 5.0, 0.0]).expect("fit");
    let longer = FreeRunFit { window_s: Some(2.0), ..settings };
    let (nrmse, vaf) = longer.validate(&mechanism, &estimated.theta, &part(cut..force.len())).expect("runs");
    println!("held out: nrmse {nrmse:?}, VAF {vaf:?} %");
    // Without dry friction the force residual is four times as large; half of that has to show in free runs.
    let smooth = Mechanism { coulomb: false, ..mechanism };
    let without = settings.fit(&smooth, &part(0..cut), &[80.0, 100.0, 0.0]).expect("fit");
    let (rest, _) = longer.validate(&smooth, &without.theta, &part(cut..force.len())).expect("runs");
    assert!(2.0 * nrmse[0] < rest[0] && vaf[0] > 99.9, "{nrmse:?} against {rest:?}");
}

#[test]
fn the_arm_is_recovered_from_three_trials_within_its_intervals() {
    let limb = support::patient();
    let trials: Vec<Vec<Vec<f64>>> = (0..3).map(|t| support::trial(&limb, 0.0, 40 + t)).collect();
    let trials: Vec<TimeTrial<'_>> = trials.iter().map(|t| TimeTrial { force: vec![&t[2], &t[3]], motion: vec![&t[4], &t[5]] }).collect();
    let mechanism = Mechanism { axes: limb.axes.clone(), spring: true, coulomb: false, offset: true, stick_velocity: 1e-3 };
    let start = [1.0, 0.0, 1.0, 8.0, 0.0, 8.0, 200.0, 0.0, 200.0, 0.0, 0.0];
    let fit = FreeRunFit { sample_rate_hz: support::RATE_HZ, window_s: None }.fit(&mechanism, &trials, &start).expect("fit");
    assert!(fit.reason.converged() && fit.vaf_percent.iter().all(|v| *v > 99.9));
    let truth = [2.1, -0.55, 1.9, 11.0, -2.0, 15.0, 300.0, -60.0, 520.0];
    for (k, (p, t)) in fit.parameters.iter().zip(truth).enumerate() {
        // The transducer's compliance, 1e-6 m/N, is not in the model: K and M differ by K²/k and 2 K M/k, 0.1 %.
        assert!((p.value - t).abs() < 4.0 * p.std_error + 2e-3 * truth[k / 3 * 3 + 2], "{}: {} against {t}", p.name, p.value);
    }
}
