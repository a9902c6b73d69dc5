//! Cutting the stretches that are to be used out of a recording.

use crate::error::AnalysisError;
use crate::result::Warning;
use ndof_signal::Recording;

/// What to keep of each recording, on the clock of its file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Trim {
    /// From here on.
    pub start_s: Option<f64>,
    /// Up to here.
    pub stop_s: Option<f64>,
    /// Without these.
    pub exclude_s: Vec<[f64; 2]>,
}

impl Trim {
    /// What is left of any recording, from and to, on the clock of its file.
    pub fn stretches_s(&self) -> Vec<(f64, f64)> {
        let mut kept = vec![(self.start_s.unwrap_or(f64::NEG_INFINITY), self.stop_s.unwrap_or(f64::INFINITY))];
        for &[from, to] in &self.exclude_s {
            kept = kept.into_iter().flat_map(|(a, b)| [(a, b.min(from)), (a.max(to), b)]).filter(|(a, b)| a < b).collect();
        }
        kept
    }

    /// Says what cuts nothing out of any recording, of which these are the beginnings and ends: perhaps its time is of another clock.
    pub(crate) fn beside(&self, spans: &[[f64; 2]]) -> Vec<Warning> {
        let first = spans.iter().map(|[from, _]| *from).fold(f64::INFINITY, f64::min);
        let last = spans.iter().map(|[_, to]| *to).fold(f64::NEG_INFINITY, f64::max);
        // From nought on is from the beginning, wherever that is.
        let start = self.start_s.filter(|start| *start != 0.0 && *start < first).map(|start| format!("`start` at {start} s"));
        let outside = |[from, to]: &&[f64; 2]| spans.iter().all(|[begin, end]| to <= begin || from >= end);
        let excluded = self.exclude_s.iter().filter(outside).map(|[from, to]| format!("`exclude` from {from} to {to} s"));
        let said = |what: String| {
            let message = format!("{what} cuts nothing: the clock of the recordings goes from {first} to {last} s");
            Warning::new("nothing-cut", message, "give times on the clock of the file")
        };
        start.into_iter().chain(excluded).map(said).collect()
    }

    /// The stretches that are left, in order; each is a recording of its own whose clock goes on.
    ///
    /// # Errors
    /// [`AnalysisError::NothingLeft`] if there is none.
    pub fn apply(&self, recording: Recording, file: &str) -> Result<Vec<Recording>, AnalysisError> {
        let rate = recording.sample_rate_hz();
        let sample = |time_s: f64| ((time_s - recording.start_s()) * rate).round().clamp(0.0, recording.len() as f64) as usize;
        let kept: Vec<(usize, usize)> = self.stretches_s().into_iter().map(|(a, b)| (sample(a), sample(b))).filter(|(a, b)| a < b).collect();
        if kept.is_empty() {
            let from_s = recording.start_s();
            return Err(AnalysisError::NothingLeft { file: file.to_owned(), from_s, to_s: from_s + recording.duration_s() });
        }
        // What is kept whole is not copied.
        if kept == [(0, recording.len())] {
            return Ok(vec![recording]);
        }
        kept.into_iter().map(|(a, b)| recording.slice(a..b).map_err(|source| AnalysisError::Recording { file: file.to_owned(), source })).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndof_signal::{Channel, Unit};

    #[test]
    fn start_stop_and_exclude_leave_the_rest_in_order() {
        let ten = Recording::new(1.0, vec![Channel::new("a", Unit::other(""), (0..10).map(f64::from).collect())]).expect("valid").starting_at(100.0);
        let trim = Trim { start_s: Some(101.0), stop_s: Some(109.0), exclude_s: vec![[103.0, 105.0]] };
        let parts: Vec<Vec<f64>> = trim.apply(ten.clone(), "a").expect("left").iter().map(|r| r.channels()[0].samples.clone()).collect();
        assert_eq!(parts, [vec![1.0, 2.0], vec![5.0, 6.0, 7.0, 8.0]]);
        assert!(trim.beside(&[[100.0, 110.0]]).is_empty() && Trim { start_s: Some(0.0), ..Trim::default() }.beside(&[[100.0, 110.0]]).is_empty());
        // Seconds since the beginning, and a clock that counts from long before.
        let outside = trim.beside(&[[1e9, 1e9 + 10.0]]);
        assert!(outside.len() == 2 && outside.iter().all(|w| w.code == "nothing-cut" && w.message.contains("1000000000")), "{outside:?}");
        let all = Trim { exclude_s: vec![[0.0, 200.0]], ..Trim::default() };
        assert!(matches!(all.apply(ten.clone(), "a"), Err(AnalysisError::NothingLeft { .. })));
    }
}
