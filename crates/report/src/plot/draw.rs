//! A panel as SVG.
//!
//! What the page's script needs to lay the panel out anew (for another width, or zoomed) goes along as JSON. The
//! data stand in a nested `<svg>`, which clips them, inside one `<g class="view">`: zooming is a transformation of
//! that group, and strokes and dots keep their size (`vector-effect: non-scaling-stroke`).

use serde_json::json;

use super::axis::Scale;
use super::palette::{Color, standalone_classes};
use super::panel::Panel;
use super::placement::{Placement, equal, ranges};
use super::shades::draw_shades;
use super::shapes::draw_series;
use super::svg::{escape, px};
use super::ticks::{Tick, ticks};
use crate::number::printed_unit;

const LEFT: f64 = 50.0;
/// Names beside a panel take no more than this.
const WIDEST_LEFT: f64 = 190.0;
const RIGHT: f64 = 12.0;
const TOP: f64 = 20.0;
/// Without a name of the ordinate.
const TOP_BARE: f64 = 6.0;
const BOTTOM_LABELLED: f64 = 38.0;
const BOTTOM_BARE: f64 = 8.0;
/// Ticks about this many pixels apart, sideways and upwards.
const TICK_SPACING: (f64, f64) = (70.0, 38.0);
/// Width of a letter of a tick's label, about.
const LETTER: f64 = 6.2;

/// The styles that both a file and the page need.
pub(crate) const PLOT_CSS: &str = include_str!("../../assets/plot.css");

/// All styles of an SVG that stands alone.
pub(crate) fn standalone_style() -> String {
    let compact: String = PLOT_CSS.lines().map(str::trim).collect();
    let page = ".sheet{fill:#fff}text{font-family:Helvetica,Arial,'DejaVu Sans',sans-serif;fill:#3c4654}.figure-title{font-size:16px;font-weight:600;fill:#1c2430}\
                .cell-title{font-size:13px;font-weight:600;fill:#1c2430}.legend{font-size:12px}.grid{stroke:#e3e7ed}.base{stroke:#9aa4b2}.span{fill:#8a94a3}";
    format!("{page}{compact}{}", standalone_classes())
}

/// A drawn panel.
pub(crate) struct PanelFrame {
    /// What goes between `<svg>` and `</svg>`.
    pub body: String,
    /// Width in pixels.
    pub width: f64,
    /// Height in pixels.
    pub height: f64,
    /// What the script needs, as JSON.
    pub meta: String,
}

/// Draws a panel `width` pixels wide whose plot area begins at `left`; `labelled` gives the abscissa its ticks' labels
/// and its name.
pub(crate) fn draw_panel(panel: &Panel, width: f64, left: f64, labelled: bool) -> PanelFrame {
    let bottom = if labelled { BOTTOM_LABELLED } else { BOTTOM_BARE };
    let top = if panel.y.caption().is_empty() { TOP_BARE } else { TOP };
    let plot_width = width - left - RIGHT;
    let plot_height = if panel.is_equal() { plot_width * panel.proportion } else { panel.height };
    let (x, y) = ranges(panel);
    let (x_shown, y_shown) = if panel.is_equal() { equal(x, y, plot_width, plot_height) } else { (x, y) };
    let at = Placement::new(panel, [x_shown, y_shown], [plot_width, plot_height], [left, top]);
    let x_ticks = sideways_ticks(panel.x.scale, x_shown, plot_width);
    let y_ticks = upwards_ticks(panel, y_shown, plot_height);
    // Names may be long; a number is never cut, as it would be another number.
    let fit = |label: &str| if panel.y.names.is_empty() { label.to_owned() } else { shortened(label, left) };
    let y_ticks: Vec<Tick> = y_ticks.into_iter().map(|tick| Tick { label: fit(&tick.label), ..tick }).collect();
    let mut body = frame(&at, &x_ticks, &y_ticks, labelled);
    body += &format!("<svg class=\"data\" x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\"><g class=\"view\">", px(left), px(top), px(plot_width), px(plot_height));
    body += &panel.shades.as_ref().map_or_else(String::new, |shades| draw_shades(&at, shades));
    body += &annotations(&at);
    let bands_first = |is_band: bool| panel.series.iter().enumerate().filter(move |(_, series)| series.mark.is_filled() == is_band);
    for (index, series) in bands_first(true).chain(bands_first(false)) {
        body += &draw_series(&at, series, index);
    }
    body += &format!("</g></svg><g class=\"words\" transform=\"translate({} {})\">{}</g>", px(left), px(top), words(&at));
    let series: Vec<_> = panel.series.iter().map(|series| json!([series.label, series.mark.word(), series.color.name()])).collect();
    let meta = json!({
        "x": [panel.x.scale.word(), x.0, x.1, panel.x.label, printed_unit(&panel.x.unit)],
        "y": [panel.y.scale.word(), y.0, y.1, panel.y.label, printed_unit(&panel.y.unit)],
        "shown": [x_shown.0, x_shown.1, y_shown.0, y_shown.1],
        "names": panel.y.names, "margin": [left, top, RIGHT, bottom], "plot": [plot_width, plot_height],
        "equal": panel.is_equal(), "free": panel.is_free(), "labelled": labelled, "link": panel.link, "series": series,
    });
    PanelFrame { body, width, height: top + plot_height + bottom, meta: meta.to_string() }
}

