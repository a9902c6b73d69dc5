//! A response to a mechanical model with its covariance.

mod between;
mod evidence;
mod findings;
mod fitted;
pub mod in_time;
mod named_models;
mod overlay;
mod project;
pub mod result;
pub mod schedule;
pub(crate) mod settings;
mod sides;
mod signs;
mod starts;
mod sums;
mod ticks;

pub use fitted::Fitted;
pub use named_models::MODEL;
pub use overlay::{Leftover, Overlay, Run, leftover, overlay};
pub use project::project;
pub(crate) use project::projection;
pub use result::ComparedParameter;
pub use settings::{Fit, FitCost, VafWeight};
pub(crate) use signs::turned_round;

use crate::error::AnalysisError;
use crate::estimate::Estimated;
use crate::response::MeasuredResponse;
use crate::result::{Head, finite, number};
use crate::trials::{Trials, axis_of};
use between::sampled;
use evidence::Evidence;
use findings::warnings;
use named_models::{blocks_of, compared_models};
use ndarray::Array3;
use ndof_models::blocks::{BlockCard, Composite};
use ndof_models::physical::{Antisymmetric, Derived, SymmetryTest, symmetry_test};
use ndof_models::{
    Axis, Held, InertiaDampingStiffness, InertiaDampingStiffnessModel, PaperFit, ParameterInfo, ParametricModel, Symmetry, WeightedFit, agreement,
    parametric_response,
};
use ndof_signal::Unit;
use ndof_sysid::{FrequencyResponse, ResponseKind};
use result::{Asked, FitResult, Joint, Matrices, Mirrored, OtherFit, Parameter, Site};
use sums::Sums;

/// What is added in quadrature to standard errors for systematic errors: 0.5 % of inertia, 1 % of damping and of stiffness.
pub const FLOORS: [(char, f64); 3] = [('M', 0.005), ('B', 0.01), ('K', 0.01)];
/// The same for delays.
pub const DELAY_FLOOR_S: f64 = 1e-4;

/// Fits inertia, damping and stiffness to an estimate: to the derived one where there is one.
///
/// # Errors
/// [`AnalysisError`] if the response is not square or not mechanical, or the band holds too little.
///
/// ```
/// use ndof_analysis::{Estimate, Fit, Trial};
/// use ndof_signal::FilteredNoise;
///
/// // 2 kg, 12 N s/m, 300 N/m, pushed by noise of 4 N rms for 40 s; both channels are means over each interval.
/// let force = FilteredNoise { axes: 1, samples: 20_000, rms: 4.0, ..FilteredNoise::default() }.generate(1)?.remove(0);
/// let (mut x, mut v) = (0.0, 0.0);
/// let mut step = |f: f64| {
///     v += (f - 12.0 * v - 300.0 * x) / 2.0 * 1e-4;
///     x += v * 1e-4;
///     x
/// };
/// let motion: Vec<f64> = force.iter().map(|f| (0..20).map(|_| step(*f)).sum::<f64>() / 20.0).collect();
/// let trial = Trial::new(500.0).effort("x", force).displacement("x", motion)?;
/// let estimated = Estimate::welch(1024).run([&trial])?;
/// let fitted = Fit { band_hz: Some([0.5, 10.0]), ..Fit::default() }.run(&estimated)?;
/// assert!((fitted.matrices.stiffness[[0, 0]] - 300.0).abs() < 15.0); // N/m
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn fit(estimated: &Estimated, settings: &Fit) -> Result<Fitted, AnalysisError> {
    let evidence = Evidence::of_recordings(estimated, settings.band_hz)?;
    let mut fitted = fit_to(&evidence, settings)?;
    if let Some((opposed, warning)) = signs::opposed(estimated, settings, &fitted) {
        fitted.opposed = opposed;
        // It says why.
        fitted.result.head.warnings.retain(|warning| warning.code != "negative-diagonal");
        fitted.result.head.warnings.push(warning);
    }
    if let Some((schedule, warnings)) = schedule::scheduled(&estimated.trials, settings, evidence.band_hz[1])? {
        fitted.result.head.warnings.extend(warnings);
        fitted.result.schedule = Some(schedule);
    }
    if let Some((in_time, warnings)) = in_time::in_time(&estimated.trials, settings, &fitted)? {
        fitted.result.head.warnings.extend(warnings);
        fitted.result.in_time = Some(in_time);
    }
    Ok(fitted)
}

