//! How much of the outputs the inputs explain, by frequency.

use std::sync::Arc;

use ndarray::{Array2, Array3, Axis as Dimension};

use super::bode::element;
use super::entries;
use super::error::{FigureError, expect_shape};
use super::frequency::{frequency_axis, positive_extent};
use crate::plot::{Axis, Color, Dash, Figure, Panel, Series};

/// Coherences of one estimate (magnitude-squared, uncorrected); shapes `[output][input][frequency]`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Coherences<'a> {
    /// Ascending.
    pub frequency_hz: &'a [f64],
    /// Names of the columns.
    pub inputs: &'a [String],
    /// Names of the rows.
    pub outputs: &'a [String],
    /// γ² of each output with each input.
    pub ordinary: &'a Array3<f64>,
    /// The same, given all other inputs.
    pub partial: &'a Array3<f64>,
    /// Of each output with all inputs together, `[output][frequency]`.
    pub multiple: &'a Array2<f64>,
    /// Above this, a partial coherence is not chance (95 %).
    pub significance_95: Option<f64>,
}

/// The matrix of partial and ordinary coherences, with the multiple coherence of the row behind and the threshold
/// of significance.
///
/// # Errors
/// [`FigureError::Shape`] where a table does not fit the names and frequencies.
pub fn coherence(name: &str, title: &str, data: Coherences<'_>) -> Result<Figure, FigureError> {
    let shape = [data.outputs.len(), data.inputs.len(), data.frequency_hz.len()];
    let meaning = "outputs × inputs × frequencies";
    expect_shape("the ordinary coherence", meaning, &shape, data.ordinary.shape())?;
    expect_shape("the partial coherence", meaning, &shape, data.partial.shape())?;
    expect_shape("the multiple coherence", "outputs × frequencies", &[shape[0], shape[2]], data.multiple.shape())?;
    let frequency: Arc<[f64]> = data.frequency_hz.into();
    let band = positive_extent(&frequency);
    let several = data.inputs.len() > 1;
    let mut figure = Figure::new(name, title).columns(data.inputs.len()).caption(if several {
        "Share of an output's power that is linear in one input: partial (other inputs taken off) and ordinary; multiple: in all inputs together. 1 is perfect."
    } else {
        "Share of the output's power that is linear in the input. 1 is perfect."
    });
    for (row, column, title) in entries(data.outputs, data.inputs) {
        let mut panel = unit_panel(band, if data.inputs.len() > 3 { 90.0 } else { 120.0 });
        if several {
            let multiple = data.multiple.index_axis(Dimension(0), row).to_vec();
            panel.series.push(Series::line("multiple", frequency.clone(), multiple, Color::Grey));
            panel.series.push(Series::line("ordinary", frequency.clone(), element(data.ordinary, row, column).to_vec(), Color::Orange).dash(Dash::Dashed));
            panel.series.push(Series::line("partial", frequency.clone(), element(data.partial, row, column).to_vec(), Color::Blue));
        } else {
            panel.series.push(Series::line("coherence", frequency.clone(), element(data.ordinary, row, column).to_vec(), Color::Blue));
        }
        if let Some(threshold) = data.significance_95 {
            panel = panel.rule(threshold, if row + column == 0 { "95 % significance" } else { "" });
        }
        figure = figure.panel(title, panel);
    }
    Ok(figure)
}

/// Coherence of each pair of inputs (they should be independent): one panel a pair.
///
/// `coherence` has the shape `[input][input][frequency]`. With one input there is no pair and no figure.
///
/// # Errors
/// [`FigureError::Shape`] where the table does not fit.
pub fn input_coherence(
    name: &str,
    frequency_hz: &[f64],
    inputs: &[String],
    coherence: &Array3<f64>,
    significance_95: Option<f64>,
) -> Result<Option<Figure>, FigureError> {
    let count = inputs.len();
    expect_shape("the coherence between inputs", "inputs × inputs × frequencies", &[count, count, frequency_hz.len()], coherence.shape())?;
    let frequency: Arc<[f64]> = frequency_hz.into();
    let band = positive_extent(frequency_hz);
    let mut panel = unit_panel(band, 130.0);
    let mut k = 0;
    for first in 0..count {
        for second in first + 1..count {
            let values = element(coherence, first, second).to_vec();
            panel.series.push(Series::line(format!("{} and {}", inputs[first], inputs[second]), frequency.clone(), values, Color::nth(k)));
            k += 1;
        }
    }
    if k == 0 {
        return Ok(None);
    }
    if let Some(threshold) = significance_95 {
        panel = panel.rule(threshold, "95 % significance");
    }
    let caption = "What two inputs share cannot be told apart in the response: low is good.";
    Ok(Some(Figure::new(name, "Coherence between inputs").caption(caption).panel("", panel)))
}

fn unit_panel(band: Option<(f64, f64)>, height: f64) -> Panel {
    Panel::new(frequency_axis(band), Axis::linear("Coherence γ²", "").range(0.0, 1.02)).height(height)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(names: &[&str]) -> Vec<String> {
        names.iter().map(|name| name.to_string()).collect()
    }

    /// The figure of so many outputs and inputs, whose multiple coherence is known at `multiple` frequencies.
    fn drawn(p: usize, q: usize, multiple: usize) -> Result<Figure, FigureError> {
        let frequency_hz: Vec<f64> = (1..30).map(f64::from).collect();
        let f = frequency_hz.len();
        let (inputs, outputs) = (names(&["x", "y", "z"][..q]), names(&["x", "y", "z"][..p]));
        let (ordinary, partial) = (Array3::from_elem((p, q, f), 0.6), Array3::from_elem((p, q, f), 0.9));
        let multiple = Array2::from_elem((p, multiple), 0.95);
        let data = Coherences {
            frequency_hz: &frequency_hz,
            inputs: &inputs,
            outputs: &outputs,
            ordinary: &ordinary,
            partial: &partial,
            multiple: &multiple,
            significance_95: Some(0.3),
        };
        coherence("c", "Coherence", data)
    }

    #[test]
    fn the_matrix_need_not_be_square_and_shows_all_three_coherences() {
        let figure = drawn(2, 3, 29).unwrap();
        assert_eq!((figure.cells.len(), figure.columns), (6, 3));
        assert!(figure.cells.iter().all(|cell| cell.panels[0].series.len() == 3 && cell.panels[0].rules.len() == 1));
        assert_eq!(drawn(1, 1, 29).unwrap().cells[0].panels[0].series.len(), 1);
    }

    #[test]
    fn three_inputs_make_three_pairs_and_one_input_none() {
        let figure = input_coherence("i", &[1.0, 2.0], &names(&["x", "y", "z"]), &Array3::zeros((3, 3, 2)), None).unwrap().unwrap();
        assert_eq!(figure.cells[0].panels[0].series.len(), 3);
        assert_eq!(input_coherence("i", &[1.0], &names(&["x"]), &Array3::zeros((1, 1, 1)), None), Ok(None));
    }

    #[test]
    fn a_table_that_does_not_fit_is_refused() {
        assert!(drawn(2, 2, 3).unwrap_err().to_string().contains("multiple coherence"));
    }
}
