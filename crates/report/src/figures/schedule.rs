//! What changes over a schedule, with its bands.

use super::error::{FigureError, expect_shape};
use crate::plot::{Axis, Color, Dash, Figure, Panel, Series};
use std::sync::Arc;

/// One curve.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ScheduleCurve {
    /// Its name.
    pub label: String,
    /// Its unit.
    pub unit: String,
    /// Its values.
    pub value: Vec<f64>,
    /// Ends of the interval at each place by itself, where there is one.
    pub ci95: Option<[Vec<f64>; 2]>,
    /// Ends of the band that holds the whole curve, where there is one.
    pub band95: Option<[Vec<f64>; 2]>,
    /// What it is compared with: its name and its values, as those of a constant model or of a simulation.
    pub references: Vec<(String, Vec<f64>)>,
}

/// Curves over one abscissa.
#[derive(Debug, Clone, PartialEq)]
pub struct ScheduleCurves {
    /// What the abscissa is, with its unit.
    pub axis: (String, String),
    /// Where the curves are given.
    pub at: Vec<f64>,
    /// From top to bottom, row by row.
    pub curves: Vec<ScheduleCurve>,
    /// Curves side by side.
    pub columns: usize,
}

/// Each curve in a panel of its own: the interval at each place inside the band that holds the whole of it.
///
/// # Errors
/// [`FigureError::Shape`] where a curve is not as long as the abscissa.
pub fn schedule(name: &str, title: &str, data: &ScheduleCurves) -> Result<Figure, FigureError> {
    let at: Arc<[f64]> = data.at.clone().into();
    let mut figure = Figure::new(name, title).columns(data.columns);
    for curve in &data.curves {
        let columns = std::iter::once(&curve.value).chain(curve.ci95.iter().flatten()).chain(curve.band95.iter().flatten());
        for values in columns {
            expect_shape(format!("\"{}\"", curve.label), "places", &[at.len()], &[values.len()])?;
        }
        let mut panel = Panel::new(Axis::linear(data.axis.0.as_str(), data.axis.1.as_str()), Axis::linear(curve.label.as_str(), curve.unit.as_str()));
        panel.height = 150.0;
        if let Some([low, high]) = &curve.band95 {
            panel.series.push(Series::band("95 % band of the whole curve", at.clone(), low.clone(), high.clone(), Color::Grey));
        }
        if let Some([low, high]) = &curve.ci95 {
            panel.series.push(Series::band("95 % interval at each place", at.clone(), low.clone(), high.clone(), Color::Blue));
        }
        panel.series.push(Series::line("estimate", at.clone(), curve.value.clone(), Color::Blue));
        for ((label, values), dash) in curve.references.iter().zip([Dash::Dotted, Dash::Dashed]) {
            expect_shape(format!("\"{label}\""), "places", &[at.len()], &[values.len()])?;
            panel.series.push(Series::line(label.as_str(), at.clone(), values.clone(), Color::Ink).dash(dash));
        }
        figure = figure.panel("", panel);
    }
    Ok(figure)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn data() -> ScheduleCurves {
        let ends = [vec![1.0, 2.0, 1.0], vec![3.0, 4.0, 3.0]];
        let stiffness = ScheduleCurve {
            label: "K".into(),
            unit: "N/m".into(),
            value: vec![2.0, 3.0, 2.0],
            ci95: Some(ends.clone()),
            band95: Some(ends),
            references: vec![("constant".into(), vec![2.4; 3])],
        };
        let mean = ScheduleCurve { label: "pos_x".into(), unit: "m".into(), ci95: None, band95: None, references: Vec::new(), ..stiffness.clone() };
        ScheduleCurves { axis: ("Phase of the cycle".into(), String::new()), at: vec![0.0, 0.5, 1.0], curves: vec![stiffness, mean], columns: 2 }
    }

    #[test]
    fn bands_lie_behind_the_curve_and_a_mean_has_none() {
        let figure = schedule("k", "Stiffness", &data()).unwrap();
        let counts: Vec<usize> = figure.cells.iter().map(|cell| cell.panels[0].series.len()).collect();
        assert_eq!((counts, figure.columns), (vec![4, 1], 2));
        assert!(figure.to_svg().contains("95 % band of the whole curve"));
    }

    #[test]
    fn a_curve_of_another_length_is_refused_by_name() {
        let mut wrong = data();
        wrong.curves[1].value.pop();
        assert!(schedule("k", "", &wrong).unwrap_err().to_string().contains("pos_x"));
    }
}
