//! Runs of a mechanism with the exact derivatives of those runs.

use super::exact::Stepper;
use super::law::{LOCAL_VARIABLES, Local};
use super::{Law, Mechanism};
use faer::Mat;
use faer::linalg::solvers::DenseSolveCore;

/// What drives a run, one slice an axis.
#[derive(Clone, Debug)]
pub(crate) enum Drive<'a> {
    /// The force is given, linear between samples, and motion comes out.
    Force(Vec<&'a [f64]>),
    /// Position, velocity and acceleration are given, and the force comes out.
    Motion([Vec<&'a [f64]>; 3]),
}

impl Drive<'_> {
    pub(crate) fn samples(&self) -> usize {
        match self {
            Drive::Force(f) => f.first().map_or(0, |f| f.len()),
            Drive::Motion([x, _, _]) => x.first().map_or(0, |x| x.len()),
        }
    }
}

/// A law of the mechanism with the places of its parameters and states.
struct Own<'a> {
    law: &'a dyn Law,
    axis: usize,
    /// First parameter and their number.
    theta: (usize, usize),
    /// First row of the state and their number.
    rows: (usize, usize),
    delay_s: Option<f64>,
    settles: bool,
}

/// A mechanism with numbers, ready to run.
pub(crate) struct Runner<'a> {
    mechanism: &'a Mechanism,
    theta: &'a [f64],
    entries: Vec<(usize, usize)>,
    n: usize,
    hidden: usize,
    pub(super) mass: Vec<f64>,
    pub(super) inverse: Vec<f64>,
    pub(super) damping: Vec<f64>,
    pub(super) stiffness: Vec<f64>,
    offset: Vec<f64>,
    trend: Vec<f64>,
    laws: Vec<Own<'a>>,
}

/// Working memory of one run.
struct Scratch {
    /// Force balance of each axis, n × width.
    acting: Vec<f64>,
    /// Delayed position and velocity of one law, 2 × width.
    delayed: Vec<f64>,
    slopes: Vec<f64>,
    states: Vec<f64>,
    rates: Vec<f64>,
    /// Position, velocity and acceleration of each axis at each sample that is past, 3 n × width each; only for delays.
    history: Vec<f64>,
    push: Vec<f64>,
}

fn add_scaled(target: &mut [f64], source: &[f64], factor: f64) {
    if factor != 0.0 {
        target.iter_mut().zip(source).for_each(|(t, s)| *t += factor * s);
    }
}

impl<'a> Runner<'a> {
    pub(crate) fn new(mechanism: &'a Mechanism, theta: &'a [f64]) -> Self {
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
        let (offset, trend) = (take(mechanism.offset), take(mechanism.trend));
        let (mut at, mut row) = (mechanism.baseline_parameters(), 2 * n);
        let laws = mechanism
            .laws
            .iter()
            .map(|placed| {
                let law = placed.law.as_ref();
                let (count, states) = (law.parameters(false).len(), law.states());
                let own = Own {
                    law,
                    axis: placed.axis,
                    theta: (at, count),
                    rows: (row, states),
                    delay_s: law.delay().map(|d| theta[at + d]),
                    settles: law.settles(),
                };
                at += count;
                row += states;
                own
            })
            .collect();
        Runner {
            mechanism,
            theta,
            n,
            hidden: row - 2 * n,
            inverse: (0..n * n).map(|e| inverse[(e / n, e % n)]).collect(),
            damping: matrix(1),
            stiffness: if mechanism.spring { matrix(2) } else { vec![0.0; n * n] },
            mass,
            offset,
            trend,
            entries,
            laws,
        }
    }

    /// Runs the mechanism and hands every sample's outputs with their derivatives to `sink`: n × (1 + columns), columns
    /// being the parameters and, where a force drives, the initial positions and velocities; or none.
    ///
    /// Without laws the steps are exact for a force that is linear between samples; with laws they are Runge-Kutta steps
    /// of fourth order, `substeps` a sample, and the derivatives those of the steps.
    pub(crate) fn run(&self, initial: &[f64], drive: &Drive<'_>, step_s: f64, substeps: usize, derivatives: bool, sink: impl FnMut(&[f64])) {
        match drive {
            Drive::Force(force) if self.laws.is_empty() => {
                Stepper::new(self, self.mechanism, &self.entries, step_s, derivatives).run(initial, force, (&self.offset, &self.trend), sink);
            }
            _ => self.integrate(initial, drive, step_s, substeps, derivatives, sink),
        }
    }

