//! A series as a path.

use super::axis::Scale;
use super::decimate::{envelope, min_max};
use super::placement::{FAR, Placement};
use super::series::{Mark, Series};
use super::svg::px;

/// Of dots in one square of this many pixels, the first is drawn.
const NEAR: f64 = 0.25;

/// A series as SVG, in the coordinates of the plot area. `index` is its number in the panel.
pub(super) fn draw_series(at: &Placement, series: &Series, index: usize) -> String {
    let x_range = at.x;
    let near = |x: &[f64], k: usize| {
        let inside = |k: usize| x.get(k).is_some_and(|value| (x_range.0..=x_range.1).contains(value));
        inside(k) || inside(k + 1) || (k > 0 && inside(k - 1))
    };
    let point = |(&x, &y): (&f64, &f64)| Some((at.x(x), at.y(y))).filter(|(x, y)| x.is_finite() && y.is_finite());
    let color = series.color.name();
    let dash = series.dash.class();
    let (class, path) = match &series.mark {
        Mark::Line { x, y } => {
            let ascending = series.mark.ascends();
            let runs = runs(x.iter().zip(y).enumerate().map(|(k, pair)| point(pair).filter(|_| !ascending || near(x, k))));
            let runs = split_at_turns(runs, at, |point| point.1);
            ("line", runs.iter().map(|run| polyline(&if ascending { min_max(run) } else { run.clone() })).collect())
        }
        Mark::Steps { edges, y } => {
            let corners = edges.windows(2).zip(y).flat_map(|(pair, y)| [(&pair[0], y), (&pair[1], y)]);
            let runs = runs(corners.map(point));
            ("line", runs.iter().map(|run| polyline(&min_max(run))).collect())
        }
        Mark::Points { x, y } => {
            let mut taken = std::collections::BTreeSet::new();
            let apart = x.iter().zip(y).filter_map(point).filter(|(x, y)| taken.insert(((x / NEAR).round() as i64, (y / NEAR).round() as i64)));
            ("points", apart.map(|(x, y)| format!("M{} {}h0", px(x), px(y))).collect())
        }
        Mark::Area { x, y } => {
            let rings = runs(x.iter().zip(y).map(point));
            (if at.panel.y.names.is_empty() { "band" } else { "band part" }, rings.iter().map(|ring| polyline(ring) + "Z").collect::<String>())
        }
        Mark::Band { x, low, high } => {
            let runs = runs(x.iter().zip(low).zip(high).enumerate().map(|(k, ((&x_k, &low_k), &high_k))| {
                // A lower end that is not positive lies below any logarithmic axis.
                let foot = if at.panel.y.scale == Scale::Log && low_k <= 0.0 { at.height + FAR } else { at.y(low_k) };
                let point = (at.x(x_k), at.y(high_k), foot);
                (near(x, k) && point.0.is_finite() && point.1.is_finite() && point.2.is_finite()).then_some(point)
            }));
            let runs = split_at_turns(runs, at, |point| 0.5 * (point.1 + point.2));
            ("band", runs.iter().map(|run| area(&envelope(run))).collect::<String>())
        }
    };
    if path.is_empty() {
        return String::new();
    }
    let dash = if class == "line" { dash } else { "" };
    let dense = if class == "line" && series.mark.x().len() as f64 > 2.0 * at.width { " dense" } else { "" };
    format!("<path class=\"{class}{dense} c-{color}{dash}\" data-s=\"{index}\" d=\"{path}\"/>")
}

/// An angle that leaves its turn comes back on the other side: nothing joins the two. Other ordinates stay as they are.
fn split_at_turns<T: Copy>(runs: Vec<Vec<T>>, at: &Placement, height: fn(&T) -> f64) -> Vec<Vec<T>> {
    if at.panel.y.scale != Scale::Degrees {
        return runs;
    }
    let half_turn = 180.0 / (at.y.1 - at.y.0) * at.height;
    runs.iter().flat_map(|run| run.chunk_by(|a, b| (height(a) - height(b)).abs() <= half_turn)).map(<[_]>::to_vec).collect()
}

/// Stretches without gaps.
fn runs<T: Copy>(points: impl Iterator<Item = Option<T>>) -> Vec<Vec<T>> {
    let mut all = Vec::new();
    let mut run = Vec::new();
    for point in points {
        match point {
            Some(point) => run.push(point),
            None if run.is_empty() => {}
            None => all.push(std::mem::take(&mut run)),
        }
    }
    if !run.is_empty() {
        all.push(run);
    }
    all
}

fn polyline(points: &[(f64, f64)]) -> String {
    match points {
        [] => String::new(),
        [(x, y)] => format!("M{} {}h0", px(*x), px(*y)),
        [(x, y), rest @ ..] => {
            let rest: Vec<_> = rest.iter().map(|(x, y)| format!("{} {}", px(*x), px(*y))).collect();
            format!("M{} {}L{}", px(*x), px(*y), rest.join(" "))
        }
    }
}

fn area(points: &[(f64, f64, f64)]) -> String {
    let upper = points.iter().map(|&(x, high, _)| (x, high));
    let lower = points.iter().rev().map(|&(x, _, low)| (x, low));
    let outline: Vec<_> = upper.chain(lower).collect();
    if points.len() < 2 { String::new() } else { polyline(&outline) + "Z" }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plot::{Axis, Color, Panel};

    #[test]
    fn neither_line_nor_band_joins_the_two_ends_of_a_turn() {
        let x = vec![0.0, 1.0, 2.0, 3.0];
        let angle = vec![160.0, 175.0, -175.0, -160.0];
        let panel = Panel::new(Axis::linear("", ""), Axis::degrees("Phase").range(-180.0, 180.0))
            .with(Series::line("a", x.clone(), angle.clone(), Color::Blue))
            .with(Series::band("a", x, angle.iter().map(|angle| angle - 5.0).collect(), angle.iter().map(|angle| angle + 5.0).collect(), Color::Blue));
        let at = Placement::new(&panel, [(0.0, 3.0), (-180.0, 180.0)], [300.0, 360.0], [0.0, 0.0]);
        let drawn: Vec<String> = panel.series.iter().map(|series| draw_series(&at, series, 0)).collect();
        assert!(drawn[0].contains("d=\"M0 20L100 5M200 355L300 340\""), "{}", drawn[0]);
        assert_eq!(drawn[1].matches('M').count(), 2, "{}", drawn[1]);
    }
}
