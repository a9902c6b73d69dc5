//! What was hidden against what was named.

use super::error::{FigureError, expect_shape};
use crate::plot::{Axis, Color, Figure, Panel, Pin, Series};
use crate::table::{Align, Table};

/// With no more columns than this, half the width is enough.
const NARROW: usize = 14;

/// Counts by truth and answer, as squares whose area is the share of the row (Hinton's diagram): blue where the
/// answer is the truth, vermillion where it is not. Columns carry the numbers of the rows.
///
/// `counts[truth][answer]`; there may be more answers than truths ("nothing", "unexplained"), named in `answers`,
/// whose first entries are the truths in the same order.
///
/// # Errors
/// [`FigureError`] without a truth, or where a row does not have one count an answer.
pub fn confusion(name: &str, title: &str, truths: &[String], answers: &[String], counts: &[Vec<usize>]) -> Result<Figure, FigureError> {
    if truths.is_empty() || answers.is_empty() {
        return Err(FigureError::Empty { what: "the list of truths or of answers" });
    }
    expect_shape("the table of counts", "truths", &[truths.len()], &[counts.len()])?;
    let numbered = truths.iter().enumerate().map(|(k, truth)| format!("{truth}  {}", k + 1)).collect();
    let columns = Axis { label: "Named".to_string(), ..Axis::names((1..=answers.len()).map(|k| k.to_string()).collect()) };
    let mut panel = Panel::new(columns, Axis::names(numbered)).height(22.0 * truths.len() as f64);
    let mut squares = [(Vec::new(), Vec::new()), (Vec::new(), Vec::new())];
    for (truth, row) in counts.iter().enumerate() {
        expect_shape(format!("the counts of \"{}\"", truths[truth]), "answers", &[answers.len()], &[row.len()])?;
        let all: usize = row.iter().sum();
        for (answer, &count) in row.iter().enumerate().filter(|(_, count)| **count > 0) {
            let half = 0.47 * (count as f64 / all as f64).sqrt();
            let (x, y) = (answer as f64 + 0.5, panel.y.row(truth));
            let (across, along) = &mut squares[usize::from(answer != truth)];
            across.extend([x - half, x + half, x + half, x - half, f64::NAN]);
            along.extend([y - half, y - half, y + half, y + half, f64::NAN]);
            panel.pins.push(Pin { x, y, label: count.to_string(), centred: true });
        }
    }
    for ((across, along), (label, color)) in squares.into_iter().zip([("right", Color::Blue), ("wrong", Color::Vermillion)]) {
        panel.series.push(Series::area(label, across, along, color));
    }
    let others = answers.iter().enumerate().skip(truths.len()).map(|(k, answer)| format!("{} {answer}", k + 1)).collect::<Vec<_>>().join(", ");
    let others = if others.is_empty() { others } else { format!(" Further columns: {others}.") };
    let caption = format!("Rows: what was hidden; columns: what was named, by the rows' numbers. Areas are shares of the row, numbers are cases.{others}");
    let mut figure = Figure::new(name, title).caption(caption).columns(if answers.len() <= NARROW { 2 } else { 1 }).panel("", panel);
    figure.table = Some(table(title, truths, answers, counts));
    Ok(figure)
}

/// One row a pair that occurred, most frequent first within each truth.
fn table(title: &str, truths: &[String], answers: &[String], counts: &[Vec<usize>]) -> Table {
    let mut table = Table::new(title, &[("Hidden", Align::Left), ("Named", Align::Left), ("Cases", Align::Right), ("Share [%]", Align::Right)]);
    for (truth, row) in truths.iter().zip(counts) {
        let all: usize = row.iter().sum();
        let mut pairs: Vec<(&String, usize)> = answers.iter().zip(row.iter().copied()).filter(|pair| pair.1 > 0).collect();
        pairs.sort_by_key(|pair| std::cmp::Reverse(pair.1));
        for (answer, count) in pairs {
            table = table.row([truth.clone(), answer.clone(), count.to_string(), format!("{:.1}", 100.0 * count as f64 / all as f64)]);
        }
    }
    table
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn areas_are_shares_of_the_row() {
        let names = |names: &[&str]| names.iter().map(|name| name.to_string()).collect::<Vec<_>>();
        let (truths, answers) = (names(&["friction", "delay"]), names(&["friction", "delay", "nothing"]));
        let figure = confusion("c", "Confusion", &truths, &answers, &[vec![75, 0, 25], vec![0, 10, 0]]).unwrap();
        let right = &figure.cells[0].panels[0].series[0].mark;
        let x = right.x();
        let side = |square: usize| x[5 * square + 1] - x[5 * square];
        assert!((side(0).powi(2) / side(1).powi(2) - 0.75).abs() < 1e-12);
        assert_eq!(figure.table.as_ref().unwrap().rows[1], ["friction", "nothing", "25", "25.0"]);
        assert!(figure.caption.contains("3 nothing"));
    }

    #[test]
    fn a_row_that_is_too_short_is_refused_by_name() {
        let names = vec!["friction".to_string()];
        assert!(confusion("c", "", &names, &names, &[vec![]]).unwrap_err().to_string().contains("friction"));
    }
}
