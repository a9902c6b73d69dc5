//! How the time of a diagnosis grows with the length of the recording, with its axes and with the effects that are tried.

use ndof_challenge::{Case, Hidden, Plant, make};
use ndof_diagnose::{Options, diagnose};
use ndof_models::effects::EFFECTS;
use std::time::Instant;

/// Seconds that all threads have computed, where the system tells them (Linux); else those since `start`.
fn computed_s(start: Instant) -> f64 {
    let of = |task: std::fs::DirEntry| std::fs::read_to_string(task.path().join("schedstat")).ok()?.split_whitespace().next()?.parse::<f64>().ok();
    let told: Option<f64> = std::fs::read_dir("/proc/self/task").ok().map(|tasks| tasks.flatten().filter_map(of).sum());
    told.filter(|ns| *ns > 0.0).map_or_else(|| start.elapsed().as_secs_f64(), |ns| 1e-9 * ns)
}

/// The least of three runs, in seconds of computing.
fn seconds(plant: Plant, duration_s: f64, trials: usize, hidden: &[&'static str], without: &[String]) -> f64 {
    let hidden = hidden.iter().map(|name| Hidden { name, severity: 0.3 }).collect();
    let made = make(&Case { plant, hidden, other: false, background: false, trials, duration_s, seed: 12, command: (1.0, 1.0) });
    let options = Options { without: without.to_vec(), ..Options::default() };
    let once = || {
        let clock = Instant::now();
        let before = computed_s(clock);
        let found = diagnose(&made.recordings, &made.ports, &options, None, &mut |_| {});
        found.map_or(f64::NAN, |_| computed_s(clock) - before)
    };
    (0..3).map(|_| once()).fold(f64::INFINITY, f64::min)
}

/// Prints the tables.
pub fn print() {
    println!("one axis, one trial: length in seconds, seconds of a diagnosis");
    for duration_s in [25.0, 50.0, 100.0, 200.0] {
        println!("{duration_s:6.0} {:8.2}", seconds(Plant::Force, duration_s, 1, &["hysteresis"], &[]));
    }
    println!("one trial of 50 s: axes, seconds");
    for plant in [Plant::Force, Plant::Planar, Plant::Wrist, Plant::Six] {
        println!("{:6} {:8.2}", plant.axes(), seconds(plant, 50.0, 1, &["hysteresis"], &[]));
    }
    println!("two axes, one trial of 50 s, a hysteresis hidden: effects that are tried, seconds");
    let names: Vec<String> = EFFECTS.iter().map(|e| e.name().to_owned()).collect();
    for kept in [1, 7, 14, names.len()] {
        let without: Vec<String> = names.iter().filter(|n| *n != "hysteresis").skip(kept - 1).cloned().collect();
        println!("{kept:6} {:8.2}", seconds(Plant::Planar, 50.0, 1, &["hysteresis"], &without));
    }
    println!("one axis, one trial of 50 s: effects that are hidden, seconds");
    for hidden in [&[][..], &["hysteresis"], &["hysteresis", "measurement-delay"], &["hysteresis", "measurement-delay", "cubic-stiffness"]] {
        println!("{:6} {:8.2}", hidden.len(), seconds(Plant::Force, 50.0, 1, hidden, &[]));
    }
}
