//! The report of a diagnosis: verdict, causes with evidence, gain, what else was tried.

use super::convert::{nan, warnings};
use super::estimate::traces_section;
use crate::error::StudyError;
use crate::result::VERSION;
use crate::result::diagnosis::{Cause, CauseValue, Confusable, Diagnosis, DiagnosisResult};
use crate::result::fit::Site;
use crate::trials::Trials;
use crate::words::{p_value, sentence};
use ndof_report::figures::{self, Considered, Estimate, HeldOut};
use ndof_report::number::significant;
use ndof_report::{Align, Note, Report, Section, Table};

/// The page of `ndof diagnose`.
///
/// # Errors
/// [`StudyError::Figure`] if a picture cannot be drawn.
pub fn diagnosis_report(trials: &Trials, result: &DiagnosisResult, title: &str, command: &str) -> Result<Report, StudyError> {
    let d = &result.diagnosis;
    let mut report = Report {
        title: title.to_owned(),
        lead: sentence(d),
        facts: vec![
            ("Inputs".to_owned(), result.inputs.join(", ")),
            ("Outputs".to_owned(), result.outputs.join(", ")),
            ("Fitted".to_owned(), d.split.estimation.clone()),
            ("Held out".to_owned(), d.split.held_out.clone()),
        ],
        command: command.to_owned(),
        version: VERSION.to_owned(),
        warnings: warnings(&result.warnings),
        ..Report::default()
    };
    report.sections = sections(result)?;
    report.sections.push(traces_section(trials)?);
    Ok(report)
}

/// The sections on causes, gain and discrepancy.
pub(super) fn sections(result: &DiagnosisResult) -> Result<Vec<Section>, StudyError> {
    let d = &result.diagnosis;
    let mut sections: Vec<Section> = d.causes.iter().map(cause_section).collect();
    sections.push(gain_section(result)?);
    sections.push(discrepancy_section(d)?);
    sections.extend(considered_section(d)?);
    sections.extend(next_section(d));
    Ok(sections)
}

/// "hysteresis, limb, x".
fn name(effect: &str, site: &Site) -> String {
    [effect, &site.side, &site.axis].into_iter().filter(|part| !part.is_empty()).collect::<Vec<_>>().join(", ")
}

fn number(value: f64) -> String {
    significant(value, 4)
}

fn cause_section(cause: &Cause) -> Section {
    let mut table = Table::new("Parameters", &[("Parameter", Align::Left), ("Unit", Align::Left), ("Estimate", Align::Right), ("95 % interval", Align::Right)]);
    for p in &cause.parameters {
        let value = match &p.value {
            Some(CauseValue::Number(value)) => number(*value),
            Some(CauseValue::Text(text)) => text.clone(),
            Some(CauseValue::Flag(flag)) => flag.to_string(),
            Some(CauseValue::Matrix(rows)) => {
                rows.iter().map(|row| row.iter().map(|v| number(nan(*v))).collect::<Vec<_>>().join(" ")).collect::<Vec<_>>().join("; ")
            }
            None => "–".to_owned(),
        };
        let interval = p.ci95.map_or_else(|| "–".to_owned(), |[low, high]| format!("{} … {}", number(low), number(high)));
        table = table.row([p.name.clone(), p.unit.clone(), value, interval]);
    }
    let lead = format!("With probability {:.2}, p {}.", nan(cause.probability), p_value(cause.p_value));
    Section::new(format!("Cause: {}", name(&cause.effect, &cause.site)), lead).table(table).list(cause.evidence.clone())
}

fn gain_section(result: &DiagnosisResult) -> Result<Section, StudyError> {
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
    let mut section = Section::new("Gain", "Error of the free run on data that no fit saw, without and with the named causes.")
        .figure(figures::before_after("gain", "Held-out error", &outputs)?)
        .text(format!("Noise floor: {}.", d.noise_floor.how));
    for shift in &d.extended.parameter_shift {
        section = section.note(
            Note::Information,
            format!("{} had been biased: {} without the causes, {} {} with them.", shift.name, number(nan(shift.before)), number(nan(shift.after)), shift.unit),
        );
    }
    Ok(section)
}

fn discrepancy_section(d: &Diagnosis) -> Result<Section, StudyError> {
    let parts = [
        ("linear", d.discrepancy.linear_share),
        ("nonlinear", d.discrepancy.nonlinear_share),
        ("changing with time", d.discrepancy.time_varying_share),
        ("noise", d.discrepancy.noise_share),
    ]
    .map(|(name, share)| (name.to_owned(), nan(share)));
    let section = Section::new("Discrepancy", "Of what kind the error of the baseline is.").figure(figures::shares("shares", "Kinds of error", &parts)?);
    Ok(if d.discrepancy.notes.is_empty() { section } else { section.list(d.discrepancy.notes.clone()) })
}

fn considered_section(d: &Diagnosis) -> Result<Option<Section>, StudyError> {
    if d.considered.is_empty() {
        return Ok(None);
    }
    let estimate =
        |value: Option<f64>, ci95: Option<[f64; 2]>| Estimate { value: nan(value), ci95: ci95.map_or((f64::NAN, f64::NAN), |[low, high]| (low, high)) };
    let named = d.causes.iter().map(|c| Considered {
        cause: name(&c.effect, &c.site),
        explained: estimate(c.gain.explained_fraction, c.gain.explained_fraction_ci95),
        p_value: nan(c.p_value),
        named: true,
        why_not: String::new(),
    });
    let others = d.considered.iter().map(|c| Considered {
        cause: name(&c.effect, &c.site),
        explained: estimate(c.explained_fraction, None),
        p_value: nan(c.p_value),
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
            c.predicted.iter().map(|p| format!("{} ({}{})", p.experiment, number(nan(p.separation)), if p.decides { ", decides" } else { "" })).collect();
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
