//! The matrix of frequency responses: gain over phase, one cell for each output and input.

use std::f64::consts::PI;
use std::sync::Arc;

use ndarray::{Array3, ArrayView1, Axis as Dimension};

use super::curve::Curve;
use super::entries;
use super::error::{FigureError, expect_shape};
use super::frequency::{frequency_axis, known_extent, positive_extent};
use crate::number::significant;
use crate::plot::{Axis, Figure, Mark, Panel, Series};

const PHASE: &str = "Phase";
/// Degrees beyond the last tick, so that a curve at exactly −180° does not lie on the frame.
const AIR_DEG: f64 = 5.0;

/// Several responses of one plant on one frequency grid.
#[derive(Debug, Clone, PartialEq)]
pub struct ResponseCurves {
    /// What the gain is, e.g. "Compliance".
    pub quantity: String,
    /// Its unit, e.g. "m/N".
    pub unit: String,
    /// Ascending.
    pub frequency_hz: Vec<f64>,
    /// Names of the columns.
    pub inputs: Vec<String>,
    /// Names of the rows.
    pub outputs: Vec<String>,
    /// From back to front.
    pub curves: Vec<Curve>,
}

impl ResponseCurves {
    pub(super) fn check(&self) -> Result<(), FigureError> {
        let shape = [self.outputs.len(), self.inputs.len(), self.frequency_hz.len()];
        if shape.contains(&0) {
            return Err(FigureError::Empty { what: "the list of outputs, of inputs or of frequencies" });
        }
        for curve in &self.curves {
            let tables = [("gain", &curve.gain), ("phase", &curve.phase_rad)]
                .into_iter()
                .chain(curve.gain_ci95.iter().flat_map(|(low, high)| [("lower gain", low), ("upper gain", high)]))
                .chain(curve.phase_ci95_rad.iter().flat_map(|(low, high)| [("lower phase", low), ("upper phase", high)]));
            for (word, table) in tables {
                expect_shape(format!("the {word} of \"{}\"", curve.label), "outputs × inputs × frequencies", &shape, table.shape())?;
            }
        }
        Ok(())
    }
}

/// The Bode matrix: in row p and column q the gain (log-log) and the phase of H_pq(f), bands at 95 %.
///
/// Phase is wrapped to that turn in which its curve is cut least often, so that a response around −180° does not
/// jump between −180° and 180°. All gains share one range where they lie within six decades. Where
/// intervals are given, frequencies beyond those at which any of them excludes zero are left out of the picture.
///
/// ```
/// use ndarray::Array3;
/// use ndof_report::figures::{Curve, CurveStyle, ResponseCurves, bode};
/// use num_complex::Complex64;
///
/// // A spring of 300 N/m with 2 kg on it.
/// let frequency_hz = vec![0.5, 1.0, 2.0, 4.0];
/// let omega = frequency_hz.iter().map(|f| std::f64::consts::TAU * f).collect::<Vec<_>>();
/// let compliance = Array3::from_shape_fn((1, 1, 4), |(_, _, k)| 1.0 / Complex64::new(300.0 - 2.0 * omega[k] * omega[k], 5.0 * omega[k]));
/// let data = ResponseCurves {
///     quantity: "compliance".into(),
///     unit: "m/N".into(),
///     frequency_hz,
///     inputs: vec!["force_x".into()],
///     outputs: vec!["pos_x".into()],
///     curves: vec![Curve::from_response("spring", &compliance, CurveStyle::FITTED)],
/// };
/// let figure = bode("bode", &data)?;
/// assert_eq!(figure.cells[0].title, "pos_x ← force_x");
/// # Ok::<(), ndof_report::FigureError>(())
/// ```
///
/// # Errors
/// [`FigureError`] where a table does not have the shape `[outputs][inputs][frequencies]` or one of them is empty.
pub fn bode(name: &str, data: &ResponseCurves) -> Result<Figure, FigureError> {
    data.check()?;
    let q = data.inputs.len();
    let frequency: Arc<[f64]> = data.frequency_hz.clone().into();
    let known = known_extent(&frequency, &data.curves);
    let band = known.or_else(|| positive_extent(&frequency));
    let gains = common_gain_range(data, band);
    let (gain_height, phase_height) = if q > 3 { (100.0, 70.0) } else { (170.0, 105.0) };
    let cut = match known {
        Some((low, high)) => {
            format!(" Shown: {} to {} Hz, where the response differs from zero; the CSV file has the rest.", significant(low, 2), significant(high, 2))
        }
        None => String::new(),
    };
    let mut figure = Figure::new(name, capitalised(&data.quantity)).columns(q).caption(format!(
        "Gain and phase by frequency; rows are outputs ({}), columns inputs ({}). Shaded: 95 % confidence interval.{cut}",
        data.outputs.join(", "),
        data.inputs.join(", ")
    ));
    for (row, column, title) in entries(&data.outputs, &data.inputs) {
        let mut gain = Panel::new(frequency_axis(band), Axis::log("Gain", data.unit.as_str())).height(gain_height);
        if let Some((low, high)) = gains {
            gain.y = gain.y.range(low, high);
        }
        let mut phase = Panel::new(frequency_axis(band), Axis::degrees(PHASE)).height(phase_height);
        let cut = best_cut(data.curves.iter().map(|curve| element(&curve.phase_rad, row, column)));
        for curve in &data.curves {
            let at = |table: &Array3<f64>| element(table, row, column).to_vec();
            let (color, dash, label) = (curve.style.color, curve.style.dash, curve.label.as_str());
            if let Some((low, high)) = &curve.gain_ci95 {
                gain.series.push(Series::band(label, frequency.clone(), at(low), at(high), color));
            }
            gain.series.push(Series::line(label, frequency.clone(), at(&curve.gain), color).dash(dash));
            let turns: Vec<f64> = element(&curve.phase_rad, row, column).iter().map(|&angle| wrap(angle, cut)).collect();
            if let Some((low, high)) = &curve.phase_ci95_rad {
                let (low, high) = phase_band(element(&curve.phase_rad, row, column), element(low, row, column), element(high, row, column), &turns);
                phase.series.push(Series::band(label, frequency.clone(), low, high, color));
            }
            phase.series.push(Series::line(label, frequency.clone(), turns, color).dash(dash));
        }
        phase.y = phase_axis(&phase.series, band);
        figure = figure.cell(title, vec![gain, phase]);
    }
    Ok(figure)
}

