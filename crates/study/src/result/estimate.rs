//! `ndof/estimate/1`: a frequency response with its coherences and confidence.

use super::{Number, Warning};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Values by output, input and frequency.
pub type Spectrum = Vec<Vec<Vec<Number>>>;

/// Intervals by output, input and frequency; `null` where there is none (of a phase: the full circle).
pub type IntervalSpectrum = Vec<Vec<Vec<Option<[f64; 2]>>>>;

/// The schema's name.
pub const SCHEMA: &str = "ndof/estimate/1";

/// A frequency response with its coherences and confidence.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct EstimateResult {
    /// `ndof/estimate/1`.
    pub schema: String,
    /// The version that wrote it.
    pub ndof_version: String,
    /// The subcommand.
    pub command: String,
    /// What the reader should know.
    pub warnings: Vec<Warning>,
    /// Sample rate of the recordings.
    pub sample_rate_hz: f64,
    /// Number of trials (stretches of record) pooled.
    pub trials: usize,
    /// Columns of the response.
    pub inputs: Vec<String>,
    /// Rows of the response.
    pub outputs: Vec<String>,
    /// Signals commanded from outside.
    pub references: Vec<String>,
    /// SI units of inputs, outputs and references.
    pub units: Units,
    /// How it was estimated.
    pub method: Method,
    /// `compliance`, `dynamic-stiffness`, `impedance`, `admittance`, or `transfer` where the channels are not mechanical.
    pub response: String,
    /// The grid.
    pub frequency_hz: Vec<f64>,
    /// From inputs to outputs as measured.
    pub direct: Direct,
    /// Through the references: R T⁻¹, free of the bias that feedback makes. Absent without references.
    pub derived: Option<Derived>,
    /// Coherence that chance alone exceeds once in twenty.
    pub significance_95: Significance,
    /// Magnitude-squared coherence between inputs, `[input][input][frequency]`.
    pub input_coherence: Spectrum,
    /// Condition number of the inputs' matrix, each scaled to unit power.
    pub input_condition_number: Vec<Number>,
    /// Coherences of the channels as they were measured, where the response was inverted: those above are then of the inverse
    /// direction, and `null` where that has none.
    pub measured_direction: Option<MeasuredDirection>,
    /// Noise against nonlinear distortion, of periodic excitation.
    pub distortion: Option<Distortion>,
    /// Segments that were left out, with `--robust`.
    pub robust: Option<Robust>,
    /// The spread between trials beside that within them, of two trials or more.
    pub trial_spread: Option<TrialSpread>,
    /// Estimates over a window that slides along the trials, with `--sliding`.
    pub course: Option<Course>,
    /// Densities of all channels, with `--spectra`.
    pub spectra: Option<Spectra>,
}

/// SI units of the channels, in the order of their names.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Units {
    /// Of the inputs.
    pub inputs: Vec<String>,
    /// Of the outputs.
    pub outputs: Vec<String>,
    /// Of the references.
    pub references: Vec<String>,
}

/// How the spectra were estimated; a setting that the method does not have is `null`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Method {
    /// `welch`, `multitaper`, `local-polynomial`, `local-rational` or `periodic`.
    pub name: String,
    /// Why this method and these settings.
    pub why: String,
    /// `h1`, `h2` or `hv`.
    pub estimator: String,
    /// Samples in a segment.
    pub nperseg: Option<usize>,
    /// Samples that neighbours share.
    pub noverlap: Option<usize>,
    /// Length of the transform.
    pub nfft: Option<usize>,
    /// Data window.
    pub window: Option<String>,
    /// Symmetric instead of periodic window.
    pub window_symmetric: Option<bool>,
    /// What is taken off each segment.
    pub detrend: Option<String>,
    /// Half-width of the multitaper's spectral window, in units of 1/T.
    pub time_bandwidth: Option<f64>,
    /// Number of tapers, where it was given.
    pub tapers: Option<usize>,
    /// Whether the tapers are weighted adaptively.
    pub adaptive: Option<bool>,
    /// Degree of the local polynomials.
    pub order: Option<usize>,
    /// Degree of the local rational method's denominators.
    pub denominator: Option<usize>,
    /// Lines on each side of each line that the local methods look at, where it was given.
    pub half_width: Option<usize>,
    /// Samples in a period of the excitation.
    pub period: Option<usize>,
    /// Segments (tapers, periods) averaged over all trials.
    pub segments: usize,
    /// Independent averages that they are worth, over all trials.
    pub effective_averages: f64,
    /// Bins closer than this are correlated.
    pub independent_spacing_hz: f64,
    /// The band that the arrays are cut to.
    pub band_hz: Option<[f64; 2]>,
}

/// A response with standard errors and 95 % intervals.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Response {
    /// Real part.
    pub re: Spectrum,
    /// Imaginary part.
    pub im: Spectrum,
    /// Of the magnitude, in the response's unit.
    pub gain_std_error: Spectrum,
    /// Of the phase.
    pub phase_std_error_rad: Spectrum,
    /// Of the magnitude.
    pub gain_ci95: IntervalSpectrum,
    /// Of the phase; `null` is the full circle.
    pub phase_ci95_rad: IntervalSpectrum,
}

