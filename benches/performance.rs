//! Seconds of everything that the book's page on performance tells, one line `name seconds` each.
//!
//! `benches/peers/run` builds and calls it beside the peers and prints the tables. By hand:
//! `cargo bench --bench performance -- [spectra|hour|simulation|fit|diagnosis|growth|program FOLDER|six FOLDER]`.

#[path = "../crates/models/examples/support/planar.rs"]
mod planar;
mod support;

use ndof::devices::Accuracy;
use ndof::diagnose::{Options, diagnose};
use ndof::signal::{Channel, Quantity, Recording, Unit, Welch};
use ndof::sysid::{Direct, derived, direct, ordered_coherence};
use ndof_challenge::{Case, Hidden, Plant, make};
use std::hint::black_box;
use std::path::Path;
use support::{arm, bare_transforms, channels, perturbation, ports, race, simulate, wall};

fn tell(name: &str, seconds: f64) {
    println!("{name} {seconds:.9}");
}

fn slices(channels: &[Vec<f64>]) -> Vec<&[f64]> {
    channels.iter().map(Vec::as_slice).collect()
}

/// 25 000 samples of four channels in the paper's two settings.
fn spectra() {
    let samples = channels(6, 25_000);
    let all = slices(&samples);
    let (open, labels) = ports(2, false);
    let (held, held_labels) = ports(2, true);
    for (setting, welch) in [("45", Welch::smooth()), ("5", Welch::fine())] {
        let four = &all[..4];
        let whole = || direct(&welch.spectra(500.0, black_box(four)).expect("long enough"), &open, &labels, Direct::H1).expect("an estimate");
        let six = || derived(&welch.spectra(500.0, black_box(&all)).expect("long enough"), &held, &held_labels).expect("an estimate");
        let found = race(
            200,
            &mut [
                &mut || bare_transforms(&welch, black_box(four)),
                &mut || drop(black_box(welch.spectra(500.0, black_box(four)))),
                &mut || drop(black_box(whole())),
                &mut || bare_transforms(&welch, black_box(&all)),
                &mut || drop(black_box(six())),
            ],
        );
        for (what, seconds) in ["bare", "spectra", "response", "bare_six", "derived"].iter().zip(found) {
            tell(&format!("spectra.{setting}.{what}"), seconds);
        }
    }
}

/// An hour at 1 kHz: twelve channels (six forces, six motions), and six commands besides.
fn hour() {
    let welch = Welch::new(4096);
    let samples = channels(18, 3_600_000);
    let all = slices(&samples);
    let twelve = &all[..12];
    let (open, labels) = ports(6, false);
    let plain = |channels: &[&[f64]]| direct(&welch.spectra(1000.0, channels).expect("long"), &open, &labels, Direct::H1).expect("an estimate");
    let (held, held_labels) = ports(6, true);
    let everything = || {
        let spectra = welch.spectra(1000.0, black_box(&all)).expect("long");
        let direct = direct(&spectra, &held, &held_labels, Direct::H1).expect("an estimate");
        let derived = derived(&spectra, &held, &held_labels).expect("an estimate");
        let inverse = &direct.response.uncertainty.as_ref().expect("estimated").input_inverse;
        black_box(ordered_coherence(&direct.response, inverse, &direct.coherence.multiple));
        for response in [&direct.response, &derived.response] {
            (0..36).for_each(|e| drop(black_box(response.gain_phase(e / 6, e % 6, 0.95))));
        }
    };
    let eighteen = || black_box(direct(&welch.spectra(1000.0, black_box(&all)).expect("long"), &held, &held_labels, Direct::H1).expect("an estimate"));
    let found = race(3, &mut [&mut || bare_transforms(&welch, twelve), &mut || drop(black_box(plain(twelve))), &mut || drop(eighteen()), &mut || everything()]);
    for (what, seconds) in ["bare", "plain", "plain_eighteen", "everything"].iter().zip(found) {
        tell(&format!("hour.{what}"), seconds);
    }
}

/// The same with threads: called with RAYON_NUM_THREADS=1 and 2.
fn threads() {
    let welch = Welch::new(4096);
    let samples = channels(12, 3_600_000);
    let twelve = slices(&samples);
    tell("threads", wall(5, &mut || drop(black_box(welch.spectra(1000.0, black_box(&twelve))))));
}

/// Fifty seconds of the arm, and what the stated accuracy is worth against 128 steps a sample.
fn simulation() {
    let experiment = arm(50.0);
    let command = perturbation(&experiment);
    let stated = simulate(&experiment, &command, Accuracy::Relative(1e-6));
    let fine = simulate(&experiment, &command, Accuracy::Fixed(7));
    let error = |k: usize| {
        let (a, b) = (&stated.channels()[k].samples, &fine.channels()[k].samples);
        let mean = b.iter().sum::<f64>() / b.len() as f64;
        (a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>() / b.iter().map(|b| (b - mean).powi(2)).sum::<f64>()).sqrt()
    };
    tell("simulation.error", (2..6).map(error).fold(0.0, f64::max));
    let run = |accuracy| drop(black_box(simulate(&experiment, black_box(&command), accuracy)));
    let found = race(15, &mut [&mut || run(Accuracy::Relative(1e-6)), &mut || run(Accuracy::Fixed(1))]);
    tell("simulation.50s", found[0]);
    tell("simulation.50s_two_steps", found[1]);
}

