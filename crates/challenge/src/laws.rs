//! Force laws of the generator, written again: nothing of the crates under test.

#![allow(clippy::needless_range_loop)]

use std::f64::consts::TAU;

/// One law acting on one axis with up to three states.
#[derive(Clone, Default)]
pub struct Law {
    pub kind: &'static str,
    pub p: [f64; 6],
    /// The axis that a product takes its other factor from.
    pub from: usize,
}

/// The limb with everything that is hidden in it.
#[derive(Clone)]
pub struct World {
    pub n: usize,
    pub axis: usize,
    pub m_inv: Vec<Vec<f64>>,
    pub b: Vec<Vec<f64>>,
    pub k: Vec<Vec<f64>>,
    pub laws: Vec<Law>,
    pub other: bool,
    pub delay_steps: usize,
    pub duration: f64,
    pub x_size: f64,
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
                if self.other && p[2] > 0.5 {
                    // Dahl's law with the square of the force.
                    force[i] += p[0] * s[0];
                    ds[0] = va - va.abs() * s[0] * s[0].abs() / (p[1] * p[1]);
                } else if self.other {
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
            "square" => {
                let u = xa / self.x_size;
                force[i] += if self.other { p[0] * self.x_size.powi(2) * 1.2 * u.abs().powf(1.5) } else { p[0] * xa * xa };
            }
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
                let stretch = xa - s[0];
                let hard = if self.other { 1.0 + (4.0 * stretch / self.x_size).powi(2).min(2.0) } else { 1.0 };
                let f = p[0] * (w * w * stretch * hard + 2.0 * p[2] * w * (va - s[1]));
                force[i] += f;
                ds[0] = s[1];
                ds[1] = f / p[0];
            }
            "relaxation" => {
                force[i] += p[0] * (xa - s[0]);
                ds[0] = (xa - s[0]) / p[1];
                if self.other {
                    force[i] += 0.6 * p[0] * (xa - s[1]) + 0.5 * p[0] * (xa - s[2]);
                    ds[1] = (xa - s[1]) / (5.0 * p[1]);
                    ds[2] = (xa - s[2]) / (0.3 * p[1]);
                }
            }
            "stiffness-drift" => force[i] += self.k[i][i] * p[0] * self.course(t) * xa,
            "posture-drift" => force[i] -= self.k[i][i] * p[0] * self.course(t),
            "quadratic-damping" => force[i] += p[0] * va * va.abs(),
            "van-der-pol" => force[i] += p[0] * va * xa * xa,
            "periodic-stiffness" => force[i] += p[0] * (TAU * p[1] * t).sin() * xa,
            "cogging" => force[i] += p[0] * (TAU * xa / p[1]).sin(),
            "knock" => force[i] -= if (0.0..p[2]).contains(&(t - p[1])) { p[0] * (std::f64::consts::PI * (t - p[1]) / p[2]).sin() } else { 0.0 },
            "product" => force[i] += p[0] * x[law.from] * xa,
            _ => {}
        }
    }

    /// Time since the middle of the trial; in the other form a change that settles.
    fn course(&self, t: f64) -> f64 {
        if self.other { self.duration * (0.6 - 1.0 * (-t / (0.4 * self.duration)).exp()) } else { t - self.duration / 2.0 }
    }

    /// Acceleration of each axis under an applied force; the limb's resistance goes to `resist`.
    #[allow(clippy::too_many_arguments)]
    pub fn rates(&self, t: f64, x: &[f64], v: &[f64], (xd, vd): (f64, f64), s: &[f64], applied: &[f64], a: &mut [f64], ds: &mut [f64], resist: &mut [f64]) {
        let n = self.n;
        resist.fill(0.0);
        ds.fill(0.0);
        for (q, law) in self.laws.iter().enumerate() {
            self.law(law, t, x, v, xd, vd, &s[3 * q..3 * q + 3], resist, &mut ds[3 * q..3 * q + 3]);
        }
        for i in 0..n {
            for j in 0..n {
                resist[i] += self.b[i][j] * v[j] + self.k[i][j] * x[j];
            }
        }
        for i in 0..n {
            a[i] = (0..n).map(|j| self.m_inv[i][j] * (applied[j] - resist[j])).sum();
        }
    }
}

/// Inverse of a small matrix.
pub fn invert(m: &[Vec<f64>]) -> Vec<Vec<f64>> {
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
