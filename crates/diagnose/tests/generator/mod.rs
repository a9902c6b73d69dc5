//! Recordings with something hidden in them, made by an integrator, a controller and sensors of their own.
//!
//! Nothing here comes from the crates under test: laws, integrator (explicit midpoint at 4 kHz), discrete controller with
//! filtered velocity, interval-averaging sensors, noise and quantisation are written again. With `other` the effects take functional forms
//! that the registry does not have.

#![allow(dead_code, clippy::needless_range_loop, clippy::type_complexity)]

use ndof_signal::{Channel, Quantity, Recording, Unit};
use ndof_sysid::Ports;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use std::f64::consts::{PI, TAU};

pub const FS: f64 = 500.0;
const SUB: usize = 8;

/// The experiment.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Plant {
    /// Two axes held by a robot.
    Planar,
    /// One axis, force imposed, nothing in the way.
    Force,
    /// A free mass under position control.
    Mass,
    /// One angle imposed, torque measured.
    Motion,
    /// Three angles held by a robot.
    Wrist,
}

impl Plant {
    pub fn axes(self) -> usize {
        match self {
            Plant::Planar => 2,
            Plant::Wrist => 3,
            _ => 1,
        }
    }
}

/// Something hidden.
#[derive(Clone, Debug)]
pub struct Hidden {
    pub name: &'static str,
    /// 1 is strong.
    pub severity: f64,
}

/// What to make.
#[derive(Clone, Debug)]
pub struct Case {
    pub plant: Plant,
    pub hidden: Vec<Hidden>,
    /// Functional forms that the registry does not have.
    pub other: bool,
    /// Small imperfections in every channel.
    pub background: bool,
    pub trials: usize,
    pub duration_s: f64,
    pub seed: u64,
}

