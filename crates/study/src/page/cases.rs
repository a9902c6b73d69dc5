//! The report of a study with several cases.

use super::tables::study_tables;
use crate::cases::result::{Setting, StudyResult};
use crate::file::ReportSection;
use crate::run::StudyOutcome;
use ndof_report::figures::{self, Ellipse, FigureError};
use ndof_report::pages::{coherence_section, frame, parameters_section, response_section, traces_section};
use ndof_report::plot::{Axis, Color, Dash, Panel, Series};
use ndof_report::{Figure, Report, Section, Table};

/// The page of `ndof study` for several cases: tables and pictures that compare them, then the first case in full and the
/// parameters of each.
///
/// # Errors
/// [`FigureError`] if a picture cannot be drawn.
pub fn cases_report(
    outcomes: &[(String, StudyOutcome)],
    result: &StudyResult,
    section: &ReportSection,
    title: &str,
    command: &str,
) -> Result<Option<Report>, FigureError> {
    let Some((first_name, first)) = outcomes.first() else { return Ok(None) };
    let mut report = frame(&first.estimated, title, command);
    report.warnings = result.head.warnings.clone();
    report.lead = lead(result);
    report.facts.insert(0, ("Cases".to_owned(), outcomes.iter().map(|(name, _)| name.as_str()).collect::<Vec<_>>().join(", ")));
    if let Some(figure) = hold_figure(outcomes, result, section) {
        report.sections.push(
            Section::new("What the hold does", "Without it tone carries the hand off; with it the forces become coherent at low frequencies.").figure(figure),
        );
    }
    let mut tables = Section::new("Cases side by side", "Each case against what was simulated.");
    for table in study_tables(result, section) {
        tables = tables.table(table);
    }
    report.sections.push(tables);
    if let Some(figure) = ellipses_figure(outcomes)? {
        report.sections.push(Section::new("Stiffness ellipses", "Found over simulated, case by case.").figure(figure));
    }
    let model = first.fitted.seen(&first.estimated)?;
    let mut response = response_section(&first.estimated, Some(&model))?;
    response.title = format!("Frequency response of {first_name}");
    report.sections.push(response);
    let mut coherence = coherence_section(&first.estimated.result)?;
    coherence.title = format!("Coherence of {first_name}");
    report.sections.push(coherence);
    for (name, outcome) in outcomes {
        report.sections.push(parameters_section(&outcome.table(), &format!("Parameters of {name}")));
    }
    report.sections.push(traces_section(&first.trials)?);
    Ok(Some(report))
}

/// How many intervals hold, and how good the worst agreement is.
pub(super) fn lead(result: &StudyResult) -> String {
    let settings = || result.cases.iter().flat_map(|case| &case.settings);
    let judged: Vec<bool> = settings().flat_map(|s: &Setting| s.parameters.iter().filter_map(|p| p.holds)).collect();
    let held = judged.iter().filter(|h| **h).count();
    let worst = settings().flat_map(|s| s.agreement.iter().filter(|a| a.estimate == "derived").filter_map(|a| a.r2)).fold(f64::INFINITY, f64::min);
    let mut text = format!("{} cases; {held} of {} intervals hold what was simulated", result.cases.len(), judged.len());
    if worst.is_finite() {
        text += &format!("; the derived estimate agrees with the linearised plant with R² of at least {worst:.5}");
    }
    text + "."
}

/// One ellipse a case, simulated over found, at most three side by side.
fn ellipses_figure(outcomes: &[(String, StudyOutcome)]) -> Result<Option<Figure>, FigureError> {
    let mut all = Figure::new("stiffness-ellipses", "Stiffness ellipses").columns(3).caption("Solid: found. Dotted: simulated.");
    for (name, outcome) in outcomes {
        let k = &outcome.fitted.matrices.stiffness;
        let [x, y] = outcome.fitted.matrices.axes.as_slice() else { return Ok(None) };
        if x.rotational || y.rotational {
            return Ok(None);
        }
        let mut ellipses = vec![Ellipse::new("found", [[k[[0, 0]], k[[0, 1]]], [k[[1, 0]], k[[1, 1]]]], Color::Blue, Dash::Solid)];
        if let Some(simulated) = outcome.constants() {
            let k = &simulated.linear.limb.stiffness;
            ellipses.push(Ellipse::new("simulated", [[k[[0, 0]], k[[0, 1]]], [k[[1, 0]], k[[1, 1]]]], Color::Ink, Dash::Dotted));
        }
        let one = figures::ellipse("ellipse", name, [&x.name, &y.name], "N/m", &ellipses)?;
        for cell in one.cells {
            all = all.cell(name.as_str(), cell.panels);
        }
    }
    Ok(Some(all))
}

