//! The report of a fit: the model over the response, its parameters, the stiffness ellipse.

use super::convert::settings_rows;
use super::course::course_section;
use super::estimate::{coherence_section, frame, measured_section, power_section, response_section, traces_section};
use super::overlay::overlay_section;
use super::schedule::schedule_section;
use crate::figures::{self, Ellipse, FigureError, capitalised};
use crate::number::{nan, significant};
use crate::plot::{Color, Dash};
use crate::{Report, Section, Table, parameter_table};
use ndof_analysis::fit::in_time::InTime;
use ndof_analysis::fit::result::FitResult;
use ndof_analysis::result::word;
use ndof_analysis::{ComparedParameter, Estimated, Fitted, MeasuredResponse};
use ndof_linear::cholesky_in_place;
use statrs::distribution::{ContinuousCDF, Normal};

/// The page of `ndof fit`.
///
/// # Errors
/// [`FigureError`] if a picture cannot be drawn.
pub fn fit_report(estimated: &Estimated, fitted: &Fitted, title: &str, command: &str) -> Result<Report, FigureError> {
    let mut report = frame(estimated, title, command);
    report.warnings = fitted.result.head.warnings.clone();
    report.settings.extend(fitted.result.settings.iter().flat_map(|asked| settings_rows(&asked.fit)));
    report.lead = lead(&fitted.result);
    let model = fitted.seen(estimated)?;
    report.sections = vec![parameters_section(&fitted.table(|_| None), "Parameters"), response_section(estimated, Some(&model))?];
    if let Some(found) = &fitted.result.schedule {
        report.sections.insert(1, schedule_section(found, &fitted.result.parameters, &estimated.trials)?);
    }
    report.sections.extend(fitted.result.in_time.as_ref().map(in_time_section));
    report.sections.extend(course_section(&estimated.result)?);
    report.sections.push(agreement_section(&fitted.result));
    report.sections.extend(overlay_section(&estimated.trials, fitted)?);
    report.sections.extend(ellipse_section(fitted, None)?);
    report.sections.push(coherence_section(&estimated.result)?);
    report.sections.extend(power_section(estimated)?);
    report.sections.push(traces_section(&estimated.trials)?);
    Ok(report)
}

/// The page of `ndof fit` for a response that was measured elsewhere.
///
/// # Errors
/// [`FigureError`] if a picture cannot be drawn.
pub fn response_fit_report(measured: &MeasuredResponse, fitted: &Fitted, title: &str, command: &str) -> Result<Report, FigureError> {
    let (result, response) = (&fitted.result, &measured.response);
    let hz = &response.frequency_hz;
    let what = format!(
        "{}: {} frequencies from {} to {} Hz",
        measured.file,
        hz.len(),
        significant(hz.first().copied().unwrap_or(f64::NAN), 4),
        significant(hz.last().copied().unwrap_or(f64::NAN), 4)
    );
    let facts = [("Response", what), ("Inputs", response.inputs.join(", ")), ("Outputs", response.outputs.join(", "))];
    let mut report = Report {
        facts: facts.map(|(name, value)| (name.to_owned(), value)).to_vec(),
        settings: result.settings.iter().flat_map(|asked| settings_rows(&asked.fit)).collect(),
        lead: lead(result),
        ..Report::of(&result.head, title, command)
    };
    report.sections = vec![parameters_section(&fitted.table(|_| None), "Parameters"), measured_section(measured, &fitted.seen_in(measured)?)?];
    report.sections.push(agreement_section(result));
    report.sections.extend(ellipse_section(fitted, None)?);
    Ok(report)
}