/// What was made.
pub struct Made {
    pub recordings: Vec<Recording>,
    pub ports: Ports,
    /// Axis index of the hidden effects.
    pub axis: usize,
    /// True parameters, by hidden effect: (name, value).
    pub truth: Vec<Vec<(&'static str, f64)>>,
    pub mass: Vec<Vec<f64>>,
    pub stiffness: Vec<Vec<f64>>,
}

/// One law acting on one axis with up to three states.
#[derive(Clone, Default)]
struct Law {
    kind: &'static str,
    p: [f64; 6],
    from: usize,
}

#[derive(Clone)]
struct World {
    n: usize,
    axis: usize,
    m_inv: Vec<Vec<f64>>,
    b: Vec<Vec<f64>>,
    k: Vec<Vec<f64>>,
    laws: Vec<Law>,
    other: bool,
    delay_steps: usize,
    duration: f64,
    x_size: f64,
}

fn states_of(kind: &str) -> usize {
    match kind {
        "hysteresis" | "reflex" | "reflex-one" | "resonance" | "relaxation" => 3,
        _ => 0,
    }
}

impl World {
    /// Adds the law's resisting force and writes its rates.
    #[allow(clippy::too_many_arguments)]
    fn law(&self, law: &Law, t: f64, x: &[f64], v: &[f64], xd: f64, vd: f64, s: &[f64], force: &mut [f64], ds: &mut [f64]) {
        let (i, p) = (self.axis, &law.p);
        let (xa, va) = (x[i], v[i]);
        match law.kind {
            "friction" => {
                let level = if self.other { p[0] * (1.0 + 0.5 * (-(va / p[2]).abs()).exp()) / 1.2 } else { p[0] };
                force[i] += level * (va / p[1]).tanh();
            }
            "hysteresis" => {
                if self.other {
                    // Three slipping springs of unequal yields and weights.
                    for (q, (y, w)) in [(1.0, 1.0), (2.5, 0.5), (0.4, 1.0)].into_iter().enumerate() {
                        let y = y * p[1];
                        force[i] += p[0] * w * s[q] / 2.0;
                        ds[q] = if (s[q] > y && va > 0.0) || (s[q] < -y && va < 0.0) { 0.0 } else { va };
                    }
                } else {
                    force[i] += p[0] * s[0];
                    ds[0] = va - 0.5 / p[1] * (va.abs() * s[0] + va * s[0].abs());
                }
            }
            "cubic" => {
                let u = xa / self.x_size;
                force[i] += if self.other { p[0] * self.x_size.powi(3) * 1.6 * u * u.abs().powf(1.3) } else { p[0] * xa.powi(3) };
            }
            "square" => force[i] += if self.other { p[0] * self.x_size * 1.5 * xa.max(0.0) } else { p[0] * xa * xa },
            "gap" => {
                let k = self.k[i][i];
                force[i] -= if self.other { k * p[0] * (xa / p[0]).tanh() } else { k * xa.clamp(-p[0], p[0]) };
            }
            "stop" => {
                let over = xa - p[1];
                if over > 0.0 {
                    force[i] += if self.other { p[0] * over * (1.0 - (-over / (0.3 * self.x_size)).exp()) } else { p[0] * over };
                }
            }
            "reflex" => {
                let w = TAU * p[3];
                force[i] += s[0];
                ds[0] = s[1];
                ds[1] = w * w * (p[0] * xd + p[1] * vd - s[0]) - if self.other { 1.4 } else { 2.0 } * w * s[1];
            }
            "reflex-one" => {
                let w = TAU * p[3];
                let threshold = if self.other { p[4] } else { 0.0 };
                force[i] += s[0];
                ds[0] = s[1];
                ds[1] = w * w * (p[1] * (vd - threshold).max(0.0) - s[0]) - 2.0 * w * s[1];
            }
            "resonance" => {
                let w = TAU * p[1];
                let f = p[0] * (w * w * (xa - s[0]) + 2.0 * p[2] * w * (va - s[1]));
                force[i] += f;
                ds[0] = s[1];
                ds[1] = f / p[0];
            }
            "relaxation" => {
                force[i] += p[0] * (xa - s[0]);
                ds[0] = (xa - s[0]) / p[1];
                if self.other {
                    force[i] += 0.6 * p[0] * (xa - s[1]);
                    ds[1] = (xa - s[1]) / (6.0 * p[1]);
                }
            }
            "stiffness-drift" => force[i] += self.k[i][i] * p[0] * (t - self.duration / 2.0) * xa,
            "posture-drift" => force[i] -= self.k[i][i] * p[0] * (t - self.duration / 2.0),
            "quadratic-damping" => force[i] += p[0] * va * va.abs(),
            "van-der-pol" => force[i] += p[0] * va * xa * xa,
            "periodic-stiffness" => force[i] += p[0] * (TAU * p[1] * t).sin() * xa,
            "cogging" => force[i] += p[0] * (TAU * xa / p[1]).sin(),
            "product" => force[i] += p[0] * x[law.from] * xa,
            _ => {}
        }
    }

