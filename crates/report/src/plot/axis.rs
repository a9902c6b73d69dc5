//! An axis: what it shows, its unit, and how numbers become lengths.

use crate::number::printed_unit;

/// Numbers beyond this (and, on a logarithmic axis, below its inverse) have no place: the length of a range must not overflow.
const LARGEST: f64 = 1e150;

/// How numbers are laid along an axis.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Scale {
    /// Evenly.
    #[default]
    Linear,
    /// By their logarithm; numbers that are not positive are not drawn.
    Log,
    /// Evenly, with ticks at parts of a turn.
    Degrees,
}

impl Scale {
    /// Whether a number has a place on the axis.
    pub(crate) fn has(self, value: f64) -> bool {
        match self {
            Scale::Log => (1.0 / LARGEST..=LARGEST).contains(&value),
            Scale::Linear | Scale::Degrees => value.abs() <= LARGEST,
        }
    }

    /// Into the coordinate in which the axis is even; NaN where the number has no place on it.
    pub(crate) fn forward(self, value: f64) -> f64 {
        match self {
            _ if !self.has(value) => f64::NAN,
            Scale::Log => value.log10(),
            Scale::Linear | Scale::Degrees => value,
        }
    }

    pub(crate) fn backward(self, coordinate: f64) -> f64 {
        if self == Scale::Log { 10f64.powf(coordinate) } else { coordinate }
    }

    pub(crate) fn word(self) -> &'static str {
        match self {
            Scale::Linear => "linear",
            Scale::Log => "log",
            Scale::Degrees => "degrees",
        }
    }
}

/// An axis of a panel.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Axis {
    /// The quantity, e.g. "Frequency".
    pub label: String,
    /// Its unit, e.g. "Hz"; empty where there is none.
    pub unit: String,
    /// How numbers are laid along it.
    pub scale: Scale,
    /// From and to; `None` takes what the series need.
    pub range: Option<(f64, f64)>,
    /// Names in place of numbers, from top to bottom; see [`Axis::names`].
    pub names: Vec<String>,
}

impl Axis {
    /// An even axis.
    pub fn linear(label: impl Into<String>, unit: impl Into<String>) -> Self {
        Self { label: label.into(), unit: unit.into(), ..Self::default() }
    }

    /// A logarithmic axis.
    pub fn log(label: impl Into<String>, unit: impl Into<String>) -> Self {
        Self { scale: Scale::Log, ..Self::linear(label, unit) }
    }

    /// An axis of degrees.
    pub fn degrees(label: impl Into<String>) -> Self {
        Self { scale: Scale::Degrees, ..Self::linear(label, "°") }
    }

    /// An ordinate of names, one a row, row k (from the top) around [`Axis::row`]`(k)`.
    pub fn names(names: Vec<String>) -> Self {
        Self { range: Some((0.0, names.len().max(1) as f64)), names, ..Self::linear("", "") }
    }

    /// The ordinate of the k-th name.
    pub fn row(&self, k: usize) -> f64 {
        self.names.len() as f64 - k as f64 - 0.5
    }

    /// With a fixed range. A range that is empty, or not positive on a logarithmic axis, is ignored when drawing.
    pub fn range(mut self, from: f64, to: f64) -> Self {
        self.range = Some((from, to));
        self
    }

    /// "Gain [m/N]", or the label alone where there is no unit.
    pub fn caption(&self) -> String {
        if self.unit.is_empty() { self.label.clone() } else { format!("{} [{}]", self.label, printed_unit(&self.unit)) }
    }

    /// The range to draw: the one that was fixed, else the extent of `values` with a little air; always usable.
    pub(crate) fn resolve(&self, values: impl Iterator<Item = f64>) -> (f64, f64) {
        if let Some((from, to)) = self.range
            && from < to
            && self.scale.forward(from).is_finite()
            && self.scale.forward(to).is_finite()
        {
            return (from, to);
        }
        let (low, high) =
            values.filter(|value| self.scale.has(*value)).fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| (low.min(value), high.max(value)));
        let (low, high) = (self.scale.forward(low), self.scale.forward(high));
        let (low, high) = match (low <= high, low < high) {
            (false, _) => (0.0, 1.0),
            (true, true) => (low, high),
            (true, false) => {
                let air = if self.scale == Scale::Log { 0.5 } else { low.abs().max(1e-9) };
                (low - air, high + air)
            }
        };
        (self.scale.backward(low), self.scale.backward(high))
    }

    /// A range widened by `share` of its length at both ends.
    pub(crate) fn widened(&self, (from, to): (f64, f64), share: f64) -> (f64, f64) {
        if self.range.is_some() {
            return (from, to);
        }
        let (low, high) = (self.scale.forward(from), self.scale.forward(to));
        let air = share * (high - low);
        (self.scale.backward(low - air), self.scale.backward(high + air))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_range_holds_all_finite_values_and_ignores_the_rest() {
        let axis = Axis::log("Gain", "m/N");
        assert_eq!(axis.caption(), "Gain [m/N]");
        let (low, high) = axis.resolve([f64::NAN, -3.0, 0.0, 0.1, 10.0, f64::INFINITY].into_iter());
        assert!((low - 0.1).abs() < 1e-15 && (high - 10.0).abs() < 1e-12);
    }

    #[test]
    fn a_single_value_and_no_value_still_give_a_range() {
        assert_eq!(Axis::linear("", "").resolve([2.0].into_iter()), (0.0, 4.0));
        assert_eq!(Axis::linear("", "").resolve(std::iter::empty()), (0.0, 1.0));
        assert_eq!(Axis::log("", "").range(-1.0, 1.0).resolve(std::iter::empty()), (1.0, 10.0));
    }
}
