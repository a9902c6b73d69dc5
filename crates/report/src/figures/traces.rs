//! Signals over time, measured and simulated.

use std::sync::Arc;

use super::error::{FigureError, expect_shape};
use crate::plot::{Axis, Color, Dash, Figure, Panel, Series};

/// One channel; NaN where there is no value.
#[derive(Debug, Clone, PartialEq)]
pub struct Trace {
    /// Its name.
    pub label: String,
    /// Its unit.
    pub unit: String,
    /// As recorded.
    pub measured: Vec<f64>,
    /// As models say, each with its name.
    pub simulated: Vec<(String, Vec<f64>)>,
}

/// Channels of one recording.
#[derive(Debug, Clone, PartialEq)]
pub struct Traces {
    /// Samples per second.
    pub sample_rate_hz: f64,
    /// Time of the first sample.
    pub start_s: f64,
    /// From top to bottom.
    pub traces: Vec<Trace>,
    /// A stretch that is shown enlarged beside the whole.
    pub detail_s: Option<(f64, f64)>,
}

/// A model that goes so many times as far as the measurement leaves the picture, which would else show nothing but its way out.
const AWAY: f64 = 3.0;

/// How models are drawn, the first first.
const MODELS: [(Color, Dash); 2] = [(Color::Vermillion, Dash::Dashed), (Color::Green, Dash::Dashed)];

/// Channels below each other over one time axis, each with its detail beside it where one is asked for.
///
/// # Errors
/// [`FigureError::Shape`] where a simulated trace is not as long as the measured one.
pub fn traces(name: &str, title: &str, data: &Traces) -> Result<Figure, FigureError> {
    let columns = if data.detail_s.is_some() { 2 } else { 1 };
    let mut figure = Figure::new(name, title).columns(columns);
    let longest = data.traces.iter().map(|trace| trace.measured.len()).max().unwrap_or(0);
    let time: Arc<[f64]> = (0..longest).map(|k| data.start_s + k as f64 / data.sample_rate_hz).collect();
    let whole = (data.start_s, data.start_s + longest as f64 / data.sample_rate_hz);
    for trace in &data.traces {
        for (_, simulated) in &trace.simulated {
            expect_shape(format!("the simulated \"{}\"", trace.label), "samples", &[trace.measured.len()], &[simulated.len()])?;
        }
        for (link, range) in std::iter::once(whole).chain(data.detail_s).enumerate() {
            let mut panel = Panel::new(Axis::linear("Time", "s").range(range.0, range.1), Axis::linear("", trace.unit.as_str())).height(95.0);
            panel.link = link;
            panel.y.label = trace.label.clone();
            panel.series.push(Series::line("measured", time.clone(), trace.measured.clone(), Color::Blue));
            let room = room(&trace.measured);
            let mut away = false;
            for ((model, simulated), (color, dash)) in trace.simulated.iter().zip(MODELS.iter().cycle()) {
                let leaves = room.is_some_and(|(low, high)| simulated.iter().any(|x| *x < low || *x > high));
                away |= leaves;
                let label = if leaves { format!("{model}, which leaves the picture") } else { model.clone() };
                panel.series.push(Series::line(label, time.clone(), simulated.clone(), *color).dash(*dash));
            }
            panel.y.range = room.filter(|_| away);
            figure = figure.panel("", panel);
        }
    }
    Ok(figure)
}

/// The measurement's extent, and around its middle so many times as much; none where it has no extent.
fn room(measured: &[f64]) -> Option<(f64, f64)> {
    let (low, high) = measured.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(*x), high.max(*x)));
    let (middle, half) = (0.5 * (low + high), 0.5 * AWAY * (high - low));
    (half > 0.0 && half.is_finite()).then_some((middle - half, middle + half))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn data() -> Traces {
        let measured: Vec<f64> = (0..1000).map(|k| (0.05 * f64::from(k)).sin()).collect();
        let force = Trace { label: "force_x".into(), unit: "N".into(), measured: measured.clone(), simulated: Vec::new() };
        let position = Trace { label: "pos_x".into(), unit: "m".into(), simulated: vec![("simulated".into(), measured.clone())], measured };
        Traces { sample_rate_hz: 100.0, start_s: 2.0, traces: vec![force, position], detail_s: Some((3.0, 4.0)) }
    }

    #[test]
    fn whole_and_detail_stand_beside_each_other_and_zoom_apart() {
        let figure = traces("traces", "Signals", &data()).unwrap();
        assert_eq!((figure.cells.len(), figure.columns), (4, 2));
        let ranges: Vec<_> = figure.cells.iter().map(|cell| (cell.panels[0].x.range, cell.panels[0].link)).collect();
        assert_eq!(ranges, [(Some((2.0, 12.0)), 0), (Some((3.0, 4.0)), 1), (Some((2.0, 12.0)), 0), (Some((3.0, 4.0)), 1)]);
    }

    #[test]
    fn a_model_without_bounds_does_not_hide_the_measurement() {
        let mut unstable = data();
        let shown = traces("t", "", &unstable).unwrap();
        assert_eq!(shown.cells[2].panels[0].y.range, None);
        let trace = &mut unstable.traces[1];
        trace.simulated.push(("baseline".into(), (0..1000).map(|k| 1e-3 * (0.03 * f64::from(k)).exp()).collect()));
        let shown = traces("t", "", &unstable).unwrap();
        let panel = &shown.cells[2].panels[0];
        let (low, high) = panel.y.range.unwrap();
        assert!((low + 3.0).abs() < 0.01 && (high - 3.0).abs() < 0.01, "{low} {high}");
        let labels: Vec<&str> = panel.series.iter().map(|series| series.label.as_str()).collect();
        assert_eq!(labels, ["measured", "simulated", "baseline, which leaves the picture"]);
    }

    #[test]
    fn a_simulation_of_another_length_is_refused_by_name() {
        let mut wrong = data();
        wrong.traces[1].simulated[0].1 = vec![0.0; 7];
        assert!(traces("t", "", &wrong).unwrap_err().to_string().contains("pos_x"));
    }
}