fn frame(at: &Placement, x_ticks: &[Tick], y_ticks: &[Tick], labelled: bool) -> String {
    let (left, right, foot) = (at.left, at.left + at.width, at.top + at.height);
    let mut svg = format!("<text class=\"axis-label\" x=\"0\" y=\"11\">{}</text><g class=\"frame\">", escape(&at.panel.y.caption()));
    for tick in y_ticks {
        let y = at.top + at.y(tick.value);
        svg += &format!("<path class=\"grid\" d=\"M{} {}H{}\"/>", px(left), px(y), px(right));
        svg += &format!("<text class=\"tick\" x=\"{}\" y=\"{}\" text-anchor=\"end\">{}</text>", px(left - 6.0), px(y + 4.0), escape(&tick.label));
    }
    for tick in x_ticks {
        let x = left + at.x(tick.value);
        svg += &format!("<path class=\"grid\" d=\"M{} {}V{}\"/>", px(x), px(at.top), px(foot));
        if labelled {
            svg += &format!("<text class=\"tick\" x=\"{}\" y=\"{}\" text-anchor=\"middle\">{}</text>", px(x), px(foot + 15.0), escape(&tick.label));
        }
    }
    svg += &format!("<path class=\"base\" d=\"M{} {}H{}\"/></g>", px(left), px(foot), px(right));
    if labelled {
        svg += &format!(
            "<text class=\"axis-label x-label\" x=\"{}\" y=\"{}\" text-anchor=\"end\">{}</text>",
            px(right),
            px(foot + 31.0),
            escape(&at.panel.x.caption())
        );
    }
    svg
}

fn annotations(at: &Placement) -> String {
    let mut svg = String::new();
    for (from, to) in at.panel.spans.iter().map(|(from, to)| (at.x(*from), at.x(*to))).filter(|(from, to)| from.is_finite() && to.is_finite()) {
        svg += &format!("<path class=\"span\" d=\"M{} 0H{}V{}H{}Z\"/>", px(from), px(to), px(at.height), px(from));
    }
    for rule in at.panel.rules.iter().filter(|rule| at.y(rule.y).is_finite()) {
        svg += &format!("<path class=\"line rule c-{} dashed\" d=\"M0 {y}H{}\"/>", Color::Grey.name(), px(at.width), y = px(at.y(rule.y)));
    }
    svg
}

fn upwards_ticks(panel: &Panel, (from, to): (f64, f64), height: f64) -> Vec<Tick> {
    if panel.y.names.is_empty() {
        return ticks(panel.y.scale, from, to, (height / TICK_SPACING.1).round() as usize);
    }
    panel.y.names.iter().enumerate().map(|(k, name)| Tick { value: panel.y.row(k), label: name.clone() }).collect()
}

/// Room for the labels of the ordinate: as much as the longest of all panels needs, so that their plot areas stand
/// below each other, but at most half of the width.
pub(crate) fn left_margin<'a>(panels: impl Iterator<Item = &'a Panel>, width: f64) -> f64 {
    let panels: Vec<&Panel> = panels.collect();
    let longest = |panel: &Panel, left: f64| {
        let (x, y) = ranges(panel);
        let side = width - left - RIGHT;
        // A panel of equal units shows more than its data where the other axis needs it, and its labels may be longer.
        let tall = side * panel.proportion;
        let (height, y) = if panel.is_equal() { (tall, equal(x, y, side, tall).1) } else { (panel.height, y) };
        upwards_ticks(panel, y, height).iter().map(|tick| tick.label.chars().count()).max().unwrap_or(0)
    };
    // A wider margin leaves a smaller square, which may have other labels: the margin only grows until they fit.
    let mut left = LEFT;
    for _ in 0..3 {
        let longest = panels.iter().map(|panel| longest(panel, left)).max().unwrap_or(0);
        left = left.max((LETTER * longest as f64 + 14.0).clamp(LEFT, WIDEST_LEFT.min(0.5 * width).max(LEFT)));
    }
    left
}

/// A name that fits into the left margin: what it begins and ends with, as names of joints begin alike.
fn shortened(name: &str, left: f64) -> String {
    let most = ((left - 12.0) / LETTER).floor().max(1.0) as usize;
    let letters: Vec<char> = name.chars().collect();
    if letters.len() <= most {
        return name.to_string();
    }
    let end = (most - 1) / 2;
    letters[..most - 1 - end].iter().chain(&['…']).chain(&letters[letters.len() - end..]).collect()
}

