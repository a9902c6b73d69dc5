//! The registry's effects in functional forms that it does not have.

use super::law::{Law, Now, World};
use super::registry::{carried, muscle};
use std::f64::consts::{PI, TAU};

/// The law's resisting force on the axis; writes the rates of its states.
pub fn force(world: &World, law: &Law, now: Now, s: &[f64], ds: &mut [f64]) -> f64 {
    match law.kind {
        "friction" => friction(world, law, now, s, ds),
        "hysteresis" => hysteresis(world, law, now, s, ds),
        "cubic" | "square" | "gap" | "stop" => spring(world, law, now),
        "reflex" | "reflex-one" => reflex(world, law, now, s, ds),
        "resonance" => resonance(world, law, now, s, ds),
        "relaxation" => relaxation(world, law, now, s, ds),
        "stiffness-drift" => world.k[world.axis][world.axis] * law.p[0] * course(world.duration, law.form, now.t) * now.x,
        "posture-drift" => -world.k[world.axis][world.axis] * law.p[0] * course(world.duration, law.form, now.t),
        "knock" => knock(law, now.t),
        _ => 0.0,
    }
}

fn friction(world: &World, law: &Law, now: Now, s: &[f64], ds: &mut [f64]) -> f64 {
    let (p, v) = (&law.p, now.v);
    let slip = (v / p[1]).tanh();
    match law.form {
        "stribeck" => p[0] / 1.2 * (1.0 + 0.5 * (-(v / p[2]).abs()).exp()) * slip,
        // The registry's own Stribeck curve.
        "stribeck-square" => (p[0] + (p[3] - p[0]) * (-(v / p[2]).powi(2)).exp()) * slip,
        // Normal force that changes along the way.
        "load" => p[0] * (1.0 + 0.7 * (now.x / world.x_size).clamp(-1.0, 1.5)) * slip,
        // Bristles with a Stribeck curve; the state is a force.
        _ => {
            let (level, give) = (p[0] * (0.8 + 0.4 * (-(v / p[2]).powi(2)).exp()), 0.02 * world.x_size);
            ds[0] = p[0] / give * (v - v.abs() * s[0] / level);
            s[0]
        }
    }
}

/// Yields of ten slipping springs over the law's, and their stiffness: a power law of yields.
fn slip(q: usize) -> (f64, f64) {
    let y = 0.2 * 1.45f64.powi(q as i32);
    (y, 0.28 * y.powf(-0.4))
}

fn hysteresis(world: &World, law: &Law, now: Now, s: &[f64], ds: &mut [f64]) -> f64 {
    let (p, v) = (&law.p, now.v);
    match law.form {
        "dahl-square" => {
            ds[0] = v - v.abs() * s[0] * s[0].abs() / (p[1] * p[1]);
            p[0] * s[0]
        }
        "three-slips" => [(1.0, 1.0), (2.5, 0.5), (0.4, 1.0)].into_iter().enumerate().map(|(q, (y, w))| slipping(w * p[0] / 2.0, y * p[1], v, s, ds, q)).sum(),
        "ten-slips" => (0..10).map(|q| slipping(slip(q).1 * p[0], slip(q).0 * p[1], v, s, ds, q)).sum(),
        // Bouc and Wen's loop, wider one way than the other.
        "unequal-loop" => {
            let width = p[1] * if s[0] > 0.0 { 1.5 } else { 0.6 };
            ds[0] = v - 0.5 / width * (v.abs() * s[0] + v * s[0].abs());
            p[0] * s[0]
        }
        // Plays in a row, each pulling on a spring that hardens: loops that are neither congruent nor Masing's.
        _ => (0..6).map(|q| p[0] / 4.0 * s[q] * (0.5 + (s[q] / world.x_size).abs().min(3.0))).sum(),
    }
}

fn slipping(k: f64, y: f64, v: f64, s: &[f64], ds: &mut [f64], q: usize) -> f64 {
    ds[q] = if (s[q] > y && v > 0.0) || (s[q] < -y && v < 0.0) { 0.0 } else { v };
    k * s[q]
}

/// Half the play of each of the curved plays over the law's yield.
fn play(q: usize) -> f64 {
    0.3 + 0.5 * q as f64
}

/// What moves plays along.
pub fn update(_: &World, law: &Law, now: Now, s: &mut [f64]) {
    if law.kind == "hysteresis" && law.form == "curved-plays" {
        s.iter_mut().take(6).enumerate().for_each(|(q, s)| *s = s.clamp(now.x - play(q) * law.p[1], now.x + play(q) * law.p[1]));
    }
}

fn spring(world: &World, law: &Law, now: Now) -> f64 {
    let (p, size) = (&law.p, world.x_size);
    let u = now.x / size;
    let k = world.k[world.axis][world.axis];
    match law.form {
        "power-2.3" => p[0] * size.powi(3) * 1.6 * u * u.abs().powf(1.3),
        "sinh" => p[0] * size.powi(3) * 4.2 * (u.clamp(-8.0, 8.0).sinh() - u),
        "quintic" => p[0] * size.powi(3) * 0.3 * u.powi(5),
        "power-1.5" => p[0] * size.powi(2) * 1.2 * u.abs().powf(1.5),
        "toe" => p[0] * size.powi(2) * 1.5 * (u.min(6.0).exp() - 1.0 - u),
        "kink" => p[0] * size.powi(2) * 1.5 * u.max(0.0),
        "soft" if law.kind == "gap" => -k * p[0] * (now.x / p[0]).tanh(),
        "off-centre" => -k * now.x.clamp(-0.4 * p[0], 1.6 * p[0]),
        "ramped" => {
            let w = (now.x / p[0]).clamp(-2.0, 2.0);
            -k * p[0] * (w - w * w.abs() / 4.0)
        }
        _ => {
            let over = (now.x - p[1]).max(0.0);
            p[0] * over
                * match law.form {
                    "hertz" => (over / (0.5 * size)).sqrt(),
                    "damped" => (1.0 + 0.6 * now.v / world.v_size).max(0.0),
                    _ => 1.0 - (-over / (0.3 * size)).exp(),
                }
        }
    }
}

