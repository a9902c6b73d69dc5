//! The report of a comparison: what differs between fits, and by how much.

use crate::figures::{Estimate, FigureError, Forest, ForestGroup, forest};
use crate::number::{nan, printed_unit, significant, to_interval, with_half_width};
use crate::plot::{Color, Scale};
use crate::{Report, Section, Table};
use ndof_analysis::compare::result::{CompareResult, Difference, ParameterComparison};

/// Below it a difference is more than chance explains: the complement of the intervals' 95 %.
const SIGNIFICANT: f64 = 0.05;

/// The page of `ndof compare`; `names` are those of the fits.
///
/// # Errors
/// [`FigureError`] if a picture cannot be drawn.
pub fn compare_report(result: &CompareResult, names: &[String], title: &str, command: &str) -> Result<Report, FigureError> {
    let mut report = Report { lead: lead(result, names), facts: vec![("Fits".to_owned(), names.join(", "))], ..Report::of(&result.head, title, command) };
    if !result.reliability.is_empty() {
        report.sections.push(Section::new("Sessions", "Agreement of the sessions over all subjects.").table(sessions(result)));
        return Ok(report);
    }
    let told = "Each later fit less the first, with 95 % intervals; p is adjusted for all parameters (Holm).";
    let tables = (1..result.fits).fold(Section::new("Differences", told), |section, later| section.table(differences(result, names, later)));
    report.sections.push(tables);
    report.sections.push(side_by_side(result, names)?);
    Ok(report)
}

fn differs(difference: &Difference) -> bool {
    difference.p_value.is_some_and(|p| p < SIGNIFICANT)
}

/// How many differences the lead names: a sentence that can be read at once.
const NAMED: usize = 3;

/// What differs, in one sentence a fit; of many differences the clearest.
fn lead(result: &CompareResult, names: &[String]) -> String {
    if let Some(first) = result.reliability.first() {
        return format!("{} sessions of {} subjects beside each other.", first.sessions, first.subjects);
    }
    let count = result.parameters.len();
    let of_fit = |later: usize| {
        let name = names.get(later).map_or("", String::as_str);
        let changed = clearest(result, later);
        let told: Vec<String> = changed.iter().take(NAMED).map(|(p, d)| change(p, d, later)).collect();
        match changed.len() {
            0 => format!("{name}: none of the {count} parameters differs by more than chance explains."),
            few if few <= NAMED => format!("{name}: {few} of {count} parameters differ by more than chance explains: {}.", told.join("; ")),
            many => format!("{name}: {many} of {count} parameters differ by more than chance explains, most clearly {}.", told.join("; ")),
        }
    };
    (1..result.fits).map(of_fit).collect::<Vec<_>>().join(" ")
}

/// What differs in a later fit, by difference over standard error, the largest first.
fn clearest(result: &CompareResult, later: usize) -> Vec<(&ParameterComparison, &Difference)> {
    let mut changed: Vec<_> = result.parameters.iter().filter_map(|p| p.differences.get(later - 1).map(|d| (p, d))).filter(|(_, d)| differs(d)).collect();
    let clarity = |d: &Difference| (nan(d.value) / nan(d.std_error)).abs();
    changed.sort_by(|(_, one), (_, other)| clarity(other).total_cmp(&clarity(one)));
    changed
}

/// "K_x_x from 300 to 360 N/m, by 60.0 ± 7.1".
fn change(p: &ParameterComparison, difference: &Difference, later: usize) -> String {
    let [before, after] = [0, later].map(|k| significant(nan(p.values.get(k).copied().flatten()), 3));
    let by = with_half_width(nan(difference.value), half_width(difference.ci95));
    format!("{} from {before} to {after} {}, by {by}", p.name, printed_unit(&p.unit))
}

fn half_width(ends: Option<[f64; 2]>) -> f64 {
    ends.map_or(f64::NAN, |[low, high]| 0.5 * (high - low))
}

/// One row a parameter: both values, the difference, its interval and the probability of as much by chance.
fn differences(result: &CompareResult, names: &[String], later: usize) -> Table {
    let name = |k: usize| names.get(k).map_or("", String::as_str);
    let numbers = [name(0), name(later), "Difference", "95 % interval", "p"];
    let empty = Table::new(format!("{} less {}", name(later), name(0)), ["Parameter", "Unit"], numbers).remarks("");
    let rows = result.parameters.iter().filter_map(|p| p.differences.get(later - 1).map(|d| (p, d)));
    rows.fold(empty, |table, (p, d)| {
        let own = |k: usize| with_half_width(nan(p.values.get(k).copied().flatten()), half_width(p.ci95.get(k).copied().flatten()));
        let half = half_width(d.ci95);
        let [low, high] = d.ci95.unwrap_or([f64::NAN; 2]).map(|end| to_interval(end, half));
        let by_chance = d.p_value.map_or_else(|| "–".to_owned(), |p| super::p_value(p).trim_start_matches("= ").to_owned());
        let judged = if differs(d) { "differs" } else { "" };
        table.row([
            p.name.clone(),
            printed_unit(&p.unit),
            own(0),
            own(later),
            with_half_width(nan(d.value), half),
            format!("{low} … {high}"),
            by_chance,
            judged.to_owned(),
        ])
    })
}

