//! `ndof/fit/1`: a mechanical model with its covariance.

use super::in_time::InTime;
use super::schedule::result::ScheduleResult;
use super::settings::{Fit, FitCost};
use crate::estimate::Estimate;
use crate::nested::Matrix;
use crate::result::{Head, Number, finite, number};
pub use ndof_diagnose::Site;
use ndof_models::{Hold, InertiaDampingStiffness, Width};
use serde::{Deserialize, Serialize};

/// A mechanical model with its covariance.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct FitResult {
    /// Which result this is.
    #[serde(flatten)]
    pub head: Head,
    /// What was asked for; null in files of a version that did not say.
    #[serde(default)]
    pub settings: Option<Asked>,
    /// The model's name.
    pub model: String,
    /// `weighted` or `paper`.
    pub cost: FitCost,
    /// What it was fitted to: `direct` or `derived`, or `file` for a response that was measured elsewhere.
    pub estimate: String,
    /// Inputs of the data.
    pub inputs: Vec<String>,
    /// Where there are more inputs than motions, of each motion the input whose gain is 1: the efforts of all others add to it by their gains,
    /// which are the last of the parameters.
    #[serde(skip_serializing_if = "Vec::is_empty", default)]
    pub reference_inputs: Vec<String>,
    /// Outputs of the data.
    pub outputs: Vec<String>,
    /// The band that was fitted.
    pub band_hz: [f64; 2],
    /// Why it ends where it does; null where it was asked for.
    #[serde(default)]
    pub band_because: Option<String>,
    /// Frequencies of it that were used, four an independent one at most.
    pub frequencies: usize,
    /// What efforts do between their samples; null where that cannot be told or makes no difference: responses from files, imposed motion,
    /// accelerations.
    #[serde(default)]
    pub between_samples: Option<Between>,
    /// Where the width of the intervals comes from: `covariance` of the estimate, `residuals`, `trials` that disagree, or `misfit` of a model that
    /// leaves more than noise.
    #[serde(default)]
    #[cfg_attr(feature = "schema", schemars(with = "String"))]
    pub interval_width: Width,
    /// χ² over degrees of freedom: near one where the model explains all but noise.
    pub chi2_reduced: Number,
    /// All parameters.
    pub parameters: Vec<Parameter>,
    /// The parameters as matrices.
    pub matrices: Matrices,
    /// Variance accounted for, percent, by element of the impedance (the paper's appendix); `null` where the model's
    /// element is identically zero.
    pub vaf: Matrix,
    /// R² over all elements, of gains in decibels of one SI unit as in the paper: it depends on the unit and says little on the
    /// intervals; 1 for the model that is the estimate.
    pub r2: Number,
    /// Of M, B and K in turn whether it is symmetric; with `symmetry` free, of more than one axis.
    #[serde(skip_serializing_if = "Vec::is_empty", default)]
    pub symmetry: Vec<Mirrored>,
    /// The same matrices at the joints, with `kinematics`.
    pub joint: Option<Joint>,
    /// Inertia, damping and stiffness over a schedule, with `schedule`.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub schedule: Option<ScheduleResult>,
    /// The same with force laws, fitted in time, with `law`.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub in_time: Option<InTime>,
    /// The fit by the paper's own cost beside the weighted one, or the other way round; null with more inputs than motions.
    pub other_cost: Option<OtherFit>,
    /// This model against those that are part of it, and with `compare` against every single extension; all by the weighted cost.
    #[serde(skip_serializing_if = "Vec::is_empty", default)]
    pub comparison: Vec<ComparedModel>,
}

impl FitResult {
    /// The schema's name.
    pub const SCHEMA: &str = "ndof/fit/1";

    /// What was found out for the fit and not asked, in words: why the band ends, what forces do between samples, what the intervals come from.
    pub fn remarks(&self) -> Vec<String> {
        let mut out = Vec::new();
        out.extend(self.band_because.as_ref().map(|because| format!("band: {because}")));
        out.extend(self.between_samples.as_ref().and_then(Between::words));
        if !self.reference_inputs.is_empty() {
            let others: Vec<&str> = self.inputs.iter().filter(|input| !self.reference_inputs.contains(input)).map(String::as_str).collect();
            out.push(format!("efforts add up: {} with gain 1, {} with gains that are fitted", self.reference_inputs.join(", "), others.join(", ")));
        }
        out.extend(self.symmetry.iter().map(|of| match of.p_value {
            Some(p) => format!("{} (p = {p:.1e})", of.meaning),
            None => of.meaning.clone(),
        }));
        out.extend(match self.interval_width {
            Width::Covariance => None,
            Width::Residuals => Some("intervals: as wide as the residuals".to_owned()),
            Width::Trials => Some("intervals: as wide as the trials disagree".to_owned()),
            Width::Misfit => Some("intervals: widened by what the model leaves".to_owned()),
        });
        out
    }

