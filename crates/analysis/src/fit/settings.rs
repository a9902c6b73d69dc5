//! What a fit can be asked.

use super::named_models::MODEL;
use crate::file::KinematicsFile;
#[cfg(feature = "clap")]
use crate::options::{HOLDS, count, not_negative, positive, words};
use crate::schedule::{Cycles, Events, schedule_channels};
use ndof_models::schedule::Term;
use ndof_models::{Hold, Symmetry, Transducer};
use serde::{Deserialize, Serialize};

/// What a fit minimises.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum FitCost {
    /// Squared errors weighted by the estimate's covariance.
    #[default]
    Weighted,
    /// Gain in dB and phase in degrees weighted by coherence, as in the paper's appendix.
    Paper,
}

/// How coherence weighs the paper's measures of agreement and its cost.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum VafWeight {
    /// By the partial coherence as it is computed, γ².
    #[default]
    GammaSquared,
    /// By its root γ.
    Gamma,
}

/// How a model is fitted; what is not given follows from the data.
///
/// The fields are the long options of `ndof fit`, the keys of the table `[fit]` of a study and the keywords in Python.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "clap", derive(clap::Args))]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields, default, rename_all = "kebab-case")]
pub struct Fit {
    /// Parametric model: inertia-damping-stiffness, with extensions behind a `+` (`ndof list models`) [default: inertia-damping-stiffness]
    #[cfg_attr(feature = "clap", arg(long))]
    pub model: Option<String>,
    /// The band that is fitted, in Hz; that which is excited where it is not given.
    #[cfg_attr(feature = "clap", arg(skip))]
    #[serde(rename = "band", alias = "band_hz")]
    pub band_hz: Option<[f64; 2]>,
    /// Widen intervals by usual errors of calibration: 0.5 % of M, 1 % of B and K, 0.1 ms of delays, in quadrature
    #[cfg_attr(feature = "clap", arg(long))]
    pub systematic: bool,
    /// Compare the model with each single extension of it, by likelihood ratio, AIC and BIC
    #[cfg_attr(feature = "clap", arg(long))]
    pub compare: bool,
    /// What is minimised: squared errors weighted by their covariance, or the paper's dB and degrees
    #[cfg_attr(feature = "clap", arg(long, default_value = "weighted", value_parser = words::<FitCost>(&["weighted", "paper"])))]
    pub cost: FitCost,
    /// How coherence weighs VAF, R² and the paper's cost: γ² as it is computed, or its root γ
    #[cfg_attr(feature = "clap", arg(long, default_value = "gamma-squared", value_parser = words::<VafWeight>(&["gamma-squared", "gamma"])))]
    pub vaf_weight: VafWeight,
    /// What is assumed of M, B and K: symmetry, symmetry without negative eigenvalues, or nothing
    #[cfg_attr(feature = "clap", arg(long, default_value = "symmetric", value_parser = words::<Symmetry>(&["symmetric", "positive-semidefinite", "free"])))]
    #[cfg_attr(feature = "schema", schemars(with = "String"))]
    pub symmetry: Symmetry,
    /// How forces go between samples: zero where each value stays until the next, as a computer commands it; linear where straight lines join
    /// them; band-limited behind an anti-alias filter; read-after or read-before where straight lines join what a held command leaves and channels are
    /// read just after it is written, or just before [default: what the data clearly show, else band-limited]
    #[cfg_attr(feature = "clap", arg(long, value_parser = words::<Hold>(&HOLDS)))]
    #[cfg_attr(feature = "schema", schemars(with = "Option<String>"))]
    pub hold: Option<Hold>,
    /// Stiffness of the force transducer's mount (N/m; N m/rad), so that its deflection is not mistaken for inertia
    #[cfg_attr(feature = "clap", arg(long, value_name = "K", value_parser = positive))]
    pub transducer_stiffness: Option<f64>,
    /// Damping of the same mount (N s/m; N m s/rad) [default: 0]
    #[cfg_attr(feature = "clap", arg(long, value_name = "B", requires = "transducer_stiffness", value_parser = not_negative))]
    pub transducer_damping: Option<f64>,
    /// Also fit matrices that vary with phase (of a cycle), time, or a channel such as a posture, a velocity or an EMG envelope
    #[cfg_attr(feature = "clap", arg(long, value_name = "WHAT"))]
    pub schedule: Option<String>,
    /// Also fit in time, the model running free, with these force laws: NAME on every axis or NAME:AXIS, with commas between (`ndof list laws`)
    #[cfg_attr(feature = "clap", arg(long, value_name = "LIST", value_delimiter = ','))]
    pub law: Option<Vec<String>>,
    /// Duration of a cycle in seconds; the first begins at time zero of each recording.
    #[cfg_attr(feature = "clap", arg(skip))]
    #[serde(rename = "cycle")]
    pub cycle_s: Option<f64>,
    /// Channel that tells where cycles begin: by its rising edges, or as a phase that wraps there.
    #[cfg_attr(feature = "clap", arg(skip))]
    pub cycle_by: Option<String>,
    /// When cycles begin, in seconds: one list for every trial, or one for each.
    #[cfg_attr(feature = "clap", arg(skip))]
    #[serde(rename = "event")]
    pub event_s: Option<Events>,
    /// Which matrices follow the schedule [default: stiffness,damping]
    #[cfg_attr(feature = "clap", arg(long, value_name = "LIST", value_delimiter = ',', requires = "schedule", value_parser = words::<Term>(&["stiffness", "damping", "inertia"])))]
    #[cfg_attr(feature = "schema", schemars(with = "Option<Vec<String>>"))]
    pub varying: Option<Vec<Term>>,
    /// Number of splines of each entry over the schedule, at least 4; a penalty makes the result as smooth as the data allow [default: 24]
    #[cfg_attr(feature = "clap", arg(long, value_name = "N", value_parser = count, requires = "schedule"))]
    pub knots: Option<usize>,
    /// Where the joints are.
    #[cfg_attr(feature = "clap", arg(skip))]
    #[cfg_attr(feature = "schema", schemars(with = "Option<serde_json::Map<String, serde_json::Value>>"))]
    pub kinematics: Option<KinematicsFile>,
}

impl Fit {
    /// The model's name in full.
    pub(super) fn model(&self) -> &str {
        self.model.as_deref().unwrap_or(MODEL)
    }

    /// Channels that the schedule is made of, beside those with a role.
    pub fn channels(&self) -> Vec<String> {
        schedule_channels(self.schedule.as_deref(), self.cycle_by.as_deref())
    }

    /// A setting that has no meaning without a schedule, where it is given.
    pub(super) fn schedule_needed(&self) -> Option<&'static str> {
        let given = [("varying", self.varying.is_some()), ("knots", self.knots.is_some())];
        self.cycles().given().or(given.into_iter().find(|(_, given)| *given).map(|(name, _)| name))
    }

    /// Where cycles begin.
    pub(super) fn cycles(&self) -> Cycles<'_> {
        Cycles { cycle_s: self.cycle_s, cycle_by: self.cycle_by.as_deref(), event_s: self.event_s.as_ref() }
    }

    /// The known compliance of the transducer.
    pub(super) fn transducer(&self) -> Option<Transducer> {
        self.transducer_stiffness.map(|stiffness| Transducer { stiffness, damping: self.transducer_damping.unwrap_or(0.0) })
    }
}
