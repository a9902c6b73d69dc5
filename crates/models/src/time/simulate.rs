//! Fourth-order Runge-Kutta steps with the exact derivatives of those steps.

use super::Mechanism;
use faer::Mat;
use faer::linalg::solvers::DenseSolveCore;

/// A mechanism with numbers, ready to run.
pub(crate) struct Runner<'a> {
    mechanism: &'a Mechanism,
    entries: Vec<(usize, usize)>,
    parameters: usize,
    n: usize,
    inverse: Vec<f64>,
    damping: Vec<f64>,
    stiffness: Vec<f64>,
    coulomb: Vec<f64>,
    offset: Vec<f64>,
}

/// State and its derivatives in parameters and initial state, (2 n) × (1 + columns).
type Block = Vec<f64>;

impl<'a> Runner<'a> {
    pub(crate) fn new(mechanism: &'a Mechanism, theta: &[f64]) -> Self {
        let n = mechanism.axes.len();
        let entries = mechanism.entries();
        let per = entries.len();
        let matrix = |k: usize| {
            let mut out = vec![0.0; n * n];
            for (&(i, j), v) in entries.iter().zip(&theta[k * per..]) {
                out[i * n + j] = *v;
                out[j * n + i] = *v;
            }
            out
        };
        let mass = matrix(0);
        let inverse = Mat::from_fn(n, n, |i, j| mass[i * n + j]).partial_piv_lu().inverse();
        let mut rest = theta[mechanism.matrices() * per..].iter().copied();
        let mut take = |used: bool| -> Vec<f64> { (0..n).map(|_| if used { rest.next().unwrap_or(0.0) } else { 0.0 }).collect() };
        let (coulomb, offset) = (take(mechanism.coulomb), take(mechanism.offset));
        Runner {
            mechanism,
            parameters: theta.len(),
            n,
            inverse: (0..n * n).map(|e| inverse[(e / n, e % n)]).collect(),
            damping: matrix(1),
            stiffness: if mechanism.spring { matrix(2) } else { vec![0.0; n * n] },
            coulomb,
            offset,
            entries,
        }
    }

    /// Runs from `initial` (positions, then velocities) under the force samples of each axis, linear between them, and
    /// hands every sample's positions with their derivatives to `sink`: n × (1 + columns), columns being the parameters
    /// and the initial state, or none.
    pub(crate) fn run(&self, initial: &[f64], force: &[&[f64]], step_s: f64, derivatives: bool, mut sink: impl FnMut(&[f64])) {
        let n = self.n;
        let width = 1 + if derivatives { self.parameters + 2 * n } else { 0 };
        let mut state: Block = vec![0.0; 2 * n * width];
        for i in 0..2 * n {
            state[i * width] = initial[i];
            if derivatives {
                state[i * width + 1 + self.parameters + i] = 1.0;
            }
        }
        let samples = force.first().map_or(0, |f| f.len());
        let (mut k1, mut k2, mut k3, mut k4, mut at) = (state.clone(), state.clone(), state.clone(), state.clone(), state.clone());
        let mut push = vec![0.0; n];
        for sample in 0..samples {
            sink(&state[..n * width]);
            if sample + 1 == samples {
                break;
            }
            let set = |push: &mut Vec<f64>, part: f64| push.iter_mut().zip(force).for_each(|(p, f)| *p = f[sample] + part * (f[sample + 1] - f[sample]));
            let moved = |at: &mut Block, k: &Block, by: f64| at.iter_mut().zip(&state).zip(k).for_each(|((a, s), k)| *a = s + by * k);
            set(&mut push, 0.0);
            self.rate(&state, &push, width, &mut k1);
            set(&mut push, 0.5);
            moved(&mut at, &k1, 0.5 * step_s);
            self.rate(&at, &push, width, &mut k2);
            moved(&mut at, &k2, 0.5 * step_s);
            self.rate(&at, &push, width, &mut k3);
            set(&mut push, 1.0);
            moved(&mut at, &k3, step_s);
            self.rate(&at, &push, width, &mut k4);
            for (e, s) in state.iter_mut().enumerate() {
                *s += step_s / 6.0 * (k1[e] + 2.0 * k2[e] + 2.0 * k3[e] + k4[e]);
            }
        }
    }

