//! Stretches in which a channel stands still while what it reads goes on, as a sensor or a bus that stops makes them.

use crate::spread::scatter;
use std::ops::Range;

/// Samples that repeat the one before: one may be chance.
const FEWEST: usize = 2;
/// Standard deviations beyond which a jump is none of the motion's: a normal one has none in any record.
const DEVIATIONS: f64 = 15.0;
/// Share of repeated samples from which a channel is coarse, or held on purpose.
const MANY: f64 = 0.2;

/// Stretches of samples that repeat the one before them, with motion on both sides, where the next makes up for it at once: it jumps by
/// more than two of the steps on either side, and by fifteen standard deviations (a robust one, of steps about the mean of those beside them) more than one, and
/// no farther than the fastest step of the record leads in the time. Motion that rests goes on from where it was.
///
/// Empty for a channel of which a fifth or more repeats.
///
/// ```
/// let sine = |k: i32| (f64::from(k) * 0.05).sin();
/// let mut x: Vec<f64> = (0..1000).map(sine).collect();
/// x[378..384].fill(sine(377));
/// assert_eq!(ndof_signal::frozen(&x), [378..384]);
/// ```
pub fn frozen(samples: &[f64]) -> Vec<Range<usize>> {
    let mut runs: Vec<Range<usize>> = Vec::new();
    for k in (1..samples.len()).filter(|k| samples[*k] == samples[k - 1]) {
        match runs.last_mut() {
            Some(run) if run.end == k => run.end = k + 1,
            _ => runs.push(k..k + 1),
        }
    }
    runs.retain(|run| run.len() >= FEWEST);
    if runs.is_empty() || runs.iter().map(Range::len).sum::<usize>() as f64 >= MANY * samples.len() as f64 {
        return Vec::new();
    }
    let step = |k: usize| samples[k + 1] - samples[k];
    let far = DEVIATIONS * scatter(samples.len().saturating_sub(3), |k| step(k + 1) - 0.5 * (step(k) + step(k + 2)));
    let ends_a_run = |k: usize| runs.binary_search_by_key(&(k + 1), |run| run.end).is_ok();
    let fastest = (0..samples.len() - 1).filter(|k| !ends_a_run(*k)).map(|k| step(k).abs()).fold(0.0, f64::max);
    let catches_up = |run: &Range<usize>| {
        // As few samples on either side as their noise allows: motion turns.
        let near = (run.len() as f64).sqrt().ceil() as usize;
        let (from, last) = (run.start.checked_sub(near + 1), samples.get(run.end + near));
        let (Some(from), Some(last)) = (from, last) else { return false };
        let [held, next] = [samples[run.start], samples[run.end]];
        let (before, jump, after) = (held - samples[from], next - held, last - next);
        let moves = before.abs().min(after.abs()) > far;
        // Three steps or more are made in one.
        let pace = before.abs().max(after.abs()) / near as f64;
        moves && jump.abs() > 2.0 * pace && jump.abs() - pace > far && jump.abs() <= (run.len() + 1) as f64 * fastest
    };
    if far > 0.0 { runs.iter().filter(|run| catches_up(run)).cloned().collect() } else { Vec::new() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    fn motion(noise: f64, resolution: f64) -> Vec<f64> {
        let mut random = ChaCha8Rng::seed_from_u64(4);
        let at = |k: u32| {
            let t = f64::from(k) / 200.0;
            let x = (9.0 * t).sin() + 0.6 * (23.0 * t + 1.0).sin() + noise * (random.random::<f64>() - 0.5);
            if resolution > 0.0 { (x / resolution).round() * resolution } else { x }
        };
        (0..8000).map(at).collect()
    }

    #[test]
    fn a_sensor_that_stops_is_found_and_what_rests_is_not() {
        for (noise, resolution) in [(0.0, 0.0), (1e-3, 0.0), (1e-3, 1e-3), (0.0, 0.02)] {
            let plain = motion(noise, resolution);
            assert!(frozen(&plain).is_empty(), "{noise} {resolution}");
            // It rests: afterwards it goes on from where it was.
            let mut rests = plain.clone();
            let resting = rests[3000];
            rests.splice(3001..3001, std::iter::repeat_n(resting, 30));
            assert!(frozen(&rests).is_empty(), "{noise} {resolution}");
        }
        let mut stops = motion(1e-3, 1e-3);
        // Where it is fast.
        let fast: Vec<usize> = (100..7900).filter(|k| (stops[k + 6] - stops[*k]).abs() > 0.45).step_by(70).take(5).collect();
        for k in &fast {
            let held = stops[*k];
            stops[k + 1..k + 6].fill(held);
        }
        assert_eq!(frozen(&stops), fast.iter().map(|k| k + 1..k + 6).collect::<Vec<_>>());
    }

    /// The motion slows down before it is not read, and is at another pace afterwards.
    #[test]
    fn the_pace_may_change_while_nothing_is_read() {
        let at = [0.0, 0.3, 0.8, 1.65, 2.6, 3.25, 3.75, 4.0, 4.2];
        let after = [9.55, 10.45, 11.4, 12.35, 13.35, 14.2, 14.9, 15.3];
        let around = |k: i32| f64::from(k) * 0.9 + 0.01 * f64::from(k * 7 % 11);
        let mut x: Vec<f64> = (-400..0).map(around).chain(at).collect();
        let first = x.len();
        x.extend([4.2; 12]);
        x.extend(after);
        x.extend((1..400).map(|k| 15.3 + around(k)));
        assert_eq!(frozen(&x), vec![first..first + 12]);
        // At rest a zero that is set anew is no motion.
        let mut rests: Vec<f64> = (-400..0).map(around).collect();
        rests.extend([0.0; 30].into_iter().chain([5.0; 30]));
        rests.extend((1..400).map(|k| 5.0 + around(k)));
        assert!(frozen(&rests).is_empty());
    }

    #[test]
    fn levels_that_are_held_are_no_fault() {
        let mut random = ChaCha8Rng::seed_from_u64(5);
        let levels: Vec<f64> = (0..400).flat_map(|_| [random.random::<f64>(); 10]).collect();
        assert!(frozen(&levels).is_empty());
        assert!(frozen(&[1.0; 50]).is_empty() && frozen(&[]).is_empty());
    }
}
