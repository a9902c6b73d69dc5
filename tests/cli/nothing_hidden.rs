//! Recordings of a linear limb: what a diagnosis says where nothing is missing, and where all that is missing comes now and then.

use crate::support::{csv, json, noise, oscillator, oscillator_that_changes};

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

/// A loop that reads force and position and then writes the command that it holds: what is read is of before the command, by half a tick. Where the
/// command was recorded nothing is missing; without it, in which order it is no recording tells, and no delay or filter is sure.
#[test]
fn half_a_tick_is_no_sure_delay() {
    const STEPS: usize = 50;
    let folder = tempfile::tempdir().expect("a folder");
    for (name, rate_hz) in [("slow.csv", 100.0), ("fast.csv", 500.0)] {
        let command = noise(1, (50.0 * rate_hz) as usize);
        let (mut x, mut v, mut held, step_s) = (0.0, 0.0, 0.0, 1.0 / rate_hz / STEPS as f64);
        let acceleration = |x: f64, v: f64, held: f64| (held - (200.0 + 300.0) * x - (15.0 + 12.0) * v) / (1.0 + 2.0);
        let (mut force, mut motion) = (Vec::new(), Vec::new());
        for (f, own) in command.iter().zip(noise(2, command.len())) {
            force.push(2.0 * acceleration(x, v, held) + 12.0 * v + 300.0 * x + 0.02 * own);
            motion.push((x * 1e5).round() / 1e5);
            held = 4.0 * f;
            for _ in 0..STEPS {
                v += acceleration(x, v, held) * step_s;
                x += v * step_s;
            }
        }
        csv(&folder.path().join(name), &format!("# sample_rate_hz: {rate_hz}\n"), &[("force_x [N]", &force), ("pos_x [m]", &motion)]);
        let seen: Vec<f64> = command.iter().map(|f| 4.0 * f).collect();
        let channels: [(&str, &[f64]); 3] = [("cmd_x [N]", &seen), ("force_x [N]", &force), ("pos_x [m]", &motion)];
        csv(&folder.path().join("commanded.csv"), &format!("# sample_rate_hz: {rate_hz}\n"), &channels);
        let d = json(folder.path(), &["diagnose", "commanded.csv"]);
        assert_eq!((d["verdict"].as_str(), d["causes"].as_array().map(Vec::len)), (Some("adequate"), Some(0)), "{}", d["causes"]);
        let notes = d["discrepancy"]["notes"].to_string();
        assert!(notes.contains("late by half a sample"), "{notes}");
        let d = json(folder.path(), &["diagnose", name]);
        let causes = d["causes"].as_array().expect("a list");
        let late = causes.iter().filter(|c| ["measurement-delay", "channel-filter"].iter().any(|effect| c["effect"] == *effect));
        assert!(late.clone().all(|c| c["probability"].as_f64().expect("a number") <= 0.6 && c["evidence"].to_string().contains("half a sample")), "{d}");
        // At 100 Hz it is there to be seen.
        assert!(rate_hz > 100.0 || late.count() == 1, "{causes:?}");
    }
}

/// A controller that runs at 100 Hz beside forces at 500 Hz: held for 10 ms its position would be late by four rows.
#[test]
fn a_position_that_is_read_more_slowly_is_no_filter() {
    let folder = tempfile::tempdir().expect("a folder");
    for (seed, every, said) in [(1, 5, true), (2, 1, false)] {
        let force = slow_noise(seed, 30_000);
        let motion = oscillator(&force);
        let read: Vec<f64> = (0..motion.len()).map(|k| motion[k / every * every]).collect();
        csv(&folder.path().join("a.csv"), "# sample_rate_hz: 500\n", &[("force_x [N]", &force), ("pos_x [m]", &read)]);
        let d = json(folder.path(), &["diagnose", "a.csv"]);
        assert_eq!((d["verdict"].as_str(), d["causes"].as_array().map(Vec::len)), (Some("adequate"), Some(0)), "{}", d["causes"]);
        let warnings: Vec<&str> = d["warnings"].as_array().expect("a list").iter().filter_map(|w| w["code"].as_str()).collect();
        assert_eq!(warnings.contains(&"slow-readings"), said, "{warnings:?}");
        let findings = json(folder.path(), &["check", "a.csv"])["findings"].clone();
        assert_eq!(findings.as_array().expect("a list").iter().any(|f| f["code"] == "slow-readings"), said, "{findings}");
        // A stream takes what is held as it is, and says so.
        let streamed = json(folder.path(), &["estimate", "a.csv", "--stream"]);
        let told = streamed["warnings"].as_array().expect("a list").iter().filter_map(|w| w["message"].as_str());
        assert_eq!(told.filter(|m| m.contains("it is 4 ms late")).count(), usize::from(said));
        let fit = json(folder.path(), &["fit", "a.csv"]);
        let stiffness = fit["parameters"].as_array().expect("a list").iter().find(|p| p["name"] == "K").expect("a stiffness");
        assert!((stiffness["value"].as_f64().expect("a number") / 300.0 - 1.0).abs() < 0.01, "{stiffness}");
    }
}

