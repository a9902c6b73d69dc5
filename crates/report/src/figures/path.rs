//! Stiffness ellipses along the path of a movement.

use super::ellipse::{axes, outline};
use super::error::{FigureError, expect_shape};
use crate::number::{printed_unit, significant};
use crate::plot::{Axis, Color, Dash, Figure, Panel, Pin, Series};
use crate::table::Table;

/// A symmetric 2 × 2 matrix at a place of a path.
#[derive(Debug, Clone, PartialEq)]
pub struct PathEllipse {
    /// What tells the place, e.g. the phase.
    pub label: String,
    /// Where it stands.
    pub centre: [f64; 2],
    /// The matrix.
    pub matrix: [[f64; 2]; 2],
    /// What was simulated, where that is known.
    pub truth: Option<[[f64; 2]; 2]>,
}

/// A stretch of a path, with ellipses in the order of the movement.
#[derive(Debug, Clone, PartialEq)]
pub struct PathStretch {
    /// Which one it is.
    pub title: String,
    /// Abscissae of the path.
    pub x: Vec<f64>,
    /// Ordinates of the path.
    pub y: Vec<f64>,
    /// The ellipses on it.
    pub ellipses: Vec<PathEllipse>,
}

/// A path in stretches, each in a panel of its own: on its way back a movement would cover what it showed on its way there.
#[derive(Debug, Clone, PartialEq)]
pub struct EllipsePath {
    /// Both axes of the plane, each with its unit.
    pub axes: [(String, String); 2],
    /// Unit of the matrices.
    pub unit: String,
    /// What the labels of the ellipses are.
    pub place: String,
    /// The stretches.
    pub stretches: Vec<PathStretch>,
}

/// Width of a plot in pixels, where panels stand below each other and where they stand side by side; about, as the labels of the ordinate take
/// what they need.
const WIDTH_PX: [f64; 2] = [810.0, 360.0];
/// A path lower than this share of its width is drawn over the whole width, one stretch below the other: two such plots are as high as wide.
const FLAT: f64 = 0.5;
/// A line of words.
const LINE_PX: f64 = 13.0;
/// From an ellipse's rim to the middle of its label: half of what four letters are wide, and a gap.
const TO_LABEL_PX: f64 = 18.0;

/// Ellipses of one scale along a path, with equal units on both axes.
///
/// They are as large as can be while neighbours on the path do not touch; a bar says how long a stiffness is.
///
/// # Errors
/// [`FigureError::Empty`] without two ellipses at different places; [`FigureError::Shape`] where a path's coordinates differ in number.
pub fn ellipse_path(name: &str, title: &str, data: &EllipsePath) -> Result<Figure, FigureError> {
    for stretch in &data.stretches {
        expect_shape(format!("\"{}\"", stretch.title), "places", &[stretch.x.len()], &[stretch.y.len()])?;
    }
    let scale = data.stretches.iter().filter_map(|stretch| largest_scale(&stretch.ellipses)).fold(f64::INFINITY, f64::min);
    if !scale.is_finite() {
        return Err(FigureError::Empty { what: "the list of ellipses at different places" });
    }
    let view = View::of(data, scale);
    let bar = round_below(data.stretches.iter().flat_map(|s| &s.ellipses).map(|e| axes(e.matrix).0).fold(0.0, f64::max));
    let mut figure = Figure::new(name, title).columns(if view.proportion <= FLAT { 1 } else { data.stretches.len() });
    for stretch in &data.stretches {
        figure = figure.panel(stretch.title.as_str(), panel(data, stretch, &view, bar));
    }
    figure.table = Some(table(title, data));
    Ok(figure)
}

/// The length of an ellipse's projection on a direction, from its centre: |A n| for a symmetric A.
fn reach(matrix: [[f64; 2]; 2], [x, y]: [f64; 2]) -> f64 {
    matrix.map(|[a, b]| a * x + b * y).into_iter().fold(0.0, f64::hypot)
}

/// The direction and the distance from one place to another.
fn way(from: [f64; 2], to: [f64; 2]) -> ([f64; 2], f64) {
    let [x, y] = [to[0] - from[0], to[1] - from[1]];
    let length = x.hypot(y);
    ([x / length, y / length], length)
}

