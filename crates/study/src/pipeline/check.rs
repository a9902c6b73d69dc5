//! Data quality before numbers.

use super::pairs::pairs;
use crate::result::check::{ChannelCheck, CheckResult, Finding, SCHEMA, TrialCheck};
use crate::result::{VERSION, Warning, number};
use crate::roles::{RoleNames, Roles};
use crate::trials::Trial;
use ndof_signal::{Channel, CrossSpectra, Quantity, Recording, Welch};
use std::f64::consts::TAU;

/// The code of what is wrong with the clock of a file.
const TIMING: &str = "sample-timing";
/// A run of at least so many equal samples at the end of a channel's range is a limit that was reached.
const CLIPPED_RUN: usize = 4;
/// Share of the samples in such runs above which a channel is clipped.
const CLIPPED_SHARE: f64 = 1e-3;
/// Resolution as a share of the standard deviation above which it is coarse: its noise is a tenth of a hundredth of the power.
const COARSE: f64 = 0.1;
/// Distance from the median, in robust standard deviations, at which a single sample is an outlier.
const OUTLIER: f64 = 15.0;
/// Coherence between two inputs, averaged over the band that they excite, above which they move together.
const TOGETHER: f64 = 0.5;
/// A jump of an angle within this share of a turn is one.
const NEARLY_A_TURN: f64 = 0.05;
/// Blocks of a record whose mean squares are compared for a trend.
const BLOCKS: usize = 20;

/// Looks at every channel of every file.
///
/// A recording whose roles cannot be found is looked at all the same, with a finding that says so.
pub fn check(trials: &[Trial], names: &RoleNames, command: &str) -> CheckResult {
    let (mut checked, mut findings, mut warnings) = (Vec::new(), Vec::new(), Vec::new());
    for (k, trial) in trials.iter().enumerate() {
        let roles = Roles::find(&trial.recording, &trial.file, names);
        if let Err(error) = &roles {
            findings.push(finding("roles", "fault", k, None, error.to_string(), "name channels with --input, --output and --reference"));
        }
        let roles = roles.ok();
        for note in trial.warnings.iter().filter(|note| note.code == TIMING) {
            findings.push(finding(TIMING, "fault", k, None, note.message.clone(), &note.action));
        }
        for warning in trial.warnings.iter().filter(|note| note.code != TIMING).chain(roles.iter().flat_map(|roles| &roles.warnings)) {
            if !warnings.contains(warning) {
                warnings.push(Warning::clone(warning));
            }
        }
        let channels = trial.recording.channels();
        let mut looks = Vec::with_capacity(channels.len());
        for (index, channel) in channels.iter().enumerate() {
            let role = role(roles.as_ref(), index);
            looks.push(look(channel, role, trial.recording.sample_rate_hz()));
            findings.extend(channel_findings(channel, role, k));
        }
        findings.extend(roles.iter().flat_map(|roles| together(&trial.recording, roles, k)));
        let (lags, of_pairs) = roles.as_ref().map(|roles| pairs(&trial.recording, roles, k)).unwrap_or_default();
        findings.extend(of_pairs);
        checked.push(TrialCheck {
            file: trial.file.clone(),
            lags,
            sample_rate_hz: trial.recording.sample_rate_hz(),
            duration_s: trial.recording.duration_s(),
            channels: looks,
        });
    }
    let faulty = findings.iter().any(|finding| finding.severity == "fault");
    let verdict = if faulty {
        "faulty"
    } else if findings.is_empty() {
        "good"
    } else {
        "usable"
    };
    CheckResult {
        schema: SCHEMA.to_owned(),
        ndof_version: VERSION.to_owned(),
        command: command.to_owned(),
        warnings,
        verdict: verdict.to_owned(),
        trials: checked,
        findings,
        assumptions: super::assumptions::assumptions(trials, names),
    }
}

/// What an analysis of these trials should warn of: each code once a channel.
pub(crate) fn quality(recordings: &[&Recording], roles: &Roles) -> Vec<Warning> {
    let mut seen: Vec<(String, Option<String>)> = Vec::new();
    let mut warnings = Vec::new();
    for (trial, recording) in recordings.iter().enumerate() {
        let of_channels = recording.channels().iter().enumerate().flat_map(|(index, channel)| channel_findings(channel, role(Some(roles), index), trial));
        for found in of_channels.chain(together(recording, roles, trial)).chain(pairs(recording, roles, trial).1) {
            let key = (found.code.clone(), found.channel.clone());
            if !seen.contains(&key) {
                let message = format!("trial {}{}: {}", trial + 1, found.channel.map(|channel| format!(", {channel}")).unwrap_or_default(), found.message);
                warnings.push(Warning::new(&found.code, message, found.action));
                seen.push(key);
            }
        }
    }
    warnings
}

fn role(roles: Option<&Roles>, index: usize) -> &'static str {
    let Some(ports) = roles.map(|roles| &roles.ports) else { return "none" };
    match index {
        _ if ports.references.contains(&index) => "reference",
        _ if ports.inputs.contains(&index) => "input",
        _ if ports.outputs.contains(&index) => "output",
        _ => "none",
    }
}

