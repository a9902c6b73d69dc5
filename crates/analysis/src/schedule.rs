//! What the schedule is: the phase of a cycle, time, or a channel.

use crate::trials::Trials;
use serde::{Deserialize, Serialize};

/// What is wrong with a schedule, and what to do.
pub(crate) type Refused = String;

/// The word for the phase of a cycle.
pub const PHASE: &str = "phase";
/// The word for time.
pub const TIME: &str = "time";

/// A cycle this many times as long as the median one is a pause between two, or lacks an edge; it is left out.
const PAUSE: f64 = 2.0;
/// A phase falls by this share of its range when a cycle ends, and at no other place by as much.
const WRAP: f64 = 0.5;
/// A channel's curve is given between these shares of its values; beyond them it stays as it is.
const ENDS: [f64; 2] = [0.01, 0.99];
/// Pieces of a trial without cycles that are held out one by one.
const PIECES: usize = 20;

/// Where cycles begin, in seconds on the clock of the recordings.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(untagged)]
pub enum Events {
    /// In every trial.
    Every(Vec<f64>),
    /// Trial by trial.
    Each(Vec<Vec<f64>>),
}

/// The scheduling variable of all trials, from 0 to 1.
pub(crate) struct Schedule {
    /// Of each sample, NaN where there is none.
    pub values: Vec<Vec<f64>>,
    /// What is held out together.
    pub blocks: Vec<Vec<usize>>,
    /// Its ends in its unit.
    pub ends: [f64; 2],
    /// Its unit, empty for a phase.
    pub unit: String,
    /// Of a cycle, where there are cycles.
    pub cycle_s: Option<f64>,
    /// How many cycles, or pieces of trials.
    pub count: usize,
}

/// Where cycles begin, by one of three ways.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Cycles<'a> {
    /// Seconds from one to the next, from time zero on.
    pub cycle_s: Option<f64>,
    /// A channel that tells.
    pub cycle_by: Option<&'a str>,
    /// Their times.
    pub event_s: Option<&'a Events>,
}

impl Cycles<'_> {
    /// The first of these settings that is given.
    pub fn given(&self) -> Option<&'static str> {
        let given = [("cycle", self.cycle_s.is_some()), ("cycle_by", self.cycle_by.is_some()), ("event", self.event_s.is_some())];
        given.into_iter().find(|(_, given)| *given).map(|(name, _)| name)
    }
}

impl Schedule {
    /// What `schedule` asks for.
    pub(crate) fn new(trials: &Trials, word: &str, cycles: Cycles<'_>) -> Result<Self, Refused> {
        match (word, cycles.cycle_s, cycles.cycle_by, cycles.event_s) {
            (PHASE, Some(cycle_s), None, None) => Self::by_clock(trials, cycle_s),
            (PHASE, None, Some(channel), None) => Self::by_channel(trials, channel),
            (PHASE, None, None, Some(events)) => Self::by_events(trials, events),
            (PHASE, ..) => Err("a phase needs one of `cycle` (seconds), `cycle_by` (a channel) and `event` (times)".to_owned()),
            (_, None, None, None) if word == TIME => Ok(Self::over_time(trials)),
            (_, None, None, None) => Self::over_channel(trials, word),
            _ => Err(format!("`cycle`, `cycle_by` and `event` are for `schedule=phase`, and the schedule is {word}; leave them out")),
        }
    }

    fn by_clock(trials: &Trials, cycle_s: f64) -> Result<Self, Refused> {
        let rate = trials.sample_rate_hz();
        // A sample on the edge of two cycles begins the second, whatever rounding makes of it.
        let whole = |cycles: f64| if (cycles - cycles.round()).abs() < 1e-9 { cycles.round() } else { cycles };
        let cycles = |start_s: f64, samples: usize| (0..samples).map(move |k| whole((start_s + k as f64 / rate) / cycle_s));
        let each: Vec<Vec<f64>> = trials.recordings().iter().map(|r| cycles(r.start_s(), r.len()).collect()).collect();
        Self::of_cycles(each, cycle_s)
    }

