//! What stays of the samples of a measurement in progress.

use ndof_signal::{Channel, Recording, RecordingError};

/// Which samples stay.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Keep {
    /// So many of the first stretch that is as long as a segment.
    First(usize),
    /// So many that came last, of all stretches.
    Last(usize),
    /// All stretches.
    All,
}

/// Stretches without a gap, the one that grows last.
#[derive(Clone, Debug, Default)]
pub(super) struct Kept {
    pub stretches: Vec<Recording>,
    /// Whether what follows is kept.
    growing: bool,
}

impl Kept {
    /// Samples that are there.
    pub fn samples(&self) -> usize {
        self.stretches.iter().map(Recording::len).sum()
    }

    /// The stretches as long as a segment.
    pub fn long(&self, nperseg: usize) -> impl Iterator<Item = &Recording> {
        self.stretches.iter().filter(move |stretch| stretch.len() >= nperseg)
    }

    /// Takes the next samples and forgets what need not stay; stretches that ended before they were as long as a segment are forgotten, too.
    pub fn push(&mut self, part: Recording, follows: bool, keep: Keep, nperseg: usize) -> Result<(), RecordingError> {
        if follows {
            self.extend(part, keep)?;
        } else {
            self.stretches.retain(|stretch| stretch.len() >= nperseg);
            self.growing = !matches!(keep, Keep::First(_)) || self.stretches.is_empty();
            self.stretches.extend(self.growing.then_some(part));
        }
        if let Keep::Last(samples) = keep { self.forget(self.samples().saturating_sub(samples)) } else { Ok(()) }
    }

    fn extend(&mut self, part: Recording, keep: Keep) -> Result<(), RecordingError> {
        let Some(grown) = self.stretches.pop_if(|_| self.growing) else { return Ok(()) };
        let room = if let Keep::First(samples) = keep { samples.saturating_sub(grown.len()) } else { usize::MAX };
        let more = part.len().min(room);
        let (rate_hz, start_s, metadata) = (grown.sample_rate_hz(), grown.start_s(), grown.metadata().clone());
        let mut channels: Vec<Channel> = grown.into_channels();
        channels.iter_mut().zip(part.channels()).for_each(|(own, next)| own.samples.extend_from_slice(&next.samples[..more]));
        self.stretches.push(Recording::new(rate_hz, channels)?.starting_at(start_s).with_metadata(metadata));
        Ok(())
    }

    /// Takes samples away at the beginning.
    fn forget(&mut self, mut excess: usize) -> Result<(), RecordingError> {
        while excess > 0
            && let Some(first) = self.stretches.first_mut()
        {
            if first.len() <= excess {
                excess -= first.len();
                self.stretches.remove(0);
            } else {
                *first = first.slice(excess..first.len())?;
                excess = 0;
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndof_signal::Unit;

    fn part(from: usize, to: usize) -> Recording {
        let samples = (from..to).map(|k| k as f64).collect();
        Recording::new(1.0, vec![Channel::new("a", Unit::other(""), samples)]).expect("valid").starting_at(from as f64)
    }

    /// Where each stretch starts, and its samples.
    fn kept(keep: Keep, pieces: &[(usize, usize, bool)]) -> Vec<(f64, Vec<f64>)> {
        let mut kept = Kept::default();
        pieces.iter().for_each(|&(from, to, follows)| kept.push(part(from, to), follows, keep, 3).expect("alike"));
        kept.stretches.iter().map(|stretch| (stretch.start_s(), stretch.channels()[0].samples.clone())).collect()
    }

    #[test]
    fn the_beginning_the_end_or_all_of_it_stays() {
        // A stretch that is shorter than a segment of 3, one of 6, and one of 4 behind a gap.
        let pieces = [(0, 2, false), (10, 14, false), (14, 16, true), (20, 22, false), (22, 24, true)];
        assert_eq!(kept(Keep::First(5), &pieces), [(10.0, vec![10.0, 11.0, 12.0, 13.0, 14.0])]);
        assert_eq!(kept(Keep::Last(5), &pieces), [(15.0, vec![15.0]), (20.0, vec![20.0, 21.0, 22.0, 23.0])]);
        assert_eq!(kept(Keep::Last(3), &pieces), [(21.0, vec![21.0, 22.0, 23.0])]);
        assert_eq!(kept(Keep::All, &pieces).iter().map(|(_, samples)| samples.len()).collect::<Vec<_>>(), [6, 4]);
    }
}