pub(super) fn finding(code: &str, severity: &str, trial: usize, channel: Option<&str>, message: String, action: &str) -> Finding {
    Finding { code: code.to_owned(), severity: severity.to_owned(), trial: trial + 1, channel: channel.map(str::to_owned), message, action: action.to_owned() }
}

fn finite(channel: &Channel) -> Vec<f64> {
    channel.samples.iter().copied().filter(|sample| sample.is_finite()).collect()
}

fn mean_and_std(samples: &[f64]) -> (f64, f64) {
    let mean = samples.iter().sum::<f64>() / samples.len() as f64;
    (mean, (samples.iter().map(|s| (s - mean).powi(2)).sum::<f64>() / samples.len() as f64).sqrt())
}

/// The least distance between values in order; what is a billionth of their range or less is round-off.
fn resolution(sorted: &[f64]) -> f64 {
    let range = sorted.last().zip(sorted.first()).map_or(0.0, |(high, low)| high - low);
    sorted.windows(2).map(|pair| pair[1] - pair[0]).filter(|step| *step > 1e-9 * range).fold(f64::INFINITY, f64::min)
}

fn look(channel: &Channel, role: &str, sample_rate_hz: f64) -> ChannelCheck {
    let samples = finite(channel);
    let (mean, std) = mean_and_std(&samples);
    let mut sorted = samples.clone();
    sorted.sort_by(f64::total_cmp);
    let step = resolution(&sorted);
    ChannelCheck {
        name: channel.name.clone(),
        unit: channel.unit.symbol().to_owned(),
        role: role.to_owned(),
        missing: channel.samples.len() - samples.len(),
        mean: number(mean),
        std: number(std),
        range: sorted.first().zip(sorted.last()).map(|(low, high)| [*low, *high]),
        step: number(step),
        band_hz: power_band(&samples, sample_rate_hz),
    }
}

/// The band that holds 98 % of a channel's power, one hundredth beyond each end.
fn power_band(samples: &[f64], sample_rate_hz: f64) -> Option<[f64; 2]> {
    let nperseg = (samples.len() / 8).checked_ilog2().filter(|bits| *bits >= 4).map(|bits| 1_usize << bits)?;
    power_band_of(&Welch::new(nperseg).spectra(sample_rate_hz, &[samples]).ok()?, 0)
}

/// The same from spectra.
pub(super) fn power_band_of(spectra: &CrossSpectra, channel: usize) -> Option<[f64; 2]> {
    let total: f64 = (1..spectra.frequency_hz().len()).map(|f| spectra.power(f, channel)).sum();
    let mut sum = 0.0;
    let mut ends = [None, None];
    for f in 1..spectra.frequency_hz().len() {
        sum += spectra.power(f, channel);
        for (end, share) in ends.iter_mut().zip([0.01, 0.99]) {
            if end.is_none() && sum >= share * total {
                *end = Some(spectra.frequency_hz()[f]);
            }
        }
    }
    ends[0].zip(ends[1]).filter(|_| total > 0.0).map(|(low, high)| [low, high])
}

fn channel_findings(channel: &Channel, role: &str, trial: usize) -> Vec<Finding> {
    let mut found = Vec::new();
    let name = channel.name.as_str();
    let used = role != "none";
    let severity = if used { "fault" } else { "remark" };
    let samples = finite(channel);
    let missing = channel.samples.len() - samples.len();
    if missing > 0 {
        let first = channel.samples.iter().position(|sample| !sample.is_finite()).unwrap_or(0);
        let message = format!("{missing} of {} samples are missing, the first at sample {first}", channel.samples.len());
        found.push(finding(
            "missing-samples",
            severity,
            trial,
            Some(name),
            message,
            "cut the stretch out with --start, --stop or --exclude, or repair the file",
        ));
    }
    if samples.len() < 3 {
        found.push(finding("too-short", severity, trial, Some(name), format!("{} samples", samples.len()), "record longer"));
        return found;
    }
    let mut sorted = samples.clone();
    sorted.sort_by(f64::total_cmp);
    if sorted[0] == sorted[sorted.len() - 1] {
        found.push(finding("constant", severity, trial, Some(name), format!("it is {} throughout", sorted[0]), "check the sensor and its cable"));
        return found;
    }
    let (_, std) = mean_and_std(&samples);
    let angle = channel.unit.quantity() == Quantity::Displacement && channel.unit.is_rotational();
    let turns = channel.samples.windows(2).filter(|pair| angle && ((pair[1] - pair[0]).abs() / TAU - 1.0).abs() < NEARLY_A_TURN).count();
    if turns > 0 {
        let message = format!("it jumps by a whole turn {turns} times: the encoder begins anew at its end");
        found.push(finding("angle-wrapped", severity, trial, Some(name), message, "unwrap the angle before, or set the encoder's zero elsewhere"));
        return found;
    }
    // Commands may hold a level on purpose; a sensor that does has reached its limit.
    if role != "reference" {
        found.extend(clipped(&samples, name, severity, trial));
    }
    let step = resolution(&sorted);
    if used && step > COARSE * std {
        let message = format!("its values are {step:.3e} apart, {:.0} % of its standard deviation", 100.0 * step / std);
        found.push(finding("coarse-quantisation", "remark", trial, Some(name), message, "use a finer range of the sensor, or perturb more strongly"));
    }
    let median = sorted[sorted.len() / 2];
    let mut distance: Vec<f64> = samples.iter().map(|s| (s - median).abs()).collect();
    distance.sort_by(f64::total_cmp);
    let robust = 1.4826 * distance[distance.len() / 2];
    let outliers = samples.iter().filter(|s| (*s - median).abs() > OUTLIER * robust).count();
    if used && robust > 0.0 && outliers > 0 {
        let message = format!("{outliers} sample(s) lie more than {OUTLIER} robust standard deviations from the median");
        found.push(finding("outliers", "remark", trial, Some(name), message, "look at the trace; cut a knock or a glitch out with --exclude"));
    }
    if used && let Some(z) = trend(&samples) {
        let message = format!("its mean square has a trend over the record (reverse arrangements, z = {z:.1})");
        found.push(finding("not-stationary", "remark", trial, Some(name), message, "leave the beginning out with --start, or expect a limb that changes"));
    }
    found
}

