//! The stiffness ellipse (Mussa-Ivaldi, Hogan and Bizzi 1985): the restoring force to a displacement of unit length
//! in every direction.

use std::f64::consts::TAU;

use super::error::FigureError;
use crate::number::significant;
use crate::plot::{Axis, Color, Dash, Figure, Panel, Series};
use crate::table::Table;

const CORNERS: usize = 181;

/// A 2 × 2 matrix as an ellipse.
#[derive(Debug, Clone, PartialEq)]
pub struct Ellipse {
    /// As in the legend.
    pub label: String,
    /// Rows by columns, e.g. K in N/m.
    pub matrix: [[f64; 2]; 2],
    /// How it is drawn.
    pub color: Color,
    /// How its line is broken.
    pub dash: Dash,
    /// Matrices that the data allow as well (draws from the estimate's distribution): their hull is the interval.
    pub samples: Vec<[[f64; 2]; 2]>,
}

impl Ellipse {
    /// An ellipse without an interval.
    pub fn new(label: impl Into<String>, matrix: [[f64; 2]; 2], color: Color, dash: Dash) -> Self {
        Self { label: label.into(), matrix, color, dash, samples: Vec::new() }
    }
}

/// Long and short half-axis and the direction of the long one, in degrees from +x within (−90, 90].
///
/// They are the singular values of the matrix and its first left singular vector, from the symmetric A Aᵀ.
pub fn axes(matrix: [[f64; 2]; 2]) -> (f64, f64, f64) {
    let [[a, b], [c, d]] = matrix;
    let (p, q, r) = (a * a + b * b, c * c + d * d, a * c + b * d);
    let (mean, spread) = (0.5 * (p + q), (0.5 * (p - q)).hypot(r));
    let long = (mean + spread).sqrt();
    // From the determinant: the difference of two near-equal numbers would lose the short axis.
    let short = if long > 0.0 { (a * d - b * c).abs() / long } else { 0.0 };
    (long, short, (0.5 * (2.0 * r).atan2(p - q)).to_degrees())
}

/// The rim, beginning in the direction of the first column.
pub(super) fn outline(matrix: [[f64; 2]; 2]) -> (Vec<f64>, Vec<f64>) {
    let point = |k: usize| {
        let (sine, cosine) = (TAU * k as f64 / (CORNERS - 1) as f64).sin_cos();
        (matrix[0][0] * cosine + matrix[0][1] * sine, matrix[1][0] * cosine + matrix[1][1] * sine)
    };
    (0..CORNERS).map(point).unzip()
}

/// Distance of an ellipse's rim from its centre in the direction `angle`: r = |det A| / |adj(A) n|; 0 if it is flat.
fn radius(matrix: [[f64; 2]; 2], angle: f64) -> f64 {
    let ([[a, b], [c, d]], (sine, cosine)) = (matrix, angle.sin_cos());
    let length = (d * cosine - b * sine).hypot(a * sine - c * cosine);
    if length > 0.0 { (a * d - b * c).abs() / length } else { 0.0 }
}

/// A sorted list's value at a share of it, between neighbours in proportion.
fn quantile(sorted: &[f64], share: f64) -> f64 {
    let at = share * (sorted.len().saturating_sub(1)) as f64;
    let (below, above) = (at.floor() as usize, at.ceil() as usize);
    match (sorted.get(below), sorted.get(above)) {
        (Some(low), Some(high)) => low + (high - low) * (at - at.floor()),
        _ => f64::NAN,
    }
}

fn quantiles(values: impl Iterator<Item = f64>) -> (f64, f64) {
    let mut sorted: Vec<f64> = values.filter(|value| value.is_finite()).collect();
    sorted.sort_by(f64::total_cmp);
    (quantile(&sorted, 0.025), quantile(&sorted, 0.975))
}

/// The ring between the 2.5 % and the 97.5 % quantile of the samples' rims, direction by direction.
fn ring(samples: &[[[f64; 2]; 2]]) -> (Vec<f64>, Vec<f64>) {
    let angles = (0..CORNERS).map(|k| TAU * k as f64 / (CORNERS - 1) as f64);
    let (inner, outer): (Vec<_>, Vec<_>) = angles
        .map(|angle| {
            let (low, high) = quantiles(samples.iter().map(|&sample| radius(sample, angle)));
            let (sine, cosine) = angle.sin_cos();
            ((low * cosine, low * sine), (high * cosine, high * sine))
        })
        .unzip();
    inner.into_iter().chain([(f64::NAN, f64::NAN)]).chain(outer).unzip()
}

