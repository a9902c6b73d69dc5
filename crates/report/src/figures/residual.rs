//! What a model leaves over: by time, by frequency, and whether it is noise.

use std::sync::Arc;

use super::error::{FigureError, expect_shape};
use super::frequency::{frequency_axis, positive_extent};
use crate::plot::{Axis, Color, Dash, Figure, Panel, Series};

/// The residual of one output, y − ŷ.
#[derive(Debug, Clone, PartialEq)]
pub struct Residual {
    /// Name of the output.
    pub output: String,
    /// Its unit.
    pub unit: String,
    /// Over time.
    pub samples: Vec<f64>,
    /// Its density, one value a frequency.
    pub density: Vec<f64>,
    /// Density of the output itself, for comparison.
    pub output_density: Vec<f64>,
    /// Autocorrelation from lag 0 on; 1 at lag 0.
    pub autocorrelation: Vec<f64>,
    /// Lags per second.
    pub lag_rate_hz: f64,
    /// Bound within which 95 % of the lags of white noise lie.
    pub white_95: f64,
}

/// One row an output: the residual over time, its density below that of the output, its autocorrelation.
///
/// # Errors
/// [`FigureError::Shape`] where a density does not have one value a frequency.
pub fn residual(name: &str, title: &str, sample_rate_hz: f64, frequency_hz: &[f64], residuals: &[Residual]) -> Result<Figure, FigureError> {
    let frequency: Arc<[f64]> = frequency_hz.into();
    let extent = positive_extent(frequency_hz);
    let mut figure = Figure::new(name, title)
        .columns(3)
        .caption("Measured less simulated: over time, its density beside the output's, and its autocorrelation (white noise stays within the band).");
    for (row, one) in residuals.iter().enumerate() {
        for (what, found) in [("residual", &one.density), ("output", &one.output_density)] {
            expect_shape(format!("the density of the {what} \"{}\"", one.output), "frequencies", &[frequency_hz.len()], &[found.len()])?;
        }
        let time: Arc<[f64]> = (0..one.samples.len()).map(|k| k as f64 / sample_rate_hz).collect();
        let mut trace = Panel::new(Axis::linear("Time", "s"), Axis::linear("Residual", one.unit.as_str())).with(Series::line(
            "residual",
            time,
            one.samples.clone(),
            Color::Vermillion,
        ));
        trace.link = 3 * row + 1;
        let unit = if one.unit.contains([' ', '/', '·']) { format!("({})²/Hz", one.unit) } else { format!("{}²/Hz", one.unit) };
        let mut density = Panel::new(frequency_axis(extent), Axis::log("Density", unit))
            .with(Series::line("output", frequency.clone(), one.output_density.clone(), Color::Grey))
            .with(Series::line("residual", frequency.clone(), one.density.clone(), Color::Vermillion));
        density.link = 0;
        let lag: Arc<[f64]> = (0..one.autocorrelation.len()).map(|k| k as f64 / one.lag_rate_hz).collect();
        let bound = vec![one.white_95; lag.len()];
        let mut correlation = Panel::new(Axis::linear("Lag", "s"), Axis::linear("Autocorrelation", "").range(-1.02, 1.02))
            .with(Series::band("white noise, 95 %", lag.clone(), bound.iter().map(|bound| -bound).collect(), bound, Color::Grey))
            .with(Series::line("residual", lag, one.autocorrelation.clone(), Color::Vermillion).dash(Dash::Solid));
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

    #[test]
    fn each_output_has_its_time_frequency_and_memory() {
        let one = Residual {
            output: "pos_x".into(),
            unit: "m".into(),
            samples: vec![0.1, -0.2, 0.1],
            density: vec![1.0, 2.0],
            output_density: vec![10.0, 20.0],
            autocorrelation: vec![1.0, 0.1, -0.1],
            lag_rate_hz: 100.0,
            white_95: 0.2,
        };
        let figure = residual("r", "Residual", 100.0, &[1.0, 2.0], &[one.clone(), one.clone()]).unwrap();
        assert_eq!((figure.cells.len(), figure.columns), (6, 3));
        assert!(residual("r", "Residual", 100.0, &[1.0], &[one]).is_err());
    }
}
