//! What a design can be asked.

use super::limbs::LooseLimb;
use super::specification::{Limits, Specification};
use super::target::Target;
use crate::error::{StudyError, meaning};
use crate::file::{Excitation, ExperimentFile};
use crate::limits;
#[cfg(feature = "clap")]
use ndof_analysis::options::{not_negative, pair, positive, words};
use ndof_signal::{AxisPlan, Lines, Sweep};
use serde::{Deserialize, Serialize};
use std::path::PathBuf;

/// What a perturbation is made of and what it must keep; what is not given follows from the experiment, or is the default.
///
/// The fields are the long options of `ndof design` and the keywords in Python.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "clap", derive(clap::Args))]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields, default, rename_all = "kebab-case")]
pub struct Design {
    /// Robot, hold and limb for which it is meant.
    #[cfg_attr(feature = "clap", arg(skip))]
    #[cfg_attr(feature = "schema", schemars(with = "Option<serde_json::Map<String, serde_json::Value>>"))]
    pub experiment: Option<ExperimentFile>,
    /// Whether commands go through the inverse of that model, so that forces with the designed properties arrive at the limb.
    #[cfg_attr(feature = "clap", arg(skip))]
    pub precompensate: bool,
    /// Correct the commands N times for what the simulated device, with its friction, does not deliver
    #[cfg_attr(feature = "clap", arg(long, value_name = "N", requires = "precompensate"))]
    pub corrections: Option<usize>,
    /// Kind of perturbation [default: filtered-noise, or the experiment's own]
    #[cfg_attr(feature = "clap", arg(long, value_parser = clap::builder::PossibleValuesParser::new(Excitation::KINDS)))]
    pub kind: Option<String>,
    /// Names of the axes [default: x,y, or the device's]
    #[cfg_attr(feature = "clap", arg(long, value_delimiter = ','))]
    pub axes: Option<Vec<String>>,
    /// Torques in N m in place of forces in N
    #[cfg_attr(feature = "clap", arg(long))]
    pub rotational: bool,
    /// Number of files, each with a perturbation of its own [default: 1, or the experiment's own]
    #[cfg_attr(feature = "clap", arg(long, value_name = "N"))]
    pub trials: Option<usize>,
    /// Seconds that will be analysed [default: 50, or the experiment's own]
    #[cfg_attr(feature = "clap", arg(long = "duration", value_name = "S"))]
    #[serde(rename = "duration")]
    pub duration_s: Option<f64>,
    /// Seconds that are commanded before that [default: 0, or what the experiment discards]
    #[cfg_attr(feature = "clap", arg(long = "lead-in", value_name = "S"))]
    #[serde(rename = "lead-in")]
    pub lead_in_s: Option<f64>,
    /// Samples per second [default: 500, or the experiment's own]
    #[cfg_attr(feature = "clap", arg(long = "sample-rate", value_name = "HZ"))]
    #[serde(rename = "sample-rate")]
    pub sample_rate_hz: Option<f64>,
    /// Root mean square of each axis; with pre-compensation, of all together [default: 4, or the experiment's own]
    #[cfg_attr(feature = "clap", arg(long, value_parser = positive))]
    pub rms: Option<f64>,
    /// Corner of the noise's low-pass; reach of a binary sequence [default: 15, or the experiment's own]
    #[cfg_attr(feature = "clap", arg(long = "cutoff", value_name = "HZ"))]
    #[serde(rename = "cutoff")]
    pub cutoff_hz: Option<f64>,
    /// Order of the noise's low-pass [default: 8, or the experiment's own]
    #[cfg_attr(feature = "clap", arg(long))]
    pub order: Option<usize>,
    /// Seeds tried for each trial of noise [default: 100, or the experiment's own]
    #[cfg_attr(feature = "clap", arg(long, value_name = "N"))]
    pub candidates: Option<usize>,
    /// Simulate the N best of these seeds, and take the one whose delivered forces are least coherent
    #[cfg_attr(feature = "clap", arg(long, value_name = "N"))]
    pub shortlist: Option<usize>,
    /// Remove the coherence between axes that the search has left in each trial of noise, for an analysis with nperseg 2048
    #[cfg_attr(feature = "clap", arg(long))]
    pub decorrelate: bool,
    /// Seconds in a period of a multisine or binary sequence [default: 10, or the experiment's own]
    #[cfg_attr(feature = "clap", arg(long = "period", value_name = "S"))]
    #[serde(rename = "period")]
    pub period_s: Option<f64>,
    /// Lines of a multisine, ends of a sweep, in Hz [default: 0.3-12, or the experiment's own]
    #[cfg_attr(feature = "clap", arg(long = "lines", value_name = "LO-HI", value_parser = pair))]
    #[serde(rename = "lines")]
    pub lines_hz: Option<[f64; 2]>,
    /// Harmonics of a multisine that carry power [default: odd-with-detection]
    #[cfg_attr(feature = "clap", arg(long, value_parser = words::<Lines>(&["all", "odd", "odd-with-detection"])))]
    #[cfg_attr(feature = "schema", schemars(with = "Option<String>"))]
    pub harmonics: Option<Lines>,
    /// How a multisine tells axes apart: orthogonal trials, or lines in turn within one [default: orthogonal]
    #[cfg_attr(feature = "clap", arg(long, value_parser = words::<AxisPlan>(&["orthogonal", "zippered"])))]
    #[cfg_attr(feature = "schema", schemars(with = "Option<String>"))]
    pub axis_plan: Option<AxisPlan>,
    /// Amplitudes of a multisine are proportional to frequency to this power [default: 0]
    #[cfg_attr(feature = "clap", arg(long, allow_hyphen_values = true))]
    pub slope: Option<f64>,
    /// Iterations that lower the peak of a multisine; 0 keeps random phases [default: 200]
    #[cfg_attr(feature = "clap", arg(long, value_name = "N"))]
    pub crest_steps: Option<usize>,
    /// How a chirp goes through its frequencies [default: logarithmic]
    #[cfg_attr(feature = "clap", arg(long, value_parser = words::<Sweep>(&["linear", "logarithmic"])))]
    #[cfg_attr(feature = "schema", schemars(with = "Option<String>"))]
    pub sweep: Option<Sweep>,
    /// Seconds over which it fades in and out; periodic ones begin at full size [default: 0, or the experiment's own]
    #[cfg_attr(feature = "clap", arg(long = "fade", value_name = "S"))]
    #[serde(rename = "fade")]
    pub fade_s: Option<f64>,
    /// Largest magnitude; a perturbation that exceeds it is scaled down as a whole
    #[cfg_attr(feature = "clap", arg(long, value_parser = positive, help_heading = "Limits"))]
    pub peak: Option<f64>,
    /// Largest change per second; a perturbation that exceeds it is scaled down as a whole
    #[cfg_attr(feature = "clap", arg(long = "slew", value_name = "PER_S", value_parser = positive, help_heading = "Limits"))]
    #[serde(rename = "slew")]
    pub slew_per_s: Option<f64>,
    /// Refuse a perturbation that would move a soft, nominal or stiff limb further than this (m, rad) [default: the experiment's safety distance]
    #[cfg_attr(feature = "clap", arg(long, value_name = "M", value_parser = positive, help_heading = "Limits"))]
    pub max_displacement: Option<f64>,
    /// Refuse a perturbation that would move such a limb faster than this (m/s, rad/s) [default: the experiment's safety speed]
    #[cfg_attr(feature = "clap", arg(long, value_name = "M_PER_S", value_parser = positive, help_heading = "Limits"))]
    pub max_velocity: Option<f64>,
    /// Inertia, damping, stiffness of a soft limb, without an experiment [default: 1.5,8,100 or 0.004,0.03,0.5]
    #[cfg_attr(feature = "clap", arg(long, value_name = "M,B,K", value_parser = limb, help_heading = "Limits"))]
    pub soft: Option<LooseLimb>,
    /// Inertia, damping, stiffness of a stiff limb, without an experiment [default: 2.5,25,800 or 0.006,0.1,5]
    #[cfg_attr(feature = "clap", arg(long, value_name = "M,B,K", value_parser = limb, help_heading = "Limits"))]
    pub stiff: Option<LooseLimb>,
    /// Say how long to measure for intervals of ± these shares: M, B, K, an entry such as K_x_y, gain@HZ; e.g. K=10%,gain@2=5%
    #[cfg_attr(feature = "clap", arg(long, value_name = "WHAT=SHARE", value_delimiter = ','))]
    pub target_ci: Vec<Target>,
    /// Band of the fit that --target-ci is about [default: 0.5-8]
    #[cfg_attr(feature = "clap", arg(long = "fit-band", value_name = "LO-HI", value_parser = pair))]
    #[serde(rename = "fit-band")]
    pub fit_band_hz: Option<[f64; 2]>,
    /// Band over which coherence between the axes is judged [default: 0.25-15]
    #[cfg_attr(feature = "clap", arg(skip))]
    #[serde(rename = "band")]
    pub band_hz: Option<[f64; 2]>,
    /// Of all random signals [default: 1, or the experiment's own]
    #[cfg_attr(feature = "clap", arg(skip))]
    pub seed: Option<u64>,
}

