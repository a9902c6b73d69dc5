//! Offsets and signs of transducers.

use super::PrepareError;
use ndof_signal::Recording;

/// Turns the sign of `channels`: for a transducer that reads the reaction instead of the force on the limb.
///
/// # Errors
/// [`PrepareError::Recording`] if a channel does not exist.
pub fn negate(recording: &Recording, channels: &[&str]) -> Result<Recording, PrepareError> {
    let mut turned = recording.clone();
    for name in channels {
        turned.map_channel(name, |sample| -sample)?;
    }
    Ok(turned)
}

/// Takes the means of `channels` in `unloaded`, a recording without load, off the same channels of `recording`.
///
/// # Errors
/// [`PrepareError::Recording`] if a channel is missing in either, or `unloaded` has a sample that is no number;
/// [`PrepareError::Units`] if the units differ, [`PrepareError::TooShort`] if `unloaded` is empty.
///
/// ```
/// use ndof_signal::{Channel, Recording, Unit};
/// let force = |samples: &[f64]| Recording::new(10.0, vec![Channel::new("force_x", Unit::other("V"), samples.to_vec())]);
/// let tared = ndof_io::tare(&force(&[3.0, 5.0])?, &force(&[0.5, 1.5])?, &["force_x"])?;
/// assert_eq!(tared.channel("force_x")?.samples, [2.0, 4.0]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn tare(recording: &Recording, unloaded: &Recording, channels: &[&str]) -> Result<Recording, PrepareError> {
    unloaded.require_finite(channels.iter().copied())?;
    let mut tared = recording.clone();
    for name in channels {
        let (own, offset) = (recording.channel(name)?, unloaded.channel(name)?);
        if own.unit != offset.unit {
            return Err(PrepareError::Units {
                channel: (*name).to_owned(),
                found: own.unit.symbol().to_owned(),
                other: format!("{name} of the recording without load"),
                expected: offset.unit.symbol().to_owned(),
                remedy: "record both in one unit",
            });
        }
        if offset.samples.is_empty() {
            return Err(PrepareError::TooShort { len: 0, needed: 1 });
        }
        let mean = offset.samples.iter().sum::<f64>() / offset.samples.len() as f64;
        tared.map_channel(name, |sample| sample - mean)?;
    }
    Ok(tared)
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndof_signal::{Channel, Quantity, Unit};

    #[test]
    fn only_the_named_channels_are_turned() {
        let channel = |name: &str| Channel::new(name, Unit::si(Quantity::Effort, false), vec![1.0, -2.0]);
        let recording = Recording::new(10.0, vec![channel("force_x"), channel("force_y")]).unwrap();
        let turned = negate(&recording, &["force_y"]).unwrap();
        assert_eq!(turned.channels()[0].samples, [1.0, -2.0]);
        assert_eq!(turned.channels()[1].samples, [-1.0, 2.0]);
        assert!(negate(&recording, &["force_z"]).unwrap_err().to_string().contains("force_y"));
    }

    #[test]
    fn a_tare_in_another_unit_is_refused() {
        let one = |unit: Unit| Recording::new(10.0, vec![Channel::new("force_x", unit, vec![1.0])]).unwrap();
        let error = tare(&one(Unit::si(Quantity::Effort, false)), &one(Unit::other("V")), &["force_x"]).unwrap_err();
        assert!(matches!(error, PrepareError::Units { .. }));
    }
}