    /// All parameters, those at the joints last.
    pub fn all_parameters(&self) -> impl Iterator<Item = &Parameter> {
        self.parameters.iter().chain(self.joint.iter().flat_map(|joint| &joint.parameters))
    }
}

/// Whether a matrix is symmetric, of which that was not assumed: a limb's is as long as nothing in it acts by itself.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Mirrored {
    /// `M`, `B` or `K`.
    pub matrix: String,
    /// `K_x_y` for (K_xy − K_yx)/2: half of what mirrored entries differ by.
    pub half_differences: Vec<Parameter>,
    /// Probability of half differences as large if it were symmetric (χ² test); null where they are not determined.
    pub p_value: Number,
    /// What follows.
    pub meaning: String,
}

/// What efforts do between their samples.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Between {
    /// `band-limited`, `zero` (each value stays until the next), `linear`, or `read-after` and `read-before` (jumps with a held command).
    #[cfg_attr(feature = "schema", schemars(with = "String"))]
    pub hold: Hold,
    /// By how much χ² is less than with any other; null where it was asked for, or where the data do not tell beyond doubt.
    pub chi2_less: Number,
    /// Others that the data do not exclude, where what is unknown of them adds more to the variance of a parameter than there was: intervals hold its
    /// values there too.
    #[serde(skip_serializing_if = "Vec::is_empty", default)]
    #[cfg_attr(feature = "schema", schemars(with = "Vec<String>"))]
    pub also: Vec<Hold>,
}

impl Between {
    /// In words; nothing where it is what everybody assumes.
    fn words(&self) -> Option<String> {
        let what = |hold: Hold| match hold {
            Hold::BandLimited => "a curve without jumps",
            Hold::Zero => "each value stays until the next",
            Hold::Linear => "a straight line from value to value",
            Hold::ReadAfter => "smooth but for the jumps of a held command, read just after each",
            Hold::ReadBefore => "smooth but for the jumps of a held command, read just before each",
        };
        let own = what(self.hold);
        if !self.also.is_empty() {
            let also: Vec<&str> = self.also.iter().map(|hold| what(*hold)).collect();
            let also = also.join(", or ");
            return Some(format!(
                "forces between samples: {own}, or {also}; the data do not tell, and intervals hold the values of all; telling the hold narrows them"
            ));
        }
        let why = self.chi2_less.map_or_else(|| "as asked".to_owned(), |less| format!("χ² is {less:.0} less than otherwise"));
        (self.hold != Hold::BandLimited).then(|| format!("forces between samples: {own} ({why})"))
    }
}

/// What a fit was asked for, and the estimate that it was fitted to.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Asked {
    /// Of the estimate.
    pub estimate: Estimate,
    /// Of the fit.
    pub fit: Fit,
}

/// One model of a comparison on the same data.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct ComparedModel {
    /// The model's name.
    pub model: String,
    /// How many parameters it has.
    pub parameters: usize,
    /// χ² of its fit.
    pub chi2: Number,
    /// χ² over degrees of freedom.
    pub chi2_reduced: Number,
    /// Akaike's criterion; the smaller, the better.
    pub aic: Number,
    /// Schwarz's criterion; the smaller, the better.
    pub bic: Number,
    /// Why it could not be fitted; its numbers are then `null`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub failed: Option<String>,
    /// Against the largest model before it in the list that is part of it; `null` where there is none.
    pub likelihood_ratio: Option<LikelihoodRatio>,
}

/// A likelihood-ratio test.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct LikelihoodRatio {
    /// The smaller model.
    pub against: String,
    /// What the larger one takes off χ².
    pub statistic: Number,
    /// Parameters that it has more.
    pub degrees_of_freedom: usize,
    /// Probability of so much if the smaller model were right, by the law that `law` names.
    pub p_value: Number,
    /// `chi-squared` where the smaller model lies within the larger one (a delay of nothing); `half-at-bound`, the mean of chi-squared with one
    /// degree of freedom fewer and with all, where one parameter is at a bound there (a cut-off as high as can be); `unknown` where other
    /// parameters then have no effect (no mass, no gain): `p_value` is a guide, compare `bic`.
    #[serde(default)]
    pub law: String,
}

