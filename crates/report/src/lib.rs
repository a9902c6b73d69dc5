//! Self-contained reports: SVG plots, tables and one HTML page.
//!
//! Everything here is fed by plain data (slices, [`ndarray`] cubes, words), so it draws a measured arm and a
//! textbook spring alike. Three floors:
//!
//! * [`plot`]: axes, series, panels and the [`Figure`] that holds them; [`Figure::to_svg`] and [`Figure::to_csv`];
//! * [`figures`]: the pictures of this field (Bode matrix, coherences, Nyquist, stiffness ellipse, traces …), each
//!   a function from plain data to a [`Figure`];
//! * [`Report`]: sections of figures, tables and notes, rendered to one HTML file that needs no network.
//!
//! A number that does not exist is NaN here: lines break there, tables show a dash, CSV cells stay empty.
//! The same data give the same bytes.
//!
//! ```
//! use ndof_report::plot::{Axis, Color, Figure, Panel, Series};
//!
//! let panel = Panel::new(Axis::log("Frequency", "Hz"), Axis::log("Gain", "m/N"))
//!     .with(Series::line("spring", vec![0.1, 1.0, 10.0], vec![2e-3, 2e-3, 1e-4], Color::Blue));
//! let figure = Figure::new("gain", "A spring with a mass").panel("x ← x", panel);
//! assert!(figure.to_svg().starts_with("<svg"));
//! assert_eq!(figure.to_csv().lines().count(), 4);
//! ```

pub mod figures;
pub mod number;
mod page;
pub mod pages;
pub mod plot;
mod table;

pub use figures::{FigureError, capitalised};
pub use ndof_signal::Warning;
pub use page::{Block, PlotFile, Report, Section};
pub use pages::{compare_report, diagnosis_report, estimate_report, fit_report, p_value, percent, response_fit_report, sentence};
pub use plot::Figure;
pub use table::{Align, Table, parameter_table};
