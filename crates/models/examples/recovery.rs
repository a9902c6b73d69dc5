//! How often the 95 % intervals of every model hold the truth, on data that another integrator made.
//!
//! `cargo run --release -p ndof-models --example recovery [SEEDS] [MODEL]`; 200 seeds take some minutes. 90.5 to 98.5 % is where 200
//! seeds of a nominal 95 % lie with 99 % probability.

#[path = "support/recovery.rs"]
mod recovery;

use ndof_models::Axis;
use ndof_models::time::Mechanism;
use rayon::prelude::*;

fn main() {
    let mut arguments = std::env::args().skip(1);
    let seeds: u64 = arguments.next().and_then(|a| a.parse().ok()).unwrap_or(200);
    let only = arguments.next();
    println!("{:<26}{:<28}{:>10}{:>12}{:>10}{:>14}", "model", "parameter", "covered", "rms error", "bias", "identifiable");
    for case in recovery::cases().iter().filter(|c| only.as_deref().is_none_or(|name| name == c.law.name())) {
        let names: Vec<String> = Mechanism::new(vec![Axis::linear("x")]).with_law(case.law.clone(), 0).parameters().into_iter().map(|p| p.name).collect();
        let answers: Vec<recovery::Answer> = (0..seeds).into_par_iter().filter_map(|seed| recovery::fit(case, seed).ok()).collect();
        let count = answers.len() as f64;
        let lost = if answers.len() as u64 == seeds { String::new() } else { format!("  {} fits refused", seeds - answers.len() as u64) };
        for (k, name) in names.iter().enumerate() {
            let share = |of: &dyn Fn(&recovery::Answer) -> bool| 100.0 * answers.iter().filter(|a| of(a)).count() as f64 / count;
            let covered = share(&|a| a.covered[k]);
            let rms = (answers.iter().map(|a| a.error[k].powi(2)).sum::<f64>() / count).sqrt();
            let bias = answers.iter().map(|a| a.error[k]).sum::<f64>() / count;
            let by = if case.thresholds.contains(&name.as_str()) { " (profile)" } else { "" };
            println!(
                "{:<26}{:<28}{:>8.1} %{:>10.2} %{:>8.2} %{:>12.0} %{}",
                if k == 0 { case.law.name() } else { "" },
                format!("{name}{by}"),
                covered,
                100.0 * rms,
                100.0 * bias,
                share(&|a| a.identifiable[k]),
                if k == 0 { &lost } else { "" }
            );
        }
    }
}
