//! Repeated trials of one experiment, with the roles of their channels.

pub(crate) mod readings;
pub(crate) mod roles;
pub(crate) mod trial;
mod trim;

pub use roles::{RoleNames, Roles, axis_of};
pub use trial::{Channels, Trial};
pub use trim::Trim;

use crate::check::quality;
use crate::error::AnalysisError;
use ndof_signal::{Channel, Quantity, Recording, Unit, Warning};
use ndof_sysid::Ports;
use roles::prefix;
use std::sync::Arc;

/// Repeated trials of one experiment: same channels, same rate, one set of roles.
#[derive(Clone, Debug, PartialEq)]
pub struct Trials {
    /// Stretches of record, each analysed by itself; shared, so that copies cost nothing.
    pub trials: Arc<[Trial]>,
    /// Roles, the same in all.
    pub roles: Roles,
    /// What the reader of a result should know, each once.
    pub warnings: Vec<Warning>,
}

/// A channel's unit; one that says nothing of it takes the one of its role: an effort as input, a displacement as output.
pub(crate) fn unit_of(channel: &Channel, role: usize, roles: &Roles) -> Unit {
    match roles.motion(role) {
        Some(order) if channel.unit.symbol().is_empty() => {
            let rotational = channel.name.starts_with("angle_") || channel.name.starts_with("torque_");
            let quantity = match order {
                None => Quantity::Effort,
                Some(0) => Quantity::Displacement,
                Some(1) => Quantity::Velocity,
                Some(_) => Quantity::Acceleration,
            };
            Unit::si(quantity, rotational)
        }
        _ => channel.unit.clone(),
    }
}

/// The first channel that has another unit than in the first recording, as both write it; one that says nothing of its unit has none.
pub(crate) fn other_unit(channels: &[Channel], first: &Recording) -> Option<(String, String)> {
    let written = |channel: &Channel| format!("{} [{}]", channel.name, channel.unit.symbol());
    let mut both = channels.iter().filter_map(|own| Some((own, first.channels().iter().find(|channel| channel.name == own.name)?)));
    both.find(|(own, first)| !own.unit.symbol().is_empty() && own.unit != first.unit).map(|(own, first)| (written(own), written(first)))
}

/// Refuses a sensor that says one thing throughout a recording, by the least and greatest value of each channel; commands may rest.
pub(crate) fn require_motion(file: &str, ports: &Ports, names: &[String], ranges: &[[f64; 2]]) -> Result<(), AnalysisError> {
    match ports.inputs.iter().chain(&ports.outputs).find(|&&channel| ranges[channel][0] == ranges[channel][1]) {
        Some(&channel) => Err(AnalysisError::Constant { file: file.to_owned(), name: names[channel].clone(), value: ranges[channel][0] }),
        None => Ok(()),
    }
}

/// Leaves out what a gap or `exclude` has cut off a recording at its ends: it would add next to nothing, and no segment fits into it.
fn leave_out_short(stretches: &mut Vec<Trial>, warnings: &mut Vec<Warning>) {
    const SHORT: f64 = 0.02;
    let longest = stretches.iter().map(|stretch| stretch.recording.len()).max().unwrap_or(0);
    let files: Vec<String> = stretches.iter().map(|stretch| stretch.file.clone()).collect();
    stretches.retain(|stretch| {
        let part = files.iter().filter(|file| **file == stretch.file).count() > 1;
        let short = part && (stretch.recording.len() as f64) < SHORT * longest as f64;
        if short {
            let (from_s, samples) = (stretch.recording.start_s(), stretch.recording.len());
            warnings.push(Warning::new(
                "short-stretch",
                format!("{}: the {samples} samples from {from_s:.3} s on are too few to say anything and are left out", stretch.file),
                "nothing, if that is what `exclude` has cut off",
            ));
        }
        !short
    });
}

/// Refuses a recording that is given twice, which would count as more evidence than there is.
fn each_once(trials: &[Trial], used: &[String]) -> Result<(), AnalysisError> {
    let alike = |a: &Trial, b: &Trial, name: &String| match (a.recording.channel(name), b.recording.channel(name)) {
        (Ok(a), Ok(b)) => a.samples == b.samples,
        _ => false,
    };
    for (k, trial) in trials.iter().enumerate() {
        let same = |other: &&Trial| used.iter().all(|name| alike(other, trial, name));
        if let Some(first) = trials[..k].iter().find(same) {
            return Err(AnalysisError::SameTrial { file: trial.file.clone(), first: first.file.clone() });
        }
    }
    Ok(())
}