/// Magnitude-squared coherences.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Coherence {
    /// Between one output and one input.
    pub ordinary: Spectrum,
    /// Of one input with one output, all other inputs given.
    pub partial: Spectrum,
    /// Of one input with one output, the inputs before it given (ordered conditioning of Bendat & Piersol, in the order of
    /// `inputs`).
    pub ordered: Spectrum,
    /// Of all inputs with one output, `[output][frequency]`.
    pub multiple: Vec<Vec<Number>>,
}

/// The direct estimate.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Direct {
    /// The response.
    #[serde(flatten)]
    pub response: Response,
    /// Its coherences.
    pub coherence: Coherence,
}

/// The derived estimate.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Derived {
    /// The response.
    #[serde(flatten)]
    pub response: Response,
    /// Coherences under the paper's assumption: the noise of the direct estimate.
    pub coherence_paper: Coherence,
    /// Coherences consistent with the instrumental-variable noise.
    pub coherence_iv: Coherence,
}

/// Coherence that chance alone exceeds once in twenty.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Significance {
    /// Of ordinary coherence.
    pub ordinary: Number,
    /// Of partial coherence.
    pub partial: Number,
    /// Of multiple coherence.
    pub multiple: Number,
}

/// Standard deviations that periodic excitation tells apart, `[output][input][frequency]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Distortion {
    /// What does not repeat.
    pub noise_std: Spectrum,
    /// What repeats and is not linear.
    pub nonlinear_std: Spectrum,
    /// Its even part.
    pub even_std: Spectrum,
    /// Its odd part.
    pub odd_std: Spectrum,
    /// What appears at lines that were not driven; empty where all were.
    pub detection: Vec<Detection>,
}

/// What appears at the lines that a multisine leaves out.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Detection {
    /// Even multiples of the fundamental (x², offset), or odd ones (friction, x³).
    pub even: bool,
    /// How many lines.
    pub lines: usize,
    /// Power of each output there over that at the driven lines, noise subtracted; `null` where noise explains all of it.
    pub level_db: Vec<Number>,
    /// The noise's share of the same.
    pub noise_db: Vec<Number>,
    /// Probability that noise alone gives as much.
    pub probability: Number,
    /// λ_h: near 0 where the distortion is the robot's. `null` where nothing stands out.
    pub lambda_limb: Number,
    /// λ_r: near 0 where the distortion is the limb's. `null` without references.
    pub lambda_robot: Number,
}

/// Coherences of the data as measured.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct MeasuredDirection {
    /// Columns.
    pub inputs: Vec<String>,
    /// Rows.
    pub outputs: Vec<String>,
    /// Of the direct estimate.
    pub direct: Coherence,
    /// Of the derived estimate under the paper's assumption.
    pub derived_paper: Option<Coherence>,
    /// Of the derived estimate, consistent with the instrumental-variable noise.
    pub derived_iv: Option<Coherence>,
}

/// What a robust estimate left out.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Robust {
    /// Segments of all trials.
    pub segments: usize,
    /// Those that were left out.
    pub rejected: Vec<RejectedSegment>,
}

/// A segment that was left out.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct RejectedSegment {
    /// Number of the trial, from 1.
    pub trial: usize,
    /// Its first second.
    pub start_s: f64,
    /// Its end.
    pub end_s: f64,
    /// Its residual above the usual one, in robust standard deviations of its logarithm.
    pub residual: Number,
    /// The power of what drives above the usual one, in the same measure.
    pub leverage: Number,
}

/// Standard deviations of the mean over trials, `[output][input][frequency]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct TrialSpread {
    /// From the scatter between trials.
    pub between: Spectrum,
    /// As each trial's own noise predicts it.
    pub within: Spectrum,
    /// Between over within, over the band and all entries: 1 where a trial is like the next.
    pub ratio: Number,
    /// The standard error of that ratio by chance.
    pub ratio_std_error: Number,
}

/// A response that changes with time; arrays by window first.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Course {
    /// Length of the window.
    pub window_s: f64,
    /// From one window to the next.
    pub step_s: f64,
    /// `direct` or `derived`.
    pub estimate: String,
    /// The spectral method within each window.
    pub method: String,
    /// Middle of each window.
    pub time_s: Vec<f64>,
    /// The grid within each window.
    pub frequency_hz: Vec<f64>,
    /// One response a window.
    pub response: Vec<Response>,
}

/// Densities, `S[a][b]` = ⟨A B*⟩, one-sided, unit_a · unit_b / Hz.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Spectra {
    /// Rows and columns: references, inputs, outputs.
    pub channels: Vec<String>,
    /// Real part.
    pub re: Spectrum,
    /// Imaginary part.
    pub im: Spectrum,
}
