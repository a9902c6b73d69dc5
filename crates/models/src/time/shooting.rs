//! The least-squares problem of a fit in time: parameters, and every window's initial state.

use super::Mechanism;
use super::deviations::Deviations;
use super::innovations::Innovations;
use super::noise::{Colour, add_moments, whiten};
use super::simulate::Runner;
use super::trial::{Causality, Prepared};
use crate::levenberg_marquardt::triangle_of_rows;
use crate::{LeastSquares, Minimum};
use faer::{Mat, Side};
use ndof_signal::SosFilter;
use rayon::prelude::*;
use std::ops::Range;

/// A stretch of a trial that runs from its own initial state.
pub(super) struct Window {
    pub trial: usize,
    pub range: Range<usize>,
}

/// A zero-phase low-pass on what is compared, and how many samples it keeps one of.
pub(super) struct OutputFilter {
    pub filter: SosFilter,
    pub keep_every: usize,
}

/// Parameters (unless fixed) and then each window's initial state.
pub(super) struct Shooting<'a> {
    pub mechanism: &'a Mechanism,
    pub causality: Causality,
    pub trials: Vec<Prepared>,
    pub windows: Vec<Window>,
    pub sigma: Vec<f64>,
    pub fixed: Option<Vec<f64>>,
    pub step_s: f64,
    pub substeps: usize,
    pub settle: usize,
    pub filter: Option<OutputFilter>,
    /// What whitens each axis' residuals.
    pub coloured: Vec<Colour>,
    /// What each window's errors are weighted by before that, where a force of the limb makes them; else none.
    pub innovations: Vec<Innovations>,
}

