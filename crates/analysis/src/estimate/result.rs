//! `ndof/estimate/1`: a frequency response with its coherences and confidence.

use super::settings::Estimate;
use crate::nested::{IntervalSpectrum, Matrix, Spectrum};
use crate::result::{Head, Number, number};
use ndarray::{Array2, Array3, Array4};
use ndof_signal::Detrend;
use ndof_sysid::{FrequencyResponse, GainPhase, ResponseKind};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// A frequency response with its coherences and confidence.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct EstimateResult {
    /// Which result this is.
    #[serde(flatten)]
    pub head: Head,
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
    /// What was asked for.
    #[serde(default)]
    pub settings: Estimate,
    /// `compliance`, `dynamic-stiffness`, `impedance`, `admittance`, or `transfer` where the channels are not mechanical.
    #[cfg_attr(feature = "schema", schemars(with = "String"))]
    pub response: ResponseKind,
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
    /// Segments that were left out, with `robust`.
    pub robust: Option<Robust>,
    /// The spread between trials beside that within them, of two trials or more.
    pub trial_spread: Option<TrialSpread>,
    /// Estimates over a window that slides along the trials, with `sliding`, or along the cycle, with `cycle`.
    pub course: Option<Course>,
    /// Densities of all channels, with `spectra`.
    pub spectra: Option<Spectra>,
}

impl EstimateResult {
    /// The schema's name.
    pub const SCHEMA: &str = "ndof/estimate/1";
}

/// SI units of the channels, in the order of their names.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Units {
    /// Of the inputs.
    pub inputs: Vec<String>,
    /// Of the outputs.
    pub outputs: Vec<String>,
    /// Of the references.
    pub references: Vec<String>,
}

impl Units {
    /// Whether the inputs or the outputs are torques or angles.
    pub fn are_rotational(&self) -> bool {
        self.inputs.iter().chain(&self.outputs).any(|unit| unit == "N m" || unit.starts_with("rad"))
    }
}

/// How the spectra were estimated; a setting that the method does not have is `null`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Method {
    /// `welch`, `multitaper`, `local-polynomial`, `local-rational` or `periodic`.
    pub name: String,
    /// Why this method and these settings.
    pub why: String,
    /// `h1`, `h2` or `hv`.
    #[cfg_attr(feature = "schema", schemars(with = "String"))]
    pub estimator: ndof_sysid::Direct,
    /// Samples in a segment.
    pub nperseg: Option<usize>,
    /// Samples that neighbours share.
    pub noverlap: Option<usize>,
    /// Length of the transform.
    pub nfft: Option<usize>,
    /// Data window.
    pub window: Option<String>,
    /// Symmetric window in place of the periodic one.
    pub window_symmetric: Option<bool>,
    /// What is removed from each segment.
    #[cfg_attr(feature = "schema", schemars(with = "Option<String>"))]
    pub detrend: Option<Detrend>,
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
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
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

/// `[f][p][q]` at the bins `keep` as `[p][q][f]`.
pub(super) fn spectrum(values: &Array3<f64>, keep: &[usize]) -> Spectrum {
    let (_, p, q) = values.dim();
    Array3::from_shape_fn((p, q, keep.len()), |(i, j, f)| values[[keep[f], i, j]]).into()
}

impl From<&FrequencyResponse> for Response {
    fn from(response: &FrequencyResponse) -> Self {
        let (p, q) = response.shape();
        let shape = (p, q, response.len());
        let entries: Vec<Vec<GainPhase>> = (0..p * q).into_par_iter().map(|e| response.gain_phase(e / q, e % q, 0.95)).collect();
        let of = |value: &dyn Fn(&GainPhase) -> f64| Array3::from_shape_fn(shape, |(i, j, f)| value(&entries[i * q + j][f])).into();
        let ends = |interval: &dyn Fn(&GainPhase) -> Option<[f64; 2]>| {
            let end = |(i, j, f, end): (usize, usize, usize, usize)| interval(&entries[i * q + j][f]).map_or(f64::NAN, |ends| ends[end]);
            Array4::from_shape_fn((p, q, response.len(), 2), end).into()
        };
        Response {
            re: Array3::from_shape_fn(shape, |(i, j, f)| response.value[[f, i, j]].re).into(),
            im: Array3::from_shape_fn(shape, |(i, j, f)| response.value[[f, i, j]].im).into(),
            gain_std_error: of(&|entry| entry.gain_std_error),
            phase_std_error_rad: of(&|entry| entry.phase_std_error_rad),
            gain_ci95: ends(&|entry| Some(entry.gain_interval)),
            phase_ci95_rad: ends(&|entry| entry.phase_interval_rad),
        }
    }
}

impl Response {
    /// The magnitude.
    pub fn gain(&self) -> Array3<f64> {
        ndarray::Zip::from(&*self.re).and(&*self.im).map_collect(|re, im| re.hypot(*im))
    }

    /// The phase, in radians.
    pub fn phase_rad(&self) -> Array3<f64> {
        ndarray::Zip::from(&*self.re).and(&*self.im).map_collect(|re, im| im.atan2(*re))
    }
}

