//! A figure: a grid of cells, each a stack of panels over one abscissa.

use super::draw::{draw_panel, left_margin, standalone_style};
use super::legend::{draw_legend, legend_entries};
use super::panel::Panel;
use super::svg::{escape, px};
use crate::table::Table;

/// Width of a figure in its own file, in pixels, where its columns are not too many for it.
const STANDALONE_WIDTH: f64 = 900.0;
const NARROWEST_CELL: f64 = 200.0;
const GAP: f64 = 18.0;
const CELL_TITLE: f64 = 20.0;
const MARGIN: f64 = 12.0;

/// One place in the grid: a title and panels below each other.
#[derive(Debug, Clone, PartialEq)]
pub struct Cell {
    /// E.g. "y ← x"; empty for none.
    pub title: String,
    /// From top to bottom; all but the last do without the labels of their abscissa, which they share.
    pub panels: Vec<Panel>,
}

/// A titled grid of panels, row by row.
#[derive(Debug, Clone, PartialEq)]
pub struct Figure {
    /// File stem and anchor: lower-case letters, digits and hyphens (others are replaced).
    pub name: String,
    /// What is shown.
    pub title: String,
    /// How to read it, in a sentence or two.
    pub caption: String,
    /// Cells in a row.
    pub columns: usize,
    /// Row by row.
    pub cells: Vec<Cell>,
    /// What says the picture in numbers, folded below it (an ellipse has it beside); `None` takes the series' numbers.
    pub table: Option<Table>,
}

impl Figure {
    /// The panels of all cells.
    pub(crate) fn panels(&self) -> impl Iterator<Item = &Panel> + Clone {
        self.cells.iter().flat_map(|cell| &cell.panels)
    }

    /// An empty figure of one column.
    pub fn new(name: &str, title: impl Into<String>) -> Self {
        Self { name: stem(name), title: title.into(), caption: String::new(), columns: 1, cells: Vec::new(), table: None }
    }

    /// With a sentence on how to read it.
    pub fn caption(mut self, caption: impl Into<String>) -> Self {
        self.caption = caption.into();
        self
    }

    /// With cells beside each other.
    pub fn columns(mut self, columns: usize) -> Self {
        self.columns = columns.max(1);
        self
    }

    /// With a cell of one panel more.
    pub fn panel(self, title: impl Into<String>, panel: Panel) -> Self {
        self.cell(title, vec![panel])
    }

    /// With a cell of stacked panels more.
    pub fn cell(mut self, title: impl Into<String>, panels: Vec<Panel>) -> Self {
        self.cells.push(Cell { title: title.into(), panels });
        self
    }

    /// Width of a cell in pixels.
    pub(crate) fn cell_width(&self) -> f64 {
        let columns = self.columns.max(1) as f64;
        let width = (STANDALONE_WIDTH - 2.0 * MARGIN - (columns - 1.0) * GAP) / columns;
        let equal = self.cells.iter().flat_map(|cell| &cell.panels).filter(|panel| panel.is_equal());
        let widest = equal.map(|panel| 430.0 / panel.proportion).fold(STANDALONE_WIDTH, f64::min);
        width.clamp(NARROWEST_CELL, widest)
    }

    /// Where the plot areas begin in their cells.
    pub(crate) fn panel_left(&self) -> f64 {
        left_margin(self.cells.iter().flat_map(|cell| &cell.panels), self.cell_width())
    }

    /// A sentence for those who cannot see it.
    pub(crate) fn description(&self) -> String {
        let panels: usize = self.cells.iter().map(|cell| cell.panels.len()).sum();
        let labels = legend_entries(self.panels()).into_iter().map(|entry| entry.label).collect::<Vec<_>>().join(", ");
        let shown = if labels.is_empty() { String::new() } else { format!(" Shown: {labels}.") };
        let panels = if panels == 1 { "One panel.".to_string() } else { format!("{panels} panels.") };
        format!("{}{}{panels}{shown}", self.caption, if self.caption.is_empty() { "" } else { " " })
    }

