//! Irregular samples onto a regular grid.

use crate::error::IoError;
use crate::limits::MAX_RESAMPLE_GROWTH;
use crate::options::Resample;
use crate::table::Table;
use crate::time::Stamps;
use ndof_signal::interpolated;

/// The longest gap that is interpolated over, in median steps: beyond it the curve between is invention.
pub(crate) const MAX_GAP_STEPS: f64 = 10.0;

/// A regular grid laid over irregular stamps.
pub(crate) struct Grid {
    pub rate_hz: f64,
    pub start_s: f64,
    pub len: usize,
    /// The longest step of the stamps.
    pub longest_gap_s: f64,
}

/// The grid for `stamps`, refused where a gap is too long or the rate asked for would alias.
pub(crate) fn grid(file: &str, table: &Table, stamps: &Stamps<'_>, how: Resample) -> Result<Grid, IoError> {
    let t = stamps.times_s;
    let own_hz = 1.0 / stamps.median_step_s;
    let rate_hz = match how {
        Resample::Auto => own_hz,
        Resample::Hz(rate_hz) if !(rate_hz.is_finite() && rate_hz > 0.0) => {
            return Err(IoError::BadRate { file: file.to_owned(), what: "the rate to resample to", rate_hz });
        }
        // One percent: the median step of a jittering clock is not its mean.
        Resample::Hz(rate_hz) if rate_hz < 0.99 * own_hz => return Err(IoError::ResampleDown { file: file.to_owned(), asked_hz: rate_hz, rate_hz: own_hz }),
        Resample::Hz(rate_hz) => rate_hz,
    };
    let mut longest_gap_s = 0.0;
    for k in 1..t.len() {
        let gap_s = t[k] - t[k - 1];
        let steps = gap_s / stamps.median_step_s;
        if steps > MAX_GAP_STEPS {
            return Err(IoError::Gap { file: file.to_owned(), place: table.place(k), gap_s, steps, limit: MAX_GAP_STEPS });
        }
        longest_gap_s = f64::max(longest_gap_s, gap_s);
    }
    // A last point that misses the end by rounding alone still counts.
    let len = ((t[t.len() - 1] - t[0]) * rate_hz + 1e-6).floor() + 1.0;
    let limit = MAX_RESAMPLE_GROWTH * t.len() as f64;
    if len > limit {
        return Err(IoError::too_large(file, "samples after resampling", len as usize, limit as usize, "ask for a lower rate"));
    }
    Ok(Grid { rate_hz, start_s: t[0], len: len as usize, longest_gap_s })
}

/// Samples `values`, taken at `times_s`, on `grid`.
pub(crate) fn interpolate(times_s: &[f64], values: &[f64], grid: &Grid) -> Vec<f64> {
    interpolated(times_s, values, (0..grid.len).map(|i| grid.start_s + i as f64 / grid.rate_hz))
}

/// Samples at a regular rate as a curve in time from the first sample on.
pub(crate) struct Curve<'a> {
    rate_hz: f64,
    samples: &'a [f64],
}

impl<'a> Curve<'a> {
    pub fn new(rate_hz: f64, samples: &'a [f64]) -> Self {
        Curve { rate_hz, samples }
    }

    /// The time of the last sample.
    pub fn end_s(&self) -> f64 {
        self.samples.len().saturating_sub(1) as f64 / self.rate_hz
    }

    /// The value at `t_s`, by Lagrange's cubic through the four nearest samples; at the ends the value there, NaN
    /// without samples.
    pub fn at(&self, t_s: f64) -> f64 {
        let y = self.samples;
        let n = y.len();
        let place = (t_s * self.rate_hz).clamp(0.0, n.saturating_sub(1) as f64);
        if n < 4 {
            return y.get(place.round() as usize).copied().unwrap_or(f64::NAN);
        }
        let k = (place as usize).clamp(1, n - 3);
        let u = place - k as f64;
        let (a, b, c) = (u + 1.0, u - 1.0, u - 2.0);
        y[k - 1] * (-u * b * c / 6.0) + y[k] * (a * b * c / 2.0) + y[k + 1] * (-a * u * c / 2.0) + y[k + 2] * (a * u * b / 6.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::table::Rounding;

    /// Round-off of a handful of operations on numbers of order one.
    const IDENTITY: f64 = 1e-13;

    #[test]
    fn a_regular_curve_is_exact_for_cubics_up_to_its_ends() {
        let cubic = |t: f64| 1.0 - t + 0.5 * t * t - 0.25 * t * t * t;
        let samples: Vec<f64> = (0..9).map(|k| cubic(f64::from(k) / 8.0)).collect();
        let curve = Curve::new(8.0, &samples);
        for i in 0..=100 {
            let t = f64::from(i) / 100.0;
            assert!((curve.at(t) - cubic(t)).abs() < IDENTITY, "{t}");
        }
        assert_eq!(curve.end_s(), 1.0);
    }

    #[test]
    fn a_long_gap_is_refused_with_its_place() {
        let mut times: Vec<f64> = (0..100).map(f64::from).collect();
        times.drain(50..65);
        let table = Table::default();
        let stamps = Stamps::new("f", &table, &times, Rounding::default()).unwrap();
        assert!(matches!(grid("f", &table, &stamps, Resample::Auto), Err(IoError::Gap { place: crate::Place::Sample(50), .. })));
    }

    #[test]
    fn a_rate_below_the_files_own_is_refused() {
        let times: Vec<f64> = (0..100).map(f64::from).collect();
        let table = Table::default();
        let stamps = Stamps::new("f", &table, &times, Rounding::default()).unwrap();
        assert!(matches!(grid("f", &table, &stamps, Resample::Hz(0.5)), Err(IoError::ResampleDown { .. })));
        assert!(matches!(grid("f", &table, &stamps, Resample::Hz(1e9)), Err(IoError::TooLarge { .. })));
    }
}