/// One parameter.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Parameter {
    /// `K_x_y`: matrix, row axis, column axis; `K` for one axis.
    pub name: String,
    /// SI unit.
    pub unit: String,
    /// Where it acts.
    pub site: Site,
    /// Value.
    pub value: Number,
    /// Standard error.
    pub std_error: Number,
    /// 95 % interval.
    pub ci95: Option<[f64; 2]>,
    /// Whether the data say anything about it.
    pub identifiable: bool,
}

impl Parameter {
    /// Whether it is the stiffness of an axis along itself, as one feels it.
    pub fn is_diagonal_stiffness(&self) -> bool {
        self.name == "K" || self.name.strip_prefix("K_").and_then(|axes| axes.split_once('_')).is_some_and(|(row, column)| row == column)
    }
}

impl From<&ndof_models::Parameter> for Parameter {
    fn from(p: &ndof_models::Parameter) -> Self {
        Parameter {
            name: p.name.clone(),
            unit: p.unit.clone(),
            site: Site { side: "limb".to_owned(), axis: p.site.clone() },
            value: number(p.value),
            std_error: number(p.std_error),
            ci95: finite(p.ci95),
            identifiable: p.identifiable,
        }
    }
}

/// Inertia, damping and stiffness with their standard errors.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[expect(non_snake_case, reason = "the field's own symbols, fixed by the result's schema")]
pub struct Matrices {
    /// Inertia.
    pub M: Matrix,
    /// Damping.
    pub B: Matrix,
    /// Stiffness.
    pub K: Matrix,
    /// Their standard errors.
    pub std_error: MatrixErrors,
    /// Delay of the force channel, where the model has one.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub delay_s: Number,
}

/// Standard errors of the matrices.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[expect(non_snake_case, reason = "the field's own symbols, fixed by the result's schema")]
pub struct MatrixErrors {
    /// Of inertia.
    pub M: Matrix,
    /// Of damping.
    pub B: Matrix,
    /// Of stiffness.
    pub K: Matrix,
}

impl From<InertiaDampingStiffness> for MatrixErrors {
    fn from(errors: InertiaDampingStiffness) -> Self {
        MatrixErrors { M: errors.inertia.into(), B: errors.damping.into(), K: errors.stiffness.into() }
    }
}

/// The matrices at the joints.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[expect(non_snake_case, reason = "the field's own symbols, fixed by the result's schema")]
pub struct Joint {
    /// Joints, in the order of rows and columns.
    pub axes: Vec<String>,
    /// Inertia (kg m²).
    pub M: Matrix,
    /// Damping (N m s/rad).
    pub B: Matrix,
    /// Stiffness (N m/rad).
    pub K: Matrix,
    /// Their standard errors, those of the kinematics included.
    pub std_error: MatrixErrors,
    /// All entries with their intervals.
    pub parameters: Vec<Parameter>,
    /// Joint angles; empty where the kinematics are a Jacobian only.
    pub posture_rad: Vec<f64>,
    /// Rows endpoint axes, columns joints.
    pub jacobian: Matrix,
    /// The stiffness that the mean force makes by the curvature of the kinematics.
    pub geometric_stiffness: Matrix,
    /// Mean force on the hand.
    pub mean_force_n: Vec<f64>,
}

/// The same model fitted by another cost.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct OtherFit {
    /// `weighted` or `paper`.
    pub cost: FitCost,
    /// All parameters.
    pub parameters: Vec<Parameter>,
    /// The parameters as matrices.
    pub matrices: Matrices,
    /// Variance accounted for, percent.
    pub vaf: Matrix,
    /// R² over all elements, of gains in decibels of one SI unit as in the paper: it depends on the unit and says little on the
    /// intervals; 1 for the model that is the estimate.
    pub r2: Number,
}

/// One line of the table: a parameter, what was simulated and what was found.
#[derive(Clone, Debug, PartialEq)]
pub struct ComparedParameter {
    /// Its name.
    pub name: String,
    /// SI unit.
    pub unit: String,
    /// What was simulated, if that is known.
    pub truth: Option<f64>,
    /// What was found.
    pub value: Option<f64>,
    /// 95 % interval.
    pub ci95: Option<[f64; 2]>,
    /// Whether the data say anything about it.
    pub identifiable: bool,
}

impl ComparedParameter {
    /// One whose truth nobody knows.
    pub fn unknown(p: &Parameter) -> Self {
        ComparedParameter { name: p.name.clone(), unit: p.unit.clone(), truth: None, value: p.value, ci95: p.ci95, identifiable: p.identifiable }
    }
}