/// The same to a response that was measured elsewhere.
///
/// Where the file does not tell the size of its errors, intervals follow from what the model leaves, and neither χ² nor a comparison of
/// models exists.
///
/// # Errors
/// As [`fit`]; [`AnalysisError::ErrorsUnknown`] where models are to be compared without known errors.
///
/// ```
/// use ndof_analysis::{Fit, MeasuredResponse, fit_response};
/// use ndof_io::ResponseTable;
/// use num_complex::Complex;
///
/// let frequency_hz: Vec<f64> = (1..60).map(|k| 0.2 * k as f64).collect();
/// let compliance = |hz: &f64| 1.0 / Complex::new(300.0 - 2.0 * (6.283185307179586 * hz).powi(2), 12.0 * 6.283185307179586 * hz);
/// let table = ResponseTable {
///     outputs: vec!["pos_x".into()],
///     inputs: vec!["force_x".into()],
///     output_units: vec!["m".into()],
///     input_units: vec!["N".into()],
///     values: vec![vec![frequency_hz.iter().map(compliance).collect()]],
///     frequency_hz,
///     ..ResponseTable::default()
/// };
/// let fitted = fit_response(&MeasuredResponse::of(&table, "frf.csv")?, &Fit::default())?;
/// assert!((fitted.matrices.stiffness[[0, 0]] - 300.0).abs() < 1e-6);
/// # Ok::<(), ndof_analysis::AnalysisError>(())
/// ```
pub fn fit_response(measured: &MeasuredResponse, settings: &Fit) -> Result<Fitted, AnalysisError> {
    if !measured.errors_known && (settings.compare || settings.model().contains('+')) {
        return Err(AnalysisError::ErrorsUnknown { file: measured.file.clone() });
    }
    if settings.schedule.is_some() {
        let what = format!("{} is a frequency response, and a `schedule` needs recordings; give those, or leave it out", measured.file);
        return Err(AnalysisError::Schedule { what });
    }
    if settings.law.is_some() {
        let what = format!("{} is a frequency response, and a `law` is fitted to recordings; give those, or leave it out", measured.file);
        return Err(AnalysisError::Law { what });
    }
    fit_to(&Evidence::of_response(measured), settings)
}

