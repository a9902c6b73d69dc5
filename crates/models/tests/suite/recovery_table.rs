//! A part of the recovery table: the whole one is `cargo run --release -p ndof-models --example recovery`.

use crate::{recovery, recovery_frequency};
use ndof_models::blocks::{BLOCKS, Composite};
use ndof_models::time::{FreeRunFit, Mechanism, TimeTrial, laws};
use ndof_models::{Axis, InertiaDampingStiffnessModel, Smoothing, Symmetry, WeightedFit, linear_start};
use rayon::prelude::*;

#[test]
fn intervals_hold_the_truth_on_data_that_another_integrator_made() {
    let cases = recovery::cases();
    let chosen = ["bouc-wen", "one-directional-reflex", "latency", "flexible-mode"];
    let runs: Vec<(&recovery::Case, u64)> =
        cases.iter().filter(|c| chosen.contains(&c.law.name())).flat_map(|c| (0..3).map(move |seed| (c, 500 + seed))).collect();
    let answers: Vec<recovery::Answer> =
        runs.par_iter().map(|(case, seed)| recovery::fit(case, *seed, recovery::Slow::Position, recovery::SECONDS).expect("a fit")).collect();
    for ((case, _), answer) in runs.iter().zip(&answers) {
        // All starts lie 20 or 25 % off; half of that is no recovery. The shape of a loop is the least certain of all.
        let worst = answer.error.iter().map(|e| e.abs()).fold(0.0, f64::max);
        assert!(worst < if case.law.name() == "bouc-wen" { 1.0 } else { 0.1 }, "{}: {:?}", case.law.name(), answer.error);
        assert!(answer.identifiable.iter().take(4).all(|i| *i), "{}", case.law.name());
        // Gains and delays leave no bent valley in such records.
        assert!(answer.profiled.iter().take(3).all(|p| !p), "{}", case.law.name());
    }
    let count: usize = answers.iter().map(|a| a.covered.len()).sum();
    let held = answers.iter().flat_map(|a| &a.covered).filter(|c| **c).count();
    // 95 % of them, less four standard deviations.
    let least = 0.95 * count as f64 - 4.0 * (count as f64 * 0.95 * 0.05).sqrt();
    println!("{held} of {count}");
    assert!(held as f64 >= least, "{held} of {count}");
}

#[test]
fn a_wall_that_was_never_touched_is_called_not_identifiable_and_the_limb_is_found_all_the_same() {
    let cases = recovery::cases();
    let case = cases.iter().find(|c| c.law.name() == "cubic-stiffness").expect("in the list");
    let (force, motion) = recovery::record(case, 3, recovery::Slow::Position);
    let trial = [TimeTrial { force: vec![&force], motion: vec![&motion], ..TimeTrial::default() }];
    let mechanism = Mechanism::new(vec![Axis::linear("x")]).with_law(case.law.clone(), 0).with(laws::EndStop { positive: true }, 0);
    let settings = FreeRunFit { noise: recovery::NOISE, substeps: 2, ..FreeRunFit::new(recovery::RATE_HZ) };
    let mut start = recovery::truth(case);
    // Ten times as far as the limb ever went.
    start.extend([800.0, 10.0 * motion.iter().copied().fold(0.0, f64::max)]);
    let found = settings.fit(&mechanism, &trial, &start).expect("a fit");
    let identifiable: Vec<bool> = found.parameters.iter().map(|p| p.identifiable).collect();
    assert_eq!(identifiable, [true, true, true, true, false, false]);
    assert!(found.parameters[4].std_error.is_infinite() && found.condition.is_infinite());
    for (p, truth) in found.parameters.iter().zip(recovery::truth(case)) {
        assert!((p.value - truth).abs() < 4.0 * p.std_error, "{p:?}");
    }
}

const SEEDS: u64 = 60;
/// Of 60 decisions that are right in 99 of 100 cases, as many as this are wrong with a probability of 1e-3.
const MOST_WRONG: usize = 4;

