//! Force laws of effects that a registry has, in whatever form.

use super::hiding::{Sizes, Truth};
use crate::laws::Law;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

/// The law of an effect of a severity (1 is strong) and its true parameters; none for an effect that is no force law of the registry's.
pub fn law(sizes: &Sizes, name: &str, form: &'static str, s: f64, rng: &mut ChaCha8Rng, own: &mut Truth) -> Option<Law> {
    let Sizes { k, m, b, x, f, speed, duration, .. } = *sizes;
    let (kind, p): (&'static str, Vec<f64>) = match name {
        "coulomb-friction" => {
            own.push(("level", s * 0.5 * f));
            if form == "stribeck-square" {
                own.extend([("stribeck_level", s * 0.85 * f), ("stribeck_velocity", 0.15 * speed)]);
            }
            ("friction", vec![s * 0.5 * f, 0.004 * speed, 0.15 * speed, s * 0.85 * f])
        }
        "hysteresis" => {
            let width = rng.random_range(0.3..0.8) * x;
            own.extend([("stiffness", s * 1.2 * k), ("yield", width)]);
            ("hysteresis", vec![s * 1.2 * k, width, rng.random_range(0.0..1.0)])
        }
        "cubic-stiffness" => {
            let negative = rng.random_range(0.0..1.0) >= 0.6 && s <= 0.06;
            own.push(("k3", if negative { -1.0 } else { 1.0 } * s * 0.8 * k / (3.0 * x * x)));
            ("cubic", vec![own[0].1])
        }
        "asymmetric-stiffness" => {
            own.push(("k2", s * 0.15 * k / x));
            ("square", vec![own[0].1])
        }
        "dead-zone" => {
            own.push(("half_gap", s * 0.9 * x));
            ("gap", vec![own[0].1])
        }
        "end-stop" => {
            let side = if form == "negative" { -1.0 } else { 1.0 };
            own.extend([("stiffness", s * 3.0 * k), ("position", side * rng.random_range(0.8..1.4) * x)]);
            ("stop", vec![own[0].1, own[1].1])
        }
        "reflex-delay" => {
            own.extend([("delay", rng.random_range(0.03..0.06)), ("stiffness", s * 0.5 * k), ("damping", s * 0.5 * b), ("cutoff", rng.random_range(2.0..4.0))]);
            ("reflex", vec![s * 0.5 * k, s * 0.5 * b, 0.0, own[3].1])
        }
        "reflex-one" => {
            own.extend([("delay", rng.random_range(0.03..0.06)), ("damping", s * 3.0 * b), ("cutoff", rng.random_range(2.5..5.0))]);
            ("reflex-one", vec![0.0, s * 3.0 * b, 0.0, own[2].1, 0.15 * speed])
        }
        "extra-resonance" => {
            own.extend([("frequency", rng.random_range(4.0..8.0)), ("damping_ratio", rng.random_range(0.03..0.1))]);
            ("resonance", vec![s * 0.4 * m, own[0].1, own[1].1])
        }
        "viscoelastic" if form == "fractional" => {
            own.extend([("coefficient", s * 0.8 * k), ("order", rng.random_range(0.2..0.4))]);
            ("relaxation", vec![own[0].1, 1.0, own[1].1])
        }
        "viscoelastic" => {
            own.extend([("modulus", s * k), ("time", rng.random_range(0.08..0.3))]);
            ("relaxation", vec![s * k, own[1].1])
        }
        "stiffness-drift" => {
            own.push(("fraction_per_s", s * 0.8 / duration));
            ("stiffness-drift", vec![own[0].1])
        }
        "posture-drift" => {
            own.push(("rate", s * 4.0 * x / duration));
            ("posture-drift", vec![own[0].1])
        }
        "transient-disturbance" => {
            own.push(("time", rng.random_range(0.1..0.6) * duration));
            ("knock", vec![s * 6.0 * f, own[0].1, 0.3])
        }
        "x-quadratic-damping" => ("quadratic-damping", vec![s * 2.5 * b / speed]),
        "x-van-der-pol" => ("van-der-pol", vec![s * 3.0 * b / (x * x)]),
        _ => return None,
    };
    Some(Law::new(kind, &p))
}
