//! Runs of a mechanism with the exact derivatives of those runs.

mod interpolate;
mod laws;

use super::exact::Stepper;
use super::law::LOCAL_VARIABLES;
use super::{Law, Mechanism};
use faer::Mat;
use faer::linalg::solvers::DenseSolveCore;
use interpolate::between;

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
                Stepper::new([&self.inverse, &self.damping, &self.stiffness], self.mechanism, &self.entries, step_s, derivatives).run(
                    initial,
                    force,
                    (&self.offset, &self.trend),
                    sink,
                );
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
mod tests;
