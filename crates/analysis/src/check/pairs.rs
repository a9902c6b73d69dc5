//! What two channels of one axis say about each other: swapped, crossed, late, or in another unit.

use super::result::{Finding, Lag};
use crate::result::number;
use crate::trials::roles::{Roles, axis_of, motion_order};
use ndof_signal::{Channel, CrossSpectra, Quantity, Recording, Welch};
use num_complex::Complex64;
use std::f64::consts::TAU;

/// Coherence from which a frequency says something about a pair of channels.
const TELLING: f64 = 0.5;
/// Mean coherence from which an input and an output belong together; a resonance that the window smears has no more.
const BELONG: f64 = 0.3;
/// Coherence between two inputs, averaged over the band that they excite, above which they move together.
const TOGETHER: f64 = 0.5;
/// Frequencies that are needed for a slope.
pub(super) const FEWEST: usize = 8;
/// Slope of log |effort/motion|² over log f below which the effort is smoother than the motion: no mechanism does that, since
/// inertia, damping and stiffness make slopes of 4, 2 and 0.
const SMOOTHER: f64 = -1.5;
/// One motion is another's derivative; a gain further from one than this is a wrong unit or calibration.
const GAIN: f64 = 0.05;
/// Lag between two measurements of one motion, in samples, that is worth a word.
const LATE: f64 = 0.5;

/// The longest segment that anything is looked at with, a minute at 1 kHz, or this much of an hour would be one transform.
pub(super) const LONGEST: usize = 1 << 16;

/// Length of the segments that channels are compared with; none for a short recording.
fn segment(samples: usize, fewest_bits: u32) -> Option<usize> {
    (samples / 16).checked_ilog2().filter(|bits| *bits >= fewest_bits).map(|bits| LONGEST.min(1 << bits))
}

/// How channels of so many samples are compared, if they are long enough.
pub(crate) fn by_segments(samples: usize) -> Option<Welch> {
    segment(samples, 5).map(Welch::new)
}

/// Spectra of all channels, if the recording is long enough and holds no missing sample.
pub(super) fn spectra(recording: &Recording) -> Option<CrossSpectra> {
    let all: Vec<usize> = (0..recording.channels().len()).collect();
    by_segments(recording.len())?.spectra(recording.sample_rate_hz(), &recording.columns(&all)).ok()
}

/// Lags and findings of all pairs of one trial, by its [`spectra`].
pub(super) fn pairs(recording: &Recording, spectra: Option<&CrossSpectra>, roles: &Roles, trial: usize) -> (Vec<Lag>, Vec<Finding>) {
    let Some(spectra) = spectra else { return (Vec::new(), Vec::new()) };
    let channels = recording.channels();
    let mut findings: Vec<Finding> = smoother(spectra, channels, roles, trial).into_iter().chain(crossed(spectra, channels, roles, trial)).collect();
    let mut lags = Vec::new();
    for (&reference, &input) in roles.ports.references.iter().zip(&roles.ports.inputs) {
        if axis_of(&channels[reference].name) == axis_of(&channels[input].name) {
            lags.extend(lag(spectra, channels, reference, input, 0).map(|(lag, _)| lag));
        }
    }
    for (later, earlier) in (0..channels.len()).flat_map(|b| (0..channels.len()).map(move |a| (b, a))) {
        let (Some(high), Some(low)) = (motion(recording, later), motion(recording, earlier)) else { continue };
        if high <= low || axis_of(&channels[later].name) != axis_of(&channels[earlier].name) {
            continue;
        }
        let Some((lag, gain)) = lag(spectra, channels, earlier, later, high - low) else { continue };
        let (name, of) = (&channels[later].name, &channels[earlier].name);
        if (gain - 1.0).abs() > GAIN {
            let message = format!("{name} is {gain:.3} times the derivative of {of}");
            findings.push(Finding::new("motions-disagree", "remark", trial, Some(name), message, "check units and calibration of both"));
        }
        if lag.lag_s.is_some_and(|lag_s| (lag_s * recording.sample_rate_hz()).abs() > LATE) {
            let message = format!("{name} comes {:.2} ms after the derivative of {of}", 1e3 * lag.lag_s.unwrap_or(0.0));
            findings.push(Finding::new("lag", "remark", trial, Some(name), message, "give both the same filter and the same clock; `align` joins two clocks"));
        }
        lags.push(lag);
    }
    (lags, findings)
}

