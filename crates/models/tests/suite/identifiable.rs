//! What the data do not determine is called so.

use crate::recovery::{self, NOISE, RATE_HZ, Slow, record, truth};
use ndof_models::Axis;
use ndof_models::time::{FreeRunFit, Mechanism, TimeTrial};
use rayon::prelude::*;

#[test]
fn thresholds_that_were_never_reached_and_sums_whose_parts_cannot_be_told_are_called_not_identifiable() {
    // Law, its parameters, and which of M, B, K and those the data determine.
    let (yes, no) = (true, false);
    let expected: [(&str, &[f64], &[bool]); 8] = [
        ("dead-zone", &[300.0, 1.0], &[yes, yes, yes, no, no]),
        ("backlash", &[300.0, 1.0], &[yes, yes, yes, no, no]),
        ("end-stop", &[800.0, 1.0], &[yes, yes, yes, no, no]),
        ("saturation", &[1e3], &[yes, yes, yes, no]),
        // A spring that never yields is the limb's own.
        ("short-range-stiffness", &[300.0, 1.0], &[yes, yes, no, no, no]),
        ("maxwell-slip", &[300.0, 1.0], &[yes, yes, no, no, no]),
        // No excess has no velocity, no reflex no delay.
        ("stribeck-friction", &[0.8, 0.0, 0.04], &[yes, yes, yes, yes, no, no]),
        ("one-directional-reflex", &[0.0, 0.045, 3.0], &[yes, yes, yes, no, no, no]),
    ];
    let cases = recovery::cases();
    let found: Vec<Vec<bool>> = expected
        .par_iter()
        .map(|(name, own, _)| {
            let mut case = recovery::cases().swap_remove(cases.iter().position(|c| c.law.name() == *name).expect("in the list"));
            case.truth = own.to_vec();
            let (force, motion) = record(&case, 7, Slow::Position);
            let trial = [TimeTrial { force: vec![&force], motion: vec![&motion], ..TimeTrial::default() }];
            let mechanism = Mechanism::new(vec![Axis::linear("x")]).with_law(case.law.clone(), 0);
            let settings = FreeRunFit { noise: NOISE, substeps: 2, ..FreeRunFit::new(RATE_HZ) };
            let fit = settings.fit(&mechanism, &trial, &truth(&case)).expect("a fit");
            fit.parameters.iter().map(|p| p.identifiable).collect()
        })
        .collect();
    for ((name, _, expected), found) in expected.iter().zip(&found) {
        assert_eq!(found, expected, "{name}");
    }
}
