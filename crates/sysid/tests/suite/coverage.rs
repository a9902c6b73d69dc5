//! The quick part of `cargo run --release -p ndof-sysid --example coverage`.

#[path = "../../examples/coverage/cases.rs"]
mod cases;

use cases::{Case, Estimator, Loop, Outcome};

/// Binomial: 4.5 standard deviations of 300 trials, since some seventy shares are looked at.
const FURTHEST: f64 = 4.5 * 1.258;

#[test]
fn intervals_hold_the_truth_at_their_nominal_rate() {
    for (row, case) in cases::all().iter().enumerate() {
        let Case { size, name, estimator, held, coherence, .. } = case;
        let quick = match estimator {
            Estimator::H1 | Estimator::Derived => *size == 2 && *name != "local rational" && (*coherence == 0.5 || (*name == "welch" && *coherence == 0.99)),
            Estimator::H2 => *coherence == 0.5,
        };
        if !quick {
            continue;
        }
        let Outcome { gain, phase, bias, freedom, direct } = case.run(row as u64, 300);
        let what = format!("{size}x{size} {name} at {coherence}, ν = {freedom:.1}: gain {gain:.1} %, phase {phase:.1} %, bias {bias:.1} %");
        println!("{what}");
        assert!((gain - 95.0).abs() < FURTHEST && (phase - 95.0).abs() < FURTHEST, "{what}");
        if let Some(direct) = direct {
            assert!(*held == Loop::Held && (direct.limit - 95.0).abs() < FURTHEST, "{what}; the direct one holds its limit {:.1} %", direct.limit);
            if *coherence == 0.5 {
                assert!(freedom < 15.0 || direct.limb < 80.0, "{what}; the direct one holds the limb {:.1} %", direct.limb);
                assert!(direct.bias > 3.0 * bias, "{what}; the direct one is {:.1} % off", direct.bias);
            }
        }
    }
}
