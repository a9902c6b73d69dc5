//! Stretches in which a channel stands still while what it reads goes on, as a sensor or a bus that stops makes them.

use crate::amplitudes::robust_deviation;
use std::ops::Range;

/// Places at most at which the scatter of steps is looked at.
const PLACES: usize = 1 << 16;
/// Samples that repeat the one before: one may be chance.
const FEWEST: usize = 2;
/// Standard deviations beyond which a jump is none of the motion's, in the longest of records.
const DEVIATIONS: f64 = 15.0;
/// Share of repeated samples from which a channel is coarse, or held on purpose.
const MANY: f64 = 0.2;

/// Stretches of samples that repeat the one before them, where the next makes up for it: it jumps by as far as the motion on both sides would have gone in the
/// meantime, within a half of that, and by fifteen standard deviations (a robust one, of steps about the mean of those beside them) more than it goes in a
/// step. Motion that rests does not catch up.
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
    let scatter = scatter_of_steps(samples);
    let catches_up = |run: &Range<usize>| {
        // As few samples as their noise allows: motion turns in between.
        let near = (run.len() as f64).sqrt().ceil() as usize;
        let (from, last) = (run.start.checked_sub(near + 1), samples.get(run.end + near));
        let (Some(from), Some(last)) = (from, last) else { return false };
        let [held, next] = [samples[run.start], samples[run.end]];
        let step = 0.5 * ((held - samples[from]) + (last - next)) / near as f64;
        let jump = next - held;
        (jump - step * (run.len() + 1) as f64).abs() < 0.5 * jump.abs() && (jump - step).abs() > DEVIATIONS * scatter
    };
    if scatter > 0.0 { runs.into_iter().filter(catches_up).collect() } else { Vec::new() }
}

/// Robust standard deviation of steps from the mean of the two beside them.
fn scatter_of_steps(samples: &[f64]) -> f64 {
    let step = |k: usize| samples[k + 1] - samples[k];
    let inner = samples.len().saturating_sub(3);
    let off = |k: usize| (step(k) - 0.5 * (step(k - 1) + step(k + 1))).abs();
    let mut sizes: Vec<f64> = (1..=inner).step_by(inner.div_ceil(PLACES).max(1)).map(off).filter(|size| size.is_finite()).collect();
    let (middle, far) = (sizes.len() / 2, 9 * sizes.len() / 10);
    let mut at = |place: usize| if sizes.is_empty() { 0.0 } else { *sizes.select_nth_unstable_by(place, f64::total_cmp).1 };
    robust_deviation(at(middle), at(far))
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

    #[test]
    fn levels_that_are_held_are_no_fault() {
        let mut random = ChaCha8Rng::seed_from_u64(5);
        let levels: Vec<f64> = (0..400).flat_map(|_| [random.random::<f64>(); 10]).collect();
        assert!(frozen(&levels).is_empty());
        assert!(frozen(&[1.0; 50]).is_empty() && frozen(&[]).is_empty());
    }
}