    fn integrate(&self, initial: &[f64], drive: &Drive<'_>, step_s: f64, substeps: usize, derivatives: bool, mut sink: impl FnMut(&[f64])) {
        let n = self.n;
        let imposed = matches!(drive, Drive::Motion(_));
        let parameters = self.theta.len();
        let width = 1 + if derivatives { parameters + if imposed { 0 } else { 2 * n } } else { 0 };
        let mut state = vec![0.0; (2 * n + self.hidden) * width];
        if !imposed {
            for i in 0..2 * n {
                state[i * width] = initial[i];
                if derivatives {
                    state[i * width + 1 + parameters + i] = 1.0;
                }
            }
        }
        let samples = drive.samples();
        let (mut k1, mut k2, mut k3, mut k4, mut at) = (state.clone(), state.clone(), state.clone(), state.clone(), state.clone());
        let largest = self.laws.iter().map(|l| (1 + l.rows.1) * (LOCAL_VARIABLES + l.rows.1 + l.theta.1)).max().unwrap_or(0);
        let mut scratch = Scratch {
            acting: vec![0.0; n * width],
            delayed: vec![0.0; 2 * width],
            slopes: vec![0.0; largest],
            states: vec![0.0; self.hidden],
            rates: vec![0.0; self.hidden],
            history: Vec::new(),
            push: vec![0.0; n],
        };
        let delays = self.laws.iter().any(|l| l.delay_s.is_some());
        let small = step_s / substeps as f64;
        let mut output = vec![0.0; n * width];
        for sample in 0..samples {
            if imposed {
                self.place(drive, sample as f64, width, &mut state);
                self.balance(drive, sample as f64, step_s, width, &state, &mut scratch, &mut k1);
                self.force_out(drive, sample, width, &scratch.acting, &mut output);
                sink(&output);
            } else {
                sink(&state[..n * width]);
            }
            if sample + 1 == samples {
                break;
            }
            for sub in 0..substeps {
                let now = sample as f64 + sub as f64 / substeps as f64;
                let rate = |state: &mut [f64], ahead: f64, out: &mut [f64], scratch: &mut Scratch| {
                    let when = now + ahead / substeps as f64;
                    if imposed {
                        self.place(drive, when, width, state);
                    }
                    self.balance(drive, when, step_s, width, state, scratch, out);
                    if !imposed {
                        self.accelerate(width, state, scratch, out);
                    }
                };
                rate(&mut state, 0.0, &mut k1, &mut scratch);
                if delays && sub == 0 && !imposed {
                    // Positions, velocities, accelerations.
                    scratch.history.extend_from_slice(&state[..2 * n * width]);
                    scratch.history.extend_from_slice(&k1[n * width..2 * n * width]);
                }
                let first = if imposed { 2 * n * width } else { 0 };
                let moved =
                    |at: &mut [f64], k: &[f64], by: f64| at[first..].iter_mut().zip(&state[first..]).zip(&k[first..]).for_each(|((a, s), k)| *a = s + by * k);
                moved(&mut at, &k1, 0.5 * small);
                rate(&mut at, 0.5, &mut k2, &mut scratch);
                moved(&mut at, &k2, 0.5 * small);
                rate(&mut at, 0.5, &mut k3, &mut scratch);
                moved(&mut at, &k3, small);
                rate(&mut at, 1.0, &mut k4, &mut scratch);
                for e in first..state.len() {
                    state[e] += small / 6.0 * (k1[e] + 2.0 * k2[e] + 2.0 * k3[e] + k4[e]);
                }
                if imposed {
                    self.place(drive, now + 1.0 / substeps as f64, width, &mut state);
                }
                self.settle(width, &mut state, &mut scratch, &mut at);
            }
        }
    }

    /// Writes a measured motion at a time (in samples) into the rows of position and velocity.
    fn place(&self, drive: &Drive<'_>, when: f64, width: usize, state: &mut [f64]) {
        let Drive::Motion([x, v, _]) = drive else { return };
        let n = self.n;
        for i in 0..n {
            (state[i * width], state[(n + i) * width]) = (between(x[i], when).0, between(v[i], when).0);
        }
    }

