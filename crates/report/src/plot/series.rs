//! What is drawn in a panel.

use std::sync::Arc;

use super::palette::{Color, Dash};

/// The shape of a series. Abscissae are shared (`Arc`), so that a matrix of panels holds one copy of its frequencies.
///
/// `x` are abscissae, `y` ordinates. NaN in any place is a gap. Where lengths differ, the shorter decides.
#[derive(Debug, Clone, PartialEq)]
#[allow(missing_docs, reason = "what x and y are is said once")]
pub enum Mark {
    /// Points joined by straight lines.
    Line { x: Arc<[f64]>, y: Vec<f64> },
    /// Dots.
    Points { x: Arc<[f64]>, y: Vec<f64> },
    /// `y[k]` from `edges[k]` to `edges[k + 1]`: one edge more than ordinates.
    Steps { edges: Arc<[f64]>, y: Vec<f64> },
    /// The area between two curves, e.g. a confidence interval.
    Band { x: Arc<[f64]>, low: Vec<f64>, high: Vec<f64> },
    /// What closed outlines enclose (even-odd); outlines are separated by NaN, e.g. the ring between two ellipses.
    Area { x: Arc<[f64]>, y: Vec<f64> },
}

impl Mark {
    pub(crate) fn word(&self) -> &'static str {
        match self {
            Mark::Line { .. } => "line",
            Mark::Points { .. } => "points",
            Mark::Steps { .. } => "steps",
            Mark::Band { .. } => "band",
            Mark::Area { .. } => "area",
        }
    }

    pub(crate) fn x(&self) -> &Arc<[f64]> {
        match self {
            Mark::Line { x, .. } | Mark::Points { x, .. } | Mark::Band { x, .. } | Mark::Area { x, .. } => x,
            Mark::Steps { edges, .. } => edges,
        }
    }

    /// Filled rather than drawn: it stands behind all lines.
    pub(crate) fn is_filled(&self) -> bool {
        matches!(self, Mark::Band { .. } | Mark::Area { .. })
    }

    /// Whether its abscissae never fall back, as those of a function.
    pub(crate) fn ascends(&self) -> bool {
        self.x().windows(2).all(|pair| pair[0] <= pair[1])
    }

    /// The columns of ordinates: one, or lower and upper end.
    pub(crate) fn columns(&self) -> Vec<(&'static str, &[f64])> {
        match self {
            Mark::Line { y, .. } | Mark::Points { y, .. } | Mark::Steps { y, .. } | Mark::Area { y, .. } => vec![("", y)],
            Mark::Band { low, high, .. } => vec![("low", low), ("high", high)],
        }
    }
}

/// A labelled, coloured series. Series of the same label share one legend entry, e.g. a line and its band.
#[derive(Debug, Clone, PartialEq)]
pub struct Series {
    /// As in the legend.
    pub label: String,
    /// Its shape.
    pub mark: Mark,
    /// Its colour.
    pub color: Color,
    /// How its line is broken.
    pub dash: Dash,
}

impl Series {
    fn new(label: impl Into<String>, mark: Mark, color: Color) -> Self {
        Self { label: label.into(), mark, color, dash: Dash::Solid }
    }

    /// A line.
    pub fn line(label: impl Into<String>, x: impl Into<Arc<[f64]>>, y: Vec<f64>, color: Color) -> Self {
        Self::new(label, Mark::Line { x: x.into(), y }, color)
    }

    /// Dots.
    pub fn points(label: impl Into<String>, x: impl Into<Arc<[f64]>>, y: Vec<f64>, color: Color) -> Self {
        Self::new(label, Mark::Points { x: x.into(), y }, color)
    }

    /// Steps between edges.
    pub fn steps(label: impl Into<String>, edges: impl Into<Arc<[f64]>>, y: Vec<f64>, color: Color) -> Self {
        Self::new(label, Mark::Steps { edges: edges.into(), y }, color)
    }

    /// A band.
    pub fn band(label: impl Into<String>, x: impl Into<Arc<[f64]>>, low: Vec<f64>, high: Vec<f64>, color: Color) -> Self {
        Self::new(label, Mark::Band { x: x.into(), low, high }, color)
    }

    /// The inside of closed outlines.
    pub fn area(label: impl Into<String>, x: impl Into<Arc<[f64]>>, y: Vec<f64>, color: Color) -> Self {
        Self::new(label, Mark::Area { x: x.into(), y }, color)
    }

    /// With another dash.
    pub fn dash(mut self, dash: Dash) -> Self {
        self.dash = dash;
        self
    }
}