/// The way from the posture over time, the coherence between the inputs, and the errors at low frequencies: one picture.
fn hold_figure(outcomes: &[(String, StudyOutcome)], result: &StudyResult, section: &ReportSection) -> Option<Figure> {
    let pick = |names: &[String]| -> Vec<(usize, &StudyOutcome, &str)> {
        let found = |name: &String| outcomes.iter().enumerate().find(|(_, (n, _))| n == name).map(|(k, (n, o))| (k, o, n.as_str()));
        names.iter().filter_map(found).collect()
    };
    let (moved, coherent, errors) = (pick(&section.displacement), pick(&section.input_coherence), pick(&section.errors));
    if moved.is_empty() && coherent.is_empty() && errors.is_empty() {
        return None;
    }
    let mut figure = Figure::new("hold", "What the hold does").columns(1);
    // A case keeps its colour from panel to panel; the seventh begins again with a broken line.
    let mut order: Vec<usize> = Vec::new();
    for (case, _, _) in moved.iter().chain(&coherent) {
        if !order.contains(case) {
            order.push(*case);
        }
    }
    let place = |case: usize| order.iter().position(|k| *k == case).unwrap_or(0);
    let dash = |k: usize| if (k / 6).is_multiple_of(2) { Dash::Solid } else { Dash::Dashed };
    if !moved.is_empty() {
        let mut panel = Panel::new(Axis::linear("Time", "s"), Axis::linear("Distance from the posture", "m"));
        for (case, outcome, name) in &moved {
            let (time, distance) = distance_over_time(outcome);
            panel = panel.with(Series::line(*name, time, distance, Color::nth(place(*case))).dash(dash(place(*case))));
        }
        figure = figure.panel("a. Where the hand is", panel);
    }
    if !coherent.is_empty() {
        let mut panel = Panel::new(Axis::log("Frequency", "Hz"), Axis::linear("Coherence between the forces", "").range(0.0, 1.0));
        for (case, outcome, name) in &coherent {
            let direct = &outcome.estimated.estimates.direct;
            let hz = &direct.response.frequency_hz;
            let used: Vec<usize> = (0..hz.len()).filter(|&f| (section.low_band_hz[0]..=12.0).contains(&hz[f])).collect();
            let inputs = direct.input_coherence.dim().1;
            let largest = |f: usize| (0..inputs).flat_map(|i| (0..i).map(move |j| direct.input_coherence[[f, i, j]])).fold(f64::NAN, f64::max);
            let x: Vec<f64> = used.iter().map(|&f| hz[f]).collect();
            panel = panel.with(Series::line(*name, x, used.iter().map(|&f| largest(f)).collect(), Color::nth(place(*case))).dash(dash(place(*case))));
        }
        if let Some(level) = coherent.first().map(|(_, outcome, _)| outcome.estimated.estimates.direct.significance_95.ordinary) {
            panel = panel.rule(level, "by chance, 95 %");
        }
        figure = figure.panel("b. Input coherence", panel);
    }
    if !errors.is_empty() {
        let names: Vec<String> = errors.iter().map(|(_, _, name)| (*name).to_owned()).collect();
        let axis = Axis::names(names);
        let heights: Vec<f64> = (0..errors.len()).map(|k| axis.row(k)).collect();
        let value = |of: fn(&crate::cases::result::LowBand) -> Option<f64>| -> Vec<f64> {
            errors.iter().map(|(k, _, _)| result.cases[*k].settings.first().and_then(|s| of(&s.low_band)).map_or(f64::NAN, |e| 100.0 * e)).collect()
        };
        let band = section.low_band_hz;
        let mut panel = Panel::new(Axis::log(format!("Error of the compliance, {} to {} Hz", band[0], band[1]), "%"), axis)
            .with(Series::points("direct estimate", value(|l| l.direct_error), heights.clone(), Color::Vermillion))
            .with(Series::points("derived estimate", value(|l| l.derived_error), heights, Color::Blue));
        panel.height = 30.0 * errors.len() as f64;
        figure = figure.panel("c. Error of the estimates", panel);
    }
    Some(figure)
}

/// Mean over the trials of the vector from the posture, averaged over tenths of a second, as its length.
fn distance_over_time(outcome: &StudyOutcome) -> (Vec<f64>, Vec<f64>) {
    let (trials, ports) = (&outcome.trials, &outcome.trials.roles.ports);
    let rest = outcome.simulated.as_ref().map(|s| s.rest.as_slice()).unwrap_or_default();
    let fs = trials.sample_rate_hz();
    let block = ((0.1 * fs).round() as usize).max(1);
    let samples = trials.trials.iter().map(|trial| trial.recording.len()).min().unwrap_or(0);
    let blocks = samples / block;
    let mean = |output: usize, at: usize| -> f64 {
        let sum: f64 = trials.trials.iter().map(|trial| trial.recording.channels()[output].samples[at * block..(at + 1) * block].iter().sum::<f64>()).sum();
        sum / (block * trials.trials.len()) as f64
    };
    let distance = |at: usize| ports.outputs.iter().zip(rest).map(|(&output, rest)| (mean(output, at) - rest).powi(2)).sum::<f64>().sqrt();
    ((0..blocks).map(|at| (at as f64 + 0.5) * block as f64 / fs).collect(), (0..blocks).map(distance).collect())
}

/// The tables that a terminal shows: those of the page without the direct estimate's agreement.
pub fn summary_tables(result: &StudyResult, section: &ReportSection) -> Vec<Table> {
    study_tables(result, section).into_iter().filter(|table| !table.caption.contains("the direct estimate with")).collect()
}