/// The scale at which the closest two neighbours just touch a line between them.
fn largest_scale(ellipses: &[PathEllipse]) -> Option<f64> {
    let touches = |pair: &[PathEllipse]| {
        let (direction, distance) = way(pair[0].centre, pair[1].centre);
        distance / (reach(pair[0].matrix, direction) + reach(pair[1].matrix, direction))
    };
    ellipses.windows(2).map(touches).filter(|scale| scale.is_finite() && *scale > 0.0).reduce(f64::min)
}

/// The largest of 1, 2 and 5 times a power of ten that is not above `value`.
fn round_below(value: f64) -> f64 {
    let power = 10f64.powf(value.log10().floor());
    [5.0, 2.0, 1.0].into_iter().map(|digit| digit * power).find(|round| *round <= value).unwrap_or(power)
}

/// What all panels show.
struct View {
    scale: f64,
    low: [f64; 2],
    high: [f64; 2],
    /// Height in widths.
    proportion: f64,
    /// A pixel in units of the plane.
    px: f64,
}

impl View {
    fn of(data: &EllipsePath, scale: f64) -> Self {
        let ends = ends(data, scale);
        let [wide, tall] = ends.map(|[low, high]| high - low);
        // Labels all around, and two lines below for the bar with its words.
        let (around, below) = (LINE_PX + TO_LABEL_PX, 2.0 * LINE_PX);
        let fit = |width: f64, most: f64| (wide / (width - 2.0 * around)).max(tall / (width * most - 2.0 * around - below));
        let whole = |px: f64| [wide / px + 2.0 * around, tall / px + 2.0 * around + below];
        let (width, most) = if tall < FLAT * wide { (WIDTH_PX[0], FLAT) } else { (WIDTH_PX[1], 1.0) };
        let px = fit(width, most);
        let height = whole(px)[1];
        let middle = ends.map(|[low, high]| 0.5 * (low + high));
        let half = [0.5 * width * px, 0.5 * height * px];
        let shift = 0.5 * below * px;
        View {
            scale,
            low: [middle[0] - half[0], middle[1] - half[1] - shift],
            high: [middle[0] + half[0], middle[1] + half[1] - shift],
            proportion: height / width,
            px,
        }
    }

    fn axis(&self, axis: usize, (label, unit): &(String, String)) -> Axis {
        Axis::linear(label.as_str(), unit.as_str()).range(self.low[axis], self.high[axis])
    }
}

/// What paths and ellipses reach along each axis.
fn ends(data: &EllipsePath, scale: f64) -> [[f64; 2]; 2] {
    let mut ends = [[f64::INFINITY, f64::NEG_INFINITY]; 2];
    let mut take = |axis: usize, value: f64, room: f64| ends[axis] = [ends[axis][0].min(value - room), ends[axis][1].max(value + room)];
    for stretch in &data.stretches {
        stretch.x.iter().for_each(|x| take(0, *x, 0.0));
        stretch.y.iter().for_each(|y| take(1, *y, 0.0));
        for ellipse in &stretch.ellipses {
            for matrix in std::iter::once(ellipse.matrix).chain(ellipse.truth) {
                [[1.0, 0.0], [0.0, 1.0]].into_iter().enumerate().for_each(|(axis, n)| take(axis, ellipse.centre[axis], scale * reach(matrix, n)));
            }
        }
    }
    ends
}

