//! The regression's rows: products of motion and splines, all through one kernel.

use super::ScheduleError;
use super::kernel::Kernel;
use super::record::Stretch;
use super::spline::Splines;
use rayon::prelude::*;
use std::ops::Range;

/// Share of the band over which the kernel falls.
const FALL: f64 = 0.6;
/// The motion is differentiated up to this many times the band's upper end, so that a product with a spline, which shifts frequencies, is
/// whole within the band, and falls over so many times the band.
const PASSED: f64 = 2.5;
const PASSED_FALL: f64 = 1.25;
/// Most of the sample rate that a band may take: what is differentiated then ends below half of it.
const WIDEST: f64 = 1.0 / 6.0;

/// How the rows are made of samples.
pub(super) struct Layout {
    /// Splines of inertia, damping and stiffness.
    pub splines: Splines,
    /// Splines of the mean effort.
    pub mean: Splines,
    pub axes: usize,
    pub rate_hz: f64,
    pub high_hz: f64,
    /// Samples from row to row: two rows a period of the band's upper end, more would say the same again.
    pub step: usize,
}

/// Position, velocity and acceleration of each axis, all through one kernel.
pub(super) type Motion = [Vec<Vec<f64>>; 3];

/// Rows of the regression one below the other, in stretches without a gap.
pub(super) struct Rows {
    pub width: usize,
    pub values: Vec<f64>,
    pub stretches: Vec<Range<usize>>,
    pub block: Vec<usize>,
}

impl Layout {
    pub(super) fn new(axes: usize, (splines, mean): (Splines, Splines), rate_hz: f64, high_hz: f64) -> Result<Self, ScheduleError> {
        if !(high_hz > 0.0 && high_hz <= WIDEST * rate_hz) {
            return Err(ScheduleError::Band { high_hz, rate_hz, most_hz: WIDEST * rate_hz });
        }
        let step = (0.5 * rate_hz / high_hz).round().max(1.0) as usize;
        Ok(Layout { splines, mean, axes, rate_hz, high_hz, step })
    }

    /// Columns of one matrix' entries in one row of the matrix: inputs × splines.
    pub(super) fn matrix_width(&self) -> usize {
        self.axes * self.splines.count()
    }

    /// Columns of all three.
    pub(super) fn regressors(&self) -> usize {
        3 * self.matrix_width()
    }

    /// Column of one spline of an entry: which matrix (0 K, 1 B, 2 M), which input.
    pub(super) fn column(&self, matrix: usize, input: usize, spline: usize) -> usize {
        (matrix * self.axes + input) * self.splines.count() + spline
    }

    /// A kernel that passes about twice the band, differentiated.
    pub(super) fn differentiator(&self, order: usize) -> Kernel {
        Kernel::new(PASSED * self.high_hz, PASSED_FALL * self.high_hz, self.rate_hz, order)
    }

