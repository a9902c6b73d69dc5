//! A panel: two axes and what is drawn between them.

use super::axis::{Axis, Scale};
use super::series::Series;
use std::sync::Arc;

/// A labelled straight line across the panel, e.g. a threshold.
#[derive(Debug, Clone, PartialEq)]
pub struct Rule {
    /// Where it cuts the ordinate.
    pub y: f64,
    /// What it means.
    pub label: String,
}

/// A few words at a point.
#[derive(Debug, Clone, PartialEq)]
pub struct Pin {
    /// Abscissa.
    pub x: f64,
    /// Ordinate.
    pub y: f64,
    /// The words.
    pub label: String,
    /// In the middle of the point, not beside it.
    pub centred: bool,
}

/// A surface seen from above, darker where it is higher, by the logarithm.
#[derive(Debug, Clone, PartialEq)]
pub struct Shades {
    /// What it is the height of, as in the legend.
    pub label: String,
    /// Abscissae of its columns.
    pub x: Arc<[f64]>,
    /// Ordinates of its rows.
    pub y: Vec<f64>,
    /// Heights, row by row.
    pub value: Vec<Vec<f64>>,
    /// Heights at which it is lightest and darkest.
    pub range: (f64, f64),
}

/// Two axes and what is drawn between them.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Panel {
    /// Abscissa.
    pub x: Axis,
    /// Ordinate.
    pub y: Axis,
    /// A surface below everything else.
    pub shades: Option<Shades>,
    /// In the order in which they are drawn; bands come before all lines.
    pub series: Vec<Series>,
    /// Thresholds.
    pub rules: Vec<Rule>,
    /// Shaded stretches.
    pub spans: Vec<(f64, f64)>,
    /// Words at points.
    pub pins: Vec<Pin>,
    /// Height in pixels.
    pub height: f64,
    /// One unit has the same length on both axes (ellipses, Nyquist).
    pub equal_aspect: bool,
    /// Height of such a plot in widths.
    pub proportion: f64,
    /// Panels of one figure with the same number are zoomed and read together.
    pub link: usize,
}

impl Panel {
    /// An empty panel.
    pub fn new(x: Axis, y: Axis) -> Self {
        Self { x, y, height: 200.0, proportion: 1.0, ..Self::default() }
    }

    /// Not curves over a shared abscissa, but places in a plane: read by distance, zoomed alone.
    pub(crate) fn is_free(&self) -> bool {
        self.is_equal() || !self.y.names.is_empty() || self.series.iter().any(|series| !series.mark.is_filled() && !series.mark.ascends())
    }

    /// Equal units on both axes: asked for, and possible, as neither is logarithmic.
    pub(crate) fn is_equal(&self) -> bool {
        self.equal_aspect && self.x.scale != Scale::Log && self.y.scale != Scale::Log
    }

    /// With a series more.
    pub fn with(mut self, series: Series) -> Self {
        self.series.push(series);
        self
    }

    /// With a labelled line across at `y`.
    pub fn rule(mut self, y: f64, label: impl Into<String>) -> Self {
        self.rules.push(Rule { y, label: label.into() });
        self
    }

    /// With another height.
    pub fn height(mut self, height: f64) -> Self {
        self.height = height;
        self
    }
}
