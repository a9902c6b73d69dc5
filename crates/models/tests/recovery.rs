//! A part of the recovery table: the whole one is `cargo run --release -p ndof-models --example recovery`.

#[path = "../examples/support/recovery.rs"]
mod recovery;

use rayon::prelude::*;

#[test]
fn intervals_hold_the_truth_on_data_that_another_integrator_made() {
    let cases = recovery::cases();
    let chosen = ["bouc-wen", "one-directional-reflex", "latency", "flexible-mode"];
    let runs: Vec<(&recovery::Case, u64)> =
        cases.iter().filter(|c| chosen.contains(&c.law.name())).flat_map(|c| (0..3).map(move |seed| (c, 500 + seed))).collect();
    let answers: Vec<recovery::Answer> = runs.par_iter().map(|(case, seed)| recovery::fit(case, *seed).expect("a fit")).collect();
    for ((case, _), answer) in runs.iter().zip(&answers) {
        // All starts lie 20 or 25 % off; half of that is no recovery. The shape of a loop is the least certain of all.
        let worst = answer.error.iter().map(|e| e.abs()).fold(0.0, f64::max);
        assert!(worst < if case.law.name() == "bouc-wen" { 1.0 } else { 0.1 }, "{}: {:?}", case.law.name(), answer.error);
        assert!(answer.identifiable.iter().take(4).all(|i| *i), "{}", case.law.name());
    }
    let count: usize = answers.iter().map(|a| a.covered.len()).sum();
    let held = answers.iter().flat_map(|a| &a.covered).filter(|c| **c).count();
    // 95 % of them, less four standard deviations.
    let least = 0.95 * count as f64 - 4.0 * (count as f64 * 0.95 * 0.05).sqrt();
    println!("{held} of {count}");
    assert!(held as f64 >= least, "{held} of {count}");
}