impl Shooting<'_> {
    pub fn axes(&self) -> usize {
        self.mechanism.axes.len()
    }

    pub fn parameters(&self) -> usize {
        if self.fixed.is_some() { 0 } else { self.mechanism.parameters().len() }
    }

    /// Numbers of a window's initial state.
    pub fn initial(&self) -> usize {
        match self.causality {
            Causality::ForceIn => 2 * self.axes(),
            Causality::MotionIn => 0,
        }
    }

    fn initial_of<'x>(&self, x: &'x [f64], window: usize) -> &'x [f64] {
        let (p, q) = (self.parameters(), self.initial());
        &x[p + q * window..p + q * (window + 1)]
    }

    /// Residuals of one window behind their derivatives in parameters and initial state (if asked for), row after row,
    /// axes interleaved; not whitened, and the settling with them.
    fn coloured_rows(&self, runner: &Runner<'_>, window: usize, initial: &[f64], derivatives: bool) -> Vec<f64> {
        let (n, p, q) = (self.axes(), self.parameters(), self.initial());
        let all = self.mechanism.parameters().len();
        let Window { trial, range } = &self.windows[window];
        let trial = &self.trials[*trial];
        let width = if derivatives { p + q } else { 0 } + 1;
        let mut out = Vec::with_capacity(n * range.len() * width);
        let mut sample = range.start;
        let run_width = 1 + if derivatives { all + q } else { 0 };
        runner.run(initial, &trial.drive(range), self.step_s, self.substeps, derivatives, |block| {
            for (i, row) in block.chunks_exact(run_width).enumerate() {
                if derivatives {
                    out.extend(row[1 + all - p..].iter().map(|v| -v / self.sigma[i]));
                }
                out.push((trial.output(i)[sample] - row[0]) / self.sigma[i]);
            }
            sample += 1;
        });
        match &self.filter {
            Some(filter) => self.low_pass(&out, width, filter),
            None => out,
        }
    }

    /// The same, whitened where asked, without the settling.
    fn rows(&self, runner: &Runner<'_>, window: usize, initial: &[f64], derivatives: bool, white: bool) -> Vec<f64> {
        let mut out = self.coloured_rows(runner, window, initial, derivatives);
        let width = self.width(derivatives);
        if let Some(filter) = self.innovations.get(window).filter(|_| white) {
            filter.apply(&mut out, width, &self.sigma);
        }
        if white && self.coloured.iter().any(|c| !c.coefficients.is_empty()) {
            whiten(&mut out, width, &self.coloured);
        }
        out.drain(..(self.settling() * self.axes() * width).min(out.len()));
        out
    }

    fn width(&self, derivatives: bool) -> usize {
        1 + if derivatives { self.parameters() + self.initial() } else { 0 }
    }

    /// Compared samples at the beginning of a window that do not count.
    fn settling(&self) -> usize {
        self.filter.as_ref().map_or(self.settle, |f| self.settle / f.keep_every)
    }

    /// Width of a row, samples that do not count, and the rows of a window that nothing has whitened.
    pub fn raw(&self, x: &[f64], window: usize, derivatives: bool) -> (usize, usize, Vec<f64>) {
        let mut rows = self.coloured_rows(&self.runner(x), window, self.initial_of(x, window), derivatives);
        if let Some(filter) = self.innovations.get(window) {
            filter.apply(&mut rows, self.width(derivatives), &self.sigma);
        }
        (self.width(derivatives), self.settling(), rows)
    }

    /// What deviations from the run of `x` become in each window, and its errors in their own unit, axes interleaved.
    pub fn deviations(&self, x: &[f64]) -> Vec<(Deviations, Vec<f64>)> {
        let (n, runner) = (self.axes(), self.runner(x));
        let theta = self.fixed.as_deref().unwrap_or(&x[..self.parameters()]);
        (0..self.windows.len())
            .into_par_iter()
            .map(|w| {
                let rows = self.coloured_rows(&runner, w, self.initial_of(x, w), false);
                let errors: Vec<f64> = rows.iter().enumerate().map(|(k, e)| e * self.sigma[k % n]).collect();
                let Window { trial, range } = &self.windows[w];
                let positions: Vec<Vec<f64>> =
                    (0..n).map(|i| range.clone().zip(errors.iter().skip(i).step_by(n)).map(|(k, e)| self.trials[*trial].output(i)[k] - e).collect()).collect();
                (Deviations::along(self.mechanism, theta, &positions, self.step_s), errors)
            })
            .collect()
    }

    /// Which unknowns the rows of a window know.
    pub fn columns_of(&self, window: usize) -> impl Iterator<Item = usize> {
        let (p, q) = (self.parameters(), self.initial());
        (0..p).chain(p + q * window..p + q * (window + 1))
    }

    /// Moments of an axis' residuals with their past, as [`add_moments`] has them. What the unknowns' covariance `spread` says they
    /// took out of the residuals is added: without it noise is underestimated where the model is flexible (restricted
    /// maximum likelihood, as an expectation).
    pub fn moments(&self, x: &[f64], axis: usize, order: usize, pole: f64, spread: Option<&Mat<f64>>) -> Mat<f64> {
        let mut moments = Mat::zeros(order + 1, order + 1);
        for window in 0..self.windows.len() {
            let (width, settle, rows) = self.raw(x, window, spread.is_some());
            let root = spread.map(|spread| {
                let columns: Vec<usize> = self.columns_of(window).collect();
                factor(&Mat::from_fn(columns.len(), columns.len(), |r, c| spread[(columns[r], columns[c])]))
            });
            let own = rows.chunks_exact(width).skip(axis).step_by(self.axes()).skip(settle).map(|row| {
                let taken = root.iter().flat_map(|root| (0..root.ncols()).map(|c| (0..root.nrows()).map(|r| row[r] * root[(r, c)]).sum::<f64>()));
                taken.chain([row[width - 1]]).collect()
            });
            add_moments(&mut moments, pole, own, width);
        }
        moments
    }

    fn low_pass(&self, rows: &[f64], width: usize, filter: &OutputFilter) -> Vec<f64> {
        let n = self.axes();
        let samples = rows.len() / (n * width);
        let kept = samples.div_ceil(filter.keep_every);
        let mut out = vec![0.0; kept * n * width];
        for column in 0..n * width {
            let series: Vec<f64> = rows.iter().skip(column).step_by(n * width).copied().collect();
            let smooth = filter.filter.filter_zero_phase(&series).unwrap_or(series);
            (0..kept).for_each(|k| out[k * n * width + column] = smooth[k * filter.keep_every]);
        }
        out
    }

    /// Residuals of each window, whitened or not.
    pub fn errors(&self, x: &[f64], white: bool) -> Vec<Vec<f64>> {
        let runner = self.runner(x);
        (0..self.windows.len()).into_par_iter().map(|w| self.rows(&runner, w, self.initial_of(x, w), false, white)).collect()
    }

    fn with_derivatives(&self, x: &[f64]) -> Vec<Vec<f64>> {
        let runner = self.runner(x);
        (0..self.windows.len()).into_par_iter().map(|w| self.rows(&runner, w, self.initial_of(x, w), true, true)).collect()
    }

    pub fn runner<'b>(&'b self, x: &'b [f64]) -> Runner<'b> {
        Runner::new(self.mechanism, self.fixed.as_deref().unwrap_or(&x[..self.parameters()]))
    }

    /// Residuals of axis `axis`, one series a window, without weights.
    pub fn series(&self, errors: &[Vec<f64>], axis: usize) -> Vec<Vec<f64>> {
        errors.iter().map(|e| e.iter().skip(axis).step_by(self.axes()).copied().collect()).collect()
    }

    /// Σ over blocks of score scoreᵀ, and the number of blocks.
    pub fn meat(&self, minimum: &Minimum, block_s: f64) -> (Mat<f64>, usize) {
        let columns = minimum.x.len();
        let (mut meat, mut blocks, mut first) = (Mat::zeros(columns, columns), 0, 0);
        let every = self.filter.as_ref().map_or(1, |f| f.keep_every);
        let block = ((block_s / (self.step_s * every as f64)) as usize).max(1) * self.axes();
        let settle = self.settle / every;
        for w in &self.windows {
            let rows = (w.range.len().div_ceil(every) - settle.min(w.range.len().div_ceil(every))) * self.axes();
            for from in (first..first + rows).step_by(block) {
                let to = (from + block).min(first + rows);
                let score: Vec<f64> = (0..columns).map(|c| (from..to).map(|r| minimum.jacobian[(r, c)] * minimum.residuals[r]).sum()).collect();
                (0..columns).for_each(|r| (0..columns).for_each(|c| meat[(r, c)] += score[r] * score[c]));
                blocks += 1;
            }
            first += rows;
        }
        (meat, blocks)
    }
}