    /// The figure as a file of its own: light colours on white, all styles inside.
    pub fn to_svg(&self) -> String {
        let cell_width = self.cell_width();
        let panel_left = self.panel_left();
        let columns = self.columns.max(1);
        let width = (2.0 * MARGIN + columns as f64 * cell_width + (columns as f64 - 1.0) * GAP).max(320.0);
        let (legend, legend_height) = draw_legend(&legend_entries(self.panels()), MARGIN, 44.0, width - 2.0 * MARGIN);
        let mut top = 38.0 + legend_height;
        let mut body = String::new();
        for row in self.cells.chunks(columns) {
            let mut deepest = 0.0f64;
            for (column, cell) in row.iter().enumerate() {
                let left = MARGIN + column as f64 * (cell_width + GAP);
                let mut y = top;
                if !cell.title.is_empty() {
                    body += &format!("<text class=\"cell-title\" x=\"{}\" y=\"{}\">{}</text>", px(left), px(y + 13.0), escape(&cell.title));
                    y += CELL_TITLE;
                }
                for (k, panel) in cell.panels.iter().enumerate() {
                    let frame = draw_panel(panel, cell_width, panel_left, k + 1 == cell.panels.len());
                    body += &format!("<g transform=\"translate({} {})\">{}</g>", px(left), px(y), frame.body);
                    y += frame.height;
                }
                deepest = deepest.max(y - top);
            }
            top += deepest + GAP / 2.0;
        }
        let height = top + MARGIN / 2.0;
        format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" role=\"img\" aria-labelledby=\"t d\" width=\"{w}\" height=\"{h}\" viewBox=\"0 0 {w} {h}\">\
             <title id=\"t\">{title}</title><desc id=\"d\">{desc}</desc><style>{style}</style>\
             <rect class=\"sheet\" width=\"{w}\" height=\"{h}\"/><text class=\"figure-title\" x=\"{m}\" y=\"26\">{title}</text>{legend}{body}</svg>\n",
            w = px(width),
            h = px(height),
            m = px(MARGIN),
            title = escape(&self.title),
            desc = escape(&self.description()),
            style = standalone_style(),
        )
    }
}

/// A file stem: lower-case letters, digits, single hyphens.
fn stem(name: &str) -> String {
    let mut stem = String::new();
    for character in name.chars() {
        if character.is_ascii_alphanumeric() {
            stem.push(character.to_ascii_lowercase());
        } else if !stem.is_empty() && !stem.ends_with('-') {
            stem.push('-');
        }
    }
    let stem = stem.trim_end_matches('-');
    if stem.is_empty() { "figure".to_string() } else { stem.to_string() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plot::{Axis, Color, Series};

    fn figure() -> Figure {
        let panel = || {
            Panel::new(Axis::log("Frequency", "Hz"), Axis::linear("Coherence", "").range(0.0, 1.0))
                .with(Series::line("a<b", vec![0.1, 1.0, 10.0], vec![0.5, f64::NAN, 0.7], Color::Blue))
                .rule(0.3, "95 %")
        };
        Figure::new("Coherence of <x>", "Coherence").columns(2).panel("x ← x", panel()).panel("x ← y", panel())
    }

    #[test]
    fn a_figure_names_what_it_shows_and_escapes_it() {
        let svg = figure().to_svg();
        assert_eq!(figure().name, "coherence-of-x");
        assert!(svg.contains("<title id=\"t\">Coherence</title>") && svg.contains("Frequency [Hz]"));
        assert!(svg.contains("a&lt;b") && !svg.contains("a<b"));
        assert_eq!(svg.matches("class=\"line c-blue\"").count(), 3, "two panels and the legend");
    }

    #[test]
    fn the_same_figure_gives_the_same_bytes() {
        assert_eq!(figure().to_svg(), figure().to_svg());
    }

    #[test]
    fn a_stem_is_safe_as_a_file_name() {
        assert_eq!([stem("../../etc/passwd"), stem("…"), stem("Bode: x y")], ["etc-passwd", "figure", "bode-x-y"]);
    }
}
