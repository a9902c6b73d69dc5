//! Inertia, damping and stiffness over a schedule, as part of `ndof/fit/1`.

use crate::result::Number;
use ndof_models::schedule::Term;
use serde::{Deserialize, Serialize};

/// Inertia, damping and stiffness over a schedule.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct ScheduleResult {
    /// `phase`, `time` or the channel.
    pub schedule: String,
    /// Its unit; empty for a phase, which goes from 0 to 1.
    pub unit: String,
    /// Where the curves are given.
    pub at: Vec<f64>,
    /// Duration of a cycle, the median one; null where there are none.
    pub cycle_s: Number,
    /// Cycles, or pieces of the trials where there are none.
    pub blocks: usize,
    /// Upper end of the band: the regression takes everything below it.
    pub high_hz: f64,
    /// Samples within the band that were used.
    pub samples: usize,
    /// Order of the autoregression of each effort's errors.
    pub noise_order: Vec<usize>,
    /// Share of each motion's variance that the commanded force foretells, where that is the instrument; null where the motion counts as
    /// imposed.
    pub command_share: Option<Vec<Number>>,
    /// Every entry of the matrices, without an assumption of symmetry.
    pub entries: Vec<ScheduleEntry>,
    /// The same at the joints, in the posture that the mean movement has at each place; empty without kinematics.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub joint: Vec<ScheduleEntry>,
    /// Whether each matrix varies at all.
    pub tests: Vec<VariationTest>,
    /// Variance accounted for of the deviation from the mean movement, within the band, of cycles (or pieces) that the fit has not seen.
    pub held_out: Vec<HeldOutShare>,
    /// The mean movement within the band.
    pub mean_movement: Vec<MeanChannel>,
}

/// One entry of a matrix over the schedule.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct ScheduleEntry {
    /// `K_x_y`: matrix, row axis, column axis; `K` for one axis.
    pub name: String,
    /// SI unit.
    pub unit: String,
    /// Whether it was let vary.
    pub varies: bool,
    /// Value at each place.
    pub value: Vec<f64>,
    /// Standard error at each place.
    pub std_error: Vec<f64>,
    /// Lower and upper end of the 95 % interval at each place by itself.
    pub ci95: [Vec<f64>; 2],
    /// Lower and upper end of the band that holds the whole curve with 95 %.
    pub band95: [Vec<f64>; 2],
    /// Effective number of coefficients; 1 for a constant.
    pub degrees_of_freedom: f64,
    /// What was simulated, in a study.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub truth: Option<Vec<f64>>,
}

/// Whether a matrix varies at all.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct VariationTest {
    /// `stiffness`, `damping` or `inertia`.
    #[cfg_attr(feature = "schema", schemars(with = "String"))]
    pub matrix: Term,
    /// Probability of so much variation if it were constant; 1e-9 for anything below.
    pub p_value: Number,
}

/// What is explained of an effort's deviation from the mean movement on data that were held out.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct HeldOutShare {
    /// The effort.
    pub channel: String,
    /// By constant matrices, percent.
    pub constant_vaf: Number,
    /// By those that vary, percent.
    pub varying_vaf: Number,
}

/// The mean of a channel over the schedule.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct MeanChannel {
    /// The channel.
    pub channel: String,
    /// Its unit.
    pub unit: String,
    /// Value at each place.
    pub value: Vec<f64>,
}

impl ScheduleEntry {
    /// Share of the places at which the 95 % interval holds what was simulated; nothing where that is not known.
    pub fn holds(&self) -> Option<f64> {
        let truth = self.truth.as_ref()?;
        let held = (0..truth.len()).filter(|k| (self.ci95[0][*k]..=self.ci95[1][*k]).contains(&truth[*k])).count();
        Some(held as f64 / truth.len() as f64)
    }
}

impl ScheduleResult {
    /// What the abscissa is called.
    pub fn label(&self) -> String {
        match self.schedule.as_str() {
            "phase" => "Phase of the cycle".to_owned(),
            "time" => "Time".to_owned(),
            channel => channel.to_owned(),
        }
    }
}