/// `M,B,K` of every axis of a limb.
#[cfg(feature = "clap")]
fn limb(text: &str) -> Result<LooseLimb, String> {
    let numbers: Option<Vec<f64>> = text.split(',').map(|part| positive(part).ok()).collect();
    match numbers.as_deref() {
        Some(&[inertia, damping, stiffness]) => Ok(LooseLimb { inertia, damping, stiffness }),
        _ => Err("write inertia, damping and stiffness as three numbers above zero, such as 1.5,8,100".to_owned()),
    }
}

/// What a motion of a robot's joints must keep, and what it is to tell.
///
/// The fields are the long options of `ndof design --robot` and the keywords in Python; those of time and seed are shared with [`Design`].
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "clap", derive(clap::Args), command(next_help_heading = "Motions of a robot's joints"))]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields, default, rename_all = "kebab-case")]
pub struct RobotMotion {
    /// Design a motion of this robot's joints that tells its inertial parameters and friction: a URDF, MJCF or TOML file
    #[cfg_attr(feature = "clap", arg(long, value_name = "FILE", conflicts_with_all = ["experiment", "precompensate"]))]
    pub robot: Option<PathBuf>,
    /// The link at the end of the chain, where a URDF or MJCF has several
    #[cfg_attr(feature = "clap", arg(long, value_name = "LINK", requires = "robot"))]
    pub tip: Option<String>,
    /// Largest speed (rad/s, m/s) of all joints, or of each; the file's holds where it is lower
    #[cfg_attr(feature = "clap", arg(long, value_name = "RAD_PER_S", value_delimiter = ',', value_parser = positive, requires = "robot"))]
    pub speed_limit: Vec<f64>,
    /// Largest acceleration (rad/s^2, m/s^2) of all joints, or of each [default: none]
    #[cfg_attr(feature = "clap", arg(long, value_name = "RAD_PER_S2", value_delimiter = ',', value_parser = positive, requires = "robot"))]
    pub acceleration_limit: Vec<f64>,
    /// Share of range, speed, acceleration and torque that stays free for the controller [default: 0.1]
    #[cfg_attr(feature = "clap", arg(long, value_name = "SHARE", value_parser = not_negative, requires = "robot"))]
    pub margin: Option<f64>,
    /// Sines and cosines in the Fourier series of each joint [default: 5]
    #[cfg_attr(feature = "clap", arg(long, value_name = "N", requires = "robot"))]
    pub fourier_terms: Option<usize>,
    /// Random motions that are improved [default: 4]
    #[cfg_attr(feature = "clap", arg(long, value_name = "N", requires = "robot"))]
    pub starts: Option<usize>,
    /// Noise of the measured torques (N m rms), for the predicted errors [default: 1 % of each joint's torque in random motions]
    #[cfg_attr(feature = "clap", arg(long, value_name = "NM", value_parser = positive, requires = "robot"))]
    pub torque_noise: Option<f64>,
    /// Joints, or parts of names of parameters, to determine best [default: all]
    #[cfg_attr(feature = "clap", arg(long, value_name = "NAME", value_delimiter = ',', requires = "robot"))]
    pub interest: Vec<String>,
    /// Seconds of the whole motion [default: 50]
    #[cfg_attr(feature = "clap", arg(skip))]
    #[serde(rename = "duration")]
    pub duration_s: Option<f64>,
    /// Seconds in a period [default: 10]
    #[cfg_attr(feature = "clap", arg(skip))]
    #[serde(rename = "period")]
    pub period_s: Option<f64>,
    /// Samples per second [default: 500]
    #[cfg_attr(feature = "clap", arg(skip))]
    #[serde(rename = "sample-rate")]
    pub sample_rate_hz: Option<f64>,
    /// Of all random numbers [default: 1]
    #[cfg_attr(feature = "clap", arg(skip))]
    pub seed: Option<u64>,
}

