//! The legend: one entry for each label of the figure.

use super::palette::{Color, Dash};
use super::panel::Panel;
use super::series::Mark;
use super::shades::shade_swatch;
use super::svg::{escape, px};

/// What a label looks like in the panels.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct LegendEntry {
    pub label: String,
    pub color: Color,
    pub dash: Dash,
    pub line: bool,
    pub points: bool,
    pub band: bool,
    pub part: bool,
    pub shades: bool,
}

/// Entries in the order of first appearance; marks of one label are merged. Series without a label have no entry.
pub(crate) fn legend_entries<'a>(panels: impl Iterator<Item = &'a Panel> + Clone) -> Vec<LegendEntry> {
    let mut entries: Vec<LegendEntry> = Vec::new();
    for (panel, series) in panels.clone().flat_map(|panel| panel.series.iter().map(move |series| (panel, series))) {
        if series.label.is_empty() {
            continue;
        }
        let at = entries.iter().position(|entry| entry.label == series.label).unwrap_or_else(|| {
            entries.push(LegendEntry { label: series.label.clone(), color: series.color, ..LegendEntry::default() });
            entries.len() - 1
        });
        let entry = &mut entries[at];
        match series.mark {
            Mark::Line { .. } | Mark::Steps { .. } => {
                entry.line = true;
                entry.dash = series.dash;
            }
            Mark::Points { .. } => entry.points = true,
            Mark::Area { .. } if !panel.y.names.is_empty() => entry.part = true,
            Mark::Band { .. } | Mark::Area { .. } => entry.band = true,
        }
    }
    for label in panels.filter_map(|panel| panel.shades.as_ref()).map(|shades| shades.label.clone()) {
        if entries.iter().all(|entry| entry.label != label) {
            entries.push(LegendEntry { label, shades: true, ..LegendEntry::default() });
        }
    }
    entries
}

/// The sample of an entry, 24 × 10 pixels with its middle at height `y`.
pub(crate) fn swatch(entry: &LegendEntry, x: f64, y: f64) -> String {
    let color = entry.color.name();
    let mut svg = String::new();
    if entry.band || entry.part {
        let class = if entry.part { "band part" } else { "band" };
        svg += &format!("<path class=\"{class} c-{color}\" d=\"M{} {}h24v10h-24Z\"/>", px(x), px(y - 5.0));
    }
    if entry.shades {
        svg += &shade_swatch(x, y);
    }
    if entry.line {
        svg += &format!("<path class=\"line c-{color}{}\" d=\"M{} {}h24\"/>", entry.dash.class(), px(x), px(y));
    }
    if entry.points {
        svg += &format!("<path class=\"points c-{color}\" d=\"M{} {}h0\"/>", px(x + 12.0), px(y));
    }
    svg
}

/// The legend in rows no wider than `width`; its SVG and its height.
pub(crate) fn draw_legend(entries: &[LegendEntry], left: f64, top: f64, width: f64) -> (String, f64) {
    let mut svg = String::new();
    if entries.is_empty() {
        return (svg, 0.0);
    }
    let (mut x, mut y) = (left, top);
    for entry in entries {
        let needed = 32.0 + 6.6 * entry.label.chars().count() as f64 + 18.0;
        if x > left && x + needed > left + width {
            x = left;
            y += 18.0;
        }
        svg += &swatch(entry, x, y);
        svg += &format!("<text class=\"legend\" x=\"{}\" y=\"{}\">{}</text>", px(x + 30.0), px(y + 4.0), escape(&entry.label));
        x += needed;
    }
    (svg, y - top + 24.0)
}