impl LeastSquares for Shooting<'_> {
    fn residuals(&self, x: &[f64]) -> Vec<f64> {
        self.errors(x, true).concat()
    }

    fn jacobian(&self, x: &[f64]) -> Mat<f64> {
        let (p, q) = (self.parameters(), self.initial());
        let parts = self.with_derivatives(x);
        let width = p + q + 1;
        let mut jacobian = Mat::zeros(parts.iter().map(|v| v.len() / width).sum(), x.len());
        let mut at = 0;
        for (w, part) in parts.iter().enumerate() {
            for row in part.chunks_exact(width) {
                (0..p).for_each(|c| jacobian[(at, c)] = row[c]);
                (0..q).for_each(|c| jacobian[(at, p + q * w + c)] = row[p + c]);
                at += 1;
            }
        }
        jacobian
    }

    /// Each window is reduced by itself: its rows know only the parameters and its own initial state.
    fn triangle(&self, x: &[f64], _residuals: &[f64]) -> Mat<f64> {
        let (p, q) = (self.parameters(), self.initial());
        let width = p + q + 1;
        let runner = self.runner(x);
        let parts: Vec<Mat<f64>> =
            (0..self.windows.len()).into_par_iter().map(|w| triangle_of_rows(&self.rows(&runner, w, self.initial_of(x, w), true, true), width)).collect();
        let total = x.len() + 1;
        let rows: usize = parts.iter().map(Mat::nrows).sum();
        let mut all = Mat::zeros(rows, total);
        let mut at = 0;
        for (w, part) in parts.iter().enumerate() {
            for r in 0..part.nrows() {
                (0..p).for_each(|c| all[(at, c)] = part[(r, c)]);
                (0..q).for_each(|c| all[(at, p + q * w + c)] = part[(r, p + c)]);
                all[(at, total - 1)] = part[(r, width - 1)];
                at += 1;
            }
        }
        all
    }
}

/// The lower triangle L of L Lᵀ = A for what is positive of A; zero rows and columns stay zero.
pub(super) fn factor(a: &Mat<f64>) -> Mat<f64> {
    let n = a.nrows();
    match a.self_adjoint_eigen(Side::Lower) {
        Ok(eigen) => Mat::from_fn(n, n, |r, c| eigen.U()[(r, c)] * eigen.S()[c].max(0.0).sqrt()),
        Err(_) => Mat::zeros(n, n),
    }
}
