//! One recording with the name that messages give it.

use crate::error::AnalysisError;
use ndof_signal::{Channel, Quantity, Recording, RecordingError, Unit, Warning};
use std::ops::Range;

/// One file's recording.
///
/// ```
/// use ndof_analysis::Trial;
///
/// let trial = Trial::new(500.0).effort("x", vec![1.0, 2.0]).displacement("x", vec![0.01, 0.02])?;
/// assert_eq!(trial.recording.names(), ["force_x", "pos_x"]);
/// let both = trial.effort("y", vec![0.0, 1.0]).displacement("y", vec![0.0, 0.01])?; // more axes by more calls
/// assert_eq!(both.recording.channels()[3].unit.symbol(), "m");
/// # Ok::<(), ndof_analysis::AnalysisError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Trial {
    /// What messages call it.
    pub file: String,
    /// Its samples.
    pub recording: Recording,
    /// What was done to read it.
    pub warnings: Vec<Warning>,
}

/// Channels of a trial whose motion is still to come.
#[derive(Clone, Debug, PartialEq)]
pub struct Channels {
    sample_rate_hz: f64,
    file: String,
    channels: Vec<Channel>,
}

impl Trial {
    /// A trial without channels, of so many samples a second; [`Channels`] adds them by what they measure, in SI units.
    #[expect(clippy::new_ret_no_self, reason = "a trial is one when it has a motion")]
    pub fn new(sample_rate_hz: f64) -> Channels {
        Channels { sample_rate_hz, file: "trial".to_owned(), channels: Vec::new() }
    }

    /// A recording, and what messages call it.
    pub fn of(file: impl Into<String>, recording: Recording) -> Self {
        Trial { file: file.into(), recording, warnings: Vec::new() }
    }

    /// Several recordings as trials 1, 2 …
    pub fn numbered(what: &str, recordings: impl IntoIterator<Item = Recording>) -> Vec<Self> {
        recordings.into_iter().enumerate().map(|(k, recording)| Trial::of(format!("{what} {}", k + 1), recording)).collect()
    }

    /// The samples `range` of the same trial.
    pub(crate) fn slice(&self, range: Range<usize>) -> Result<Self, AnalysisError> {
        self.holding(self.recording.slice(range))
    }

    /// The same trial with these channels on its clock.
    pub(crate) fn with_channels(&self, channels: Vec<Channel>) -> Result<Self, AnalysisError> {
        self.holding(self.recording.with_channels(channels))
    }

    /// The same trial with these channels turned round.
    pub(crate) fn negated(&self, names: &[String]) -> Result<Self, AnalysisError> {
        let mut recording = self.recording.clone();
        let turned = names.iter().try_for_each(|name| recording.map_channel(name, |sample| -sample));
        self.holding(turned.map(|()| recording))
    }

    fn holding(&self, recording: Result<Recording, RecordingError>) -> Result<Self, AnalysisError> {
        let recording = recording.map_err(|source| AnalysisError::Recording { file: self.file.clone(), source })?;
        Ok(Trial { file: self.file.clone(), recording, warnings: self.warnings.clone() })
    }

    fn open(self) -> Channels {
        Channels { sample_rate_hz: self.recording.sample_rate_hz(), file: self.file, channels: self.recording.into_channels() }
    }

    /// With the force along one axis more (N).
    pub fn effort(self, axis: &str, samples: impl Into<Vec<f64>>) -> Channels {
        self.open().effort(axis, samples)
    }

    /// With the displacement along one axis more (m).
    ///
    /// # Errors
    /// [`AnalysisError::Recording`] as [`Channels::displacement`].
    pub fn displacement(self, axis: &str, samples: impl Into<Vec<f64>>) -> Result<Self, AnalysisError> {
        self.open().displacement(axis, samples)
    }

    /// With the angle about one axis more (rad).
    ///
    /// # Errors
    /// [`AnalysisError::Recording`] as [`Channels::displacement`].
    pub fn angle(self, axis: &str, samples: impl Into<Vec<f64>>) -> Result<Self, AnalysisError> {
        self.open().angle(axis, samples)
    }
}

impl Channels {
    fn with(mut self, prefix: &str, axis: &str, unit: Unit, samples: impl Into<Vec<f64>>) -> Self {
        self.channels.push(Channel::new(format!("{prefix}{axis}"), unit, samples.into()));
        self
    }

    fn close(self) -> Result<Trial, AnalysisError> {
        let Channels { sample_rate_hz, file, channels } = self;
        match Recording::new(sample_rate_hz, channels) {
            Ok(recording) => Ok(Trial::of(file, recording)),
            Err(source) => Err(AnalysisError::Recording { file, source }),
        }
    }

    /// With the force along an axis (N).
    pub fn effort(self, axis: &str, samples: impl Into<Vec<f64>>) -> Self {
        self.with("force_", axis, Unit::si(Quantity::Effort, false), samples)
    }

    /// With the torque about an axis (N m).
    pub fn torque(self, axis: &str, samples: impl Into<Vec<f64>>) -> Self {
        self.with("torque_", axis, Unit::si(Quantity::Effort, true), samples)
    }

    /// With the force that was commanded along an axis (N).
    pub fn command(self, axis: &str, samples: impl Into<Vec<f64>>) -> Self {
        self.with("cmd_", axis, Unit::si(Quantity::Effort, false), samples)
    }

    /// With the displacement along an axis (m).
    ///
    /// # Errors
    /// [`AnalysisError::Recording`] if the channels differ in length, a name is taken, or the sample rate is none.
    pub fn displacement(self, axis: &str, samples: impl Into<Vec<f64>>) -> Result<Trial, AnalysisError> {
        self.with("pos_", axis, Unit::si(Quantity::Displacement, false), samples).close()
    }

    /// With the angle about an axis (rad).
    ///
    /// # Errors
    /// As [`Channels::displacement`].
    pub fn angle(self, axis: &str, samples: impl Into<Vec<f64>>) -> Result<Trial, AnalysisError> {
        self.with("angle_", axis, Unit::si(Quantity::Displacement, true), samples).close()
    }
}
