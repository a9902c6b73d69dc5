//! Data quality before numbers.

mod assumptions;
mod channel;
mod evenness;
mod pairs;
mod quality;
pub mod result;
mod sign;

pub(crate) use evenness::evenness;
pub(crate) use pairs::by_segments;
pub(crate) use quality::{Alone, quality, quality_apart};

use crate::result::{Head, number};
use crate::trials::{RoleNames, Roles, Trial, add_each};
use channel::role;
use ndof_signal::{Amplitudes, Channel, CrossSpectra, Welch};
use quality::{amplitudes, findings};
use rayon::prelude::*;
use result::{ChannelCheck, CheckResult, Finding, TrialCheck};

/// The code of what is wrong with the clock of a file.
const TIMING: &str = "sample-timing";

/// Looks at every channel of every file.
///
/// A recording whose roles cannot be found is looked at all the same, with a finding that says so.
pub fn check(trials: &[Trial], names: &RoleNames) -> CheckResult {
    let (mut checked, mut found, mut warnings) = (Vec::new(), Vec::new(), Vec::new());
    let sizes: Vec<Vec<Amplitudes>> = trials.iter().map(|trial| amplitudes(&trial.recording)).collect();
    for (k, (trial, sizes)) in trials.iter().zip(&sizes).enumerate() {
        let roles = Roles::find(&trial.recording, &trial.file, names);
        if let Err(error) = &roles {
            // A finding is told with its file.
            let message = error.to_string().trim_start_matches(&format!("{}: ", trial.file)).to_owned();
            found.push(Finding::new("roles", "fault", k, None, message, "name channels with `input`, `output` and `reference`"));
        }
        let roles = roles.ok();
        let (timing, notes): (Vec<_>, Vec<_>) = trial.warnings.iter().cloned().partition(|note| note.code == TIMING);
        found.extend(timing.into_iter().map(|note| Finding::new(TIMING, "fault", k, None, note.message, &note.action)));
        add_each(&mut warnings, notes.into_iter().chain(roles.iter().flat_map(|roles| roles.warnings.clone())));
        let sample_rate_hz = trial.recording.sample_rate_hz();
        let channels = trial.recording.channels().par_iter().zip(sizes).enumerate();
        let spectra = pairs::spectra(&trial.recording);
        let of_all = spectra.as_ref();
        let channels = channels.map(|(index, (channel, sizes))| look(channel, sizes, role(roles.as_ref(), index), (sample_rate_hz, of_all, index))).collect();
        let (lags, of_trial) = findings(&trial.recording, sizes, of_all, roles.as_ref(), k);
        found.extend(of_trial);
        let against = of_all.zip(roles.as_ref()).map(|(spectra, roles)| sign::against(spectra, trial.recording.channels(), roles, k));
        found.extend(against.into_iter().flatten());
        checked.push(TrialCheck { file: trial.file.clone(), lags, sample_rate_hz, duration_s: trial.recording.duration_s(), channels });
    }
    let faulty = found.iter().any(|finding| finding.severity == "fault");
    let verdict = if faulty {
        "faulty"
    } else if found.is_empty() {
        "good"
    } else {
        "usable"
    };
    CheckResult {
        head: Head::new(CheckResult::SCHEMA, "check", warnings),
        verdict: verdict.to_owned(),
        trials: checked,
        findings: found,
        assumptions: assumptions::assumptions(trials, &sizes, names),
    }
}

/// What a channel is; `of_all` are the spectra of all channels of its trial, and its place there.
fn look(channel: &Channel, amplitudes: &Amplitudes, role: &str, (sample_rate_hz, of_all, index): (f64, Option<&CrossSpectra>, usize)) -> ChannelCheck {
    let Amplitudes { samples, mean, std, range: [low, high], .. } = amplitudes;
    ChannelCheck {
        name: channel.name.clone(),
        unit: channel.unit.symbol().to_owned(),
        role: role.to_owned(),
        missing: channel.samples.len() - samples.len(),
        mean: number(*mean),
        std: number(*std),
        range: (low <= high).then_some([*low, *high]),
        step: number(amplitudes.step()),
        band_hz: power_band(samples, sample_rate_hz, of_all, index),
    }
}

