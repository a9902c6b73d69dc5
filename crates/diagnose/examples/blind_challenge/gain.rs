//! Whether the interval that is given for the gain holds on data that nobody has seen.

use ndof_challenge::draw::draw;
use ndof_challenge::make;
use ndof_diagnose::{Diagnosis, HeldOut, Options, diagnose};

/// Trials that are fitted, and those on which the gain is then known well.
const FITTED: usize = 2;
const FRESH: usize = 9;

/// The share that the first cause explains, and its interval.
fn gain(d: &Diagnosis) -> Option<(&str, f64, [f64; 2])> {
    let first = d.causes.first()?;
    Some((first.effect.as_str(), first.gain.explained_fraction?, first.gain.explained_fraction_ci95?))
}

/// Diagnoses single effects with one held-out trial, and again with nine fresh ones: how often the second gain lies inside the first's interval.
pub fn print(seed: u64, cases: u64) {
    let (mut inside, mut all, mut widths, mut worst) = (0, 0, 0.0, 0.0_f64);
    for number in 0..cases {
        let case = ndof_challenge::Case { trials: FITTED + 1 + FRESH, ..draw(seed, number, "single", None) };
        let made = make(&case);
        let ask = |trials: &[ndof_signal::Recording], held: Vec<usize>| {
            diagnose(trials, &made.ports, &Options { held_out: HeldOut::Trials(held), ..Options::default() }, None, &mut |_| {}).ok()
        };
        let once = ask(&made.recordings[..=FITTED], vec![FITTED]);
        let mut fresh = made.recordings.clone();
        fresh.remove(FITTED);
        let again = ask(&fresh, (FITTED..FITTED + FRESH).collect());
        let (Some(once), Some(again)) = (once, again) else { continue };
        let (Some((name, said, interval)), Some((same, truth, _))) = (gain(&once), gain(&again)) else { continue };
        if name != same {
            continue;
        }
        all += 1;
        let hit = (interval[0]..=interval[1]).contains(&truth);
        inside += usize::from(hit);
        widths += interval[1] - interval[0];
        worst = worst.max((said - truth).abs());
        println!(
            "{name:22} {:7} said {said:.3} ({:.3} to {:.3}) on fresh trials {truth:.3} {}",
            case.plant.word(),
            interval[0],
            interval[1],
            if hit { "" } else { "outside" }
        );
    }
    println!("of {all} gains {inside} inside their 95 % interval of mean width {:.3}; largest difference {worst:.3}", widths / f64::from(all.max(1)));
}
