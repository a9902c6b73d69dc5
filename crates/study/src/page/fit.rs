//! The report of a fit: the model over the response, its parameters, the stiffness ellipse.

use super::convert::nan;
use super::estimate::{coherence_section, frame, response_section, traces_section};
use crate::error::StudyError;
use crate::pipeline::{ComparedParameter, Estimated, Fitted, compare, model_response};
use crate::result::FitResult;
use crate::trials::Trials;
use ndof_report::figures::{self, Ellipse};
use ndof_report::number::significant;
use ndof_report::plot::{Color, Dash};
use ndof_report::{Align, Parameter, Report, Section, Table, parameter_table};

/// The page of `ndof fit`.
///
/// # Errors
/// [`StudyError::Figure`] if a picture cannot be drawn.
pub fn fit_report(trials: &Trials, estimated: &Estimated, fitted: &Fitted, title: &str, command: &str) -> Result<Report, StudyError> {
    let mut report = frame(trials, estimated, title, command);
    report.warnings = super::convert::warnings(&fitted.result.warnings);
    let [low, high] = fitted.result.band_hz;
    report.lead = format!("Inertia, damping and stiffness fitted to the {} estimate from {low:.2} to {high:.2} Hz.", fitted.result.estimate);
    let model = model_response(&fitted.matrices, estimated.best());
    report.sections = vec![parameters_section(&compare(fitted, None), "Parameters"), response_section(estimated, Some(&model))?];
    report.sections.push(agreement_section(&fitted.result));
    report.sections.extend(ellipse_section(fitted, None)?);
    report.sections.push(coherence_section(&estimated.result)?);
    report.sections.push(traces_section(trials)?);
    Ok(report)
}

/// Parameters with intervals, beside the truth where it is known.
pub(super) fn parameters_section(parameters: &[ComparedParameter], title: &str) -> Section {
    let rows: Vec<Parameter> = parameters
        .iter()
        .map(|p| Parameter {
            name: p.name.clone(),
            unit: p.unit.clone(),
            truth: p.truth,
            value: nan(p.value),
            ci95: p.ci95.map_or((f64::NAN, f64::NAN), |[low, high]| (low, high)),
            identifiable: p.identifiable,
        })
        .collect();
    Section::new(title, "Estimates with 95 % intervals.").table(parameter_table(title, &rows))
}

/// How well the model agrees with the estimate, as the paper measures it, for both costs.
pub(super) fn agreement_section(result: &FitResult) -> Section {
    let mut table = Table::new("Variance accounted for", &[("Cost", Align::Left), ("Element", Align::Left), ("VAF, %", Align::Right), ("R²", Align::Right)]);
    let both = std::iter::once((&result.cost, &result.vaf, result.r2)).chain(result.other_cost.iter().map(|other| (&other.cost, &other.vaf, other.r2)));
    for (cost, vaf, r2) in both {
        for (i, row) in vaf.iter().enumerate() {
            for (j, value) in row.iter().enumerate() {
                let element = format!("{}, {}", result.outputs.get(i).map_or("", String::as_str), result.inputs.get(j).map_or("", String::as_str));
                table = table.row([cost.clone(), element, significant(nan(*value), 5), significant(nan(r2), 6)]);
            }
        }
    }
    let lead = format!("Reduced χ² {}; gain in dB and phase of the impedance, weighted with partial coherence.", significant(nan(result.chi2_reduced), 3));
    Section::new("Agreement", lead).table(table)
}

/// The stiffness ellipse of a planar limb, and that of the truth.
pub(super) fn ellipse_section(fitted: &Fitted, truth: Option<&[Vec<f64>]>) -> Result<Option<Section>, StudyError> {
    let k = &fitted.matrices.stiffness;
    let [x, y] = fitted.matrices.axes.as_slice() else { return Ok(None) };
    if k.dim() != (2, 2) || x.rotational || y.rotational {
        return Ok(None);
    }
    let mut ellipses = vec![Ellipse::new("fitted", [[k[[0, 0]], k[[0, 1]]], [k[[1, 0]], k[[1, 1]]]], Color::Blue, Dash::Solid)];
    if let Some([first, second]) = truth
        && let ([a, b], [c, d]) = (first.as_slice(), second.as_slice())
    {
        ellipses.push(Ellipse::new("simulated", [[*a, *b], [*c, *d]], Color::Ink, Dash::Dotted));
    }
    let figure = figures::ellipse("stiffness-ellipse", "Stiffness ellipse", [&x.name, &y.name], "N/m", &ellipses)?;
    Ok(Some(Section::new("Stiffness ellipse", "The restoring force to a displacement of unit length in every direction.").figure(figure)))
}
