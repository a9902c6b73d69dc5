//! The numbers behind a figure, thinned to what one can read (or listen to).

use std::sync::Arc;

use crate::number::significant;
use crate::plot::{Cell, Figure, Mark, Panel, Series};
use crate::table::{Align, Table};

/// Rows of a table; fewer where there are many tables.
const MOST_ROWS: usize = 16;
const FEWEST_ROWS: usize = 6;

/// One table a cell and abscissa.
pub(super) fn data_tables(figure: &Figure) -> Vec<Table> {
    let rows = if figure.cells.len() > 16 { FEWEST_ROWS } else { MOST_ROWS };
    figure.cells.iter().flat_map(|cell| cell_tables(figure, cell, rows)).collect()
}

fn cell_tables(figure: &Figure, cell: &Cell, rows: usize) -> Vec<Table> {
    let mut abscissae: Vec<&Arc<[f64]>> = Vec::new();
    for series in cell.panels.iter().flat_map(|panel| &panel.series) {
        if !abscissae.iter().any(|x| same(x, series.mark.x())) {
            abscissae.push(series.mark.x());
        }
    }
    abscissae.into_iter().map(|x| table_over(figure, cell, x, rows)).collect()
}

/// One abscissa, also where it holds NaN, which equals nothing.
fn same(a: &Arc<[f64]>, b: &Arc<[f64]>) -> bool {
    Arc::ptr_eq(a, b) || a == b
}

fn table_over(figure: &Figure, cell: &Cell, x: &Arc<[f64]>, rows: usize) -> Table {
    let of_cell = if cell.title.is_empty() { figure.title.clone() } else { format!("{}, {}", figure.title, cell.title) };
    let picked = pick(cell.panels.first(), x, rows);
    let caption = if picked.len() < x.len() { format!("{of_cell} ({} of {} rows; the CSV file has all)", picked.len(), x.len()) } else { of_cell };
    let head = cell.panels.first().map(|panel| panel.x.caption()).unwrap_or_default();
    let mut table = Table::new(caption, [head], [""; 0]);
    table.rows = picked.iter().map(|&k| vec![significant(x[k], 3)]).collect();
    for panel in &cell.panels {
        let mut labels: Vec<&str> = Vec::new();
        for series in panel.series.iter().filter(|series| same(series.mark.x(), x) && !matches!(series.mark, Mark::Area { .. })) {
            if !labels.contains(&series.label.as_str()) {
                labels.push(&series.label);
            }
        }
        for label in labels {
            table.columns.push((format!("{}: {label}", panel.y.caption()), Align::Right));
            for (row, &k) in table.rows.iter_mut().zip(&picked) {
                row.push(value_and_interval(panel, label, x, k));
            }
        }
    }
    table
}

/// "3.1 [2.9, 3.4]" from the line and the band of one label.
fn value_and_interval(panel: &Panel, label: &str, x: &Arc<[f64]>, k: usize) -> String {
    let of_label = |series: &&Series| series.label == label && same(series.mark.x(), x);
    let mut words = Vec::new();
    for series in panel.series.iter().filter(of_label) {
        match &series.mark {
            Mark::Line { y, .. } | Mark::Points { y, .. } | Mark::Steps { y, .. } => {
                if let Some(value) = y.get(k) {
                    words.insert(0, significant(*value, 3));
                }
            }
            Mark::Area { .. } => {}
            Mark::Band { low, high, .. } => {
                if let (Some(low), Some(high)) = (low.get(k), high.get(k)) {
                    words.push(format!("[{}, {}]", significant(*low, 3), significant(*high, 3)));
                }
            }
        }
    }
    words.join(" ")
}

/// Places of at most `rows` abscissae, spread evenly over the axis as it is drawn.
fn pick(panel: Option<&Panel>, x: &[f64], rows: usize) -> Vec<usize> {
    if x.len() <= rows {
        return (0..x.len()).collect();
    }
    let Some(panel) = panel else { return Vec::new() };
    let (low, high) = panel.x.resolve(x.iter().copied());
    let (low, high) = (panel.x.scale.forward(low), panel.x.scale.forward(high));
    let even: Vec<f64> = x.iter().map(|x| panel.x.scale.forward(*x)).collect();
    let mut picked = Vec::new();
    for row in 0..rows {
        let wanted = low + (high - low) * row as f64 / (rows - 1) as f64;
        let away = |k: &usize| (even[*k] - wanted).abs();
        picked.extend((0..x.len()).min_by(|a, b| away(a).total_cmp(&away(b))).filter(|nearest| !picked.contains(nearest)));
    }
    picked
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plot::{Axis, Color};

    #[test]
    fn the_table_spreads_its_rows_as_the_axis_does_and_joins_value_and_interval() {
        let x: Arc<[f64]> = (1..=1000).map(f64::from).collect();
        let y: Vec<f64> = x.iter().map(|x| 2.0 * x).collect();
        let panel = Panel::new(Axis::log("Frequency", "Hz"), Axis::log("Gain", "m/N"))
            .with(Series::band("a", x.clone(), y.iter().map(|y| 0.9 * y).collect(), y.iter().map(|y| 1.1 * y).collect(), Color::Blue))
            .with(Series::line("a", x, y, Color::Blue));
        let tables = data_tables(&Figure::new("f", "F").panel("p", panel));
        assert_eq!(tables.len(), 1);
        let table = &tables[0];
        assert!(table.rows.len() <= MOST_ROWS && table.rows.len() > 10);
        assert_eq!(table.rows[0], ["1.00", "2.00 [1.80, 2.20]"]);
        assert_eq!(table.rows.last().unwrap()[0], "1000");
        assert!(table.rows[4][0].starts_with("6."), "the fifth of sixteen rows over three decades: {}", table.rows[4][0]);
    }
}
