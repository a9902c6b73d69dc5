//! What the laws of a mechanism add to its force balance, and the past that delayed ones look back to.

use super::interpolate::{between, cubic, hermite};
use super::{Drive, Own, Runner, Scratch, add_scaled};
use crate::time::law::{LOCAL_VARIABLES, Local};

impl Runner<'_> {
    #[allow(clippy::too_many_arguments)]
    pub(super) fn add_law(
        &self,
        own: &Own<'_>,
        drive: &Drive<'_>,
        when: f64,
        step_s: f64,
        width: usize,
        state: &[f64],
        scratch: &mut Scratch,
        out: &mut [f64],
    ) {
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
}