impl Design {
    /// What is asked for, in front of what the experiment says, in front of the defaults.
    pub(super) fn specification(&self) -> Result<Specification, StudyError> {
        let experiment = self.experiment.as_ref();
        let from = |value: Option<f64>, own: fn(&ExperimentFile) -> f64, default| value.or(experiment.map(own)).unwrap_or(default);
        let [soft, stiff] = LooseLimb::soft_and_stiff(self.rotational);
        let device = experiment.map(|file| file.experiment().axes()).transpose()?;
        let found = Specification {
            excitation: self.excitation(),
            axes: self.axes.clone().or(device).unwrap_or_else(|| vec!["x".to_owned(), "y".to_owned()]),
            rotational: self.rotational,
            trials: self.trials.or(experiment.map(|file| file.trials)).unwrap_or(1),
            duration_s: from(self.duration_s, |file| file.duration_s, 50.0),
            lead_in_s: from(self.lead_in_s, |file| file.discard_s, 0.0),
            sample_rate_hz: from(self.sample_rate_hz, |file| file.sample_rate_hz, 500.0),
            seed: self.seed.or(experiment.map(|file| file.seed)).unwrap_or(1),
            band_hz: self.band().into(),
            experiment: self.experiment.clone(),
            limbs: [self.soft.unwrap_or(soft), self.stiff.unwrap_or(stiff)],
            limits: Limits { displacement: self.max_displacement, velocity: self.max_velocity },
            targets: self.target_ci.clone(),
            fit_band_hz: self.fit_band_hz.unwrap_or([0.5, 8.0]),
        };
        possible(&found)
            .and_then(|()| found.excitation.check())
            .and_then(|()| limits::simulation(found.trials, found.duration_s + found.lead_in_s, found.sample_rate_hz, found.axes.len()))
            .and_then(|()| found.two_periods())
            .map_err(|what| meaning("the design", what))?;
        Ok(found)
    }

