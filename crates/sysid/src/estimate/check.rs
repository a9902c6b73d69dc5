//! What every estimator refuses, in the same words.

use super::error::{EstimateError, LARGEST, SMALLEST};
use crate::labels::Labels;
use crate::ports::Ports;
use ndof_signal::{CrossSpectra, Recording, SpectraError};

/// Variation as a share of the largest value below which nothing but rounding varies.
const ROUNDING: f64 = 1e-14;

/// Channels and labels of each role.
fn roles<'a>(ports: &'a Ports, labels: &'a Labels) -> [(&'static str, &'a [usize], &'a [String]); 3] {
    [("reference", &ports.references, &labels.references), ("input", &ports.inputs, &labels.inputs), ("output", &ports.outputs, &labels.outputs)]
}

/// Channels fit the spectra, labels fit the channels.
pub(crate) fn ports(spectra: &CrossSpectra, ports: &Ports, labels: &Labels) -> Result<(), EstimateError> {
    ports.validate(spectra.channels())?;
    match roles(ports, labels).into_iter().find(|(_, channels, names)| channels.len() != names.len()) {
        Some((role, channels, names)) => Err(EstimateError::Labels { role, labels: names.len(), ports: channels.len() }),
        None => Ok(()),
    }
}

/// Trials have as many channels as the first, at its sample rate.
pub(crate) fn alike(trials: &[&Recording]) -> Result<(), EstimateError> {
    let kind = |recording: &Recording| [("channels", recording.channels().len() as f64), ("Hz sample rate", recording.sample_rate_hz())];
    for (k, recording) in trials.iter().enumerate() {
        for ((what, expected), (_, found)) in kind(trials[0]).into_iter().zip(kind(recording)) {
            if expected != found {
                return Err(SpectraError::Mismatch { trial: k + 1, what, expected, found }.into());
            }
        }
    }
    Ok(())
}

/// Drivers move, and every channel moves by what powers can be computed of.
pub(crate) fn sizes(trials: &[&Recording], ports: &Ports, labels: &Labels) -> Result<(), EstimateError> {
    for (role, channels, names) in roles(ports, labels) {
        for (&channel, name) in channels.iter().zip(names) {
            let (mut size, mut still) = (0.0_f64, true);
            for samples in trials.iter().filter_map(|trial| trial.channels().get(channel)).map(|channel| &channel.samples) {
                let (low, high) = samples.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(*x), high.max(*x)));
                still &= high - low <= ROUNDING * low.abs().max(high.abs());
                // Where a channel stands far from zero, it is the mean that has to be squared.
                size = size.max(high - low).max(if high.abs().max(low.abs()) > LARGEST { f64::INFINITY } else { 0.0 });
            }
            if still && role != "output" && size < LARGEST {
                return Err(EstimateError::Silent { role, name: name.clone() });
            }
            if size > 0.0 && !(SMALLEST..=LARGEST).contains(&size) {
                return Err(EstimateError::Size { role, name: name.clone(), size });
            }
        }
    }
    Ok(())
}

/// The same from spectra alone: a channel's size is the root of its power over all frequencies.
pub(crate) fn powers(spectra: &CrossSpectra, ports: &Ports, labels: &Labels) -> Result<(), EstimateError> {
    let hz = spectra.frequency_hz();
    let step_hz = if let [first, second, ..] = hz { second - first } else { 1.0 };
    for (role, channels, names) in roles(ports, labels) {
        for (&channel, name) in channels.iter().zip(names) {
            let size = (step_hz * (0..hz.len()).map(|f| spectra.power(f, channel)).sum::<f64>()).sqrt();
            // The root mean square of a single peak is a small share of its height.
            if size != 0.0 && !(1e-3 * SMALLEST..=LARGEST).contains(&size) {
                return Err(EstimateError::Size { role, name: name.clone(), size });
            }
        }
    }
    Ok(())
}

/// ν = n_e − q, which must be positive.
pub(crate) fn degrees_of_freedom(averages: f64, unknowns: usize) -> Result<f64, EstimateError> {
    let freedom = averages - unknowns as f64;
    // n_e of segments that do not overlap is a whole number up to round-off; below it nothing is left to judge by.
    if freedom > 1e-9 { Ok(freedom) } else { Err(EstimateError::TooFewAverages { averages, unknowns }) }
}

/// An error that names the channels to blame if no bin has an estimate.
pub(crate) fn not_all_singular(
    spectra: &CrossSpectra,
    channels: &[usize],
    names: &[String],
    role: &'static str,
    singular: &[usize],
) -> Result<(), EstimateError> {
    let bins = spectra.frequency_hz().len() - usize::from(spectra.mean_removed());
    if singular.len() < bins {
        return Ok(());
    }
    for (name, &channel) in names.iter().zip(channels) {
        if singular.iter().all(|&f| spectra.power(f, channel) <= 0.0) {
            return Err(EstimateError::Silent { role, name: name.clone() });
        }
    }
    let mut worst = (0.0, Vec::new());
    for i in 0..channels.len() {
        for j in 0..i {
            let sum: f64 = singular
                .iter()
                .map(|&f| spectra.at(f, channels[i], channels[j]).norm_sqr() / (spectra.power(f, channels[i]) * spectra.power(f, channels[j])))
                .filter(|c| c.is_finite())
                .sum();
            let mean = sum / singular.len().max(1) as f64;
            if mean > worst.0 {
                worst = (mean, vec![names[j].clone(), names[i].clone()]);
            }
        }
    }
    // No pair alone explains it: three or more channels depend on each other.
    let names = if worst.0 > 0.999 { worst.1 } else { names.to_vec() };
    Err(EstimateError::Dependent { role, names })
}
