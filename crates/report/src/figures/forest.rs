//! Estimates with their intervals, row by row: parameters before and after, left and right, subject by subject.

use super::error::{FigureError, expect_shape};
use crate::number::with_half_width;
use crate::plot::{Axis, Color, Dash, Figure, Panel, Scale, Series};
use crate::table::Table;

/// An estimate; NaN where there is none.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Estimate {
    /// The value.
    pub value: f64,
    /// Its 95 % interval; NaN for none.
    pub ci95: (f64, f64),
}

/// One estimate a row, under one label.
#[derive(Debug, Clone, PartialEq)]
pub struct ForestGroup {
    /// As in the legend, e.g. "before".
    pub label: String,
    /// Its colour.
    pub color: Color,
    /// One a row.
    pub estimates: Vec<Estimate>,
}

/// Rows of estimates over one axis.
#[derive(Debug, Clone, PartialEq)]
pub struct Forest {
    /// What the axis shows.
    pub quantity: String,
    /// Its unit.
    pub unit: String,
    /// Even or logarithmic.
    pub scale: Scale,
    /// Names of the rows, from top to bottom.
    pub rows: Vec<String>,
    /// From top to bottom within each row.
    pub groups: Vec<ForestGroup>,
    /// A vertical line with its label, e.g. (0, "no difference").
    pub reference: Option<(f64, String)>,
}

/// A forest plot: a dot for each estimate and a line for its interval.
///
/// # Errors
/// [`FigureError`] without rows, or where a group does not have one estimate a row.
pub fn forest(name: &str, title: &str, data: &Forest) -> Result<Figure, FigureError> {
    if data.rows.is_empty() {
        return Err(FigureError::Empty { what: "the list of rows" });
    }
    let x = Axis { scale: data.scale, ..Axis::linear(data.quantity.as_str(), data.unit.as_str()) };
    let mut panel = Panel::new(x, Axis::names(data.rows.clone()));
    let groups = if crowded(data) { data.groups.len() as f64 } else { 1.0 };
    let row_height = if data.rows.len() > 40 { 9.0 + 5.0 * groups } else { 12.0 + 12.0 * groups };
    panel.height = row_height * data.rows.len() as f64;
    if let Some((at, label)) = &data.reference {
        panel.series.push(Series::line(label.as_str(), vec![*at, *at], vec![0.0, data.rows.len() as f64], Color::Grey).dash(Dash::Dashed));
    }
    for (index, group) in data.groups.iter().enumerate() {
        expect_shape(format!("the group \"{}\"", group.label), "rows", &[data.rows.len()], &[group.estimates.len()])?;
        if group.estimates.iter().all(|estimate| estimate.value.is_nan()) {
            continue;
        }
        let offset = if groups > 1.0 { 0.7 * ((groups - 1.0) / 2.0 - index as f64) / groups } else { 0.0 };
        let height = |row: usize| panel.y.row(row) + offset;
        let (mut across, mut along) = (Vec::new(), Vec::new());
        for (row, estimate) in group.estimates.iter().enumerate().filter(|(_, estimate)| estimate.ci95.0.is_finite() && estimate.ci95.1.is_finite()) {
            across.extend([estimate.ci95.0, estimate.ci95.1, f64::NAN]);
            along.extend([height(row), height(row), f64::NAN]);
        }
        let heights = (0..group.estimates.len()).map(height).collect();
        let values: Vec<f64> = group.estimates.iter().map(|estimate| estimate.value).collect();
        if !across.is_empty() {
            panel.series.push(Series::line(group.label.as_str(), across, along, group.color));
        }
        panel.series.push(Series::points(group.label.as_str(), values, heights, group.color));
    }
    let mut figure = Figure::new(name, title).panel("", panel);
    figure.table = Some(table(title, data));
    Ok(figure)
}

/// Whether groups would lie on each other in one line: only if a row has several intervals.
fn crowded(data: &Forest) -> bool {
    let wide = |row: usize| data.groups.iter().filter(|group| group.estimates.get(row).is_some_and(|estimate| estimate.ci95.0.is_finite())).count();
    (0..data.rows.len()).any(|row| wide(row) > 1)
}

fn table(title: &str, data: &Forest) -> Table {
    let unit = if data.unit.is_empty() { data.quantity.clone() } else { format!("{} [{}]", data.quantity, data.unit) };
    let mut table = Table::new(format!("{title}: {unit}"), [""], data.groups.iter().map(|group| group.label.as_str()));
    for (row, name) in data.rows.iter().enumerate() {
        let of_group = |group: &ForestGroup| match group.estimates.get(row) {
            Some(estimate) => with_half_width(estimate.value, 0.5 * (estimate.ci95.1 - estimate.ci95.0)),
            None => String::new(),
        };
        table.rows.push(std::iter::once(name.clone()).chain(data.groups.iter().map(of_group)).collect());
    }
    table
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plot::Mark;

    fn data() -> Forest {
        let estimate = |value: f64| Estimate { value, ci95: (value - 5.0, value + 5.0) };
        let unknown = Estimate { value: f64::NAN, ci95: (f64::NAN, f64::NAN) };
        Forest {
            quantity: "Stiffness".into(),
            unit: "N/m".into(),
            scale: Scale::Linear,
            rows: vec!["K_x_x".into(), "K_y_y".into()],
            groups: vec![
                ForestGroup { label: "before".into(), color: Color::Grey, estimates: vec![estimate(300.0), estimate(520.0)] },
                ForestGroup { label: "after".into(), color: Color::Blue, estimates: vec![estimate(280.0), unknown] },
            ],
            reference: None,
        }
    }

    #[test]
    fn the_first_row_is_on_top_and_groups_stand_below_each_other() {
        let figure = forest("f", "Shift", &data()).unwrap();
        let panel = &figure.cells[0].panels[0];
        let heights: Vec<_> = panel.series.iter().filter_map(|series| if let Mark::Points { y, .. } = &series.mark { Some(y.clone()) } else { None }).collect();
        assert!(heights[0][0] > heights[0][1] && heights[0][0] > heights[1][0] && heights[1][0] > heights[0][1]);
        assert!(figure.to_svg().contains(">K_x_x</text>"));
        assert_eq!(figure.table.as_ref().unwrap().rows[1], ["K_y_y", "520.0 ± 5.0", "– ± –"]);
    }

    #[test]
    fn a_group_without_a_value_is_not_in_the_legend() {
        let mut none = data();
        none.groups[0].estimates = vec![Estimate { value: f64::NAN, ci95: (f64::NAN, f64::NAN) }; 2];
        let labels: Vec<_> = forest("f", "", &none).unwrap().cells[0].panels[0].series.iter().map(|series| series.label.clone()).collect();
        assert_eq!(labels, ["after", "after"]);
    }

    #[test]
    fn a_group_with_a_row_too_few_is_refused() {
        let mut wrong = data();
        wrong.groups[1].estimates.pop();
        assert!(forest("f", "", &wrong).unwrap_err().to_string().contains("after"));
    }
}
