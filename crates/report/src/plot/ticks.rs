//! Where an axis has its ticks, and what they say.

use super::axis::Scale;
use crate::number::{fixed, superscript};

/// A tick: its place on the axis and its label.
#[derive(Debug, Clone, PartialEq)]
pub struct Tick {
    /// In the unit of the axis.
    pub value: f64,
    /// As written beside the axis.
    pub label: String,
}

/// Ticks of an axis from `min` to `max` (both included where they are round), about `target` of them.
///
/// Linear axes step by 1, 2, 2.5 or 5 times a power of ten, axes of degrees by 15, 30, 45, 90 or 180; logarithmic
/// axes have decades, or 1, 2, 5 within them, or round numbers where the axis is shorter than that. Empty where the
/// range is empty, not finite or, on a logarithmic axis, not positive.
pub fn ticks(scale: Scale, min: f64, max: f64, target: usize) -> Vec<Tick> {
    let positive = scale != Scale::Log || min > 0.0;
    if !(min.is_finite() && max.is_finite() && min < max && positive) {
        return Vec::new();
    }
    match scale {
        Scale::Linear => labelled(&steps(min, max, nice_step((max - min) / target.max(1) as f64)), min, max),
        Scale::Degrees => {
            let wanted = (max - min) / target.max(1) as f64;
            let step = [15.0, 30.0, 45.0, 90.0, 180.0].into_iter().find(|&step| step >= wanted * 0.7);
            match step {
                Some(step) if wanted > 5.0 => labelled(&steps(min, max, step), min, max),
                _ => ticks(Scale::Linear, min, max, target),
            }
        }
        Scale::Log => log_ticks(min, max, target),
    }
}

fn nice_step(wanted: f64) -> f64 {
    let power = 10f64.powf(wanted.log10().floor());
    let factor = [1.0, 2.0, 2.5, 5.0, 10.0].into_iter().find(|factor| factor * power >= wanted * 0.75).unwrap_or(10.0);
    factor * power
}

fn steps(min: f64, max: f64, step: f64) -> Vec<f64> {
    let slack = step * 1e-9;
    let first = ((min - slack) / step).ceil() as i64;
    let last = ((max + slack) / step).floor() as i64;
    (first..=last).take(100).map(|k| k as f64 * step).collect()
}

/// Labels with just the decimals that tell neighbours apart; a common power of ten where numbers are large or small.
fn labelled(values: &[f64], min: f64, max: f64) -> Vec<Tick> {
    let largest = min.abs().max(max.abs());
    let exponent = largest.log10().floor() as i32;
    let power = if (-3..5).contains(&exponent) { 0 } else { exponent };
    let scale = 10f64.powi(power);
    let step = values.windows(2).map(|pair| pair[1] - pair[0]).fold(f64::INFINITY, f64::min);
    let fine = if step.is_finite() { step / scale } else { largest / scale };
    let decimals = (0..10).find(|&d| (fine * 10f64.powi(d) - (fine * 10f64.powi(d)).round()).abs() < 1e-6 * fine * 10f64.powi(d)).unwrap_or(10) as usize;
    let suffix = if power == 0 { String::new() } else { format!("×10{}", superscript(power)) };
    let label = |value: f64| if value == 0.0 { "0".to_string() } else { fixed(value / scale, decimals) + &suffix };
    values.iter().map(|&value| Tick { value, label: label(value) }).collect()
}

