//! What the diagnosis says when an effect's force law is switched off in the generator, and when its hypothesis is taken from the registry.

use ndof_challenge::draw::{SINGLE, registry_name};
use ndof_challenge::{Case, Hidden, Made, Plant, make};
use ndof_diagnose::{Cause, DiagnoseError, Diagnosis, Options, Verdict, diagnose};

/// The recordings of each effect: plant and seed.
const RECORDINGS: [(Plant, u64); 4] = [(Plant::Force, 20), (Plant::Motion, 21), (Plant::Force, 22), (Plant::Planar, 23)];

type Answer = Result<Diagnosis, DiagnoseError>;

/// Named causes; a limb's own force is always there and is no name for something hidden.
fn named(d: &Diagnosis) -> impl Iterator<Item = &Cause> {
    d.causes.iter().filter(|c| c.effect != "limb-noise")
}

fn words(answer: &Answer) -> String {
    let d = match answer {
        Ok(d) => d,
        Err(error) => return format!("no diagnosis ({error})"),
    };
    let causes: Vec<String> = named(d)
        .map(|c| {
            let beside: Vec<&str> = d.confusable.iter().filter(|k| k.effects.contains(&c.effect)).flat_map(|k| k.effects.iter().map(String::as_str)).collect();
            let more = if beside.is_empty() { String::new() } else { format!(" ({})", beside.join("/")) };
            format!("{} {:.2}{more}", c.effect, c.probability)
        })
        .collect();
    format!("{:?}: {}", d.verdict, if causes.is_empty() { "nothing named".to_owned() } else { causes.join(", ") })
}

/// Whether a name is said above 0.9 with no other beside it.
fn sure(d: &Diagnosis) -> bool {
    named(d).any(|c| c.probability > 0.9 && d.confusable.iter().all(|k| !k.effects.contains(&c.effect)))
}

fn ask(made: &Made, without: &[&str]) -> Answer {
    let options = Options { without: without.iter().map(|w| (*w).to_owned()).collect(), ..Options::default() };
    diagnose(&made.recordings, &made.ports, &options, None, &mut |_| {})
}

/// Prints the answers of every effect, or of one, and counts them.
pub fn print(only: Option<&str>) {
    // A recording without an answer counts, and as wrong.
    let (mut all, mut right, mut off, mut held, mut open) = (0, 0, 0, 0, 0);
    for name in SINGLE.into_iter().filter(|name| only.is_none_or(|o| o == *name)) {
        // A compliance in series does not show in a torque that answers an imposed angle.
        for (plant, seed) in RECORDINGS.into_iter().filter(|(plant, _)| (*plant, name) != (Plant::Motion, "series-compliance")) {
            let recorded = |severity: f64| {
                let hidden = if severity > 0.0 { vec![Hidden { name, severity }] } else { vec![] };
                make(&Case { plant, hidden, other: false, background: false, trials: 2, duration_s: 40.0, seed, command: (1.0, 1.0) })
            };
            let known = registry_name(name);
            let made = recorded(0.5);
            let (full, nothing, without) = (ask(&made, &[]), ask(&recorded(0.0), &[]), ask(&made, &[known]));
            all += 1;
            right += usize::from(full.as_ref().is_ok_and(|d| named(d).next().is_some_and(|c| c.effect == known)));
            off += usize::from(nothing.as_ref().is_ok_and(|d| named(d).next().is_none()));
            held += usize::from(without.as_ref().is_ok_and(|d| !sure(d)));
            open += usize::from(without.as_ref().is_ok_and(|d| d.verdict != Verdict::Explained && !sure(d)));
            println!("{name:22} {:7} with {:60} off {:28} without {}", plant.word(), words(&full), words(&nothing), words(&without));
        }
    }
    println!(
        "of {all}: named first {right}; switched off, nothing named {off}; taken from the registry, no other name for sure {held}, nor called explained {open}"
    );
}
