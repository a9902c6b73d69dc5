//! The fit whose time `cargo bench -p ndof-models --bench fit` takes: six axes in frequency.

use crate::six_axes;
use ndof_models::{InertiaDampingStiffnessModel, Symmetry};

#[test]
fn a_limb_of_six_axes_is_recovered_from_three_trials_within_its_errors() {
    let fit = six_axes::fit(&six_axes::responses().expect("a response")).expect("a fit");
    let limb = six_axes::limb();
    let truth = InertiaDampingStiffnessModel::new(limb.axes.clone(), Symmetry::Symmetric).theta(&limb);
    assert!(fit.reason.converged() && fit.theta.len() == 63);
    // 63 at once: beyond 5 standard errors none.
    for (p, t) in fit.parameters.iter().zip(&truth) {
        assert!(p.identifiable && (p.value - t).abs() < 5.0 * p.std_error, "{t}: {p:?}");
    }
    let held = fit.parameters.iter().zip(&truth).filter(|(p, t)| (p.ci95[0]..=p.ci95[1]).contains(*t)).count();
    // 59.9 ± 1.7, less four of these.
    assert!(held >= 53, "{held} of 63");
}
