//! Laws that no registry of effects has: memory of use, switches, events, hidden dynamics, rough ground, parameters that are switched.
//!
//! None lies in the span of products, powers, tanh or sin of displacement and velocity, delayed or not.

use super::law::{Law, Now, STATES, World};
use std::f64::consts::{PI, TAU};

/// A law's states when a trial begins.
pub fn start(law: &Law) -> [f64; STATES] {
    let mut s = [0.0; STATES];
    match law.kind {
        // Long since the last event.
        "x-startle" | "x-catch" | "x-bond" => s[0] = 99.0,
        "x-rossler" => s[..3].copy_from_slice(&[1.0, 1.0, 0.0]),
        "x-limit-cycle" => s[0] = 0.5,
        "x-double-well" => s[0] = -law.p[1],
        _ => {}
    }
    s
}

/// The law's resisting force on the axis; writes the rates of its states.
pub fn force(world: &World, law: &Law, now: Now, s: &[f64], ds: &mut [f64]) -> f64 {
    match law.kind {
        "x-thixotropy" | "x-mullins" | "x-fatigue" | "x-thermal-damping" => memory(world, law, now, s, ds),
        "x-rossler" | "x-limit-cycle" | "x-double-well" | "x-state-delay" => dynamics(world, law, now, s, ds),
        "x-startle" | "x-catch" | "x-bond" => event(law, now, s),
        _ => switched(world, law, now, s),
    }
}

fn memory(world: &World, law: &Law, Now { x, v, .. }: Now, s: &[f64], ds: &mut [f64]) -> f64 {
    let p = &law.p;
    match law.kind {
        // A spring that movement of the last p1 seconds softens.
        "x-thixotropy" => {
            let q = s[0] / world.v_size;
            ds[0] = (v.abs() - s[0]) / p[1];
            -p[0] * x * q * q / (0.5 + q * q)
        }
        // Softer below the largest excursion of the last seconds.
        "x-mullins" => -p[0] * x * (1.0 - (x / s[0].max(1e-3 * world.x_size)).abs()).max(0.0),
        // Softer by the way that it has gone.
        "x-fatigue" => {
            ds[0] = v.abs();
            -p[0] * x * (1.0 - (-s[0] / p[1]).exp())
        }
        // Damping that its own heat takes away.
        _ => {
            ds[0] = ((v / world.v_size).powi(2) - s[0]) / p[1];
            p[0] * v / (0.3 + s[0])
        }
    }
}

fn dynamics(world: &World, law: &Law, Now { x, v, .. }: Now, s: &[f64], ds: &mut [f64]) -> f64 {
    let p = &law.p;
    let (u, w) = (x / world.x_size, TAU * p[1]);
    match law.kind {
        // Rössler's chaotic oscillator, driven by the motion.
        "x-rossler" => {
            ds[0] = w * (-s[1] - s[2]);
            ds[1] = w * (s[0] + 0.2 * s[1] + 0.5 * u);
            ds[2] = w * (0.2 + s[2] * (s[0] - 5.7));
            p[0] * s[0] / 5.0
        }
        // A van der Pol oscillator that the motion pulls along.
        "x-limit-cycle" => {
            ds[0] = s[1];
            ds[1] = 1.5 * w * (1.0 - s[0] * s[0]) * s[1] + w * w * (0.4 * u - s[0]);
            p[0] * s[0]
        }
        // A carried mass that rests on either side of a hump.
        "x-double-well" => {
            let stretch = x - s[0];
            let (u, w) = ((stretch / p[1]).powi(2), TAU * 5.0);
            let f = p[0] * (w * w * stretch * (u - 1.0) / (1.0 + u / 3.0) + 0.3 * w * (v - s[1]));
            ds[0] = s[1];
            ds[1] = f / p[0];
            f
        }
        // Velocity fed back after a delay that gets shorter with speed: six lags in a row.
        _ => {
            ds[6] = (v.abs() - s[6]) / 0.1;
            let delay = p[1] / (0.4 + s[6] / world.v_size);
            for q in 0..6 {
                let before = if q == 0 { v } else { s[q - 1] };
                ds[q] = 6.0 / delay * (before - s[q]);
            }
            p[0] * s[5]
        }
    }
}

fn event(law: &Law, Now { x, .. }: Now, s: &[f64]) -> f64 {
    let (p, since) = (&law.p, s[0]);
    match law.kind {
        // A burst of force after a fast movement.
        "x-startle" if (0.09..0.29).contains(&since) => p[0] * s[1] * (PI * (since - 0.09) / 0.2).sin(),
        // A correction some time after the place was left: up, held, let go.
        "x-catch" if (0.15..1.35).contains(&since) => p[0] * s[1] * ((since - 0.15) / 0.2).min((1.35 - since) / 0.4).min(1.0),
        // A bond to a spot, until it breaks.
        "x-bond" if s[2] > 0.0 => p[0] * (x - s[1]),
        _ => 0.0,
    }
}

