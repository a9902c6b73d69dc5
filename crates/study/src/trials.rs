//! Repeated trials of one experiment, with the roles of their channels.

use crate::error::StudyError;
use crate::pipeline::quality;
use crate::result::Warning;
use crate::roles::{RoleNames, Roles, prefix};
use crate::trim::Trim;
use ndof_signal::{Channel, Quantity, Recording, Unit};
use ndof_sysid::Ports;

/// One file's recording.
#[derive(Clone, Debug, PartialEq)]
pub struct Trial {
    /// What messages call it.
    pub file: String,
    /// Its samples.
    pub recording: Recording,
    /// What was done to read it.
    pub warnings: Vec<Warning>,
}

/// Repeated trials of one experiment: same channels, same rate, one set of roles.
#[derive(Clone, Debug, PartialEq)]
pub struct Trials {
    /// Stretches of record, each analysed by itself.
    pub trials: Vec<Trial>,
    /// Roles, the same in all.
    pub roles: Roles,
    /// What the reader of a result should know, each once.
    pub warnings: Vec<Warning>,
}

/// A channel that says nothing of its unit takes the one of its role: an effort as input, a displacement as output.
fn with_unit(channel: &Channel, role: usize, roles: &Roles) -> Channel {
    let mut channel = channel.clone();
    let motion = roles.input_motion.iter().chain(&roles.output_motion).nth(role.wrapping_sub(roles.ports.references.len()));
    if channel.unit.symbol().is_empty()
        && let Some(order) = motion
    {
        let rotational = channel.name.starts_with("angle_") || channel.name.starts_with("torque_");
        let quantity = match order {
            None => Quantity::Effort,
            Some(0) => Quantity::Displacement,
            Some(1) => Quantity::Velocity,
            Some(_) => Quantity::Acceleration,
        };
        channel.unit = Unit::si(quantity, rotational);
    }
    channel
}

/// The first channel that has another unit than in the first recording, as both write it; one that says nothing of its unit has none.
pub(crate) fn other_unit(channels: &[Channel], first: &Recording) -> Option<(String, String)> {
    let written = |channel: &Channel| format!("{} [{}]", channel.name, channel.unit.symbol());
    let mut both = channels.iter().filter_map(|own| Some((own, first.channels().iter().find(|channel| channel.name == own.name)?)));
    both.find(|(own, first)| !own.unit.symbol().is_empty() && own.unit != first.unit).map(|(own, first)| (written(own), written(first)))
}

/// Refuses a sensor that says one thing throughout a recording, by the least and greatest value of each channel; commands may rest.
pub(crate) fn require_motion(file: &str, ports: &Ports, names: &[String], ranges: &[[f64; 2]]) -> Result<(), StudyError> {
    match ports.inputs.iter().chain(&ports.outputs).find(|&&channel| ranges[channel][0] == ranges[channel][1]) {
        Some(&channel) => Err(StudyError::Constant { file: file.to_owned(), name: names[channel].clone(), value: ranges[channel][0] }),
        None => Ok(()),
    }
}

/// Leaves out what a gap or --exclude has cut off a recording at its ends: it would add next to nothing, and no segment fits into it.
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
                "nothing, if that is what --exclude has cut off",
            ));
        }
        !short
    });
}

/// Refuses a recording that is given twice, which would count as more evidence than there is.
fn each_once(trials: &[Trial], used: &[String]) -> Result<(), StudyError> {
    let alike = |a: &Trial, b: &Trial, name: &String| match (a.recording.channel(name), b.recording.channel(name)) {
        (Ok(a), Ok(b)) => a.samples == b.samples,
        _ => false,
    };
    for (k, trial) in trials.iter().enumerate() {
        let same = |other: &&Trial| used.iter().all(|name| alike(other, trial, name));
        if let Some(first) = trials[..k].iter().find(same) {
            return Err(StudyError::SameTrial { file: trial.file.clone(), first: first.file.clone() });
        }
    }
    Ok(())
}