fn clipped(samples: &[f64], name: &str, severity: &str, trial: usize) -> Option<Finding> {
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
    (share > CLIPPED_SHARE).then(|| {
        let message = format!("{:.1} % of its samples stand still at the ends of its range, {low} and {high}", 100.0 * share);
        finding("clipped", severity, trial, Some(name), message, "lower the amplifier's gain or the perturbation")
    })
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

/// Pairs of inputs that move together.
fn together(recording: &Recording, roles: &Roles, trial: usize) -> Vec<Finding> {
    let inputs = &roles.ports.inputs;
    let Some(nperseg) = (recording.len() / 16).checked_ilog2().filter(|bits| *bits >= 4).map(|bits| 1_usize << bits) else { return Vec::new() };
    let Ok(spectra) = Welch::new(nperseg).spectra(recording.sample_rate_hz(), &recording.columns(inputs)) else { return Vec::new() };
    let mut found = Vec::new();
    for b in 0..inputs.len() {
        for a in 0..b {
            let bins = 1..spectra.frequency_hz().len();
            let weight: f64 = bins.clone().map(|f| (spectra.power(f, a) * spectra.power(f, b)).sqrt()).sum();
            let shared: f64 = bins.map(|f| spectra.at(f, a, b).norm_sqr() / (spectra.power(f, a) * spectra.power(f, b)).sqrt()).filter(|v| v.is_finite()).sum();
            if shared > TOGETHER * weight {
                let (first, second) = (&recording.channels()[inputs[a]].name, &recording.channels()[inputs[b]].name);
                let message = format!("inputs {first} and {second} move together (mean coherence {:.2})", shared / weight);
                let severity = if shared > 0.999 * weight { "fault" } else { "remark" };
                found.push(finding(
                    "inputs-together",
                    severity,
                    trial,
                    Some(second),
                    message,
                    "perturb the axes independently, or leave one of them out with --input",
                ));
            }
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndof_signal::Unit;

    fn codes(force: Vec<f64>, motion: Vec<f64>) -> Vec<String> {
        let channel = |name: &str, unit: &str, samples| Channel::new(name, Unit::parse(unit).expect("a unit").0, samples);
        let recording = Recording::new(100.0, vec![channel("force_x", "N", force), channel("pos_x", "m", motion)]).expect("valid");
        let trial = Trial { file: "a.csv".to_owned(), recording, warnings: Vec::new() };
        check(&[trial], &RoleNames::default(), "check").findings.into_iter().map(|finding| finding.code).collect()
    }

    /// Uniform noise, which has no outliers and no trend.
    fn noise(seed: u64) -> Vec<f64> {
        let mut state = seed;
        (0..4000)
            .map(|_| {
                state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                (state >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
            })
            .collect()
    }

    #[test]
    fn good_data_are_good() {
        assert_eq!(codes(noise(1), noise(2)), Vec::<String>::new());
    }

    #[test]
    fn each_fault_is_found_by_its_name() {
        let clipped: Vec<f64> = (0..4000).map(|k| (3.0 * (f64::from(k) * 0.05).sin()).clamp(-2.0, 2.0)).collect();
        assert_eq!(codes(clipped, noise(2)), ["clipped"]);
        assert_eq!(codes(vec![1.5; 4000], noise(2)), ["constant"]);
        let coarse = noise(3).iter().map(|s| (s * 2.0).round()).collect();
        assert!(codes(noise(1), coarse).contains(&"coarse-quantisation".to_owned()));
        let mut knocked = noise(4);
        knocked[100] = 50.0;
        assert!(codes(noise(1), knocked).contains(&"outliers".to_owned()));
        let mut holey = noise(5);
        holey[7] = f64::NAN;
        assert_eq!(codes(noise(1), holey), ["missing-samples"]);
        let growing = noise(6).iter().enumerate().map(|(k, s)| s * (1.0 + k as f64 / 500.0)).collect();
        assert_eq!(codes(noise(1), growing), ["not-stationary"]);
    }
}
