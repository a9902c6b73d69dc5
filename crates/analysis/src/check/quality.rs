//! Everything that is found in one recording.

use super::channel::{channel_findings, meant, role};
use super::evenness::{even, unsteady};
use super::pairs::{pairs, spectra, together};
use super::result::{Finding, Lag};
use crate::trials::readings::{ACTION, SlowReadings};
use crate::trials::roles::Roles;
use ndof_signal::{Amplitudes, Channel, CrossSpectra, Recording, Warning};
use ndof_sysid::Steadiness;
use rayon::prelude::*;

/// The sizes of each channel's samples.
pub(super) fn amplitudes(recording: &Recording) -> Vec<Amplitudes<'_>> {
    recording.channels().par_iter().map(|channel| Amplitudes::of(&channel.samples)).collect()
}

/// Lags and findings of a recording: of each channel, then of channels that belong together.
pub(super) fn findings(
    recording: &Recording,
    sizes: &[Amplitudes],
    spectra: Option<&CrossSpectra>,
    roles: Option<&Roles>,
    trial: usize,
) -> (Vec<Lag>, Vec<Finding>) {
    let channels = recording.channels().par_iter().zip(sizes).enumerate();
    let alone: Vec<Alone> = channels.map(|(index, (channel, sizes))| Alone::of(channel, sizes, roles, (index, recording.sample_rate_hz()), trial)).collect();
    of_all(recording, &alone, spectra, roles, trial)
}

/// The same by what each channel tells, of a recording of which names, units and clock are looked at and no sample, unless it is too short for `spectra`.
fn of_all(recording: &Recording, alone: &[Alone], spectra: Option<&CrossSpectra>, roles: Option<&Roles>, trial: usize) -> (Vec<Lag>, Vec<Finding>) {
    let mut found: Vec<Finding> = alone.iter().flat_map(|channel| channel.findings.clone()).collect();
    let Some(roles) = roles else { return (Vec::new(), found) };
    found.extend(roles.motions().filter_map(|index| alone[index].slow.clone()));
    let driven = roles.ports.drivers().iter().filter_map(|&index| Some((index, alone[index].evenness.as_ref()?)));
    found.extend(unsteady(recording, roles, trial, driven));
    found.extend(together(recording, spectra, roles, trial));
    let (lags, of_pairs) = pairs(recording, spectra, roles, trial);
    found.extend(of_pairs);
    (lags, found)
}

/// What a channel tells by itself.
pub(crate) struct Alone {
    findings: Vec<Finding>,
    /// That a motion is read more slowly than rows are written.
    slow: Option<Finding>,
    /// How evenly a driver drives.
    pub evenness: Option<Steadiness>,
}

impl Alone {
    /// Of the channel at a place of a recording of some rate.
    fn of(channel: &Channel, sizes: &Amplitudes, roles: Option<&Roles>, (index, rate_hz): (usize, f64), trial: usize) -> Self {
        let moves = roles.is_some_and(|roles| roles.motions().any(|motion| motion == index));
        let slow = if moves { SlowReadings::of(&channel.samples) } else { None };
        let drives = roles.is_some_and(|roles| roles.ports.drivers().contains(&index));
        Alone {
            findings: channel_findings(channel, sizes, (role(roles, index), &meant(roles, index, channel)), trial),
            slow: slow.map(|slow| Finding::new("slow-readings", "remark", trial, Some(&channel.name), slow.told(rate_hz), ACTION)),
            evenness: if drives { even(&channel.samples, rate_hz) } else { None },
        }
    }

    /// Of a channel of the only trial, whose samples are not kept; `None` where they cannot be used as they are: one that is no number, a motion that is read
    /// slowly or stands still.
    pub fn usable(channel: &Channel, roles: &Roles, place: (usize, f64)) -> Option<Self> {
        let sizes = Amplitudes::of(&channel.samples);
        let alone = Alone::of(channel, &sizes, Some(roles), place, 0);
        let moves = roles.ports.references.contains(&place.0) || sizes.range[0] < sizes.range[1];
        (sizes.samples.len() == channel.samples.len() && alone.slow.is_none() && moves).then_some(alone)
    }
}

/// As [`quality`], by what each channel of the only trial tells and the spectra of all, `by_segments`.
pub(crate) fn quality_apart(recording: &Recording, alone: &[Alone], spectra: &CrossSpectra, roles: &Roles) -> Vec<Warning> {
    told(of_all(recording, alone, Some(spectra), Some(roles), 0).1)
}

/// What an analysis of these trials should warn of: each code once a channel.
pub(crate) fn quality(recordings: &[&Recording], roles: &Roles) -> Vec<Warning> {
    let of_trial = |(trial, recording): (usize, &&Recording)| findings(recording, &amplitudes(recording), spectra(recording).as_ref(), Some(roles), trial).1;
    told(recordings.iter().enumerate().flat_map(of_trial))
}

fn told(findings: impl IntoIterator<Item = Finding>) -> Vec<Warning> {
    let mut seen: Vec<(String, Option<String>)> = Vec::new();
    let mut warnings = Vec::new();
    for found in findings {
        let key = (found.code.clone(), found.channel.clone());
        if !seen.contains(&key) {
            let message = format!("trial {}{}: {}", found.trial, found.channel.map(|channel| format!(", {channel}")).unwrap_or_default(), found.message);
            warnings.push(Warning::new(&found.code, message, found.action));
            seen.push(key);
        }
    }
    warnings
}