fn panel(data: &EllipsePath, stretch: &PathStretch, view: &View, bar: f64) -> Panel {
    let mut panel = Panel::new(view.axis(0, &data.axes[0]), view.axis(1, &data.axes[1]));
    (panel.equal_aspect, panel.proportion) = (true, view.proportion);
    let rims = |of: &dyn Fn(&PathEllipse) -> Option<[[f64; 2]; 2]>| -> (Vec<f64>, Vec<f64>) {
        let rim = |ellipse: &PathEllipse| {
            let (x, y) = outline(of(ellipse).unwrap_or([[f64::NAN; 2]; 2]));
            let placed = |(dx, dy): (f64, f64)| (ellipse.centre[0] + view.scale * dx, ellipse.centre[1] + view.scale * dy);
            x.into_iter().zip(y).map(placed).chain([(f64::NAN, f64::NAN)]).collect::<Vec<_>>()
        };
        stretch.ellipses.iter().flat_map(rim).unzip()
    };
    let (x, y) = rims(&|ellipse| Some(ellipse.matrix));
    panel.series.push(Series::line("mean path", stretch.x.clone(), stretch.y.clone(), Color::Grey));
    panel.series.push(Series::area("stiffness", x.clone(), y.clone(), Color::Blue));
    panel.series.push(Series::line("stiffness", x, y, Color::Blue));
    if stretch.ellipses.iter().any(|ellipse| ellipse.truth.is_some()) {
        let (x, y) = rims(&|ellipse| ellipse.truth);
        panel.series.push(Series::line("simulated", x, y, Color::Ink).dash(Dash::Dotted));
    }
    let (x, y): (Vec<f64>, Vec<f64>) = stretch.ellipses.iter().map(|ellipse| (ellipse.centre[0], ellipse.centre[1])).unzip();
    panel.series.push(Series::points("", x, y, Color::Blue));
    panel.pins = labels(stretch, view);
    let [left, foot] = view.low.map(|low| low + LINE_PX * view.px);
    panel.series.push(Series::line("", vec![left, left + view.scale * bar], vec![foot; 2], Color::Ink));
    let words = format!("{} {}", significant(bar, 1), printed_unit(&data.unit));
    // A pin's words begin a little to the right of it.
    panel.pins.push(Pin { x: left + view.scale * bar, y: foot - 0.75 * LINE_PX * view.px, label: words, centred: false });
    panel
}

/// A label beside each ellipse, across the path: above it where the path does not rise straight up.
fn labels(stretch: &PathStretch, view: &View) -> Vec<Pin> {
    let last = stretch.ellipses.len().saturating_sub(1);
    let label = |(k, ellipse): (usize, &PathEllipse)| {
        let (along, _) = way(stretch.ellipses[k.saturating_sub(1)].centre, stretch.ellipses[(k + 1).min(last)].centre);
        let across = if along[0] < 0.0 || (along[0] == 0.0 && along[1] > 0.0) { [along[1], -along[0]] } else { [-along[1], along[0]] };
        let away = view.scale * reach(ellipse.matrix, across) + TO_LABEL_PX * view.px;
        Pin { x: ellipse.centre[0] + away * across[0], y: ellipse.centre[1] + away * across[1], label: ellipse.label.clone(), centred: true }
    };
    stretch.ellipses.iter().enumerate().map(label).collect()
}

