//! How the limb moves: explicit midpoint at 4 kHz under a discrete controller, or an imposed sum of sines.

use super::laws::World;
use super::{FS, SUB};
use ndof_signal::inverse_transform;
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

/// Force on the limb and motion, `[axis][time]` on the fine grid.
pub fn held(world: &World, command: &[Vec<f64>], own: &[Vec<f64>], robot: &Robot) -> (Vec<Vec<f64>>, Vec<Vec<f64>>) {
    let n = world.n;
    let samples = command[0].len();
    let fine = samples * SUB;
    let h = 1.0 / (FS * SUB as f64);
    let zero = vec![0.0; n];
    let (mut x, mut v, mut xm, mut vm) = (zero.clone(), zero.clone(), zero.clone(), zero.clone());
    let mut s = vec![0.0; 3 * world.laws.len()];
    let mut sm = s.clone();
    let (mut fs, mut xs) = (vec![Vec::with_capacity(fine); n], vec![Vec::with_capacity(fine); n]);
    let mut past: Vec<(f64, f64)> = Vec::with_capacity(fine);
    let (mut vf, mut vp, mut xp, mut drive) = (zero.clone(), zero.clone(), zero.clone(), zero.clone());
    let (mut a, mut a2, mut w, mut applied, mut resist) = (zero.clone(), zero.clone(), zero.clone(), zero.clone(), zero);
    let (mut d1, mut d2) = (s.clone(), s.clone());
    for k in 0..samples {
        for i in 0..n {
            let raw = (x[i] - xp[i]) * FS;
            vf[i] = 0.11216 * (raw + vp[i]) + 0.77568 * vf[i];
            vp[i] = raw;
            xp[i] = x[i];
            let (r, reference) = if robot.position { (0.0, command[i][k]) } else { (command[i][k], 0.0) };
            drive[i] = r + robot.kp[i] * (reference - x[i]) - robot.kd[i] * vf[i];
            if let Some(limit) = robot.limit {
                drive[i] = drive[i].clamp(-limit, limit);
            }
        }
        for q in 0..SUB {
            let t = (k * SUB + q) as f64 * h;
            past.push((x[world.axis], v[world.axis]));
            let back = past.len().checked_sub(1 + world.delay_steps).map_or((0.0, 0.0), |b| past[b]);
            for i in 0..n {
                w[i] = own[i][k] + (own[i][k + 1] - own[i][k]) * q as f64 / SUB as f64;
                applied[i] = drive[i] - robot.friction[i] * (v[i] / robot.smoothing).tanh() + w[i];
            }
            world.rates(t, &x, &v, back, &s, &applied, &mut a, &mut d1, &mut resist);
            for i in 0..n {
                xm[i] = x[i] + 0.5 * h * v[i];
                vm[i] = v[i] + 0.5 * h * a[i];
                applied[i] = drive[i] - robot.friction[i] * (vm[i] / robot.smoothing).tanh() + w[i];
            }
            sm.iter_mut().zip(&s).zip(&d1).for_each(|((m, s), d)| *m = s + 0.5 * h * d);
            world.rates(t + 0.5 * h, &xm, &vm, back, &sm, &applied, &mut a2, &mut d2, &mut resist);
            for i in 0..n {
                let inertial: f64 = (0..n).map(|j| robot.inertia[i][j] * a2[j]).sum();
                fs[i].push(applied[i] - w[i] - inertial);
                xs[i].push(xm[i]);
                x[i] += h * vm[i];
                v[i] += h * a2[i];
            }
            s.iter_mut().zip(&d2).for_each(|(s, d)| *s += h * d);
        }
    }
    (fs, xs)
}

/// Torque that an imposed angle needs, on the fine grid: a sum of sines up to 12 Hz, differentiated exactly.
pub fn imposed(rng: &mut ChaCha8Rng, world: &World, own: &[f64], samples: usize, rms: f64, mass: f64) -> (Vec<Vec<f64>>, Vec<Vec<f64>>) {
    let h = 1.0 / (FS * SUB as f64);
    let fine = samples * SUB;
    let duration = samples as f64 / FS;
    let lines = (12.0 * duration) as usize;
    let tones: Vec<(f64, f64)> = (1..lines).map(|k| (1.0 / (1.0 + (k as f64 / duration / 3.0).powi(2)), rng.random_range(0.0..TAU))).collect();
    let size = (tones.iter().map(|t| t.0 * t.0 / 2.0).sum::<f64>()).sqrt();
    let back = inverse_transform(fine);
    let series = |order: i32| -> Vec<f64> {
        let mut spectrum = vec![Complex64::ZERO; fine / 2 + 1];
        for (k, (amplitude, phase)) in tones.iter().enumerate() {
            let s = Complex64::new(0.0, TAU * (k + 1) as f64 / duration);
            spectrum[k + 1] = Complex64::from_polar(0.5 * amplitude / size * rms, *phase) * s.powi(order);
        }
        let mut out = back.make_output_vec();
        back.process(&mut spectrum, &mut out).expect("a spectrum of the right length");
        out
    };
    let (x, v, a) = (series(0), series(1), series(2));
    let mut s = vec![0.0; 3 * world.laws.len()];
    let mut ds = s.clone();
    let (mut acc, mut resist) = (vec![0.0], vec![0.0]);
    let mut torque = Vec::with_capacity(fine);
    for k in 0..fine {
        let past = k.checked_sub(world.delay_steps).map_or((0.0, 0.0), |b| (x[b], v[b]));
        world.rates(k as f64 * h, &x[k..=k], &v[k..=k], past, &s, &[0.0], &mut acc, &mut ds, &mut resist);
        let (i, q) = (k / SUB, k % SUB);
        let w = own[i] + (own[i + 1] - own[i]) * q as f64 / SUB as f64;
        torque.push(mass * a[k] + resist[0] + w);
        s.iter_mut().zip(&ds).for_each(|(s, d)| *s += h * d);
    }
    (vec![torque], vec![x])
}
