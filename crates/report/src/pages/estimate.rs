//! The report of an estimate: response, coherences, coherence between inputs, traces.

use super::convert::{UNKNOWN, channel_traces, curve, quantity, settings_rows, unit};
use super::course::course_section;
use crate::figures::{self, Coherences, Curve, CurveStyle, FigureError, ResponseCurves, Spectrum, Traces};
use crate::number::density_unit;
use crate::{Report, Section};
use ndof_analysis::estimate::result::{Coherence, EstimateResult};
use ndof_analysis::{Estimated, MeasuredResponse, Trials};
use ndof_sysid::FrequencyResponse;

/// The page of `ndof estimate`.
///
/// # Errors
/// [`FigureError`] if a picture cannot be drawn.
pub fn estimate_report(estimated: &Estimated, title: &str, command: &str) -> Result<Report, FigureError> {
    let mut report = frame(estimated, title, command);
    report.lead = lead(&estimated.result);
    report.sections = vec![response_section(estimated, None)?, coherence_section(&estimated.result)?];
    report.sections.extend(course_section(&estimated.result)?);
    report.sections.extend(power_section(estimated)?);
    report.sections.push(traces_section(&estimated.trials)?);
    Ok(report)
}

/// Title, facts, warnings and settings, without sections.
pub fn frame(estimated: &Estimated, title: &str, command: &str) -> Report {
    let result = &estimated.result;
    let seconds: f64 = estimated.trials.trials.iter().map(|trial| trial.recording.duration_s()).sum();
    let what = format!("{} in, {} out, {} trial(s), {seconds:.1} s at {} Hz", result.inputs.len(), result.outputs.len(), result.trials, result.sample_rate_hz);
    Report {
        facts: vec![
            ("Recording".to_owned(), what),
            ("Inputs".to_owned(), result.inputs.join(", ")),
            ("Outputs".to_owned(), result.outputs.join(", ")),
            ("References".to_owned(), if result.references.is_empty() { "none".to_owned() } else { result.references.join(", ") }),
        ],
        settings: settings(result),
        ..Report::of(&result.head, title, command)
    }
}

/// What the method made of the settings, then what else was asked for.
fn settings(result: &EstimateResult) -> Vec<(String, String)> {
    let named = |name: String| if name == "name" { "method".to_owned() } else { name.replace('_', "-") };
    let made = settings_rows(&result.method).into_iter().filter(|(_, value)| value != UNKNOWN);
    let mut rows: Vec<(String, String)> = made.map(|(name, value)| (named(name), value)).collect();
    for (name, value) in settings_rows(&result.settings) {
        if rows.iter().all(|(known, _)| *known != name) {
            rows.push((name, value));
        }
    }
    rows
}

fn lead(result: &EstimateResult) -> String {
    let coherence = match &result.measured_direction {
        Some(measured) => measured.derived_iv.as_ref().unwrap_or(&measured.direct),
        None => result.derived.as_ref().map_or(&result.direct.coherence, |d| &d.coherence_iv),
    };
    let all: Vec<f64> = coherence.multiple.iter().copied().filter(|c| c.is_finite()).collect();
    let good = all.iter().filter(|c| **c >= 0.8).count();
    format!(
        "The {} of {} to {}: at {:.0} % of the frequencies at least 80 % of the motion's power is explained.",
        quantity(result.response),
        result.outputs.join(", "),
        result.inputs.join(", "),
        100.0 * good as f64 / all.len().max(1) as f64
    )
}

/// The response with intervals, and a fitted model over it.
///
/// # Errors
/// [`FigureError`] if a picture cannot be drawn.
pub fn response_section(estimated: &Estimated, model: Option<&FrequencyResponse>) -> Result<Section, FigureError> {
    let (first, last) = (estimated.result.frequency_hz.first().copied().unwrap_or(0.0), estimated.result.frequency_hz.last().copied().unwrap_or(0.0));
    let cut = |response: &FrequencyResponse| response.band(first, last);
    let mut curves = Vec::new();
    if let Some(derived) = &estimated.derived {
        curves.push(curve("direct", &FrequencyResponse { uncertainty: None, ..cut(&estimated.direct) }, CurveStyle::SECOND));
        curves.push(curve("derived", &cut(derived), CurveStyle::MEASURED));
    } else {
        curves.push(curve("direct", &cut(&estimated.direct), CurveStyle::MEASURED));
    }
    if let Some(model) = model {
        curves.push(curve("model", &cut(model), CurveStyle::FITTED));
    }
    let result = &estimated.result;
    let rotational = result.units.are_rotational();
    drawn(&cut(estimated.best()), rotational, curves, model.is_some())
}

