//! A response with its errors and intervals, as results hold them.

use crate::result::estimate::Response;
use crate::result::number;
use ndof_sysid::{FrequencyResponse, GainPhase};

/// Rearranges `[f][p][q]` by `value(f, i, j)` to `[p][q][f]`.
pub(super) fn spectrum<T>(frequencies: usize, rows: usize, columns: usize, value: impl Fn(usize, usize, usize) -> T) -> Vec<Vec<Vec<T>>> {
    (0..rows).map(|i| (0..columns).map(|j| (0..frequencies).map(|f| value(f, i, j)).collect()).collect()).collect()
}

/// The response with standard errors and 95 % intervals of gain and phase.
pub(super) fn response_with_errors(response: &FrequencyResponse) -> Response {
    let (p, q) = response.shape();
    let entries: Vec<Vec<Vec<GainPhase>>> = (0..p).map(|i| (0..q).map(|j| response.gain_phase(i, j, 0.95)).collect()).collect();
    let frequencies = response.len();
    let of = |value: &dyn Fn(&GainPhase) -> f64| spectrum(frequencies, p, q, |f, i, j| number(value(&entries[i][j][f])));
    Response {
        re: spectrum(frequencies, p, q, |f, i, j| number(response.value[[f, i, j]].re)),
        im: spectrum(frequencies, p, q, |f, i, j| number(response.value[[f, i, j]].im)),
        gain_std_error: of(&|entry| entry.gain_std_error),
        phase_std_error_rad: of(&|entry| entry.phase_std_error_rad),
        gain_ci95: spectrum(frequencies, p, q, |f, i, j| finite(entries[i][j][f].gain_interval)),
        phase_ci95_rad: spectrum(frequencies, p, q, |f, i, j| entries[i][j][f].phase_interval_rad.and_then(finite)),
    }
}

/// An interval, if both ends are numbers.
pub(super) fn finite(interval: [f64; 2]) -> Option<[f64; 2]> {
    interval.iter().all(|end| end.is_finite()).then_some(interval)
}
