//! Channels of equal length at one sample rate.

use crate::quantity::Unit;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fmt;
use std::ops::Range;

/// One measured or commanded signal, in SI units.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Channel {
    /// Its name, e.g. `force_x`.
    pub name: String,
    /// The SI unit of the samples.
    pub unit: Unit,
    /// One sample for each interval of the recording.
    pub samples: Vec<f64>,
}

impl Channel {
    /// A channel from its parts.
    pub fn new(name: impl Into<String>, unit: Unit, samples: Vec<f64>) -> Self {
        Channel { name: name.into(), unit, samples }
    }
}

/// Channels of equal length at one sample rate: what every analysis starts from and every simulation ends in.
///
/// Row *k* of each channel stands for the interval from `t_k` to `t_k + 1/fs`.
///
/// ```
/// use ndof_signal::{Channel, Quantity, Recording, Unit};
/// let force = Channel::new("force_x", Unit::si(Quantity::Effort, false), vec![0.0, 1.0, 0.5]);
/// let recording = Recording::new(500.0, vec![force])?;
/// assert_eq!(recording.to_string(), "1 channel (force_x), 0.006 s at 500 Hz");
/// # Ok::<(), ndof_signal::RecordingError>(())
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Recording {
    sample_rate_hz: f64,
    channels: Vec<Channel>,
    start_s: f64,
    metadata: BTreeMap<String, String>,
}

/// Why samples do not make a recording.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[allow(missing_docs, reason = "a message says what its fields are")]
pub enum RecordingError {
    /// The sample rate is not a positive number.
    #[error("sample rate {0} Hz; it must be a positive, finite number")]
    SampleRate(f64),
    /// Channels differ in length.
    #[error("channel \"{name}\" has {found} samples, \"{first}\" has {expected}; all channels of a recording need the same number")]
    Length { first: String, expected: usize, name: String, found: usize },
    /// Two channels have one name.
    #[error("two channels are called \"{0}\"; rename one of them")]
    DuplicateName(String),
    /// There is no channel of that name.
    #[error("no channel \"{name}\"; the recording has: {}", available.join(", "))]
    NoChannel { name: String, available: Vec<String> },
    /// A sample is not a number.
    #[error("channel \"{channel}\" is {value} at sample {sample} ({time_s:.4} s); cut that stretch out with `exclude`, or repair the file")]
    NotFinite {
        channel: String,
        /// The sample's index, from 0.
        sample: usize,
        time_s: f64,
        /// NaN or an infinity.
        value: f64,
    },
    /// A cut lies outside of the recording.
    #[error("samples {from} to {to} were asked for, the recording has {len}")]
    Range {
        from: usize,
        /// One past the last.
        to: usize,
        len: usize,
    },
}

impl Recording {
    /// A recording from channels of equal length (zero channels and zero samples are allowed here, and refused
    /// where a number is asked of them).
    ///
    /// # Errors
    /// [`RecordingError`] if the rate is not positive, lengths differ or names repeat.
    pub fn new(sample_rate_hz: f64, channels: Vec<Channel>) -> Result<Self, RecordingError> {
        if !(sample_rate_hz.is_finite() && sample_rate_hz > 0.0) {
            return Err(RecordingError::SampleRate(sample_rate_hz));
        }
        if let Some(first) = channels.first() {
            for (i, channel) in channels.iter().enumerate() {
                if channel.samples.len() != first.samples.len() {
                    return Err(RecordingError::Length {
                        first: first.name.clone(),
                        expected: first.samples.len(),
                        name: channel.name.clone(),
                        found: channel.samples.len(),
                    });
                }
                if channels[..i].iter().any(|c| c.name == channel.name) {
                    return Err(RecordingError::DuplicateName(channel.name.clone()));
                }
            }
        }
        Ok(Recording { sample_rate_hz, channels, start_s: 0.0, metadata: BTreeMap::new() })
    }

    /// The same recording with its first sample at `start_s` on the clock of its file.
    #[must_use]
    pub fn starting_at(mut self, start_s: f64) -> Self {
        self.start_s = start_s;
        self
    }