    /// Force on the masses with all its derivatives but those in M, into `scratch.acting`, and the rates of hidden states.
    #[allow(clippy::too_many_arguments)]
    fn balance(&self, drive: &Drive<'_>, when: f64, step_s: f64, width: usize, state: &[f64], scratch: &mut Scratch, out: &mut [f64]) {
        let (n, t) = (self.n, when * step_s);
        for i in 0..n {
            scratch.push[i] = match drive {
                Drive::Force(f) => between(f[i], when).0,
                Drive::Motion(_) => 0.0,
            };
            let row = &mut scratch.acting[i * width..(i + 1) * width];
            row.fill(0.0);
            row[0] = scratch.push[i] - self.offset[i] - self.trend[i] * t;
            for j in 0..n {
                add_scaled(row, &state[(n + j) * width..(n + j + 1) * width], -self.damping[i * n + j]);
                add_scaled(row, &state[j * width..(j + 1) * width], -self.stiffness[i * n + j]);
            }
        }
        if width > 1 {
            let per = self.entries.len();
            for (matrix, first) in [(1, n), (2, 0)].into_iter().take(self.mechanism.matrices() - 1) {
                for (e, &(i, j)) in self.entries.iter().enumerate() {
                    let column = 1 + matrix * per + e;
                    scratch.acting[i * width + column] -= state[(first + j) * width];
                    if i != j {
                        scratch.acting[j * width + column] -= state[(first + i) * width];
                    }
                }
            }
            let mut column = 1 + self.mechanism.matrices() * per;
            for (used, slope) in [(self.mechanism.offset, 1.0), (self.mechanism.trend, t)] {
                for i in 0..if used { n } else { 0 } {
                    scratch.acting[i * width + column] -= slope;
                    column += 1;
                }
            }
        }
        for own in &self.laws {
            self.add_law(own, drive, when, step_s, width, state, scratch, out);
        }
    }

    #[allow(clippy::too_many_arguments)]
    fn add_law(&self, own: &Own<'_>, drive: &Drive<'_>, when: f64, step_s: f64, width: usize, state: &[f64], scratch: &mut Scratch, out: &mut [f64]) {
        let (n, axis) = (self.n, own.axis);
        let (first_row, nz) = own.rows;
        let theta = &self.theta[own.theta.0..own.theta.0 + own.theta.1];
        let (x, v) = (state[axis * width], state[(n + axis) * width]);
        let mut local = Local {
            time_s: when * step_s,
            position: x,
            velocity: v,
            delayed_position: x,
            delayed_velocity: v,
            force: scratch.push[axis],
            delayed_force: scratch.push[axis],
        };
        let mut force_slope = 0.0;
        let delay_column = own.law.delay().map(|d| 1 + own.theta.0 + d);
        if let Some(delay_s) = own.delay_s {
            let then = when - (delay_s / step_s).max(1.0);
            self.look_back(drive, then, axis, step_s, width, delay_column, scratch);
            (local.delayed_position, local.delayed_velocity) = (scratch.delayed[0], scratch.delayed[width]);
            if let Drive::Force(f) = drive {
                let (value, slope) = between(f[axis], when - delay_s / step_s);
                (local.delayed_force, force_slope) = (value, -slope / step_s);
            }
        }
        (0..nz).for_each(|k| scratch.states[k] = state[(first_row + k) * width]);
        if width == 1 {
            scratch.acting[axis] -= own.law.evaluate(theta, &local, &scratch.states[..nz], &mut scratch.rates[..nz]);
            (0..nz).for_each(|k| out[first_row + k] = scratch.rates[k]);
            return;
        }
        let f = own.law.linearise(theta, &local, &scratch.states[..nz], &mut scratch.rates[..nz], &mut scratch.slopes);
        let columns = LOCAL_VARIABLES + nz + theta.len();
        for r in 0..=nz {
            let slopes = &scratch.slopes[r * columns..(r + 1) * columns];
            let (row, sign, value) = if r == 0 {
                (&mut scratch.acting[axis * width..(axis + 1) * width], -1.0, None)
            } else {
                let row = &mut out[(first_row + r - 1) * width..(first_row + r) * width];
                row.fill(0.0);
                (row, 1.0, Some(scratch.rates[r - 1]))
            };
            row[0] = value.unwrap_or(row[0] - f);
            let tail = |row: usize| &state[row * width + 1..(row + 1) * width];
            let target = &mut row[1..];
            add_scaled(target, tail(axis), sign * slopes[0]);
            add_scaled(target, tail(n + axis), sign * slopes[1]);
            if own.delay_s.is_some() {
                add_scaled(target, &scratch.delayed[1..width], sign * slopes[2]);
                add_scaled(target, &scratch.delayed[width + 1..2 * width], sign * slopes[3]);
            }
            if let Some(column) = delay_column {
                target[column - 1] += sign * slopes[5] * force_slope;
            }
            for k in 0..nz {
                add_scaled(target, tail(first_row + k), sign * slopes[LOCAL_VARIABLES + k]);
            }
            for p in 0..theta.len() {
                target[own.theta.0 + p] += sign * slopes[LOCAL_VARIABLES + nz + p];
            }
        }
    }

