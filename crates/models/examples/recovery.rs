//! How often the 95 % intervals of every model hold the truth, on data that another integrator made.
//!
//! `cargo run --release -p ndof-models --example recovery [SEEDS] [MODEL] [position|force] [SECONDS] [test]`: all models or one, in time and in
//! frequency, as a table in Markdown; the slow noise is wander of the position channel, or force that the limb makes; records in time are 15 s
//! long where nothing else is said, and SEEDS may be a range, `100..200`. With `test` the profiles of
//! laws in time are not followed to their ends but asked whether they hold the truth. 90.5 to 98.5 % is where 200 seeds
//! of a nominal 95 % lie with 99 % probability. `told-apart` in place of a model counts how often the BIC tells a delay from a flexible mode in time.

#[path = "support/recovery.rs"]
mod recovery;
#[path = "support/recovery_frequency.rs"]
mod recovery_frequency;

use ndof_models::Axis;
use ndof_models::time::Mechanism;
use rayon::prelude::*;
use recovery::{Answer, Slow};
use std::ops::Range;

fn main() {
    let mut arguments = std::env::args().skip(1);
    let seeds = arguments.next().and_then(|a| range(&a)).unwrap_or(0..200);
    let only = arguments.next();
    let slow = if arguments.next().as_deref() == Some("force") { Slow::Force } else { Slow::Position };
    let seconds: f64 = arguments.next().and_then(|a| a.parse().ok()).unwrap_or(recovery::SECONDS);
    let tested = arguments.next().as_deref() == Some("test");
    let wanted = |name: &str| only.as_deref().is_none_or(|o| o == name || o == "all");
    if only.as_deref() == Some("told-apart") {
        return told_apart(seeds.end);
    }
    println!("| model | parameter | in the 95 % interval | rms error | bias | by profile | called identifiable |\n|---|---|---|---|---|---|---|");
    for case in recovery::cases().iter().filter(|c| wanted(c.law.name())) {
        let names = Mechanism::new(vec![Axis::linear("x")]).with_law(case.law.clone(), 0).parameters().into_iter();
        let names: Vec<String> = names.map(|p| p.name).collect();
        print(case.law.name(), &names, seeds.clone(), |seed| {
            if tested { recovery::test(case, seed, slow, seconds) } else { recovery::fit(case, seed, slow, seconds) }.ok()
        });
    }
    for case in recovery_frequency::cases().iter().filter(|c| wanted(&c.name)) {
        print(&case.name, &case.names(), seeds.clone(), |seed| recovery_frequency::fit(case, seed).ok());
    }
}

/// `200` is 0 to 199, `40..60` is 40 to 59.
fn range(text: &str) -> Option<Range<u64>> {
    match text.split_once("..") {
        Some((first, end)) => Some(first.parse().ok()?..end.parse().ok()?),
        None => Some(0..text.parse().ok()?),
    }
}

fn told_apart(seeds: u64) {
    for truth in ["latency", "flexible-mode"] {
        let named: Vec<Option<bool>> = (0..seeds).into_par_iter().map(|seed| recovery::names_the_truth(truth, seed).ok()).collect();
        let right = named.iter().filter(|n| **n == Some(true)).count();
        println!("{truth}: {right} of {seeds} named, {} refused", named.iter().filter(|n| n.is_none()).count());
    }
}

fn print(model: &str, names: &[String], seeds: Range<u64>, fit: impl Fn(u64) -> Option<Answer> + Sync + Send) {
    let asked = (seeds.end - seeds.start) as usize;
    let answers: Vec<Answer> = seeds.into_par_iter().filter_map(fit).collect();
    let count = answers.len() as f64;
    let lost = if answers.len() == asked { String::new() } else { format!("  {} fits refused", asked - answers.len()) };
    for (k, name) in names.iter().enumerate() {
        let share = |of: &dyn Fn(&Answer) -> bool| 100.0 * answers.iter().filter(|a| of(a)).count() as f64 / count;
        let rms = (answers.iter().map(|a| a.error[k].powi(2)).sum::<f64>() / count).sqrt();
        let bias = answers.iter().map(|a| a.error[k]).sum::<f64>() / count;
        println!(
            "| {} | {name} | {:.1} % | {:.2} % | {:.2} % | {:.0} % | {:.0} %{} |",
            if k == 0 { model } else { "" },
            share(&|a| a.covered[k]),
            100.0 * rms,
            100.0 * bias,
            share(&|a| a.profiled[k]),
            share(&|a| a.identifiable[k]),
            if k == 0 { lost.as_str() } else { "" }
        );
    }
}