fn motion(recording: &Recording, index: usize) -> Option<i32> {
    let channel = &recording.channels()[index];
    let named = ["pos_", "angle_", "vel_", "acc_"].iter().any(|prefix| channel.name.starts_with(prefix));
    if named { motion_order(recording, index) } else { None }
}

pub(super) fn coherence(spectra: &CrossSpectra, f: usize, a: usize, b: usize) -> f64 {
    spectra.at(f, a, b).norm_sqr() / (spectra.power(f, a) * spectra.power(f, b))
}

/// Frequencies at which two channels are coherent.
pub(super) fn telling(spectra: &CrossSpectra, a: usize, b: usize) -> Vec<usize> {
    (1..spectra.frequency_hz().len()).filter(|&f| coherence(spectra, f, a, b) > TELLING).collect()
}

/// By how much `to` comes after `from` differentiated `orders` times, from the slope of the phase, and the ratio of the two.
fn lag(spectra: &CrossSpectra, channels: &[Channel], from: usize, to: usize, orders: i32) -> Option<(Lag, f64)> {
    let bins = telling(spectra, from, to);
    if bins.len() < FEWEST {
        return None;
    }
    let hz = spectra.frequency_hz();
    let ratio = |f: usize| spectra.at(f, to, from) / (spectra.power(f, from) * Complex64::new(0.0, TAU * hz[f]).powi(orders));
    // The delay that turns all phasors into one direction: the sum of the products of neighbours has the phase −2π Δf τ.
    let turn: Complex64 = bins
        .windows(2)
        .filter(|pair| pair[1] == pair[0] + 1)
        .map(|pair| {
            let weight = (coherence(spectra, pair[0], from, to) * coherence(spectra, pair[1], from, to)).sqrt();
            let product = ratio(pair[1]) * ratio(pair[0]).conj();
            product * (weight / product.norm())
        })
        .filter(|term| term.is_finite())
        .sum();
    if turn.norm() == 0.0 {
        return None; // No two neighbours tell anything, and single lines do not tell a delay.
    }
    let step_hz = hz.get(2)? - hz.get(1)?;
    let lag_s = -turn.arg() / (TAU * step_hz);
    let total: f64 = bins.iter().map(|&f| coherence(spectra, f, from, to)).sum();
    let gain = bins.iter().map(|&f| coherence(spectra, f, from, to) * ratio(f).norm()).sum::<f64>() / total;
    let lag = Lag { from: channels[from].name.clone(), to: channels[to].name.clone(), lag_s: number(lag_s), coherence: total / bins.len() as f64 };
    Some((lag, gain))
}

/// A force that is smoother than the motion it belongs to.
fn smoother(spectra: &CrossSpectra, channels: &[Channel], roles: &Roles, trial: usize) -> Vec<Finding> {
    let effort = |i: usize| channels[i].unit.quantity() == Quantity::Effort;
    let displacement = |i: usize| channels[i].unit.quantity() == Quantity::Displacement;
    let pairs = roles.ports.inputs.iter().flat_map(|&i| roles.ports.outputs.iter().map(move |&o| (i, o)));
    let pairs = pairs.filter_map(|(i, o)| match (effort(i) && displacement(o), effort(o) && displacement(i)) {
        (true, _) => Some((i, o)),
        (_, true) => Some((o, i)),
        _ => None,
    });
    let mut found = Vec::new();
    for (effort, motion) in pairs.filter(|&(effort, motion)| axis_of(&channels[effort].name) == axis_of(&channels[motion].name)) {
        let points: Vec<(f64, f64)> = telling(spectra, effort, motion)
            .into_iter()
            .map(|f| (spectra.frequency_hz()[f].ln(), (spectra.power(f, effort) / spectra.power(f, motion)).ln()))
            .collect();
        let Some(slope) = slope(&points) else { continue };
        if slope < SMOOTHER {
            let (force, moved) = (&channels[effort].name, &channels[motion].name);
            let message = format!("{force} falls faster with frequency than {moved} (power as f^{slope:.1}), as no force that causes a motion does");
            let action = "check whether the columns of force and motion are swapped, or the force is filtered";
            found.push(Finding::new("channels-swapped", "remark", trial, Some(force), message, action));
        }
    }
    found
}

