//! The schedule along a recording, and the mean movement that comes back with it.

use crate::linear::{Factor, Symmetric};
use crate::split::Stretch;
use ndof_models::schedule::Splines;
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
        Movement::new(&self.values, self.splines(0.0)?, &(0..longest)).map(|movement| movement.deviation(series))
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

/// The mean over the cycle of any series, by least squares; what holds for a force balance holds for its deviation from that mean, be the laws in
/// it as nonlinear as they may: the mean of each force is taken out of it along the whole motion.
#[derive(Clone, Debug)]
pub(crate) struct Movement {
    pub splines: Splines,
    /// The phase of each sample that counts, `[trial][time]`; NaN of all others.
    places: Vec<Vec<f64>>,
    factor: Factor,
}

impl Movement {
    /// That of phases, of which those of samples in `inside` count.
    pub fn new(phases: &[Vec<f64>], splines: Splines, inside: &Range<usize>) -> Option<Self> {
        let counts = |k: usize, phase: f64| if inside.contains(&k) { phase } else { f64::NAN };
        let places: Vec<Vec<f64>> = phases.iter().map(|trial| trial.iter().enumerate().map(|(k, p)| counts(k, *p)).collect()).collect();
        let mut normal = Symmetric::zeros(splines.count());
        for phase in places.iter().flatten().filter(|phase| phase.is_finite()) {
            let row = splines.at(*phase);
            for (a, (i, v)) in row.iter().enumerate() {
                row[..=a].iter().for_each(|(j, w)| normal.add(*i, *j, v * w));
            }
        }
        normal.factor().map(|factor| Movement { splines, places, factor })
    }

    /// Coefficients of the mean of a series, `[trial][time]`.
    pub fn mean(&self, series: &[&[f64]]) -> Vec<f64> {
        let mut right = vec![0.0; self.splines.count()];
        for (value, phase) in series.iter().zip(&self.places).flat_map(|(s, p)| s.iter().zip(p)).filter(|(_, phase)| phase.is_finite()) {
            self.splines.at(*phase).into_iter().for_each(|(k, weight)| right[k] += weight * value);
        }
        self.factor.solve(&right)
    }

    /// A series less its mean; nothing where there is no phase.
    pub fn deviation(&self, series: &[&[f64]]) -> Vec<Vec<f64>> {
        let mean = self.mean(series);
        let one = |(value, phase): (&f64, &f64)| if phase.is_finite() { value - at(self.splines, &mean, *phase) } else { 0.0 };
        series.iter().zip(&self.places).map(|(s, p)| s.iter().zip(p).map(one).collect()).collect()
    }
}

/// A mean at a phase; nothing where there is no phase.
pub(crate) fn at(splines: Splines, mean: &[f64], phase: f64) -> f64 {
    if phase.is_finite() { splines.at(phase).into_iter().map(|(k, weight)| weight * mean[k]).sum() } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    #[test]
    fn what_comes_back_with_the_phase_is_taken_out_and_nothing_else() {
        let phase: Vec<f64> = (0..5000).map(|k| (f64::from(k) / 500.0).fract()).collect();
        let other = |k: usize| (0.0317 * k as f64).sin();
        let series: Vec<f64> = phase.iter().enumerate().map(|(k, u)| 3.0 + (TAU * u).sin() + 0.2 * (4.0 * TAU * u).cos() + other(k)).collect();
        let schedule = Schedule { words: String::new(), unit: String::new(), ends: [0.0, 1.0], cycle_s: Some(1.0), values: vec![phase.clone()] };
        let splines = schedule.splines(10.0).expect("cycles");
        let movement = Movement::new(&schedule.values, splines, &(500..4500)).expect("a mean");
        let left = &movement.deviation(&[&series])[0];
        assert!(left[..500].iter().chain(&left[4500..]).all(|v| *v == 0.0));
        // The mean of the other over eight cycles remains: a third of it.
        let rest: f64 = (500..4500).map(|k| (left[k] - other(k)).powi(2)).sum::<f64>() / (500..4500).map(|k| other(k).powi(2)).sum::<f64>();
        assert!(rest < 2.0 / 8.0, "{rest}");
        // A product with what follows the phase alone keeps nothing but the deviation of the other factor.
        let periodic: Vec<f64> = phase.iter().map(|u| 1.0 + (2.0 * TAU * u).sin()).collect();
        assert!(movement.deviation(&[&periodic])[0].iter().all(|v| v.abs() < 1e-4));
        assert_eq!(Schedule::between(&[0.2, 0.4, 0.1], 0.5), 0.30000000000000004);
        assert_eq!(Schedule::between(&[0.9, 0.1], 0.5), 0.9);
    }
}