/// With a capital first letter, as titles have it.
pub fn capitalised(words: &str) -> String {
    let mut letters = words.chars();
    letters.next().map(|first| first.to_uppercase().chain(letters).collect()).unwrap_or_default()
}

/// One element of the matrix over frequency.
pub(super) fn element(table: &Array3<f64>, row: usize, column: usize) -> ArrayView1<'_, f64> {
    table.index_axis(Dimension(0), row).index_axis_move(Dimension(0), column)
}

/// One range for all gains, if they lie within six decades.
fn common_gain_range(data: &ResponseCurves, band: Option<(f64, f64)>) -> Option<(f64, f64)> {
    let inside = |k: usize| data.frequency_hz.get(k).is_some_and(|frequency| band.is_none_or(|(low, high)| (low..=high).contains(frequency)));
    let gains = data.curves.iter().flat_map(|curve| curve.gain.indexed_iter());
    let (low, high) = gains
        .filter(|&((_, _, k), &gain)| inside(k) && gain.is_finite() && gain > 0.0)
        .fold((f64::INFINITY, 0.0f64), |(low, high), (_, &gain)| (low.min(gain), high.max(gain)));
    let decades = (high / low).log10();
    (decades > 0.0 && decades <= 6.0).then(|| (low / 10f64.powf(0.06 * decades), high * 10f64.powf(0.06 * decades)))
}

/// An angle in degrees within [cut, cut + 360°).
fn wrap(angle_rad: f64, cut_deg: f64) -> f64 {
    cut_deg + (angle_rad.to_degrees() - cut_deg).rem_euclid(360.0)
}

/// Where to cut the circle, in degrees: where the curves jump least; ±180° if that is as good.
fn best_cut<'a>(phases: impl Iterator<Item = ArrayView1<'a, f64>>) -> f64 {
    let phases: Vec<_> = phases.collect();
    let jumps = |cut: f64| -> usize {
        let of_one = |phase: &ArrayView1<f64>| phase.iter().zip(phase.iter().skip(1)).filter(|&(&a, &b)| (wrap(b, cut) - wrap(a, cut)).abs() > 180.0).count();
        phases.iter().map(of_one).sum()
    };
    let candidates = [-180.0, -225.0, -135.0, -270.0, -90.0, -315.0, -45.0, -360.0, 0.0];
    candidates.into_iter().min_by_key(|cut| jumps(*cut)).unwrap_or(-180.0)
}

