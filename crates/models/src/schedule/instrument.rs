//! The motion as the command foretells it: instruments for a limb that is pushed by force.

use super::ScheduleError;
use super::design::{Layout, Motion};
use super::record::Stretch;
use super::spline::Splines;
use faer::linalg::solvers::Solve;
use faer::{Mat, MatRef, Side};

/// Splines of the impulse responses over the schedule: the limb's answer may change with the phase, only less finely than its stiffness,
/// as an instrument need not be exact.
const COARSE: usize = 6;
/// How many lags are tried, four a period of the band's upper end.
const LAGS: [usize; 4] = [8, 16, 32, 64];
/// A hundred-millionth of the command's power keeps responses finite where the command says nothing.
const RIDGE: f64 = 1e-8;

/// The motion as the command foretells it, about its mean over the schedule, and how much of it that is.
#[derive(Clone, Debug, PartialEq)]
pub struct Foretold {
    /// `[stretch][axis][time]`; not a number where the schedule is none.
    pub motion: Vec<Vec<Vec<f64>>>,
    /// Share of the motion's variance about its mean over the schedule that the command foretells, an axis.
    pub share: Vec<f64>,
}

/// x̂(t) = Σ_l Σ_q h_ql φ_q(s(t)) c(t − l Δ) by least squares, the mean over the schedule beside it, with as many lags as Schwarz's
/// criterion gives. It holds nothing of the limb's own noise but through h: a
/// few hundred numbers out of many thousand samples.
pub(super) fn foretold(layout: &Layout, stretches: &[Stretch<'_>], measured: &[Motion]) -> Result<Foretold, ScheduleError> {
    let coarse = Splines::new(COARSE, layout.splines.closed());
    let lag = (layout.rate_hz / (4.0 * layout.high_hz)).round().max(1.0) as usize;
    let kernel = layout.differentiator(0);
    let commands: Vec<Vec<Vec<f64>>> = stretches.iter().map(|s| s.command.iter().map(|c| kernel.apply(c)).collect()).collect();
    let inputs = commands.first().map_or(0, Vec::len);
    let (axes, mean) = (layout.axes, layout.mean.count());
    let (most, unit) = (LAGS[LAGS.len() - 1], inputs * COARSE);
    // [mean | lags, each commands × splines | motion]: fewer lags are a leading part.
    let width = mean + most * unit + axes;
    let mut values = Vec::new();
    for ((stretch, commands), motion) in stretches.iter().zip(&commands).zip(measured) {
        for t in (0..stretch.schedule.len()).step_by(lag) {
            let (s, here): (f64, Vec<f64>) = (stretch.schedule[t], motion[0].iter().map(|x| x[t]).collect());
            if s.is_finite() && here.iter().all(|x| x.is_finite()) {
                values.extend(layout.mean.row(s));
                values.extend(command_row(coarse, s, commands, t, (lag, most)));
                values.extend(here);
            }
        }
    }
    let rows = values.len() / width;
    let all = MatRef::from_row_major_slice(&values, rows, width);
    let gram: Mat<f64> = all.transpose() * all;
    let mut chosen: Option<(f64, usize, Mat<f64>, Vec<f64>)> = None;
    for lags in LAGS {
        let size = mean + lags * unit;
        if 2 * size > rows {
            break;
        }
        let Some((solution, left)) = solve(&gram, size, axes) else { continue };
        let criterion = rows as f64 * left.iter().map(|e| e.ln()).sum::<f64>() + (size * axes) as f64 * (rows as f64).ln();
        if chosen.as_ref().is_none_or(|(least, ..)| criterion < *least) {
            chosen = Some((criterion, lags, solution, left));
        }
    }
    let (_, lags, solution, left) = chosen.ok_or(ScheduleError::TooShort { rows, needed: 2 * (mean + LAGS[0] * unit) })?;
    let (_, whole) = solve(&gram, mean, axes).ok_or(ScheduleError::Undetermined)?;
    let share = left.iter().zip(&whole).map(|(left, whole)| 1.0 - left / whole).collect();
    let motion = stretches.iter().zip(&commands).map(|(stretch, commands)| {
        let mut told = vec![vec![0.0; stretch.schedule.len()]; axes];
        for t in 0..stretch.schedule.len() {
            let row = command_row(coarse, stretch.schedule[t], commands, t, (lag, lags));
            for (axis, told) in told.iter_mut().enumerate() {
                told[t] = row.iter().enumerate().map(|(k, c)| c * solution[(mean + k, axis)]).sum();
            }
        }
        told
    });
    Ok(Foretold { motion: motion.collect(), share })
}

/// Past commands times splines at one sample; NaN where the schedule is not known. What was commanded before the stretch counts as nothing:
/// an instrument need not be exact.
fn command_row(coarse: Splines, s: f64, commands: &[Vec<f64>], t: usize, (lag, lags): (usize, usize)) -> Vec<f64> {
    let mut row = vec![if s.is_finite() { 0.0 } else { f64::NAN }; lags * commands.len() * COARSE];
    for l in (0..lags).take_while(|l| s.is_finite() && l * lag <= t) {
        for (input, command) in commands.iter().enumerate() {
            let c = Some(command[t - l * lag]).filter(|c| c.is_finite()).unwrap_or(0.0);
            coarse.at(s).into_iter().for_each(|(q, value)| row[(l * commands.len() + input) * COARSE + q] = value * c);
        }
    }
    row
}

/// Coefficients of the leading columns for each of the last ones, and what they leave of those.
fn solve(gram: &Mat<f64>, size: usize, axes: usize) -> Option<(Mat<f64>, Vec<f64>)> {
    let first = gram.ncols() - axes;
    let ridge = |i: usize, j: usize| if i == j { 1.0 + RIDGE } else { 1.0 };
    let left = Mat::from_fn(size, size, |i, j| gram[(i, j)] * ridge(i, j));
    let right = Mat::from_fn(size, axes, |i, j| gram[(i, first + j)]);
    let solution = left.llt(Side::Lower).ok()?.solve(&right);
    let explained = |j: usize| (0..size).map(|i| right[(i, j)] * solution[(i, j)]).sum::<f64>();
    let rest = (0..axes).map(|j| gram[(first + j, first + j)] - explained(j)).collect();
    Some((solution, rest))
}
