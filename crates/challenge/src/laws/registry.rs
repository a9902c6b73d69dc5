//! Laws in the functional form that a registry of effects has.

use super::law::{Law, Now, World};
use std::f64::consts::{PI, TAU};

/// The law's resisting force on the axis; writes the rates of its states.
pub fn force(world: &World, law: &Law, now: Now, s: &[f64], ds: &mut [f64]) -> f64 {
    let p = &law.p;
    let (i, Now { t, x, v, back: (xd, vd), all }) = (world.axis, now);
    match law.kind {
        "friction" => p[0] * (v / p[1]).tanh(),
        "hysteresis" => {
            ds[0] = v - 0.5 / p[1] * (v.abs() * s[0] + v * s[0].abs());
            p[0] * s[0]
        }
        "cubic" => p[0] * x.powi(3),
        "square" => p[0] * x * x,
        "gap" => -world.k[i][i] * x.clamp(-p[0], p[0]),
        "stop" => {
            let over = if p[1] > 0.0 { (x - p[1]).max(0.0) } else { (x - p[1]).min(0.0) };
            p[0] * over
        }
        "reflex" => muscle(p[0] * xd + p[1] * vd, TAU * p[3], 2.0, s, ds),
        "reflex-one" => muscle(p[1] * vd.max(0.0), TAU * p[3], 2.0, s, ds),
        "resonance" => carried(p[0], TAU * p[1], p[2], 1.0, x, v, s, ds),
        "relaxation" => {
            ds[0] = (x - s[0]) / p[1];
            p[0] * (x - s[0])
        }
        "stiffness-drift" => world.k[i][i] * p[0] * (t - world.duration / 2.0) * x,
        "posture-drift" => -world.k[i][i] * p[0] * (t - world.duration / 2.0),
        "knock" if (0.0..p[2]).contains(&(t - p[1])) => -p[0] * (PI * (t - p[1]) / p[2]).sin(),
        "van-der-pol" => p[0] * v * x * x,
        "quadratic-damping" => p[0] * v * v.abs(),
        "product" => p[0] * all[law.from] * x,
        _ => 0.0,
    }
}

/// A muscle's activation: two lags in a row at critical damping 2.
pub fn muscle(drive: f64, w: f64, damping: f64, s: &[f64], ds: &mut [f64]) -> f64 {
    ds[0] = s[1];
    ds[1] = w * w * (drive - s[0]) - damping * w * s[1];
    s[0]
}

/// Force on the limb of a mass that it carries on a spring, `hard` times as stiff.
#[allow(clippy::too_many_arguments)]
pub fn carried(mass: f64, w: f64, ratio: f64, hard: f64, x: f64, v: f64, s: &[f64], ds: &mut [f64]) -> f64 {
    let f = mass * (w * w * (x - s[0]) * hard + 2.0 * ratio * w * (v - s[1]));
    ds[0] = s[1];
    ds[1] = f / mass;
    f
}
