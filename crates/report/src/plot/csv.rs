//! The numbers behind a figure as a table.

use std::sync::Arc;

use super::figure::Figure;

/// A field, quoted where it must be (RFC 4180).
fn field(text: &str) -> String {
    if text.contains([',', '"', '\n', '\r']) { format!("\"{}\"", text.replace('"', "\"\"")) } else { text.to_string() }
}

fn number(value: Option<&f64>) -> String {
    value.filter(|value| value.is_finite()).map(f64::to_string).unwrap_or_default()
}

/// Points of a series that are written at the most.
const MOST_POINTS: usize = 5000;

struct Column<'a> {
    cell: &'a str,
    quantity: String,
    label: String,
    x: &'a Arc<[f64]>,
    values: &'a [f64],
}

impl Figure {
    fn data_columns(&self) -> Vec<Column<'_>> {
        let mut columns = Vec::new();
        for cell in &self.cells {
            for panel in &cell.panels {
                if let Some(shades) = &panel.shades {
                    let rows = shades.y.iter().zip(&shades.value);
                    let quantity = panel.y.caption();
                    columns.extend(rows.map(|(y, values)| Column {
                        cell: &cell.title,
                        quantity: quantity.clone(),
                        label: y.to_string(),
                        x: &shades.x,
                        values,
                    }));
                }
                for series in &panel.series {
                    for (end, values) in series.mark.columns() {
                        let label = if end.is_empty() { series.label.clone() } else { format!("{} {end}", series.label) };
                        columns.push(Column { cell: &cell.title, quantity: panel.y.caption(), label, x: series.mark.x(), values });
                    }
                }
            }
        }
        columns
    }

    /// The data of the figure: one row an abscissa where all series share it, else one row a point.
    ///
    /// A series of more than 5000 points (a trace, which the recording holds in full) is thinned evenly, and a comment in
    /// the first line says so.
    /// Numbers are written so that they read back exactly; what does not exist is empty.
    pub fn to_csv(&self) -> String {
        let columns = self.data_columns();
        let Some(first) = columns.first() else { return String::new() };
        let abscissa = self.cells.iter().flat_map(|cell| &cell.panels).next().map(|panel| panel.x.caption()).unwrap_or_default();
        let step = |len: usize| len.div_ceil(MOST_POINTS).max(1);
        let longest = columns.iter().map(|column| column.x.len()).max().unwrap_or(0);
        let mut text = match step(longest) {
            1 => String::new(),
            every => format!("# of series longer than {MOST_POINTS} points one point in {every} is written; the recording has all\n"),
        };
        if columns.iter().all(|column| Arc::ptr_eq(column.x, first.x) || column.x == first.x) {
            let heads = columns.iter().map(|column| field(&[column.cell, &column.quantity, &column.label].join(" | ")));
            text += &std::iter::once(field(&abscissa)).chain(heads).collect::<Vec<_>>().join(",");
            text.push('\n');
            for (row, x) in first.x.iter().enumerate().step_by(step(first.x.len())) {
                let values = columns.iter().map(|column| number(column.values.get(row)));
                text += &std::iter::once(number(Some(x))).chain(values).collect::<Vec<_>>().join(",");
                text.push('\n');
            }
            return text;
        }
        text += &format!("cell,quantity,series,{},value\n", field(&abscissa));
        for column in &columns {
            let head = [column.cell, &column.quantity, &column.label].map(field).join(",");
            for (x, value) in column.x.iter().zip(column.values).step_by(step(column.x.len())) {
                text += &format!("{head},{},{}\n", number(Some(x)), number(Some(value)));
            }
        }
        text
    }
}

#[cfg(test)]
mod tests {
    use crate::plot::{Axis, Color, Figure, Panel, Series};

    fn panel(x: Vec<f64>) -> Panel {
        let y = x.iter().map(|x| 1.0 / x).collect();
        Panel::new(Axis::log("Frequency", "Hz"), Axis::log("Gain", "m/N")).with(Series::line("a,b", x, y, Color::Blue))
    }

    #[test]
    fn shared_abscissae_give_one_row_each_and_gaps_stay_empty() {
        let figure = Figure::new("f", "").panel("p", panel(vec![1.0, 0.0, 3.0])).panel("q", panel(vec![1.0, 0.0, 3.0]));
        assert_eq!(figure.to_csv(), "Frequency [Hz],\"p | Gain [m/N] | a,b\",\"q | Gain [m/N] | a,b\"\n1,1,1\n0,,\n3,0.3333333333333333,0.3333333333333333\n");
    }

    #[test]
    fn a_long_trace_is_thinned_and_says_so() {
        let figure = Figure::new("f", "").panel("p", panel((1..=10_001).map(f64::from).collect()));
        let text = figure.to_csv();
        assert!(text.starts_with("# of series longer than 5000 points one point in 3"), "{}", &text[..80]);
        assert_eq!(text.lines().count(), 2 + 10_001_usize.div_ceil(3));
    }

    #[test]
    fn different_abscissae_give_one_row_a_point() {
        let figure = Figure::new("f", "").panel("p", panel(vec![1.0])).panel("q", panel(vec![2.0]));
        assert_eq!(figure.to_csv(), "cell,quantity,series,Frequency [Hz],value\np,Gain [m/N],\"a,b\",1,1\nq,Gain [m/N],\"a,b\",2,0.5\n");
        assert_eq!(Figure::new("f", "").to_csv(), "");
    }
}
