//! What a model leaves over: by time, by frequency, and whether it is noise.

use std::sync::Arc;

use super::error::{FigureError, expect_shape};
use super::frequency::{frequency_axis, positive_extent};
use crate::number::density_unit;
use crate::plot::{Axis, Color, Dash, Figure, Panel, Series};
use ndof_analysis::Leftover;

/// The residual of one output, y − ŷ.
#[derive(Debug, Clone, PartialEq)]
pub struct Residual {
    /// Name of the output.
    pub output: String,
    /// Its unit.
    pub unit: String,
    /// What a run leaves of it.
    pub left: Leftover,
}

/// One row an output: the residual over time, sampled at a rate from a time on, its density below that of the output, its autocorrelation.
///
/// # Errors
/// [`FigureError::Shape`] where a density does not have one value a frequency.
pub fn residual(name: &str, title: &str, (sample_rate_hz, start_s): (f64, f64), residuals: &[Residual]) -> Result<Figure, FigureError> {
    let mut figure = Figure::new(name, title)
        .columns(3)
        .caption("Measured less simulated: over time, its density beside the output's, and its autocorrelation (white noise stays within the band).");
    for (row, one) in residuals.iter().enumerate() {
        let left = &one.left;
        for (what, found) in [("residual", &left.density), ("output", &left.output_density)] {
            expect_shape(format!("the density of the {what} \"{}\"", one.output), "frequencies", &[left.frequency_hz.len()], &[found.len()])?;
        }
        let frequency: Arc<[f64]> = left.frequency_hz.as_slice().into();
        let time: Arc<[f64]> = (0..left.samples.len()).map(|k| start_s + k as f64 / sample_rate_hz).collect();
        let mut trace = Panel::new(Axis::linear("Time", "s"), Axis::linear("Residual", one.unit.as_str())).with(Series::line(
            "residual",
            time,
            left.samples.clone(),
            Color::Vermillion,
        ));
        trace.link = 3 * row + 1;
        let mut density = Panel::new(frequency_axis(positive_extent(&frequency)), Axis::log("Density", density_unit(&one.unit)))
            .with(Series::line("output", frequency.clone(), left.output_density.clone(), Color::Grey))
            .with(Series::line("residual", frequency.clone(), left.density.clone(), Color::Vermillion));
        density.link = 0;
        let lag: Arc<[f64]> = (0..left.autocorrelation.len()).map(|k| k as f64 / left.lag_rate_hz).collect();
        let bound = vec![left.white_95; lag.len()];
        let mut correlation = Panel::new(Axis::linear("Lag", "s"), Axis::linear("Autocorrelation", "").range(-1.02, 1.02))
            .with(Series::band("white noise, 95 %", lag.clone(), bound.iter().map(|bound| -bound).collect(), bound, Color::Grey))
            .with(Series::line("residual", lag, left.autocorrelation.clone(), Color::Vermillion).dash(Dash::Solid));
        correlation.link = 3 * row + 2;
        for (what, panel) in [("time", trace), ("frequency", density), ("memory", correlation)] {
            figure = figure.panel(format!("{}: {what}", one.output), panel.height(120.0));
        }
    }
    Ok(figure)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plot::Mark;

    #[test]
    fn each_output_has_its_time_frequency_and_memory() {
        let one = Residual {
            output: "pos_x".into(),
            unit: "m".into(),
            left: Leftover {
                samples: vec![0.1, -0.2, 0.1],
                frequency_hz: vec![1.0, 2.0],
                density: vec![1.0, 2.0],
                output_density: vec![10.0, 20.0],
                autocorrelation: vec![1.0, 0.1, -0.1],
                lag_rate_hz: 100.0,
                white_95: 0.2,
                vaf_percent: 99.0,
            },
        };
        let figure = residual("r", "Residual", (100.0, 35.0), &[one.clone(), one.clone()]).unwrap();
        assert_eq!((figure.cells.len(), figure.columns), (6, 3));
        assert!(matches!(&figure.cells[0].panels[0].series[0].mark, Mark::Line { x, .. } if x[..] == [35.0, 35.01, 35.02]));
        let short = Leftover { density: vec![1.0], ..one.left };
        assert!(residual("r", "Residual", (100.0, 0.0), &[Residual { left: short, ..one }]).is_err());
    }
}
