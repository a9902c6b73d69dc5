//! Cases drawn from a seed.

use super::{Case, Hidden, Plant};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Single effects that every plant can have.
pub const SINGLE: [&str; 18] = [
    "coulomb-friction",
    "hysteresis",
    "cubic-stiffness",
    "asymmetric-stiffness",
    "dead-zone",
    "end-stop",
    "reflex-delay",
    "reflex-one",
    "extra-resonance",
    "viscoelastic",
    "stiffness-drift",
    "posture-drift",
    "measurement-delay",
    "channel-filter",
    "periodic-disturbance",
    "series-compliance",
    "transient-disturbance",
    "quantisation",
];
/// Those of a mass without a spring.
pub const FREE_MASS: [&str; 6] = ["coulomb-friction", "hysteresis", "extra-resonance", "measurement-delay", "periodic-disturbance", "transient-disturbance"];
/// Those that have another functional form.
pub const OTHER: [&str; 14] = [
    "coulomb-friction",
    "hysteresis",
    "hysteresis",
    "cubic-stiffness",
    "asymmetric-stiffness",
    "dead-zone",
    "end-stop",
    "reflex-delay",
    "reflex-one",
    "extra-resonance",
    "viscoelastic",
    "stiffness-drift",
    "channel-filter",
    "periodic-disturbance",
];
/// Effects that no registry knows.
pub const OUTSIDE: [&str; 4] = ["x-quadratic-damping", "x-van-der-pol", "x-periodic-stiffness", "x-cogging"];
/// Two at once.
pub const PAIRS: [(&str, &str); 10] = [
    ("coulomb-friction", "measurement-delay"),
    ("hysteresis", "channel-filter"),
    ("cubic-stiffness", "coulomb-friction"),
    ("reflex-delay", "measurement-delay"),
    ("stiffness-drift", "hysteresis"),
    ("extra-resonance", "dead-zone"),
    ("viscoelastic", "cubic-stiffness"),
    ("hysteresis", "coulomb-friction"),
    ("reflex-one", "cubic-stiffness"),
    ("periodic-disturbance", "coulomb-friction"),
];

/// The kinds of cases, in the shares of a challenge of 50: 10 null, 5 background, 8 other, 5 pair, 5 outside, 17 single.
pub fn kind_of(number: u64) -> &'static str {
    match number % 50 {
        0..10 => "null",
        10..15 => "background",
        15..23 => "other",
        23..28 => "pair",
        28..33 => "outside",
        _ => "single",
    }
}

/// The registry's name of a hidden thing.
pub fn registry_name(hidden: &str) -> &str {
    match hidden.split('/').next().unwrap_or(hidden) {
        "reflex-one" => "reflex-delay",
        "series-compliance" => "extra-resonance",
        other => other,
    }
}

/// Case `number` of the challenge of `seed`.
pub fn draw(seed: u64, number: u64, kind: &str, plant: Option<Plant>) -> Case {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    rng.set_stream(number);
    // One in a hundred has six axes, which cost as much as thirty of the others.
    let share: f64 = rng.random_range(0.0..1.0);
    let drawn = match share {
        s if s < 0.27 => Plant::Force,
        s if s < 0.54 => Plant::Planar,
        s if s < 0.76 => Plant::Motion,
        s if s < 0.88 => Plant::Mass,
        s if s < 0.99 => Plant::Wrist,
        _ => Plant::Six,
    };
    let plant = plant.unwrap_or(if kind == "pair" && drawn == Plant::Mass { Plant::Force } else { drawn });
    let mut severity = |lo: f64| f64::exp(rng.random_range(f64::ln(lo)..0.0));
    let (first, second) = (severity(0.13), severity(0.13));
    let single = severity(0.03);
    let turned = rng.random_range(0..12);
    let mut pick = |list: &[&'static str]| list[rng.random_range(0..list.len())];
    let hidden = match kind {
        "null" | "background" => vec![],
        "pair" => {
            let (a, b) = PAIRS[rng.random_range(0..PAIRS.len())];
            vec![Hidden { name: a, severity: 0.6 * first }, Hidden { name: b, severity: 0.6 * second }]
        }
        "outside" => vec![Hidden { name: pick(if plant == Plant::Mass { &OUTSIDE[..2] } else { &OUTSIDE }), severity: first }],
        "other" if plant == Plant::Mass => vec![Hidden { name: pick(&["coulomb-friction", "hysteresis", "extra-resonance"]), severity: single }],
        "other" => vec![Hidden { name: pick(&OTHER), severity: single }],
        _ if plant == Plant::Mass => vec![Hidden { name: pick(&FREE_MASS), severity: single }],
        _ if (2..=3).contains(&plant.axes()) && turned == 0 => vec![Hidden { name: "sensor-misalignment", severity: single }],
        _ => vec![Hidden { name: pick(&SINGLE), severity: single }],
    };
    let trials = if rng.random_range(0.0..1.0) < 0.6 { 3 } else { 1 };
    Case { plant, hidden, other: kind == "other", background: kind == "background", trials, duration_s: 50.0, seed: rng.random(), command: (1.0, 1.0) }
}
