//! The kernels whose instructions are counted: each is run once within [`measured`], on one thread.
//!
//! `bash benches/instructions` counts them with callgrind and compares with `benches/instructions.txt`.

#[path = "../crates/diagnose/tests/generator/mod.rs"]
mod generator;
#[path = "../crates/models/examples/support/planar.rs"]
mod planar;
mod support;

use generator::{Case, Hidden, Plant, make};
use ndof::devices::Accuracy;
use ndof::diagnose::{Options, diagnose};
use ndof::signal::{Multitaper, Welch};
use ndof::sysid::{Direct, SpectralMethod, derived, direct};
use std::hint::black_box;
use support::{arm, channels, perturbation, ports, simulate};

/// What callgrind looks at; the name is in `benches/instructions`.
#[inline(never)]
fn measured(work: &mut dyn FnMut()) {
    work();
    black_box(());
}

fn kernels() {
    let samples = channels(18, 25_000);
    let all: Vec<&[f64]> = samples.iter().map(Vec::as_slice).collect();
    let mut say = |name: &str, work: &mut dyn FnMut()| {
        println!("{name}");
        measured(work);
    };
    for (name, welch) in [("welch, 4 channels, 45 segments", Welch::smooth()), ("welch, 4 channels, 5 segments", Welch::fine())] {
        say(name, &mut || drop(black_box(welch.spectra(500.0, black_box(&all[..4])))));
    }
    let welch = Welch::new(2048);
    say("welch, 12 channels, 23 segments", &mut || drop(black_box(welch.spectra(500.0, black_box(&all[..12])))));
    say("multitaper, 4 channels", &mut || drop(black_box(Multitaper::default().spectra(500.0, black_box(&all[..4])))));
    for axes in [2, 6] {
        let (open, labels) = ports(axes, false);
        let (held, held_labels) = ports(axes, true);
        let spectra = welch.spectra(500.0, &all[..3 * axes]).expect("long enough");
        say(&format!("direct, {axes} x {axes}"), &mut || drop(black_box(direct(black_box(&spectra), &open, &labels, Direct::H1))));
        say(&format!("derived, {axes} x {axes}"), &mut || drop(black_box(derived(black_box(&spectra), &held, &held_labels))));
    }
    let (open, labels) = ports(2, false);
    let channel = |c: usize| ndof::signal::Channel::new(format!("c{c}"), ndof::signal::Unit::default(), samples[c][..4096].to_vec());
    let trial = ndof::signal::Recording::new(500.0, (0..4).map(channel).collect()).expect("one length");
    let local = SpectralMethod::LocalPolynomial(ndof::sysid::LocalPolynomial::default());
    say("local polynomial, 2 x 2", &mut || drop(black_box(ndof::sysid::estimate(&[&trial], &open, &labels, &local, Direct::H1))));

    let experiment = arm(2.0);
    let command = perturbation(&experiment);
    say("simulation, planar arm, 2 s", &mut || drop(black_box(simulate(&experiment, black_box(&command), Accuracy::Relative(1e-6)))));
    let trials: Vec<[Vec<f64>; 4]> = planar::trials().into_iter().map(|trial| trial.map(|samples| samples[..1500].to_vec())).collect();
    say("free-run fit, planar, 3 x 3 s", &mut || drop(black_box(planar::fit(black_box(&trials)))));
    let hidden = vec![Hidden { name: "coulomb-friction", severity: 1.0 }];
    let made = make(&Case { plant: Plant::Force, hidden, other: false, background: true, trials: 1, duration_s: 12.0, seed: 11 });
    say("diagnosis, one axis, 12 s", &mut || drop(black_box(diagnose(&made.recordings, &made.ports, &Options::default(), None, &mut |_| {}))));
}

fn main() {
    let one_thread = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a pool of one thread");
    one_thread.install(kernels);
}