    /// Position and velocity at a time that is past (in samples), cubic between samples; before the beginning they
    /// are what they were there.
    #[allow(clippy::too_many_arguments)]
    fn look_back(&self, drive: &Drive<'_>, then: f64, axis: usize, step_s: f64, width: usize, delay_column: Option<usize>, scratch: &mut Scratch) {
        let n = self.n;
        scratch.delayed.fill(0.0);
        if let Drive::Motion([x, v, a]) = drive {
            for (k, (y, rate)) in [(&x[axis], &v[axis]), (&v[axis], &a[axis])].into_iter().enumerate() {
                let (value, slope) = hermite(|s| (y[s], rate[s]), y.len(), then, step_s);
                scratch.delayed[k * width] = value;
                if let Some(column) = delay_column.filter(|_| width > 1) {
                    scratch.delayed[k * width + column] = -slope;
                }
            }
            return;
        }
        let stride = 3 * n * width;
        let past = scratch.history.len() / stride;
        if past == 0 {
            return;
        }
        let row = |sample: usize, kind: usize| sample * stride + (kind * n + axis) * width;
        if then <= 0.0 || past == 1 {
            for kind in 0..2 {
                let at = row(0, kind);
                scratch.delayed[kind * width..(kind + 1) * width].copy_from_slice(&scratch.history[at..at + width]);
            }
            return;
        }
        let (sample, basis, slopes) = cubic(then, past, step_s);
        for kind in 0..2 {
            let rows = [row(sample, kind), row(sample, kind + 1), row(sample + 1, kind), row(sample + 1, kind + 1)];
            let target = &mut scratch.delayed[kind * width..(kind + 1) * width];
            for (at, weight) in rows.iter().zip(basis) {
                add_scaled(target, &scratch.history[*at..*at + width], weight);
            }
            if let Some(column) = delay_column.filter(|_| width > 1) {
                target[column] -= rows.iter().zip(slopes).map(|(at, slope)| scratch.history[*at] * slope).sum::<f64>();
            }
        }
    }

    /// M⁻¹ of what acts, and velocities as the rate of positions.
    fn accelerate(&self, width: usize, state: &[f64], scratch: &mut Scratch, out: &mut [f64]) {
        let n = self.n;
        let acting = &mut scratch.acting;
        out[..n * width].copy_from_slice(&state[n * width..2 * n * width]);
        for i in 0..n {
            out[(n + i) * width] = (0..n).map(|j| self.inverse[i * n + j] * acting[j * width]).sum();
        }
        if width > 1 {
            for (e, &(i, j)) in self.entries.iter().enumerate() {
                acting[i * width + 1 + e] -= out[(n + j) * width];
                if i != j {
                    acting[j * width + 1 + e] -= out[(n + i) * width];
                }
            }
        }
        for i in 0..n {
            let row = &mut out[(n + i) * width..(n + i + 1) * width];
            row.fill(0.0);
            for j in 0..n {
                add_scaled(row, &acting[j * width..(j + 1) * width], self.inverse[i * n + j]);
            }
        }
    }

