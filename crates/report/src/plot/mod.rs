//! Axes, series, panels and figures, and how they become SVG and CSV.

mod axis;
mod csv;
mod decimate;
mod draw;
mod figure;
mod legend;
mod palette;
mod panel;
mod placement;
mod series;
mod shades;
mod shapes;
mod svg;
mod ticks;

pub use axis::{Axis, Scale};
pub use figure::{Cell, Figure};
pub use palette::{Color, Dash};
pub use panel::{Panel, Pin, Rule, Shades};
pub use series::{Mark, Series};
pub use ticks::{Tick, ticks};

pub(crate) use draw::draw_panel;
pub(crate) use legend::{legend_entries, swatch};
pub(crate) use palette::page_variables;
pub(crate) use svg::escape;