impl Trials {
    /// Trials from recordings: roles found, stretches cut out, channels without a role left out, the others checked.
    ///
    /// # Errors
    /// [`StudyError`] if there is none, a role cannot be filled, trials differ, or a channel that is used holds no numbers.
    pub fn new(trials: Vec<Trial>, names: &RoleNames, trim: &Trim) -> Result<Self, StudyError> {
        let first = trials.first().ok_or(StudyError::NoRecording)?;
        let mut roles = Roles::find(&first.recording, &first.file, names)?;
        let used: Vec<usize> = roles.ports.references.iter().chain(&roles.ports.inputs).chain(&roles.ports.outputs).copied().collect();
        let all_names = first.recording.names();
        let used_names: Vec<String> = used.iter().map(|&i| all_names[i].clone()).collect();
        each_once(&trials, &used_names)?;
        let (first_file, rate) = (first.file.clone(), first.recording.sample_rate_hz());
        let (mut stretches, mut warnings): (Vec<Trial>, _) = (Vec::new(), roles.warnings.clone());
        for (role, name) in used_names.iter().enumerate() {
            if let Ok(channel) = first.recording.channel(name)
                && channel.unit.symbol().is_empty()
                && !with_unit(channel, role, &roles).unit.symbol().is_empty()
                && prefix(name).is_none()
            {
                warnings.push(Warning::new(
                    "unit-inferred",
                    format!("channel \"{name}\" says nothing of its unit and is taken in {}", with_unit(channel, role, &roles).unit.symbol()),
                    format!("write it into the header, or give it with --channels {name}=\"{name} [N]\" (with the right unit)"),
                ));
            }
        }
        for trial in trials {
            let Trial { file, recording, warnings: notes } = trial;
            for note in notes {
                if !warnings.contains(&note) {
                    warnings.push(note);
                }
            }
            let mismatch =
                |what, found: String, expected: String| StudyError::TrialMismatch { file: file.clone(), what, found, first: first_file.clone(), expected };
            if recording.sample_rate_hz() != rate {
                return Err(mismatch("the sample rate", format!("{} Hz", recording.sample_rate_hz()), format!("{rate} Hz")));
            }
            let own = recording.names();
            let order: Vec<Option<usize>> = used_names.iter().map(|name| own.iter().position(|n| n == name)).collect();
            let Some(order) = order.into_iter().collect::<Option<Vec<usize>>>() else {
                return Err(mismatch("the list of channels", own.join(", "), all_names.join(", ")));
            };
            for stretch in trim.apply(&recording, &file)? {
                let wrap = |source| StudyError::Recording { file: file.clone(), source };
                let channels: Vec<Channel> = order.iter().enumerate().map(|(role, &i)| with_unit(&stretch.channels()[i], role, &roles)).collect();
                if let Some((own, first)) = stretches.first().and_then(|first: &Trial| other_unit(&channels, &first.recording)) {
                    return Err(mismatch("a channel", own, first));
                }
                let stretch = Recording::new(rate, channels).map_err(wrap)?.starting_at(stretch.start_s()).with_metadata(stretch.metadata().clone());
                stretch.require_finite(used_names.iter().map(String::as_str)).map_err(wrap)?;
                stretches.push(Trial { file: file.clone(), recording: stretch, warnings: Vec::new() });
            }
        }
        let (references, inputs) = (roles.ports.references.len(), roles.ports.inputs.len());
        roles.ports = Ports {
            references: (0..references).collect(),
            inputs: (references..references + inputs).collect(),
            outputs: (references + inputs..used.len()).collect(),
        };
        leave_out_short(&mut stretches, &mut warnings);
        let looked_at: Vec<&Recording> = stretches.iter().map(|trial| &trial.recording).collect();
        warnings.extend(quality(&looked_at, &roles));
        Ok(Trials { trials: stretches, roles, warnings })
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
