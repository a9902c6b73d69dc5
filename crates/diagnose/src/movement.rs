//! The schedule along a recording, and the mean movement that comes back with it.

use crate::stretch::Stretch;
use ndof_models::schedule::{MeanOver, Splines};
use std::ops::Range;

/// Splines of the mean over a period of the band's upper end, which they follow within a hundredth.
const PER_PERIOD: f64 = 4.0;
/// The fewest: hundredths of a cycle.
const FEWEST: usize = 100;
/// The most, which are solved in no time; the mean of a cycle of minutes is followed less finely.
const MOST: usize = 800;

/// What a stiffness or damping may follow.
#[derive(Clone, Debug, PartialEq)]
pub struct Schedule {
    /// What it is, in words: "the phase of the cycle".
    pub words: String,
    /// Its unit; empty for a phase.
    pub unit: String,
    /// Its least and greatest value, which are 0 and 1 in `values`.
    pub ends: [f64; 2],
    /// Duration of a cycle, where the end is the beginning. The mean movement over the cycle is then taken out of every balance.
    pub cycle_s: Option<f64>,
    /// From 0 to 1 at each sample of each trial; NaN where there is none.
    pub values: Vec<Vec<f64>>,
}

impl Schedule {
    /// Splines that follow a mean movement up to a frequency.
    pub(crate) fn splines(&self, high_hz: f64) -> Option<Splines> {
        self.cycle_s.map(|cycle_s| Splines::new(((PER_PERIOD * high_hz * cycle_s).ceil() as usize).clamp(FEWEST, MOST), true))
    }

    /// Series of the trials less their means over the cycle; nothing where there are no cycles.
    pub fn deviations(&self, series: &[&[f64]]) -> Option<Vec<Vec<f64>>> {
        let longest = self.values.iter().map(Vec::len).max().unwrap_or(0);
        mean_over(&self.values, self.splines(0.0)?, &(0..longest)).map(|movement| movement.deviation(series))
    }

    /// That of a part of the trials.
    #[must_use]
    pub fn part(&self, part: &Stretch) -> Self {
        let values = match part {
            Stretch::Trials(chosen) => chosen.iter().filter_map(|trial| self.values.get(*trial).cloned()).collect(),
            Stretch::Samples(range) => self.values.iter().map(|v| v[range.start..range.end.min(v.len())].to_vec()).collect(),
        };
        Schedule { values, ..self.clone() }
    }

    /// The value at a place between samples.
    pub(crate) fn between(values: &[f64], place: f64) -> f64 {
        let at = |k: usize| values.get(k).copied().unwrap_or(f64::NAN);
        let (a, b) = (at(place.max(0.0) as usize), at(place.max(0.0) as usize + 1));
        // Where a cycle ends, the next begins.
        if (b - a).abs() < 0.5 { a + place.max(0.0).fract() * (b - a) } else { a }
    }
}

/// The mean of samples within a range, at these phases.
pub(crate) fn mean_over(phases: &[Vec<f64>], splines: Splines, inside: &Range<usize>) -> Option<MeanOver> {
    let counts = |k: usize, phase: f64| if inside.contains(&k) { phase } else { f64::NAN };
    let places = phases.iter().map(|trial| trial.iter().enumerate().map(|(k, p)| counts(k, *p)).collect()).collect();
    MeanOver::new(places, splines).ok()
}

/// A mean at a phase; nothing where there is no phase.
pub(crate) fn at(splines: Splines, mean: &[f64], phase: f64) -> f64 {
    if phase.is_finite() { splines.value(mean, phase) } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_phase_between_samples_lies_between_them_and_begins_anew_at_a_cycle_s_end() {
        assert!((Schedule::between(&[0.2, 0.4, 0.1], 0.5) - 0.3).abs() < 1e-15);
        assert_eq!(Schedule::between(&[0.9, 0.1], 0.5), 0.9);
    }
}
