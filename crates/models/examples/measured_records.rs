//! What the models find in measured records of others.
//!
//! `cargo run --release -p ndof-models --example measured_records`; records that are not at hand are left out with a line.

#[path = "support/records.rs"]
mod records;

use ndof_models::time::FreeRun;
use records::Row;

fn parameters(fit: &FreeRun) {
    for p in &fit.parameters {
        println!("    {:<28}{:>12.5} ± {:<10.2e} {}{}", p.name, p.value, p.std_error, p.unit, if p.identifiable { "" } else { "  not identifiable" });
    }
}

fn table(rows: &[Row]) {
    println!("  {:<38}{:>12}{:>12}{:>14}", "model", "fitted VAF", "held out", "held-out NRMSE");
    for r in rows {
        println!("  {:<38}{:>10.2} %{:>10.2} %{:>14.4}", r.name, r.fit.score.vaf_percent[0], r.held_out.vaf_percent[0], r.held_out.nrmse[0]);
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    println!("EMPS, a carriage on a screw; published 95.11 kg, 203.5 N s/m, offset −3.16 N, dry friction 20.39 N");
    match records::emps() {
        None => println!("  not at hand"),
        Some(found) => {
            let (published, rows) = found?;
            for (p, value) in published.parameters.iter().zip([95.11, 203.5, -3.16, 20.39]) {
                println!("    {:<12}{:>10.3} ± {:<8.3} {:<8} {:+.2} % of the published", p.name, p.value, p.std_error, p.unit, 100.0 * (p.value / value - 1.0));
            }
            table(&rows);
        }
    }
    println!("\nAnkle z_pf, angle in and torque out");
    match records::ankle() {
        None => println!("  not at hand"),
        Some(rows) => {
            let rows = rows?;
            table(&rows);
            if let Some(best) = rows.iter().max_by(|a, b| a.held_out.vaf_percent[0].total_cmp(&b.held_out.vaf_percent[0])) {
                println!("  best: {}", best.name);
                parameters(&best.fit);
            }
        }
    }
    println!("\nMagneto-rheological damper, velocity in and force out");
    match records::damper() {
        None => println!("  not at hand"),
        Some(found) => {
            let (curve, rows) = found?;
            println!("  best static curve of velocity, of any shape: held-out VAF {curve:.2} %");
            table(&rows);
            if let Some(last) = rows.last() {
                parameters(&last.fit);
            }
        }
    }
    Ok(())
}
