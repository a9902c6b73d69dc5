//! Tables, and the table of parameters with their intervals.

use crate::number::{printed_unit, to_interval, with_half_width};
use crate::plot::escape;
use ndof_analysis::ComparedParameter;

/// Tables whose cells are no longer than this are not wrapped: on a narrow screen they scroll.
const ONE_LINE: usize = 34;

/// How a column stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Align {
    /// Words.
    Left,
    /// Numbers.
    Right,
}

/// A table of finished words.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Table {
    /// What it shows; read out before it.
    pub caption: String,
    /// Head and alignment of each column; the first names the row.
    pub columns: Vec<(String, Align)>,
    /// Rows; missing cells are empty.
    pub rows: Vec<Vec<String>>,
}

impl Table {
    /// A table without rows: its columns of words, then those of numbers.
    pub fn new<W: Into<String>, N: Into<String>>(caption: impl Into<String>, words: impl IntoIterator<Item = W>, numbers: impl IntoIterator<Item = N>) -> Self {
        let words = words.into_iter().map(|head| (head.into(), Align::Left));
        let columns = words.chain(numbers.into_iter().map(|head| (head.into(), Align::Right))).collect();
        Self { caption: caption.into(), columns, rows: Vec::new() }
    }

    /// With a last column of words.
    pub fn remarks(mut self, head: &str) -> Self {
        self.columns.push((head.to_owned(), Align::Left));
        self
    }

    /// With a row more.
    pub fn row<T: Into<String>>(mut self, cells: impl IntoIterator<Item = T>) -> Self {
        self.rows.push(cells.into_iter().map(Into::into).collect());
        self
    }

    pub(crate) fn to_html(&self) -> String {
        let class = |k: usize| if self.columns.get(k).is_some_and(|column| column.1 == Align::Right) { " class=\"number\"" } else { "" };
        let heads: String = self.columns.iter().enumerate().map(|(k, (head, _))| format!("<th scope=\"col\"{}>{}</th>", class(k), escape(head))).collect();
        let mut rows = String::new();
        for row in &self.rows {
            rows += "<tr>";
            for k in 0..self.columns.len() {
                let text = escape(row.get(k).map(String::as_str).unwrap_or_default());
                rows += &if k == 0 { format!("<th scope=\"row\">{text}</th>") } else { format!("<td{}>{text}</td>", class(k)) };
            }
            rows += "</tr>\n";
        }
        let compact = self.rows.iter().flatten().all(|cell| cell.chars().count() <= ONE_LINE);
        format!(
            "<div class=\"{}\" tabindex=\"0\" role=\"group\" aria-label=\"{c}\"><table><caption>{c}</caption><thead><tr>{heads}</tr></thead>\n<tbody>{rows}</tbody></table></div>\n",
            if compact { "table compact" } else { "table" },
            c = escape(&self.caption)
        )
    }
}

/// Parameters with unit, truth (if any is known), estimate ± half of the 95 % interval, the interval and what to
/// make of it. The interval decides the digits of every number in its row.
pub fn parameter_table(caption: impl Into<String>, parameters: &[ComparedParameter]) -> Table {
    let with_truth = parameters.iter().any(|parameter| parameter.truth.is_some());
    let numbers = with_truth.then_some("Simulated").into_iter().chain(["Estimate", "95 % interval"]);
    let mut table = Table::new(caption, ["Parameter", "Unit"], numbers).remarks(if with_truth { "Simulated is" } else { "" });
    for parameter in parameters {
        let [low, high] = parameter.ci95.unwrap_or([f64::NAN; 2]);
        let half = 0.5 * (high - low);
        let mut row = vec![parameter.name.clone(), printed_unit(&parameter.unit)];
        if with_truth {
            row.push(parameter.truth.map(|truth| to_interval(truth, half)).unwrap_or_default());
        }
        row.push(with_half_width(parameter.value.unwrap_or(f64::NAN), half));
        row.push(format!("{} … {}", to_interval(low, half), to_interval(high, half)));
        row.push(judgement(parameter).to_string());
        table.rows.push(row);
    }
    table
}

fn judgement(parameter: &ComparedParameter) -> &'static str {
    let [low, high] = parameter.ci95.unwrap_or([f64::NAN; 2]);
    match parameter.truth {
        _ if !parameter.identifiable => "not identifiable from these data",
        Some(truth) if low <= truth && truth <= high => "inside",
        Some(_) if low.is_finite() && high.is_finite() => "outside",
        None if low <= 0.0 && 0.0 <= high => "not different from 0",
        _ => "",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parameter(truth: Option<f64>) -> ComparedParameter {
        ComparedParameter { name: "K_x_x".into(), unit: "N/m".into(), truth, value: Some(302.44), ci95: Some([297.3, 307.5]), identifiable: true }
    }

    #[test]
    fn a_row_shows_the_truth_to_the_digits_of_the_interval() {
        let table = parameter_table("Fit", &[parameter(Some(300.0))]);
        assert_eq!(table.rows[0], ["K_x_x", "N/m", "300.0", "302.4 ± 5.1", "297.3 … 307.5", "inside"]);
    }

    #[test]
    fn without_truth_there_is_no_column_for_it() {
        let table = parameter_table("Fit", &[parameter(None)]);
        assert_eq!((table.columns.len(), table.rows[0].len()), (5, 5));
    }

    #[test]
    fn what_the_data_do_not_say_is_said() {
        let mut blind = parameter(Some(300.0));
        blind.identifiable = false;
        assert_eq!(judgement(&blind), "not identifiable from these data");
        assert_eq!(judgement(&ComparedParameter { ci95: Some([310.0, 320.0]), ..parameter(Some(300.0)) }), "outside");
        assert_eq!(judgement(&ComparedParameter { ci95: Some([-1.0, 1.0]), ..parameter(None) }), "not different from 0");
    }

    #[test]
    fn names_from_recordings_are_escaped() {
        let html = Table::new("a & b", ["<h>"], ["v"]).row(["<script>", "1"]).to_html();
        assert!(html.contains("&lt;script&gt;") && html.contains("a &amp; b") && html.contains("&lt;h&gt;") && !html.contains("<script"));
    }
}
