//! Streams of several rates, or of several clocks that are set to one time, in one table.

use crate::error::IoError;
use crate::limits::Budget;
use crate::names::uniquely;
use crate::recording::Note;
use crate::resample::MAX_GAP_STEPS;
use crate::table::{Column, Rounding, Table};
use ndof_signal::interpolated;

/// When the samples of a stream were taken.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Times {
    /// At a rate, from a time on.
    Regular { start_s: f64, rate_hz: f64 },
    /// At these times in seconds, finite and increasing.
    Stamps(Vec<f64>),
}

/// Columns of one clock.
#[derive(Clone, Debug)]
pub(crate) struct Stream {
    pub name: String,
    pub times: Times,
    pub columns: Vec<Column>,
}

impl Stream {
    fn len(&self) -> usize {
        self.columns.first().map_or(0, |c| c.samples.len())
    }

    fn at(&self, k: usize) -> f64 {
        match &self.times {
            Times::Regular { start_s, rate_hz } => start_s + k as f64 / rate_hz,
            Times::Stamps(stamps) => stamps.get(k).copied().unwrap_or(f64::NAN),
        }
    }

    fn span(&self) -> (f64, f64) {
        (self.at(0), self.at(self.len().saturating_sub(1)))
    }

    fn rate_hz(&self) -> f64 {
        match &self.times {
            Times::Regular { rate_hz, .. } => *rate_hz,
            Times::Stamps(_) => (self.len() - 1) as f64 / (self.span().1 - self.span().0),
        }
    }

    fn stamps(&self) -> Vec<f64> {
        (0..self.len()).map(|k| self.at(k)).collect()
    }
}

/// The streams on the clock of the fastest, where all of them were running: the others are interpolated (cubic), which invents
/// no frequency and loses none. A stream of less than two samples is left out and told.
///
/// Values of streams that share the clock stay as they are, bit for bit.
pub(crate) fn join(file: &str, streams: Vec<Stream>, budget: &mut Budget) -> Result<Table, IoError> {
    let unsuitable = |what: String, remedy: &str| IoError::Unsuitable { file: file.to_owned(), what, remedy: remedy.to_owned() };
    let mut table = Table::default();
    let runs = |s: &Stream| s.len() > 1 && s.rate_hz().is_finite() && s.rate_hz() > 0.0;
    let (streams, short): (Vec<_>, Vec<_>) = streams.into_iter().partition(runs);
    if !short.is_empty() {
        let names: Vec<&str> = short.iter().map(|s| s.name.as_str()).collect();
        table.notes.push(Note::new("ignored-streams", format!("streams of less than two samples are left out: {}", names.join(", ")), "record them longer"));
    }
    let fastest = (0..streams.len()).reduce(|best, k| if streams[k].rate_hz() > streams[best].rate_hz() { k } else { best });
    let Some(fastest) = fastest else {
        return Err(unsuitable("there is no stream of at least two numbers in it".to_owned(), "a recording needs channels of numbers over time"));
    };
    let base = &streams[fastest];
    // Half a step beyond the ends is still held by the last sample.
    let slack = 0.5 / base.rate_hz();
    let from_s = streams.iter().map(|s| s.span().0).fold(f64::NEG_INFINITY, f64::max) - slack;
    let to_s = streams.iter().map(|s| s.span().1).fold(f64::INFINITY, f64::min) + slack;
    let inside = |k: &usize| (from_s..=to_s).contains(&base.at(*k));
    let from = (0..base.len()).find(inside).unwrap_or(base.len());
    let to = (from..base.len()).take_while(inside).last().map_or(from, |k| k + 1);
    if to < from + 2 {
        let spans: Vec<String> = streams.iter().map(|s| format!("{} from {:.3} to {:.3} s", s.name, s.span().0, s.span().1)).collect();
        return Err(unsuitable(
            format!("its streams were never running at the same time: {}", spans.join(", ")),
            "record them together, or read them one by one",
        ));
    }
    let wanted = streams.iter().map(|s| s.columns.len()).sum::<usize>() + 1;
    budget.claim(file, (8 * wanted as u64).saturating_mul((to - from) as u64))?;
    let times: Vec<f64> = (from..to).map(|k| base.at(k)).collect();
    if streams.len() > 1 {
        table.notes.push(note(&streams, fastest, (times[0], times[times.len() - 1])));
    }
    match &base.times {
        Times::Regular { rate_hz, .. } => table.set_clock(*rate_hz, times[0]),
        Times::Stamps(_) => {
            table.columns.push(Column { name: "t".to_owned(), unit: Some("s".to_owned()), samples: times.clone(), rounding: Rounding::default() });
        }
    }
    let paths: Vec<[String; 2]> = streams.iter().flat_map(|s| s.columns.iter().map(|c| [s.name.clone(), c.name.clone()])).collect();
    let mut names = uniquely(&paths).into_iter();
    let base_times = base.times.clone();
    for stream in streams {
        let stamps = (stream.times != base_times).then(|| stream.stamps());
        for column in stream.columns {
            let samples = match &stamps {
                None => column.samples.get(from..to).map(<[f64]>::to_vec).unwrap_or_default(),
                Some(stamps) => without_gaps(stamps, &times, interpolated(stamps, &column.samples, times.iter().copied())),
            };
            table.columns.push(Column { name: names.next().unwrap_or(column.name), samples, ..column });
        }
    }
    Ok(table)
}

