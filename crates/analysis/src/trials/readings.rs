//! Motion that its sensor tells more slowly than rows are written.

use ndof_signal::{Channel, Warning, curve_through};

/// Changes without which a pattern may be chance: each lies in every second row in one of two.
const CHANGES: usize = 32;
/// What to do about it.
pub(crate) const ACTION: &str = "log it at the rate of the rows to see more";

/// How a motion is read that is held from one reading to the next.
pub(crate) struct SlowReadings {
    /// A reading lasts so many rows.
    every: f64,
    /// The row of the first reading, which the first rows hold: not above zero.
    first: f64,
}

impl SlowReadings {
    /// `None` where any row may be a reading, where all steps are of one size, as of an encoder that turns evenly, and where readings that follow each other
    /// are hardly alike: a command that jumps, or a motion whose readings do not tell what lies between them.
    pub fn of(samples: &[f64]) -> Option<Self> {
        let mut changes = Vec::new();
        for k in (1..samples.len()).filter(|&k| samples[k] != samples[k - 1]) {
            if changes.last().is_some_and(|last| k - last < 2) {
                return None;
            }
            changes.push(k);
        }
        if changes.len() < CHANGES {
            return None;
        }
        let (every, start) = pace(&changes)?;
        let own = SlowReadings { every, first: start - (start / every).ceil() * every };
        let readings = own.readings(samples);
        let mean = readings.iter().sum::<f64>() / readings.len() as f64;
        let power: f64 = readings.iter().map(|x| (x - mean).powi(2)).sum();
        let steps = || readings.windows(2).map(|w| (w[1] - w[0]).powi(2));
        let widest = steps().fold(0.0, f64::max);
        // Twice the power where readings know nothing of each other; two steps of an encoder have four times the square of one.
        (steps().sum::<f64>() < power && steps().any(|step| step > 0.0 && step < 0.5 * widest)).then_some(own)
    }

    /// The readings, each in the first row that holds it.
    fn readings(&self, samples: &[f64]) -> Vec<f64> {
        let row = |k: usize| (self.first + k as f64 * self.every - SAME).ceil().max(0.0) as usize;
        (0..).map_while(|k| samples.get(row(k)).copied()).collect()
    }

    /// The curve through the readings, row by row: motion does not jump.
    fn curve(&self, samples: &[f64]) -> Vec<f64> {
        curve_through(&self.readings(samples), (0..samples.len()).map(|row| (row as f64 - self.first) / self.every))
    }

    /// What it is, at rows of this rate.
    pub fn told(&self, rate_hz: f64) -> String {
        // From a reading to the middle of the rows that hold it, which begin half a row after it where the two clocks know nothing of each other.
        let late_rows = if self.every.fract() == 0.0 { 0.5 * (self.every - 1.0) } else { 0.5 * self.every };
        let [rows, hz, ms] = [self.every, rate_hz / self.every, 1e3 * late_rows / rate_hz].map(short);
        format!("it is read anew every {rows} rows, at {hz} Hz: held between its readings it is {ms} ms late")
    }
}

/// Rows as near as this are the same.
const SAME: f64 = 1e-6;

/// Every how many rows something is read anew, and the row of the reading that the first change shows, by the rows of all changes; `None` where they do not
/// keep step. Each change is seen in the first row after it, and readings that are equal show none.
fn pace(changes: &[usize]) -> Option<(f64, f64)> {
    let gaps = || changes.windows(2).map(|w| w[1] - w[0]);
    let least = gaps().min()?;
    let single: Vec<f64> = gaps().filter(|gap| *gap <= least + 1).map(|gap| gap as f64).collect();
    let about = single.iter().sum::<f64>() / single.len() as f64;
    let places: Vec<(f64, f64)> = gaps()
        .scan((0.0, changes[0] as f64), |(reading, row), gap| {
            (*reading, *row) = (*reading + (gap as f64 / about).round(), *row + gap as f64);
            Some((*reading, *row))
        })
        .chain([(0.0, changes[0] as f64)])
        .collect();
    let count = places.len() as f64;
    let middle = [places.iter().map(|p| p.0).sum::<f64>() / count, places.iter().map(|p| p.1).sum::<f64>() / count];
    let (slope, weight) = places.iter().fold((0.0, 0.0), |(slope, weight), p| {
        let reading = p.0 - middle[0];
        (slope + reading * (p.1 - middle[1]), weight + reading * reading)
    });
    let every = slope / weight;
    let every = if (every - every.round()).abs() < SAME { every.round() } else { every };
    let offsets = || places.iter().map(|(reading, row)| row - every * reading);
    let (first, last) = (offsets().fold(f64::INFINITY, f64::min), offsets().fold(f64::NEG_INFINITY, f64::max));
    // A row each, and what the line through them may turn by: the scatter of a row's width, at both ends.
    (last - first < 1.0 + 2.0 / count.sqrt()).then_some((every, first))
}

