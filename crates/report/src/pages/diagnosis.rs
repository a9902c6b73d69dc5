//! The report of a diagnosis: verdict, causes with evidence, gain, what else was tried.

use super::convert::settings_rows;
use super::estimate::traces_section;
use super::overlay::{Compared, residual_figure, run_figure};
use super::words::{p_value, sentence};
use crate::figures::{self, Considered, Estimate, FigureError, HeldOut, ScheduleCurve, ScheduleCurves, Stretches};
use crate::number::{nan, significant};
use crate::plot::{Axis, Color, Dash, Panel, Scale, Series};
use crate::{Figure, Report, Section, Table};
use ndof_analysis::Diagnosed;
use ndof_analysis::diagnose::result::DiagnosisResult;
use ndof_diagnose::{Cause, Confusable, Curve, Diagnosis, Pictures, Site};
use ndof_models::effects::Value;

/// The page of `ndof diagnose`.
///
/// # Errors
/// [`FigureError`] if a picture cannot be drawn.
pub fn diagnosis_report(diagnosed: &Diagnosed, title: &str, command: &str) -> Result<Report, FigureError> {
    let result = &diagnosed.result;
    let d = &result.diagnosis;
    let mut report = Report {
        lead: sentence(d),
        facts: vec![
            ("Inputs".to_owned(), result.inputs.join(", ")),
            ("Outputs".to_owned(), result.outputs.join(", ")),
            ("Fitted".to_owned(), d.split.estimation.clone()),
            ("Held out".to_owned(), d.split.held_out.clone()),
        ],
        settings: settings_rows(&result.settings),
        sections: sections(diagnosed)?,
        ..Report::of(&result.head, title, command)
    };
    report.sections.push(traces_section(&diagnosed.trials)?);
    Ok(report)
}

/// The sections on causes, gain and discrepancy.
///
/// # Errors
/// [`FigureError`] if a picture cannot be drawn.
pub fn sections(Diagnosed { result, pictures, corrections, .. }: &Diagnosed) -> Result<Vec<Section>, FigureError> {
    let d = &result.diagnosis;
    let words = if corrections.is_some() { &OF_JOINTS } else { &OF_MOTION };
    let mut sections: Vec<Section> = d.causes.iter().enumerate().map(cause_section).collect::<Result<_, _>>()?;
    sections.extend(corrections.is_some().then(|| file_section(d)));
    sections.push(gain_section(result, words, corrections.is_none())?);
    sections.extend(runs_section(result, pictures, words)?);
    sections.extend(state_section(pictures, words)?);
    sections.push(discrepancy_section(d)?);
    sections.extend(considered_section(d)?);
    sections.extend(next_section(d));
    Ok(sections)
}

/// What a prediction is, and what it leaves over.
struct Words {
    gain: &'static str,
    runs: &'static str,
    state: &'static str,
}

const OF_MOTION: Words = Words {
    gain: "Error of the free run on data that no fit saw, without and with the named causes.",
    runs: "Free runs from the input alone over data that no fit saw; what is shown is within the analysed band.",
    state: "What inertia, damping and stiffness leave over in the first trial that was fitted, as the mean over stretches of the state that hold equally many samples: friction is a step over velocity, a hysteresis a loop over displacement.",
};

const OF_JOINTS: Words = Words {
    gain: "Error of the torques on data that no fit saw, without and with the named causes.",
    runs: "Torques that the robot of the file needs for the measured motion, without and with the named causes, over data that no fit saw.",
    state: "Torque that the robot of the file leaves over in the first trial that was fitted, as the mean over stretches of speed and angle that hold equally many samples: friction is a step over speed, a gear's hysteresis a loop over the angle.",
};

/// Frictions, rotors and masses of the file beside what the data say.
fn file_section(d: &Diagnosis) -> Section {
    let mut table = Table::new("The file and the data", ["Parameter", "Unit"], ["File", "Data", "95 % interval"]);
    for (file, data) in d.baseline.parameters.iter().zip(&d.extended.parameters) {
        let found = told(d, &file.name);
        let value = if found.is_some() { number(data.value) } else { "as the file".to_owned() };
        // What is told of a mass is its change.
        let beside = if file.name.starts_with("mass_") { file.value } else { 0.0 };
        let interval = found.flatten().map_or_else(|| "–".to_owned(), |[low, high]| format!("{} … {}", number(beside + low), number(beside + high)));
        table = table.row([file.name.clone(), file.unit.clone(), number(file.value), value, interval]);
    }
    Section::new("The file and the data", "A number that no cause calls wrong stands as in the file.").table(table)
}