    /// The force that an imposed motion takes: M a less what acts without it.
    fn force_out(&self, drive: &Drive<'_>, sample: usize, width: usize, acting: &[f64], out: &mut [f64]) {
        let Drive::Motion([_, _, a]) = drive else { return };
        let n = self.n;
        out.iter_mut().zip(acting).for_each(|(o, a)| *o = -a);
        for i in 0..n {
            out[i * width] += (0..n).map(|j| self.mass[i * n + j] * a[j][sample]).sum::<f64>();
        }
        if width > 1 {
            for (e, &(i, j)) in self.entries.iter().enumerate() {
                out[i * width + 1 + e] += a[j][sample];
                if i != j {
                    out[j * width + 1 + e] += a[i][sample];
                }
            }
        }
    }

    /// Lets states jump at the end of a step.
    fn settle(&self, width: usize, state: &mut [f64], scratch: &mut Scratch, spare: &mut [f64]) {
        for own in self.laws.iter().filter(|l| l.settles) {
            let (first, nz) = own.rows;
            let theta = &self.theta[own.theta.0..own.theta.0 + own.theta.1];
            (0..nz).for_each(|k| scratch.states[k] = state[(first + k) * width]);
            let position = state[own.axis * width];
            let slopes = (width > 1).then_some(&mut scratch.slopes[..]);
            own.law.settle(theta, position, &mut scratch.states[..nz], slopes);
            let columns = 1 + nz + theta.len();
            for k in 0..nz {
                let row = &mut spare[k * width..(k + 1) * width];
                row.fill(0.0);
                if width > 1 {
                    let slopes = &scratch.slopes[k * columns..(k + 1) * columns];
                    add_scaled(&mut row[1..], &state[own.axis * width + 1..(own.axis + 1) * width], slopes[0]);
                    for l in 0..nz {
                        add_scaled(&mut row[1..], &state[(first + l) * width + 1..(first + l + 1) * width], slopes[1 + l]);
                    }
                    (0..theta.len()).for_each(|p| row[1 + own.theta.0 + p] += slopes[1 + nz + p]);
                }
                row[0] = scratch.states[k];
            }
            state[first * width..(first + nz) * width].copy_from_slice(&spare[..nz * width]);
        }
    }
}

/// Value between two samples and slope per sample; the first or last value beyond the ends.
fn between(samples: &[f64], when: f64) -> (f64, f64) {
    let last = samples.len() - 1;
    if when <= 0.0 {
        return (samples[0], 0.0);
    }
    let at = when as usize;
    if at >= last {
        return (samples[last], 0.0);
    }
    let slope = samples[at + 1] - samples[at];
    (samples[at] + slope * (when - at as f64), slope)
}

/// Sample before a time, and the weights of value and rate there and at the next sample, for the value and its rate (1/s).
fn cubic(when: f64, samples: usize, step_s: f64) -> (usize, [f64; 4], [f64; 4]) {
    let sample = (when as usize).min(samples - 2);
    let u = when - sample as f64;
    let (u2, u3) = (u * u, u * u * u);
    let basis = [1.0 - 3.0 * u2 + 2.0 * u3, (u - 2.0 * u2 + u3) * step_s, 3.0 * u2 - 2.0 * u3, (u3 - u2) * step_s];
    let slopes = [6.0 * (u2 - u) / step_s, 1.0 - 4.0 * u + 3.0 * u2, 6.0 * (u - u2) / step_s, 3.0 * u2 - 2.0 * u];
    (sample, basis, slopes)
}

/// Value and rate (1/s) at a time (in samples) of a signal with known rate; constant before the beginning.
fn hermite(at: impl Fn(usize) -> (f64, f64), samples: usize, when: f64, step_s: f64) -> (f64, f64) {
    if when <= 0.0 || samples < 2 {
        return (at(0).0, 0.0);
    }
    let (sample, basis, slopes) = cubic(when.min((samples - 1) as f64), samples, step_s);
    let ((a, da), (b, db)) = (at(sample), at(sample + 1));
    let dot = |w: [f64; 4]| w[0] * a + w[1] * da + w[2] * b + w[3] * db;
    (dot(basis), dot(slopes))
}