    /// Cycles that begin where a phase wraps, or at the rising edges of anything else: where it goes above the middle of its range.
    fn by_channel(trials: &Trials, name: &str) -> Result<Self, Refused> {
        let channels = channel(trials, name)?;
        let [low, high] = range(&channels);
        let fall = |pair: &[f64]| pair[0] - pair[1] > WRAP * (high - low);
        // A phase climbs little by little and falls at once; a pulse does both at once.
        let climbs = |pair: &[f64]| (0.0..WRAP * (high - low)).contains(&(pair[1] - pair[0]));
        let is_phase = channels.iter().all(|c| c.windows(2).all(|pair| climbs(pair) || fall(pair)));
        let middle = 0.5 * (low + high);
        let begins = |pair: &[f64]| if is_phase { fall(pair) } else { pair[0] < middle && pair[1] >= middle };
        let starts = channels.iter().map(|c| c.windows(2).enumerate().filter(|(_, p)| begins(p)).map(|(k, _)| (k + 1) as f64).collect());
        Self::of_starts(trials, starts.collect(), || {
            format!("channel \"{name}\" begins no two cycles, and `cycle_by` needs rising edges or a phase that wraps; choose another channel, or give `cycle`")
        })
    }

    /// Cycles from event to event.
    fn by_events(trials: &Trials, events: &Events) -> Result<Self, Refused> {
        let recordings = trials.recordings();
        let each: Vec<&Vec<f64>> = match events {
            Events::Every(times) => vec![times; recordings.len()],
            Events::Each(lists) => lists.iter().collect(),
        };
        if each.len() != recordings.len() {
            return Err(format!("`event` has times of {} trials, and there are {}; give a list for each, or one for all", each.len(), recordings.len()));
        }
        if each.iter().any(|times| times.iter().any(|t| !t.is_finite())) {
            return Err("`event` holds what is no number; give seconds".to_owned());
        }
        let starts = recordings.iter().zip(each).map(|(recording, times)| {
            let mut starts: Vec<f64> = times.iter().map(|t| (t - recording.start_s()) * recording.sample_rate_hz()).collect();
            starts.sort_unstable_by(f64::total_cmp);
            starts.dedup();
            starts
        });
        Self::of_starts(trials, starts.collect(), || "`event` begins no two cycles in any trial; give more times".to_owned())
    }

    /// Cycles between starts, which are places in samples.
    fn of_starts(trials: &Trials, starts: Vec<Vec<f64>>, none: impl Fn() -> Refused) -> Result<Self, Refused> {
        let mut lengths: Vec<f64> = starts.iter().flat_map(|s| s.windows(2).map(|pair| pair[1] - pair[0])).collect();
        lengths.sort_unstable_by(f64::total_cmp);
        let median = *lengths.get(lengths.len() / 2).ok_or_else(none)?;
        let each = trials.recordings().into_iter().zip(&starts).map(|(recording, starts)| {
            let mut phase = vec![f64::NAN; recording.len()];
            for (number, pair) in starts.windows(2).enumerate().filter(|(_, pair)| pair[1] - pair[0] <= PAUSE * median) {
                // Times are no exact multiples of samples: what is a sample but for rounding begins the cycle.
                let sample = |place: f64| ((place - 1e-6).ceil().max(0.0) as usize).min(phase.len());
                let within = |k: usize| ((k as f64 - pair[0]) / (pair[1] - pair[0])).clamp(0.0, 1.0 - f64::EPSILON);
                (sample(pair[0])..sample(pair[1])).for_each(|k| phase[k] = number as f64 + within(k));
            }
            phase
        });
        Self::of_cycles(each.collect(), median / trials.sample_rate_hz())
    }

    /// From the number of the cycle with the phase as its fraction.
    fn of_cycles(each: Vec<Vec<f64>>, cycle_s: f64) -> Result<Self, Refused> {
        let (mut blocks, mut first) = (Vec::new(), 0);
        for cycles in &each {
            let least = cycles.iter().copied().filter(|c| c.is_finite()).fold(f64::INFINITY, f64::min).floor();
            let block = |c: &f64| if c.is_finite() { first + (c.floor() - least) as usize } else { first };
            blocks.push(cycles.iter().map(block).collect::<Vec<usize>>());
            first = blocks.last().and_then(|b| b.iter().max()).map_or(first, |last| last + 1);
        }
        if first < 2 {
            return Err(format!(
                "{first} cycle of {cycle_s} s: a mean movement and what deviates from it need several; record more, or give a shorter `cycle`"
            ));
        }
        let values = each.into_iter().map(|c| c.into_iter().map(|c| c - c.floor()).collect()).collect();
        Ok(Schedule { values, blocks, ends: [0.0, 1.0], unit: String::new(), cycle_s: Some(cycle_s), count: first })
    }