/// The band that holds 98 % of a channel's power, one hundredth beyond each end; by the spectra of all channels where their segments are as long.
fn power_band(samples: &[f64], sample_rate_hz: f64, of_all: Option<&CrossSpectra>, index: usize) -> Option<[f64; 2]> {
    let nperseg = (samples.len() / 8).checked_ilog2().filter(|bits| *bits >= 4).map(|bits| pairs::LONGEST.min(1 << bits))?;
    match of_all.filter(|spectra| spectra.frequency_hz().len() == nperseg / 2 + 1) {
        Some(spectra) => power_band_of(spectra, index),
        None => power_band_of(&Welch::new(nperseg).spectra(sample_rate_hz, &[samples]).ok()?, 0),
    }
}

/// The same from spectra.
pub(crate) fn power_band_of(spectra: &CrossSpectra, channel: usize) -> Option<[f64; 2]> {
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

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use ndof_signal::{Quantity, Recording, Unit};

    fn codes(force: Vec<f64>, motion: Vec<f64>) -> Vec<String> {
        let trial = Trial::new(100.0).effort("x", force).displacement("x", motion).expect("valid");
        check(&[trial], &RoleNames::default()).findings.into_iter().map(|finding| finding.code).collect()
    }

    /// Uniform noise, which has no outliers and no trend.
    pub(crate) fn uniform(samples: usize, mut state: u64) -> Vec<f64> {
        (0..samples)
            .map(|_| {
                state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                (state >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
            })
            .collect()
    }

    fn noise(seed: u64) -> Vec<f64> {
        uniform(4000, seed)
    }

    #[test]
    fn good_data_are_good() {
        assert_eq!(codes(noise(1), noise(2)), Vec::<String>::new());
    }

    #[test]
    fn each_fault_is_found_by_its_name() {
        let clipped: Vec<f64> = (0..4000).map(|k| (3.0 * (f64::from(k) * 0.05).sin()).clamp(-2.0, 2.0)).collect();
        assert_eq!(codes(clipped, noise(2)), ["clipped"]);
        // A joint that turns, as its encoder says it: for some samples it stands at the end of its way.
        let turning = (0..4000).map(|k| ((f64::from(k) * 0.01).sin() * 1e3).round() / 1e3).collect();
        assert!(!codes(turning, noise(2)).contains(&"clipped".to_owned()));
        // The same by ten steps in all: one of them is a long way, and no arrival.
        let in_steps = (0..4000).map(|k| (5.0 * (f64::from(k) * 0.01).sin()).round()).collect();
        assert!(!codes(in_steps, noise(2)).contains(&"clipped".to_owned()));
        // Steps of a force, each held for a while, and a sequence of two levels.
        let held: Vec<f64> = (0..4000).map(|k| [-2.0, 1.0, 0.0, 2.0, -1.0][k / 90 % 5]).collect();
        let two = noise(6).iter().map(|s| s.signum()).collect();
        assert!([held, two].into_iter().all(|levels| !codes(levels, noise(2)).contains(&"clipped".to_owned())));
        assert_eq!(codes(vec![1.5; 4000], noise(2)), ["constant"]);
        let coarse = noise(3).iter().map(|s| (s * 2.0).round()).collect();
        let coarse = codes(noise(1), coarse);
        assert!(coarse.contains(&"coarse-quantisation".to_owned()) && !coarse.contains(&"clipped".to_owned()), "{coarse:?}");
        // A command has the levels that it was given.
        let levels: Vec<f64> = noise(5).iter().map(|s| s.signum()).collect();
        let commanded = Trial::new(100.0).command("x", levels).effort("x", noise(1)).displacement("x", noise(2)).expect("valid");
        let found = check(&[commanded], &RoleNames::default()).findings;
        assert!(found.iter().all(|finding| finding.code != "coarse-quantisation"), "{found:?}");
        let mut knocked = noise(4);
        knocked[100] = 50.0;
        assert!(codes(noise(1), knocked).contains(&"outliers".to_owned()));
        // A bit that was lost, small beside the motion; a step and a turn of the same size are motions.
        let slow = |k: usize| (k as f64 * 0.02).sin() + 1e-3 * (k % 7) as f64;
        let lost = (0..4000).map(|k| slow(k) + if k == 2000 { 0.25 } else { 0.0 }).collect();
        let moved = (0..4000).map(|k| slow(k) + if k >= 2000 { 0.25 } else { 0.0 }).collect();
        assert_eq!([codes(noise(1), lost), codes(noise(1), moved)].map(|codes| codes.contains(&"lone-samples".to_owned())), [true, false]);
        // A bus that stops for six samples, and a limb that rests for them.
        let fast = |k: usize| (k as f64 * 0.05).sin() + 1e-4 * (k % 7) as f64;
        let stops = (0..4000).map(|k| fast(if (2010..2016).contains(&k) { 2009 } else { k })).collect();
        let rests = (0..4000).map(|k| fast(if k < 2010 { k } else { 2009.max(k - 6) })).collect();
        assert_eq!([codes(noise(1), stops), codes(noise(1), rests)].map(|codes| codes.contains(&"frozen".to_owned())), [true, false]);
        let in_millimetres = noise(7).iter().map(|x| x * 20.0).collect();
        assert_eq!(codes(noise(1), in_millimetres), ["unlikely-unit"]);
        let mut holey = noise(5);
        holey[7] = f64::NAN;
        assert_eq!(codes(noise(1), holey), ["missing-samples"]);
        let growing = noise(6).iter().enumerate().map(|(k, s)| 0.1 * s * (1.0 + k as f64 / 500.0)).collect();
        assert_eq!(codes(noise(1), growing), ["not-stationary"]);
        // A sensor that warms up: the mean square about the mean of the record falls and rises again.
        let drifting = noise(6).iter().enumerate().map(|(k, s)| s + k as f64 / 4000.0).collect();
        assert_eq!(codes(noise(1), drifting), ["drift"]);
    }

    #[test]
    fn an_effort_that_goes_against_its_motion_is_said_of_every_motion() {
        let force = noise(8);
        let (mut x, mut v) = (0.0, 0.0);
        let step = |f: &f64| {
            v += (f - 12.0 * v - 300.0 * x) / 2.0 * 1e-2;
            x += v * 1e-2;
            [x, v]
        };
        let moved: Vec<[f64; 2]> = force.iter().map(step).collect();
        let turned: Vec<f64> = force.iter().map(|f| -f).collect();
        let [x, v] = [0, 1].map(|k| moved.iter().map(|m| m[k]).collect::<Vec<f64>>());
        let found = |force: &[f64], name: &str, quantity: Quantity, motion: &[f64]| {
            let channels = [("force_x", Quantity::Effort, force), (name, quantity, motion)];
            let channels = channels.map(|(name, quantity, samples)| Channel::new(name, Unit::si(quantity, false), samples.to_vec()));
            let trial = Trial::of("trial.csv", Recording::new(100.0, channels.to_vec()).expect("valid"));
            check(&[trial], &RoleNames::default()).findings.iter().any(|finding| finding.code == "force-sign")
        };
        assert_eq!([&force, &turned].map(|force| found(force, "pos_x", Quantity::Displacement, &x)), [false, true]);
        assert_eq!([&force, &turned].map(|force| found(force, "vel_x", Quantity::Velocity, &v)), [false, true]);
    }

    /// A name that the user gives says what a column is as well as a header does.
    #[test]
    fn a_unit_that_follows_from_a_role_is_looked_at_as_well() {
        let channel = |name: &str, samples| Channel::new(name, Unit::other(""), samples);
        let millimetres = noise(7).iter().map(|x| x * 20.0).collect();
        let recording = Recording::new(100.0, vec![channel("Fx", noise(1)), channel("X", millimetres)]).expect("valid");
        let names = RoleNames { inputs: Some(vec!["Fx".to_owned()]), outputs: Some(vec!["X".to_owned()]), ..RoleNames::default() };
        let found = check(&[Trial::of("trial.csv", recording)], &names);
        assert!(found.findings.iter().any(|finding| finding.code == "unlikely-unit"), "{:?}", found.findings);
    }
}
