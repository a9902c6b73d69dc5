//! A panel as SVG.
//!
//! What the page's script needs to lay the panel out anew (for another width, or zoomed) goes along as JSON. The
//! data stand in a nested `<svg>`, which clips them, inside one `<g class="view">`: zooming is a transformation of
//! that group, and strokes and dots keep their size (`vector-effect: non-scaling-stroke`).

use serde_json::json;

use super::axis::Scale;
use super::decimate::{envelope, min_max};
use super::figure::{Panel, RULE_COLOR};
use super::palette::standalone_classes;
use super::series::{Mark, Series};
use super::svg::{escape, px};
use super::ticks::{Tick, ticks};

const LEFT: f64 = 50.0;
const RIGHT: f64 = 12.0;
const TOP: f64 = 20.0;
const BOTTOM_LABELLED: f64 = 38.0;
const BOTTOM_BARE: f64 = 8.0;
/// Ticks about this many pixels apart, sideways and upwards.
const TICK_SPACING: (f64, f64) = (70.0, 38.0);
/// Width of a letter of a tick's label, about.
const LETTER: f64 = 6.2;
/// Coordinates further out than this are cut, which no eye can tell.
const FAR: f64 = 4000.0;

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

/// Where numbers go in a panel, relative to its plot area.
struct Placement<'a> {
    panel: &'a Panel,
    x: (f64, f64),
    y: (f64, f64),
    width: f64,
    height: f64,
}

impl Placement<'_> {
    fn x(&self, value: f64) -> f64 {
        let scale = self.panel.x.scale;
        let (low, high) = (scale.forward(self.x.0), scale.forward(self.x.1));
        ((scale.forward(value) - low) / (high - low) * self.width).clamp(-FAR, self.width + FAR)
    }

    fn y(&self, value: f64) -> f64 {
        let scale = self.panel.y.scale;
        let (low, high) = (scale.forward(self.y.0), scale.forward(self.y.1));
        ((high - scale.forward(value)) / (high - low) * self.height).clamp(-FAR, self.height + FAR)
    }
}

/// Draws a panel `width` pixels wide; `labelled` gives the abscissa its ticks' labels and its name.
pub(crate) fn draw_panel(panel: &Panel, width: f64, labelled: bool) -> PanelFrame {
    let bottom = if labelled { BOTTOM_LABELLED } else { BOTTOM_BARE };
    let plot_width = width - LEFT - RIGHT;
    let plot_height = if panel.equal_aspect { plot_width } else { panel.height };
    let (x, y) = ranges(panel);
    let (x_shown, y_shown) = if panel.equal_aspect { equal(x, y, plot_width, plot_height) } else { (x, y) };
    let at = Placement { panel, x: x_shown, y: y_shown, width: plot_width, height: plot_height };
    let x_ticks = sideways_ticks(panel.x.scale, x_shown, plot_width);
    let y_ticks = ticks(panel.y.scale, y_shown.0, y_shown.1, (plot_height / TICK_SPACING.1).round() as usize);
    let mut body = frame(&at, &x_ticks, &y_ticks, labelled);
    body += &format!("<svg class=\"data\" x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\"><g class=\"view\">", px(LEFT), px(TOP), px(plot_width), px(plot_height));
    body += &annotations(&at);
    let bands_first = |is_band: bool| panel.series.iter().enumerate().filter(move |(_, series)| series.mark.is_filled() == is_band);
    for (index, series) in bands_first(true).chain(bands_first(false)) {
        body += &draw_series(&at, series, index);
    }
    body += &format!("</g></svg><g class=\"words\" transform=\"translate({} {})\">{}</g>", px(LEFT), px(TOP), words(&at));
    let series: Vec<_> = panel.series.iter().map(|series| json!([series.label, series.mark.word(), series.color.name()])).collect();
    let meta = json!({
        "x": [panel.x.scale.word(), x.0, x.1, panel.x.label, panel.x.unit],
        "y": [panel.y.scale.word(), y.0, y.1, panel.y.label, panel.y.unit],
        "shown": [x_shown.0, x_shown.1, y_shown.0, y_shown.1],
        "margin": [LEFT, TOP, RIGHT, bottom], "plot": [plot_width, plot_height],
        "equal": panel.equal_aspect, "labelled": labelled, "link": panel.link, "series": series,
    });
    PanelFrame { body, width, height: TOP + plot_height + bottom, meta: meta.to_string() }
}