/// What a mechanism of given parameters does: positions under a force, from given initial positions and velocities.
///
/// # Panics
/// If `theta`, `initial` or `force` do not have the mechanism's size.
pub fn simulate(mechanism: &Mechanism, theta: &[f64], initial: &[f64], force: &[&[f64]], sample_rate_hz: f64, substeps: usize) -> Vec<Vec<f64>> {
    let n = mechanism.axes.len();
    assert!(theta.len() == mechanism.parameters().len() && initial.len() == 2 * n && force.len() == n, "sizes do not fit the mechanism");
    let mut out = vec![Vec::new(); n];
    let drive = Drive::Force(force.to_vec());
    Runner::new(mechanism, theta).run(initial, &drive, 1.0 / sample_rate_hz, substeps.max(1), false, |sample| {
        out.iter_mut().zip(sample).for_each(|(o, v)| o.push(*v));
    });
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Axis;
    use crate::time::laws::{self, Coulomb};
    use std::f64::consts::TAU;

    fn force(samples: usize, axes: usize) -> Vec<Vec<f64>> {
        (0..axes).map(|a| (0..samples).map(|k| 4.0 * (0.1 * k as f64 * (1.0 + a as f64)).sin() + 2.0 * (0.023 * k as f64).cos()).collect()).collect()
    }

    /// Last outputs of a run.
    fn last(mechanism: &Mechanism, theta: &[f64], initial: &[f64], drive: &Drive<'_>, derivatives: bool) -> Vec<f64> {
        let mut out = Vec::new();
        Runner::new(mechanism, theta).run(initial, drive, 0.004, 2, derivatives, |block| out = block.to_vec());
        out
    }

    fn assert_derivatives(mechanism: &Mechanism, theta: &[f64], initial: &[f64], drive: &Drive<'_>, what: &str) {
        let n = mechanism.axes.len();
        let exact = last(mechanism, theta, initial, drive, true);
        let width = exact.len() / n;
        for c in 0..width - 1 {
            let moved = |sign: f64| {
                let (mut t, mut x) = (theta.to_vec(), initial.to_vec());
                let value = if c < theta.len() { &mut t[c] } else { &mut x[c - theta.len()] };
                let step = 3e-6 * value.abs();
                *value += sign * step;
                (last(mechanism, &t, &x, drive, false), step)
            };
            let ((up, step), (down, _)) = (moved(1.0), moved(-1.0));
            for i in 0..n {
                let (difference, found) = ((up[i] - down[i]) / (2.0 * step), exact[i * width + 1 + c]);
                // 1e-6, and what rounding leaves of a difference.
                let rounding = 1e-12 * exact[i * width].abs().max(1e-3) / step;
                assert!((difference - found).abs() < 1e-6 * found.abs() + rounding, "{what} {c} {i}: {difference} {found}");
            }
        }
    }

    const BASE: [f64; 3] = [2.0, 12.0, 350.0];

    #[test]
    fn derivatives_of_exact_steps_are_differences_with_and_without_spring_offset_and_trend() {
        let force = force(180, 2);
        let drive = Drive::Force(force.iter().map(Vec::as_slice).collect());
        let axes = vec![Axis::linear("x"), Axis::linear("y")];
        let theta = [2.1, -0.5, 1.9, 11.0, -2.0, 15.0, 300.0, -60.0, 520.0, 0.2, -0.1, 0.3, 0.15];
        for (spring, offset, trend) in [(true, true, true), (true, false, true), (false, true, false), (false, false, false)] {
            let mechanism = Mechanism { spring, offset, trend, ..Mechanism::new(axes.clone()) };
            let count = mechanism.parameters().len();
            let theta: Vec<f64> = theta[..if spring { 9 } else { 6 }].iter().chain(&theta[9..]).take(count).copied().collect();
            assert_derivatives(&mechanism, &theta, &[0.001, -0.002, 0.05, 0.02], &drive, &format!("{spring} {offset} {trend}"));
        }
    }

    #[test]
    fn derivatives_with_every_law_are_differences_of_the_discrete_run() {
        let force = force(150, 1);
        let drive = Drive::Force(vec![&force[0]]);
        let x: Vec<f64> = (0..150).map(|k| 0.01 * (0.043 * f64::from(k)).sin() + 0.004 * (0.11 * f64::from(k)).cos()).collect();
        let v: Vec<f64> = (0..150).map(|k| (0.01 * 0.043 * (0.043 * f64::from(k)).cos() - 0.004 * 0.11 * (0.11 * f64::from(k)).sin()) / 0.004).collect();
        let a: Vec<f64> = (0..150)
            .map(|k| (-0.01 * 0.043f64.powi(2) * (0.043 * f64::from(k)).sin() - 0.004 * 0.11f64.powi(2) * (0.11 * f64::from(k)).cos()) / 1.6e-5)
            .collect();
        let imposed = Drive::Motion([vec![&x], vec![&v], vec![&a]]);
        for law in laws::all() {
            let law = if law.name() == "coulomb-friction" { std::sync::Arc::new(Coulomb { turn_velocity: 0.02 }) } else { law };
            let (name, delay) = (law.name(), law.delay());
            let mechanism = Mechanism::new(vec![Axis::linear("x")]).with_offset().with_law(law, 0);
            let mut base = BASE.to_vec();
            base.push(0.3);
            let mut theta = mechanism.starts(&base).pop().expect("a start");
            if let Some(delay) = delay {
                // No whole number of steps: where the past begins there is a kink.
                theta[4 + delay] *= 1.003;
            }
            if name == "stribeck-friction" {
                // Turned around over 1 mm/s, differences are no measure of anything.
                theta[4] = 0.05;
            }
            assert_derivatives(&mechanism, &theta, &[0.001, 0.03], &drive, name);
            if name != "saturation" && name != "latency" {
                assert_derivatives(&mechanism, &theta, &[], &imposed, &format!("{name}, motion imposed"));
            }
        }
    }

    #[test]
    fn exact_steps_and_runge_kutta_steps_are_one_mechanism() {
        let force = force(400, 1);
        let drive = Drive::Force(vec![&force[0]]);
        let plain = Mechanism::new(vec![Axis::linear("x")]).with_offset();
        let carried = plain.clone().with(laws::CubicStiffness, 0);
        let (mut exact, mut stepped) = (Vec::new(), Vec::new());
        Runner::new(&plain, &[2.0, 12.0, 350.0, 0.2]).run(&[0.001, 0.02], &drive, 0.002, 1, false, |y| exact.push(y[0]));
        Runner::new(&carried, &[2.0, 12.0, 350.0, 0.2, 0.0]).run(&[0.001, 0.02], &drive, 0.002, 4, false, |y| stepped.push(y[0]));
        let size = exact.iter().fold(0.0f64, |m, v| m.max(v.abs()));
        // (ω h)⁴/120 of 0.5 ms steps at 13 rad/s: 1e-11 a step's worth.
        assert!(exact.iter().zip(&stepped).all(|(a, b)| (a - b).abs() < 1e-9 * size));
    }

    #[test]
    fn time_and_frequency_faces_of_every_linear_law_agree() {
        // The steady answer of mass, damper, spring and law to a sine, by the run and by 1/(M s² + B s + K + f/x).
        let (hz, rate) = (2.0, 4000.0);
        let samples = (12.0 * rate) as usize;
        let period = (rate / hz) as usize;
        // A force that is linear between samples has sinc² less of the sine.
        let half = std::f64::consts::PI * hz / rate;
        let held = (half.sin() / half).powi(2);
        let sine: Vec<f64> = (0..samples).map(|k| (TAU * hz * k as f64 / rate).sin()).collect();
        for law in laws::all() {
            let theta = Mechanism::new(vec![Axis::linear("x")]).with_law(law.clone(), 0).starts(&[2.0, 30.0, 350.0]).remove(0);
            let s = num_complex::Complex64::new(0.0, TAU * hz);
            let Some(own) = law.response(&theta[3..], s) else { continue };
            let mechanism = Mechanism::new(vec![Axis::linear("x")]).with_law(law.clone(), 0);
            let answer = &super::simulate(&mechanism, &theta, &[0.0, 0.0], &[&sine], rate, 1)[0];
            let (mut re, mut im) = (0.0, 0.0);
            for (k, y) in answer.iter().enumerate().skip(samples - period) {
                let phase = TAU * hz * k as f64 / rate;
                re += y * phase.sin() * 2.0 / period as f64;
                im += y * phase.cos() * 2.0 / period as f64;
            }
            let want = (s * s * theta[0] + s * theta[1] + theta[2] + own).inv() * held;
            let error = (num_complex::Complex64::new(re, im) - want).norm() / want.norm();
            let bound = if law.name() == "fractional" { laws::FractionalDamping::ERROR } else { 1e-8 };
            println!("{}: {error:.1e}", law.name());
            assert!(error < bound, "{}: {error:e}", law.name());
        }
    }
}