/// Three trials of 50 s, thirteen parameters, free-run.
fn fit() {
    let trials = planar::trials();
    let found = race(5, &mut [&mut || drop(black_box(planar::fit(black_box(&trials))))]);
    tell("fit.planar", found[0]);
}

fn case(plant: Plant, trials: usize, duration_s: f64, hidden: &[&'static str]) -> Case {
    let hidden = hidden.iter().map(|name| Hidden { name, severity: 1.0 }).collect();
    Case { plant, hidden, other: false, background: true, trials, duration_s, seed: 11, command: (1.0, 1.0) }
}

fn diagnosed(case: &Case, runs: usize) -> f64 {
    let made = make(case);
    race(runs, &mut [&mut || drop(black_box(diagnose(&made.recordings, &made.ports, &Options::default(), None, &mut |_| {})))])[0]
}

fn diagnosis() {
    let one: &[&str] = &["coulomb-friction"];
    tell("diagnosis.planar", diagnosed(&case(Plant::Planar, 3, 50.0, one), 3));
    tell("diagnosis.one_axis", diagnosed(&case(Plant::Force, 1, 50.0, one), 3));
}

/// How cost grows: spectra with length and channels, diagnosis with length, axes and effects.
fn growth() {
    let (welch, samples) = (Welch::new(4096), channels(12, 800_000));
    let spectra = |channels: usize, samples_used: usize| {
        let cut: Vec<&[f64]> = samples[..channels].iter().map(|c| &c[..samples_used]).collect();
        race(5, &mut [&mut || drop(black_box(welch.spectra(1000.0, black_box(&cut))))])[0]
    };
    for length in [100_000, 200_000, 400_000, 800_000] {
        tell(&format!("growth.length.{length}"), spectra(4, length));
    }
    for count in [2, 4, 6, 8, 12] {
        tell(&format!("growth.channels.{count}"), spectra(count, 200_000));
    }
    for seconds in [12.5, 25.0, 50.0] {
        tell(&format!("growth.diagnosis_length.{seconds}"), diagnosed(&case(Plant::Planar, 3, seconds, &["coulomb-friction"]), 1));
    }
    for (axes, plant) in [(1, Plant::Force), (2, Plant::Planar), (3, Plant::Wrist), (6, Plant::Six)] {
        tell(&format!("growth.diagnosis_axes.{axes}"), diagnosed(&case(plant, 3, 25.0, &["coulomb-friction"]), 1));
    }
    for hidden in [&[][..], &["coulomb-friction"], &["coulomb-friction", "reflex-delay"]] {
        tell(&format!("growth.diagnosis_effects.{}", hidden.len()), diagnosed(&case(Plant::Planar, 3, 25.0, hidden), 1));
    }
}

/// Writes 50 s of two forces and two motions at 500 Hz, `trial.csv`, and an hour of three and three at 1 kHz as `hour.parquet` and `hour.csv`.
fn program(folder: &Path) {
    let write = |file: &str, axes: usize, rate_hz: f64, samples: usize| {
        let name = |c: usize| format!("{}_{}", if c < axes { "torque" } else { "angle" }, c % axes);
        let unit = |c: usize| Unit::si(if c < axes { Quantity::Effort } else { Quantity::Displacement }, true);
        let channels = channels(2 * axes, samples).into_iter().enumerate().map(|(c, samples)| Channel::new(name(c), unit(c), samples)).collect();
        let recording = Recording::new(rate_hz, channels).expect("one length");
        ndof::io::write(&folder.join(file), &recording).expect("written (build with --features parquet)");
    };
    write("trial.csv", 2, 500.0, 25_000);
    ["hour.csv", "hour.parquet"].iter().for_each(|file| write(file, 3, 1000.0, 3_600_000));
}

/// Writes three trials of six joints held by an exoskeleton, `six-1.csv` and so on.
fn six(folder: &Path) {
    for (k, trial) in make(&case(Plant::Six, 3, 50.0, &[])).recordings.iter().enumerate() {
        ndof::io::write(&folder.join(format!("six-{}.csv", k + 1)), trial).expect("written");
    }
}

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).filter(|a| a != "--bench").collect();
    let one_thread = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a pool of one thread");
    let wanted = |name: &str| arguments.is_empty() || arguments.iter().any(|a| a == name);
    if let [what, folder] = arguments.as_slice() {
        return if what == "six" { six(Path::new(folder)) } else { program(Path::new(folder)) };
    }
    if arguments == ["threads"] {
        return threads();
    }
    let parts: [(&str, fn()); 6] =
        [("spectra", spectra), ("hour", hour), ("simulation", simulation), ("fit", fit), ("diagnosis", diagnosis), ("growth", growth)];
    for (name, part) in parts {
        if wanted(name) {
            one_thread.install(part);
        }
    }
}
