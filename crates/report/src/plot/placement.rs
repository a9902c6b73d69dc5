//! Where the numbers of a panel go.

use super::panel::Panel;
use super::series::Mark;

/// Coordinates further out than this are cut, which no eye can tell.
pub(super) const FAR: f64 = 4000.0;

/// Where numbers go in a panel, relative to its plot area.
pub(super) struct Placement<'a> {
    pub panel: &'a Panel,
    pub x: (f64, f64),
    pub y: (f64, f64),
    pub width: f64,
    pub height: f64,
    /// Left end of the plot area in the panel.
    pub left: f64,
    /// Its upper end.
    pub top: f64,
    /// Both ranges in the coordinates in which their axes are even.
    even: [(f64, f64); 2],
}

impl<'a> Placement<'a> {
    /// Of a panel that shows these ranges in a plot area of this width and height, which begins at `left` and `top`.
    pub fn new(panel: &'a Panel, [x, y]: [(f64, f64); 2], [width, height]: [f64; 2], [left, top]: [f64; 2]) -> Self {
        let even = [(panel.x.scale, x), (panel.y.scale, y)].map(|(scale, (from, to))| (scale.forward(from), scale.forward(to)));
        Placement { panel, x, y, width, height, left, top, even }
    }

    pub fn x(&self, value: f64) -> f64 {
        let (low, high) = self.even[0];
        ((self.panel.x.scale.forward(value) - low) / (high - low) * self.width).clamp(-FAR, self.width + FAR)
    }

    pub fn y(&self, value: f64) -> f64 {
        let (low, high) = self.even[1];
        ((high - self.panel.y.scale.forward(value)) / (high - low) * self.height).clamp(-FAR, self.height + FAR)
    }
}

/// The ranges of both axes. Bands widen the ordinate by at most 40 % beyond the lines: an interval without bounds
/// should not hide what is known.
pub(super) fn ranges(panel: &Panel) -> ((f64, f64), (f64, f64)) {
    let spans = panel.spans.iter().flat_map(|(from, to)| [*from, *to]);
    let x = panel.x.resolve(panel.series.iter().flat_map(|series| series.mark.x().iter().copied()).chain(spans));
    let dotted = panel.series.iter().any(|series| matches!(series.mark, Mark::Points { .. }));
    let x = match (panel.is_equal(), panel.is_free() || dotted) {
        (true, _) => panel.x.widened(x, 0.06),
        (false, true) => panel.x.widened(x, 0.03),
        (false, false) => x,
    };
    let inside = |band: bool| {
        panel.series.iter().filter(move |series| series.mark.is_filled() == band).flat_map(move |series| {
            series
                .mark
                .columns()
                .into_iter()
                .flat_map(move |(_, values)| series.mark.x().iter().zip(values).filter(move |(at, _)| (x.0..=x.1).contains(*at)).map(|(_, value)| *value))
        })
    };
    let scale = panel.y.scale;
    let lines = panel.rules.iter().map(|rule| rule.y).chain(inside(false));
    if !inside(false).any(|value| scale.has(value)) {
        let y = panel.y.resolve(inside(true).chain(lines));
        return (x, panel.y.widened(y, 0.05));
    }
    let core = panel.y.resolve(lines);
    if panel.y.range.is_some() {
        return (x, core);
    }
    let (low, high) = (scale.forward(core.0), scale.forward(core.1));
    let room = 0.4 * (high - low);
    let near = scale.backward(low - room)..=scale.backward(high + room);
    let within = inside(true).filter(|value| near.contains(value));
    let y = panel.y.resolve([core.0, core.1].into_iter().chain(within));
    (x, panel.y.widened(y, 0.05))
}

/// Widens one of two ranges so that a unit has the same length on both axes.
pub(super) fn equal(x: (f64, f64), y: (f64, f64), width: f64, height: f64) -> ((f64, f64), (f64, f64)) {
    let per_pixel = ((x.1 - x.0) / width).max((y.1 - y.0) / height);
    let around = |(from, to): (f64, f64), pixels: f64| {
        let middle = 0.5 * (from + to);
        (middle - 0.5 * pixels * per_pixel, middle + 0.5 * pixels * per_pixel)
    };
    (around(x, width), around(y, height))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plot::{Axis, Color, Series};

    #[test]
    fn an_unbounded_interval_does_not_hide_the_curve() {
        let x = vec![1.0, 2.0, 3.0];
        let panel = Panel::new(Axis::linear("", ""), Axis::linear("", ""))
            .with(Series::line("a", x.clone(), vec![1.0, 2.0, 1.5], Color::Blue))
            .with(Series::band("a", x, vec![0.9, -1e9, 1.4], vec![1.1, 1e9, 1.6], Color::Blue));
        let (_, y) = ranges(&panel);
        assert!(y.0 > 0.8 && y.1 < 2.1, "{y:?}");
    }

    #[test]
    fn equal_axes_have_equal_units() {
        let (x, y) = equal((0.0, 1.0), (0.0, 4.0), 200.0, 100.0);
        assert_eq!((x, y), ((-3.5, 4.5), (0.0, 4.0)));
    }
}