/// The stiffness as a force that one can imagine, and whether the model is enough.
pub(super) fn lead(result: &FitResult) -> String {
    const CENTIMETRE: f64 = 0.01;
    const TEN_DEGREES: f64 = std::f64::consts::PI / 18.0;
    let mut felt = Vec::new();
    for p in result.parameters.iter().filter(|p| p.identifiable) {
        let (factor, unit) = match p.unit.as_str() {
            "N/m" => (CENTIMETRE, "N"),
            "N m/rad" => (TEN_DEGREES, "N m"),
            _ => continue,
        };
        if let (true, Some(value), Some([low, high])) = (p.is_diagonal_stiffness(), p.value, p.ci95) {
            let [value, low, high] = [value, low, high].map(|k| significant(factor * k, 3));
            let axis = if p.site.axis.is_empty() { String::new() } else { format!(" along {}", p.site.axis) };
            felt.push((unit, format!("{value} {unit}{axis} ({low} to {high})")));
        }
    }
    let extensions: Vec<&str> = result.model.split('+').skip(1).collect();
    let what = std::iter::once("inertia, damping and stiffness").chain(extensions).collect::<Vec<_>>().join(" with ");
    let known = result.parameters.iter().all(|p| p.identifiable);
    let model = match result.chi2_reduced {
        Some(chi2) if chi2 <= 2.0 && !known => format!("of {what} not everything is determined"),
        Some(chi2) if chi2 <= 2.0 => format!("{what} leave nothing but noise"),
        Some(_) => format!("{what} do not explain all of it"),
        None => format!("{what} were fitted"),
    };
    let [low, high] = result.band_hz;
    let mut sentences = Vec::new();
    for (unit, by) in [("N", "Moved by 1 cm"), ("N m", "Turned by 10°")] {
        let all: Vec<&str> = felt.iter().filter(|(own, _)| *own == unit).map(|(_, words)| words.as_str()).collect();
        if !all.is_empty() {
            sentences.push(format!("{by} and held there, it pushes back with {}.", all.join(" and ")));
        }
    }
    let judged = result.chi2_reduced.map_or_else(|| "too few averages to judge by".to_owned(), |chi2| format!("reduced χ² {}", significant(chi2, 3)));
    sentences.push(format!("From {low:.2} to {high:.2} Hz {model} ({judged})."));
    sentences.join(" ")
}

/// Parameters with intervals, beside the truth where it is known.
pub fn parameters_section(parameters: &[ComparedParameter], title: &str) -> Section {
    Section::new(title, "Estimates with 95 % intervals.").table(parameter_table(title, parameters))
}

/// Matrices and force laws that were fitted in time, and how near their free run stays.
fn in_time_section(found: &InTime) -> Section {
    let lead = format!(
        "Inertia, damping and stiffness with {}, fitted to the free run of {} from {}. Places and gaps of laws count from the mean of the motion.",
        found.laws.join(", "),
        found.outputs.join(", "),
        found.imposed.join(", ")
    );
    let caption = format!("Error of the free run, of the output's standard deviation; held out: {}", found.held_out.what);
    let mut errors = Table::new(caption, ["Output"], ["Fitted", "Held out", "Held out, without the laws"]);
    for (k, output) in found.outputs.iter().enumerate() {
        let at = |values: &[Option<f64>]| significant(nan(values.get(k).copied().flatten()), 3);
        errors = errors.row([output.clone(), at(&found.nrmse), at(&found.held_out.nrmse), at(&found.held_out.nrmse_without_laws)]);
    }
    let parameters: Vec<ComparedParameter> = found.parameters.iter().map(ComparedParameter::unknown).collect();
    Section::new("In time", lead).table(parameter_table("In time", &parameters)).table(errors)
}

/// How well the model agrees with the estimate, as the paper measures it, for both costs.
pub fn agreement_section(result: &FitResult) -> Section {
    let mut table = Table::new("Variance accounted for", ["Cost", "Element"], ["VAF, %", "R²"]);
    let both = std::iter::once((&result.cost, &result.vaf, result.r2)).chain(result.other_cost.iter().map(|other| (&other.cost, &other.vaf, other.r2)));
    for (cost, vaf, r2) in both {
        for ((i, j), value) in vaf.indexed_iter() {
            let element = format!("{}, {}", result.outputs.get(i).map_or("", String::as_str), result.inputs.get(j).map_or("", String::as_str));
            table = table.row([word(cost), element, significant(*value, 5), significant(nan(r2), 6)]);
        }
    }
    let lead = format!(
        "Reduced χ² {} (about 1: inertia, damping and stiffness leave nothing but noise); gain in dB and phase of the impedance, weighted with partial coherence.",
        significant(nan(result.chi2_reduced), 3)
    );
    let lead = result.remarks().iter().fold(lead, |lead, remark| format!("{lead} {}.", capitalised(remark)));
    Section::new("Agreement", lead).table(table)
}

