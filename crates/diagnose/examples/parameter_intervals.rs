//! How often the intervals of a named cause's parameters hold the truth: simulations by the challenge's own integrator, one cause each.
//!
//! `cargo run --release -p ndof-diagnose --example parameter_intervals [SEEDS] [EFFECT] [quiet]`: for each effect, plant and parameter the share of
//! intervals that hold the truth, bias and scatter in standard errors. Only the hidden effect may be named: this is about numbers, not names.

use ndof_challenge::{Case, Hidden, Made, Plant, Setting, make_with};
use ndof_diagnose::{Options, diagnose};
use ndof_models::effects::{EFFECTS, Value};
use rayon::prelude::*;

/// As hidden, as named, and where it can be.
const ASKED: [(&str, &str, &[Plant]); 14] = [
    ("coulomb-friction", "coulomb-friction", &[Plant::Force, Plant::Motion, Plant::Planar]),
    ("coulomb-friction/stribeck-square", "coulomb-friction", &[Plant::Force, Plant::Motion]),
    ("hysteresis", "hysteresis", &[Plant::Force, Plant::Motion, Plant::Planar]),
    ("cubic-stiffness", "cubic-stiffness", &[Plant::Force, Plant::Motion, Plant::Planar]),
    ("asymmetric-stiffness", "asymmetric-stiffness", &[Plant::Force, Plant::Planar]),
    ("dead-zone", "dead-zone", &[Plant::Force, Plant::Planar]),
    ("end-stop", "end-stop", &[Plant::Force, Plant::Planar]),
    ("stiffness-drift", "stiffness-drift", &[Plant::Force, Plant::Motion, Plant::Planar]),
    ("measurement-delay", "measurement-delay", &[Plant::Force, Plant::Planar]),
    ("channel-filter", "channel-filter", &[Plant::Force, Plant::Planar]),
    ("reflex-delay", "reflex-delay", &[Plant::Force, Plant::Motion, Plant::Planar]),
    ("reflex-one", "reflex-delay", &[Plant::Force, Plant::Planar]),
    ("viscoelastic", "viscoelastic", &[Plant::Force, Plant::Planar]),
    ("extra-resonance", "extra-resonance", &[Plant::Force]),
];
const DURATION_S: f64 = 50.0;
/// Not one of the exam's.
const FIRST_SEED: u64 = 9_000_000;

/// Deviation from the truth in standard errors.
type Deviation = (String, f64);

fn deviations(name: &'static str, effect: &str, plant: Plant, seed: u64, quiet: bool) -> Option<Vec<Deviation>> {
    let hidden = vec![Hidden { name, severity: 1.0 }];
    let case = Case { plant, hidden, other: false, background: false, trials: 1, duration_s: DURATION_S, seed: FIRST_SEED + seed, command: (1.0, 1.0) };
    let made = make_with(&case, &Setting { quiet, ..Setting::default() });
    let without = EFFECTS.iter().map(|e| e.name().to_owned()).filter(|e| e != effect).collect();
    let found = diagnose(&made.recordings, &made.ports, &Options { without, ..Options::default() }, None, &mut |_| {}).ok()?;
    let cause = found.causes.iter().find(|c| c.effect == effect)?;
    let mut out = Vec::new();
    for (name, truth) in &made.truth[0] {
        let Some(p) = cause.parameters.iter().find(|p| p.name.starts_with(name)) else { continue };
        if let (Value::Number(value), Some([low, high])) = (&p.value, p.ci95) {
            out.push(((*name).to_owned(), (value.abs() - truth.abs()) / ((high - low) / 3.92)));
        }
    }
    let matrices = [("M", &made.mass, 0.0), ("B", &made.damping, 0.0), ("K", &made.stiffness, at_the_mean(&made))];
    for (letter, matrix, more) in matrices {
        let own = found.extended.parameters.iter().find(|p| p.name.starts_with(letter))?;
        out.push((letter.to_owned(), (own.value - matrix[0][0] - more) / own.std_error?));
    }
    Some(out)
}

/// By how much the stiffness of the first axis, where an asymmetric spring acts on it, is another one at the mean of the fitted motion than at rest: 2 k2 x.
fn at_the_mean(made: &Made) -> f64 {
    let Some((_, k2)) = made.truth[0].iter().find(|(name, _)| *name == "k2").filter(|_| made.axis == 0) else { return 0.0 };
    let motion = &made.recordings[0].channels()[made.ports.outputs[0]].samples;
    let fitted = &motion[..motion.len() * 7 / 10];
    2.0 * k2 * fitted.iter().sum::<f64>() / fitted.len() as f64
}

fn main() {
    let mut arguments = std::env::args().skip(1);
    let seeds: u64 = arguments.next().and_then(|a| a.parse().ok()).unwrap_or(50);
    let only = arguments.next().filter(|a| a != "all");
    let quiet = arguments.next().is_some_and(|a| a == "quiet");
    println!("| hidden | plant | parameter | named | held | bias | scatter |\n|---|---|---|---|---|---|---|");
    for (name, effect, plants) in ASKED.into_iter().filter(|(name, ..)| only.as_deref().is_none_or(|o| *name == o)) {
        for &plant in plants {
            let all: Vec<Vec<Deviation>> = (0..seeds).into_par_iter().filter_map(|seed| deviations(name, effect, plant, seed, quiet)).collect();
            let mut parameters: Vec<&str> = all.iter().flatten().map(|(name, _)| name.as_str()).collect();
            parameters.sort_unstable();
            parameters.dedup();
            for parameter in parameters {
                let t: Vec<f64> = all.iter().flatten().filter(|(name, _)| name == parameter).map(|(_, t)| *t).collect();
                let (n, mean) = (t.len() as f64, t.iter().sum::<f64>() / t.len() as f64);
                let held = t.iter().filter(|t| t.abs() <= 1.96).count();
                let scatter = (t.iter().map(|t| (t - mean).powi(2)).sum::<f64>() / n).sqrt();
                println!("| {name} | {} | {parameter} | {} of {seeds} | {:.0} % | {mean:+.2} | {scatter:.2} |", plant.word(), t.len(), 100.0 * held as f64 / n);
            }
        }
    }
}
