//! What a diagnosis can be asked.

use super::arm::known_arm;
use crate::error::AnalysisError;
use crate::file::{BaselineFile, KinematicsFile};
#[cfg(feature = "clap")]
use crate::options::{HOLDS, words};
use crate::result::given;
use crate::schedule::{Cycles, Events, PHASE, Schedule, TIME, schedule_channels};
use crate::suggest::{did_you_mean, nearest};
use crate::trials::Trials;
use ndof_devices::RobotConfig;
use ndof_diagnose::Options;
use ndof_joints::CAUSES;
use ndof_models::Hold;
use ndof_models::effects::EFFECTS;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// A third is held out, and a mean over fewer than two of the others leaves nothing.
const FEWEST_CYCLES: usize = 4;

/// What no fit may see.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(untagged)]
pub enum HeldOut {
    /// Of several files the last third, of one the last 30 % of its time; of joints that move one after the other, of each of as few stretches as it takes.
    #[default]
    Auto,
    /// This stretch of every file, in seconds.
    Time([f64; 2]),
    /// These files.
    Files(Vec<String>),
}

/// How a simulation is diagnosed; what is not given follows from the data.
///
/// The fields are the long options of `ndof diagnose`, the keys of the table `[diagnose]` of a study and the keywords in Python.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "clap", derive(clap::Args))]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields, default, rename_all = "kebab-case")]
pub struct Diagnose {
    /// The band that is analysed, in Hz; found from the data where it is not given.
    #[cfg_attr(feature = "clap", arg(skip))]
    #[serde(rename = "band")]
    pub band_hz: Option<[f64; 2]>,
    /// What no fit may see.
    #[cfg_attr(feature = "clap", arg(skip))]
    pub held_out: HeldOut,
    /// Discrepancy that does not matter, as a share of each signal's standard deviation
    #[cfg_attr(feature = "clap", arg(long, value_name = "SHARE", default_value_t = 0.01))]
    pub tolerance: f64,
    /// Seed of the bootstrap.
    #[cfg_attr(feature = "clap", arg(skip))]
    pub seed: u64,
    /// How forces go between samples, as in `fit`: zero, linear, band-limited, read-after or read-before [default: what the data clearly show, else band-limited]
    #[cfg_attr(feature = "clap", arg(long, value_parser = words::<Hold>(&HOLDS)))]
    #[cfg_attr(feature = "schema", schemars(with = "Option<String>"))]
    pub hold: Option<Hold>,
    /// Effects that the search leaves out
    #[cfg_attr(feature = "clap", arg(long, value_name = "EFFECTS", value_delimiter = ','))]
    pub without: Vec<String>,
    /// Simulate the next experiments that would tell confusable causes apart, and say how well each would
    #[cfg_attr(feature = "clap", arg(long))]
    pub plan: bool,
    /// What stiffness or damping may vary with, as one cause beside the others: phase (of a cycle), time, or a channel (a posture, an EMG envelope)
    #[cfg_attr(feature = "clap", arg(long, value_name = "WHAT", conflicts_with = "plan"))]
    pub schedule: Option<String>,
    /// Duration of a cycle in seconds, from time zero of each recording on; the mean movement over the cycle is taken out of all hypotheses alike.
    #[cfg_attr(feature = "clap", arg(skip))]
    #[serde(rename = "cycle")]
    pub cycle_s: Option<f64>,
    /// Channel whose rising edges begin cycles, or a phase that wraps where they begin.
    #[cfg_attr(feature = "clap", arg(skip))]
    pub cycle_by: Option<String>,
    /// When cycles begin, in seconds: one list for every trial, or one for each.
    #[cfg_attr(feature = "clap", arg(skip))]
    #[serde(rename = "event")]
    pub event_s: Option<Events>,
    /// The simulation that is judged.
    #[cfg_attr(feature = "clap", arg(skip))]
    #[cfg_attr(feature = "schema", schemars(with = "Option<serde_json::Map<String, serde_json::Value>>"))]
    pub baseline: Option<BaselineFile>,
    /// The arm whose curved geometry is weighed as a cause; in a study that of the table `[kinematics]`.
    #[cfg_attr(feature = "clap", arg(skip))]
    #[cfg_attr(feature = "schema", schemars(with = "Option<serde_json::Map<String, serde_json::Value>>"))]
    pub kinematics: Option<KinematicsFile>,
    /// The robot whose joints are judged: its file's bodies and frictions are the simulation.
    #[cfg_attr(feature = "clap", arg(skip))]
    #[cfg_attr(feature = "schema", schemars(with = "Option<serde_json::Map<String, serde_json::Value>>"))]
    pub robot: Option<RobotConfig>,
    /// In a study: so many effects are drawn from the seed and hidden in what is simulated; the answer comes last.
    #[cfg_attr(feature = "clap", arg(skip))]
    pub hide: usize,
}

impl Default for Diagnose {
    fn default() -> Self {
        let Options { tolerance, seed, plan, .. } = Options::default();
        Diagnose {
            band_hz: None,
            held_out: HeldOut::Auto,
            tolerance,
            seed,
            hold: None,
            without: Vec::new(),
            plan,
            schedule: None,
            cycle_s: None,
            cycle_by: None,
            event_s: None,
            baseline: None,
            kinematics: None,
            robot: None,
            hide: 0,
        }
    }
}

