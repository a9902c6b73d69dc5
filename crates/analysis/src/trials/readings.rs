//! Motion that its sensor tells more slowly than rows are written.

use ndof_signal::{Channel, Warning, finer};

/// Changes without which a pattern may be chance: each lies in every second row in one of two.
const CHANGES: usize = 32;
/// What to do about it.
pub(crate) const ACTION: &str = "log it at the rate of the rows to see more";

/// How a motion is read that is held from one reading to the next.
pub(crate) struct SlowReadings {
    /// A reading lasts so many rows.
    every: usize,
    /// The first row of a new reading.
    first: usize,
}

impl SlowReadings {
    /// `None` where any row may be a reading, and where readings that follow each other are hardly alike: a command that jumps, or a motion whose readings
    /// do not tell what lies between them.
    pub fn of(samples: &[f64]) -> Option<Self> {
        let mut changes = (1..samples.len()).filter(|&k| samples[k] != samples[k - 1]);
        let first = changes.next()?;
        let (mut every, mut count) = (0, 1);
        for k in changes {
            (every, count) = (common_divisor(k - first, every), count + 1);
            if every == 1 {
                return None;
            }
        }
        if every == 0 || count < CHANGES {
            return None;
        }
        let own = SlowReadings { every, first: first % every };
        let readings = own.readings(samples);
        let mean = readings.iter().sum::<f64>() / readings.len() as f64;
        let power: f64 = readings.iter().map(|x| (x - mean).powi(2)).sum();
        let steps: f64 = readings.windows(2).map(|w| (w[1] - w[0]).powi(2)).sum();
        // Twice the power where readings know nothing of each other.
        (steps < power).then_some(own)
    }

    /// The readings, from the one that the first rows still hold.
    fn readings(&self, samples: &[f64]) -> Vec<f64> {
        let held = (self.first > 0).then(|| samples[0]);
        held.into_iter().chain(samples.iter().skip(self.first).step_by(self.every).copied()).collect()
    }

    /// The curve through the readings, row by row: motion does not jump.
    fn curve(&self, samples: &[f64]) -> Vec<f64> {
        let before = (self.every - self.first) % self.every;
        finer(&self.readings(samples), self.every).into_iter().skip(before).take(samples.len()).collect()
    }

    /// What it is, at rows of this rate.
    pub fn told(&self, rate_hz: f64) -> String {
        let late_ms = 500.0 * (self.every - 1) as f64 / rate_hz;
        format!("it is read anew in every {} row, {}: held between its readings it is {} late", nth(self.every), hz(rate_hz / self.every as f64), ms(late_ms))
    }
}

fn common_divisor(a: usize, b: usize) -> usize {
    if b == 0 { a } else { common_divisor(b, a % b) }
}

/// Puts the curve through its readings in the place of a motion that is held from one to the next.
pub(super) fn between_readings(channel: &mut Channel, rate_hz: f64, file: &str) -> Option<Warning> {
    let slow = SlowReadings::of(&channel.samples)?;
    channel.samples = slow.curve(&channel.samples);
    let known = hz(0.5 * rate_hz / slow.every as f64);
    let message = format!("{file}, {}: {}; the curve through its readings is taken, which knows nothing above {known}", channel.name, slow.told(rate_hz));
    Some(Warning::new("slow-readings", message, ACTION))
}

/// 2nd, 3rd, 4th …
fn nth(n: usize) -> String {
    let ending = match (n % 10, n % 100) {
        (1, rest) if rest != 11 => "st",
        (2, rest) if rest != 12 => "nd",
        (3, rest) if rest != 13 => "rd",
        _ => "th",
    };
    format!("{n}{ending}")
}

/// Three digits are more than anyone reads.
fn hz(value: f64) -> String {
    format!("{} Hz", (1e3 * value).round() / 1e3)
}

fn ms(value: f64) -> String {
    format!("{} ms", (1e3 * value).round() / 1e3)
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
            assert!(warning.message.contains("every 5th row, 100 Hz: held between its readings it is 4 ms late"), "{}", warning.message);
            assert_eq!(channel.samples.len(), 5000);
            // Far from the ends, whose kinks are felt as 1 / distance.
            for k in 1500..3500 {
                assert!((channel.samples[k] - place((k + offset) as f64 / 500.0)).abs() < 2e-3, "{k}");
            }
        }
    }

    #[test]
    fn what_may_change_in_any_row_and_what_jumps_stay() {
        let smooth = |k: usize| place(k as f64 / 500.0);
        let steps = |k: usize| (40.0 * smooth(k)).round();
        let jumps = |k: usize| ((k / 5 * 7919) % 101) as f64;
        for of in [&smooth as &dyn Fn(usize) -> f64, &steps, &jumps, &|_| 1.0, &|k| f64::from(u8::from(k > 700))] {
            let samples: Vec<f64> = (0..2000).map(of).collect();
            let mut channel = channel(samples.clone());
            assert!(between_readings(&mut channel, 500.0, "a.csv").is_none());
            assert_eq!(channel.samples, samples);
        }
    }
}