/// The ranges of both axes. Bands widen the ordinate by at most 40 % beyond the lines: an interval without bounds
/// should not hide what is known.
fn ranges(panel: &Panel) -> ((f64, f64), (f64, f64)) {
    let spans = panel.spans.iter().flat_map(|span| [span.from, span.to]);
    let x = panel.x.resolve(panel.series.iter().flat_map(|series| series.mark.x().iter().copied()).chain(spans));
    let x = if panel.equal_aspect { panel.x.widened(x, 0.06) } else { x };
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
    if inside(false).all(|value| !scale.forward(value).is_finite()) {
        let y = panel.y.resolve(inside(true).chain(lines));
        return (x, panel.y.widened(y, 0.05));
    }
    let core = panel.y.resolve(lines);
    if panel.y.range.is_some() {
        return (x, core);
    }
    let (low, high) = (scale.forward(core.0), scale.forward(core.1));
    let room = 0.4 * (high - low);
    let within = inside(true).filter(|value| (low - room..=high + room).contains(&scale.forward(*value)));
    let y = panel.y.resolve([core.0, core.1].into_iter().chain(within));
    (x, panel.y.widened(y, 0.05))
}

/// Widens one of two ranges so that a unit has the same length on both axes.
fn equal(x: (f64, f64), y: (f64, f64), width: f64, height: f64) -> ((f64, f64), (f64, f64)) {
    let per_pixel = ((x.1 - x.0) / width).max((y.1 - y.0) / height);
    let around = |(from, to): (f64, f64), pixels: f64| {
        let middle = 0.5 * (from + to);
        (middle - 0.5 * pixels * per_pixel, middle + 0.5 * pixels * per_pixel)
    };
    (around(x, width), around(y, height))
}