    /// Acceleration of each axis under an applied force.
    #[allow(clippy::too_many_arguments)]
    fn rates(&self, t: f64, x: &[f64], v: &[f64], xd: f64, vd: f64, s: &[f64], applied: &[f64], a: &mut [f64], ds: &mut [f64]) -> Vec<f64> {
        let n = self.n;
        let mut resist = vec![0.0; n];
        ds.fill(0.0);
        for (q, law) in self.laws.iter().enumerate() {
            self.law(law, t, x, v, xd, vd, &s[3 * q..3 * q + 3], &mut resist, &mut ds[3 * q..3 * q + 3]);
        }
        for i in 0..n {
            for j in 0..n {
                resist[i] += self.b[i][j] * v[j] + self.k[i][j] * x[j];
            }
        }
        for i in 0..n {
            a[i] = (0..n).map(|j| self.m_inv[i][j] * (applied[j] - resist[j])).sum();
        }
        resist
    }
}

fn invert(m: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let n = m.len();
    let mut a: Vec<Vec<f64>> = m.iter().enumerate().map(|(i, r)| r.iter().copied().chain((0..n).map(|j| f64::from(u8::from(i == j)))).collect()).collect();
    for c in 0..n {
        let p = a[c][c];
        a[c].iter_mut().for_each(|v| *v /= p);
        for r in 0..n {
            if r != c {
                let f = a[r][c];
                for k in 0..2 * n {
                    let u = a[c][k];
                    a[r][k] -= f * u;
                }
            }
        }
    }
    a.into_iter().map(|r| r[n..].to_vec()).collect()
}

/// Uniform noise through a cascade of second-order Butterworth sections, scaled to `rms`.
pub fn band_noise(rng: &mut ChaCha8Rng, n: usize, cutoff: f64, rms: f64, fs: f64, order: usize) -> Vec<f64> {
    let run_in = 2000;
    let mut x: Vec<f64> = (0..n + run_in).map(|_| rng.random_range(-1.0..1.0)).collect();
    let w = (PI * cutoff / fs).tan();
    for q in 0..order / 2 {
        let d = 2.0 * (PI * (2 * q + 1) as f64 / (2 * order) as f64).sin();
        let norm = 1.0 + d * w + w * w;
        let (g, a1, a2) = (w * w / norm, 2.0 * (w * w - 1.0) / norm, (1.0 - d * w + w * w) / norm);
        let (mut x1, mut x2, mut y1, mut y2) = (0.0, 0.0, 0.0, 0.0);
        for v in &mut x {
            let y = g * (*v + 2.0 * x1 + x2) - a1 * y1 - a2 * y2;
            (x2, x1, y2, y1) = (x1, *v, y1, y);
            *v = y;
        }
    }
    let x = &x[run_in..];
    let size = (x.iter().map(|v| v * v).sum::<f64>() / n as f64).sqrt();
    x.iter().map(|v| v / size * rms).collect()
}

fn average(fine: &[f64]) -> Vec<f64> {
    fine.chunks_exact(SUB).map(|c| c.iter().sum::<f64>() / SUB as f64).collect()
}

fn late(fine: &[f64], delay_s: f64) -> Vec<f64> {
    let steps = delay_s * FS * SUB as f64;
    let (whole, rest) = (steps.floor() as usize, steps.fract());
    (0..fine.len())
        .map(|k| {
            let at = |d: usize| fine[k.saturating_sub(d)];
            (1.0 - rest) * at(whole) + rest * at(whole + 1)
        })
        .collect()
}

fn smoothed(fine: &[f64], cutoff: f64) -> Vec<f64> {
    let a = 1.0 - (-TAU * cutoff / (FS * SUB as f64)).exp();
    let mut y = fine[0];
    fine.iter()
        .map(|x| {
            y += a * (x - y);
            y
        })
        .collect()
}

fn measured(rng: &mut ChaCha8Rng, x: &[f64], noise: f64, quantum: f64) -> Vec<f64> {
    x.iter()
        .map(|v| {
            let e: f64 = rng.sample(StandardNormal);
            ((v + noise * e) / quantum).round() * quantum
        })
        .collect()
}

/// Makes a case.
pub fn make(case: &Case) -> Made {
    let mut rng = ChaCha8Rng::seed_from_u64(case.seed);
    let n = case.plant.axes();
    let samples = (case.duration_s * FS) as usize;
    let axis = rng.random_range(0..n);
    let mut around = || {
        let e: f64 = rng.sample(StandardNormal);
        (0.1 * e).exp()
    };
    let scaled = |m: &[&[f64]], f: f64| -> Vec<Vec<f64>> { m.iter().map(|r| r.iter().map(|v| v * f).collect()).collect() };
    let (jm, jb, jk) = (around(), around(), around());
    let zero = vec![vec![0.0; n]; n];
    // mass, damping, stiffness, robot's mass, kp, kd, displacement and force rms
    let (m, b, k, robot, kp, kd, xs, fs_rms) = match case.plant {
        Plant::Planar => (
            scaled(&[&[2.1, -0.55], &[-0.55, 1.9]], jm),
            scaled(&[&[11.0, -2.0], &[-2.0, 15.0]], jb),
            scaled(&[&[300.0, -60.0], &[-60.0, 520.0]], jk),
            scaled(&[&[0.932, -0.305], &[-0.305, 1.05]], 1.0),
            100.0,
            5.0,
            4.5e-3,
            2.7,
        ),
        Plant::Wrist => (
            scaled(&[&[0.004, 0.0003, 0.0], &[0.0003, 0.0035, 0.0002], &[0.0, 0.0002, 0.003]], jm),
            scaled(&[&[0.03, 0.002, 0.0], &[0.002, 0.03, 0.001], &[0.0, 0.001, 0.02]], jb),
            scaled(&[&[1.5, 0.1, 0.05], &[0.1, 1.2, 0.0], &[0.05, 0.0, 0.9]], jk),
            scaled(&[&[0.004, 0.0, 0.0], &[0.0, 0.004, 0.0], &[0.0, 0.0, 0.003]], 1.0),
            1.0,
            0.01,
            0.04,
            0.09,
        ),
        Plant::Force => (scaled(&[&[2.0]], jm), scaled(&[&[12.0]], jb), scaled(&[&[400.0]], jk), zero.clone(), 0.0, 0.0, 8e-3, 4.0),
        Plant::Mass => (scaled(&[&[2.0]], jm), scaled(&[&[4.0]], jb), zero.clone(), zero.clone(), 300.0, 20.0, 2e-2, 5.0),
        Plant::Motion => (scaled(&[&[0.015]], jm), scaled(&[&[1.0]], jb), scaled(&[&[60.0]], jk), zero.clone(), 0.0, 0.0, 0.02, 1.5),
    };
    let (kx, mx, bx) = (if case.plant == Plant::Mass { 300.0 } else { k[axis][axis] }, m[axis][axis], b[axis][axis]);
    let mut limb_noise = if case.plant == Plant::Planar {
        if rng.random_range(0.0..1.0) < 0.5 { rng.random_range(0.01..0.15) } else { rng.random_range(0.15..0.5) }
    } else {
        rng.random_range(0.02..0.06) * fs_rms / 4.0
    };
    let mut force_delay = 0.0;
    let mut force_cutoff = None;
    let mut series = None;
    let mut angle: f64 = 0.0;
    let mut tremor = (0.0, 0.0);
    let mut delay = 0.0;
    let mut laws = Vec::new();
    let mut truth = Vec::new();
    let mut robot_friction = if n > 1 { rng.random_range(0.02..0.12) * fs_rms } else { 0.0 };
    let speed = xs * 12.0;
    let mut extra_mass = 0.0;
    for hidden in &case.hidden {
        let s = hidden.severity;
        let mut law = Law::default();
        let mut own: Vec<(&'static str, f64)> = Vec::new();
        match hidden.name {
            "coulomb-friction" => {
                law = Law { kind: "friction", p: [s * 0.5 * fs_rms, 0.004 * speed, 0.15 * speed, 0.0, 0.0, 0.0], from: 0 };
                own.push(("level", law.p[0]));
            }
            "hysteresis" => {
                law = Law { kind: "hysteresis", p: [s * 1.2 * kx, rng.random_range(0.3..0.8) * xs, 0.0, 0.0, 0.0, 0.0], from: 0 };
                own.push(("stiffness", law.p[0]));
                own.push(("yield", law.p[1]));
            }
            "cubic-stiffness" => {
                let sign = if rng.random_range(0.0..1.0) < 0.6 || s > 0.06 { 1.0 } else { -1.0 };
                law = Law { kind: "cubic", p: [sign * s * 0.8 * kx / (3.0 * xs * xs), 0.0, 0.0, 0.0, 0.0, 0.0], from: 0 };
                own.push(("k3", law.p[0]));
            }
            "asymmetric-stiffness" => {
                law = Law { kind: "square", p: [s * 0.4 * kx / xs, 0.0, 0.0, 0.0, 0.0, 0.0], from: 0 };
                own.push(("k2", law.p[0]));
            }
            "dead-zone" => {
                law = Law { kind: "gap", p: [s * 0.9 * xs, 0.0, 0.0, 0.0, 0.0, 0.0], from: 0 };
                own.push(("half_gap", law.p[0]));
            }
            "end-stop" => {
                law = Law { kind: "stop", p: [s * 3.0 * kx, rng.random_range(0.8..1.4) * xs, 0.0, 0.0, 0.0, 0.0], from: 0 };
                own.push(("stiffness", law.p[0]));
                own.push(("position", law.p[1]));
            }
            "reflex-delay" => {
                delay = rng.random_range(0.03..0.06);
                law = Law { kind: "reflex", p: [s * 0.5 * kx, s * 0.5 * bx, 0.0, rng.random_range(2.0..4.0), 0.0, 0.0], from: 0 };
                own.push(("delay", delay));
            }
            "reflex-one" => {
                delay = rng.random_range(0.03..0.06);
                law = Law { kind: "reflex-one", p: [0.0, s * 3.0 * bx, 0.0, rng.random_range(2.5..5.0), 0.15 * speed, 0.0], from: 0 };
                own.push(("delay", delay));
            }
            "extra-resonance" => {
                law = Law { kind: "resonance", p: [s * 0.4 * mx, rng.random_range(4.0..8.0), rng.random_range(0.03..0.1), 0.0, 0.0, 0.0], from: 0 };
                own.push(("frequency", law.p[1]));
            }
            "viscoelastic" => {
                law = Law { kind: "relaxation", p: [s * kx, rng.random_range(0.08..0.3), 0.0, 0.0, 0.0, 0.0], from: 0 };
                own.push(("modulus", law.p[0]));
            }
            "stiffness-drift" => {
                law = Law { kind: "stiffness-drift", p: [s * 0.8 / case.duration_s, 0.0, 0.0, 0.0, 0.0, 0.0], from: 0 };
                own.push(("fraction_per_s", law.p[0]));
            }
            "posture-drift" => {
                law = Law { kind: "posture-drift", p: [s * 4.0 * xs / case.duration_s, 0.0, 0.0, 0.0, 0.0, 0.0], from: 0 };
                own.push(("rate", law.p[0]));
            }
            "measurement-delay" => {
                force_delay += s * 0.012;
                own.push(("delay", s * 0.012));
            }
            "channel-filter" => {
                force_cutoff = Some(12.0 / s);
                own.push(("cutoff", 12.0 / s));
            }
            "series-compliance" => series = Some(kx * 40.0 * 0.5 / s),
            "sensor-misalignment" => {
                angle = (15.0 * s).to_radians() * if rng.random_range(0.0..1.0) < 0.5 { 1.0 } else { -1.0 };
                own.push(("angle", angle));
            }
            "periodic-disturbance" => {
                tremor = (s * 0.6 * fs_rms, rng.random_range(4.0..10.0));
                own.push(("frequency", tremor.1));
            }
            "limb-noise" => limb_noise = s * 0.3 * fs_rms,
            "robot-friction" => robot_friction = s * 0.5 * fs_rms,
            "added-mass" => extra_mass = s * 0.3 * mx,
            "x-quadratic-damping" => law = Law { kind: "quadratic-damping", p: [s * 2.5 * bx / speed, 0.0, 0.0, 0.0, 0.0, 0.0], from: 0 },
            "x-van-der-pol" => law = Law { kind: "van-der-pol", p: [s * 3.0 * bx / (xs * xs), 0.0, 0.0, 0.0, 0.0, 0.0], from: 0 },
            "x-periodic-stiffness" => law = Law { kind: "periodic-stiffness", p: [s * 0.6 * kx, rng.random_range(0.4..1.2), 0.0, 0.0, 0.0, 0.0], from: 0 },
            "x-cogging" => law = Law { kind: "cogging", p: [s * 0.5 * fs_rms, rng.random_range(0.8..1.5) * xs, 0.0, 0.0, 0.0, 0.0], from: 0 },
            "x-product" => law = Law { kind: "product", p: [s * kx / xs, 0.0, 0.0, 0.0, 0.0, 0.0], from: (axis + 1) % n },
            other => panic!("the generator does not know {other}"),
        }
        if !law.kind.is_empty() {
            laws.push(law);
        }
        truth.push(own);
    }
    if case.background {
        laws.push(Law { kind: "van-der-pol", p: [rng.random_range(0.0..0.04) * bx / (xs * xs), 0.0, 0.0, 0.0, 0.0, 0.0], from: 0 });
        laws.push(Law { kind: "cubic", p: [rng.random_range(-0.5..1.0) * 0.01 * kx / (3.0 * xs * xs), 0.0, 0.0, 0.0, 0.0, 0.0], from: 0 });
        force_delay += rng.random_range(0.0..2e-4);
    }
    let mut limb = m.clone();
    for (i, row) in limb.iter_mut().enumerate() {
        row[i] += extra_mass;
    }
    let total: Vec<Vec<f64>> = limb.iter().zip(&robot).map(|(a, b)| a.iter().zip(b).map(|(a, b)| a + b).collect()).collect();
    let step = 1.0 / (FS * SUB as f64);
    let world = World {
        n,
        axis,
        m_inv: invert(&total),
        b,
        k: k.clone(),
        laws,
        other: case.other,
        delay_steps: (delay / step).round() as usize,
        duration: case.duration_s,
        x_size: xs,
    };
    let rotational = matches!(case.plant, Plant::Motion | Plant::Wrist);
    let names: &[&str] = match case.plant {
        Plant::Wrist => &["flexion", "deviation", "pronation"],
        _ => &["x", "y"],
    };
    let recordings = (0..case.trials)
        .map(|_| {
            let fine = samples * SUB;
            let mut own: Vec<Vec<f64>> = (0..n).map(|_| band_noise(&mut rng, samples + 1, 2.0, limb_noise, FS, 2)).collect();
            if tremor.0 > 0.0 {
                let mut phase: f64 = rng.random_range(0.0..6.0);
                for k in 0..=samples {
                    let e: f64 = rng.sample(StandardNormal);
                    phase += TAU * tremor.1 / FS + 0.01 * e;
                    for (i, w) in own.iter_mut().enumerate() {
                        w[k] += tremor.0 * phase.sin() * if i == axis { 1.0 } else { 0.3 };
                    }
                }
            }
            let (force, motion, command) = if case.plant == Plant::Motion {
                imposed(&mut rng, &world, &own[0], samples, xs, limb[0][0])
            } else {
                let command: Vec<Vec<f64>> = (0..n)
                    .map(|_| match case.plant {
                        Plant::Mass => band_noise(&mut rng, samples, 2.0, xs, FS, 4),
                        Plant::Force => band_noise(&mut rng, samples, 12.0, 4.0, FS, 8),
                        Plant::Wrist => band_noise(&mut rng, samples, 15.0, 0.13, FS, 8),
                        _ => band_noise(&mut rng, samples, 15.0, 4.0, FS, 8),
                    })
                    .collect();
                let (f, x) = held(&world, &command, &own, &robot, (kp, kd), robot_friction, 0.004 * speed, case.plant == Plant::Mass);
                (f, x, command)
            };
            let mut f: Vec<Vec<f64>> = force
                .iter()
                .map(|f| {
                    let f = force_cutoff.map_or_else(|| f.clone(), |c| smoothed(f, c));
                    average(&late(&f, force_delay))
                })
                .collect();
            let mut d: Vec<Vec<f64>> = motion.iter().map(|x| average(x)).collect();
            if let Some(k) = series {
                for (d, f) in d.iter_mut().zip(&force) {
                    d.iter_mut().zip(average(f)).for_each(|(d, f)| *d += f / k);
                }
            }
            if angle != 0.0 && n >= 2 {
                let (s, c) = angle.sin_cos();
                for k in 0..samples {
                    let (a, b) = (f[0][k], f[1][k]);
                    f[0][k] = c * a - s * b;
                    f[1][k] = s * a + c * b;
                }
            }
            let (fq, dq) = match case.plant {
                Plant::Motion => (0.005, 2e-5),
                Plant::Wrist => (6e-4, 1e-4),
                Plant::Mass => (0.025, 2e-5),
                _ => (0.025, 5e-5),
            };
            let fnoise = if n == 3 {
                8e-4
            } else if case.plant == Plant::Motion {
                0.015
            } else {
                0.03
            };
            let mut channels = Vec::new();
            let unit = |q| Unit::si(q, rotational);
            let effort_word = if rotational { "torque" } else { "force" };
            let motion_word = if rotational { "angle" } else { "pos" };
            for i in 0..n {
                let f = measured(&mut rng, &f[i][..samples], fnoise, fq);
                let d = measured(&mut rng, &d[i][..samples], dq / 4.0, dq);
                channels.push(Channel::new(format!("{effort_word}_{}", names[i]), unit(Quantity::Effort), f));
                channels.push(Channel::new(format!("{motion_word}_{}", names[i]), unit(Quantity::Displacement), d));
                if case.plant != Plant::Motion {
                    let (quantity, samples) = if case.plant == Plant::Mass { (Quantity::Displacement, &command[i]) } else { (Quantity::Effort, &command[i]) };
                    channels.push(Channel::new(format!("cmd_{}", names[i]), unit(quantity), samples.clone()));
                }
            }
            debug_assert_eq!(fine, samples * SUB);
            Recording::new(FS, channels).expect("channels of one length")
        })
        .collect();
    let stride = if case.plant == Plant::Motion { 2 } else { 3 };
    let at = |o: usize| -> Vec<usize> { (0..n).map(|i| i * stride + o).collect() };
    let ports = if case.plant == Plant::Motion {
        Ports { references: vec![], inputs: at(1), outputs: at(0) }
    } else {
        Ports { references: at(2), inputs: at(0), outputs: at(1) }
    };
    Made { recordings, ports, axis, truth, mass: m, stiffness: k }
}

/// Force applied to the limb and motion, on the fine grid.
#[allow(clippy::too_many_arguments)]
fn held(
    world: &World,
    command: &[Vec<f64>],
    own: &[Vec<f64>],
    robot: &[Vec<f64>],
    (kp, kd): (f64, f64),
    robot_friction: f64,
    eps: f64,
    position: bool,
) -> (Vec<Vec<f64>>, Vec<Vec<f64>>) {
    let n = world.n;
    let samples = command[0].len();
    let fine = samples * SUB;
    let h = 1.0 / (FS * SUB as f64);
    let (mut x, mut v) = (vec![0.0; n], vec![0.0; n]);
    let mut s = vec![0.0; 3 * world.laws.len()];
    let (mut fs, mut xs) = (vec![Vec::with_capacity(fine); n], vec![Vec::with_capacity(fine); n]);
    let mut past: Vec<(f64, f64)> = Vec::with_capacity(fine);
    let (mut vf, mut vp, mut xp) = (vec![0.0; n], vec![0.0; n], vec![0.0; n]);
    let mut drive = vec![0.0; n];
    let (mut a, mut a2) = (vec![0.0; n], vec![0.0; n]);
    let (mut d1, mut d2) = (s.clone(), s.clone());
    for k in 0..samples {
        for i in 0..n {
            let raw = (x[i] - xp[i]) * FS;
            vf[i] = 0.11216 * (raw + vp[i]) + 0.77568 * vf[i];
            vp[i] = raw;
            xp[i] = x[i];
            let (r, reference) = if position { (0.0, command[i][k]) } else { (command[i][k], 0.0) };
            drive[i] = r + kp * (reference - x[i]) - kd * vf[i];
        }
        for q in 0..SUB {
            let t = (k * SUB + q) as f64 * h;
            past.push((x[world.axis], v[world.axis]));
            let back = past.len().checked_sub(1 + world.delay_steps).map_or((0.0, 0.0), |b| past[b]);
            let w: Vec<f64> = own.iter().map(|w| w[k] + (w[k + 1] - w[k]) * q as f64 / SUB as f64).collect();
            let friction = |v: &[f64]| -> Vec<f64> { v.iter().map(|v| robot_friction * (v / eps).tanh()).collect() };
            let applied = |v: &[f64]| -> Vec<f64> { friction(v).iter().enumerate().map(|(i, f)| drive[i] - f + w[i]).collect() };
            world.rates(t, &x, &v, back.0, back.1, &s, &applied(&v), &mut a, &mut d1);
            let xm: Vec<f64> = x.iter().zip(&v).map(|(x, v)| x + 0.5 * h * v).collect();
            let vm: Vec<f64> = v.iter().zip(&a).map(|(v, a)| v + 0.5 * h * a).collect();
            let sm: Vec<f64> = s.iter().zip(&d1).map(|(s, d)| s + 0.5 * h * d).collect();
            let fm = applied(&vm);
            world.rates(t + 0.5 * h, &xm, &vm, back.0, back.1, &sm, &fm, &mut a2, &mut d2);
            for i in 0..n {
                let inertial: f64 = (0..n).map(|j| robot[i][j] * a2[j]).sum();
                fs[i].push(fm[i] - w[i] - inertial);
                xs[i].push(xm[i]);
            }
            for i in 0..n {
                x[i] += h * vm[i];
                v[i] += h * a2[i];
            }
            s.iter_mut().zip(&d2).for_each(|(s, d)| *s += h * d);
        }
    }
    (fs, xs)
}

/// Torque that an imposed angle needs, on the fine grid.
fn imposed(rng: &mut ChaCha8Rng, world: &World, own: &[f64], samples: usize, rms: f64, mass: f64) -> (Vec<Vec<f64>>, Vec<Vec<f64>>, Vec<Vec<f64>>) {
    let fs = FS * SUB as f64;
    let h = 1.0 / fs;
    let fine = samples * SUB;
    // A sum of sines is differentiated exactly.
    let duration = samples as f64 / FS;
    let lines = (12.0 * duration) as usize;
    let tones: Vec<(f64, f64, f64)> = (1..lines)
        .map(|k| {
            let f = k as f64 / duration;
            (f, 1.0 / (1.0 + (f / 3.0).powi(2)), rng.random_range(0.0..TAU))
        })
        .collect();
    let size = (tones.iter().map(|t| t.1 * t.1 / 2.0).sum::<f64>()).sqrt();
    let (mut x, mut v, mut a) = (vec![0.0; fine], vec![0.0; fine], vec![0.0; fine]);
    for (f, amplitude, phase) in tones {
        let (w, c) = (TAU * f, amplitude / size * rms);
        let (step_s, step_c) = (w * h).sin_cos();
        let (mut sin, mut cos) = phase.sin_cos();
        for k in 0..fine {
            x[k] += c * sin;
            v[k] += c * w * cos;
            a[k] -= c * w * w * sin;
            (sin, cos) = (sin * step_c + cos * step_s, cos * step_c - sin * step_s);
        }
    }
    let mut s = vec![0.0; 3 * world.laws.len()];
    let mut ds = s.clone();
    let mut acc = vec![0.0];
    let mut torque = Vec::with_capacity(fine);
    for k in 0..fine {
        let back = k.checked_sub(world.delay_steps).map_or((0.0, 0.0), |b| (x[b], v[b]));
        let resist = world.rates(k as f64 * h, &x[k..=k], &v[k..=k], back.0, back.1, &s, &[0.0], &mut acc, &mut ds);
        let (i, q) = (k / SUB, k % SUB);
        let w = own[i] + (own[i + 1] - own[i]) * q as f64 / SUB as f64;
        torque.push(mass * a[k] + resist[0] + w);
        s.iter_mut().zip(&ds).for_each(|(s, d)| *s += h * d);
    }
    (vec![torque], vec![x], vec![])
}