/// Puts the curve through its readings in the place of a motion that is held from one to the next.
pub(super) fn between_readings(channel: &mut Channel, rate_hz: f64, file: &str) -> Option<Warning> {
    let slow = SlowReadings::of(&channel.samples)?;
    channel.samples = slow.curve(&channel.samples);
    let known_hz = short(0.5 * rate_hz / slow.every);
    let message = format!("{file}, {}: {}; the curve through its readings is taken, which knows nothing above {known_hz} Hz", channel.name, slow.told(rate_hz));
    Some(Warning::new("slow-readings", message, ACTION))
}

/// Three digits after the point are more than anyone reads.
fn short(value: f64) -> f64 {
    (1e3 * value).round() / 1e3
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndof_signal::{Quantity, Unit};
    use std::f64::consts::TAU;

    fn place(t: f64) -> f64 {
        (TAU * 3.1 * t).sin() + 0.4 * (TAU * 7.3 * t).cos()
    }

    fn channel(samples: Vec<f64>) -> Channel {
        Channel::new("pos_x", Unit::si(Quantity::Displacement, false), samples)
    }

    #[test]
    fn what_is_held_between_readings_becomes_the_curve_through_them() {
        for offset in [0, 2] {
            let held: Vec<f64> = (0..5000_usize).map(|k| place(((k + offset) / 5 * 5) as f64 / 500.0)).collect();
            let mut channel = channel(held);
            let warning = between_readings(&mut channel, 500.0, "a.csv").expect("said");
            assert!(warning.message.contains("every 5 rows, at 100 Hz: held between its readings it is 4 ms late"), "{}", warning.message);
            assert_eq!(channel.samples.len(), 5000);
            // Far from the ends, whose kinks are felt as 1 / distance.
            for k in 1500..3500 {
                assert!((channel.samples[k] - place((k + offset) as f64 / 500.0)).abs() < 2e-3, "{k}");
            }
        }
    }

    /// Two clocks that know nothing of each other: 128 Hz in rows of 1000 Hz, which show a reading from the first row after it.
    #[test]
    fn readings_need_no_whole_number_of_rows() {
        let reading_s = |row: usize| (row as f64 / 1000.0 * 128.0 + 0.3).floor() / 128.0 - 0.3 / 128.0;
        let mut channel = channel((0..20_000).map(|row| place(reading_s(row))).collect());
        let warning = between_readings(&mut channel, 1000.0, "a.csv").expect("said");
        assert!(warning.message.contains("every 7.81"), "{}", warning.message);
        assert!(warning.message.contains("at 128 Hz: held between its readings it is 3.906 ms late"), "{}", warning.message);
        for k in 6000..14_000 {
            assert!((channel.samples[k] - place(k as f64 / 1000.0)).abs() < 3e-3, "{k}");
        }
    }

    #[test]
    fn what_may_change_in_any_row_and_what_jumps_stay() {
        let smooth = |k: usize| place(k as f64 / 500.0);
        let steps = |k: usize| (40.0 * smooth(k)).round();
        let jumps = |k: usize| ((k / 5 * 7919) % 101) as f64;
        let even_turns = |k: usize| (k as f64 / 7.3).floor();
        for of in [&smooth as &dyn Fn(usize) -> f64, &steps, &jumps, &even_turns, &|_| 1.0, &|k| f64::from(u8::from(k > 700))] {
            let samples: Vec<f64> = (0..2000).map(of).collect();
            let mut channel = channel(samples.clone());
            assert!(between_readings(&mut channel, 500.0, "a.csv").is_none());
            assert_eq!(channel.samples, samples);
        }
    }
}
