//! The axis that most pictures share.

use super::curve::Curve;
use crate::plot::Axis;

/// An interval from x to more than this times x says little.
const LOOSE: f64 = 10.0;
/// Stretches a decade in which the share of known bins is judged: third octaves.
const STRETCHES: f64 = 10.0;

/// First and last positive frequency: what a logarithmic axis can show.
pub(super) fn positive_extent(frequency_hz: &[f64]) -> Option<(f64, f64)> {
    let positive = || frequency_hz.iter().copied().filter(|frequency| *frequency > 0.0);
    let (low, high) = (positive().fold(f64::INFINITY, f64::min), positive().fold(0.0, f64::max));
    (low < high && high.is_finite()).then_some((low, high))
}

/// The band in which something is known: from the first to the last third octave where, in half of the bins, the
/// interval of some measured gain excludes zero and spans less than a factor of [`LOOSE`].
///
/// `None` if that is all, or nothing, or if no curve has an interval: then there is no reason to leave anything out.
pub(super) fn known_extent(frequency_hz: &[f64], curves: &[Curve]) -> Option<(f64, f64)> {
    let known = |k: usize| {
        curves.iter().filter_map(|curve| curve.gain_ci95.as_ref()).any(|(low, high)| {
            low.outer_iter().zip(high.outer_iter()).any(|(low, high)| {
                low.outer_iter()
                    .zip(high.outer_iter())
                    .any(|(low, high)| matches!((low.get(k), high.get(k)), (Some(&low), Some(&high)) if low > 0.0 && high < LOOSE * low))
            })
        })
    };
    let mut stretches: std::collections::BTreeMap<i64, (usize, usize, f64, f64)> = std::collections::BTreeMap::new();
    for (k, &frequency) in frequency_hz.iter().enumerate().filter(|(_, frequency)| **frequency > 0.0 && frequency.is_finite()) {
        let stretch = stretches.entry((STRETCHES * frequency.log10()).floor() as i64).or_insert((0, 0, frequency, frequency));
        stretch.0 += usize::from(known(k));
        stretch.1 += 1;
        stretch.3 = frequency;
    }
    let mut good = stretches.values().filter(|(known, all, _, _)| 2 * known >= *all);
    let first = good.next()?;
    let (low, high) = (first.2, good.next_back().unwrap_or(first).3);
    let whole = positive_extent(frequency_hz)?;
    (low < high && (low > whole.0 || high < whole.1)).then_some((low, high))
}

/// A logarithmic axis in hertz over `extent`.
pub(super) fn frequency_axis(extent: Option<(f64, f64)>) -> Axis {
    let axis = Axis::log("Frequency", "Hz");
    match extent {
        Some((low, high)) => axis.range(low, high),
        None => axis,
    }
}

#[cfg(test)]
mod tests {
    use ndarray::Array3;

    use super::*;
    use crate::figures::CurveStyle;

    fn curve(gain: &[f64], half: impl Fn(usize) -> f64) -> Curve {
        let cube = |value: &dyn Fn(usize) -> f64| Array3::from_shape_fn((1, 1, gain.len()), |(_, _, k)| value(k));
        Curve {
            label: "measured".into(),
            gain: cube(&|k| gain[k]),
            gain_ci95: Some((cube(&|k| gain[k] - half(k)), cube(&|k| gain[k] + half(k)))),
            phase_rad: Array3::zeros((1, 1, gain.len())),
            phase_ci95_rad: None,
            style: CurveStyle::MEASURED,
        }
    }

    #[test]
    fn the_picture_ends_where_nothing_is_known_and_keeps_what_lies_between() {
        let frequency: Vec<f64> = (0..=1000).map(f64::from).collect();
        let measured = curve(&[1.0; 1001], |k| if k < 200 && k % 5 != 0 { 0.1 } else { 2.0 });
        let (low, high) = known_extent(&frequency, &[measured]).unwrap();
        assert!(low <= 2.0 && (150.0..=251.0).contains(&high), "{low} {high}");
    }

    #[test]
    fn nothing_is_left_out_without_intervals_or_without_a_reason() {
        let frequency = [1.0, 2.0, 4.0, 8.0];
        let mut all_known = curve(&[1.0; 4], |_| 0.1);
        assert_eq!(known_extent(&frequency, std::slice::from_ref(&all_known)), None);
        assert_eq!(known_extent(&frequency, &[curve(&[1.0; 4], |_| 2.0)]), None);
        all_known.gain_ci95 = None;
        assert_eq!(known_extent(&frequency, &[all_known]), None);
    }
}
