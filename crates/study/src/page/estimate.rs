//! The report of an estimate: response, coherences, coherence between inputs, traces.

use super::convert::{cube, curve, plane, warnings};
use crate::error::StudyError;
use crate::pipeline::Estimated;
use crate::result::EstimateResult;
use crate::result::estimate::Coherence;
use crate::trials::Trials;
use ndof_report::figures::{self, Coherences, CurveStyle, ResponseCurves, Spectrum, Trace, Traces};
use ndof_report::{Report, Section};
use ndof_sysid::FrequencyResponse;

/// The page of `ndof estimate`.
///
/// # Errors
/// [`StudyError::Figure`] if a picture cannot be drawn.
pub fn estimate_report(trials: &Trials, estimated: &Estimated, title: &str, command: &str) -> Result<Report, StudyError> {
    let mut report = frame(trials, estimated, title, command);
    report.lead = lead(&estimated.result);
    report.sections = vec![response_section(estimated, None)?, coherence_section(&estimated.result)?];
    report.sections.extend(power_section(trials, estimated)?);
    report.sections.push(traces_section(trials)?);
    Ok(report)
}

/// Title, facts, warnings and settings, without sections.
pub(super) fn frame(trials: &Trials, estimated: &Estimated, title: &str, command: &str) -> Report {
    let result = &estimated.result;
    let seconds: f64 = trials.trials.iter().map(|trial| trial.recording.duration_s()).sum();
    let m = &result.method;
    let settings = [
        ("method", Some(m.name.clone())),
        ("why", Some(m.why.clone())),
        ("estimator", Some(m.estimator.clone())),
        ("nperseg", m.nperseg.map(|n| n.to_string())),
        ("noverlap", m.noverlap.map(|n| n.to_string())),
        ("nfft", m.nfft.map(|n| n.to_string())),
        ("window", m.window.clone()),
        ("detrend", m.detrend.clone()),
        ("segments", Some(m.segments.to_string())),
        ("effective averages", Some(format!("{:.2}", m.effective_averages))),
    ];
    Report {
        title: title.to_owned(),
        facts: vec![
            (
                "Recording".to_owned(),
                format!("{} in, {} out, {} trial(s), {seconds:.1} s at {} Hz", result.inputs.len(), result.outputs.len(), result.trials, result.sample_rate_hz),
            ),
            ("Inputs".to_owned(), result.inputs.join(", ")),
            ("Outputs".to_owned(), result.outputs.join(", ")),
            ("References".to_owned(), if result.references.is_empty() { "none".to_owned() } else { result.references.join(", ") }),
        ],
        command: command.to_owned(),
        version: crate::result::VERSION.to_owned(),
        warnings: warnings(&result.warnings),
        settings: settings.into_iter().filter_map(|(name, value)| Some((name.to_owned(), value?))).collect(),
        ..Report::default()
    }
}

fn lead(result: &EstimateResult) -> String {
    let coherence = match &result.measured_direction {
        Some(measured) => measured.derived_iv.as_ref().unwrap_or(&measured.direct),
        None => result.derived.as_ref().map_or(&result.direct.coherence, |d| &d.coherence_iv),
    };
    let all: Vec<f64> = coherence.multiple.iter().flatten().flatten().copied().collect();
    let good = all.iter().filter(|c| **c >= 0.8).count();
    format!(
        "The {} of {} to {}: at {:.0} % of the frequencies at least 80 % of the motion's power is explained.",
        result.response.replace('-', " "),
        result.outputs.join(", "),
        result.inputs.join(", "),
        100.0 * good as f64 / all.len().max(1) as f64
    )
}

fn unit(kind: &str, rotational: bool) -> &'static str {
    match (kind, rotational) {
        ("compliance", false) => "m/N",
        ("compliance", true) => "rad/(N m)",
        ("dynamic-stiffness", false) => "N/m",
        ("dynamic-stiffness", true) => "N m/rad",
        ("impedance", false) => "N s/m",
        ("impedance", true) => "N m s/rad",
        ("admittance", false) => "m/(N s)",
        ("admittance", true) => "rad/(N m s)",
        _ => "",
    }
}