fn fit_to(whole: &Evidence<'_>, settings: &Fit) -> Result<Fitted, AnalysisError> {
    let cards = blocks_of(settings.model())?;
    let sums = Sums::of(whole, settings.band_hz.unwrap_or(whole.band_hz))?;
    if sums.is_some() && settings.cost == FitCost::Paper {
        return Err(AnalysisError::PaperSums);
    }
    let summed = sums.as_ref().map(Sums::first);
    let evidence = summed.as_ref().unwrap_or(whole);
    let channels = evidence.channels;
    let ports = &channels.roles.ports;
    let model = InertiaDampingStiffnessModel::new(motion_axes(channels), settings.symmetry);
    let band_hz = settings.band_hz.unwrap_or(evidence.band_hz);
    let without = &evidence.without;
    let (smoothing, transducer) = (evidence.smoothing(band_hz), settings.transducer());
    let comparison = WeightedFit { band_hz, smoothing, transducer, covariance: evidence.covariance, ..WeightedFit::default() };
    let composite = Composite::of_cards(&model, &cards);
    let starts = starts::starts(&model, &composite, &cards, evidence, band_hz)?;
    let mut sampled = sampled(&comparison, (&model, composite), &starts, evidence, settings.hold)?;
    let ticked = sampled.ticks.as_ref().map(|ticks| evidence.on(ticks, sampled.sampling));
    let evidence = ticked.as_ref().unwrap_or(evidence);
    let response = &*evidence.response;
    let (sampling, begin) = (sampled.sampling, std::mem::take(&mut sampled.theta));
    let composite = Held { model: Composite::of_cards(&model, &cards), sampling };
    let compared = compared_models(&comparison, (&model, sampling), evidence, (&cards, &begin), settings.compare);
    let mut weighted = match &sums {
        Some(sums) => sums.fit(&comparison, &composite, &begin)?,
        None if evidence.errors_known() => {
            comparison.allowing_for_misfit(&composite, response, comparison.fit_trials(&composite, response, without, &begin)?)?
        }
        None => comparison.fit_trials(&composite, response, without, &begin)?,
    };
    sampled.widen(&mut weighted);
    let mount = match &sums {
        None if evidence.errors_known() => comparison.series_compliance(&composite, response, &weighted)?,
        _ => None,
    };
    let mount = mount.and_then(|mount| findings::unknown_mount(&mut weighted, &mount, composite.axes()));
    let summed = sums.as_ref().map(|sums| sums.evidence(sums.gains_of(&weighted)));
    let evidence = summed.as_ref().unwrap_or(evidence);
    let (response, weight) = (&*evidence.response, evidence.weight(settings.vaf_weight));
    let (fit, other) = by_both_costs(evidence, &composite, weighted, (settings, &weight, sums.is_none()))?;
    let report = Report::of(&composite, (&model, &cards), (response, &weight), band_hz);
    let reported = report.write(&fit, settings.cost)?;
    let other_cost = if settings.cost == FitCost::Weighted { FitCost::Paper } else { FitCost::Weighted };
    let other = other.map(|other| report.write(&other, other_cost)).transpose()?;
    let baseline = fit.marginal(model.parameters().len());
    let matrices = model.matrices(&baseline.theta);
    let joint: Option<Joint> =
        settings.kinematics.as_ref().map(|file| Ok::<_, AnalysisError>(project(file, &model, &baseline, &evidence.mean_effort)?.1)).transpose()?;
    let result = FitResult {
        head: Head::new(FitResult::SCHEMA, "fit", warnings(evidence, &fit, &baseline).into_iter().chain(mount).collect()),
        settings: Some(Asked { estimate: evidence.asked.clone(), fit: settings.clone() }),
        model: composite.name().to_owned(),
        cost: reported.cost,
        estimate: evidence.name.to_owned(),
        inputs: channels.names(&ports.inputs),
        reference_inputs: sums.as_ref().map(Sums::references).unwrap_or_default(),
        outputs: channels.names(&ports.outputs),
        band_hz: fit.band_hz,
        band_because: evidence.band_because.filter(|_| settings.band_hz.is_none()).map(str::to_owned),
        frequencies: fit.bins,
        between_samples: sampled.said,
        interval_width: fit.width,
        chi2_reduced: number(fit.chi2_reduced).filter(|_| evidence.errors_known()),
        parameters: reported.parameters,
        matrices: reported.matrices,
        vaf: reported.vaf,
        r2: reported.r2,
        symmetry: mirrored(&model, &baseline),
        joint,
        schedule: None,
        in_time: None,
        other_cost: other,
        comparison: compared,
    };
    let extensions = cards.iter().map(|card| card.name()).collect();
    let gains = sums.as_ref().map(|sums| sums.matrix(&fit));
    let theta = fit.theta[..composite.parameters().len()].to_vec();
    let (mean_effort, opposed) = (evidence.mean_effort.clone(), Vec::new());
    Ok(Fitted { fit: baseline, model, matrices, comparison, sampling, ticks: sampled.ticks, mean_effort, extensions, theta, gains, opposed, result })
}

/// What results say of a fit by one cost or the other: its parameters, and how well it agrees with the estimate within the band.
struct Report<'a> {
    composite: &'a Held<Composite>,
    model: &'a InertiaDampingStiffnessModel,
    cards: &'a [&'a BlockCard],
    measured: FrequencyResponse,
    weight: Array3<f64>,
    band_hz: [f64; 2],
}