/// The stiffness ellipse of a planar limb, and that of the truth.
///
/// # Errors
/// [`FigureError`] if a picture cannot be drawn.
pub fn ellipse_section(fitted: &Fitted, truth: Option<&[Vec<f64>]>) -> Result<Option<Section>, FigureError> {
    let k = &fitted.matrices.stiffness;
    let [x, y] = fitted.matrices.axes.as_slice() else { return Ok(None) };
    if k.dim() != (2, 2) || x.rotational || y.rotational {
        return Ok(None);
    }
    let fitted_ellipse = Ellipse::new("fitted", [[k[[0, 0]], k[[0, 1]]], [k[[1, 0]], k[[1, 1]]]], Color::Blue, Dash::Solid);
    let mut ellipses = vec![Ellipse { samples: draws(fitted), ..fitted_ellipse }];
    if let Some([first, second]) = truth
        && let ([a, b], [c, d]) = (first.as_slice(), second.as_slice())
    {
        ellipses.push(Ellipse::new("simulated", [[*a, *b], [*c, *d]], Color::Ink, Dash::Dotted));
    }
    let figure = figures::ellipse("stiffness-ellipse", "Stiffness ellipse", [&x.name, &y.name], "N/m", &ellipses)?;
    Ok(Some(Section::new("Stiffness ellipse", "The restoring force to a displacement of unit length in every direction.").figure(figure)))
}

/// Stiffness matrices that the data allow: Gaussian with the covariance of the fit, at points that fill the cube evenly, so that
/// the same fit gives the same picture (Roberts' sequence, the generalised golden ratio).
fn draws(fitted: &Fitted) -> Vec<[[f64; 2]; 2]> {
    const DRAWS: usize = 200;
    let [x, y] = fitted.matrices.axes.as_slice() else { return Vec::new() };
    let names = [[(&x.name, &x.name), (&x.name, &y.name)], [(&y.name, &x.name), (&y.name, &y.name)]];
    let index = |(row, column): (&String, &String)| {
        let named = |a: &str, b: &str| fitted.fit.parameters.iter().position(|p| p.name == format!("K_{a}_{b}"));
        named(row, column).or_else(|| named(column, row))
    };
    let [[Some(xx), Some(xy)], [Some(yx), Some(yy)]] = names.map(|row| row.map(index)) else { return Vec::new() };
    let mut used = vec![xx, xy, yx, yy];
    used.sort_unstable();
    used.dedup();
    let n = used.len();
    let mut root: Vec<f64> = (0..n * n).map(|e| fitted.fit.covariance[[used[e / n], used[e % n]]]).collect();
    if !cholesky_in_place(&mut root, n) {
        return Vec::new();
    }
    let Ok(normal) = Normal::new(0.0, 1.0) else { return Vec::new() };
    let golden = (0..64).fold(2.0_f64, |g, _| (1.0 + g).powf(1.0 / (n as f64 + 1.0)));
    (1..=DRAWS)
        .map(|k| {
            let even: Vec<f64> = (1..=n).map(|d| normal.inverse_cdf((0.5 + k as f64 * golden.powi(-(d as i32))).fract().clamp(1e-9, 1.0 - 1e-9))).collect();
            let value = |index: usize| {
                let i = used.iter().position(|u| *u == index).unwrap_or(0);
                fitted.fit.theta[index] + (0..=i).map(|j| root[i * n + j] * even[j]).sum::<f64>()
            };
            [[value(xx), value(xy)], [value(yx), value(yy)]]
        })
        .collect()
}
