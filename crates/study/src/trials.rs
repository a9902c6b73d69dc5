//! Repeated trials of one experiment, with the roles of their channels.

use crate::error::StudyError;
use crate::result::Warning;
use crate::roles::{RoleNames, Roles};
use crate::trim::Trim;
use ndof_signal::Recording;

/// One file's recording.
#[derive(Clone, Debug, PartialEq)]
pub struct Trial {
    /// What messages call it.
    pub file: String,
    /// Its samples.
    pub recording: Recording,
}

/// Repeated trials of one experiment: same channels, same rate, one set of roles.
#[derive(Clone, Debug, PartialEq)]
pub struct Trials {
    /// Stretches of record, each analysed by itself.
    pub trials: Vec<Trial>,
    /// Roles, the same in all.
    pub roles: Roles,
}

impl Trials {
    /// Trials from recordings: roles found, stretches cut out, channels checked.
    ///
    /// # Errors
    /// [`StudyError`] if there is none, a role cannot be filled, trials differ, or a channel that is used holds no numbers.
    pub fn new(trials: Vec<Trial>, names: &RoleNames, trim: &Trim) -> Result<Self, StudyError> {
        let first = trials.first().ok_or(StudyError::NoRecording)?;
        let roles = Roles::find(&first.recording, &first.file, names)?;
        let used: Vec<usize> = roles.ports.references.iter().chain(&roles.ports.inputs).chain(&roles.ports.outputs).copied().collect();
        let (first_file, rate, all_names) = (first.file.clone(), first.recording.sample_rate_hz(), first.recording.names());
        let mut stretches = Vec::new();
        for trial in trials {
            let Trial { file, recording } = trial;
            let mismatch =
                |what, found: String, expected: String| StudyError::TrialMismatch { file: file.clone(), what, found, first: first_file.clone(), expected };
            if recording.sample_rate_hz() != rate {
                return Err(mismatch("the sample rate", format!("{} Hz", recording.sample_rate_hz()), format!("{rate} Hz")));
            }
            let order = all_names.iter().map(|name| recording.names().iter().position(|n| n == name)).collect::<Option<Vec<_>>>();
            let Some(order) = order.filter(|_| recording.channels().len() == all_names.len()) else {
                return Err(mismatch("the list of channels", recording.names().join(", "), all_names.join(", ")));
            };
            for stretch in trim.apply(&recording, &file)? {
                let wrap = |source| StudyError::Recording { file: file.clone(), source };
                let channels = order.iter().map(|&i| stretch.channels()[i].clone()).collect();
                let stretch = Recording::new(rate, channels).map_err(wrap)?.starting_at(stretch.start_s()).with_metadata(stretch.metadata().clone());
                stretch.require_finite(used.iter().map(|&i| all_names[i].as_str())).map_err(wrap)?;
                stretches.push(Trial { file: file.clone(), recording: stretch });
            }
        }
        Ok(Trials { trials: stretches, roles })
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
        let Some(first) = self.trials.first() else { return Vec::new() };
        indices.iter().map(|&i| first.recording.channels()[i].name.clone()).collect()
    }

    /// SI units of the channels with these indices.
    pub fn units(&self, indices: &[usize]) -> Vec<String> {
        let Some(first) = self.trials.first() else { return Vec::new() };
        indices.iter().map(|&i| first.recording.channels()[i].unit.symbol().to_owned()).collect()
    }

    /// The mean of a channel over all trials.
    pub fn mean(&self, index: usize) -> f64 {
        let (sum, count) = self.trials.iter().fold((0.0, 0), |(sum, count), trial| {
            let samples = &trial.recording.channels()[index].samples;
            (sum + samples.iter().sum::<f64>(), count + samples.len())
        });
        sum / count as f64
    }

    /// What was noticed while the roles were found.
    pub fn warnings(&self) -> &[Warning] {
        &self.roles.warnings
    }
}
