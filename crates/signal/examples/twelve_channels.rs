//! Seconds for the cross-spectra of 12 channels over an hour at 500 Hz, the best of several runs; what the Python package
//! is measured against: `cargo run --release -p ndof-signal --example twelve_channels`.

use ndof_signal::{Welch, WelchError};
use std::time::Instant;

fn main() -> Result<(), WelchError> {
    const RUNS: usize = 7;
    let samples = 500 * 3600;
    let channels: Vec<Vec<f64>> = (0..12).map(|c| (0..samples).map(|k| (f64::from(k) * 0.01 * f64::from(c + 1)).sin()).collect()).collect();
    let slices: Vec<&[f64]> = channels.iter().map(Vec::as_slice).collect();
    let welch = Welch::new(4096);
    let mut best = f64::INFINITY;
    let mut power = 0.0;
    for _ in 0..RUNS {
        let started = Instant::now();
        let spectra = welch.spectra(500.0, &slices)?;
        best = best.min(started.elapsed().as_secs_f64());
        power = spectra.power(100, 11);
    }
    println!("{best} {power}");
    Ok(())
}