/// The interval of a file's parameter, where a cause names it.
fn told(d: &Diagnosis, parameter: &str) -> Option<Option<[f64; 2]>> {
    let [effect, of_joint, own] = [
        ["coulomb-friction", "coulomb_", "level_nm"],
        ["viscous-friction", "viscous_", "viscous_nm_s_per_rad"],
        ["motor-inertia", "rotor_", "rotor_kg_m2"],
        ["link-parameters", "mass_", "change_of_mass_kg"],
    ]
    .into_iter()
    .find(|[_, prefix, _]| parameter.starts_with(prefix))?;
    let joint = parameter.strip_prefix(of_joint)?;
    let cause = d.causes.iter().find(|c| c.effect == effect && joint.strip_prefix(c.site.axis.as_str()).is_some_and(|rest| rest.starts_with('_')))?;
    cause.parameters.iter().find(|p| p.name == own).map(|p| p.ci95)
}

/// "hysteresis, limb, x".
fn name(effect: &str, site: &Site) -> String {
    [effect, &site.side, &site.axis].into_iter().filter(|part| !part.is_empty()).collect::<Vec<_>>().join(", ")
}

fn number(value: f64) -> String {
    significant(value, 4)
}

fn cause_section((position, cause): (usize, &Cause)) -> Result<Section, FigureError> {
    let mut table = Table::new("Parameters", ["Parameter", "Unit"], ["Estimate", "95 % interval"]);
    for p in &cause.parameters {
        let value = match &p.value {
            Value::Number(value) => number(*value),
            Value::Text(text) => text.clone(),
            Value::Flag(flag) => flag.to_string(),
            Value::Matrix(rows) => rows.iter().map(|row| row.iter().map(|v| number(*v)).collect::<Vec<_>>().join(" ")).collect::<Vec<_>>().join("; "),
        };
        let interval = p.ci95.map_or_else(|| "–".to_owned(), |[low, high]| format!("{} … {}", number(low), number(high)));
        table = table.row([p.name.clone(), p.unit.clone(), value, interval]);
    }
    let lead = format!("With probability {:.2}, p {}.", cause.probability, p_value(cause.p_value));
    let section = Section::new(format!("Cause: {}", name(&cause.effect, &cause.site)), lead).table(table).list(cause.evidence.clone());
    let Some(first) = cause.over_schedule.first() else { return Ok(section) };
    let curve = |curve: &Curve| ScheduleCurve {
        label: curve.name.clone(),
        unit: curve.unit.clone(),
        value: curve.value.clone(),
        ci95: Some(curve.ci95.clone()),
        ..ScheduleCurve::default()
    };
    let axis = first.over.strip_prefix("the ").unwrap_or(&first.over).to_owned();
    let title = format!("{} over {}", first.name, first.over);
    let curves: Vec<ScheduleCurve> = cause.over_schedule.iter().map(curve).collect();
    let columns = curves.len().min(2);
    let data = ScheduleCurves { axis: (axis, first.over_unit.clone()), at: first.at.clone(), curves, columns };
    Ok(section.figure(figures::schedule(&format!("cause-{}-over-schedule", position + 1), &title, &data)?))
}

fn gain_section(result: &DiagnosisResult, words: &Words, shifts: bool) -> Result<Section, FigureError> {
    let d = &result.diagnosis;
    let at = |values: &[Option<f64>], k: usize| values.get(k).copied().flatten().unwrap_or(f64::NAN);
    let outputs: Vec<HeldOut> = result
        .outputs
        .iter()
        .enumerate()
        .map(|(k, output)| HeldOut {
            output: output.clone(),
            before: at(&d.baseline.held_out.nrmse, k),
            after: at(&d.extended.held_out.nrmse, k),
            floor: at(&d.noise_floor.nrmse, k),
        })
        .collect();
    let mut section = Section::new("Gain", words.gain)
        .figure(figures::before_after("gain", "Held-out error", &outputs)?)
        .text(format!("Noise floor: {}.", d.noise_floor.how));
    for shift in d.extended.parameter_shift.iter().filter(|_| shifts) {
        section = section.note(format!("{} is {} without the causes, {} {} with them.", shift.name, number(shift.before), number(shift.after), shift.unit));
    }
    Ok(section)
}

