//! What the cases of a study show, as tables for the page and for the terminal.

use crate::cases::result::{BandAgreement, Case, Compared, Setting, StudyResult};
use crate::file::ReportSection;
use ndof_analysis::result::Number;
use ndof_report::Table;
use ndof_report::number::{nan, significant};

/// The tables of a study with several cases: agreement, fitted matrices, elements off the diagonal, hold, steps.
pub fn study_tables(result: &StudyResult, report: &ReportSection) -> Vec<Table> {
    let mut tables: Vec<Table> = ["derived", "direct"].iter().filter_map(|estimate| agreement(result, estimate)).collect();
    tables.extend([fits(result), ellipses(result), off_diagonal(result)].into_iter().flatten());
    if [&report.displacement, &report.input_coherence, &report.errors].iter().any(|names| !names.is_empty()) {
        tables.push(hold(result));
    }
    tables.extend((!result.steps.is_empty()).then(|| steps(result)));
    tables
}

/// What a row is about.
const LABELS: [&str; 2] = ["Case", "Setting"];

fn rows(result: &StudyResult) -> impl Iterator<Item = (&Case, &Setting)> {
    result.cases.iter().flat_map(|case| case.settings.iter().map(move |setting| (case, setting)))
}

fn setting_name(setting: &Setting) -> String {
    setting.segments_per_trial.map_or_else(|| setting.name.clone(), |n| format!("{}, {n} segments", setting.name))
}

/// A number to `digits` significant digits.
fn shown(value: Number, digits: usize) -> String {
    significant(nan(value), digits)
}

/// Percent with `decimals` decimals, so that 99.98 and 100.00 differ.
fn fixed(value: Number, decimals: usize) -> String {
    value.map_or_else(|| "–".to_owned(), |v| format!("{v:.decimals$}"))
}

fn interval(compared: &Compared) -> String {
    compared.ci95.map_or_else(|| "–".to_owned(), |[low, high]| format!("{} … {}", significant(low, 4), significant(high, 4)))
}

/// VAF and R² against the linearised plant, as the paper's figures 7 and 8.
fn agreement(result: &StudyResult, estimate: &str) -> Option<Table> {
    let of = |setting: &Setting| -> Vec<BandAgreement> { setting.agreement.iter().filter(|a| a.estimate == estimate).cloned().collect() };
    let first = rows(result).map(|(_, setting)| of(setting)).find(|bands| !bands.is_empty())?;
    let axes = &result.cases.first()?.axes;
    let mut heads = Vec::new();
    for band in &first {
        let [low, high] = band.band_hz;
        heads.extend(axes.iter().flat_map(|i| axes.iter().map(move |j| format!("VAF {i}{j} {low}–{high} Hz"))));
        heads.push(format!("R² {low}–{high} Hz"));
    }
    let mut table = Table::new(format!("Agreement of the {estimate} estimate with the linearised plant: VAF in % and R²"), LABELS, heads);
    for (case, setting) in rows(result) {
        let mut row = vec![case.name.clone(), setting_name(setting)];
        for band in of(setting) {
            row.extend(band.vaf.iter().flatten().map(|v| fixed(*v, 2)));
            row.push(fixed(band.r2, 5));
        }
        table = table.row(row);
    }
    Some(table)
}

/// How far the fitted matrices are off, and how many intervals hold.
fn fits(result: &StudyResult) -> Option<Table> {
    rows(result).find(|(_, setting)| setting.relative_error.is_some())?;
    let numbers = ["M off by, %", "B off by, %", "K off by, %", "Intervals that hold"];
    let mut table = Table::new("Fitted matrices against the linearised plant, relative norm", LABELS, numbers);
    for (case, setting) in rows(result) {
        let percent = |of: fn(&crate::cases::result::MatrixNumbers) -> Number| shown(setting.relative_error.as_ref().and_then(of).map(|e| 100.0 * e), 2);
        let judged: Vec<bool> = setting.parameters.iter().filter_map(|p| p.holds).collect();
        let held = format!("{} of {}", judged.iter().filter(|h| **h).count(), judged.len());
        table = table.row([case.name.clone(), setting_name(setting), percent(|e| e.M), percent(|e| e.B), percent(|e| e.K), held]);
    }
    Some(table)
}