/// A person pulls once in each trial, each time at another moment.
#[test]
fn one_pull_a_trial_is_a_knock_in_each() {
    let folder = tempfile::tempdir().expect("a folder");
    let files = ["one.csv", "two.csv", "three.csv"];
    for ((seed, name), from) in (1..).zip(files).zip([9_000, 4_000, 13_000]) {
        let force = slow_noise(seed, 20_000);
        let pull = |k: usize| if (from..from + 400).contains(&k) { 25.0 * (std::f64::consts::PI * (k - from) as f64 / 400.0).sin().powi(2) } else { 0.0 };
        let felt: Vec<f64> = force.iter().enumerate().map(|(k, f)| f + pull(k)).collect();
        let motion: Vec<f64> = oscillator(&felt).iter().zip(noise(10 + seed, felt.len())).map(|(x, e)| x + 5e-6 * e).collect();
        csv(&folder.path().join(name), "# sample_rate_hz: 500\n", &[("force_x [N]", &force), ("pos_x [m]", &motion)]);
    }
    let d = json(folder.path(), &[&["diagnose"][..], &files].concat());
    let causes = d["causes"].as_array().expect("a list");
    let told: Vec<(&str, f64)> =
        causes.iter().map(|c| (c["effect"].as_str().expect("a name"), c["parameters"][0]["value"].as_f64().expect("a time"))).collect();
    // Of the trials that were fitted, each where its person pulled.
    let [(a, first), (b, second)] = told[..] else { panic!("{told:?}") };
    assert_eq!([a, b], ["transient-disturbance"; 2]);
    assert!(first.min(second) > 7.0 && first.min(second) < 8.8 && first.max(second) > 17.0 && first.max(second) < 18.8, "{told:?}");
}

/// A stiffness that swings once in 20 s, of which a diagnosis that was told of no schedule has no law.
#[test]
fn what_changes_slowly_is_said_and_leaves_nothing_adequate() {
    let folder = tempfile::tempdir().expect("a folder");
    // Once in 40 s: a record of two minutes resolves it.
    let force = slow_noise(1, 60_000);
    let motion = oscillator_that_changes(|k| [2.0, 12.0, 300.0 + 90.0 * (std::f64::consts::TAU * k as f64 / 20_000.0).sin()], &force);
    let noisy: Vec<f64> = motion.iter().zip(noise(2, force.len())).map(|(x, e)| x + 5e-6 * e).collect();
    csv(&folder.path().join("a.csv"), "# sample_rate_hz: 500\n", &[("force_x [N]", &force), ("pos_x [m]", &noisy)]);
    let d = json(folder.path(), &["diagnose", "a.csv"]);
    let notes = d["discrepancy"]["notes"].as_array().expect("a list");
    assert!(notes.iter().filter_map(|n| n.as_str()).any(|n| n.contains("changes slowly")), "{notes:?}");
    assert_ne!(d["verdict"], "adequate");
    assert_ne!(d["verdict"], "explained");
}

/// Noise below some 10 Hz, of about 4 N.
fn slow_noise(seed: u64, samples: usize) -> Vec<f64> {
    let mut levels = [0.0; 2];
    let smooth = |f: &f64| {
        levels[0] += 0.12 * (40.0 * f - levels[0]);
        levels[1] += 0.12 * (levels[0] - levels[1]);
        levels[1]
    };
    noise(seed, samples).iter().map(smooth).collect()
}
