//! Responses in the complex plane.

use super::bode::{ResponseCurves, capitalised, element};
use super::entries;
use super::error::FigureError;
use super::frequency::known_extent;
use crate::number::{printed_unit, significant};
use crate::plot::{Axis, Figure, Panel, Pin, Series};
use crate::table::{Align, Table};
use ndof_analysis::log_spaced;

/// Frequencies that are named along the first curve.
const MARKED_HZ: [f64; 7] = [0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0];

/// Names closer than this share of the picture would overlap.
const APART: f64 = 0.07;
const TABLE_ROWS: usize = 12;

/// The Nyquist matrix: imaginary over real part, with equal units on both axes; some frequencies are named along
/// the last curve (the model, where there is one). The band is that of the Bode matrix.
///
/// # Errors
/// As [`bode`](super::bode).
pub fn nyquist(name: &str, data: &ResponseCurves) -> Result<Figure, FigureError> {
    data.check()?;
    let (low, high) = known_extent(&data.frequency_hz, &data.curves).unwrap_or((0.0, f64::INFINITY));
    let mut figure = Figure::new(name, format!("{} in the complex plane", capitalised(&data.quantity)))
        .columns(data.inputs.len())
        .caption("Imaginary over real part; small numbers are frequencies in hertz.");
    for (row, column, title) in entries(&data.outputs, &data.inputs) {
        let unit = data.unit.as_str();
        let mut panel = Panel::new(Axis::linear("Real part", unit), Axis::linear("Imaginary part", unit));
        panel.equal_aspect = true;
        for (index, curve) in data.curves.iter().enumerate() {
            let polar = || element(&curve.gain, row, column).into_iter().zip(element(&curve.phase_rad, row, column)).zip(&data.frequency_hz);
            let usable = |frequency: f64| frequency > 0.0 && (low..=high).contains(&frequency);
            let real: Vec<f64> = polar().map(|((gain, phase), &f)| if usable(f) { gain * phase.cos() } else { f64::NAN }).collect();
            let imaginary: Vec<f64> = polar().map(|((gain, phase), &f)| if usable(f) { gain * phase.sin() } else { f64::NAN }).collect();
            if index + 1 == data.curves.len() {
                panel.pins = pins(&data.frequency_hz, &real, &imaginary);
            }
            // What was measured scatters: dots. What was computed is a line.
            panel.series.push(match curve.gain_ci95 {
                Some(_) => Series::points(curve.label.as_str(), real, imaginary, curve.style.color),
                None => Series::line(curve.label.as_str(), real, imaginary, curve.style.color).dash(curve.style.dash),
            });
        }
        figure = figure.panel(title, panel);
    }
    figure.table = Some(table(data));
    Ok(figure)
}

/// Real and imaginary parts at a few frequencies, evenly spread by their logarithm.
fn table(data: &ResponseCurves) -> Table {
    let positive: Vec<usize> = (0..data.frequency_hz.len()).filter(|&k| data.frequency_hz[k] > 0.0).collect();
    let picked = log_spaced(&positive, &data.frequency_hz, TABLE_ROWS);
    let mut table = Table::new(format!("{}: real and imaginary part", capitalised(&data.quantity)), ["Frequency [Hz]"], [""; 0]);
    table.rows = picked.iter().map(|&k| vec![significant(data.frequency_hz[k], 3)]).collect();
    for (row, column, title) in entries(&data.outputs, &data.inputs) {
        for curve in &data.curves {
            table.columns.push((format!("{title} [{}]: {}", printed_unit(&data.unit), curve.label), Align::Right));
            for (cells, &k) in table.rows.iter_mut().zip(&picked) {
                let (gain, phase) = (curve.gain[[row, column, k]], curve.phase_rad[[row, column, k]]);
                cells.push(format!("{}; {}", significant(gain * phase.cos(), 3), significant(gain * phase.sin(), 3)));
            }
        }
    }
    table
}

/// Names of round frequencies, at the nearest bin no further off than 5 %, where they do not lie on each other.
fn pins(frequency_hz: &[f64], real: &[f64], imaginary: &[f64]) -> Vec<Pin> {
    let extent = |values: &[f64]| {
        let finite = || values.iter().copied().filter(|value| value.is_finite());
        finite().fold(f64::NEG_INFINITY, f64::max) - finite().fold(f64::INFINITY, f64::min)
    };
    let apart = APART * extent(real).max(extent(imaginary));
    let mut pins: Vec<Pin> = Vec::new();
    for wanted in MARKED_HZ {
        let away = |k: &usize| (frequency_hz[*k] - wanted).abs();
        let Some(k) = (0..frequency_hz.len()).min_by(|a, b| away(a).total_cmp(&away(b))) else { continue };
        let free = pins.iter().all(|pin| (pin.x - real[k]).hypot(pin.y - imaginary[k]) > apart);
        if away(&k) <= 0.05 * wanted && free {
            pins.push(Pin { x: real[k], y: imaginary[k], label: wanted.to_string(), centred: false });
        }
    }
    pins
}

#[cfg(test)]
mod tests {
    use ndarray::Array3;
    use num_complex::Complex64;

    use super::*;
    use crate::figures::{Curve, CurveStyle};
    use crate::plot::Mark;

    #[test]
    fn a_first_order_lag_is_half_a_circle() {
        let frequency_hz: Vec<f64> = (0..400).map(|k| 0.1 * f64::from(k)).collect();
        let response = Array3::from_shape_fn((1, 1, 400), |(_, _, k)| 1.0 / Complex64::new(1.0, frequency_hz[k]));
        let data = ResponseCurves {
            quantity: "Gain".into(),
            unit: String::new(),
            frequency_hz,
            inputs: vec!["u".into()],
            outputs: vec!["y".into()],
            curves: vec![Curve::from_response("lag", &response, CurveStyle::FITTED)],
        };
        let figure = nyquist("nyquist", &data).unwrap();
        let panel = &figure.cells[0].panels[0];
        let Mark::Line { x, y } = &panel.series[0].mark else { panic!("a line") };
        assert!(x[0].is_nan(), "0 Hz is left out");
        // |H - 1/2| = 1/2 for 1 / (1 + jf), to round-off.
        assert!(x.iter().zip(y).skip(1).all(|(re, im)| ((re - 0.5).hypot(*im) - 0.5).abs() < 1e-14));
        let table = figure.table.as_ref().unwrap();
        assert_eq!((table.rows[0][0].as_str(), table.rows[0][1].as_str(), table.rows.last().unwrap()[0].as_str()), ("0.100", "0.990; −0.0990", "39.9"));
        assert!(panel.equal_aspect && panel.pins.iter().any(|pin| pin.label == "5"));
    }
}
