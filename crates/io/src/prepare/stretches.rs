//! Stretches of time, on the clock of the file.

use super::PrepareError;
use ndof_signal::Recording;
use std::ops::Range;

/// A time that misses a sample's by this share of a step, through rounding, still means that sample.
const STEP_ROUNDING: f64 = 1e-6;

/// The first sample at or after `time_s` on the clock of the file.
fn sample_at(recording: &Recording, time_s: f64) -> usize {
    let steps = (time_s - recording.start_s()) * recording.sample_rate_hz();
    // A cast of a float saturates, so that times far outside land on the ends.
    ((steps - STEP_ROUNDING).ceil().max(0.0) as usize).min(recording.len())
}

/// The samples from `start_s` (or the beginning) to before `stop_s` (or the end), on the clock of the file.
///
/// # Errors
/// [`PrepareError::Backwards`] or [`PrepareError::NothingLeft`].
///
/// ```
/// use ndof_signal::{Channel, Recording, Unit};
/// let ramp = Channel::new("a", Unit::other(""), (0..10).map(f64::from).collect());
/// let recording = Recording::new(10.0, vec![ramp])?;
/// let middle = ndof_io::trim(&recording, Some(0.2), Some(0.5))?;
/// assert_eq!(middle.channel("a")?.samples, [2.0, 3.0, 4.0]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn trim(recording: &Recording, start_s: Option<f64>, stop_s: Option<f64>) -> Result<Recording, PrepareError> {
    let own_stop_s = recording.start_s() + recording.duration_s();
    if let (Some(from_s), Some(to_s)) = (start_s, stop_s) {
        check(from_s, to_s)?;
    }
    let (from_s, to_s) = (start_s.unwrap_or(recording.start_s()), stop_s.unwrap_or(own_stop_s));
    let range = sample_at(recording, from_s)..stop_s.map_or(recording.len(), |s| sample_at(recording, s));
    if range.is_empty() {
        return Err(PrepareError::NothingLeft { from_s, to_s, start_s: recording.start_s(), stop_s: own_stop_s });
    }
    Ok(recording.slice(range)?)
}

/// What is left of a recording when stretches from a time to before another are taken out: one recording for each
/// piece, in order, since joining them would make steps that nobody measured.
///
/// # Errors
/// [`PrepareError::Backwards`] for a stretch, [`PrepareError::NothingLeft`] if all is taken out.
pub fn exclude(recording: &Recording, stretches_s: &[(f64, f64)]) -> Result<Vec<Recording>, PrepareError> {
    let mut out: Vec<Range<usize>> = Vec::with_capacity(stretches_s.len());
    for &(from_s, to_s) in stretches_s {
        check(from_s, to_s)?;
        out.push(sample_at(recording, from_s)..sample_at(recording, to_s));
    }
    out.sort_by_key(|r| (r.start, r.end));
    let mut kept = Vec::new();
    let mut next = 0;
    for range in out {
        if range.start > next {
            kept.push(next..range.start);
        }
        next = next.max(range.end);
    }
    if next < recording.len() {
        kept.push(next..recording.len());
    }
    if kept.is_empty() {
        let (start_s, stop_s) = (recording.start_s(), recording.start_s() + recording.duration_s());
        return Err(PrepareError::NothingLeft { from_s: start_s, to_s: stop_s, start_s, stop_s });
    }
    kept.into_iter().map(|range| Ok(recording.slice(range)?)).collect()
}

fn check(from_s: f64, to_s: f64) -> Result<(), PrepareError> {
    if from_s < to_s { Ok(()) } else { Err(PrepareError::Backwards { from_s, to_s }) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndof_signal::{Channel, Unit};

    fn ramp(start_s: f64) -> Recording {
        let samples = (0..1000).map(f64::from).collect();
        Recording::new(100.0, vec![Channel::new("a", Unit::other(""), samples)]).unwrap().starting_at(start_s)
    }

    #[test]
    fn times_are_those_of_the_file_and_rounding_moves_no_sample() {
        let cut = trim(&ramp(5.0), Some(5.07), Some(5.1)).unwrap();
        assert_eq!(cut.channels()[0].samples, [7.0, 8.0, 9.0]);
        assert!((cut.start_s() - 5.07).abs() < 1e-12);
        assert_eq!(trim(&ramp(0.0), None, None).unwrap(), ramp(0.0));
    }

    #[test]
    fn what_is_left_are_the_pieces_between() {
        let pieces = exclude(&ramp(0.0), &[(5.0, 6.0), (0.0, 1.0), (5.5, 7.0), (9.5, 99.0)]).unwrap();
        let spans: Vec<_> = pieces.iter().map(|p| (p.channels()[0].samples[0], p.len())).collect();
        assert_eq!(spans, [(100.0, 400), (700.0, 250)]);
        assert_eq!(exclude(&ramp(0.0), &[]).unwrap(), [ramp(0.0)]);
    }

    #[test]
    fn an_empty_or_backward_stretch_is_an_error() {
        assert!(matches!(trim(&ramp(0.0), Some(20.0), None), Err(PrepareError::NothingLeft { .. })));
        assert!(matches!(trim(&ramp(0.0), Some(3.0), Some(2.0)), Err(PrepareError::Backwards { .. })));
        assert!(matches!(exclude(&ramp(0.0), &[(f64::NAN, 1.0)]), Err(PrepareError::Backwards { .. })));
        assert!(matches!(exclude(&ramp(0.0), &[(-1.0, 11.0)]), Err(PrepareError::NothingLeft { .. })));
    }
}