/// A warning for each channel that takes its unit from its role, though its name does not say which.
fn inferred_units(first: &Recording, used: &[String], roles: &Roles) -> Vec<Warning> {
    let inferred = |(role, name): (usize, &String)| {
        let channel = first.channel(name).ok().filter(|channel| channel.unit.symbol().is_empty() && prefix(name).is_none())?;
        let unit = unit_of(channel, role, roles);
        let message = format!("channel \"{name}\" says nothing of its unit and is taken in {}", unit.symbol());
        let action = format!("write it into the header, or give it with `channels={name}=\"{name} [{}]\"` (with the right unit)", unit.symbol());
        (!unit.symbol().is_empty()).then(|| Warning::new("unit-inferred", message, action))
    };
    used.iter().enumerate().filter_map(inferred).collect()
}

/// Adds what is not among them yet.
pub(crate) fn add_each(warnings: &mut Vec<Warning>, more: impl IntoIterator<Item = Warning>) {
    for warning in more {
        if !warnings.contains(&warning) {
            warnings.push(warning);
        }
    }
}

/// Where recordings come from.
#[derive(Clone, Copy, PartialEq)]
enum Source {
    Record,
    Stream,
    Simulator,
}

impl Trials {
    /// Trials from recordings: roles found, stretches cut out, channels without a role left out, the others checked.
    ///
    /// # Errors
    /// [`AnalysisError`] if there is none, a role cannot be filled, trials differ, or a channel that is used holds no numbers.
    pub fn new(trials: Vec<Trial>, names: &RoleNames, trim: &Trim) -> Result<Self, AnalysisError> {
        Trials::judged(trials, names, trim, Source::Record)
    }

    /// The same of what a simulator logged: at the same commands it logs the same again, which no measured recording does.
    ///
    /// # Errors
    /// As [`Trials::new`].
    pub fn simulated(trials: Vec<Trial>, names: &RoleNames, trim: &Trim) -> Result<Self, AnalysisError> {
        Trials::judged(trials, names, trim, Source::Simulator)
    }

    /// The same of pieces of a stream, whose channels stay as they are.
    pub(crate) fn of_stream(pieces: Vec<Trial>, names: &RoleNames) -> Result<Self, AnalysisError> {
        Trials::judged(pieces, names, &Trim::default(), Source::Stream)
    }

    /// The same of the first piece, by which nothing of the signals is judged.
    pub(crate) fn of_piece(piece: Trial, names: &RoleNames) -> Result<Self, AnalysisError> {
        Trials::assembled(vec![piece], names, &Trim::default(), Source::Stream)
    }

    /// With what is to be known of the signals.
    fn judged(trials: Vec<Trial>, names: &RoleNames, trim: &Trim, source: Source) -> Result<Self, AnalysisError> {
        let mut trials = Trials::assembled(trials, names, trim, source)?;
        trials.warnings.extend(quality(&trials.recordings(), &trials.roles));
        Ok(trials)
    }

