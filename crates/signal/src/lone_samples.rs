//! Samples that stand alone, as a bit that was lost on the way makes them.

use crate::spread::scatter;
use std::ops::Range;

/// Places on either side, without those of which the sample itself is part: by fourteen of them a deviation is known to a fifth.
const AROUND: usize = 8;
/// Places that are looked at together.
const STRETCH: usize = 256;

/// Where a single sample lies off the line between its neighbours, d_k = x_k - (x_{k-1} + x_{k+1})/2, by more than so many standard deviations of what
/// samples usually do (a robust one) and of what those around it do, while its neighbours lie off by half of it the other way: as beside one wrong sample, and
/// not beside a step, a turn or in a burst.
///
/// Empty where nine in ten places have no scatter at all.
///
/// ```
/// let mut x: Vec<f64> = (0..1000).map(|k| f64::from(k * 7 % 11) + (f64::from(k) * 0.1).sin() * 500.0).collect();
/// x[300] += 400.0;
/// x[600..].iter_mut().for_each(|x| *x += 400.0); // a step
/// (800..820).step_by(4).for_each(|k| x[k] += 400.0); // a burst
/// assert_eq!(ndof_signal::lone_samples(&x, 15.0), [300]);
/// ```
pub fn lone_samples(samples: &[f64], deviations: f64) -> Vec<usize> {
    let off = |k: usize| samples[k] - 0.5 * (samples[k - 1] + samples[k + 1]);
    let inner = samples.len().saturating_sub(2);
    let least = deviations * scatter(inner, |k| off(k + 1));
    let alone = |k: &usize| {
        let size = off(*k);
        // A half, as far as the signal itself can hide it.
        let beside = |k: usize| (-0.75..=-0.25).contains(&(off(k) / size));
        let around = (k.saturating_sub(AROUND).max(1)..k - 1).chain(k + 2..(k + AROUND + 1).min(inner + 1));
        let quiet = || {
            let (count, power) = around.fold((0.0, 0.0), |(count, power), k| (count + 1.0, power + off(k).powi(2)));
            size.powi(2) * count > deviations.powi(2) * power
        };
        size.abs() > least && beside(k - 1) && beside(k + 1) && quiet()
    };
    if least.is_nan() || least <= 0.0 {
        return Vec::new();
    }
    // Most stretches hold none that far off, which is seen at once.
    let stretches = (2..inner).step_by(STRETCH).map(|first| first..(first + STRETCH).min(inner));
    let far_off = |[before, x, after]: [f64; 3]| (x - 0.5 * (before + after)).abs() > least;
    let any = |stretch: &Range<usize>| {
        let around = &samples[stretch.start - 1..=stretch.end];
        around.windows(3).fold(false, |any, x| any | far_off([x[0], x[1], x[2]]))
    };
    stretches.filter(any).flatten().filter(alone).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Wherever it lies in what is looked at together, but for the ends of the signal.
    #[test]
    fn a_lone_sample_is_found_wherever_it_is() {
        let quiet: Vec<f64> = (0..3 * STRETCH + 7).map(|k| (k * 7 % 11) as f64).collect();
        assert!(lone_samples(&quiet, 15.0).is_empty());
        for at in 3..quiet.len() - 3 {
            let mut samples = quiet.clone();
            samples[at] += 400.0;
            assert_eq!(lone_samples(&samples, 15.0), [at]);
        }
    }
}