fn reflex(world: &World, law: &Law, now: Now, s: &[f64], ds: &mut [f64]) -> f64 {
    let (p, (xd, vd), w) = (&law.p, now.back, TAU * law.p[3]);
    let both = p[0] * xd + p[1] * vd;
    let speed = world.v_size;
    match (law.kind, law.form) {
        ("reflex", "underdamped") => muscle(both, w, 1.4, s, ds),
        ("reflex", "first-order") => {
            ds[0] = 0.5 * w * (both - s[0]);
            s[0]
        }
        ("reflex", _) => {
            let most = p[1] * speed + p[0] * world.x_size;
            muscle(most * (both / most).tanh(), w, 2.0, s, ds)
        }
        (_, "threshold") => muscle(p[1] * (vd - p[4]).max(0.0), w, 2.0, s, ds),
        (_, "square") => muscle(p[1] * vd.max(0.0).powi(2) / (2.0 * speed), w, 2.0, s, ds),
        _ => muscle(p[1] * speed * (vd.max(0.0) / speed).tanh(), w, 2.0, s, ds),
    }
}

fn resonance(world: &World, law: &Law, now: Now, s: &[f64], ds: &mut [f64]) -> f64 {
    let (p, w) = (&law.p, TAU * law.p[1]);
    match law.form {
        "hardening" => {
            let hard = 1.0 + (4.0 * (now.x - s[0]) / world.x_size).powi(2).min(2.0);
            carried(p[0], w, p[2], hard, now.x, now.v, s, ds)
        }
        "two-modes" => carried(p[0], w, p[2], 1.0, now.x, now.v, s, ds) + carried(0.5 * p[0], 1.9 * w, p[2], 1.0, now.x, now.v, &s[2..], &mut ds[2..]),
        // Dry friction in its spring in place of a damper.
        _ => {
            let rub = 0.15 * p[0] * w * w * world.x_size * ((now.v - s[1]) / (0.05 * world.v_size)).tanh();
            let f = p[0] * w * w * (now.x - s[0]) + rub;
            ds[0] = s[1];
            ds[1] = f / p[0];
            f
        }
    }
}

fn relaxation(world: &World, law: &Law, now: Now, s: &[f64], ds: &mut [f64]) -> f64 {
    let (p, x) = (&law.p, now.x);
    let mut sum = |elements: &mut dyn Iterator<Item = (f64, f64)>| -> f64 {
        elements
            .enumerate()
            .map(|(q, (modulus, time))| {
                ds[q] = (x - s[q]) / time;
                modulus * (x - s[q])
            })
            .sum()
    };
    match law.form {
        "three-times" => sum(&mut [(1.0, 1.0), (0.6, 5.0), (0.5, 0.3)].into_iter().map(|(k, t)| (k * p[0], t * p[1]))),
        // Relaxation as a stretched exponential: times over three decades.
        "stretched" => sum(&mut (0..7).map(|q| (p[0] * 0.55 * 0.85f64.powi((q - 3i32).abs()), p[1] * 3.0f64.powi(q - 4)))),
        // p0 s^p2 as a sum of elements at twelve rates, by s^a = sin(πa)/π ∫ s w^(a-1) / (s + w) dw (the registry's second form).
        "fractional" => {
            let (a, step) = (p[2], 1e4f64.ln() / 12.0);
            sum(&mut (0..12).map(|q| {
                let w = TAU * 0.02 * (step * (q as f64 + 0.5)).exp();
                (p[0] * (PI * a).sin() / PI * step * w.powf(a), 1.0 / w)
            }))
        }
        // Fung's quasi-linear relaxation: of an elastic force that is not linear.
        _ => {
            let elastic = x * (1.0 + 0.5 * (x / world.x_size).clamp(-1.5, 3.0));
            ds[0] = (elastic - s[0]) / p[1];
            p[0] * (elastic - s[0])
        }
    }
}

/// Time since the middle of a trial, or another course of it, as long and as far.
pub fn course(duration: f64, form: &str, t: f64) -> f64 {
    match form {
        "settling" => duration * (0.6 - (-t / (0.4 * duration)).exp()),
        "sigmoid" => 0.5 * duration * ((t - 0.45 * duration) / (0.08 * duration)).tanh(),
        _ => t - duration / 2.0,
    }
}

fn knock(law: &Law, t: f64) -> f64 {
    let since = t - law.p[1];
    match law.form {
        "kick" if since > 0.0 => -1.5 * law.p[0] * (since / 0.02).min(1.0) * (-since / 0.15).exp(),
        "to-and-fro" if (0.0..0.6).contains(&since) => -law.p[0] * (TAU * since / 0.6).sin(),
        _ => 0.0,
    }
}
