//! From a column of time to a rate, or to the place where it is irregular.

use crate::error::IoError;
use crate::table::{Rounding, Table};

/// A step may differ from the median step by this share, besides the rounding of the written numbers: clocks of
/// acquisition cards jitter by less, one lost sample is a thousand times more.
const STEP_TOLERANCE: f64 = 1e-3;

/// Rounded time stamps are believed to be regular only where the rounding is finer than this share of the step;
/// beyond it a lost sample would pass for rounding.
const MAX_ROUNDING_OF_STEP: f64 = 0.25;

/// The whole clock may leave the regular grid by this share of a step, besides rounding.
const DRIFT_TOLERANCE: f64 = 0.1;

/// A regular clock.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Clock {
    pub rate_hz: f64,
    pub start_s: f64,
    /// How well the rate is known from the stamps, relative.
    pub relative_error: f64,
}

/// What is known of a time column, in seconds, that increases.
pub(crate) struct Stamps<'a> {
    pub times_s: &'a [f64],
    pub rounding: Rounding,
    pub median_step_s: f64,
}

impl<'a> Stamps<'a> {
    /// Checks that time increases; `times_s` holds finite numbers.
    pub fn new(file: &str, table: &Table, times_s: &'a [f64], rounding: Rounding) -> Result<Self, IoError> {
        if times_s.len() < 2 {
            return Err(IoError::OneSample { file: file.to_owned(), rows: times_s.len() });
        }
        if let Some(k) = times_s.windows(2).position(|w| w[1] <= w[0]) {
            return Err(IoError::TimeBackwards { file: file.to_owned(), place: table.place(k + 1), before_s: times_s[k], after_s: times_s[k + 1] });
        }
        let mut steps: Vec<f64> = times_s.windows(2).map(|w| w[1] - w[0]).collect();
        let middle = steps.len() / 2;
        let (_, &mut median_step_s, _) = steps.select_nth_unstable_by(middle, f64::total_cmp);
        Ok(Stamps { times_s, rounding, median_step_s })
    }

    /// The clock, if the steps are equal within the rounding of the stamps.
    pub fn regular(&self, file: &str, table: &Table) -> Result<Clock, IoError> {
        let t = self.times_s;
        let n = t.len();
        let (first, last) = (t[0], t[n - 1]);
        let step = (last - first) / (n - 1) as f64;
        let coarseness = self.rounding.about(first.abs().max(last.abs()));
        let rounding = if coarseness <= MAX_ROUNDING_OF_STEP * self.median_step_s { coarseness } else { 0.0 };
        // Subtracting two stamps costs an epsilon of each.
        let arithmetic = 2.0 * f64::EPSILON * first.abs().max(last.abs());
        // The median is itself one of the rounded steps, hence twice the rounding of one step.
        let tolerance = STEP_TOLERANCE * self.median_step_s + 2.0 * rounding + arithmetic;
        let irregular = |k: &usize| (t[*k] - t[*k - 1] - self.median_step_s).abs() > tolerance;
        let off_grid = |k: &usize| (t[*k] - first - step * *k as f64).abs() > DRIFT_TOLERANCE * step + 2.0 * rounding + arithmetic;
        let mut bad = (1..n).filter(irregular);
        let found = bad.next().map(|k| (k, 1 + bad.count())).or_else(|| {
            let mut off = (1..n).filter(off_grid);
            off.next().map(|k| (k, 1 + off.count()))
        });
        if let Some((k, count)) = found {
            return Err(IoError::IrregularTime {
                file: file.to_owned(),
                place: table.place(k),
                found_s: tidy(t[k] - t[k - 1]),
                expected_s: tidy(self.median_step_s),
                count,
                steps: n - 1,
            });
        }
        let worst = (0..n).map(|k| (t[k] - first - step * k as f64).abs()).fold(0.0, f64::max);
        let relative_error = (2.0 * worst + rounding + arithmetic) / (last - first);
        Ok(Clock { rate_hz: simplest(1.0 / step, relative_error), start_s: first, relative_error })
    }
}

/// Nine digits, for people to read.
fn tidy(value: f64) -> f64 {
    format!("{value:.8e}").parse().unwrap_or(value)
}

/// The rate with the fewest digits, as a rate or as a step, among those that the stamps cannot tell from `rate_hz`.
pub(crate) fn simplest(rate_hz: f64, relative_error: f64) -> f64 {
    let margin = relative_error + 4.0 * f64::EPSILON;
    let round_to = |value: f64, digits: usize| format!("{value:.digits$e}").parse().unwrap_or(value);
    let shortest = |value: f64| (0..17).map(|digits| (digits, round_to(value, digits))).find(|(_, r)| (r / value - 1.0).abs() <= margin);
    match (shortest(rate_hz), shortest(1.0 / rate_hz)) {
        (Some((d_rate, _)), Some((d_step, step))) if d_step < d_rate => 1.0 / step,
        (Some((_, rate)), _) => rate,
        (None, _) => rate_hz,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn clock(times: &[f64], rounding: Rounding) -> Result<Clock, IoError> {
        let table = Table::default();
        Stamps::new("f", &table, times, rounding)?.regular("f", &table)
    }

    fn rounded(rate: f64, n: usize, place: f64) -> Vec<f64> {
        (0..n).map(|k| (k as f64 / rate / place).round() * place).collect()
    }

    #[test]
    fn a_rate_comes_out_with_its_few_digits() {
        for rate in [1.0, 128.0, 500.0, 1000.0, 44100.0] {
            let times: Vec<f64> = (0..5000).map(|k| 3.0 + k as f64 / rate).collect();
            assert_eq!(clock(&times, Rounding::default()).unwrap().rate_hz, rate);
        }
        let thirds: Vec<f64> = (0..5000).map(|k| k as f64 * 0.003).collect();
        assert_eq!(clock(&thirds, Rounding::default()).unwrap().rate_hz, 1.0 / 0.003);
    }

    #[test]
    fn stamps_rounded_to_milliseconds_are_regular() {
        let rounding = Rounding { place: 1e-3, ..Default::default() };
        let rate = clock(&rounded(128.0, 6400, 1e-3), rounding).unwrap().rate_hz;
        assert!((rate / 128.0 - 1.0).abs() < 1e-3 / 49.0, "{rate}");
    }

    #[test]
    fn one_lost_sample_is_found_however_the_stamps_are_rounded() {
        for (rate, place) in [(128.0, 1e-3), (500.0, 1e-3), (1000.0, 1e-3), (1000.0, 1e-6)] {
            let mut times = rounded(rate, 1000, place);
            times.remove(400);
            let error = clock(&times, Rounding { place, ..Default::default() }).unwrap_err();
            assert!(matches!(error, IoError::IrregularTime { place: crate::Place::Sample(400), count: 1, .. }), "{rate}: {error}");
        }
    }

    #[test]
    fn a_clock_that_drifts_slowly_is_irregular() {
        let times: Vec<f64> = (0..10_000).map(|k| k as f64 * 1e-3 * (1.0 + 4e-8 * k as f64)).collect();
        assert!(matches!(clock(&times, Rounding::default()), Err(IoError::IrregularTime { .. })));
    }

    #[test]
    fn time_that_stands_still_is_an_error() {
        assert!(matches!(clock(&[0.0, 1.0, 1.0], Rounding::default()), Err(IoError::TimeBackwards { .. })));
        assert!(matches!(clock(&[0.0], Rounding::default()), Err(IoError::OneSample { .. })));
    }
}