    fn assembled(trials: Vec<Trial>, names: &RoleNames, trim: &Trim, source: Source) -> Result<Self, AnalysisError> {
        let first = trials.first().ok_or(AnalysisError::NoRecording)?;
        let mut roles = Roles::find(&first.recording, &first.file, names)?;
        let all_names = first.recording.names();
        let used: Vec<String> = roles.used().into_iter().chain(roles.kept.iter().copied()).map(|i| all_names[i].clone()).collect();
        if source != Source::Simulator {
            each_once(&trials, &used)?;
        }
        let mut warnings = roles.warnings.clone();
        warnings.extend(inferred_units(&first.recording, &used, &roles));
        let span = |trial: &Trial| [trial.recording.start_s(), trial.recording.start_s() + trial.recording.duration_s()];
        warnings.extend(trim.beside(&trials.iter().map(span).collect::<Vec<_>>()));
        let (first_file, rate) = (first.file.clone(), first.recording.sample_rate_hz());
        let mut stretches: Vec<Trial> = Vec::new();
        for Trial { file, recording, warnings: notes } in trials {
            let mismatch = |what, found, expected| AnalysisError::TrialMismatch { file: file.clone(), what, found, first: first_file.clone(), expected };
            add_each(&mut warnings, notes);
            if recording.sample_rate_hz() != rate {
                return Err(mismatch("the sample rate", format!("{} Hz", recording.sample_rate_hz()), format!("{rate} Hz")));
            }
            let own = recording.names();
            let order: Option<Vec<usize>> = used.iter().map(|name| own.iter().position(|n| n == name)).collect();
            let order = order.ok_or_else(|| mismatch("the list of channels", own.join(", "), all_names.join(", ")))?;
            for stretch in trim.apply(recording, &file)? {
                let wrap = |source| AnalysisError::Recording { file: file.clone(), source };
                let (start_s, metadata) = (stretch.start_s(), stretch.metadata().clone());
                let mut own: Vec<Option<Channel>> = stretch.into_channels().into_iter().map(Some).collect();
                // The samples themselves, without a copy; what is kept for a schedule may have a role as well.
                let taken = |(role, &i): (usize, &usize)| {
                    let mut channel = if order[role + 1..].contains(&i) { own[i].clone() } else { own[i].take() }?;
                    channel.unit = unit_of(&channel, role, &roles);
                    Some(channel)
                };
                let mut channels: Vec<Channel> = order.iter().enumerate().filter_map(taken).collect();
                // Of pieces of a stream the curve is not known.
                let whole = source != Source::Stream;
                for (_, channel) in channels.iter_mut().enumerate().filter(|(role, _)| whole && roles.motion(*role).flatten().is_some()) {
                    add_each(&mut warnings, readings::between_readings(channel, rate, &file));
                }
                if let Some((own, first)) = stretches.first().and_then(|first| other_unit(&channels, &first.recording)) {
                    return Err(mismatch("a channel", own, first));
                }
                let stretch = Recording::new(rate, channels).map_err(wrap)?.starting_at(start_s).with_metadata(metadata);
                stretch.require_finite(used.iter().map(String::as_str)).map_err(wrap)?;
                stretches.push(Trial::of(file.clone(), stretch));
            }
        }
        let (references, inputs, outputs) = (roles.ports.references.len(), roles.ports.inputs.len(), roles.ports.outputs.len());
        roles.ports = Ports {
            references: (0..references).collect(),
            inputs: (references..references + inputs).collect(),
            outputs: (references + inputs..references + inputs + outputs).collect(),
        };
        roles.kept = (references + inputs + outputs..used.len()).collect();
        leave_out_short(&mut stretches, &mut warnings);
        Ok(Trials { trials: stretches.into(), roles, warnings })
    }

    /// Trials with roles by the names of their channels, in full.
    ///
    /// # Errors
    /// As [`Trials::new`].
    pub fn of<'a>(trials: impl IntoIterator<Item = &'a Trial>) -> Result<Self, AnalysisError> {
        Trials::new(trials.into_iter().cloned().collect(), &RoleNames::default(), &Trim::default())
    }

    /// The recordings.
    pub fn recordings(&self) -> Vec<&Recording> {
        self.trials.iter().map(|trial| &trial.recording).collect()
    }

    /// Samples a second.
    pub fn sample_rate_hz(&self) -> f64 {
        self.trials.first().map_or(f64::NAN, |trial| trial.recording.sample_rate_hz())
    }

    /// Names of the channels with these indices.
    pub fn names(&self, indices: &[usize]) -> Vec<String> {
        self.channels(indices).iter().map(|channel| channel.name.clone()).collect()
    }

    /// The channels with these indices, of the first trial.
    pub fn channels(&self, indices: &[usize]) -> Vec<&Channel> {
        let Some(first) = self.trials.first() else { return Vec::new() };
        indices.iter().map(|&i| &first.recording.channels()[i]).collect()
    }

    /// SI units of the channels with these indices.
    pub fn units(&self, indices: &[usize]) -> Vec<String> {
        self.channels(indices).iter().map(|channel| channel.unit.symbol().to_owned()).collect()
    }

    /// The mean of a channel over all trials.
    pub fn mean(&self, index: usize) -> f64 {
        let (sum, count) = self.trials.iter().fold((0.0, 0), |(sum, count), trial| {
            let samples = &trial.recording.channels()[index].samples;
            (sum + samples.iter().sum::<f64>(), count + samples.len())
        });
        sum / count as f64
    }
}
