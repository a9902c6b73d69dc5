//! The blind challenge: recordings with something hidden, drawn from a seed, and how often the diagnosis names it.
//!
//! ```text
//! cargo run --release -p ndof-diagnose --example blind_challenge -- --cases 200 --seed 1 [--kind clear|other|null|background|pair|outside|all] [--plant …] [--verbose]
//! ```
//!
//! Prints a confusion matrix, the shares that DIAGNOSIS asks for, and a reliability table.

#[path = "../tests/generator/mod.rs"]
mod generator;

use generator::{Case, Hidden, Plant, make};
use ndof_diagnose::{Diagnosis, Options, diagnose};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::collections::BTreeMap;
use std::time::Instant;

const EVERYWHERE: [&str; 14] = [
    "coulomb-friction",
    "hysteresis",
    "cubic-stiffness",
    "asymmetric-stiffness",
    "dead-zone",
    "end-stop",
    "reflex-delay",
    "reflex-one",
    "extra-resonance",
    "viscoelastic",
    "stiffness-drift",
    "measurement-delay",
    "channel-filter",
    "periodic-disturbance",
];
const FREE_MASS: [&str; 5] = ["coulomb-friction", "hysteresis", "extra-resonance", "measurement-delay", "periodic-disturbance"];
const OUTSIDE: [&str; 4] = ["x-quadratic-damping", "x-van-der-pol", "x-periodic-stiffness", "x-cogging"];
const PAIRS: [(&str, &str); 8] = [
    ("coulomb-friction", "measurement-delay"),
    ("hysteresis", "channel-filter"),
    ("cubic-stiffness", "coulomb-friction"),
    ("reflex-delay", "measurement-delay"),
    ("stiffness-drift", "hysteresis"),
    ("extra-resonance", "dead-zone"),
    ("viscoelastic", "cubic-stiffness"),
    ("hysteresis", "coulomb-friction"),
];

/// The registry's name of a hidden thing.
fn registry_name(hidden: &str) -> &str {
    match hidden {
        "reflex-one" => "reflex-delay",
        "series-compliance" => "extra-resonance",
        other => other,
    }
}

