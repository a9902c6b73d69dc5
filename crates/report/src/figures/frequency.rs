//! The axis that most pictures share.

use crate::plot::Axis;

/// First and last positive frequency: what a logarithmic axis can show.
pub(super) fn positive_extent(frequency_hz: &[f64]) -> Option<(f64, f64)> {
    let positive = || frequency_hz.iter().copied().filter(|frequency| *frequency > 0.0);
    let (low, high) = (positive().fold(f64::INFINITY, f64::min), positive().fold(0.0, f64::max));
    (low < high && high.is_finite()).then_some((low, high))
}

/// A logarithmic axis in hertz over `extent`.
pub(super) fn frequency_axis(extent: Option<(f64, f64)>) -> Axis {
    let axis = Axis::log("Frequency", "Hz");
    match extent {
        Some((low, high)) => axis.range(low, high),
        None => axis,
    }
}
