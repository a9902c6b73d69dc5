//! Diagnoses the measured records of others, where they are at hand (`--data DIR`).
#[path = "../tests/hidden/records/mod.rs"]
mod records;

use ndof_diagnose::{Options, diagnose};

fn main() {
    let only = std::env::args().nth(1);
    for (name, read) in records::ALL {
        if only.as_ref().is_some_and(|o| o != name) {
            continue;
        }
        let Some((trials, ports)) = read() else {
            println!("{name}: not at hand");
            continue;
        };
        let clock = std::time::Instant::now();
        match diagnose(
            &trials,
            &ports,
            &Options { most_causes: std::env::args().nth(2).and_then(|v| v.parse().ok()).unwrap_or(4), ..Options::default() },
            None,
            &mut |_| {},
        ) {
            Err(error) => println!("{name}: {error}"),
            Ok(d) => {
                println!(
                    "{name}: {:?} baseline {:.4?} extended {:.4?} floor {:.4?} {:?} {:.2} s",
                    d.verdict,
                    d.baseline.held_out.vaf_percent,
                    d.extended.held_out.vaf_percent,
                    d.noise_floor.nrmse,
                    d.split,
                    clock.elapsed().as_secs_f64()
                );
                println!(
                    "  shares lin {:.3} nonlin {:.3} tv {:.3} noise {:.3} {:?}",
                    d.discrepancy.linear_share, d.discrepancy.nonlinear_share, d.discrepancy.time_varying_share, d.discrepancy.noise_share, d.discrepancy.notes
                );
                for c in &d.causes {
                    println!(
                        "  {} {:?} p {:.3} bic {:.0} vaf {:.2?} -> {:.2?} {:?}",
                        c.effect,
                        c.site,
                        c.probability,
                        c.gain.delta_bic,
                        c.gain.vaf_before,
                        c.gain.vaf_after,
                        c.parameters.iter().map(|p| format!("{}={:?} {:.3?}", p.name, p.value, p.ci95)).collect::<Vec<_>>()
                    );
                    println!("    {:?}", c.evidence);
                }
                println!("  band to {:.3} Hz", d.discrepancy.by_band.last().map_or(0.0, |b| b.band_hz[1]));
                println!("  minor {:?} confusable {:?}", d.minor, d.confusable);
                println!("  base {:?}", d.baseline.parameters.iter().map(|p| format!("{} {:.4}", p.name, p.value)).collect::<Vec<_>>());
                println!("  ext  {:?}", d.extended.parameters.iter().map(|p| format!("{} {:.4}", p.name, p.value)).collect::<Vec<_>>());
                println!(
                    "  considered {:?}",
                    d.considered.iter().take(4).map(|c| format!("{} {:.3} {}", c.effect, c.explained_fraction, c.why_not)).collect::<Vec<_>>()
                );
            }
        }
    }
}