fn switched(world: &World, law: &Law, now: Now, s: &[f64]) -> f64 {
    let (p, Now { t, x, v, .. }) = (&law.p, now);
    let u = x / world.x_size;
    match law.kind {
        // Stiffer for a while after a fast movement.
        "x-latch" => p[0] * x * (s[0] / 0.1).clamp(0.0, 1.0),
        "x-relay-stiffness" => p[0] * x * s[2],
        // A spring that catches the limb where it is, at times of its own.
        "x-random-contact" => p[0] * (x - s[1]) * if s[0] > 0.0 { 1.0 } else { 0.0 },
        "x-telegraph-damping" => {
            let (on, since) = world.switched(law, t);
            let ramp = (since / 0.05).min(1.0);
            p[0] * v * if on { ramp } else { 1.0 - ramp }
        }
        "x-periodic-stiffness" => p[0] * (TAU * p[1] * t).sin() * x,
        // Ground that is rough at every scale.
        "x-rough" => (0..10)
            .map(|j| {
                let length = 2.2 * 1.55f64.powi(-j);
                p[0] * length.sqrt() * (TAU * u / length + 2.4 * f64::from(j * j)).sin()
            })
            .sum(),
        // A film of fluid that gets thin on one side.
        "x-squeeze-film" => {
            let thin = 1.0 / (1.0 + (2.0 * u).clamp(-20.0, 20.0).exp()) + 0.05;
            p[0] * v * (1.0 / thin - 1.0) / 4.0
        }
        // Together with the mass: m(x) a + m'(x) v² / 2, and m'(t) v.
        "x-position-inertia" => 0.5 * p[0] * slope(3.0 * u) * 3.0 / world.x_size * v * v,
        "x-grip" => {
            let (on, since) = world.switched(law, t);
            if since < GRASP_S { p[0] / GRASP_S * v * if on { 1.0 } else { 0.0 } } else { 0.0 }
        }
        _ => 0.0,
    }
}

/// How long a grip takes.
const GRASP_S: f64 = 0.1;

fn slope(u: f64) -> f64 {
    let e = (-u.clamp(-30.0, 30.0)).exp();
    e / (1.0 + e).powi(2)
}

/// Inertia that a law adds.
pub fn mass(world: &World, law: &Law, t: f64, x: f64) -> f64 {
    match law.kind {
        "x-position-inertia" => law.p[0] / (1.0 + (-3.0 * x / world.x_size).clamp(-30.0, 30.0).exp()),
        "x-grip" => {
            let (on, since) = world.switched(law, t);
            let ramp = (since / GRASP_S).min(1.0);
            law.p[0] * if on { ramp } else { 1.0 - ramp }
        }
        _ => 0.0,
    }
}

/// What happens at the end of a step of `h` seconds.
pub fn update(world: &World, law: &Law, Now { t, x, v, .. }: Now, h: f64, s: &mut [f64]) {
    let p = &law.p;
    match law.kind {
        "x-mullins" => s[0] = (s[0] * (-h / p[1]).exp()).max(x.abs()),
        "x-latch" => s[0] = if v.abs() > p[1] { 1.2 } else { (s[0] - h).max(0.0) },
        // Stiff once it has been above the threshold for 60 ms, soft once below its mirror as long.
        "x-relay-stiffness" => {
            let beyond = if s[0] > 0.5 { x < -p[1] } else { x > p[1] };
            s[1] = if beyond { s[1] + h } else { 0.0 };
            if s[1] > 0.06 {
                (s[0], s[1]) = (1.0 - s[0], 0.0);
            }
            s[2] += h / 0.02 * (s[0] - s[2]);
        }
        "x-random-contact" => {
            let on = world.switched(law, t).0;
            if on && s[0] <= 0.0 {
                s[1] = x;
            }
            s[0] = if on { 1.0 } else { 0.0 };
        }
        "x-startle" => {
            s[0] += h;
            if s[0] > 1.5 && v.abs() > p[1] {
                (s[0], s[1]) = (0.0, v.signum());
            }
        }
        "x-catch" => {
            s[0] += h;
            if s[0] > 1.8 && x.abs() > p[1] {
                (s[0], s[1]) = (0.0, x.signum());
            }
        }
        // Binds where the limb is slow near one of two spots, breaks at a force, and stays open for a while.
        "x-bond" => {
            s[0] += h;
            if s[2] > 0.0 && (x - s[1]).abs() > p[1] {
                (s[0], s[2]) = (0.0, 0.0);
            } else if s[2] <= 0.0 && s[0] > 0.15 && v.abs() < 0.5 * world.v_size {
                (s[1], s[2]) = (x, 1.0);
            }
        }
        _ => {}
    }
}