/// Ellipses over each other with equal units on both axes; the shaded ring holds the rim at 95 % in each direction.
///
/// The table behind the picture has half-axes, direction and area, with the 95 % range of the samples.
///
/// # Errors
/// [`FigureError::Empty`] without an ellipse.
pub fn ellipse(name: &str, title: &str, axis_names: [&str; 2], unit: &str, ellipses: &[Ellipse]) -> Result<Figure, FigureError> {
    if ellipses.is_empty() {
        return Err(FigureError::Empty { what: "the list of ellipses" });
    }
    let mut panel = Panel::new(Axis::linear(format!("Along {}", axis_names[0]), unit), Axis::linear(format!("Along {}", axis_names[1]), unit));
    panel.equal_aspect = true;
    for ellipse in ellipses {
        if !ellipse.samples.is_empty() {
            let (x, y) = ring(&ellipse.samples);
            panel.series.push(Series::area(ellipse.label.as_str(), x, y, ellipse.color));
        }
        let (x, y) = outline(ellipse.matrix);
        panel.series.push(Series::line(ellipse.label.as_str(), x, y, ellipse.color).dash(ellipse.dash));
    }
    let shaded = if ellipses.iter().any(|ellipse| !ellipse.samples.is_empty()) { " Shaded: 95 % interval." } else { "" };
    let caption = format!("The restoring force to a displacement of unit length in every direction; long means stiff.{shaded}");
    let mut figure = Figure::new(name, title).panel("", panel).caption(caption);
    figure.table = Some(table(title, unit, ellipses));
    Ok(figure)
}

/// A number made of long half-axis, short half-axis and direction.
type Property = fn((f64, f64, f64)) -> f64;

/// One column an ellipse, one row a property.
fn table(title: &str, unit: &str, ellipses: &[Ellipse]) -> Table {
    let mut table = Table::new(title, [""], ellipses.iter().map(|ellipse| ellipse.label.as_str()));
    let properties: [(String, Property); 4] = [
        (format!("Long half-axis [{unit}]"), |(long, _, _)| long),
        (format!("Short half-axis [{unit}]"), |(_, short, _)| short),
        ("Direction of the long one [°]".to_string(), |(_, _, direction)| direction),
        ("Ratio long to short".to_string(), |(long, short, _)| long / short),
    ];
    for (name, property) in properties {
        let mut row = vec![name];
        for ellipse in ellipses {
            let of_estimate = axes(ellipse.matrix);
            // A direction is known up to half a turn: take the one nearest to the estimate's.
            let of_sample = |&matrix: &[[f64; 2]; 2]| {
                let (long, short, direction) = axes(matrix);
                property((long, short, of_estimate.2 + (direction - of_estimate.2 + 90.0).rem_euclid(180.0) - 90.0))
            };
            let value = significant(property(of_estimate), 3);
            row.push(match quantiles(ellipse.samples.iter().map(of_sample)) {
                (low, high) if low.is_finite() => format!("{value} [{}, {}]", significant(low, 3), significant(high, 3)),
                _ => value,
            });
        }
        table.rows.push(row);
    }
    table
}

#[cfg(test)]
mod tests {
    use super::*;

    const K: [[f64; 2]; 2] = [[300.0, -60.0], [-60.0, 520.0]];

    #[test]
    fn half_axes_of_a_symmetric_matrix_are_its_eigenvalues() {
        let (long, short, direction) = axes(K);
        // λ = 410 ± √(110² + 60²)
        let spread = 110f64.hypot(60.0);
        assert!((long - 410.0 - spread).abs() < 1e-10 && (short - 410.0 + spread).abs() < 1e-10);
        assert!(((2.0 * direction.to_radians()).tan() - 2.0 * -60.0 / (300.0 - 520.0)).abs() < 1e-10 && direction.abs() > 45.0);
    }

    #[test]
    fn the_rim_lies_at_the_radius_in_every_direction() {
        let skew = [[300.0, -90.0], [-30.0, 520.0]];
        let (x, y) = outline(skew);
        for (x, y) in x.iter().zip(&y) {
            assert!((radius(skew, y.atan2(*x)) / x.hypot(*y) - 1.0).abs() < 1e-12);
        }
        assert_eq!(radius([[0.0; 2]; 2], 0.3), 0.0);
    }

    #[test]
    fn samples_become_a_ring_around_the_ellipse_and_ranges_in_the_table() {
        let scaled = |factor: f64| K.map(|row| row.map(|value| value * factor));
        let mut fitted = Ellipse::new("fitted", K, Color::Blue, Dash::Solid);
        fitted.samples = (0..=200).map(|k| scaled(0.9 + 0.001 * f64::from(k))).collect();
        let figure = ellipse("ellipse", "Stiffness", ["x", "y"], "N/m", &[fitted]).unwrap();
        assert_eq!(figure.cells[0].panels[0].series.len(), 2);
        let rows = &figure.table.as_ref().unwrap().rows;
        assert_eq!(rows[0][1], "535 [484, 586]", "535.3 × 0.905 and × 1.095");
    }

    #[test]
    fn no_ellipse_is_an_error() {
        assert!(ellipse("e", "", ["x", "y"], "N/m", &[]).is_err());
    }
}
