//! What is wrong with one channel.

use super::result::Finding;
use ndof_signal::{Channel, Quantity};
use std::f64::consts::TAU;

/// A run of at least so many equal samples at the end of a channel's range is a limit that was reached.
const CLIPPED_RUN: usize = 4;
/// Share of the samples in such runs above which a channel is clipped.
const CLIPPED_SHARE: f64 = 1e-3;
/// Resolution as a share of the standard deviation above which it is coarse: its noise is a tenth of a hundredth of the power.
const COARSE: f64 = 0.1;
/// Distance from the median, in robust standard deviations, at which a single sample is an outlier.
const OUTLIER: f64 = 15.0;
/// A jump of an angle within this share of a turn is one.
const NEARLY_A_TURN: f64 = 0.05;
/// Blocks of a record whose mean squares are compared for a trend.
const BLOCKS: usize = 20;

/// The samples that are numbers.
pub(super) fn finite(channel: &Channel) -> Vec<f64> {
    channel.samples.iter().copied().filter(|sample| sample.is_finite()).collect()
}

pub(super) fn mean_and_std(samples: &[f64]) -> (f64, f64) {
    let mean = samples.iter().sum::<f64>() / samples.len() as f64;
    (mean, (samples.iter().map(|s| (s - mean).powi(2)).sum::<f64>() / samples.len() as f64).sqrt())
}

/// The least distance between values in order; what is a billionth of their range or less is round-off.
pub(super) fn resolution(sorted: &[f64]) -> f64 {
    let range = sorted.last().zip(sorted.first()).map_or(0.0, |(high, low)| high - low);
    sorted.windows(2).map(|pair| pair[1] - pair[0]).filter(|step| *step > 1e-9 * range).fold(f64::INFINITY, f64::min)
}

/// What is wrong with a channel, and what is worth knowing of one that is used.
pub(super) fn channel_findings(channel: &Channel, role: &str, trial: usize) -> Vec<Finding> {
    let mut found = Vec::new();
    let used = role != "none";
    let severity = if used { "fault" } else { "remark" };
    let mut say = |code: &str, severity: &str, message: String, action: &str| {
        found.push(Finding::new(code, severity, trial, Some(&channel.name), message, action));
    };
    let samples = finite(channel);
    let missing = channel.samples.len() - samples.len();
    if missing > 0 {
        let first = channel.samples.iter().position(|sample| !sample.is_finite()).unwrap_or(0);
        let message = format!("{missing} of {} samples are missing, the first at sample {first}", channel.samples.len());
        say("missing-samples", severity, message, "cut the stretch out with `start`, `stop` or `exclude`, or repair the file");
    }
    if samples.len() < 3 {
        say("too-short", severity, format!("{} samples", samples.len()), "record longer");
        return found;
    }
    let mut sorted = samples.clone();
    sorted.sort_by(f64::total_cmp);
    if sorted[0] == sorted[sorted.len() - 1] {
        say("constant", severity, format!("it is {} throughout", sorted[0]), "check the sensor and its cable");
        return found;
    }
    let (_, std) = mean_and_std(&samples);
    let angle = channel.unit.quantity() == Quantity::Displacement && channel.unit.is_rotational();
    let turns = channel.samples.windows(2).filter(|pair| angle && ((pair[1] - pair[0]).abs() / TAU - 1.0).abs() < NEARLY_A_TURN).count();
    if turns > 0 {
        let message = format!("it jumps by a whole turn {turns} times: the encoder begins anew at its end");
        say("angle-wrapped", severity, message, "unwrap the angle before, or set the encoder's zero elsewhere");
        return found;
    }
    // Commands may hold a level on purpose; a sensor that does has reached its limit.
    if role != "reference"
        && let Some(message) = clipped(&samples)
    {
        say("clipped", severity, message, "lower the amplifier's gain or the perturbation");
    }
    if !used {
        return found;
    }
    let step = resolution(&sorted);
    if step > COARSE * std {
        let message = format!("its values are {step:.3e} apart, {:.0} % of its standard deviation", 100.0 * step / std);
        say("coarse-quantisation", "remark", message, "use a finer range of the sensor, or perturb more strongly");
    }
    let median = sorted[sorted.len() / 2];
    let mut distance: Vec<f64> = samples.iter().map(|s| (s - median).abs()).collect();
    distance.sort_by(f64::total_cmp);
    let robust = 1.4826 * distance[distance.len() / 2];
    let outliers = distance.iter().filter(|distance| **distance > OUTLIER * robust).count();
    if robust > 0.0 && outliers > 0 {
        let message = format!("{outliers} sample(s) lie more than {OUTLIER} robust standard deviations from the median");
        say("outliers", "remark", message, "look at the trace; cut a knock or a glitch out with `exclude`");
    }
    if let Some(z) = trend(&samples) {
        let message = format!("its mean square has a trend over the record (reverse arrangements, z = {z:.1})");
        say("not-stationary", "remark", message, "leave the beginning out with `start`, or expect a limb that changes");
    }
    found
}

/// In words, if samples stand still at the ends of their range.
fn clipped(samples: &[f64]) -> Option<String> {
    let (low, high) = samples.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), s| (low.min(*s), high.max(*s)));
    let (mut inside, mut run) = (0, 0);
    for k in 0..=samples.len() {
        let at_end = samples.get(k).is_some_and(|s| *s == low || *s == high) && (run == 0 || samples[k] == samples[k - 1]);
        if at_end {
            run += 1;
        } else {
            inside += if run >= CLIPPED_RUN { run } else { 0 };
            run = usize::from(samples.get(k).is_some_and(|s| *s == low || *s == high));
        }
    }
    let share = inside as f64 / samples.len() as f64;
    (share > CLIPPED_SHARE).then(|| format!("{:.1} % of its samples stand still at the ends of its range, {low} and {high}", 100.0 * share))
}

/// z of the reverse arrangements among the mean squares of blocks, if it is beyond 3.3 (one record in a thousand by chance).
fn trend(samples: &[f64]) -> Option<f64> {
    let size = samples.len() / BLOCKS;
    if size < 2 {
        return None;
    }
    let (mean, _) = mean_and_std(samples);
    let squares: Vec<f64> = samples.chunks_exact(size).take(BLOCKS).map(|block| block.iter().map(|s| (s - mean).powi(2)).sum()).collect();
    let n = squares.len() as f64;
    let reversed = (0..squares.len()).flat_map(|i| (i + 1..squares.len()).map(move |j| (i, j))).filter(|&(i, j)| squares[i] > squares[j]).count() as f64;
    let z = (reversed - n * (n - 1.0) / 4.0) / (n * (2.0 * n + 5.0) * (n - 1.0) / 72.0).sqrt();
    (z.abs() > 3.3).then_some(z)
}