/// A response that changes with time, or over a cycle; arrays by window first.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Course {
    /// Length of the window.
    pub window_s: f64,
    /// From one window to the next.
    pub step_s: f64,
    /// `direct` or `derived`.
    pub estimate: String,
    /// The spectral method within each window.
    pub method: String,
    /// Duration of a cycle, where the windows lie about the same phase of all cycles.
    pub cycle_s: Option<f64>,
    /// How many cycles there are.
    pub cycles: Option<usize>,
    /// Middle of each window since the trials' beginning, or the cycle's.
    pub time_s: Vec<f64>,
    /// Independent averages in each window.
    pub effective_averages: Vec<Number>,
    /// The grid within each window.
    pub frequency_hz: Vec<f64>,
    /// One response a window.
    pub response: Vec<Response>,
    /// Of all inputs with one output as they were measured, `[output][frequency]`, one a window.
    pub multiple_coherence: Vec<Matrix>,
}

impl Course {
    /// Frequencies above zero at which most windows have a gain whose interval does not reach zero, in any entry.
    pub fn known(&self) -> Vec<usize> {
        let entries = || self.response.first().into_iter().flat_map(|r| ndarray::indices((r.re.dim().0, r.re.dim().1)));
        let most = |(i, j): (usize, usize), f: usize| 2 * self.response.iter().filter(|r| r.gain_ci95[[i, j, f, 0]] > 0.0).count() >= self.response.len();
        (0..self.frequency_hz.len()).filter(|&f| self.frequency_hz[f] > 0.0 && entries().into_iter().any(|entry| most(entry, f))).collect()
    }
}

/// Magnitude-squared coherences.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Coherence {
    /// Between one output and one input.
    pub ordinary: Spectrum,
    /// Of one input with one output, all other inputs given.
    pub partial: Spectrum,
    /// Of one input with one output, the inputs before it given (ordered conditioning of Bendat & Piersol, in the order of
    /// `inputs`).
    pub ordered: Spectrum,
    /// Of all inputs with one output, `[output][frequency]`.
    pub multiple: Matrix,
}

impl Coherence {
    /// Those of the response `of` at the bins `keep`, with the inputs that the covariance of `inputs` knows.
    pub(super) fn new(c: &ndof_sysid::Coherence, of: &FrequencyResponse, inputs: &FrequencyResponse, keep: &[usize]) -> Self {
        let ordered = inputs.uncertainty.as_ref().filter(|_| !keep.is_empty()).map(|u| ndof_sysid::ordered_coherence(of, &u.input_inverse, &c.multiple));
        let (p, q) = of.shape();
        Coherence {
            ordinary: spectrum(&c.ordinary, keep),
            partial: spectrum(&c.partial, keep),
            ordered: ordered.map_or_else(|| Array3::from_elem((p, q, keep.len()), f64::NAN).into(), |ordered| spectrum(&ordered, keep)),
            multiple: by_output(&c.multiple, keep),
        }
    }

    /// Those that do not exist.
    pub(super) fn unknown(p: usize, q: usize, frequencies: usize) -> Self {
        let none = || Spectrum::from(Array3::from_elem((p, q, frequencies), f64::NAN));
        Coherence { ordinary: none(), partial: none(), ordered: none(), multiple: Array2::from_elem((p, frequencies), f64::NAN).into() }
    }
}

/// What is `[frequency][output]`, output first, at the bins `keep`.
pub(super) fn by_output(values: &Array2<f64>, keep: &[usize]) -> Matrix {
    Array2::from_shape_fn((values.ncols(), keep.len()), |(i, f)| values[[keep[f], i]]).into()
}

/// The direct estimate.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Direct {
    /// The response.
    #[serde(flatten)]
    pub response: Response,
    /// Its coherences.
    pub coherence: Coherence,
}

/// The derived estimate.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
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
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Significance {
    /// Of ordinary coherence.
    pub ordinary: Number,
    /// Of partial coherence.
    pub partial: Number,
    /// Of multiple coherence.
    pub multiple: Number,
}

/// Standard deviations that periodic excitation tells apart, `[output][input][frequency]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
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

impl Distortion {
    pub(super) fn new(d: &ndof_sysid::Distortion, keep: &[usize]) -> Self {
        Distortion {
            noise_std: spectrum(&d.noise_std, keep),
            nonlinear_std: spectrum(&d.nonlinear_std, keep),
            even_std: spectrum(&d.even_std, keep),
            odd_std: spectrum(&d.odd_std, keep),
            detection: d.detection.iter().map(Detection::from).collect(),
        }
    }
}

/// What appears at the lines that a multisine leaves out.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
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

impl From<&ndof_sysid::Detection> for Detection {
    fn from(d: &ndof_sysid::Detection) -> Self {
        Detection {
            even: d.even,
            lines: d.lines,
            level_db: d.level_db.iter().map(|v| number(*v)).collect(),
            noise_db: d.noise_db.iter().map(|v| number(*v)).collect(),
            probability: number(d.probability),
            lambda_limb: number(d.lambda_limb),
            lambda_robot: number(d.lambda_robot),
        }
    }
}

/// Coherences of the data as measured.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
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
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Robust {
    /// Segments of all trials.
    pub segments: usize,
    /// Those that were left out.
    pub rejected: Vec<RejectedSegment>,
}

/// A segment that was left out.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
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
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
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

/// Densities, `S[a][b]` = ⟨A B*⟩, one-sided, unit_a · unit_b / Hz.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Spectra {
    /// Rows and columns: references, inputs, outputs.
    pub channels: Vec<String>,
    /// Real part.
    pub re: Spectrum,
    /// Imaginary part.
    pub im: Spectrum,
}