/// Stiffness ellipses.
fn ellipses(result: &StudyResult) -> Option<Table> {
    rows(result).find(|(_, setting)| setting.ellipse.is_some())?;
    let numbers = ["Stiffest, N/m", "found", "Softest, N/m", "found", "Direction, °", "found", "95 % interval", "Axis ratio", "found", "95 % interval"];
    let mut table = Table::new("Stiffness ellipses: simulated and found; a circle has no direction", LABELS, numbers);
    for (case, setting) in rows(result) {
        let Some(e) = &setting.ellipse else { continue };
        let turn = e.orientation_deg.as_ref();
        table = table.row([
            case.name.clone(),
            setting_name(setting),
            shown(e.major.truth, 5),
            shown(e.major.value, 5),
            shown(e.minor.truth, 5),
            shown(e.minor.value, 5),
            turn.map_or_else(|| "–".to_owned(), |t| fixed(t.truth, 2)),
            turn.map_or_else(|| "–".to_owned(), |t| fixed(t.value, 2)),
            turn.map_or_else(|| "–".to_owned(), interval),
            fixed(e.axis_ratio.truth, 4),
            fixed(e.axis_ratio.value, 4),
            e.axis_ratio.ci95.map_or_else(|| "–".to_owned(), |[low, high]| format!("{low:.4} … {high:.4}")),
        ]);
    }
    Some(table)
}

/// Whether the elements off the diagonal can be seen at all: partial coherence and the standard error in units of the element.
fn off_diagonal(result: &StudyResult) -> Option<Table> {
    let numbers = ["γ² on the diagonal", "γ² off it", "Error of the diagonal", "Error off it"];
    let mut table = Table::new(
        "Elements of the derived estimate in the widest band: mean partial coherence, and mean standard error of the dynamic stiffness in units of the element itself",
        LABELS,
        numbers,
    );
    for (case, setting) in rows(result) {
        let widest = setting.agreement.iter().filter(|a| a.estimate == "derived").max_by(|a, b| a.band_hz[1].total_cmp(&b.band_hz[1]));
        let Some(band) = widest.filter(|band| band.partial_coherence.len() > 1) else { continue };
        let mean = |matrix: &[Vec<Number>], diagonal: bool| {
            let values: Vec<f64> = matrix
                .iter()
                .enumerate()
                .flat_map(|(i, row)| row.iter().enumerate().filter(move |(j, _)| (i == *j) == diagonal).map(|(_, v)| nan(*v)))
                .collect();
            significant(values.iter().sum::<f64>() / values.len() as f64, 2)
        };
        table = table.row([
            case.name.clone(),
            setting_name(setting),
            mean(&band.partial_coherence, true),
            mean(&band.partial_coherence, false),
            mean(&band.relative_error, true),
            mean(&band.relative_error, false),
        ]);
    }
    (!table.rows.is_empty()).then_some(table)
}

/// What a hold does: where the endpoint stays, and what feedback through it does to the estimates.
fn hold(result: &StudyResult) -> Table {
    let band = rows(result).next().map_or([0.0, 0.0], |(_, setting)| setting.low_band.band_hz);
    let caption = format!("Distance from the posture at the end, coherence between the forces and errors of the compliance from {} to {} Hz", band[0], band[1]);
    let numbers = ["Distance, cm", "Coherence, mean", "largest", "by chance", "Direct off by, %", "Derived off by, %"];
    let mut table = Table::new(caption, LABELS, numbers);
    for (case, setting) in rows(result) {
        let low = &setting.low_band;
        table = table.row([
            case.name.clone(),
            setting_name(setting),
            fixed(case.distance.map(|d| 100.0 * d), 2),
            fixed(low.input_coherence_mean, 3),
            fixed(low.input_coherence_max, 3),
            fixed(low.significance_95, 3),
            shown(low.direct_error.map(|e| 100.0 * e), 3),
            shown(low.derived_error.map(|e| 100.0 * e), 3),
        ]);
    }
    table
}

/// Steps of a parameter from case to case.
fn steps(result: &StudyResult) -> Table {
    let numbers = ["Simulated step", "Found", "95 % interval", "Step over its standard error"];
    let mut table = Table::new("Steps from case to case", ["From", "To", "Setting", "Parameter"], numbers);
    for step in &result.steps {
        table = table.row([
            step.from.clone(),
            step.to.clone(),
            step.setting.clone(),
            format!("{} [{}]", step.parameter, step.unit),
            shown(step.change.truth, 3),
            shown(step.change.value, 4),
            interval(&step.change),
            shown(step.z, 3),
        ]);
    }
    table
}