impl Diagnose {
    /// Channels that the schedule is made of, beside those with a role.
    pub fn channels(&self) -> Vec<String> {
        schedule_channels(self.schedule.as_deref(), self.cycle_by.as_deref())
    }

    fn cycles(&self) -> Cycles<'_> {
        Cycles { cycle_s: self.cycle_s, cycle_by: self.cycle_by.as_deref(), event_s: self.event_s.as_ref() }
    }

    /// What stiffness and damping may follow; what is wrong with it, and what to do.
    fn schedule(&self, trials: &Trials) -> Result<Option<ndof_diagnose::Schedule>, String> {
        let Some(word) = self.schedule.as_deref() else {
            return self.cycles().given().map_or(Ok(None), |option| Err(format!("`{option}` is of a `schedule`; give that too")));
        };
        if self.plan {
            return Err("`plan` simulates experiments that have no `schedule`; leave out one of the two".to_owned());
        }
        let Schedule { values, ends, unit, cycle_s, count, .. } = Schedule::new(trials, word, self.cycles())?;
        if cycle_s.is_some() && count < FEWEST_CYCLES {
            return Err(format!("{count} cycles: a mean movement, what deviates from it and a held-out part need {FEWEST_CYCLES} or more; record more"));
        }
        let words = match word {
            PHASE => "the phase of the cycle".to_owned(),
            TIME => TIME.to_owned(),
            channel => format!("the channel {channel}"),
        };
        Ok(Some(ndof_diagnose::Schedule { words, unit, ends, cycle_s, values }))
    }

    /// The same for the search, which knows trials by number.
    pub(super) fn options(&self, trials: &Trials) -> Result<Options, AnalysisError> {
        self.check(EFFECTS.iter().map(|effect| effect.name()).collect(), "effects")?;
        if self.baseline.is_some() {
            self.refuse_hold_beside("a `baseline`")?;
        }
        Ok(Options {
            band_hz: self.band_hz.map(|[low, high]| (low, high)),
            held_out: self.apart(trials),
            tolerance: self.tolerance,
            seed: self.seed,
            without: self.without.clone(),
            plan: self.plan,
            arm: self.kinematics.as_ref().map(|file| known_arm(file, trials, self.schedule.is_some())).transpose()?,
            schedule: self.schedule(trials).map_err(|what| AnalysisError::Schedule { what })?,
            ..Options::default()
        })
    }

    /// Refuses a `hold` beside what stands for the linear model that it is of.
    pub(super) fn refuse_hold_beside(&self, simulation: &str) -> Result<(), AnalysisError> {
        let what = format!("it is of the linear model that is fitted, and {simulation} stands for that; leave one of the two out");
        if self.hold.is_some() { Err(AnalysisError::Meaning { file: "`hold`".to_owned(), what }) } else { Ok(()) }
    }

    /// The same where a robot's joints are judged; what is of other tasks is refused.
    pub(super) fn of_joints(&self, trials: &Trials) -> Result<ndof_joints::Options, AnalysisError> {
        self.check(CAUSES.iter().map(|cause| cause.card.name).collect(), "joints")?;
        let other = ["band", "baseline", "hold", "kinematics", "schedule", "plan"];
        if let Some(name) = given(self).into_iter().find(|name| other.contains(&name.as_str())) {
            return Err(AnalysisError::Meaning {
                file: format!("`{name}`"),
                what: "it is not for a `robot`, whose joints are judged; leave out one of the two".to_owned(),
            });
        }
        Ok(ndof_joints::Options { held_out: self.apart(trials), tolerance: self.tolerance, without: self.without.clone(), ..ndof_joints::Options::default() })
    }

    /// Refuses a tolerance that is none, and names of causes that there are not in the `list`.
    fn check(&self, known: Vec<&str>, list: &str) -> Result<(), AnalysisError> {
        let wrong = |argument: &str, what: String| Err(AnalysisError::Meaning { file: format!("`{argument}`"), what });
        if !(self.tolerance.is_finite() && self.tolerance >= 0.0) {
            return wrong("tolerance", format!("{} is no share; give one such as 0.01", self.tolerance));
        }
        match self.without.iter().find(|name| !known.contains(&name.as_str())) {
            Some(name) => {
                let near = did_you_mean(nearest(name, known.iter().copied()).as_deref());
                wrong("without", format!("no effect \"{name}\"{near}; `ndof list {list}` prints them"))
            }
            None => Ok(()),
        }
    }

    pub(super) fn apart(&self, trials: &Trials) -> ndof_diagnose::HeldOut {
        match &self.held_out {
            HeldOut::Auto => ndof_diagnose::HeldOut::Auto,
            HeldOut::Time([from, to]) => ndof_diagnose::HeldOut::Time(*from, *to),
            HeldOut::Files(files) => {
                let held = trials.trials.iter().enumerate().filter(|(_, trial)| files.contains(&trial.file));
                ndof_diagnose::HeldOut::Trials(held.map(|(k, _)| k).collect())
            }
        }
    }

    /// The same without the folders of files, which are nobody else's business.
    pub(super) fn recorded(&self) -> Self {
        let bare = |file: &String| Path::new(file).file_name().map_or_else(|| file.clone(), |name| name.to_string_lossy().into_owned());
        let held_out = match &self.held_out {
            HeldOut::Files(files) => HeldOut::Files(files.iter().map(bare).collect()),
            other => other.clone(),
        };
        Diagnose { held_out, ..self.clone() }
    }
}
