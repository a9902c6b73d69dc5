//! The blind challenge: recordings with something hidden, drawn from a seed, and how often the diagnosis names it.
//!
//! ```text
//! cargo run --release -p ndof-diagnose --example blind_challenge -- --cases 2500 --seed 1 --out blind
//! ```
//!
//! prints the rates that are asked of a diagnosis, the confusion matrix and the reliability table, and stores them
//! (`blind.txt`, `blind.json`, `confusion.svg`, `reliability.svg`). Case k of a seed is always the same, so a long challenge may be run in
//! parts: `--first K --cases N --rows FILE` appends to FILE, and `--from FILE …` prints what the files say together.
//! `--train` prints the coefficients of the probability that the rows
//! give; probabilities of stored rows are those of the coefficients in this program. `--kind null|background|single|other|pair|outside` and `--plant force|planar|motion|mass|wrist|six` narrow it down,
//! `--verbose` prints every case that is not answered as asked.
//!
//! Beside the challenge: `--mutation` (or `--mutation EFFECT`) switches effects off in the generator and takes them from the registry,
//! `--gain` holds the intervals of the gain against fresh recordings, `--growth` times a diagnosis.

mod gain;
mod growth;
mod mutation;
mod row;
mod tables;
mod train;

use ndof_challenge::draw::{draw, kind_of};
use ndof_challenge::strength::{Strength, strength};
use ndof_challenge::{Plant, make};
use ndof_diagnose::{Options, diagnose};
use row::Row;
use std::io::Write;
use std::time::Instant;

fn argument(name: &str) -> Option<String> {
    let all: Vec<String> = std::env::args().collect();
    all.iter().position(|a| a == name).and_then(|k| all.get(k + 1).cloned())
}

fn stored() -> Result<Vec<Row>, Box<dyn std::error::Error>> {
    let mut rows = Vec::new();
    for file in std::env::args().skip_while(|a| a != "--from").skip(1).take_while(|a| !a.starts_with("--")) {
        for line in std::fs::read_to_string(&file)?.lines() {
            rows.push(serde_json::from_str::<Row>(line)?.weighed());
        }
    }
    Ok(rows)
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let number = |name: &str, default: u64| argument(name).and_then(|v| v.parse().ok()).unwrap_or(default);
    let (first, cases, seed) = (number("--first", 0), number("--cases", 50), number("--seed", 1));
    let plant = argument("--plant").and_then(|p| Plant::ALL.into_iter().find(|q| q.word() == p));
    let asked = |name: &str| std::env::args().any(|a| a == name);
    let verbose = asked("--verbose");
    if asked("--mutation") {
        mutation::print(argument("--mutation").as_deref());
        return Ok(());
    }
    if asked("--gain") {
        gain::print(seed, cases);
        return Ok(());
    }
    if asked("--growth") {
        growth::print();
        return Ok(());
    }
    let mut rows = stored()?;
    let mut file = argument("--rows").map(|f| std::fs::OpenOptions::new().create(true).append(true).open(f)).transpose()?;
    for k in if rows.is_empty() { first..first + cases } else { 0..0 } {
        let kind = argument("--kind").unwrap_or_else(|| kind_of(k).to_owned());
        let case = draw(seed, k, &kind, plant);
        let made = make(&case);
        let size = if case.hidden.is_empty() && !case.background { Strength::default() } else { strength(&case, &made) };
        let clock = Instant::now();
        let found = diagnose(&made.recordings, &made.ports, &Options::default(), None, &mut |_| {});
        let row = Row::new(seed, k, &kind, &case, &made, size, clock.elapsed().as_secs_f64());
        let row = match &found {
            Ok(found) => row.told(&made, found),
            Err(error) => Row { error: Some(error.to_string()), ..row },
        };
        if let Some(file) = &mut file {
            writeln!(file, "{}", serde_json::to_string(&row)?)?;
        }
        if verbose && (!row.right() || row.error.is_some()) {
            if let Ok(d) = &found {
                d.causes.iter().for_each(|c| {
                    println!("    {} {:?} {:.4?} -> {:.4?} {:?}", c.effect, c.gain.explained_fraction, c.gain.nrmse_before, c.gain.nrmse_after, c.evidence)
                });
            }
            println!(
                "{k} {kind} {} x{} {:?} share {:.3} size {:.4} axis {} -> {:?} {:?} minor {:?} {}",
                row.plant,
                row.trials,
                row.hidden,
                row.share,
                row.size,
                row.axis,
                row.verdict,
                row.named.iter().map(|n| format!("{}[{}] {:.2} {:?}", n.effect, n.axis, n.probability, n.confusable)).collect::<Vec<_>>(),
                found.as_ref().map(|d| d.minor.iter().map(|m| format!("{} {:.4} {}", m.effect, m.removed, m.why)).collect::<Vec<_>>()).unwrap_or_default(),
                found.as_ref().map(|d| d.discrepancy.notes.join("; ")).unwrap_or_default(),
            );
        }
        rows.push(row);
    }
    if asked("--train") {
        train::print(&rows);
        return Ok(());
    }
    print!("{}", tables::text(&rows));
    if let Some(folder) = argument("--out") {
        tables::store(&rows, std::path::Path::new(&folder))?;
    }
    Ok(())
}