#[test]
fn a_delay_a_flexible_mode_and_a_series_compliance_are_told_apart_in_frequency() {
    let candidates = ["delay", "flexible-mode", "series-compliance"];
    for truth in candidates {
        let cases = recovery_frequency::cases();
        let case = cases.iter().find(|c| c.name == format!("{}, in frequency", truth.replace('-', " "))).expect("in the list");
        let chosen: Vec<&str> = (0..SEEDS)
            .into_par_iter()
            .map(|seed| {
                let (response, _) = recovery_frequency::responses(case, 1000 + seed).expect("a response");
                let settings = WeightedFit { band_hz: recovery_frequency::BAND_HZ, smoothing: Smoothing::Open, ..WeightedFit::default() };
                let arm = InertiaDampingStiffnessModel::new(vec![Axis::linear("x")], Symmetry::Symmetric);
                let start = linear_start(&arm, &response.band(0.3, 6.0)).expect("start");
                let plain = ("none", settings.fit(&arm, &response, &start).expect("fit").bic());
                let with = candidates.iter().map(|name| {
                    let card = BLOCKS.iter().find(|c| c.name() == *name).expect("in the registry");
                    let model = Composite::of_cards(&arm, &[card]);
                    (*name, settings.fit_from(&model, &response, &model.starts(&start)).expect("fit").bic())
                });
                std::iter::once(plain).chain(with).min_by(|a, b| a.1.total_cmp(&b.1)).expect("four").0
            })
            .collect();
        let wrong = chosen.iter().filter(|name| **name != truth).count();
        println!("{truth}: {} of {SEEDS} named", chosen.len() - wrong);
        assert!(wrong <= MOST_WRONG, "{truth}: {chosen:?}");
    }
}

#[test]
fn a_delay_and_a_flexible_mode_are_told_apart_in_time() {
    for truth in ["latency", "flexible-mode"] {
        let right = (0..4u64).into_par_iter().filter(|seed| recovery::names_the_truth(truth, 2000 + seed).expect("a fit")).count();
        assert_eq!(right, 4, "{truth}");
    }
}

#[test]
fn intervals_of_linear_models_in_frequency_hold_the_truth() {
    for case in recovery_frequency::cases() {
        let answers: Vec<recovery::Answer> = (0..20u64).into_par_iter().map(|seed| recovery_frequency::fit(&case, 3000 + seed).expect("a fit")).collect();
        for (k, name) in case.names().iter().enumerate() {
            let held = answers.iter().filter(|a| a.covered[k]).count();
            // 15 or fewer of 20 at 95 %: 3e-4.
            assert!(held > 15, "{} {name}: {held} of 20", case.name);
        }
    }
}

#[test]
fn a_search_that_is_thrown_against_a_bound_comes_back() {
    // With a bold first step the bristles' excess runs to its bound and the Stribeck velocity to nothing.
    let cases = recovery::cases();
    let case = cases.iter().find(|c| c.law.name() == "lugre-friction").expect("in the list");
    let (force, motion) = recovery::record(case, 6, recovery::Slow::Position);
    let trial = [TimeTrial { force: vec![&force], motion: vec![&motion], ..TimeTrial::default() }];
    let mechanism = Mechanism::new(vec![Axis::linear("x")]).with_law(case.law.clone(), 0);
    let settings = FreeRunFit { noise: recovery::NOISE, substeps: 2, ..FreeRunFit::new(recovery::RATE_HZ) };
    let truth = recovery::truth(case);
    let far: Vec<f64> = truth.iter().enumerate().map(|(k, t)| t * if k % 2 == 0 { 1.25 } else { 0.8 }).collect();
    let [far, near] = [far, truth].map(|start| settings.fit(&mechanism, &trial, &start).expect("a fit"));
    // Both stop when the cost falls by less than 1e-12 of it.
    assert!((far.deviance - near.deviance).abs() < 1e-3, "{} {}", far.deviance, near.deviance);
    for (a, b) in far.parameters.iter().zip(&near.parameters) {
        assert!((a.value - b.value).abs() < 0.01 * b.std_error && a.identifiable, "{a:?} {b:?}");
    }
}

#[test]
fn a_bent_valley_is_profiled_and_what_it_leaves_open_is_called_so() {
    let cases = recovery::cases();
    let case = cases.iter().find(|c| c.law.name() == "reflex").expect("in the list");
    // Wald's intervals of this record miss B, K and the reflex' stiffness.
    let answer = recovery::fit(case, 3, recovery::Slow::Position, recovery::SECONDS).expect("a fit");
    assert!(answer.profiled.iter().all(|p| *p) && answer.covered.iter().all(|c| *c));
    // One search with a parameter held at its truth says the same as the interval's ends.
    assert_eq!(recovery::test(case, 3, recovery::Slow::Position, recovery::SECONDS).expect("a fit").covered, answer.covered);
    // M, B and K are known to a part of themselves; the gains of the reflex are not.
    assert!(answer.identifiable[..3].iter().all(|i| *i) && answer.identifiable[3..5].iter().all(|i| !*i), "{:?}", answer.identifiable);
}
