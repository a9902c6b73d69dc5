//! `ndof/design/1`: perturbations to be commanded, and what they will do.

use super::settings::Design;
use ndof_analysis::result::{Head, Number};
use serde::{Deserialize, Serialize};

/// What was designed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct DesignResult {
    /// Which result this is.
    #[serde(flatten)]
    pub head: Head,
    /// What was asked for.
    #[serde(default)]
    pub settings: Design,
    /// What it is made of.
    pub kind: String,
    /// The axes.
    pub axes: Vec<String>,
    /// Unit of the commands.
    pub unit: String,
    /// Samples a second.
    pub sample_rate_hz: f64,
    /// Length of the stretch that is analysed (s).
    pub duration_s: f64,
    /// Length of what comes before it (s).
    pub lead_in_s: f64,
    /// Whether the inverse of a model of robot and limb goes before the commands.
    pub precompensated: bool,
    /// Trial by trial.
    pub trials: Vec<DesignedTrial>,
    /// How coherence between the axes was looked at, and over which band.
    pub analysis: CoherenceAnalysis,
    /// Coherence of all trials together; null for one axis.
    pub pooled: Option<CoherenceStages>,
    /// Expected motion of a soft and a stiff limb, and of the experiment's own, the largest over the trials.
    pub motion: Vec<Motion>,
    /// How long to measure for the wanted intervals (`target_ci`).
    pub length: Option<LengthPlan>,
}

impl DesignResult {
    /// The schema's name.
    pub const SCHEMA: &str = "ndof/design/1";
}

/// One trial's perturbation.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct DesignedTrial {
    /// The seed it was drawn from.
    pub seed: Option<u64>,
    /// Axis by axis.
    pub signals: Vec<DesignedSignal>,
    /// Largest coherence between the axes that seeds give by chance: the median over those tried.
    pub chance: Number,
    /// Coherence between the axes of this trial by itself; null for one axis and for multisines.
    pub coherence: Option<CoherenceStages>,
}

/// The command of one axis.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct DesignedSignal {
    /// The axis.
    pub axis: String,
    /// Root mean square.
    pub rms: f64,
    /// Largest magnitude.
    pub peak: f64,
    /// Peak over root mean square.
    pub crest_factor: Number,
    /// Largest change per second.
    pub slew_per_s: f64,
    /// Share of its power within the band of `analysis`.
    pub power_share: f64,
    /// Root mean square of the force that the linear model delivers for it.
    pub delivered_rms: Number,
}

/// How coherence between the axes was looked at.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct CoherenceAnalysis {
    /// `welch`, or `lines` of a multisine.
    pub name: String,
    /// Samples in a segment, or in a period.
    pub nperseg: usize,
    /// Samples that neighbours share.
    pub noverlap: usize,
    /// Length of the transform.
    pub nfft: usize,
    /// The band (Hz).
    pub band_hz: [f64; 2],
}

/// Coherence of each axis with all others together, at the stages on the way to the limb.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct CoherenceStages {
    /// Between the commands.
    pub commanded: CoherenceSize,
    /// Between the forces on the limb that the linear model delivers.
    pub delivered_linear: Option<CoherenceSize>,
    /// Between the forces on the limb that the simulated device delivers, its friction and sensors included.
    pub delivered: Option<CoherenceSize>,
    /// The same with the limb's own force noise, which no design can take out; null where the experiment has none.
    pub delivered_restless: Option<CoherenceSize>,
}

/// Size of a coherence over axes and frequencies of a band.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct CoherenceSize {
    /// The largest.
    pub max: f64,
    /// The mean.
    pub mean: f64,
}

/// Motion to be expected of one axis.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Motion {
    /// `soft`, `nominal` or `stiff`.
    pub limb: String,
    /// The axis.
    pub axis: String,
    /// Root mean square of the displacement (m, rad).
    pub displacement_rms: f64,
    /// Its largest magnitude (m, rad).
    pub displacement_peak: f64,
    /// Largest magnitude of the velocity (m/s, rad/s).
    pub velocity_peak: f64,
}

/// How long to measure.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct LengthPlan {
    /// The intervals that are wanted.
    pub wanted: Vec<WantedInterval>,
    /// Band of the fit (Hz).
    pub band_hz: [f64; 2],
    /// Number of trials that the design has.
    pub trials: usize,
    /// Length of each that gives all wanted intervals (s); null if none does.
    pub duration_s: Number,
    /// Number of trials of the designed length that gives them; null if none does.
    pub trials_of_this_length: Option<usize>,
    /// Half widths of the 95 % intervals that this design itself gives, as shares of the values.
    pub predicted: Vec<PredictedInterval>,
}

/// One wanted interval.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct WantedInterval {
    /// `M`, `B`, `K` (the largest over their diagonals), one entry such as `K_x_y`, or `gain@2` (at 2 Hz, the largest over the
    /// diagonal of the compliance).
    pub what: String,
    /// Half width of the 95 % interval as a share of the value.
    pub half_width: f64,
    /// Effective averages that give it.
    pub effective_averages: Number,
    /// Length of each trial that gives it (s).
    pub duration_s: Number,
}

/// The interval of one parameter to be expected.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct PredictedInterval {
    /// Parameter, or `gain@HZ`.
    pub name: String,
    /// Value of the model.
    pub value: Number,
    /// Half width of the 95 % interval as a share of the value.
    pub half_width: Number,
}