    /// Samples at which each cycle comes to a phase, trial by trial.
    pub(crate) fn crossings(&self, phase: f64) -> Vec<Vec<usize>> {
        let of_trial = |(values, blocks): (&Vec<f64>, &Vec<usize>)| {
            // Cycles since the phase: a whole number is passed where the phase is.
            let passed: Vec<f64> = values.iter().zip(blocks).map(|(value, block)| (*block as f64 + value - phase + 1e-9).floor()).collect();
            let begins = |k: usize| passed[k] > passed[k - 1] || (passed[k - 1].is_nan() && (values[k] - phase).abs() < 1e-9);
            (1..passed.len()).filter(|k| passed[*k].is_finite() && begins(*k)).collect()
        };
        self.values.iter().zip(&self.blocks).map(of_trial).collect()
    }

    fn over_time(trials: &Trials) -> Self {
        let rate = trials.sample_rate_hz();
        let seconds: Vec<Vec<f64>> = trials.recordings().iter().map(|r| (0..r.len()).map(|k| r.start_s() + k as f64 / rate).collect()).collect();
        let ends = range(&seconds.iter().map(Vec::as_slice).collect::<Vec<_>>());
        Self::scaled(&seconds.iter().map(Vec::as_slice).collect::<Vec<_>>(), ends, "s")
    }

    fn over_channel(trials: &Trials, name: &str) -> Result<Self, Refused> {
        let channels = channel(trials, name)?;
        let mut sorted: Vec<f64> = channels.iter().flat_map(|c| c.iter().copied()).collect();
        sorted.sort_unstable_by(f64::total_cmp);
        let ends = ENDS.map(|share| sorted[(share * (sorted.len() - 1) as f64).round() as usize]);
        if ends[1] <= ends[0] {
            return Err(format!("channel \"{name}\" stays at {} and schedules nothing; choose another with `schedule`", ends[0]));
        }
        let unit = trials.trials.first().and_then(|t| t.recording.channel(name).ok()).map_or_else(String::new, |c| c.unit.symbol().to_owned());
        Ok(Self::scaled(&channels, ends, &unit))
    }

    fn scaled(channels: &[&[f64]], ends: [f64; 2], unit: &str) -> Self {
        let width = (ends[1] - ends[0]).max(f64::MIN_POSITIVE);
        let values = channels.iter().map(|c| c.iter().map(|v| ((v - ends[0]) / width).clamp(0.0, 1.0)).collect()).collect();
        let piece = |trial: usize, k: usize, samples: usize| trial * PIECES + k * PIECES / samples;
        let blocks = channels.iter().enumerate().map(|(trial, c)| (0..c.len()).map(|k| piece(trial, k, c.len())).collect()).collect();
        Schedule { values, blocks, ends, unit: unit.to_owned(), cycle_s: None, count: PIECES * channels.len() }
    }
}

/// Channels that a schedule is made of.
pub(crate) fn schedule_channels(schedule: Option<&str>, cycle_by: Option<&str>) -> Vec<String> {
    schedule.filter(|word| ![PHASE, TIME].contains(word)).into_iter().chain(cycle_by).map(str::to_owned).collect()
}

/// The samples of a channel in each trial.
fn channel<'a>(trials: &'a Trials, name: &str) -> Result<Vec<&'a [f64]>, Refused> {
    let of = |recording: &'a ndof_signal::Recording| recording.channel(name).map(|c| c.samples.as_slice());
    let found: Result<Vec<_>, _> = trials.recordings().into_iter().map(of).collect();
    found.map_err(|_| format!("no channel \"{name}\" for the schedule; there is phase, time, and every channel of the recording"))
}

