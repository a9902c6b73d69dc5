//! `ndof/study-result/1`: every case of a study beside what was simulated.

use ndof_analysis::result::{Head, Number};
use serde::{Deserialize, Serialize};

/// Every case of a study beside what was simulated.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct StudyResult {
    /// Which result this is.
    #[serde(flatten)]
    pub head: Head,
    /// The cases, in the study's order; one without a name where the study has none.
    pub cases: Vec<Case>,
    /// How parameters change from each case to the next, where the study asks for it.
    pub steps: Vec<Step>,
}

impl StudyResult {
    /// The schema's name.
    pub const SCHEMA: &str = "ndof/study-result/1";
}

/// One case.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Case {
    /// Its name.
    pub name: String,
    /// Repeated trials.
    pub trials: usize,
    /// Endpoint axes, in the order of all matrices.
    pub axes: Vec<String>,
    /// Where the endpoint was on average over the last quarter of the trials, from the posture (m, rad).
    pub displacement: Vec<Number>,
    /// Length of that vector.
    pub distance: Number,
    /// What each setting of the estimate gave.
    pub settings: Vec<Setting>,
}

/// What one setting of the estimate gave.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Setting {
    /// Its name.
    pub name: String,
    /// The spectral method.
    pub method: String,
    /// Segments of one trial; nothing where the method has none.
    pub segments_per_trial: Option<usize>,
    /// Effective averages over all trials.
    pub effective_averages: Number,
    /// Fitted parameters with their truth.
    pub parameters: Vec<Parameter>,
    /// ‖X̂ − X‖/‖X‖ of the fitted matrices.
    pub relative_error: Option<MatrixNumbers>,
    /// Agreement of each estimate with the linearised plant, band by band.
    pub agreement: Vec<BandAgreement>,
    /// The stiffness ellipse, of two translational axes.
    pub ellipse: Option<Ellipse>,
    /// What feedback through the hold does at low frequencies.
    pub low_band: LowBand,
}

/// A parameter beside its truth.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Parameter {
    /// `K_x_y`.
    pub name: String,
    /// SI unit.
    pub unit: String,
    /// What was simulated.
    pub truth: Number,
    /// What was found.
    pub value: Number,
    /// Standard error.
    pub std_error: Number,
    /// 95 % interval.
    pub ci95: Option<[f64; 2]>,
    /// Whether the interval holds the truth.
    pub holds: Option<bool>,
}

/// One number a matrix.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[expect(non_snake_case, reason = "the field's own symbols")]
pub struct MatrixNumbers {
    /// Of inertia.
    pub M: Number,
    /// Of damping.
    pub B: Number,
    /// Of stiffness.
    pub K: Number,
}

/// VAF and R² of an estimate against the linearised plant with its transducer (Palazzolo et al. 2007, appendix).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct BandAgreement {
    /// `direct` or `derived`.
    pub estimate: String,
    /// The band.
    pub band_hz: [f64; 2],
    /// Percent, `[output][input]`; nothing where the plant's element is zero.
    pub vaf: Vec<Vec<Number>>,
    /// Over all elements.
    pub r2: Number,
    /// Mean partial coherence in the band, `[output][input]`.
    pub partial_coherence: Vec<Vec<Number>>,
    /// Mean share of the element's own size that its standard error is, `[output][input]`: about one where the data say nothing.
    pub relative_error: Vec<Vec<Number>>,
}

/// A number with its interval and its truth.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Compared {
    /// What was simulated.
    pub truth: Number,
    /// What was found.
    pub value: Number,
    /// 95 % interval.
    pub ci95: Option<[f64; 2]>,
}

/// The stiffness ellipse.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Ellipse {
    /// Larger half axis (N/m).
    pub major: Compared,
    /// Smaller half axis (N/m).
    pub minor: Compared,
    /// Direction of the larger, from x, within ±90°; nothing where the truth is a circle.
    pub orientation_deg: Option<Compared>,
    /// Larger over smaller; the interval reaches 1 where the data allow a circle.
    pub axis_ratio: Compared,
}

/// Coherence between the inputs and errors of the compliance at low frequencies.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct LowBand {
    /// The band.
    pub band_hz: [f64; 2],
    /// Mean over frequency of the largest coherence between two inputs.
    pub input_coherence_mean: Number,
    /// Its largest value.
    pub input_coherence_max: Number,
    /// What chance alone stays below at one frequency.
    pub significance_95: Number,
    /// ‖Ĉ − C‖/‖C‖ of the direct estimate.
    pub direct_error: Number,
    /// Of the derived one.
    pub derived_error: Number,
}

/// A parameter's change from one case to the next.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Step {
    /// The earlier case.
    pub from: String,
    /// The later.
    pub to: String,
    /// The setting of the estimate.
    pub setting: String,
    /// The parameter.
    pub parameter: String,
    /// SI unit.
    pub unit: String,
    /// Later less earlier.
    pub change: Compared,
    /// Change over its standard error.
    pub z: Number,
}
