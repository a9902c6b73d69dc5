//! Force laws that no registry has.

use super::hiding::Sizes;
use crate::laws::Law;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

/// The law of that name and severity; none where it is no force law.
pub fn law(sizes: &Sizes, name: &'static str, s: f64, rng: &mut ChaCha8Rng) -> Option<Law> {
    let Sizes { k, m, b, x, f, speed, duration, total } = *sizes;
    let p = match name {
        "x-periodic-stiffness" => [s * 0.6 * k, rng.random_range(0.4..1.2)],
        "x-thixotropy" => [s * 1.2 * k, rng.random_range(0.15..0.4)],
        "x-mullins" => [s * 1.5 * k, rng.random_range(0.8..2.0)],
        "x-fatigue" => [s * 0.8 * k, speed * duration * rng.random_range(0.15..0.4)],
        "x-thermal-damping" => [s * 4.0 * b, rng.random_range(0.3..0.9)],
        "x-rossler" => [s * f, rng.random_range(0.9..2.0)],
        "x-limit-cycle" => [s * 0.5 * f, rng.random_range(1.5..3.5)],
        "x-double-well" => [s * 0.4 * m, rng.random_range(0.2..0.5) * x],
        "x-state-delay" => [s * 2.0 * b, rng.random_range(0.04..0.09)],
        "x-startle" => [s * 2.0 * f, rng.random_range(0.9..1.3) * speed],
        "x-catch" => [s * 1.5 * f, rng.random_range(1.2..1.7) * x],
        "x-bond" => [s * 2.0 * k, rng.random_range(0.15..0.3) * x],
        "x-latch" => [s * 1.5 * k, rng.random_range(1.0..1.5) * speed],
        "x-relay-stiffness" => [s * 1.2 * k, rng.random_range(0.4..0.8) * x],
        "x-random-contact" => [s * 1.5 * k, rng.random_range(0.8..1.6)],
        "x-telegraph-damping" => [s * 4.0 * b, rng.random_range(0.8..1.6)],
        "x-grip" => [s * 0.8 * m, rng.random_range(1.0..2.0)],
        "x-rough" => [s * 0.5 * f, 0.0],
        "x-squeeze-film" => [s * 2.0 * b, 0.0],
        "x-position-inertia" => [s * 1.2 * m, 0.0],
        _ => return None,
    };
    let switched = matches!(name, "x-random-contact" | "x-telegraph-damping" | "x-grip");
    // Intervals at random, never shorter than a quarter of a second.
    let mut schedule = Vec::new();
    let mut at = 0.5;
    while switched && at < total {
        let u: f64 = rng.random_range(0.0..1.0);
        at += 0.25 - p[1] * (1.0 - u).ln();
        schedule.push(at);
    }
    Some(Law { schedule, ..Law::new(name, &p) })
}