/// Takes out what a curve says over a gap that is too long to interpolate over.
fn without_gaps(stamps: &[f64], times: &[f64], mut values: Vec<f64>) -> Vec<f64> {
    let mut steps: Vec<f64> = stamps.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let middle = steps.len() / 2;
    let limit_s = MAX_GAP_STEPS * *steps.select_nth_unstable_by(middle, f64::total_cmp).1;
    let mut first = 0;
    for pair in stamps.windows(2).filter(|pair| pair[1] - pair[0] > limit_s) {
        first += times[first..].partition_point(|t| *t <= pair[0]);
        let last = first + times[first..].partition_point(|t| *t < pair[1]);
        values[first..last].fill(f64::NAN);
        first = last;
    }
    values
}

fn note(streams: &[Stream], fastest: usize, (from_s, to_s): (f64, f64)) -> Note {
    let clock = &streams[fastest];
    let others: Vec<&Stream> = streams.iter().filter(|s| s.times != clock.times).collect();
    let listed: Vec<String> = others.iter().map(|s| format!("{} ({:.6} Hz)", s.name, s.rate_hz())).collect();
    let message = format!("{} streams are joined on the clock of {} ({:.6} Hz), from {from_s:.6} to {to_s:.6} s", streams.len(), clock.name, clock.rate_hz());
    if others.is_empty() {
        return Note::new("clocks-joined", message, "none: they share the clock");
    }
    let slowest_hz = others.iter().map(|s| s.rate_hz()).fold(f64::INFINITY, f64::min);
    Note::new(
        "clocks-joined",
        format!("{message}; interpolated onto it: {}", listed.join(", ")),
        format!("trust nothing of them above half of their own rate ({:.6} Hz for the slowest)", 0.5 * slowest_hz),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    fn stream(name: &str, times: Times, n: usize, of: impl Fn(usize) -> f64) -> Stream {
        let column = Column { name: name.to_owned(), samples: (0..n).map(of).collect(), ..Column::default() };
        Stream { name: name.to_owned(), times, columns: vec![column] }
    }

    #[test]
    fn a_slow_stream_is_interpolated_where_both_were_running() {
        let fast = stream("robot", Times::Regular { start_s: 1.0, rate_hz: 100.0 }, 300, |k| k as f64);
        // A parabola, which the interpolation gives exactly.
        let stamps: Vec<f64> = (0..50).map(|k| 1.5 + 0.1 * k as f64).collect();
        let slow = stream("camera", Times::Stamps(stamps.clone()), 50, |k| stamps[k] * stamps[k]);
        let table = join("f", vec![fast, slow], &mut Budget::of(1000)).unwrap();
        assert_eq!(table.metadata["sample_rate_hz"], "100");
        assert_eq!(table.columns[0].samples[..3], [50.0, 51.0, 52.0]);
        for (k, value) in table.columns[1].samples.iter().enumerate() {
            let t = 1.5 + 0.01 * k as f64;
            assert!((value - t * t).abs() < 1e-12, "{t}: {value}");
        }
        assert_eq!(table.columns[1].samples.len(), 250);
        assert!(table.notes[0].message.contains("camera (10.000000 Hz)"), "{}", table.notes[0].message);
    }

    #[test]
    fn a_long_gap_is_no_curve() {
        let fast = stream("a", Times::Regular { start_s: 0.0, rate_hz: 100.0 }, 400, |k| k as f64);
        let stamps: Vec<f64> = (0..40).map(|k| 0.05 * k as f64 + if k < 20 { 0.0 } else { 2.0 }).collect();
        let slow = stream("b", Times::Stamps(stamps), 40, |k| k as f64);
        let table = join("f", vec![fast, slow], &mut Budget::of(1000)).unwrap();
        let missing = table.columns[1].samples.iter().filter(|v| v.is_nan()).count();
        // From 0.95 s, the last before the gap, to 3.0 s: both are there.
        assert_eq!(missing, 204);
        // The stamps are not exactly those of the grid.
        assert!((table.columns[1].samples[95] - 19.0).abs() < 1e-9 && (table.columns[1].samples[300] - 20.0).abs() < 1e-9);
    }

    #[test]
    fn streams_that_never_meet_are_refused() {
        let first = stream("a", Times::Regular { start_s: 0.0, rate_hz: 10.0 }, 10, |_| 0.0);
        let second = stream("b", Times::Regular { start_s: 5.0, rate_hz: 10.0 }, 10, |_| 0.0);
        let error = join("f", vec![first, second], &mut Budget::of(1000)).unwrap_err();
        assert!(error.to_string().contains("never running at the same time"), "{error}");
    }
}