/// The response with intervals, and a fitted model over it.
pub(super) fn response_section(estimated: &Estimated, model: Option<&FrequencyResponse>) -> Result<Section, StudyError> {
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
    let rotational = result.units.inputs.iter().chain(&result.units.outputs).any(|unit| unit == "N m" || unit.starts_with("rad"));
    let data = ResponseCurves {
        quantity: result.response.replace('-', " "),
        unit: unit(&result.response, rotational).to_owned(),
        element_units: None,
        frequency_hz: result.frequency_hz.clone(),
        inputs: result.inputs.clone(),
        outputs: result.outputs.clone(),
        curves,
    };
    let lead = match model {
        Some(_) => {
            "Gain and phase with 95 % intervals. The model is drawn as the estimate sees it: through the same spectral window, which rounds sharp bends, and with the give of the transducer where that is known. It ends at twice the fitted band."
        }
        None => "Gain and phase with 95 % intervals.",
    };
    Ok(Section::new("Frequency response", lead).figure(figures::bode("bode", &data)?).figure(figures::nyquist("nyquist", &data)?))
}

/// Where the power of each channel lies; methods without densities have no such picture.
pub(super) fn power_section(trials: &Trials, estimated: &Estimated) -> Result<Option<Section>, StudyError> {
    let (Some(cross), Some(first)) = (&estimated.estimates.spectra, trials.trials.first()) else { return Ok(None) };
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

/// `N²/Hz`, `(N m)²/Hz`.
fn density_unit(symbol: &str) -> String {
    match symbol {
        "" => "1/Hz".to_owned(),
        plain if plain.chars().all(char::is_alphanumeric) => format!("{plain}²/Hz"),
        product => format!("({product})²/Hz"),
    }
}

/// Coherences of the estimate that is shown.
pub(super) fn coherence_section(result: &EstimateResult) -> Result<Section, StudyError> {
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
            &Coherences {
                frequency_hz: result.frequency_hz.clone(),
                inputs: inputs.clone(),
                outputs: outputs.clone(),
                ordinary: cube(&coherence.ordinary),
                partial: cube(&coherence.partial),
                multiple: plane(&coherence.multiple),
                significance_95: result.significance_95.partial,
            },
        )
    };
    let mut section = Section::new("Coherence", "How much of each output the inputs explain; above the line it is not chance.");
    section = section.figure(draw("coherence-direct", "Coherence, direct estimate", direct)?);
    if let Some(paper) = paper {
        section = section.figure(draw("coherence-derived", "Coherence, derived estimate (paper's assumption)", paper)?);
    }
    if let Some(figure) =
        figures::input_coherence("input-coherence", &result.frequency_hz, inputs, &cube(&result.input_coherence), result.significance_95.ordinary)?
    {
        section = section.figure(figure);
    }
    Ok(section)
}

/// The first trial over time, with a few seconds enlarged.
pub(super) fn traces_section(trials: &Trials) -> Result<Section, StudyError> {
    const DETAIL_SAMPLES: f64 = 1500.0;
    let mut section = Section::new("Recording", "The first trial as recorded.");
    if let Some(first) = trials.trials.first() {
        let recording = &first.recording;
        let traces = recording
            .channels()
            .iter()
            .map(|c| Trace { label: c.name.clone(), unit: c.unit.symbol().to_owned(), measured: c.samples.clone(), simulated: Vec::new() })
            .collect();
        let middle = recording.start_s() + recording.duration_s() / 2.0;
        let half = (DETAIL_SAMPLES / recording.sample_rate_hz()).min(recording.duration_s() / 4.0) / 2.0;
        let data = Traces {
            sample_rate_hz: recording.sample_rate_hz(),
            start_s: recording.start_s(),
            traces,
            detail_s: Some((middle - half, middle + half)),
            held_out_s: None,
        };
        section = section.figure(figures::traces("traces", "First trial", &data)?);
    }
    Ok(section)
}