impl<'a> Report<'a> {
    fn of(
        composite: &'a Held<Composite>,
        (model, cards): (&'a InertiaDampingStiffnessModel, &'a [&'a BlockCard]),
        (response, weight): (&FrequencyResponse, &Array3<f64>),
        band_hz: [f64; 2],
    ) -> Self {
        let in_band = response.within(band_hz);
        let measured = FrequencyResponse { uncertainty: None, ..response.select(&in_band) };
        Report { composite, model, cards, measured, weight: weight.select(ndarray::Axis(0), &in_band), band_hz }
    }

    fn write(&self, fit: &ndof_models::Fit, cost: FitCost) -> Result<OtherFit, AnalysisError> {
        let Report { composite, model, measured, .. } = self;
        let of_model = FrequencyResponse {
            inputs: measured.inputs.clone(),
            outputs: measured.outputs.clone(),
            ..parametric_response(*composite, &fit.theta[..composite.parameters().len()], &measured.frequency_hz, measured.kind)
        };
        let agreed = agreement(measured, &of_model, &self.weight, self.band_hz)?;
        let share = |(i, j): (usize, usize)| agreed.vaf_percent[i][j].unwrap_or(f64::NAN);
        Ok(OtherFit {
            cost,
            parameters: parameters(fit, model.parameters().len(), self.cards),
            matrices: with_errors(model, fit),
            vaf: ndarray::Array2::from_shape_fn((agreed.vaf_percent.len(), agreed.vaf_percent.first().map_or(0, Vec::len)), share).into(),
            r2: agreed.r2,
        })
    }
}

/// The fit that is asked for, and that by the other cost; the paper's is one of an impedance, and of several inputs an axis there is none.
fn by_both_costs(
    evidence: &Evidence<'_>,
    model: &dyn ParametricModel,
    mut weighted: ndof_models::Fit,
    (settings, weight, impedance): (&Fit, &Array3<f64>, bool),
) -> Result<(ndof_models::Fit, Option<ndof_models::Fit>), AnalysisError> {
    // Errors of unknown size say nothing here: without them the residuals do.
    let plain = (!evidence.errors_known()).then(|| FrequencyResponse { uncertainty: None, ..(*evidence.response).clone() });
    let response = plain.as_ref().unwrap_or(&evidence.response);
    let settled = PaperFit { band_hz: settings.band_hz.unwrap_or(evidence.band_hz) };
    let paper = impedance.then(|| settled.fit_trials(model, response, &evidence.without, weight, &weighted.theta));
    let mut paper = paper.transpose()?;
    if settings.systematic {
        paper.iter_mut().chain([&mut weighted]).for_each(add_floors);
    }
    Ok(match paper {
        Some(paper) if settings.cost == FitCost::Paper => (paper, Some(weighted)),
        paper => (weighted, paper),
    })
}

impl Fit {
    /// Fits the model to an estimate.
    ///
    /// # Errors
    /// As [`fit`].
    pub fn run(&self, estimated: &Estimated) -> Result<Fitted, AnalysisError> {
        fit(estimated, self)
    }
}

impl MeasuredResponse {
    /// Fits inertia, damping and stiffness, or what else `settings` name.
    ///
    /// # Errors
    /// As [`fit_response`].
    pub fn fit(&self, settings: &Fit) -> Result<Fitted, AnalysisError> {
        fit_response(self, settings)
    }
}

impl Estimated {
    /// Inertia, damping and stiffness from the first to the second frequency (Hz).
    ///
    /// # Errors
    /// As [`fit`].
    pub fn fit(&self, band_hz: std::ops::Range<f64>) -> Result<Fitted, AnalysisError> {
        fit(self, &Fit { band_hz: Some([band_hz.start, band_hz.end]), ..Fit::default() })
    }
}

/// Adds the floors of systematic errors to the covariance.
fn add_floors(fit: &mut ndof_models::Fit) {
    let floor = |p: &ndof_models::Parameter| match FLOORS.iter().find(|(matrix, _)| p.name == matrix.to_string() || p.name.starts_with(&format!("{matrix}_"))) {
        Some((_, share)) => share * p.value.abs(),
        None if p.name.starts_with("delay_s") => DELAY_FLOOR_S,
        None => 0.0,
    };
    let floors: Vec<f64> = fit.parameters.iter().map(floor).collect();
    fit.add_covariance(|r, c| if r == c { floors[r].powi(2) } else { 0.0 });
}

/// Parameters of the whole model; those of a channel's block belong to the sensor, and the gains behind them to the actuators.
fn parameters(fit: &ndof_models::Fit, base: usize, cards: &[&BlockCard]) -> Vec<Parameter> {
    let blocks = cards.iter().flat_map(|card| std::iter::repeat_n(if card.is_sensor() { "sensor" } else { "limb" }, (card.block)().parameters(false).len()));
    let sides = std::iter::repeat_n("limb", base).chain(blocks).chain(std::iter::repeat("actuator"));
    let mut out: Vec<Parameter> = fit.parameters.iter().map(Parameter::from).collect();
    out.iter_mut().zip(sides).for_each(|(p, side)| p.site.side = side.to_owned());
    out
}

/// What the mirrored entries of each matrix differ by.
fn mirrored(model: &InertiaDampingStiffnessModel, fit: &ndof_models::Fit) -> Vec<Mirrored> {
    let half = |one: Antisymmetric| {
        let of_entry = fit.parameters.iter().find(|p| p.name == one.name)?;
        let Derived { value, std_error, ci95 } = one.half_difference;
        Some(Parameter { value: number(value), std_error: number(std_error), ci95: finite(ci95), ..Parameter::from(of_entry) })
    };
    let told = |SymmetryTest { matrix, antisymmetric, p_value, meaning }: SymmetryTest| Mirrored {
        matrix,
        half_differences: antisymmetric.into_iter().filter_map(half).collect(),
        p_value: number(p_value),
        meaning,
    };
    symmetry_test(model, fit).into_iter().map(told).collect()
}

/// The axes that move.
fn motion_axes(channels: &Trials) -> Vec<Axis> {
    let ports = &channels.roles.ports;
    let motion = if channels.roles.natural_kind().is_effort_over_motion() { &ports.inputs } else { &ports.outputs };
    channels.channels(motion).iter().map(|channel| axis(&channel.name, &channel.unit)).collect()
}

/// What a fit would find, without its numbers; nothing where there is no impedance.
pub(crate) fn unknown_parameters(channels: &Trials) -> Vec<Parameter> {
    let ports = &channels.roles.ports;
    if channels.roles.natural_kind() == ResponseKind::Transfer || ports.inputs.len() < ports.outputs.len() {
        return Vec::new();
    }
    let unknown = |info: ParameterInfo| Parameter {
        name: info.name,
        unit: info.unit,
        site: Site { side: "limb".to_owned(), axis: info.site },
        value: None,
        std_error: None,
        ci95: None,
        identifiable: false,
    };
    InertiaDampingStiffnessModel::new(motion_axes(channels), Symmetry::default()).parameters().into_iter().map(unknown).collect()
}

fn axis(channel: &str, unit: &Unit) -> Axis {
    Axis { name: axis_of(channel).to_owned(), rotational: unit.is_rotational() || (unit.symbol().is_empty() && Axis::from_channel(channel).rotational) }
}

/// Matrices of the baseline with the standard error of each entry.
fn with_errors(model: &InertiaDampingStiffnessModel, whole: &ndof_models::Fit) -> Matrices {
    let fit = whole.marginal(model.parameters().len());
    let InertiaDampingStiffness { inertia, damping, stiffness, .. } = model.matrices(&fit.theta);
    let errors: Vec<f64> = fit.parameters.iter().map(|p| p.std_error).collect();
    Matrices {
        M: inertia.into(),
        B: damping.into(),
        K: stiffness.into(),
        std_error: model.matrices(&errors).into(),
        delay_s: whole.parameter("delay_s").and_then(|p| number(p.value)),
    }
}