    /// The motions of stretches with their derivatives, about their means.
    pub(super) fn motions(&self, stretches: &[Stretch<'_>]) -> Vec<Motion> {
        let mean = |axis: usize| {
            let all = || stretches.iter().flat_map(|stretch| stretch.motion[axis].iter());
            all().sum::<f64>() / (all().count() as f64).max(1.0)
        };
        let centre: Vec<f64> = (0..self.axes).map(mean).collect();
        stretches.iter().map(|stretch| self.motion(&stretch.motion, &centre)).collect()
    }

    /// The motion of a stretch with its derivatives, about `centre`.
    pub(super) fn motion(&self, channels: &[&[f64]], centre: &[f64]) -> Motion {
        let about: Vec<Vec<f64>> = channels.iter().zip(centre).map(|(x, c)| x.iter().map(|x| x - c).collect()).collect();
        [0, 1, 2].map(|order| {
            let kernel = self.differentiator(order);
            about.par_iter().map(|x| kernel.apply(x)).collect()
        })
    }

    /// Rows of [regressors of each motion | mean | efforts].
    ///
    /// A column is h * (φ_k(s) x): the product comes first and the kernel after it, as on the effort's side of the equation. The kernel alone
    /// would not do: it does not commute with a changing stiffness.
    pub(super) fn rows(&self, stretches: &[Stretch<'_>], motions: &[Vec<&Motion>]) -> Rows {
        let kernel = Kernel::new(self.high_hz, FALL * self.high_hz, self.rate_hz, 0);
        let kinds = motions.first().map_or(0, Vec::len);
        let width = kinds * self.regressors() + self.mean.count() + self.axes;
        let mut rows = Rows { width, values: Vec::new(), stretches: Vec::new(), block: Vec::new() };
        for (stretch, motion) in stretches.iter().zip(motions) {
            let (half, mut begun) = (kernel.half(), rows.block.len());
            for centre in (half..stretch.schedule.len().saturating_sub(half)).step_by(self.step) {
                if self.push_row(&mut rows, stretch, motion, &kernel, centre) {
                    rows.block.push(stretch.block[centre]);
                } else if begun < rows.block.len() {
                    rows.stretches.push(begun..rows.block.len());
                    begun = rows.block.len();
                }
            }
            if begun < rows.block.len() {
                rows.stretches.push(begun..rows.block.len());
            }
        }
        rows
    }

    /// Adds the row about one sample; false where a value is missing within the kernel's reach.
    fn push_row(&self, rows: &mut Rows, stretch: &Stretch<'_>, motion: &[&Motion], kernel: &Kernel, centre: usize) -> bool {
        let from = centre - kernel.half();
        let count = kernel.taps().len();
        let seen = from..from + count;
        let known = |m: &&Motion| m[0].iter().all(|x| x[from].is_finite() && x[from + count - 1].is_finite());
        if !motion.iter().all(known) || stretch.schedule[seen.clone()].iter().any(|s| !s.is_finite()) {
            return false;
        }
        let begin = rows.values.len();
        rows.values.resize(begin + rows.width, 0.0);
        let row = &mut rows.values[begin..];
        let mean_at = motion.len() * self.regressors();
        let effort_at = mean_at + self.mean.count();
        // The kernel is symmetric: forwards or backwards is one.
        for (t, tap) in seen.zip(kernel.taps()) {
            let s = stretch.schedule[t];
            for (k, value) in self.splines.at(s) {
                let weight = tap * value;
                for (kind, motion) in motion.iter().enumerate() {
                    for (order, axes) in motion.iter().enumerate() {
                        for (axis, x) in axes.iter().enumerate() {
                            row[kind * self.regressors() + self.column(order, axis, k)] += weight * x[t];
                        }
                    }
                }
            }
            self.mean.at(s).into_iter().for_each(|(k, value)| row[mean_at + k] += tap * value);
            (0..self.axes).for_each(|axis| row[effort_at + axis] += tap * stretch.effort[axis][t]);
        }
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    /// effort = K(s) x with a stiffness that changes fast: products first and kernel after them leave nothing over.
    #[test]
    fn the_rows_hold_the_equation_while_the_stiffness_changes() {
        let (rate, samples) = (500.0, 3000);
        let splines = Splines::new(12, true);
        let stiffness: Vec<f64> = (0..12).map(|k| 50.0 + 40.0 * f64::from(k * 5 % 7)).collect();
        let phase: Vec<f64> = (0..samples).map(|t| (t as f64 / rate).fract()).collect();
        let x: Vec<f64> = (0..samples).map(|t| (TAU * 7.3 * t as f64 / rate).sin() + 0.5 * (TAU * 2.1 * t as f64 / rate).cos()).collect();
        let effort: Vec<f64> = x.iter().zip(&phase).map(|(x, s)| x * splines.row(*s).iter().zip(&stiffness).map(|(a, b)| a * b).sum::<f64>()).collect();
        let stretch = Stretch { effort: vec![&effort], motion: vec![&x], command: vec![], schedule: phase, block: vec![0; samples] };
        let layout = Layout::new(1, (splines, Splines::new(4, true)), rate, 12.0).expect("a band");
        let motion = layout.motion(&stretch.motion, &[0.0]);
        let rows = layout.rows(&[stretch], &[vec![&motion]]);
        assert!(rows.block.len() > 50 && rows.stretches.len() == 1);
        for row in rows.values.chunks_exact(rows.width) {
            let found: f64 = (0..12).map(|k| row[layout.column(0, 0, k)] * stiffness[k]).sum();
            // Ripple of the differentiating kernel: two parts in ten thousand of an effort of about 200.
            assert!((found - row[rows.width - 1]).abs() < 0.1, "{found} for {}", row[rows.width - 1]);
        }
    }

    #[test]
    fn a_band_without_room_is_refused() {
        let splines = Splines::new(8, true);
        assert!(matches!(Layout::new(1, (splines, splines), 100.0, 20.0), Err(ScheduleError::Band { .. })));
    }
}