fn slope(points: &[(f64, f64)]) -> Option<f64> {
    if points.len() < FEWEST {
        return None;
    }
    let n = points.len() as f64;
    let (mx, my) = (points.iter().map(|p| p.0).sum::<f64>() / n, points.iter().map(|p| p.1).sum::<f64>() / n);
    let spread: f64 = points.iter().map(|p| (p.0 - mx).powi(2)).sum();
    number(points.iter().map(|p| (p.0 - mx) * (p.1 - my)).sum::<f64>() / spread)
}

/// Two axes whose outputs follow each other's inputs and not their own.
fn crossed(spectra: &CrossSpectra, channels: &[Channel], roles: &Roles, trial: usize) -> Vec<Finding> {
    let (inputs, outputs) = (&roles.ports.inputs, &roles.ports.outputs);
    let mean = |a: usize, b: usize| {
        let bins = 1..spectra.frequency_hz().len();
        let weight = |f: usize| spectra.power(f, a).sqrt() * spectra.power(f, b).sqrt();
        let total: f64 = bins.clone().map(weight).sum();
        bins.map(|f| weight(f) * coherence(spectra, f, a, b)).filter(|v| v.is_finite()).sum::<f64>() / total
    };
    let mut found = Vec::new();
    for b in 0..inputs.len().min(outputs.len()) {
        for a in 0..b {
            let (own, other) = (mean(inputs[a], outputs[a]).max(mean(inputs[b], outputs[b])), mean(inputs[a], outputs[b]).min(mean(inputs[b], outputs[a])));
            if other > BELONG && own < 0.5 * other {
                let names = [inputs[a], outputs[b], inputs[b], outputs[a]].map(|i| channels[i].name.as_str());
                let message = format!(
                    "{} goes with {}, and {} with {} (coherence {other:.2}, with their own axes {own:.2} at most)",
                    names[0], names[1], names[2], names[3]
                );
                let action = "check whether two columns are swapped; name them with `channels`";
                found.push(Finding::new("axes-crossed", "remark", trial, Some(names[1]), message, action));
            }
        }
    }
    found
}

/// Pairs of inputs that move together, by the [`spectra`] of the trial where there are any, else by those of its inputs.
pub(super) fn together(recording: &Recording, all: Option<&CrossSpectra>, roles: &Roles, trial: usize) -> Vec<Finding> {
    let inputs = &roles.ports.inputs;
    let of_inputs = |nperseg| Welch::new(nperseg).spectra(recording.sample_rate_hz(), &recording.columns(inputs)).ok();
    let own = if all.is_none() { segment(recording.len(), 4).and_then(of_inputs) } else { None };
    let places: Vec<usize> = if all.is_some() { inputs.clone() } else { (0..inputs.len()).collect() };
    let Some(spectra) = all.or(own.as_ref()) else { return Vec::new() };
    let mut found = Vec::new();
    for second in 0..inputs.len() {
        for first in 0..second {
            let (a, b) = (places[first], places[second]);
            let bins = 1..spectra.frequency_hz().len();
            let weight: f64 = bins.clone().map(|f| (spectra.power(f, a) * spectra.power(f, b)).sqrt()).sum();
            let shared: f64 = bins.map(|f| spectra.at(f, a, b).norm_sqr() / (spectra.power(f, a) * spectra.power(f, b)).sqrt()).filter(|v| v.is_finite()).sum();
            if shared > TOGETHER * weight {
                let (first, second) = (&recording.channels()[inputs[first]].name, &recording.channels()[inputs[second]].name);
                let message = format!("inputs {first} and {second} move together (mean coherence {:.2})", shared / weight);
                let severity = if shared > 0.999 * weight { "fault" } else { "remark" };
                let action = "perturb the axes independently, or leave one of them out with `input`";
                found.push(Finding::new("inputs-together", severity, trial, Some(second), message, action));
            }
        }
    }
    found
}