fn frame(at: &Placement, x_ticks: &[Tick], y_ticks: &[Tick], labelled: bool) -> String {
    let (right, foot) = (LEFT + at.width, TOP + at.height);
    let mut svg = format!("<text class=\"axis-label\" x=\"0\" y=\"11\">{}</text><g class=\"frame\">", escape(&at.panel.y.caption()));
    for tick in y_ticks {
        let y = TOP + at.y(tick.value);
        svg += &format!("<path class=\"grid\" d=\"M{} {}H{}\"/>", px(LEFT), px(y), px(right));
        svg += &format!("<text class=\"tick\" x=\"{}\" y=\"{}\" text-anchor=\"end\">{}</text>", px(LEFT - 6.0), px(y + 4.0), escape(&tick.label));
    }
    for tick in x_ticks {
        let x = LEFT + at.x(tick.value);
        svg += &format!("<path class=\"grid\" d=\"M{} {}V{}\"/>", px(x), px(TOP), px(foot));
        if labelled {
            svg += &format!("<text class=\"tick\" x=\"{}\" y=\"{}\" text-anchor=\"middle\">{}</text>", px(x), px(foot + 15.0), escape(&tick.label));
        }
    }
    svg += &format!("<path class=\"base\" d=\"M{} {}H{}\"/></g>", px(LEFT), px(foot), px(right));
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
    for span in &at.panel.spans {
        svg += &format!("<path class=\"span\" d=\"M{} 0H{}V{}H{}Z\"/>", px(at.x(span.from)), px(at.x(span.to)), px(at.height), px(at.x(span.from)));
    }
    for rule in &at.panel.rules {
        svg += &format!("<path class=\"line rule c-{} dashed\" d=\"M0 {y}H{}\"/>", RULE_COLOR.name(), px(at.width), y = px(at.y(rule.y)));
    }
    svg
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

/// Words beside rules, spans and pins; `data-x` and `data-y` are their places in pixels before any zoom.
fn words(at: &Placement) -> String {
    let mut svg = String::new();
    let mut word = |kind: &str, (x, y): (f64, f64), (dx, dy): (f64, f64), label: &str| {
        let anchor = if kind == "rule" { "end" } else { "start" };
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
    for span in &at.panel.spans {
        word("span", (at.x(span.from).max(0.0), 0.0), (0.0, -6.0), &span.label);
    }
    for pin in &at.panel.pins {
        word("pin", (at.x(pin.x), at.y(pin.y)), (6.0, -6.0), &pin.label);
    }
    svg
}

fn draw_series(at: &Placement, series: &Series, index: usize) -> String {
    let x_range = at.x;
    let near = |x: &[f64], k: usize| {
        let inside = |k: usize| x.get(k).is_some_and(|value| (x_range.0..=x_range.1).contains(value));
        inside(k) || inside(k + 1) || (k > 0 && inside(k - 1))
    };
    let color = series.color.name();
    let dash = series.dash.class();
    let (class, path) = match &series.mark {
        Mark::Line { x, y } => {
            let ascending = x.windows(2).all(|pair| pair[0] <= pair[1]);
            let runs = runs(x.iter().zip(y).enumerate().map(|(k, (&x_k, &y_k))| {
                let point = (at.x(x_k), at.y(y_k));
                ((!ascending || near(x, k)) && point.0.is_finite() && point.1.is_finite()).then_some(point)
            }));
            let runs = if at.panel.y.scale == Scale::Degrees { split_at_turns(runs, at) } else { runs };
            ("line", runs.iter().map(|run| polyline(&if ascending { min_max(run, 1.0) } else { run.clone() })).collect())
        }
        Mark::Steps { edges, y } => {
            let corners = edges.windows(2).zip(y).flat_map(|(pair, &y_k)| [(pair[0], y_k), (pair[1], y_k)]);
            let runs = runs(corners.map(|(x_k, y_k)| {
                let point = (at.x(x_k), at.y(y_k));
                (point.0.is_finite() && point.1.is_finite()).then_some(point)
            }));
            ("line", runs.iter().map(|run| polyline(&min_max(run, 1.0))).collect())
        }
        Mark::Points { x, y } => {
            let dots = x.iter().zip(y).map(|(&x_k, &y_k)| (at.x(x_k), at.y(y_k))).filter(|point| point.0.is_finite() && point.1.is_finite());
            ("points", dots.map(|(x, y)| format!("M{} {}h0", px(x), px(y))).collect())
        }
        Mark::Area { x, y } => {
            let rings = runs(x.iter().zip(y).map(|(&x_k, &y_k)| {
                let point = (at.x(x_k), at.y(y_k));
                (point.0.is_finite() && point.1.is_finite()).then_some(point)
            }));
            ("band", rings.iter().map(|ring| polyline(ring) + "Z").collect::<String>())
        }
        Mark::Band { x, low, high } => {
            let runs = runs(x.iter().zip(low).zip(high).enumerate().map(|(k, ((&x_k, &low_k), &high_k))| {
                // A lower end that is not positive lies below any logarithmic axis.
                let foot = if at.panel.y.scale == Scale::Log && low_k <= 0.0 { at.height + FAR } else { at.y(low_k) };
                let point = (at.x(x_k), at.y(high_k), foot);
                (near(x, k) && point.0.is_finite() && point.1.is_finite() && point.2.is_finite()).then_some(point)
            }));
            ("band", runs.iter().map(|run| area(&envelope(run, 1.0))).collect::<String>())
        }
    };
    if path.is_empty() {
        return String::new();
    }
    let dash = if class == "line" { dash } else { "" };
    let dense = if class == "line" && series.mark.x().len() as f64 > 2.0 * at.width { " dense" } else { "" };
    format!("<path class=\"{class}{dense} c-{color}{dash}\" data-s=\"{index}\" d=\"{path}\"/>")
}

/// An angle that leaves its turn comes back on the other side: no line joins the two.
fn split_at_turns(runs: Vec<Vec<(f64, f64)>>, at: &Placement) -> Vec<Vec<(f64, f64)>> {
    let half_turn = 180.0 / (at.y.1 - at.y.0) * at.height;
    runs.iter().flat_map(|run| run.chunk_by(|a, b| (a.1 - b.1).abs() <= half_turn)).map(<[_]>::to_vec).collect()
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
    use crate::plot::{Axis, Color};

    fn panel(y: Vec<f64>) -> Panel {
        let x: Vec<f64> = (0..y.len()).map(|k| k as f64).collect();
        Panel::new(Axis::linear("Time", "s"), Axis::linear("Force", "N").range(0.0, 1.0)).with(Series::line("force", x, y, Color::Blue))
    }

    fn path_of(body: &str) -> &str {
        let start = body.find(" d=\"M").map(|_| body.rfind("data-s=\"0\" d=\"").unwrap()).unwrap();
        &body[start..start + body[start..].find("/>").unwrap()]
    }

    #[test]
    fn a_line_lies_where_its_numbers_say() {
        let frame = draw_panel(&panel(vec![0.0, 1.0, 0.5]), LEFT + RIGHT + 100.0, true);
        assert_eq!(path_of(&frame.body), "data-s=\"0\" d=\"M0 200L50 0 100 100\"");
    }

    #[test]
    fn a_missing_value_breaks_the_line() {
        let frame = draw_panel(&panel(vec![0.0, 1.0, f64::NAN, 0.5, 1.0]), LEFT + RIGHT + 100.0, true);
        assert_eq!(path_of(&frame.body), "data-s=\"0\" d=\"M0 200L25 0M75 100L100 0\"");
    }

    #[test]
    fn a_long_trace_is_cut_to_what_pixels_show() {
        let frame = draw_panel(&panel((0..100_000).map(|k| (k as f64 * 0.37).sin().abs()).collect()), 462.0, true);
        assert!(frame.body.len() < 20_000, "{}", frame.body.len());
    }

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
