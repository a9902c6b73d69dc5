//! A response that changes: its surface from above, slices of it, and coherence.

use super::bode::capitalised;
use super::entries;
use super::error::{FigureError, expect_shape};
use crate::number::significant;
use crate::plot::{Axis, Color, Figure, Panel, Series, Shades};
use ndarray::Array3;
use std::sync::Arc;

/// Responses place by place.
#[derive(Debug, Clone, PartialEq)]
pub struct Course {
    /// What gains are of: "dynamic stiffness".
    pub quantity: String,
    /// Their unit.
    pub unit: String,
    /// What the abscissa is, with its unit.
    pub axis: (String, String),
    /// Where responses were estimated.
    pub at: Vec<f64>,
    /// The grid of all of them.
    pub frequency_hz: Vec<f64>,
    /// Columns.
    pub inputs: Vec<String>,
    /// Rows.
    pub outputs: Vec<String>,
    /// Gain, lower and upper end of its 95 % interval at each place, `[output][input][frequency]`.
    pub gain: Vec<[Array3<f64>; 3]>,
}

impl Course {
    fn along(&self, which: usize, entry: [usize; 3]) -> Vec<f64> {
        self.gain.iter().map(|gain| gain[which][entry]).collect()
    }
}

fn check(data: &Course) -> Result<(), FigureError> {
    let expected = [data.outputs.len(), data.inputs.len(), data.frequency_hz.len()];
    expect_shape("the course", "places", &[data.at.len()], &[data.gain.len()])?;
    data.gain.iter().flatten().try_for_each(|gain| expect_shape("a gain", "outputs, inputs, frequencies", &expected, gain.shape()))
}

/// The gain of each entry over places and frequencies, seen from above; nothing where its interval reaches zero.
///
/// # Errors
/// [`FigureError`] where sizes differ, or no gain is known.
pub fn course_surface(data: &Course) -> Result<Figure, FigureError> {
    check(data)?;
    let rows: Vec<usize> = (0..data.frequency_hz.len()).filter(|f| data.frequency_hz[*f] > 0.0).collect();
    let of = |i: usize, j: usize| -> Vec<Vec<f64>> {
        let known = |f: usize| data.gain.iter().map(move |[gain, low, _]| if low[[i, j, f]] > 0.0 { gain[[i, j, f]] } else { f64::NAN });
        rows.iter().map(|f| known(*f).collect()).collect()
    };
    let all: Vec<Vec<Vec<f64>>> = entries(&data.outputs, &data.inputs).map(|(i, j, _)| of(i, j)).collect();
    let finite = || all.iter().flatten().flatten().copied().filter(|v| v.is_finite());
    let (low, high) = (finite().fold(f64::INFINITY, f64::min), finite().fold(0.0, f64::max));
    // Frequencies at which most places say nothing are no part of the picture.
    let told = |row: &usize| all.iter().any(|entry| 2 * entry[*row].iter().filter(|v| v.is_finite()).count() >= data.at.len());
    let (Some(first), Some(last)) = ((0..rows.len()).find(told), (0..rows.len()).rev().find(told)) else {
        return Err(FigureError::Empty { what: "the course of the response" });
    };
    let hz: Vec<f64> = rows[first..=last].iter().map(|f| data.frequency_hz[*f]).collect();
    let at: Arc<[f64]> = data.at.clone().into();
    let label = format!("gain from {} (light) to {} {} (dark)", significant(low, 2), significant(high, 2), crate::number::printed_unit(&data.unit));
    let (step, width) = (hz.get(1).map_or(1.0, |second| second - hz[0]), data.at.get(1).map_or(1.0, |second| second - data.at[0]));
    let range = |values: &[f64], step: f64| (values[0] - 0.5 * step, values[values.len() - 1] + 0.5 * step);
    let ((x0, x1), (y0, y1)) = (range(&data.at, width), range(&hz, step));
    let mut figure = Figure::new("response-course", format!("{} from above", capitalised(&data.quantity))).columns(data.inputs.len());
    for ((_, _, title), values) in entries(&data.outputs, &data.inputs).zip(&all) {
        let mut panel =
            Panel::new(Axis::linear(data.axis.0.as_str(), data.axis.1.as_str()).range(x0, x1), Axis::linear("Frequency", "Hz").range(y0.max(0.0), y1));
        panel.shades = Some(Shades { label: label.clone(), x: at.clone(), y: hz.clone(), value: values[first..=last].to_vec(), range: (low, high) });
        figure = figure.panel(title, panel);
    }
    Ok(figure.caption("Steps of darkness are equal ratios. White: the 95 % interval of the gain reaches zero."))
}