fn range(channels: &[&[f64]]) -> [f64; 2] {
    channels.iter().flat_map(|c| c.iter()).fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], v| [low.min(*v), high.max(*v)])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Trial;
    use crate::trials::{RoleNames, Trim};
    use ndof_signal::{Channel, Recording, Unit};

    /// 4 s at 100 Hz with a channel more.
    fn trials(extra: impl Fn(f64) -> f64) -> Trials {
        let wave = |hz: f64| (0..400).map(|k| (hz * f64::from(k)).sin()).collect::<Vec<f64>>();
        let more = (0..400).map(|k| extra(f64::from(k) / 100.0)).collect::<Vec<f64>>();
        let channels = [("force_x", "N", wave(0.1)), ("pos_x", "m", wave(0.2)), ("more", "", more)];
        let channels = channels.into_iter().map(|(name, unit, samples)| Channel::new(name, Unit::parse(unit).expect("a unit").0, samples)).collect();
        let recording = Recording::new(100.0, channels).expect("channels");
        let names = RoleNames { kept: vec!["more".to_owned()], ..RoleNames::default() };
        Trials::new(vec![Trial::of("a.csv", recording)], &names, &Trim::default()).expect("trials")
    }

    fn by(channel: &str) -> Cycles<'_> {
        Cycles { cycle_by: Some(channel), ..Cycles::default() }
    }

    fn at(events: &Events) -> Cycles<'_> {
        Cycles { event_s: Some(events), ..Cycles::default() }
    }

    fn every(cycle_s: f64) -> Cycles<'static> {
        Cycles { cycle_s: Some(cycle_s), ..Cycles::default() }
    }

    #[test]
    fn events_begin_cycles_between_samples_and_beyond_the_ends_of_the_recording() {
        // Cycles of 0.8 s from 3.3 ms before each multiple on: each sample is 3.3 ms further than by the clock.
        let events: Vec<f64> = (0..7).rev().map(|k| 0.8 * f64::from(k) - 0.003_3).collect();
        for events in [Events::Every(events.clone()), Events::Each(vec![events])] {
            let found = Schedule::new(&trials(|t| t), PHASE, at(&events)).expect("cycles");
            assert!((0..400).all(|k| (found.values[0][k] - (k as f64 / 80.0 + 0.003_3 / 0.8).fract()).abs() < 1e-9));
            assert!((found.count, found.blocks[0][79], found.blocks[0][80]) == (5, 0, 1) && (found.cycle_s.expect("cycles") - 0.8).abs() < 1e-9);
        }
    }

    #[test]
    fn clock_edges_and_a_phase_that_wraps_give_the_same_phase() {
        let clock = Schedule::new(&trials(|t| t), PHASE, every(0.8)).expect("cycles");
        let wraps = Schedule::new(&trials(|t| (t / 0.8 + 1e-9).fract()), PHASE, by("more")).expect("cycles");
        let edges = Schedule::new(&trials(|t| if (t / 0.8 + 1e-9).fract() < 0.3 { 5.0 } else { 0.0 }), PHASE, by("more")).expect("cycles");
        assert_eq!((clock.count, clock.cycle_s), (5, Some(0.8)));
        for other in [wraps, edges] {
            // Before the first edge and after the last there is no whole cycle.
            assert!(other.values[0][40].is_nan() && other.values[0][390].is_nan());
            assert!((80..320).all(|k| (other.values[0][k] - clock.values[0][k]).abs() < 1e-9), "{:?}", other.cycle_s);
            assert!((other.cycle_s.expect("cycles") - 0.8).abs() < 1e-12);
        }
    }

    #[test]
    fn time_and_a_channel_go_from_end_to_end() {
        let time = Schedule::new(&trials(|t| t), TIME, Cycles::default()).expect("time");
        assert_eq!((time.ends, time.unit.as_str(), time.cycle_s), ([0.0, 3.99], "s", None));
        let posture = Schedule::new(&trials(|t| 3.0 - t), "more", Cycles::default()).expect("a channel");
        assert!(posture.values[0][0] == 1.0 && posture.values[0][399] == 0.0 && posture.ends[0] > -0.99);
    }

    #[test]
    fn what_makes_no_schedule_is_refused_with_what_to_do() {
        let said = |cycles: Cycles<'_>, word: &str, extra: fn(f64) -> f64| Schedule::new(&trials(extra), word, cycles).err().unwrap_or_default();
        let none = Cycles::default();
        assert!(said(none, PHASE, |t| t).contains("`cycle_by`"));
        assert!(said(by("more"), PHASE, |_| 1.0).contains("no two cycles"));
        assert!(said(by("more"), TIME, |t| t).contains("leave them out"));
        assert!(said(at(&Events::Every(vec![1.0])), PHASE, |t| t).contains("no two cycles"));
        assert!(said(at(&Events::Each(vec![vec![1.0, 2.0]; 2])), PHASE, |t| t).contains("2 trials, and there are 1"));
        assert!(said(none, "more", |_| 1.0).contains("stays at 1"));
        assert!(said(none, "other", |t| t).contains("\"other\""));
        assert!(said(every(9.0), PHASE, |t| t).contains("1 cycle"));
    }
}
