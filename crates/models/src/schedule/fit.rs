//! Inertia, damping and stiffness over a schedule from stretches of record.

use super::ScheduleError;
use super::band::standard_errors;
use super::design::{Layout, Motion, Rows};
use super::held_out::Folds;
use super::instrument::{Foretold, foretold};
use super::mean::MeanOver;
use super::moments::{Columns, Normal, Products, Varying};
use super::noise::{autoregression, whitened};
use super::penalised::{Penalised, penalised};
use super::record::Stretch;
use super::result::{MeanMovement, RowCurves, Scheduled, ScheduledEntry, Term};
use super::spline::Splines;
use super::variation::probability_if_constant;
use crate::fit::t_quantile;
use faer::Mat;
use ndarray::Array2;
use rayon::prelude::*;

/// Curves are given at each hundredth of the schedule, as gait analysis does of the cycle.
const PLACES: usize = 100;
/// Rounds of fit and autoregression: residuals are efficient from the second on, and by the fourth the numbers stay within a millionth.
const ROUNDS: usize = 4;

/// How a scheduled fit is made.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ScheduledFit {
    /// Samples a second.
    pub rate_hz: f64,
    /// Upper end of the band (Hz), a sixth of the rate at most.
    pub high_hz: f64,
    /// Splines of each entry that varies; the penalty decides how much of their freedom is used.
    pub knots: usize,
    /// Splines of the mean effort: four a period of the band's upper end follow a mean movement as far as the band goes.
    pub mean_knots: usize,
    /// Whether the end of the schedule is its beginning, as of a phase.
    pub closed: bool,
    /// Whether stiffness varies.
    pub stiffness: bool,
    /// Whether damping varies.
    pub damping: bool,
    /// Whether inertia varies.
    pub inertia: bool,
}

/// All that was made of the data, and the fits of all rows.
struct Work {
    layout: Layout,
    rows: Rows,
    varying: Varying,
    roughness: Array2<f64>,
}

/// The fit of one row of the matrices.
struct Row {
    fit: Penalised,
    autoregression: Vec<f64>,
    white: Products,
}

