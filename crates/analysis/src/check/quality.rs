//! Everything that is found in one recording.

use super::channel::{channel_findings, meant, role};
use super::evenness::unsteady;
use super::pairs::{pairs, spectra, together};
use super::result::{Finding, Lag};
use crate::trials::readings::{ACTION, SlowReadings};
use crate::trials::roles::Roles;
use ndof_signal::{Amplitudes, CrossSpectra, Recording, Warning};
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
    let mut found: Vec<Finding> = channels
        .flat_map_iter(|(index, (channel, sizes))| channel_findings(channel, sizes, (role(roles, index), &meant(roles, index, channel)), trial))
        .collect();
    let Some(roles) = roles else { return (Vec::new(), found) };
    let slow = |index: usize| {
        let channel = &recording.channels()[index];
        let told = SlowReadings::of(&channel.samples)?.told(recording.sample_rate_hz());
        Some(Finding::new("slow-readings", "remark", trial, Some(&channel.name), told, ACTION))
    };
    found.extend(roles.motions().filter_map(slow));
    found.extend(unsteady(recording, roles, trial));
    found.extend(together(recording, spectra, roles, trial));
    let (lags, of_pairs) = pairs(recording, spectra, roles, trial);
    found.extend(of_pairs);
    (lags, found)
}

/// What an analysis of these trials should warn of: each code once a channel.
pub(crate) fn quality(recordings: &[&Recording], roles: &Roles) -> Vec<Warning> {
    let mut seen: Vec<(String, Option<String>)> = Vec::new();
    let mut warnings = Vec::new();
    let of_trial = |(trial, recording): (usize, &&Recording)| findings(recording, &amplitudes(recording), spectra(recording).as_ref(), Some(roles), trial).1;
    for found in recordings.iter().enumerate().flat_map(of_trial) {
        let key = (found.code.clone(), found.channel.clone());
        if !seen.contains(&key) {
            let message = format!("trial {}{}: {}", found.trial, found.channel.map(|channel| format!(", {channel}")).unwrap_or_default(), found.message);
            warnings.push(Warning::new(&found.code, message, found.action));
            seen.push(key);
        }
    }
    warnings
}
