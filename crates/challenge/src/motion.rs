//! How the limb moves: explicit midpoint at 4 kHz under a discrete controller, or an imposed sum of sines.

use super::laws::{Rates, World};
use crate::clock::{FINE_HZ, FS, SUB};
use ndof_signal::{inverse_transform, signal_by};
use num_complex::Complex64;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use std::f64::consts::TAU;

/// The robot that holds the limb.
pub struct Robot<'a> {
    pub inertia: &'a [Vec<f64>],
    pub kp: &'a [f64],
    pub kd: &'a [f64],
    /// Level and smoothing velocity of its dry friction, by axis.
    pub friction: &'a [f64],
    pub smoothing: f64,
    /// Whether the command is a position.
    pub position: bool,
    /// Largest force that it applies.
    pub limit: Option<f64>,
}

/// Where limb and laws are at a step.
#[derive(Clone)]
pub struct Mark {
    pub step: usize,
    pub x: Vec<f64>,
    pub v: Vec<f64>,
    pub s: Vec<f64>,
}

/// Force on the limb and motion, `[axis][time]` on the fine grid, and where everything was at every second.
pub struct Played {
    pub force: Vec<Vec<f64>>,
    pub motion: Vec<Vec<f64>>,
    pub marks: Vec<Mark>,
}

/// Limb and laws between two steps of the integrator.
struct Walk<'a> {
    world: &'a World,
    now: Mark,
    /// Displacement, velocity and states in the middle of the step.
    middle: Mark,
    /// Displacement and velocity of the axis at each step so far.
    past: Vec<(f64, f64)>,
    /// Acceleration, rates of the laws' states, the limb's resistance, and the force on it.
    a: Vec<f64>,
    ds: Vec<f64>,
    resist: Vec<f64>,
    applied: Vec<f64>,
}

impl<'a> Walk<'a> {
    fn new(world: &'a World, from: Mark, steps: usize) -> Self {
        let (n, states) = (world.n, from.s.len());
        let (a, ds, resist, applied) = (vec![0.0; n], vec![0.0; states], vec![0.0; n], vec![0.0; n]);
        Walk { world, middle: from.clone(), now: from, past: Vec::with_capacity(steps), a, ds, resist, applied }
    }

    /// One step of the explicit midpoint rule under the force that `applied` gives for a velocity. Afterwards `middle`, `applied` and `a` are
    /// those of its middle.
    fn step(&mut self, h: f64, mut applied: impl FnMut(&[f64], &mut [f64])) {
        let t = self.now.step as f64 / FINE_HZ;
        let i = self.world.axis;
        self.past.push((self.now.x[i], self.now.v[i]));
        let back = self.past.len().checked_sub(1 + self.world.delay_steps).map_or((0.0, 0.0), |b| self.past[b]);
        applied(&self.now.v, &mut self.applied);
        let mut out = Rates { applied: &self.applied, a: &mut self.a, ds: &mut self.ds, resist: &mut self.resist };
        self.world.rates(t, &self.now.x, &self.now.v, back, &self.now.s, &mut out);
        let ahead = |to: &mut [f64], from: &[f64], rate: &[f64]| to.iter_mut().zip(from).zip(rate).for_each(|((to, y), r)| *to = y + 0.5 * h * r);
        ahead(&mut self.middle.x, &self.now.x, &self.now.v);
        ahead(&mut self.middle.v, &self.now.v, &self.a);
        ahead(&mut self.middle.s, &self.now.s, &self.ds);
        applied(&self.middle.v, &mut self.applied);
        let mut out = Rates { applied: &self.applied, a: &mut self.a, ds: &mut self.ds, resist: &mut self.resist };
        self.world.rates(t + 0.5 * h, &self.middle.x, &self.middle.v, back, &self.middle.s, &mut out);
        let on = |from: &mut [f64], rate: &[f64]| from.iter_mut().zip(rate).for_each(|(y, r)| *y += h * r);
        on(&mut self.now.x, &self.middle.v);
        on(&mut self.now.v, &self.a);
        on(&mut self.now.s, &self.ds);
        self.world.update(t, h, &self.now.x, &self.now.v, &mut self.now.s);
        self.now.step += 1;
    }
}

