//! A surface seen from above.

use super::palette::Color;
use super::panel::Shades;
use super::placement::Placement;
use super::svg::px;

/// Steps from the lightest to the darkest; an eye tells fewer apart.
const STEPS: usize = 24;

/// How dark a height is, from nought to one; nothing where there is no height.
fn darkness(shades: &Shades, value: f64) -> Option<usize> {
    let (low, high) = (shades.range.0.ln(), shades.range.1.ln());
    let share = (value.ln() - low) / (high - low);
    share.is_finite().then(|| (share.clamp(0.0, 1.0) * (STEPS - 1) as f64).round() as usize + 1)
}

/// Half way to the neighbours, and as far again beyond the ends.
fn edges(at: &[f64]) -> Vec<f64> {
    let inner = at.windows(2).map(|pair| 0.5 * (pair[0] + pair[1]));
    let width = |k: usize| if at.len() < 2 { 1.0 } else { at[k + 1] - at[k] };
    let (Some(first), Some(last)) = (at.first(), at.last()) else { return Vec::new() };
    std::iter::once(first - 0.5 * width(0)).chain(inner).chain([last + 0.5 * width(at.len().saturating_sub(2))]).collect()
}

/// One path for each step of darkness, in the coordinates of the plot area.
pub(super) fn draw_shades(at: &Placement, shades: &Shades) -> String {
    let clamped = |edges: Vec<f64>, (from, to): (f64, f64)| edges.into_iter().map(|e| e.clamp(from, to)).collect::<Vec<_>>();
    let (x, y) = (clamped(edges(&shades.x), at.x), clamped(edges(&shades.y), at.y));
    let mut paths = vec![String::new(); STEPS + 1];
    for (row, values) in shades.value.iter().enumerate() {
        for (column, value) in values.iter().enumerate() {
            let Some(step) = darkness(shades, *value) else { continue };
            let (left, right, top, foot) = (at.x(x[column]), at.x(x[column + 1]), at.y(y[row + 1]), at.y(y[row]));
            paths[step] += &format!("M{} {}H{}V{}H{}Z", px(left), px(top), px(right), px(foot), px(left));
        }
    }
    let drawn = paths.iter().enumerate().filter(|(_, path)| !path.is_empty());
    drawn
        .map(|(step, path)| {
            format!(
                "<path class=\"c-{}\" fill=\"currentColor\" shape-rendering=\"crispEdges\" fill-opacity=\"{}\" d=\"{path}\"/>",
                Color::Blue.name(),
                opacity(step)
            )
        })
        .collect()
}

fn opacity(step: usize) -> f64 {
    (100.0 * step as f64 / STEPS as f64).round() / 100.0
}

/// From light to dark, 24 pixels wide and 10 high with the middle at height `y`.
pub(super) fn shade_swatch(x: f64, y: f64) -> String {
    let part = |k: usize| {
        format!(
            "<path class=\"c-{}\" fill=\"currentColor\" shape-rendering=\"crispEdges\" fill-opacity=\"{}\" d=\"M{} {}h6v10h-6Z\"/>",
            Color::Blue.name(),
            opacity(STEPS * k / 4),
            px(x + 6.0 * (k - 1) as f64),
            px(y - 5.0)
        )
    };
    (1..=4).map(part).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plot::{Axis, Panel};

    #[test]
    fn each_cell_reaches_half_way_to_its_neighbours_and_what_is_not_known_stays_empty() {
        let mut panel = Panel::new(Axis::linear("Phase", "").range(0.0, 1.0), Axis::linear("Frequency", "Hz").range(1.0, 3.0));
        let shades = Shades {
            label: "gain".into(),
            x: vec![0.25, 0.75].into(),
            y: vec![1.5, 2.5],
            value: vec![vec![1.0, 100.0], vec![f64::NAN, 10.0]],
            range: (1.0, 100.0),
        };
        panel.shades = Some(shades.clone());
        let at = Placement::new(&panel, [(0.0, 1.0), (1.0, 3.0)], [100.0, 200.0], [0.0, 0.0]);
        let drawn = draw_shades(&at, &shades);
        assert_eq!(drawn.matches("<path").count(), 3, "{drawn}");
        assert!(drawn.contains("fill-opacity=\"0.04\" d=\"M0 100H50V200H0Z\"") && drawn.contains("fill-opacity=\"1\" d=\"M50 100H100V200H50Z\""), "{drawn}");
    }
}