    fn band(&self) -> [f64; 2] {
        self.band_hz.unwrap_or([0.25, 15.0])
    }

    fn excitation(&self) -> Excitation {
        let own = self.experiment.as_ref().map(|file| file.excitation.clone()).filter(|own| !own.replays());
        let own = own.unwrap_or_else(|| Excitation { candidates: 100, ..Excitation::default() });
        Excitation {
            kind: self.kind.clone().unwrap_or(own.kind),
            file: None,
            folder: PathBuf::new(),
            rms: self.rms.unwrap_or(own.rms),
            cutoff_hz: self.cutoff_hz.unwrap_or(own.cutoff_hz),
            order: self.order.unwrap_or(own.order),
            candidates: self.candidates.unwrap_or(own.candidates),
            shortlist: self.shortlist.unwrap_or(own.shortlist),
            search_band_hz: self.band(),
            decorrelate: self.decorrelate || own.decorrelate,
            precompensate: self.precompensate,
            corrections: self.corrections.unwrap_or(if self.precompensate { own.corrections } else { 0 }),
            period_s: self.period_s.unwrap_or(own.period_s),
            band_hz: self.lines_hz.unwrap_or(own.band_hz),
            harmonics: self.harmonics.unwrap_or(own.harmonics),
            axis_plan: self.axis_plan.unwrap_or(own.axis_plan),
            slope: self.slope.unwrap_or(own.slope),
            crest_steps: self.crest_steps.unwrap_or(own.crest_steps),
            sweep: self.sweep.unwrap_or(own.sweep),
            fade_s: self.fade_s.unwrap_or(own.fade_s),
            peak: self.peak.or(own.peak),
            slew_per_s: self.slew_per_s.or(own.slew_per_s),
        }
    }
}

/// Refuses what would make a recording of nothing.
fn possible(asked: &Specification) -> Result<(), String> {
    let samples = (asked.duration_s * asked.sample_rate_hz).round();
    let nameless = asked.axes.iter().any(|axis| axis.trim().is_empty());
    let (fade, whole) = (asked.excitation.fade_s, asked.duration_s + asked.lead_in_s);
    let wrong = [
        (
            !(samples.is_finite() && samples >= 1.0 && asked.sample_rate_hz > 0.0),
            format!("`duration={}` at `sample_rate={}`: nothing to write; give positive numbers", asked.duration_s, asked.sample_rate_hz),
        ),
        (asked.trials == 0, "`trials=0`: nothing would be made; ask for at least 1".to_owned()),
        (asked.excitation.candidates == 0, "`candidates=0`: no seed would be tried; ask for at least 1".to_owned()),
        (nameless, "`axes`: an axis has no name; write for example `axes=x,y`".to_owned()),
        (!(asked.lead_in_s >= 0.0 && asked.lead_in_s.is_finite()), format!("`lead_in={}`: it must not be negative", asked.lead_in_s)),
        (!(0.0..=whole / 2.0).contains(&fade), format!("`fade={fade}`: it must lie between 0 and half of the duration, {} s", whole / 2.0)),
    ];
    wrong.into_iter().find(|(wrong, _)| *wrong).map_or(Ok(()), |(_, message)| Err(message))
}