fn draw(rng: &mut ChaCha8Rng, kind: &str, plant: Option<Plant>) -> Case {
    let plants = [Plant::Force, Plant::Planar, Plant::Motion, Plant::Mass];
    let plant = plant.unwrap_or_else(|| plants[rng.random_range(0..plants.len())]);
    let severity = |rng: &mut ChaCha8Rng, lo: f64| (rng.random_range(f64::ln(lo)..0.0)).exp();
    let list: &[&'static str] = if plant == Plant::Mass { &FREE_MASS } else { &EVERYWHERE };
    let hidden = match kind {
        "null" | "background" => vec![],
        "pair" => {
            let (a, b) = PAIRS[rng.random_range(0..PAIRS.len())];
            [a, b].map(|name| Hidden { name, severity: severity(rng, 0.08) * 0.6 }).to_vec()
        }
        "outside" => {
            let name = OUTSIDE[rng.random_range(0..if plant == Plant::Mass { 2 } else { OUTSIDE.len() })];
            vec![Hidden { name, severity: severity(rng, 0.08) }]
        }
        _ => {
            let name = list[rng.random_range(0..list.len())];
            vec![Hidden { name, severity: severity(rng, 0.05) }]
        }
    };
    let plant = if kind == "pair" && plant == Plant::Mass { Plant::Force } else { plant };
    Case {
        plant,
        hidden,
        other: kind == "other",
        background: kind == "background",
        trials: if rng.random_range(0.0..1.0) < 0.7 { 3 } else { 1 },
        duration_s: 50.0,
        seed: rng.random(),
    }
}

#[derive(Default)]
struct Tally {
    cases: usize,
    right: usize,
    axis: usize,
    nothing: usize,
    confident_wrong: usize,
    exact: usize,
    seconds: f64,
}

fn argument(name: &str) -> Option<String> {
    let all: Vec<String> = std::env::args().collect();
    all.iter().position(|a| a == name).and_then(|k| all.get(k + 1).cloned())
}

fn confusable_with(d: &Diagnosis, name: &str) -> bool {
    d.confusable.iter().any(|c| c.effects.iter().any(|e| e == name))
}

fn main() {
    let number = |name: &str, default: u64| argument(name).and_then(|v| v.parse().ok()).unwrap_or(default);
    let (cases, seed) = (number("--cases", 40), number("--seed", 1));
    let wanted = argument("--kind").unwrap_or_else(|| "all".to_owned());
    let plant = argument("--plant").and_then(|p| match p.as_str() {
        "planar" => Some(Plant::Planar),
        "force" => Some(Plant::Force),
        "mass" => Some(Plant::Mass),
        "motion" => Some(Plant::Motion),
        "wrist" => Some(Plant::Wrist),
        _ => None,
    });
    let verbose = std::env::args().any(|a| a == "--verbose");
    let kinds = ["clear", "other", "null", "background", "pair", "outside"];
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut tallies: BTreeMap<String, Tally> = BTreeMap::new();
    let mut confusion: BTreeMap<(String, String), usize> = BTreeMap::new();
    let mut reliability: Vec<(f64, bool)> = Vec::new();
    for number in 0..cases {
        let kind = if wanted == "all" { kinds[number as usize % kinds.len()] } else { wanted.as_str() };
        let case = draw(&mut rng, kind, plant);
        let made = make(&case);
        let clock = Instant::now();
        let found = match diagnose(&made.recordings, &made.ports, &Options::default(), None, &mut |_| {}) {
            Ok(found) => found,
            Err(error) => {
                println!("{number} {kind} {case:?}: {error}");
                continue;
            }
        };
        let seconds = clock.elapsed().as_secs_f64();
        let truth: Vec<&str> = case.hidden.iter().map(|h| registry_name(h.name)).collect();
        // A limb's own force is always there; it is no rival of what was hidden.
        let causes: Vec<_> = found.causes.iter().filter(|c| c.effect != "limb-noise").collect();
        let lead = causes.first().map_or("nothing", |c| c.effect.as_str());
        let right = match truth.as_slice() {
            [] => causes.is_empty(),
            _ if kind == "outside" => causes.is_empty() || causes.iter().all(|c| c.probability <= 0.9),
            [one] => {
                lead == *one || (!causes.is_empty() && confusable_with(&found, one) && found.confusable.iter().any(|c| c.effects.iter().any(|e| e == lead)))
            }
            several => several.iter().all(|t| causes.iter().any(|c| c.effect == *t) || confusable_with(&found, t)),
        };
        let axes = ["x", "y"];
        let tally = tallies.entry(format!("{kind} {}", if wanted == "all" { String::new() } else { format!("{:?}", case.plant) })).or_default();
        tally.cases += 1;
        tally.right += usize::from(right);
        tally.nothing += usize::from(causes.is_empty());
        tally.exact += usize::from(causes.len() == truth.len() && right);
        tally.axis += usize::from(
            right
                && causes.first().is_some_and(|c| c.site.axis.is_empty() || made.axis >= 2 || c.site.axis == axes[made.axis] || made.ports.outputs.len() == 1),
        );
        tally.seconds += seconds;
        for cause in &causes {
            let good = truth.iter().any(|t| *t == cause.effect);
            reliability.push((cause.probability, good));
            tally.confident_wrong += usize::from(!good && cause.probability > 0.9 && !found.confusable.iter().any(|c| c.effects.contains(&cause.effect)));
        }
        if truth.len() <= 1 {
            *confusion.entry((case.hidden.first().map_or("nothing", |h| h.name).to_owned(), lead.to_owned())).or_default() += 1;
        }
        if verbose || !right {
            let hidden: Vec<String> = case.hidden.iter().map(|h| format!("{} {:.3}", h.name, h.severity)).collect();
            let named: Vec<String> = found
                .causes
                .iter()
                .map(|c| {
                    format!(
                        "{}[{}] p {:.2} bic {:.0} expl {:.2?} {:.2?}->{:.2?} {:?}",
                        c.effect,
                        c.site.axis,
                        c.probability,
                        c.gain.delta_bic,
                        c.gain.explained_fraction,
                        c.gain.nrmse_before,
                        c.gain.nrmse_after,
                        c.parameters.iter().map(|p| format!("{} {:?} {:?}", p.name, p.value, p.ci95)).collect::<Vec<_>>()
                    )
                })
                .collect();
            println!(
                "{number} {kind} {:?} x{} axis {} [{}] {:?} -> {:?} {} | floor {:.3?} minor {:?} confusable {:?} notes {:?} {:.2} s",
                case.plant,
                case.trials,
                made.axis,
                hidden.join(", "),
                made.truth,
                found.verdict,
                named.join(" + "),
                found.noise_floor.nrmse,
                found.minor.iter().map(|m| format!("{} {:.4}", m.effect, m.removed)).collect::<Vec<_>>(),
                found.confusable.iter().map(|c| c.effects.join("~")).collect::<Vec<_>>(),
                found.discrepancy.notes,
                seconds
            );
        }
    }
    println!("\n{:24} {:>6} {:>7} {:>7} {:>7} {:>9} {:>10} {:>6}", "kind", "cases", "right", "exact", "axis", "nothing", "sure+wrong", "s");
    for (kind, t) in &tallies {
        let share = |n: usize| 100.0 * n as f64 / t.cases as f64;
        println!(
            "{kind:24} {:6} {:6.1}% {:6.1}% {:6.1}% {:8.1}% {:9.1}% {:6.2}",
            t.cases,
            share(t.right),
            share(t.exact),
            share(t.axis),
            share(t.nothing),
            share(t.confident_wrong),
            t.seconds / t.cases as f64
        );
    }
    println!("\nhidden -> named first");
    for ((hidden, named), count) in &confusion {
        println!("{hidden:24} {named:24} {count}");
    }
    reliability.sort_by(|a, b| a.0.total_cmp(&b.0));
    println!("\nreliability (5 bins of equal count): mean probability, share right, n");
    let mut error = 0.0;
    let bins = 5.min(reliability.len().max(1));
    for b in 0..bins {
        let part = &reliability[b * reliability.len() / bins..(b + 1) * reliability.len() / bins];
        if part.is_empty() {
            continue;
        }
        let n = part.len() as f64;
        let (p, r) = (part.iter().map(|x| x.0).sum::<f64>() / n, part.iter().filter(|x| x.1).count() as f64 / n);
        error += (p - r).abs() * n / reliability.len() as f64;
        println!("{p:.3} {r:.3} {}", part.len());
    }
    println!("expected calibration error {error:.3}");
}