fn discrepancy_section(d: &Diagnosis) -> Result<Section, FigureError> {
    let parts = [
        ("linear", d.discrepancy.linear_share),
        ("nonlinear", d.discrepancy.nonlinear_share),
        ("changing with time", d.discrepancy.time_varying_share),
        ("noise", d.discrepancy.noise_share),
    ]
    .map(|(name, share)| (name.to_owned(), share));
    let mut section = Section::new("Discrepancy", "Of what kind the error of the baseline is, and where it lies.");
    if parts.iter().any(|(_, share)| share.is_finite()) {
        section = section.figure(figures::shares("shares", "Kinds of error", &parts)?);
    }
    let bands: Vec<Place> = d.discrepancy.by_band.iter().map(|b| (b.band_hz, b.output.as_str(), b.share)).collect();
    let times: Vec<Place> = d.discrepancy.by_time.iter().map(|t| (t.time_s, t.output.as_str(), t.share)).collect();
    let over = |label: &str, unit: &str| (label.to_owned(), unit.to_owned());
    let by_frequency = stretches_figure("error-by-frequency", "Error by frequency", over("Frequency", "Hz"), &bands)?;
    let by_time = stretches_figure("error-by-time", "Error by time", over("Time since the held-out part began", "s"), &times)?;
    for figure in by_frequency.into_iter().chain(by_time) {
        section = section.figure(figure);
    }
    Ok(if d.discrepancy.notes.is_empty() { section } else { section.list(d.discrepancy.notes.clone()) })
}

/// From and to, the output, and its share there.
type Place<'a> = ([f64; 2], &'a str, f64);

