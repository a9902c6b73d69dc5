//! Where the search for a model's parameters begins.

use super::evidence::Evidence;
use crate::error::AnalysisError;
use ndof_models::blocks::{BlockCard, Composite};
use ndof_models::{InertiaDampingStiffnessModel, ParametricModel, linear_start};
use ndof_sysid::FrequencyResponse;
use num_complex::Complex64;
use std::f64::consts::TAU;

/// Samples by which efforts or motions may be late: beyond the first few, so close that the best lies within half a period of what still matters.
const LATE: [f64; 12] = [-8.0, -5.0, -4.0, -3.0, -2.0, -1.0, 1.0, 2.0, 3.0, 4.0, 5.0, 8.0];

/// Inertia, damping and stiffness by linear least squares within the band, with each of the blocks' own starts. Where a delay is fitted, they
/// follow also from the response with a delay of some samples taken off: a mass turned by half a period is none.
pub(super) fn starts(
    model: &InertiaDampingStiffnessModel,
    composite: &Composite,
    cards: &[&BlockCard],
    evidence: &Evidence<'_>,
    band_hz: [f64; 2],
) -> Result<Vec<Vec<f64>>, AnalysisError> {
    let response = evidence.response.band(band_hz[0], band_hz[1]);
    let start = linear_start(model, &response)?;
    let mut starts = composite.starts(&start);
    let base = model.parameters().len();
    let delay = composite.parameters().iter().skip(base).position(|p| p.name == "delay_s").filter(|_| cards.iter().any(|card| card.name() == "delay"));
    if let (Some(delay), Some((rate_hz, _))) = (delay, evidence.sampled) {
        for late_s in LATE.map(|samples| samples / rate_hz) {
            let Ok(start) = linear_start(model, &on_time(&response, late_s)) else { continue };
            let Some(mut first) = composite.starts(&start).into_iter().next() else { continue };
            first[base + delay] = late_s;
            starts.extend(Some(first).filter(|start| start.iter().all(|v| v.is_finite())));
        }
    }
    Ok(starts)
}

/// A response of motion to effort whose effort is no longer late.
fn on_time(response: &FrequencyResponse, late_s: f64) -> FrequencyResponse {
    let mut out = response.clone();
    for (f, hz) in response.frequency_hz.iter().enumerate() {
        let turn = Complex64::from_polar(1.0, -TAU * hz * late_s);
        out.value.index_axis_mut(ndarray::Axis(0), f).iter_mut().for_each(|v| *v *= turn);
    }
    out
}