fn log_ticks(min: f64, max: f64, target: usize) -> Vec<Tick> {
    let (low, high) = (min * (1.0 - 1e-9), max * (1.0 + 1e-9));
    let (first, last) = (low.log10().floor() as i32, high.log10().floor() as i32);
    let within = |mantissas: &[f64], stride: i32| -> Vec<(f64, i32)> {
        (first..=last)
            .filter(|decade| decade.rem_euclid(stride) == 0)
            .flat_map(|decade| mantissas.iter().map(move |&mantissa| (mantissa, decade)))
            .filter(|&(mantissa, decade)| (low..=high).contains(&(mantissa * 10f64.powi(decade))))
            .collect()
    };
    let most = (target * 8).div_ceil(5).max(3);
    // Bare decades are calmest, if they are not too few for the room.
    let decades = within(&[1.0], 1).len();
    let order: &[&[f64]] = if decades >= 3 && 3 * decades >= 2 * target { &[&[1.0]] } else { &[&[1.0, 2.0, 5.0], &[1.0, 3.0], &[1.0]] };
    for mantissas in order {
        let found = within(mantissas, 1);
        if (3..=most).contains(&found.len()) {
            return log_labelled(&found);
        }
    }
    if decades < 2 {
        return ticks(Scale::Linear, min, max, target);
    }
    let stride = (2..).find(|&stride| within(&[1.0], stride).len() <= most).unwrap_or(1);
    log_labelled(&within(&[1.0], stride))
}

fn log_labelled(marks: &[(f64, i32)]) -> Vec<Tick> {
    let plain = marks.iter().all(|&(_, decade)| (-2..4).contains(&decade));
    let label = |&(mantissa, decade): &(f64, i32)| match (plain, mantissa) {
        (true, _) => fixed(mantissa * 10f64.powi(decade), (-decade).max(0) as usize),
        (false, 1.0) => format!("10{}", superscript(decade)),
        (false, _) => format!("{mantissa}×10{}", superscript(decade)),
    };
    marks.iter().map(|mark| Tick { value: mark.0 * 10f64.powi(mark.1), label: label(mark) }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(scale: Scale, min: f64, max: f64) -> Vec<String> {
        ticks(scale, min, max, 5).into_iter().map(|tick| tick.label).collect()
    }

    #[test]
    fn linear_ticks_are_round_and_carry_the_decimals_they_need() {
        assert_eq!(labels(Scale::Linear, 0.0, 1.0), ["0", "0.2", "0.4", "0.6", "0.8", "1.0"]);
        assert_eq!(labels(Scale::Linear, -12.0, 9.0), ["−10", "−5", "0", "5"]);
        assert_eq!(labels(Scale::Linear, 0.0, 50.0), ["0", "10", "20", "30", "40", "50"]);
        assert_eq!(labels(Scale::Linear, 0.0, 2e-5), ["0", "0.5×10⁻⁵", "1.0×10⁻⁵", "1.5×10⁻⁵", "2.0×10⁻⁵"]);
    }

    #[test]
    fn phase_ticks_are_multiples_of_45_or_90_degrees() {
        assert_eq!(labels(Scale::Degrees, -180.0, 180.0), ["−180", "−90", "0", "90", "180"]);
        assert_eq!(labels(Scale::Degrees, -180.0, 45.0), ["−180", "−135", "−90", "−45", "0", "45"]);
    }

    #[test]
    fn log_ticks_are_decades_or_one_two_five() {
        assert_eq!(labels(Scale::Log, 0.1, 20.0), ["0.1", "0.2", "0.5", "1", "2", "5", "10", "20"]);
        assert_eq!(labels(Scale::Log, 1e-6, 1e-2), ["10⁻⁶", "10⁻⁵", "10⁻⁴", "10⁻³", "10⁻²"]);
        assert_eq!(labels(Scale::Log, 3.1, 3.9), ["3.2", "3.4", "3.6", "3.8"]);
        assert_eq!(labels(Scale::Log, 1e-12, 1e12).len(), 7);
    }

    #[test]
    fn an_axis_that_does_not_exist_has_no_ticks() {
        for (min, max) in [(0.0, 1.0), (1.0, 1.0), (2.0, 1.0), (f64::NAN, 1.0), (1.0, f64::INFINITY)] {
            assert!(ticks(Scale::Log, min, max, 5).is_empty());
        }
    }
}