/// Shares of each output's error over stretches of frequency or time; nothing where there are none.
fn stretches_figure(name: &str, title: &str, over: (String, String), places: &[Place<'_>]) -> Result<Option<Figure>, FigureError> {
    let Some((_, first, _)) = places.first() else { return Ok(None) };
    let own: Vec<&Place<'_>> = places.iter().filter(|(_, output, _)| output == first).collect();
    let mut outputs: Vec<&str> = Vec::new();
    for (_, output, _) in places {
        if !outputs.contains(output) {
            outputs.push(output);
        }
    }
    let edges: Vec<f64> = own.iter().map(|(ends, ..)| ends[0]).chain(own.last().map(|(ends, ..)| ends[1])).collect();
    let values = |output: &str| places.iter().filter(|(_, o, _)| *o == output).map(|(.., share)| 100.0 * share).collect();
    let data = Stretches {
        over,
        scale: Scale::Linear,
        edges,
        quantity: ("Share of the error's power".to_owned(), "%".to_owned()),
        lines: outputs.iter().map(|output| ((*output).to_owned(), values(output))).collect(),
    };
    Ok(Some(figures::discrepancy(name, title, &data)?))
}

/// Free runs of the baseline and of the extended model over the held-out part, and what the better one leaves.
fn runs_section(result: &DiagnosisResult, pictures: &Pictures, words: &Words) -> Result<Option<Section>, FigureError> {
    let named = !result.diagnosis.causes.is_empty();
    let finite = |runs: &[Vec<f64>], i: usize| runs.get(i).is_some_and(|run| run.iter().any(|x| x.is_finite()));
    let runs: Vec<Compared<'_>> = pictures
        .outputs
        .iter()
        .zip(&pictures.measured)
        .enumerate()
        .map(|(i, (output, measured))| {
            let mut models = Vec::new();
            if finite(&pictures.baseline, i) {
                models.push(("baseline", pictures.baseline[i].as_slice()));
            }
            if named && finite(&pictures.extended, i) {
                models.push(("with the causes", pictures.extended[i].as_slice()));
            }
            Compared { output: output.clone(), unit: pictures.output_unit.to_owned(), measured, models }
        })
        .collect();
    if runs.iter().all(|run| run.models.is_empty()) {
        return Ok(None);
    }
    let clock = (pictures.sample_rate_hz, pictures.start_s);
    let mut section = Section::new("Prediction of held-out data", words.runs).figure(run_figure("held-out", "The first held-out trial", clock, &runs)?);
    let title = if named { "What the extended model leaves" } else { "What the baseline leaves" };
    if let Some(figure) = residual_figure("held-out-residual", title, clock, pictures.band_hz, &runs)? {
        section = section.figure(figure);
    }
    Ok(Some(section))
}

/// What the matrices leave over, on average at each velocity and displacement of each axis, with what the causes say.
fn state_section(pictures: &Pictures, words: &Words) -> Result<Option<Section>, FigureError> {
    let mut figure = Figure::new("missing-effort", "Missing effort").columns(2);
    for (i, (axis, missing)) in pictures.axes.iter().zip(&pictures.missing).enumerate() {
        let (Some(velocity), Some(position)) = (pictures.velocity.get(i), pictures.position.get(i)) else { continue };
        let explained = pictures.explained.get(i).filter(|force| force.iter().any(|f| *f != 0.0));
        let of_axis = |name: &str| if pictures.axes.len() > 1 { format!("{name} {axis}") } else { name.to_owned() };
        let curves: [(&str, &[f64], Color, Dash); 2] = [
            ("missing", missing, Color::Blue, Dash::Solid),
            ("explained by the causes", explained.map_or(&[], Vec::as_slice), Color::Vermillion, Dash::Dashed),
        ];
        for (link, (name, unit, state)) in [("Velocity", pictures.units[1], velocity), ("Displacement", pictures.units[0], position)].into_iter().enumerate() {
            let mut panel = Panel::new(Axis::linear(of_axis(name), unit), Axis::linear(of_axis("Missing effort"), pictures.units[2])).height(150.0);
            panel.link = 2 * i + link;
            for (label, effort, color, dash) in curves {
                // Over displacement forth and back are apart: what a loop encloses is what it takes.
                let ways: &[(&str, Option<bool>)] = if link == 0 { &[("", None)] } else { &[(", moving forth", Some(true)), (", moving back", Some(false))] };
                for (way, forth) in ways {
                    let (x, y) = means(state, effort, |k| forth.is_none_or(|forth| (velocity[k] > 0.0) == forth));
                    let color = if *forth == Some(false) { beside(color) } else { color };
                    if !x.is_empty() {
                        panel.series.push(Series::line(format!("{label}{way}"), x, y, color).dash(dash));
                    }
                }
            }
            if !panel.series.is_empty() {
                figure = figure.panel("", panel);
            }
        }
    }
    if figure.cells.is_empty() {
        return Ok(None);
    }
    Ok(Some(Section::new("Missing effort over the state", words.state).figure(figure)))
}

/// The colour of the way back.
fn beside(color: Color) -> Color {
    if color == Color::Blue { Color::Sky } else { Color::Orange }
}

/// Means of values over stretches of the state with equally many of those samples that count.
fn means(state: &[f64], values: &[f64], counts: impl Fn(usize) -> bool) -> (Vec<f64>, Vec<f64>) {
    const STRETCHES: usize = 24;
    const FEWEST: usize = 10;
    let mut pairs: Vec<(f64, f64)> = (0..state.len().min(values.len())).filter(|&k| counts(k)).map(|k| (state[k], values[k])).collect();
    pairs.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mean = |run: &[(f64, f64)], of: fn(&(f64, f64)) -> f64| run.iter().map(of).sum::<f64>() / run.len() as f64;
    pairs.chunks(pairs.len().div_ceil(STRETCHES).max(1)).filter(|run| run.len() >= FEWEST).map(|run| (mean(run, |p| p.0), mean(run, |p| p.1))).unzip()
}

fn considered_section(d: &Diagnosis) -> Result<Option<Section>, FigureError> {
    if d.considered.is_empty() {
        return Ok(None);
    }
    let estimate =
        |value: Option<f64>, ci95: Option<[f64; 2]>| Estimate { value: nan(value), ci95: ci95.map_or((f64::NAN, f64::NAN), |[low, high]| (low, high)) };
    let named = d.causes.iter().map(|c| Considered {
        cause: name(&c.effect, &c.site),
        explained: estimate(c.gain.explained_fraction, c.gain.explained_fraction_ci95),
        p_value: c.p_value,
        named: true,
        why_not: String::new(),
    });
    let others = d.considered.iter().map(|c| Considered {
        cause: name(&c.effect, &c.site),
        explained: estimate(Some(c.explained_fraction), None),
        p_value: c.p_value,
        named: false,
        why_not: c.why_not.clone(),
    });
    let rows: Vec<Considered> = named.chain(others).collect();
    Ok(Some(Section::new("What else was tried", "And why it was not named.").figure(figures::considered("considered", "Considered", &rows)?)))
}

/// What cannot be told apart and what is too small to matter, each with what to do about it.
fn next_section(d: &Diagnosis) -> Option<Section> {
    let power = |c: &Confusable| -> String {
        let decide: Vec<String> =
            c.predicted.iter().map(|p| format!("{} ({}{})", p.experiment, number(p.separation), if p.decides { ", decides" } else { "" })).collect();
        if decide.is_empty() { String::new() } else { format!(" Simulated separation: {}.", decide.join("; ")) }
    };
    let apart = d
        .confusable
        .iter()
        .map(|c| format!("{} cannot be told apart by this recording. Next experiment: {}.{}", c.effects.join(" and "), c.next_experiment, power(c)));
    let minor = d.minor.iter().map(|m| format!("{} is significant but minor: {}.", name(&m.effect, &m.site), m.why));
    let lines: Vec<String> = apart.chain(minor).collect();
    (!lines.is_empty()).then(|| Section::new("What remains", "What to measure next, and what is too small to matter.").list(lines))
}