impl ScheduledFit {
    /// Fits all stretches together.
    ///
    /// # Errors
    /// [`ScheduleError`] where channels do not belong together, the band has no room, or the data do not determine so many splines.
    ///
    /// ```
    /// use ndof_models::schedule::{ScheduledFit, Stretch, Term};
    ///
    /// // One axis, 0.2 kg and 2 N s/m, whose stiffness goes from 20 to 100 N/m and back in each cycle of 1 s; the motion is imposed.
    /// let (rate_hz, turn) = (200.0, std::f64::consts::TAU);
    /// let time: Vec<f64> = (0..12_000).map(|k| k as f64 / rate_hz).collect();
    /// let sines = [(1.3, 0.1), (2.9, 1.7), (4.7, 0.6), (7.1, 2.9)];
    /// let sum = |term: &dyn Fn(f64, f64) -> f64| sines.iter().map(|(hz, phase)| 0.01 * term(turn * hz, *phase)).sum::<f64>();
    /// let x: Vec<f64> = time.iter().map(|t| sum(&|w, p| (w * t + p).sin())).collect();
    /// let stiffness = |t: f64| 60.0 - 40.0 * (turn * t).cos();
    /// let effort: Vec<f64> = time
    ///     .iter()
    ///     .zip(&x)
    ///     .map(|(t, x)| 0.2 * sum(&|w, p| -w * w * (w * t + p).sin()) + 2.0 * sum(&|w, p| w * (w * t + p).cos()) + stiffness(*t) * x)
    ///     .collect();
    /// let stretch = Stretch {
    ///     effort: vec![&effort],
    ///     motion: vec![&x],
    ///     command: vec![],
    ///     schedule: time.iter().map(|t| t.fract()).collect(),
    ///     block: time.iter().map(|t| *t as usize).collect(),
    /// };
    /// let settings = ScheduledFit { rate_hz, high_hz: 12.0, knots: 16, mean_knots: 48, closed: true, stiffness: true, damping: true, inertia: false };
    /// let found = settings.run(&[stretch])?;
    /// let k = &found.entry(Term::Stiffness, 0, 0).ok_or("no stiffness")?.value;
    /// assert!((k[0] - 20.0).abs() < 1.0 && (k[50] - 100.0).abs() < 1.0);
    /// assert!(1.0 - found.vaf_varying[0] < 1e-3 * (1.0 - found.vaf_constant[0]));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn run(&self, stretches: &[Stretch<'_>]) -> Result<Scheduled, ScheduleError> {
        let (axes, commands) = Stretch::check(stretches)?;
        let (layout, splines) = (self.layout(axes)?, Splines::new(self.knots, self.closed));
        let motions = layout.motions(stretches);
        let instrument: Option<Foretold> = (commands > 0).then(|| foretold(&layout, stretches, &motions)).transpose()?;
        let still = vec![0.0; axes];
        let slices = |told: &'_ [Vec<f64>]| layout.motion(&told.iter().map(Vec::as_slice).collect::<Vec<_>>(), &still);
        let told: Vec<Motion> = instrument.iter().flat_map(|told| told.motion.iter().map(|told| slices(told))).collect();
        let kinds: Vec<Vec<&Motion>> = motions.iter().enumerate().map(|(k, own)| std::iter::once(own).chain(told.get(k)).collect()).collect();
        let rows = layout.rows(stretches, &kinds);
        let needed = layout.regressors() + layout.mean.count() + 1;
        if rows.block.len() < 2 * needed {
            return Err(ScheduleError::TooShort { rows: rows.block.len(), needed: 2 * needed });
        }
        let work = Work { roughness: splines.roughness(), layout, rows, varying: [self.stiffness, self.damping, self.inertia] };
        let columns = Columns::new(&work.layout, work.varying);
        let fits: Vec<Result<Row, ScheduleError>> = (0..axes).into_par_iter().map(|output| work.row(&columns, output)).collect();
        let fits: Vec<Row> = fits.into_iter().collect::<Result<_, _>>()?;
        let at: Vec<f64> = (0..=PLACES).map(|k| k as f64 / PLACES as f64).collect();
        let [vaf_constant, vaf_varying, folds] = work.held_out(&columns, &fits)?;
        Ok(Scheduled {
            entries: work.entries(&columns, &fits, &at),
            probability_if_constant: work.tests(&fits)?,
            mean: mean_movement(stretches, work.layout.mean, &at)?,
            at,
            vaf_constant,
            vaf_varying,
            noise_order: fits.iter().map(|row| row.autoregression.len()).collect(),
            rows: work.rows.block.len(),
            folds: folds.first().map_or(0, |folds| *folds as usize),
            foretold: instrument.map(|told| told.share),
            splines,
            curves: fits.iter().map(|row| row.curves(&columns)).collect(),
        })
    }

    /// The motion as the command foretells it: an instrument for whatever is fitted to a limb that is pushed by force.
    ///
    /// # Errors
    /// As [`ScheduledFit::run`]; [`ScheduleError::Undetermined`] too where there is no command.
    pub fn foretold(&self, stretches: &[Stretch<'_>]) -> Result<Foretold, ScheduleError> {
        let (axes, commands) = Stretch::check(stretches)?;
        let layout = self.layout(axes)?;
        if commands == 0 {
            return Err(ScheduleError::Undetermined);
        }
        foretold(&layout, stretches, &layout.motions(stretches))
    }

    fn layout(&self, axes: usize) -> Result<Layout, ScheduleError> {
        Layout::new(axes, [self.knots, self.mean_knots].map(|count| Splines::new(count, self.closed)).into(), self.rate_hz, self.high_hz)
    }
}

impl Row {
    fn curves(&self, columns: &Columns) -> RowCurves {
        let own = columns.summed.len();
        RowCurves {
            coefficients: (0..own).map(|k| self.fit.beta[(k, 0)]).collect(),
            covariance: self.fit.covariance.clone(),
            pointwise: t_quantile(self.fit.freedom),
            entries: columns.entries.clone(),
        }
    }
}

impl Work {
    /// One row of the matrices: fit, autoregression of what it leaves, and the fit of the whitened rows.
    fn row(&self, columns: &Columns, output: usize) -> Result<Row, ScheduleError> {
        let mut white = Products::of(&self.rows);
        let mut noise = Vec::new();
        for round in 0..=ROUNDS {
            let normal = Normal::new(&white, &self.layout, &columns.summed, output)?;
            let fit = penalised(&normal, columns.summed.len(), &columns.groups, &self.roughness, None)?;
            if round == ROUNDS {
                return Ok(Row { fit, autoregression: noise, white });
            }
            noise = autoregression(&self.rows, &self.residual(columns, &fit.beta, output));
            white = Products::of(&whitened(&self.rows, &noise));
        }
        Err(ScheduleError::Undetermined)
    }

