//! Recordings of a linear limb: what a diagnosis says where nothing is missing.

use crate::support::{csv, json, noise, oscillator};

/// Each force stays until the next, and has power up to Nyquist's frequency, where nothing of the limb follows it between the samples.
#[test]
fn power_at_high_frequencies_is_no_stiffness_that_varies() {
    let folder = tempfile::tempdir().expect("a folder");
    let files = ["one.csv", "two.csv", "three.csv"];
    for (seed, name) in (1..).zip(files) {
        let force: Vec<f64> = noise(seed, 20_000).iter().map(|f| 30.0 * f).collect();
        let motion: Vec<f64> = oscillator(&force).iter().zip(noise(10 + seed, force.len())).map(|(x, e)| x + 5e-6 * e).collect();
        csv(&folder.path().join(name), "# sample_rate_hz: 500\n", &[("force_x [N]", &force), ("pos_x [m]", &motion)]);
    }
    let d = json(folder.path(), &[&["diagnose"][..], &files].concat());
    assert_eq!((d["verdict"].as_str(), d["causes"].as_array().map(Vec::len)), (Some("adequate"), Some(0)), "{}", d["discrepancy"]["notes"]);
}

#[test]
fn how_much_of_a_noisy_motion_is_not_foretold_is_said() {
    let folder = tempfile::tempdir().expect("a folder");
    for (share, said) in [(0.3, true), (0.01, false)] {
        let force: Vec<f64> = noise(1, 20_000).iter().map(|f| 4.0 * f).collect();
        let motion = oscillator(&force);
        let rms = (motion.iter().map(|x| x * x).sum::<f64>() / motion.len() as f64).sqrt();
        let noisy: Vec<f64> = motion.iter().zip(noise(2, force.len())).map(|(x, e)| x + share * rms * e).collect();
        csv(&folder.path().join("a.csv"), "# sample_rate_hz: 500\n", &[("force_x [N]", &force), ("pos_x [m]", &noisy)]);
        let d = json(folder.path(), &["diagnose", "a.csv"]);
        let notes = d["discrepancy"]["notes"].as_array().expect("a list");
        assert_eq!(notes.iter().filter_map(|n| n.as_str()).any(|n| n.contains("is not foretold from the input")), said, "{share}: {} {notes:?}", d["verdict"]);
    }
}