/// The limb held by a robot, or pushed by it.
pub fn held(world: &World, command: &[Vec<f64>], own: &[Vec<f64>], robot: &Robot) -> Played {
    let n = world.n;
    let samples = command[0].len();
    let (fine, h) = (samples * SUB, 1.0 / FINE_HZ);
    let rest = Mark { step: 0, x: vec![0.0; n], v: vec![0.0; n], s: world.at_rest() };
    let mut walk = Walk::new(world, rest, fine);
    let mut played = Played { force: vec![Vec::with_capacity(fine); n], motion: vec![Vec::with_capacity(fine); n], marks: vec![] };
    let (mut vf, mut vp, mut xp, mut drive) = (vec![0.0; n], vec![0.0; n], vec![0.0; n], vec![0.0; n]);
    let mut w = vec![0.0; n];
    for k in 0..samples {
        if k % FS as usize == 0 {
            played.marks.push(walk.now.clone());
        }
        for i in 0..n {
            let raw = (walk.now.x[i] - xp[i]) * FS;
            vf[i] = 0.11216 * (raw + vp[i]) + 0.77568 * vf[i];
            vp[i] = raw;
            xp[i] = walk.now.x[i];
            let (r, reference) = if robot.position { (0.0, command[i][k]) } else { (command[i][k], 0.0) };
            drive[i] = r + robot.kp[i] * (reference - walk.now.x[i]) - robot.kd[i] * vf[i];
            if let Some(limit) = robot.limit {
                drive[i] = drive[i].clamp(-limit, limit);
            }
        }
        for q in 0..SUB {
            w.iter_mut().zip(own).for_each(|(w, own)| *w = own[k] + (own[k + 1] - own[k]) * q as f64 / SUB as f64);
            walk.step(h, |v, applied| {
                for i in 0..n {
                    let rub = if robot.friction[i] == 0.0 { 0.0 } else { robot.friction[i] * (v[i] / robot.smoothing).tanh() };
                    applied[i] = drive[i] - rub + w[i];
                }
            });
            for (i, w) in w.iter().enumerate() {
                let inertial: f64 = (0..n).map(|j| robot.inertia[i][j] * walk.a[j]).sum();
                played.force[i].push(walk.applied[i] - w - inertial);
                played.motion[i].push(walk.middle.x[i]);
            }
        }
    }
    played
}

/// The limb alone under a given force, `[axis][time]` on the fine grid, from a mark on: its motion at the middle of each step. Each step is
/// walked in halves, since without the robot's inertia the limb is quicker.
pub fn driven(world: &World, force: &[Vec<f64>], from: &Mark, steps: usize) -> Vec<Vec<f64>> {
    let mut walk = Walk::new(world, from.clone(), steps);
    let mut motion = vec![Vec::with_capacity(steps); world.n];
    for k in from.step..from.step + steps {
        let apply = |_: &[f64], applied: &mut [f64]| applied.iter_mut().zip(force).for_each(|(a, f)| *a = f[k]);
        walk.step(0.5 / FINE_HZ, apply);
        motion.iter_mut().zip(&walk.now.x).for_each(|(m, x)| m.push(*x));
        // The second half belongs to the same step of time, and the past has whole steps only.
        walk.now.step = k;
        walk.step(0.5 / FINE_HZ, apply);
        walk.past.pop();
    }
    motion
}

/// An imposed motion and its derivatives on the fine grid.
pub struct Imposed {
    pub x: Vec<f64>,
    pub v: Vec<f64>,
    pub a: Vec<f64>,
}

/// A sum of sines up to 12 Hz, differentiated exactly.
pub fn sines(rng: &mut ChaCha8Rng, samples: usize, rms: f64) -> Imposed {
    let duration = samples as f64 / FS;
    let lines = (12.0 * duration) as usize;
    let tones: Vec<(f64, f64)> = (1..lines).map(|k| (1.0 / (1.0 + (k as f64 / duration / 3.0).powi(2)), rng.random_range(0.0..TAU))).collect();
    let size = (tones.iter().map(|t| t.0 * t.0 / 2.0).sum::<f64>()).sqrt();
    let spectrum: Vec<Complex64> = tones.iter().map(|(amplitude, phase)| Complex64::from_polar(0.5 * amplitude / size * rms, *phase)).collect();
    along(&spectrum, samples * SUB, duration)
}

/// A series and its derivatives from its lines 1/duration, 2/duration …
pub fn along(lines: &[Complex64], fine: usize, duration: f64) -> Imposed {
    let back = inverse_transform(fine);
    let series = |order: i32| -> Vec<f64> {
        let mut spectrum = vec![Complex64::ZERO; fine / 2 + 1];
        for (k, line) in lines.iter().enumerate() {
            spectrum[k + 1] = line * Complex64::new(0.0, TAU * (k + 1) as f64 / duration).powi(order);
        }
        signal_by(back.as_ref(), &mut spectrum)
    };
    Imposed { x: series(0), v: series(1), a: series(2) }
}

/// Torque that an imposed motion needs, on the fine grid.
pub fn torque(world: &World, path: &Imposed, own: &[f64], mass: f64) -> Vec<f64> {
    let h = 1.0 / FINE_HZ;
    let mut s = world.at_rest();
    let mut ds = vec![0.0; s.len()];
    let (mut acc, mut resist) = (vec![0.0], vec![0.0]);
    (0..path.x.len())
        .map(|k| {
            let t = k as f64 * h;
            let past = k.checked_sub(world.delay_steps).map_or((0.0, 0.0), |b| (path.x[b], path.v[b]));
            let (x, v) = (&path.x[k..=k], &path.v[k..=k]);
            let mut out = Rates { applied: &[0.0], a: &mut acc, ds: &mut ds, resist: &mut resist };
            world.rates(t, x, v, past, &s, &mut out);
            let (i, q) = (k / SUB, k % SUB);
            let w = own[i] + (own[i + 1] - own[i]) * q as f64 / SUB as f64;
            let torque = (mass + world.extra_mass(t, x)) * path.a[k] + resist[0] + w;
            s.iter_mut().zip(&ds).for_each(|(s, d)| *s += h * d);
            world.update(t, h, x, v, &mut s);
            torque
        })
        .collect()
}