    /// The same recording with free-form facts about it (never a person's name).
    #[must_use]
    pub fn with_metadata(mut self, metadata: BTreeMap<String, String>) -> Self {
        self.metadata = metadata;
        self
    }

    /// Other channels on the same clock, with the same facts.
    ///
    /// # Errors
    /// [`RecordingError`] if lengths differ or names repeat.
    pub fn with_channels(&self, channels: Vec<Channel>) -> Result<Self, RecordingError> {
        Ok(Recording { start_s: self.start_s, metadata: self.metadata.clone(), ..Recording::new(self.sample_rate_hz, channels)? })
    }

    /// Samples a second.
    pub fn sample_rate_hz(&self) -> f64 {
        self.sample_rate_hz
    }

    /// The time of the first sample, on the clock of the file.
    pub fn start_s(&self) -> f64 {
        self.start_s
    }

    /// All channels, in the file's order.
    pub fn channels(&self) -> &[Channel] {
        &self.channels
    }

    /// The channels themselves, for whoever keeps the samples without a copy.
    pub fn into_channels(self) -> Vec<Channel> {
        self.channels
    }

    /// Free-form facts from the file.
    pub fn metadata(&self) -> &BTreeMap<String, String> {
        &self.metadata
    }

    /// The number of samples in each channel.
    pub fn len(&self) -> usize {
        self.channels.first().map_or(0, |c| c.samples.len())
    }

    /// Whether there is no sample at all.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Length in seconds: samples over rate.
    pub fn duration_s(&self) -> f64 {
        self.len() as f64 / self.sample_rate_hz
    }

    /// The names of the channels, in order.
    pub fn names(&self) -> Vec<String> {
        self.channels.iter().map(|c| c.name.clone()).collect()
    }

    /// The index of the channel called `name`.
    ///
    /// # Errors
    /// [`RecordingError::NoChannel`] with the names that there are.
    pub fn index_of(&self, name: &str) -> Result<usize, RecordingError> {
        self.channels.iter().position(|c| c.name == name).ok_or_else(|| RecordingError::NoChannel { name: name.to_owned(), available: self.names() })
    }

    /// The channel called `name`.
    ///
    /// # Errors
    /// [`RecordingError::NoChannel`] with the names that there are.
    pub fn channel(&self, name: &str) -> Result<&Channel, RecordingError> {
        Ok(&self.channels[self.index_of(name)?])
    }

    /// The samples of the channels with these indices, in this order.
    pub fn columns(&self, indices: &[usize]) -> Vec<&[f64]> {
        indices.iter().map(|&i| self.channels[i].samples.as_slice()).collect()
    }

    /// Changes one channel in place (a sign, a tare), keeping the recording valid.
    ///
    /// # Errors
    /// [`RecordingError::NoChannel`] if there is none of that name.
    pub fn map_channel(&mut self, name: &str, mut f: impl FnMut(f64) -> f64) -> Result<(), RecordingError> {
        let i = self.index_of(name)?;
        self.channels[i].samples.iter_mut().for_each(|s| *s = f(*s));
        Ok(())
    }

    /// The samples `range` of every channel, as a recording of its own whose clock goes on.
    ///
    /// # Errors
    /// [`RecordingError::Range`] if the range does not lie within the recording.
    pub fn slice(&self, range: Range<usize>) -> Result<Self, RecordingError> {
        if range.start > range.end || range.end > self.len() {
            return Err(RecordingError::Range { from: range.start, to: range.end, len: self.len() });
        }
        let channels =
            self.channels.iter().map(|c| Channel { name: c.name.clone(), unit: c.unit.clone(), samples: c.samples[range.clone()].to_vec() }).collect();
        Ok(self.with_channels(channels)?.starting_at(self.start_s + range.start as f64 / self.sample_rate_hz))
    }