/// The gain of each entry over the places at these frequencies, with 95 % intervals.
///
/// # Errors
/// [`FigureError`] where sizes differ.
pub fn course_slices(data: &Course, frequencies: &[usize]) -> Result<Figure, FigureError> {
    check(data)?;
    let at: Arc<[f64]> = data.at.clone().into();
    let mut figure = Figure::new("response-slices", format!("{} at some frequencies", capitalised(&data.quantity))).columns(data.inputs.len());
    for (i, j, title) in entries(&data.outputs, &data.inputs) {
        let mut panel = Panel::new(Axis::linear(data.axis.0.as_str(), data.axis.1.as_str()), Axis::log("Gain", data.unit.as_str()));
        for (k, &f) in frequencies.iter().enumerate() {
            let [value, low, high] = [0, 1, 2].map(|which| data.along(which, [i, j, f]));
            let (label, color) = (format!("{} Hz", significant(data.frequency_hz[f], 3)), Color::nth(k));
            panel.series.push(Series::band(label.as_str(), at.clone(), low, high, color));
            panel.series.push(Series::line(label, at.clone(), value, color));
        }
        figure = figure.panel(title, panel);
    }
    Ok(figure.caption("95 % intervals at each place by itself."))
}

/// Multiple coherence of each output over the places at these frequencies; `coherence` is `[place][output][frequency]`.
///
/// # Errors
/// [`FigureError`] where sizes differ.
pub fn course_coherence(data: &Course, coherence: &Array3<f64>, frequencies: &[usize]) -> Result<Figure, FigureError> {
    let (places, outputs, bins) = coherence.dim();
    expect_shape("the coherence", "places, outputs, frequencies", &[data.at.len(), data.frequency_hz.len()], &[places, bins])?;
    let at: Arc<[f64]> = data.at.clone().into();
    let mut figure = Figure::new("coherence-course", "Multiple coherence at some frequencies").columns(outputs);
    for output in 0..outputs {
        let mut panel = Panel::new(Axis::linear(data.axis.0.as_str(), data.axis.1.as_str()), Axis::linear("Coherence", "").range(0.0, 1.0)).height(150.0);
        for (k, &f) in frequencies.iter().enumerate() {
            let label = format!("{} Hz", significant(data.frequency_hz[f], 3));
            panel.series.push(Series::line(label, at.clone(), (0..places).map(|place| coherence[[place, output, f]]).collect(), Color::nth(k)));
        }
        figure = figure.panel(String::new(), panel);
    }
    Ok(figure)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Gain of (place + 1) · f with an interval that reaches zero at the last frequency.
    fn data() -> Course {
        let hz = [0.0, 2.0, 4.0, 6.0];
        let gain = |place: f64| {
            let of = |width: f64| Array3::from_shape_fn((1, 1, 4), |(_, _, f)| (place + 1.0) * hz[f] + width * if f == 3 { 1e3 } else { 0.1 });
            [of(0.0), of(-1.0), of(1.0)]
        };
        Course {
            quantity: "dynamic stiffness".into(),
            unit: "N/m".into(),
            axis: ("Time in the cycle".into(), "s".into()),
            at: vec![0.0, 0.5, 1.0],
            frequency_hz: hz.to_vec(),
            inputs: vec!["x".into()],
            outputs: vec!["f".into()],
            gain: [0.0, 1.0, 2.0].map(gain).to_vec(),
        }
    }

    #[test]
    fn the_surface_ends_where_nothing_is_known() {
        let figure = course_surface(&data()).expect("a figure");
        let shades = figure.cells[0].panels[0].shades.as_ref().expect("shades");
        assert_eq!((shades.y.clone(), shades.range), (vec![2.0, 4.0], (2.0, 12.0)));
        assert_eq!(shades.value, vec![vec![2.0, 4.0, 6.0], vec![4.0, 8.0, 12.0]]);
        assert!(figure.to_csv().starts_with("Time in the cycle [s],f \u{2190} x | Frequency [Hz] | 2,"), "{}", figure.to_csv());
        assert!(figure.to_svg().contains("gain from 2"));
    }

    #[test]
    fn slices_have_a_line_and_a_band_for_each_frequency() {
        let figure = course_slices(&data(), &[1, 2]).expect("a figure");
        assert_eq!(figure.cells[0].panels[0].series.len(), 4);
        let mut wrong = data();
        wrong.gain.pop();
        assert!(course_slices(&wrong, &[1]).is_err());
    }
}
