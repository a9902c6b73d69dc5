//! Fits three 50 s trials of a planar limb, thirteen parameters, free-run, and says how long that took.
//!
//! `cargo run --release -p ndof-models --example free_run_speed [FILE.csv]` writes the trials to the file as well, for
//! `benches/peers/fit_scipy.py`, which fits the same with SciPy.

#[path = "support/planar.rs"]
mod planar;

use std::io::Write;
use std::time::Instant;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let trials = planar::trials();
    if let Some(path) = std::env::args().nth(1) {
        let mut file = std::io::BufWriter::new(std::fs::File::create(path)?);
        writeln!(file, "trial,force_x,force_y,pos_x,pos_y")?;
        for (number, [fx, fy, x, y]) in trials.iter().enumerate() {
            for k in 0..fx.len() {
                // Shortest text that reads back as the same number.
                writeln!(file, "{number},{},{},{},{}", fx[k], fy[k], x[k], y[k])?;
            }
        }
    }
    let mut best = f64::INFINITY;
    let mut found = None;
    for _ in 0..5 {
        let begun = Instant::now();
        found = Some(planar::fit(&trials));
        best = best.min(begun.elapsed().as_secs_f64());
    }
    let fit = found.ok_or("no fit")?;
    println!("{{\"seconds\": {best:.4}, \"nrmse\": {:?}, \"theta\": {:?}}}", fit.score.nrmse, fit.theta);
    Ok(())
}
