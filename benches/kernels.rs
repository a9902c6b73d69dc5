//! The kernels whose instructions are counted: the one that is named runs once within [`measured`], on one thread; without a name all
//! are listed.
//!
//! `bash benches/instructions` counts them with callgrind and compares with `benches/instructions.txt`.

#[path = "../crates/models/examples/support/planar.rs"]
mod planar;
mod support;

use ndof::devices::Accuracy;
use ndof::diagnose::{Options, diagnose};
use ndof::signal::{Channel, Multitaper, Quantity, Recording, Unit, Welch};
use ndof::sysid::{Direct, LocalPolynomial, SpectralMethod, derived, direct, estimate};
use ndof_challenge::{Case, Hidden, Plant, make};
use std::hint::black_box;
use support::{arm, channels, perturbation, ports, simulate};

/// What callgrind looks at; the name is in `benches/instructions`.
#[inline(never)]
fn measured(work: &mut dyn FnMut()) {
    work();
    black_box(());
}

/// Runs the kernel of that name, or lists all.
fn kernels(wanted: Option<&str>) {
    let say = |name: &str, kernel: &dyn Fn()| match wanted {
        None => println!("{name}"),
        Some(wanted) if wanted == name => kernel(),
        Some(_) => {}
    };
    let with = |count: usize, work: &dyn Fn(&[&[f64]])| {
        let samples = channels(count, 25_000);
        work(&samples.iter().map(Vec::as_slice).collect::<Vec<_>>());
    };
    // The second time: what the first prepares and keeps would hide the sums.
    let welch = |welch: &Welch, count: usize| {
        with(count, &|all| {
            let mut spectra = || drop(black_box(welch.spectra(500.0, black_box(all))));
            spectra();
            measured(&mut spectra);
        });
    };
    say("welch, 4 channels, 45 segments", &|| welch(&Welch::smooth(), 4));
    say("welch, 4 channels, 5 segments", &|| welch(&Welch::fine(), 4));
    say("welch, 12 channels, 23 segments", &|| welch(&Welch::new(2048), 12));
    say("multitaper, 4 channels", &|| with(4, &|all| measured(&mut || drop(black_box(Multitaper::default().spectra(500.0, black_box(all)))))));
    for axes in [2, 6] {
        let spectra = || Welch::new(1024).spectra(500.0, &channels(3 * axes, 12_000).iter().map(Vec::as_slice).collect::<Vec<_>>()).expect("long enough");
        say(&format!("direct, {axes} x {axes}"), &|| {
            let (spectra, (ports, labels)) = (spectra(), ports(axes, false));
            measured(&mut || drop(black_box(direct(black_box(&spectra), &ports, &labels, Direct::H1))));
        });
        say(&format!("derived, {axes} x {axes}"), &|| {
            let (spectra, (ports, labels)) = (spectra(), ports(axes, true));
            measured(&mut || drop(black_box(derived(black_box(&spectra), &ports, &labels))));
        });
    }
    say("local polynomial, 2 x 2", &|| {
        let unit = || Unit::si(Quantity::Displacement, false);
        let columns = channels(4, 2048).into_iter().enumerate().map(|(c, samples)| Channel::new(format!("c{c}"), unit(), samples)).collect();
        let (trial, (ports, labels)) = (Recording::new(500.0, columns).expect("one length"), ports(2, false));
        let local = SpectralMethod::LocalPolynomial(LocalPolynomial::default());
        measured(&mut || drop(black_box(estimate(&[black_box(&trial)], &ports, &labels, &local, Direct::H1))));
    });
    say("simulation, planar arm, 2 s", &|| {
        let experiment = arm(2.0);
        let command = perturbation(&experiment);
        measured(&mut || drop(black_box(simulate(&experiment, black_box(&command), Accuracy::Relative(1e-6)))));
    });
    say("free-run fit, planar, 3 x 3 s", &|| {
        let trials: Vec<[Vec<f64>; 4]> = planar::trials().into_iter().map(|trial| trial.map(|samples| samples[..1500].to_vec())).collect();
        measured(&mut || drop(black_box(planar::fit(black_box(&trials)))));
    });
    say("diagnosis, one axis, 12 s", &|| {
        let hidden = vec![Hidden { name: "coulomb-friction", severity: 1.0 }];
        let made = make(&Case { plant: Plant::Force, hidden, other: false, background: true, trials: 1, duration_s: 12.0, seed: 11, command: (1.0, 1.0) });
        measured(&mut || drop(black_box(diagnose(&made.recordings, &made.ports, &Options::default(), None, &mut |_| {}))));
    });
}

fn main() {
    let wanted = std::env::args().skip(1).find(|a| a != "--bench");
    let one_thread = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a pool of one thread");
    one_thread.install(|| kernels(wanted.as_deref()));
}