    /// d/dt of state and derivatives.
    fn rate(&self, state: &Block, force: &[f64], width: usize, out: &mut Block) {
        let n = self.n;
        let (position, velocity) = (|i: usize| state[i * width], |i: usize| state[(n + i) * width]);
        let friction: Vec<(f64, f64)> = (0..n)
            .map(|i| {
                let t = (velocity(i) / self.mechanism.stick_velocity).tanh();
                (t, (1.0 - t * t) / self.mechanism.stick_velocity)
            })
            .collect();
        let (top, bottom) = out.split_at_mut(n * width);
        top.copy_from_slice(&state[n * width..]);
        // First what acts on the masses, then M⁻¹ of it, column by column.
        let mut acting = vec![0.0; n * width];
        for i in 0..n {
            let row = &mut acting[i * width..(i + 1) * width];
            row[0] = force[i] - self.coulomb[i] * friction[i].0 - self.offset[i];
            for j in 0..n {
                let (b, k) = (self.damping[i * n + j], self.stiffness[i * n + j]);
                let slope = b + if i == j { self.coulomb[i] * friction[i].1 } else { 0.0 };
                row[0] -= b * velocity(j) + k * position(j);
                for c in 1..width {
                    row[c] -= slope * state[(n + j) * width + c] + k * state[j * width + c];
                }
            }
        }
        let acceleration: Vec<f64> = (0..n).map(|i| (0..n).map(|j| self.inverse[i * n + j] * acting[j * width]).sum()).collect();
        if width > 1 {
            let per = self.entries.len();
            for matrix in 0..self.mechanism.matrices() {
                for (e, &(i, j)) in self.entries.iter().enumerate() {
                    let column = 1 + matrix * per + e;
                    let factor = |axis: usize| match matrix {
                        0 => acceleration[axis],
                        1 => velocity(axis),
                        _ => position(axis),
                    };
                    acting[i * width + column] -= factor(j);
                    if i != j {
                        acting[j * width + column] -= factor(i);
                    }
                }
            }
            let mut column = 1 + self.mechanism.matrices() * per;
            for used in [self.mechanism.coulomb, self.mechanism.offset].iter().enumerate().filter(|(_, used)| **used).map(|(k, _)| k) {
                for i in 0..n {
                    acting[i * width + column] -= if used == 0 { friction[i].0 } else { 1.0 };
                    column += 1;
                }
            }
        }
        for i in 0..n {
            for c in 0..width {
                bottom[i * width + c] = (0..n).map(|j| self.inverse[i * n + j] * acting[j * width + c]).sum();
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Axis;

    #[test]
    fn derivatives_are_those_of_the_discrete_run() {
        let mechanism = Mechanism { axes: vec![Axis::linear("x"), Axis::linear("y")], spring: true, coulomb: true, offset: true, stick_velocity: 0.05 };
        let theta = [2.1, -0.5, 1.9, 11.0, -2.0, 15.0, 300.0, -60.0, 520.0, 0.4, 0.3, 0.2, -0.1];
        assert_eq!(mechanism.parameters().len(), theta.len());
        let force: Vec<Vec<f64>> = (0..2).map(|a| (0..200).map(|k| (0.1 * f64::from(k) * (1.0 + f64::from(a))).sin() * 4.0).collect()).collect();
        let force: Vec<&[f64]> = force.iter().map(Vec::as_slice).collect();
        let initial = [0.001, -0.002, 0.05, 0.02];
        let last = |theta: &[f64], initial: &[f64], derivatives: bool| {
            let mut out = Vec::new();
            Runner::new(&mechanism, theta).run(initial, &force, 0.005, derivatives, |block| out = block.to_vec());
            out
        };
        let exact = last(&theta, &initial, true);
        let width = exact.len() / 2;
        assert_eq!(width, 1 + 13 + 4);
        for c in 0..17 {
            let moved = |sign: f64| {
                let (mut t, mut x) = (theta.to_vec(), initial.to_vec());
                let value = if c < 13 { &mut t[c] } else { &mut x[c - 13] };
                let step = 1e-5 * value.abs();
                *value += sign * step;
                (last(&t, &x, false), step)
            };
            let ((up, step), (down, _)) = (moved(1.0), moved(-1.0));
            for i in 0..2 {
                let difference = (up[i] - down[i]) / (2.0 * step);
                let found = exact[i * width + 1 + c];
                assert!(
                    (difference - found).abs() < 1e-6 * found.abs() + 1e-9 * exact[i * width].abs() / step.max(1e-9) * 1e-3,
                    "{c} {i}: {difference} {found}"
                );
            }
        }
    }
}