/// The phase's interval around the wrapped curve, in degrees; unknown ends beside a known phase are the full circle.
fn phase_band(phase: ArrayView1<f64>, low: ArrayView1<f64>, high: ArrayView1<f64>, turns: &[f64]) -> (Vec<f64>, Vec<f64>) {
    let ends =
        phase.iter().zip(low).zip(high).zip(turns).map(|(((&phase, &low), &high), &turn)| match (low.is_finite() && high.is_finite(), phase.is_finite()) {
            (_, false) => (f64::NAN, f64::NAN),
            (true, true) => (turn - (phase - low).rem_euclid(2.0 * PI).to_degrees(), turn + (high - phase).rem_euclid(2.0 * PI).to_degrees()),
            (false, true) => (turn - 180.0, turn + 180.0),
        });
    ends.unzip()
}

/// Multiples of 45° around all lines within the band, at least a right angle high.
fn phase_axis(series: &[Series], band: Option<(f64, f64)>) -> Axis {
    let within = |frequency: f64| band.is_none_or(|(low, high)| (low..=high).contains(&frequency));
    let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
    for one in series {
        if let Mark::Line { x, y } = &one.mark {
            for (_, &angle) in x.iter().zip(y).filter(|&(&frequency, angle)| within(frequency) && angle.is_finite()) {
                (low, high) = (low.min(angle), high.max(angle));
            }
        }
    }
    if low > high {
        return Axis::degrees(PHASE).range(-180.0, 180.0);
    }
    let (mut from, mut to) = (((low + AIR_DEG) / 45.0).floor() * 45.0, ((high - AIR_DEG) / 45.0).ceil() * 45.0);
    if to - from < 90.0 {
        (from, to) = (from - 45.0, to + 45.0);
    }
    Axis::degrees(PHASE).range(from - AIR_DEG, to + AIR_DEG)
}

#[cfg(test)]
mod tests {
    use super::super::curve::CurveStyle;
    use super::*;
    use num_complex::Complex64;

    fn spring_with_mass(frequency_hz: &[f64]) -> Array3<Complex64> {
        let response = |f: f64| {
            let s = Complex64::new(0.0, 2.0 * PI * f);
            1.0 / (s * s * 2.0 + s * 11.0 + 300.0)
        };
        Array3::from_shape_fn((1, 1, frequency_hz.len()), |(_, _, k)| response(frequency_hz[k]))
    }

    fn curves() -> ResponseCurves {
        let frequency_hz: Vec<f64> = (1..200).map(|k| 0.1 * f64::from(k)).collect();
        let curve = Curve::from_response("model", &spring_with_mass(&frequency_hz), CurveStyle::FITTED);
        ResponseCurves {
            quantity: "Compliance".into(),
            unit: "m/N".into(),
            frequency_hz,
            inputs: vec!["x".into()],
            outputs: vec!["x".into()],
            curves: vec![curve],
        }
    }

    #[test]
    fn a_bode_matrix_has_a_cell_an_element_and_its_own_axes() {
        let figure = bode("bode", &curves()).unwrap();
        let svg = figure.to_svg();
        assert_eq!((figure.cells.len(), figure.cells[0].panels.len()), (1, 2));
        assert!(svg.contains("Gain [m/N]") && svg.contains("Phase [°]") && svg.contains("Frequency [Hz]") && svg.contains("x ← x"));
        assert_eq!(figure.cells[0].panels[1].y.range, Some((-185.0, 5.0)), "phase of a spring with a mass runs from 0 to -180 degrees");
    }

    #[test]
    fn phase_is_cut_where_the_curve_is_not() {
        let noisy: Vec<f64> = (0..100).map(|k| PI + 0.2 * f64::from(k).sin()).collect();
        let cut = best_cut(std::iter::once(ArrayView1::from(&noisy)));
        assert!(noisy.windows(2).all(|pair| (wrap(pair[0], cut) - wrap(pair[1], cut)).abs() < 180.0));
    }

    #[test]
    fn an_unknown_phase_interval_is_the_full_circle() {
        let (phase, end, unknown) = ([0.5, 0.5], [0.4, f64::NAN], [0.7, f64::NAN]);
        let turns = [0.5f64.to_degrees(); 2];
        let (low, high) = phase_band(ArrayView1::from(&phase), ArrayView1::from(&end), ArrayView1::from(&unknown), &turns);
        assert!((low[0] - 0.4f64.to_degrees()).abs() < 1e-9 && (high[0] - 0.7f64.to_degrees()).abs() < 1e-9);
        assert!((high[1] - low[1] - 360.0).abs() < 1e-9);
    }

    #[test]
    fn a_table_of_another_shape_is_refused_by_name() {
        let mut data = curves();
        data.inputs.push("y".into());
        let error = bode("bode", &data).unwrap_err();
        assert!(error.to_string().contains("gain of \"model\"") && error.to_string().contains("[1, 2, 199]"), "{error}");
    }
}
