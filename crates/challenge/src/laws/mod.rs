//! Force laws of the generator, written again: nothing of the crates under test.

mod law;
mod other;
mod outside;
mod registry;

pub use law::{Law, Now, STATES, World};
pub use other::course;

use std::ops::{Div, Mul, SubAssign};

/// Applied force, and where the answer goes: accelerations, rates of the laws' states, the limb's resistance.
pub struct Rates<'a> {
    pub applied: &'a [f64],
    pub a: &'a mut [f64],
    pub ds: &'a mut [f64],
    pub resist: &'a mut [f64],
}

impl World {
    /// States as they are when a trial begins.
    pub fn at_rest(&self) -> Vec<f64> {
        self.laws.iter().flat_map(outside::start).collect()
    }

    fn now<'a>(&self, t: f64, x: &'a [f64], v: &[f64], back: (f64, f64)) -> Now<'a> {
        Now { t, x: x[self.axis], v: v[self.axis], back, all: x }
    }

    /// Acceleration of each axis under an applied force; the limb's resistance without inertia goes to `resist`.
    pub fn rates(&self, t: f64, x: &[f64], v: &[f64], back: (f64, f64), s: &[f64], out: &mut Rates) {
        let (n, i) = (self.n, self.axis);
        let now = self.now(t, x, v, back);
        out.resist.fill(0.0);
        out.ds.fill(0.0);
        for (law, (s, ds)) in self.laws.iter().zip(s.chunks(STATES).zip(out.ds.chunks_mut(STATES))) {
            out.resist[i] += match law.kind {
                outside if outside.starts_with("x-") => outside::force(self, law, now, s, ds),
                _ if law.form.is_empty() => registry::force(self, law, now, s, ds),
                _ => other::force(self, law, now, s, ds),
            };
        }
        for ((resist, b), k) in out.resist.iter_mut().zip(&self.b).zip(&self.k) {
            *resist += (0..n).map(|j| b[j] * v[j] + k[j] * x[j]).sum::<f64>();
        }
        for (a, row) in out.a.iter_mut().zip(&self.m_inv) {
            *a = (0..n).map(|j| row[j] * (out.applied[j] - out.resist[j])).sum();
        }
        // A mass of the law itself on the axis: (M + m e eᵀ)⁻¹ by Sherman and Morrison.
        let mass = self.extra_mass(t, x);
        if mass > 0.0 {
            let share = mass * out.a[i] / (1.0 + mass * self.m_inv[i][i]);
            out.a.iter_mut().zip(&self.m_inv).for_each(|(a, row)| *a -= share * row[i]);
        }
    }

    /// Inertia that laws add on the axis.
    pub fn extra_mass(&self, t: f64, x: &[f64]) -> f64 {
        self.laws.iter().map(|law| outside::mass(self, law, t, x[self.axis])).sum()
    }

    /// What happens at the end of a step of the integrator: switches, latches, resets.
    pub fn update(&self, t: f64, h: f64, x: &[f64], v: &[f64], s: &mut [f64]) {
        let now = self.now(t, x, v, (0.0, 0.0));
        for (law, s) in self.laws.iter().zip(s.chunks_mut(STATES)) {
            if law.kind.starts_with("x-") { outside::update(self, law, now, h, s) } else { other::update(self, law, now, s) }
        }
    }

    /// Whether a schedule is on at a time of this trial, and for how long it has been so.
    fn switched(&self, law: &Law, t: f64) -> (bool, f64) {
        let t = t + self.trial as f64 * self.duration;
        let past = law.schedule.partition_point(|at| *at <= t);
        let since = past.checked_sub(1).map_or(f64::INFINITY, |last| t - law.schedule[last]);
        (past % 2 == 1, since)
    }
}

/// A⁻¹ B of rows [A B], by Gauss and Jordan without a search for pivots.
pub fn eliminated<T: Copy + Div<Output = T> + Mul<Output = T> + SubAssign>(mut a: Vec<Vec<T>>) -> Vec<Vec<T>> {
    let n = a.len();
    for c in 0..n {
        let pivot: Vec<T> = a[c].iter().map(|v| *v / a[c][c]).collect();
        for row in &mut a {
            let w = row[c];
            row.iter_mut().zip(&pivot).for_each(|(v, p)| *v -= w * *p);
        }
        a[c] = pivot;
    }
    a.into_iter().map(|row| row[n..].to_vec()).collect()
}

/// Inverse of a small matrix.
pub fn invert(m: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let one = |i: usize| (0..m.len()).map(move |j| f64::from(u8::from(i == j)));
    eliminated(m.iter().enumerate().map(|(i, row)| row.iter().copied().chain(one(i)).collect()).collect())
}