    /// What the measured motion leaves of an effort, row by row.
    fn residual(&self, columns: &Columns, beta: &Mat<f64>, output: usize) -> Vec<f64> {
        let effort = self.rows.width - self.layout.axes + output;
        let mean = self.rows.width - self.layout.axes - self.layout.mean.count();
        let mut of_column = vec![0.0; self.rows.width];
        columns.summed.iter().enumerate().for_each(|(k, summed)| summed.iter().for_each(|c| of_column[*c] = beta[(k, 0)]));
        (0..self.layout.mean.count()).for_each(|k| of_column[mean + k] = beta[(columns.summed.len() + k, 0)]);
        let told = |row: &[f64]| row.iter().zip(&of_column).map(|(x, b)| x * b).sum::<f64>();
        self.rows.values.chunks_exact(self.rows.width).map(|row| row[effort] - told(row)).collect()
    }

    /// Every entry with its bands.
    fn entries(&self, columns: &Columns, fits: &[Row], at: &[f64]) -> Vec<ScheduledEntry> {
        let axes = self.layout.axes;
        let curves: Vec<Vec<f64>> = at.iter().map(|u| self.layout.splines.row(*u)).collect();
        let one = |matrix: usize, row: usize, column: usize| {
            let (first, varies) = columns.entries[matrix * axes + column];
            let constant = vec![vec![1.0]; at.len()];
            let (rows, fit) = (if varies { &curves } else { &constant }, &fits[row].fit);
            let (std_error, wide) = standard_errors(rows, |i, j| fit.covariance[(first + i, first + j)]);
            let pointwise = t_quantile(fit.freedom);
            let group = columns.groups.iter().position(|g| *g == first);
            ScheduledEntry {
                term: Term::ALL[matrix],
                row,
                column,
                varies,
                value: rows.iter().map(|r| r.iter().enumerate().map(|(k, v)| v * fit.beta[(first + k, 0)]).sum()).collect(),
                std_error,
                pointwise,
                simultaneous: wide.max(pointwise),
                degrees_of_freedom: group.map_or(1.0, |g| fit.degrees[g]),
            }
        };
        let all = (0..3).flat_map(|matrix| (0..axes * axes).map(move |e| (matrix, e / axes, e % axes)));
        all.map(|(matrix, row, column)| one(matrix, row, column)).collect()
    }

    /// The test of each matrix over its rows, by the inequality of Bonferroni.
    fn tests(&self, fits: &[Row]) -> Result<[f64; 3], ScheduleError> {
        let mut out = [1.0; 3];
        for (matrix, least) in out.iter_mut().enumerate() {
            for (output, row) in fits.iter().enumerate() {
                let p = probability_if_constant(&row.white, &self.layout, (output, matrix, self.varying), &self.roughness)?;
                *least = f64::min(*least, p * self.layout.axes as f64);
            }
        }
        Ok(out)
    }

    /// Shares of held-out variance: constant, varying; and by how many folds.
    fn held_out(&self, columns: &Columns, fits: &[Row]) -> Result<[Vec<f64>; 3], ScheduleError> {
        let constant = Columns::new(&self.layout, [false; 3]);
        let [mut of_constant, mut of_varying, mut count] = [Vec::new(), Vec::new(), Vec::new()];
        for (output, row) in fits.iter().enumerate() {
            let Some(folds) = Folds::new(&self.rows, &row.autoregression) else { break };
            of_constant.push(folds.share(&self.layout, &constant, output, &self.roughness, &[])?);
            of_varying.push(folds.share(&self.layout, columns, output, &self.roughness, &row.fit.weights)?);
            count.push(folds.count() as f64);
        }
        Ok([of_constant, of_varying, count])
    }
}

/// The mean of each channel over the schedule, from its samples as they are: rows hold nothing above the band, where finer splines would run wild.
fn mean_movement(stretches: &[Stretch<'_>], splines: Splines, at: &[f64]) -> Result<MeanMovement, ScheduleError> {
    let over = MeanOver::new(stretches.iter().map(|stretch| stretch.schedule.clone()).collect(), splines)?;
    let mean = |channels: Vec<&[f64]>| -> Vec<f64> {
        let coefficients = over.coefficients(&channels);
        at.iter().map(|u| splines.value(&coefficients, *u)).collect()
    };
    let axes = 0..stretches.first().map_or(0, |stretch| stretch.motion.len());
    Ok(MeanMovement {
        effort: axes.clone().map(|axis| mean(stretches.iter().map(|s| s.effort[axis]).collect())).collect(),
        motion: axes.map(|axis| mean(stretches.iter().map(|s| s.motion[axis]).collect())).collect(),
    })
}
