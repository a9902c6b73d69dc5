//! The report of a whole study.

use crate::file::HiddenEffect;
use crate::run::StudyOutcome;
use ndof_report::pages::{
    agreement_section, coherence_section, course_section, diagnosis_sections, ellipse_section, frame, overlay_section, parameters_section, power_section,
    response_section, schedule_section, traces_section,
};
use ndof_report::{FigureError, Report, Section};

/// The page of `ndof study`.
///
/// # Errors
/// [`FigureError`] if a picture cannot be drawn.
pub fn study_report(outcome: &StudyOutcome, title: &str, command: &str) -> Result<Report, FigureError> {
    let StudyOutcome { trials, estimated, fitted, also, .. } = outcome;
    let mut report = frame(estimated, title, command);
    report.warnings = fitted.result.head.warnings.clone();
    let truth = outcome.constants().map(|s| &s.truth);
    let table = outcome.table();
    // Where joints and robot have one and the same axes, each number stands there twice, and counts once.
    let known = |k: usize| table[..k].iter().any(|p| (p.value, p.truth) == (table[k].value, table[k].truth));
    let counted: Vec<_> = table.iter().enumerate().filter(|(k, _)| !known(*k)).map(|(_, p)| p).collect();
    let inside = counted.iter().filter(|p| matches!((p.truth, p.ci95), (Some(t), Some([low, high])) if (low..=high).contains(&t))).count();
    report.lead = match truth {
        Some(_) => format!("{inside} of {} simulated parameters lie inside their 95 % intervals.", counted.len()),
        None => format!("{} parameters with 95 % intervals.", counted.len()),
    };
    report.sections.push(parameters_section(&table, "Parameters"));
    let model = fitted.seen(estimated)?;
    report.sections.push(response_section(estimated, Some(&model))?);
    report.sections.extend(course_section(&estimated.result)?);
    report.sections.push(agreement_section(&fitted.result));
    if let Some(found) = &fitted.result.schedule {
        report.sections.push(schedule_section(found, &fitted.result.parameters, trials)?);
    }
    report.sections.extend(overlay_section(trials, fitted)?);
    report.sections.extend(ellipse_section(fitted, truth.map(|t| t.endpoint.K.as_slice()))?);
    for (name, _, fitted) in also {
        report.sections.push(parameters_section(&fitted.table(|name| truth?.parameter(name)), &format!("Parameters, setting \u{201c}{name}\u{201d}")));
    }
    report.sections.extend(outcome.sensitivity.as_ref().map(super::sensitivity::section));
    if let Some(diagnosed) = &outcome.diagnosed {
        report.sections.extend(diagnosis_sections(diagnosed)?);
        report.sections.extend(hidden_section(&outcome.hidden));
    }
    report.sections.push(coherence_section(&estimated.result)?);
    report.sections.extend(power_section(estimated)?);
    report.sections.push(traces_section(trials)?);
    Ok(report)
}

/// What the study had hidden, after everything else was said about it.
fn hidden_section(hidden: &[HiddenEffect]) -> Option<Section> {
    let lines: Vec<String> = hidden
        .iter()
        .map(|hidden| {
            let values: Vec<String> = hidden.parameters.iter().map(|(name, value)| format!("{name} = {value}")).collect();
            let axis = hidden.axis.as_ref().map(|axis| format!(", {axis}")).unwrap_or_default();
            format!("{} ({}{axis}): {}", hidden.name, hidden.side, values.join(", "))
        })
        .collect();
    (!lines.is_empty()).then(|| Section::new("What was hidden", "Drawn from the seed; the diagnosis did not see it.").list(lines))
}