/// Ticks whose labels do not touch: fewer where the labels are long.
fn sideways_ticks(scale: Scale, (from, to): (f64, f64), width: f64) -> Vec<Tick> {
    let mut target = (width / TICK_SPACING.0).round() as usize;
    loop {
        let found = ticks(scale, from, to, target);
        let longest = found.iter().map(|tick| tick.label.chars().count()).max().unwrap_or(0);
        let room = width / found.len().max(1) as f64;
        if target <= 2 || scale == Scale::Log || LETTER * longest as f64 + 12.0 <= room {
            return found;
        }
        target -= 1;
    }
}

/// Words beside rules and pins; `data-x` and `data-y` are their places in pixels before any zoom.
fn words(at: &Placement) -> String {
    let mut svg = String::new();
    let mut word = |kind: &str, (x, y): (f64, f64), (dx, dy): (f64, f64), label: &str| {
        let anchor = match kind {
            "rule" => "end",
            "centre" => "middle",
            _ => "start",
        };
        if !label.is_empty() && (-0.5..=at.width + 0.5).contains(&x) && (-0.5..=at.height + 0.5).contains(&y) {
            svg += &format!(
                "<text class=\"pin\" data-kind=\"{kind}\" data-x=\"{x}\" data-y=\"{y}\" x=\"{x}\" y=\"{y}\" dx=\"{dx}\" dy=\"{dy}\" text-anchor=\"{anchor}\">{}</text>",
                escape(label),
                x = px(x),
                y = px(y),
            );
        }
    };
    for rule in &at.panel.rules {
        word("rule", (at.width, at.y(rule.y)), (-3.0, -4.0), &rule.label);
    }
    for pin in &at.panel.pins {
        let (kind, offset) = if pin.centred { ("centre", (0.0, 4.0)) } else { ("pin", (6.0, -6.0)) };
        word(kind, (at.x(pin.x), at.y(pin.y)), offset, &pin.label);
    }
    svg
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plot::{Axis, Series};

    fn panel(y: Vec<f64>) -> Panel {
        let x: Vec<f64> = (0..y.len()).map(|k| k as f64).collect();
        Panel::new(Axis::linear("Time", "s"), Axis::linear("Force", "N").range(0.0, 1.0)).with(Series::line("force", x, y, Color::Blue))
    }

    #[test]
    fn a_long_name_keeps_how_it_begins_and_how_it_ends() {
        let left = 12.0 + 11.0 * LETTER;
        assert_eq!(shortened("end-stop, ur_wrist_1", left), "end-s…ist_1");
        assert_eq!(shortened("end-stop, a", left), "end-stop, a");
    }

    fn path_of(body: &str) -> &str {
        let start = body.find(" d=\"M").map(|_| body.rfind("data-s=\"0\" d=\"").unwrap()).unwrap();
        &body[start..start + body[start..].find("/>").unwrap()]
    }

    #[test]
    fn a_line_lies_where_its_numbers_say() {
        let frame = draw_panel(&panel(vec![0.0, 1.0, 0.5]), LEFT + RIGHT + 100.0, LEFT, true);
        assert_eq!(path_of(&frame.body), "data-s=\"0\" d=\"M0 200L50 0 100 100\"");
    }

    #[test]
    fn equal_units_are_equal_in_a_plot_that_is_lower_than_wide() {
        let mut panel = panel(vec![0.0, 1.0, 0.5]);
        (panel.x, panel.y) = (Axis::linear("Along", "m").range(0.0, 4.0), Axis::linear("Across", "m").range(0.0, 1.0));
        (panel.equal_aspect, panel.proportion) = (true, 0.25);
        let frame = draw_panel(&panel, LEFT + RIGHT + 400.0, LEFT, true);
        assert_eq!(frame.height, TOP + 100.0 + BOTTOM_LABELLED);
        assert_eq!(path_of(&frame.body), "data-s=\"0\" d=\"M0 100L100 0 200 50\"");
    }

    #[test]
    fn a_missing_value_breaks_the_line() {
        let frame = draw_panel(&panel(vec![0.0, 1.0, f64::NAN, 0.5, 1.0]), LEFT + RIGHT + 100.0, LEFT, true);
        assert_eq!(path_of(&frame.body), "data-s=\"0\" d=\"M0 200L25 0M75 100L100 0\"");
    }

    #[test]
    fn a_long_trace_is_cut_to_what_pixels_show() {
        let frame = draw_panel(&panel((0..100_000).map(|k| (k as f64 * 0.37).sin().abs()).collect()), 462.0, LEFT, true);
        assert!(frame.body.len() < 20_000, "{}", frame.body.len());
    }
}
