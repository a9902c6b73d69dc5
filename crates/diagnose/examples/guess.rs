//! Guess first: measured records of others. Shows what a linear model leaves of each, waits for a guess (at a terminal), and tells what the
//! diagnosis names and what is known.
//!
//! `cargo run --release -p ndof-diagnose --example guess [RECORD]`. The records are not part of the repository: they are looked for in
//! `../shared/data` beside it, or in the folder of `NDOF_RECORDS`; one that is not at hand is left out with a line.
#[path = "../tests/hidden/records/mod.rs"]
mod records;

use ndof_diagnose::{Diagnosis, Options, diagnose};
use ndof_models::effects::Value;
use std::error::Error;
use std::io::{IsTerminal, stdin};

/// Record, what was done, and what is known of it.
const KNOWN: [(&str, &str, &str); 6] = [
    (
        "emps",
        "a carriage on a screw, position-controlled; motor force in, position out",
        "dry friction of 20.39 N, an offset of -3.16 N (Janot, Gautier & Brunot)",
    ),
    (
        "ankle-pf",
        "a human ankle whose angle is imposed; angle in, torque out",
        "a stretch reflex after 40 to 50 ms, to one direction only (Kearney, Stein & Parameswaran 1997)",
    ),
    ("ankle-df2", "the same ankle in another posture", "hardly any reflex: a model of the intrinsic path without a fixed order reaches 94 to 96 % VAF"),
    ("mr-damper", "a damper whose fluid is magnetised; velocity in, force out", "hysteresis and yield: near rest the force differs by direction"),
    ("robot-arm", "a flexible robot arm; reaction torque in, acceleration out", "a second, lightly damped mode (DaISy)"),
    ("cd-player", "the arm of a CD player, two forces in, two positions out", "light damping and a weak coupling (DaISy)"),
];

fn percent(values: &[Option<f64>]) -> String {
    values.iter().map(|v| v.map_or("not finite".to_owned(), |v| format!("{v:.1} %"))).collect::<Vec<_>>().join(", ")
}

/// What the linear model leaves, without the answer.
fn clues(d: &Diagnosis) {
    println!("held-out VAF of inertia, damping and stiffness: {}", percent(&d.baseline.held_out.vaf_percent));
    let s = &d.discrepancy;
    println!(
        "of the residual a linear model could explain {:.0} %, a nonlinear one {:.0} % more, one that changes with time {:.0} %",
        100.0 * s.linear_share,
        100.0 * s.nonlinear_share,
        100.0 * s.time_varying_share
    );
    for band in &s.by_band {
        println!("  {}, {:.3} to {:.3} Hz: {:.0} % of what is left", band.output, band.band_hz[0], band.band_hz[1], 100.0 * band.share);
    }
}

fn answer(d: &Diagnosis, known: &str) {
    println!("verdict: {:?}; held-out VAF of the extended model: {}", d.verdict, percent(&d.extended.held_out.vaf_percent));
    for cause in &d.causes {
        println!("  {} ({} {}), probability {:.2}", cause.effect, cause.site.side, cause.site.axis, cause.probability);
        for p in &cause.parameters {
            let interval = p.ci95.map(|[low, high]| format!(" ({low:.4} to {high:.4})")).unwrap_or_default();
            let value = match &p.value {
                Value::Number(value) => format!("{value:.4}"),
                Value::Flag(value) => value.to_string(),
                Value::Text(value) => value.clone(),
                Value::Matrix(rows) => format!("{rows:?}"),
            };
            println!("    {} = {value}{interval} {}", p.name, p.unit);
        }
    }
    for pair in &d.confusable {
        println!("  not told apart: {}; next: {}", pair.effects.join(", "), pair.next_experiment);
    }
    d.discrepancy.notes.iter().for_each(|note| println!("  note: {note}"));
    println!("known: {known}\n");
}

fn main() -> Result<(), Box<dyn Error>> {
    let only = std::env::args().nth(1);
    for (name, read) in records::ALL.into_iter().filter(|(name, _)| only.as_ref().is_none_or(|o| o == name)) {
        let Some((trials, ports)) = read() else {
            println!("{name}: not at hand");
            continue;
        };
        let (_, done, known) = KNOWN.into_iter().find(|k| k.0 == name).ok_or("a record that nothing is known of")?;
        let found = diagnose(&trials, &ports, &Options::default(), None, &mut |_| {})?;
        println!("{name}: {done}");
        clues(&found);
        if stdin().is_terminal() {
            println!("What is it? Guess, then press Enter.");
            stdin().read_line(&mut String::new())?;
        }
        answer(&found, known);
    }
    Ok(())
}