/// A picture for each unit: the fits below each other in every parameter's row.
fn side_by_side(result: &CompareResult, names: &[String]) -> Result<Section, FigureError> {
    let mut units: Vec<&str> = result.parameters.iter().map(|p| p.unit.as_str()).collect();
    units.sort_unstable();
    units.dedup();
    let mut section = Section::new("Side by side", "Values of every fit with their 95 % intervals.");
    for unit in units {
        let own: Vec<&ParameterComparison> = result.parameters.iter().filter(|p| p.unit == unit).collect();
        let estimate = |p: &&ParameterComparison, k: usize| {
            let [low, high] = p.ci95.get(k).copied().flatten().unwrap_or([f64::NAN; 2]);
            Estimate { value: nan(p.values.get(k).copied().flatten()), ci95: (low, high) }
        };
        let group =
            |(k, name): (usize, &String)| ForestGroup { label: name.clone(), color: Color::nth(k), estimates: own.iter().map(|p| estimate(p, k)).collect() };
        let data = Forest {
            quantity: "Value".to_owned(),
            unit: printed_unit(unit),
            scale: Scale::Linear,
            rows: own.iter().map(|p| p.name.clone()).collect(),
            groups: names.iter().enumerate().map(group).collect(),
            reference: Some((0.0, "zero".to_owned())),
        };
        section = section.figure(forest("compare", &format!("Parameters in {}", printed_unit(unit)), &data)?);
    }
    Ok(section)
}

/// Agreement of the sessions, one row a parameter.
fn sessions(result: &CompareResult) -> Table {
    let numbers = ["Mean", "ICC(2,1)", "95 % interval", "SEM", "Detectable change"];
    result.reliability.iter().fold(Table::new("Reliability of the sessions", ["Parameter", "Unit"], numbers), |table, r| {
        let short = |value: Option<f64>| significant(nan(value), 4);
        let interval = r.icc_ci95.map_or_else(|| "–".to_owned(), |[low, high]| format!("{} … {}", significant(low, 3), significant(high, 3)));
        table.row([
            r.name.clone(),
            printed_unit(&r.unit),
            short(r.mean),
            short(r.icc),
            interval,
            short(r.standard_error_of_measurement),
            short(r.minimal_detectable_change),
        ])
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndof_analysis::result::Head;

    fn parameter(name: &str, values: [f64; 2], p_value: f64) -> ParameterComparison {
        let difference = values[1] - values[0];
        ParameterComparison {
            name: name.into(),
            unit: "N/m".into(),
            values: values.map(Some).to_vec(),
            ci95: values.map(|value| Some([value - 5.0, value + 5.0])).to_vec(),
            differences: vec![Difference {
                value: Some(difference),
                std_error: Some(3.6),
                ci95: Some([difference - 7.1, difference + 7.1]),
                p_value: Some(p_value),
            }],
            standard_error_of_measurement: None,
            minimal_detectable_change: None,
        }
    }

    fn compared(p_values: [f64; 2]) -> Report {
        report_of(vec![parameter("K_x_x", [300.0, 360.0], p_values[0]), parameter("K_y_y", [500.0, 503.0], p_values[1])])
    }

    fn report_of(parameters: Vec<ParameterComparison>) -> Report {
        let result = CompareResult { head: Head::new(CompareResult::SCHEMA, "compare", Vec::new()), fits: 2, parameters, reliability: Vec::new() };
        compare_report(&result, &["before".to_owned(), "after".to_owned()], "Sessions", "ndof compare").unwrap()
    }

    #[test]
    fn the_lead_names_what_differs_and_nothing_else() {
        let report = compared([1e-9, 0.4]);
        assert_eq!(report.lead, "after: 1 of 2 parameters differ by more than chance explains: K_x_x from 300 to 360 N/m, by 60.0 ± 7.1.");
        assert_eq!(compared([0.2, 0.4]).lead, "after: none of the 2 parameters differs by more than chance explains.");
    }

    #[test]
    fn of_many_differences_the_lead_names_the_clearest() {
        let parameters = (1..=5).map(|k| parameter(&format!("K_{k}_{k}"), [300.0, 300.0 + 20.0 * f64::from(k)], 1e-6)).collect();
        let lead = report_of(parameters).lead;
        assert!(lead.starts_with("after: 5 of 5 parameters differ by more than chance explains, most clearly K_5_5 from 300 to 400 N/m"), "{lead}");
        assert!(lead.contains("K_3_3") && !lead.contains("K_2_2"), "{lead}");
    }

    #[test]
    fn every_parameter_has_its_row_and_every_unit_its_picture() {
        let report = compared([1e-9, 0.4]);
        let html = report.to_html();
        for what in ["K_x_x", "K_y_y", "300.0 ± 5.0", "differs", "after less before"] {
            assert!(html.contains(what), "{what}");
        }
        assert_eq!(report.figures().count(), 1);
    }
}
