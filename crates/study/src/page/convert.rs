//! Result types to the plain data that pictures are drawn from.

use crate::result::estimate::Spectrum;
use crate::result::{Number, Warning};
use ndarray::{Array2, Array3};
use ndof_report::figures::{Curve, CurveStyle};
use ndof_sysid::FrequencyResponse;

/// `[p][q][f]` with NaN for what does not exist.
pub(super) fn cube(values: &Spectrum) -> Array3<f64> {
    let (p, q, f) = (values.len(), values.first().map_or(0, Vec::len), values.first().and_then(|row| row.first()).map_or(0, Vec::len));
    Array3::from_shape_fn((p, q, f), |(i, j, k)| nan(values[i][j][k]))
}

/// `[p][f]` with NaN for what does not exist.
pub(super) fn plane(values: &[Vec<Number>]) -> Array2<f64> {
    Array2::from_shape_fn((values.len(), values.first().map_or(0, Vec::len)), |(i, k)| nan(values[i][k]))
}

pub(super) fn nan(value: Number) -> f64 {
    value.unwrap_or(f64::NAN)
}

/// A response as a curve, with its 95 % intervals where it has a covariance.
pub(super) fn curve(label: &str, response: &FrequencyResponse, style: CurveStyle) -> Curve {
    let (p, q) = response.shape();
    let value = Array3::from_shape_fn((p, q, response.len()), |(i, j, f)| response.value[[f, i, j]]);
    let mut curve = Curve::from_response(label, &value, style);
    if response.uncertainty.is_some() {
        let entries: Vec<Vec<_>> = (0..p).map(|i| (0..q).map(|j| response.gain_phase(i, j, 0.95)).collect()).collect();
        let ends = |end: usize| {
            Array3::from_shape_fn(value.dim(), |(i, j, f)| Some(entries[i][j][f].gain_interval[end]).filter(|end| end.is_finite()).unwrap_or(f64::NAN))
        };
        let phases = |end: usize| Array3::from_shape_fn(value.dim(), |(i, j, f)| entries[i][j][f].phase_interval_rad.map_or(f64::NAN, |ends| ends[end]));
        curve.gain_ci95 = Some((ends(0), ends(1)));
        curve.phase_ci95_rad = Some((phases(0), phases(1)));
    }
    curve
}

pub(super) fn warnings(warnings: &[Warning]) -> Vec<ndof_report::Warning> {
    warnings.iter().map(|w| ndof_report::Warning { code: w.code.clone(), message: w.message.clone(), action: w.action.clone() }).collect()
}
