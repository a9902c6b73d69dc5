//! What the diagnosis says when an effect's force law is switched off in the generator, and when its hypothesis is taken from the registry.
//!
//! ```text
//! cargo run --release -p ndof-diagnose --example mutation
//! ```
#[path = "../tests/generator/mod.rs"]
mod generator;

use generator::draw::registry_name;
use generator::{Case, Hidden, Plant, make};
use ndof_diagnose::{Diagnosis, Options, diagnose};

fn words(d: &Diagnosis) -> String {
    let causes: Vec<String> = d
        .causes
        .iter()
        .filter(|c| c.effect != "limb-noise")
        .map(|c| {
            let beside: Vec<&str> = d.confusable.iter().filter(|k| k.effects.contains(&c.effect)).flat_map(|k| k.effects.iter().map(String::as_str)).collect();
            let more = if beside.is_empty() { String::new() } else { format!(" ({})", beside.join("/")) };
            format!("{} {:.2}{more}", c.effect, c.probability)
        })
        .collect();
    format!("{:?}: {}", d.verdict, if causes.is_empty() { "nothing named".to_owned() } else { causes.join(", ") })
}

fn main() {
    let effects = [
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
        "series-compliance",
        "periodic-disturbance",
        "transient-disturbance",
    ];
    let (mut right, mut off, mut held, mut all) = (0, 0, 0, 0);
    for name in effects {
        for (plant, seed) in [(Plant::Force, 20), (Plant::Motion, 21), (Plant::Force, 22), (Plant::Planar, 23)] {
            if plant == Plant::Motion && name == "series-compliance" {
                continue;
            }
            let case = |severity: f64| Case {
                plant,
                hidden: if severity > 0.0 { vec![Hidden { name, severity }] } else { vec![] },
                other: false,
                background: false,
                trials: 2,
                duration_s: 40.0,
                seed,
                command: (1.0, 1.0),
            };
            let made = make(&case(0.5));
            let ask = |made: &generator::Made, without: &[&str]| {
                let options = Options { without: without.iter().map(|w| (*w).to_owned()).collect(), ..Options::default() };
                diagnose(&made.recordings, &made.ports, &options, None, &mut |_| {})
            };
            let known = registry_name(name);
            let (Ok(full), Ok(nothing), Ok(without)) = (ask(&made, &[]), ask(&make(&case(0.0)), &[]), ask(&made, &[known])) else {
                println!("{name} {}: no diagnosis", plant.word());
                continue;
            };
            let named = |d: &Diagnosis| d.causes.iter().any(|c| c.effect != "limb-noise");
            let sure = |d: &Diagnosis| {
                d.causes.iter().any(|c| c.effect != "limb-noise" && c.probability > 0.9 && d.confusable.iter().all(|k| !k.effects.contains(&c.effect)))
            };
            let first = full.causes.iter().find(|c| c.effect != "limb-noise").is_some_and(|c| c.effect == known);
            all += 1;
            right += usize::from(first);
            off += usize::from(!named(&nothing));
            held += usize::from(!sure(&without));
            println!("{name:22} {:7} with {:60} off {:28} without {}", plant.word(), words(&full), words(&nothing), words(&without));
        }
    }
    println!("of {all}: named first {right}; switched off, nothing named {off}; taken from the registry, no other name for sure {held}");
}
