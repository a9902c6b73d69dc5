//! How often 95 % intervals hold the truth: every method and estimator, open loop and held by a robot.
//!
//! `cargo run --release -p ndof-sysid --example coverage [TRIALS [METHOD [SIZE]]]` prints one row for each case (default 1000
//! trials, all methods, all sizes): the share of simulated experiments in which the intervals of gain and of phase hold the true response, at a known true
//! coherence; for the held limb also what the direct estimate does.

mod cases;

use cases::{Case, Estimator, Loop, Outcome};

/// Šidák: about 180 shares of 1000 trials lie within these bounds together in 19 of 20 runs, if each is 95 %.
const BOUNDS: std::ops::RangeInclusive<f64> = 92.5..=97.5;

fn main() {
    let count: u64 = std::env::args().nth(1).and_then(|a| a.parse().ok()).unwrap_or(1000);
    let wanted = std::env::args().nth(2).unwrap_or_default();
    println!("{count} trials a case; % of 95 % intervals that hold the truth; bias of the mean in % of the gain");
    println!(
        "{:<6}{:<18}{:<9}{:<6}{:>6}{:>5} |{:>6}{:>6}{:>7} | direct, held: own limit, limb, bias",
        "size", "method", "estimate", "loop", "γ²", "ν", "gain", "phase", "bias"
    );
    let axes: Option<usize> = std::env::args().nth(3).and_then(|a| a.parse().ok());
    let asked_for = |case: &Case| case.name.contains(&wanted) && axes.is_none_or(|axes| axes == case.size);
    let (mut cells, mut outside) = (0, Vec::new());
    for (row, case) in cases::all().iter().enumerate().filter(|(_, case)| asked_for(case)) {
        let Outcome { gain, phase, bias, freedom, direct } = case.run(row as u64, count);
        let Case { size, name, estimator, held, coherence, .. } = case;
        let estimator = match estimator {
            Estimator::H1 => "H1",
            Estimator::H2 => "H2",
            Estimator::Derived => "derived",
        };
        let way = if *held == Loop::Held { "held" } else { "open" };
        print!("{:<6}{name:<18}{estimator:<9}{way:<6}{coherence:>6}{freedom:>5.1} |{gain:>6.1}{phase:>6.1}{bias:>7.1} |", format!("{size}x{size}"));
        match direct {
            Some(d) => println!("{:>6.1}{:>6.1}{:>7.1}", d.limit, d.limb, d.bias),
            None => println!(),
        }
        // Its own test of the denominator, made on the same data, costs it some of its level.
        if *name == "local rational" {
            continue;
        }
        for share in [gain, phase] {
            cells += 1;
            if !BOUNDS.contains(&share) {
                outside.push(format!("{size}x{size} {name} {estimator} {way} {coherence}: {share:.1}"));
            }
        }
    }
    println!("without the local rational method: {cells} shares, {} outside of {:.1} to {:.1} %", outside.len(), BOUNDS.start(), BOUNDS.end());
    outside.iter().for_each(|line| println!("  {line}"));
}