    /// Checks that the named channels hold numbers only.
    ///
    /// # Errors
    /// [`RecordingError::NotFinite`] with the first place that does not, or [`RecordingError::NoChannel`].
    pub fn require_finite<'a>(&self, names: impl IntoIterator<Item = &'a str>) -> Result<(), RecordingError> {
        for name in names {
            let channel = self.channel(name)?;
            if let Some(sample) = channel.samples.iter().position(|s| !s.is_finite()) {
                return Err(RecordingError::NotFinite {
                    channel: channel.name.clone(),
                    sample,
                    time_s: self.start_s + sample as f64 / self.sample_rate_hz,
                    value: channel.samples[sample],
                });
            }
        }
        Ok(())
    }
}

impl fmt::Display for Recording {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let n = self.channels.len();
        write!(f, "{n} channel{} ({}), {} s at {} Hz", if n == 1 { "" } else { "s" }, self.names().join(", "), self.duration_s(), self.sample_rate_hz)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::quantity::Quantity;

    fn channel(name: &str, samples: Vec<f64>) -> Channel {
        Channel::new(name, Unit::si(Quantity::Effort, false), samples)
    }

    #[test]
    fn what_a_recording_says_of_itself() {
        let recording = Recording::new(10.0, vec![channel("a", vec![1.0, 2.0, 3.0, 4.0]), channel("b", vec![0.0; 4])]).expect("one length").starting_at(1.0);
        assert_eq!((recording.duration_s(), recording.len(), recording.is_empty()), (0.4, 4, false));
        assert_eq!(recording.to_string(), "2 channels (a, b), 0.4 s at 10 Hz");
        let part = recording.slice(1..3).expect("inside");
        assert_eq!((part.channels()[0].samples.as_slice(), part.start_s()), (&[2.0, 3.0][..], 1.1));
        assert!(recording.slice(2..2).expect("nothing of it").is_empty() && recording.slice(0..4).expect("all of it") == recording);
        #[allow(clippy::reversed_empty_ranges, reason = "that is what is refused")]
        let refused = [3..1, 3..5, 5..5].map(|range| recording.slice(range));
        assert!(refused.iter().all(|part| matches!(part, Err(RecordingError::Range { len: 4, .. }))));
        let names: Vec<String> = recording.into_channels().into_iter().map(|c| c.name).collect();
        assert_eq!(names, ["a", "b"]);
    }

    #[test]
    fn unequal_lengths_and_equal_names_are_refused() {
        let error = Recording::new(10.0, vec![channel("a", vec![0.0; 3]), channel("b", vec![0.0; 2])]).unwrap_err();
        assert!(matches!(error, RecordingError::Length { expected: 3, found: 2, .. }));
        let error = Recording::new(10.0, vec![channel("a", vec![0.0]), channel("a", vec![0.0])]).unwrap_err();
        assert_eq!(error, RecordingError::DuplicateName("a".to_owned()));
        assert_eq!(Recording::new(0.0, vec![]).unwrap_err(), RecordingError::SampleRate(0.0));
    }

    #[test]
    fn the_place_of_a_missing_number_is_named() {
        let r = Recording::new(10.0, vec![channel("a", vec![0.0, 1.0, f64::NAN])]).expect("valid").starting_at(1.0);
        assert!(r.require_finite(["a"]).unwrap_err().to_string().contains("sample 2 (1.2000 s)"));
    }

    #[test]
    fn channels_are_found_by_name_and_changed_in_place() {
        let facts = BTreeMap::from([("hand".to_owned(), "left".to_owned())]);
        let both = vec![channel("a", vec![0.0, 1.0]), channel("b", vec![2.0, 3.0])];
        let mut recording = Recording::new(10.0, both).expect("valid").with_metadata(facts.clone());
        assert_eq!((recording.sample_rate_hz(), recording.metadata(), recording.index_of("b")), (10.0, &facts, Ok(1)));
        recording.map_channel("b", |x| -2.0 * x).expect("there is one");
        assert_eq!(recording.columns(&[1, 0]), [&[-4.0, -6.0], &[0.0, 1.0]]);
        assert!(matches!(recording.map_channel("c", |x| x), Err(RecordingError::NoChannel { .. })));
    }
}
