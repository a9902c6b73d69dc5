//! Motion that its sensor tells more slowly than rows are written.

use ndof_signal::{Channel, Warning, finer};

/// Changes without which a pattern may be chance: each lies in every second row in one of two.
const CHANGES: usize = 32;

/// Every how many rows a channel is read anew, and its first row of a new reading. `None` where any row may be one, and where readings that follow each
/// other are hardly alike: a command that jumps, or a motion whose readings do not tell what lies between them.
fn slow(samples: &[f64]) -> Option<(usize, usize)> {
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
    let readings: Vec<f64> = samples.iter().skip(first % every).step_by(every).copied().collect();
    let mean = readings.iter().sum::<f64>() / readings.len() as f64;
    let power: f64 = readings.iter().map(|x| (x - mean).powi(2)).sum();
    let steps: f64 = readings.windows(2).map(|w| (w[1] - w[0]).powi(2)).sum();
    // Twice the power where readings know nothing of each other.
    (steps < power).then_some((every, first % every))
}

fn common_divisor(a: usize, b: usize) -> usize {
    if b == 0 { a } else { common_divisor(b, a % b) }
}

/// Puts the curve through its readings in the place of a motion that is held from one to the next: motion does not jump, and held it is late. Of a piece
/// of a stream the curve is not known, and what is held stays.
pub(super) fn between_readings(channel: &mut Channel, rate_hz: f64, file: &str, is_piece: bool) -> Option<Warning> {
    let (every, first) = slow(&channel.samples)?;
    let slow_hz = rate_hz / every as f64;
    let (done, action) = if is_piece {
        (format!("held between its readings it is {} ms late", 500.0 * (every - 1) as f64 / rate_hz), "estimate from the whole record instead of a stream")
    } else {
        let known_hz = 0.5 * slow_hz;
        (format!("the curve through its readings is taken, which knows nothing above {known_hz} Hz"), "log it at the rate of the rows to see more")
    };
    if !is_piece {
        // The reading that the first rows still hold.
        let before = (first > 0).then(|| channel.samples[0]);
        let readings: Vec<f64> = before.into_iter().chain(channel.samples.iter().skip(first).step_by(every).copied()).collect();
        let ahead = if first > 0 { every - first } else { 0 };
        let length = channel.samples.len();
        channel.samples = finer(&readings, every).into_iter().skip(ahead).take(length).collect();
    }
    let message = format!("{file}: {} is read anew in every {} of {rate_hz} rows a second, at {slow_hz} Hz; {done}", channel.name, nth(every));
    Some(Warning::new("slow-readings", message, action))
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
            let mut channel = channel(held.clone());
            let of_piece = between_readings(&mut channel, 500.0, "a.csv", true).expect("said");
            assert!(of_piece.message.contains("4 ms late") && channel.samples == held, "{}", of_piece.message);
            let warning = between_readings(&mut channel, 500.0, "a.csv", false).expect("said");
            assert!(warning.message.contains("every 5th") && warning.message.contains("at 100 Hz"), "{}", warning.message);
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
            assert!(between_readings(&mut channel, 500.0, "a.csv", false).is_none());
            assert_eq!(channel.samples, samples);
        }
    }
}
