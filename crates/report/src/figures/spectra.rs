//! Power of signals by frequency: where the perturbation put its energy.

use std::sync::Arc;

use super::error::{FigureError, expect_shape};
use super::frequency::{frequency_axis, positive_extent};
use crate::plot::{Axis, Color, Dash, Figure, Panel, Series};

/// The density of one signal.
#[derive(Debug, Clone, PartialEq)]
pub struct Spectrum {
    /// Name of the channel.
    pub label: String,
    /// Unit of the density, e.g. "N²/Hz". Signals of one unit share a panel.
    pub unit: String,
    /// One-sided density.
    pub density: Vec<f64>,
}

/// Power spectral densities, one panel for each unit. The band that was analysed is `band_hz`, shaded outside.
///
/// # Errors
/// [`FigureError::Shape`] where a density does not have one value a frequency.
pub fn spectra(name: &str, title: &str, frequency_hz: &[f64], spectra: &[Spectrum], band_hz: Option<(f64, f64)>) -> Result<Figure, FigureError> {
    let frequency: Arc<[f64]> = frequency_hz.into();
    let extent = positive_extent(frequency_hz);
    let mut units: Vec<&str> = Vec::new();
    for spectrum in spectra {
        expect_shape(format!("the density of \"{}\"", spectrum.label), "frequencies", &[frequency_hz.len()], &[spectrum.density.len()])?;
        if !units.contains(&spectrum.unit.as_str()) {
            units.push(&spectrum.unit);
        }
    }
    let mut figure = Figure::new(name, title).columns(units.len().clamp(1, 2)).caption("Power spectral density (one-sided).");
    let mut color = 0;
    for unit in units {
        let mut panel = Panel::new(frequency_axis(extent), Axis::log("Density", unit)).height(150.0);
        for spectrum in spectra.iter().filter(|spectrum| spectrum.unit == unit) {
            let dash = if color < 6 { Dash::Solid } else { Dash::Dashed };
            panel.series.push(Series::line(spectrum.label.as_str(), frequency.clone(), spectrum.density.clone(), Color::nth(color)).dash(dash));
            color += 1;
        }
        if let (Some((from, to)), Some((low, high))) = (band_hz, extent) {
            let outside = [(low, from.min(high)), (to.max(low), high)];
            panel.spans = outside.into_iter().filter(|(from, to)| from < to).collect();
        }
        figure = figure.panel("", panel);
    }
    Ok(figure)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn one(label: &str, unit: &str) -> Spectrum {
        Spectrum { label: label.into(), unit: unit.into(), density: vec![1.0, 0.5, 0.1, 0.01] }
    }

    #[test]
    fn signals_of_one_unit_share_a_panel_and_what_lies_outside_the_band_is_shaded() {
        let all = [one("force_x", "N²/Hz"), one("pos_x", "m²/Hz"), one("force_y", "N²/Hz")];
        let figure = spectra("s", "Power", &[0.0, 1.0, 2.0, 4.0], &all, Some((1.5, 3.0))).unwrap();
        let counts: Vec<_> = figure.cells.iter().map(|cell| (cell.panels[0].series.len(), cell.panels[0].spans.len())).collect();
        assert_eq!(counts, [(2, 2), (1, 2)]);
        assert!(spectra("s", "Power", &[1.0], &all, None).is_err());
    }
}