/// One row an ellipse.
fn table(title: &str, data: &EllipsePath) -> Table {
    let unit = printed_unit(&data.unit);
    let caption = |(label, unit): &(String, String)| format!("{label} [{}]", printed_unit(unit));
    let own = [format!("Long half-axis [{unit}]"), format!("Short half-axis [{unit}]"), "Direction of the long one [°]".to_owned()];
    let known = data.stretches.iter().flat_map(|stretch| &stretch.ellipses).any(|ellipse| ellipse.truth.is_some());
    let simulated = own.iter().filter(|_| known).map(|head| format!("{head}, simulated"));
    let heads = std::iter::once(data.place.clone()).chain(data.axes.iter().map(caption)).chain(own.iter().cloned()).chain(simulated);
    let mut table = Table::new(title, [""; 0], heads);
    let of = |matrix: [[f64; 2]; 2]| {
        let (long, short, direction) = axes(matrix);
        [long, short, direction].map(|value| significant(value, 3))
    };
    for ellipse in data.stretches.iter().flat_map(|stretch| &stretch.ellipses) {
        let mut row = vec![ellipse.label.clone()];
        row.extend(ellipse.centre.map(|value| significant(value, 3)));
        row.extend(of(ellipse.matrix));
        row.extend(ellipse.truth.map(of).into_iter().flatten());
        table = table.row(row);
    }
    table
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plot::Mark;

    fn ellipse(x: f64, [long, short]: [f64; 2]) -> PathEllipse {
        PathEllipse { label: x.to_string(), centre: [x, 0.0], matrix: [[long, 0.0], [0.0, short]], truth: Some([[long, 0.0], [0.0, long]]) }
    }

    fn data(ellipses: Vec<PathEllipse>) -> EllipsePath {
        let stretch = PathStretch { title: "there".into(), x: vec![0.0, 0.1, 0.3], y: vec![0.0; 3], ellipses };
        EllipsePath { axes: ["pos_x", "pos_y"].map(|name| (name.into(), "m".into())), unit: "N/m".into(), place: "Phase".into(), stretches: vec![stretch] }
    }

    #[test]
    fn neighbours_just_touch_and_the_bar_has_their_scale() {
        // 100 mm hold 300 and 200 N/m, 200 mm hold 200 and 400 N/m: the first pair decides, 0.2 mm a N/m.
        let figure = ellipse_path("p", "", &data(vec![ellipse(0.0, [300.0, 100.0]), ellipse(0.1, [200.0, 100.0]), ellipse(0.3, [400.0, 100.0])])).unwrap();
        let panel = &figure.cells[0].panels[0];
        let Mark::Line { x, y } = &panel.series[2].mark else { panic!("rims") };
        assert_eq!(panel.series[2].label, "stiffness");
        let widest = x[..181].iter().copied().fold(0.0, f64::max);
        let narrowest = x[182..363].iter().copied().fold(f64::INFINITY, f64::min);
        assert!((widest - 0.06).abs() < 1e-12 && (narrowest - 0.06).abs() < 1e-5 && x[181].is_nan() && y[181].is_nan(), "{widest} {narrowest}");
        let bar = panel.series.last().unwrap();
        // 200 N/m are the largest round number of stiffness below 400 N/m.
        assert!((bar.mark.x()[1] - bar.mark.x()[0] - 0.04).abs() < 1e-12);
        assert_eq!(panel.pins.last().unwrap().label, "200 N/m");
        assert!(panel.pins[..3].iter().all(|pin| pin.centred && pin.y > 0.02));
    }

    #[test]
    fn everything_lies_within_a_view_of_equal_units() {
        let figure = ellipse_path("p", "", &data(vec![ellipse(0.0, [300.0, 900.0]), ellipse(0.3, [200.0, 100.0])])).unwrap();
        let panel = &figure.cells[0].panels[0];
        let [x, y] = [&panel.x, &panel.y].map(|axis| axis.range.unwrap());
        assert!(((y.1 - y.0) / (x.1 - x.0) / panel.proportion - 1.0).abs() < 1e-12);
        let inside = |values: &[f64], (low, high): (f64, f64)| values.iter().filter(|v| v.is_finite()).all(|v| (low..=high).contains(v));
        assert!(panel.series.iter().all(|s| inside(s.mark.x(), x) && s.mark.columns().iter().all(|(_, values)| inside(values, y))));
        assert!(panel.pins.iter().all(|pin| inside(&[pin.x], x) && inside(&[pin.y], y)));
    }

    #[test]
    fn the_table_has_half_axes_beside_what_was_simulated() {
        let figure = ellipse_path("p", "", &data(vec![ellipse(0.0, [300.0, 100.0]), ellipse(0.1, [200.0, 100.0])])).unwrap();
        let table = figure.table.unwrap();
        assert_eq!(table.rows[0], ["0", "0", "0", "300", "100", "0", "300", "300", "0"]);
        assert_eq!(table.rows[0].len(), table.columns.len());
    }

    #[test]
    fn one_place_is_no_path() {
        assert!(ellipse_path("p", "", &data(vec![ellipse(0.0, [300.0, 100.0])])).is_err());
        assert!(ellipse_path("p", "", &data(vec![ellipse(0.1, [300.0, 100.0]); 2])).is_err());
    }

    #[test]
    fn round_numbers_are_one_two_and_five() {
        assert_eq!([999.0, 500.0, 499.0, 19.0, 0.03].map(round_below), [500.0, 500.0, 200.0, 10.0, 0.02]);
    }
}