/// A response that was measured elsewhere, and the fitted model over it.
pub(super) fn measured_section(measured: &MeasuredResponse, model: &FrequencyResponse) -> Result<Section, FigureError> {
    let mut response = measured.response.to_kind(measured.kind)?;
    if !measured.errors_known {
        response.uncertainty = None;
    }
    let curves = vec![curve("measured", &response, CurveStyle::MEASURED), curve("model", model, CurveStyle::FITTED)];
    drawn(&response, measured.is_rotational(), curves, true)
}

/// Gain and phase, and the same in the complex plane.
fn drawn(like: &FrequencyResponse, rotational: bool, curves: Vec<Curve>, model: bool) -> Result<Section, FigureError> {
    let data = ResponseCurves {
        quantity: quantity(like.kind),
        unit: unit(like.kind, rotational).to_owned(),
        frequency_hz: like.frequency_hz.clone(),
        inputs: like.inputs.clone(),
        outputs: like.outputs.clone(),
        curves,
    };
    let lead = match model {
        true => {
            "Gain and phase with 95 % intervals. The model is drawn as the estimate sees it: through the same spectral window, which rounds sharp bends, and with the give of the transducer where that is known. It ends at twice the fitted band."
        }
        false => "Gain and phase with 95 % intervals.",
    };
    Ok(Section::new("Frequency response", lead).figure(figures::bode("bode", &data)?).figure(figures::nyquist("nyquist", &data)?))
}

/// Where the power of each channel lies; methods without densities have no such picture.
///
/// # Errors
/// [`FigureError`] if a picture cannot be drawn.
pub fn power_section(estimated: &Estimated) -> Result<Option<Section>, FigureError> {
    let (Some(cross), Some(first)) = (&estimated.estimates.spectra, estimated.trials.trials.first()) else { return Ok(None) };
    let hz = cross.frequency_hz();
    let spectra: Vec<Spectrum> = first
        .recording
        .channels()
        .iter()
        .enumerate()
        .map(|(k, channel)| Spectrum {
            label: channel.name.clone(),
            unit: density_unit(channel.unit.symbol()),
            density: (0..hz.len()).map(|f| if hz[f] > 0.0 { cross.power(f, k) } else { f64::NAN }).collect(),
        })
        .collect();
    let band_hz = estimated.result.method.band_hz.map(|[low, high]| (low, high));
    let figure = figures::spectra("power", "Power of the channels", hz, &spectra, band_hz)?;
    Ok(Some(Section::new("Power", "Where the perturbation put its energy, and where the motion answered.").figure(figure)))
}

/// Coherences of the estimate that is shown.
///
/// # Errors
/// [`FigureError`] if a picture cannot be drawn.
pub fn coherence_section(result: &EstimateResult) -> Result<Section, FigureError> {
    let (inputs, outputs) = result.measured_direction.as_ref().map_or((&result.inputs, &result.outputs), |m| (&m.inputs, &m.outputs));
    let direct = result.measured_direction.as_ref().map_or(&result.direct.coherence, |m| &m.direct);
    let paper = match &result.measured_direction {
        Some(measured) => measured.derived_paper.as_ref(),
        None => result.derived.as_ref().map(|d| &d.coherence_paper),
    };
    let draw = |name: &str, title: &str, coherence: &Coherence| {
        figures::coherence(
            name,
            title,
            Coherences {
                frequency_hz: &result.frequency_hz,
                inputs,
                outputs,
                ordinary: &coherence.ordinary,
                partial: &coherence.partial,
                multiple: &coherence.multiple,
                significance_95: result.significance_95.partial,
            },
        )
    };
    let mut section = Section::new("Coherence", "How much of each output the inputs explain; above the line it is not chance.");
    section = section.figure(draw("coherence-direct", "Coherence, direct estimate", direct)?);
    if let Some(paper) = paper {
        section = section.figure(draw("coherence-derived", "Coherence, derived estimate (paper's assumption)", paper)?);
    }
    if let Some(figure) = figures::input_coherence("input-coherence", &result.frequency_hz, inputs, &result.input_coherence, result.significance_95.ordinary)? {
        section = section.figure(figure);
    }
    Ok(section)
}

/// The first trial over time, with a few seconds enlarged.
///
/// # Errors
/// [`FigureError`] if a picture cannot be drawn.
pub fn traces_section(trials: &Trials) -> Result<Section, FigureError> {
    const DETAIL_SAMPLES: f64 = 1500.0;
    let mut section = Section::new("Recording", "The first trial as recorded.");
    if let Some(first) = trials.trials.first() {
        let recording = &first.recording;
        let traces = channel_traces(recording);
        let middle = recording.start_s() + recording.duration_s() / 2.0;
        let half = (DETAIL_SAMPLES / recording.sample_rate_hz()).min(recording.duration_s() / 4.0) / 2.0;
        let data = Traces { sample_rate_hz: recording.sample_rate_hz(), start_s: recording.start_s(), traces, detail_s: Some((middle - half, middle + half)) };
        section = section.figure(figures::traces("traces", "First trial", &data)?);
    }
    Ok(section)
}
