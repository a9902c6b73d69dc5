//! Looks for recordings whose cause cannot be told from another, and asks for the experiment that would.
#[path = "../tests/generator/mod.rs"]
mod generator;

use generator::{Case, Hidden, Plant, make};
use ndof_diagnose::{Options, diagnose};

fn main() {
    for (name, severities) in [
        ("measurement-delay", [0.1, 0.14, 0.2, 0.3]),
        ("channel-filter", [0.1, 0.14, 0.2, 0.3]),
        ("hysteresis", [0.03, 0.05, 0.08, 0.12]),
        ("coulomb-friction", [0.03, 0.05, 0.08, 0.12]),
        ("viscoelastic", [0.05, 0.08, 0.12, 0.2]),
        ("cubic-stiffness", [0.02, 0.04, 0.06, 0.1]),
    ] {
        for plant in [Plant::Force, Plant::Planar] {
            for severity in severities {
                for seed in [1, 2] {
                    let made = make(&Case {
                        plant,
                        hidden: vec![Hidden { name, severity }],
                        other: false,
                        background: false,
                        trials: 1,
                        duration_s: 30.0,
                        seed,
                        command: (1.0, 1.0),
                    });
                    let Ok(d) = diagnose(&made.recordings, &made.ports, &Options { plan: true, ..Options::default() }, None, &mut |_| {}) else { continue };
                    if !d.confusable.is_empty() {
                        println!(
                            "{name} {severity} {} seed {seed}: {:?}",
                            plant.word(),
                            d.causes.iter().map(|c| (&c.effect, c.probability)).collect::<Vec<_>>()
                        );
                        for c in &d.confusable {
                            println!("   {:?}: {}", c.effects, c.next_experiment);
                            c.predicted.iter().for_each(|p| println!("      {:8.1} {} {}", p.separation, p.decides, p.experiment));
                        }
                    }
                }
            }
        }
    }
}
