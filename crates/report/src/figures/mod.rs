//! The pictures of this field, each from plain data to a [`Figure`](crate::Figure).
//!
//! A new picture is one file here: a struct of plain data, if it needs one, and a function that checks its shapes
//! and returns a figure. Drawing, zoom, read-out, tables, files and dark mode come with the figure.

mod bode;
mod coherence;
mod course;
mod curve;
mod diagnosis;
mod ellipse;
mod error;
mod forest;
mod frequency;
mod nyquist;
mod path;
mod residual;
mod schedule;
mod spectra;
mod traces;

pub use bode::{ResponseCurves, bode, capitalised};
pub use coherence::{Coherences, coherence, input_coherence};
pub use course::{Course, course_coherence, course_slices, course_surface};
pub use curve::{Curve, CurveStyle};
pub use diagnosis::{Considered, HeldOut, Stretches, before_after, considered, discrepancy, shares};
pub use ellipse::{Ellipse, ellipse};
pub use error::FigureError;
pub use forest::{Estimate, Forest, ForestGroup, forest};
pub use nyquist::nyquist;
pub use path::{EllipsePath, PathEllipse, PathStretch, ellipse_path};
pub use residual::{Residual, residual};
pub use schedule::{ScheduleCurve, ScheduleCurves, schedule};
pub use spectra::{Spectrum, spectra};
pub use traces::{Trace, Traces, traces};

/// The elements of a matrix of responses, row by row: row, column and title.
fn entries(outputs: &[String], inputs: &[String]) -> impl Iterator<Item = (usize, usize, String)> {
    outputs.iter().enumerate().flat_map(move |(i, output)| inputs.iter().enumerate().map(move |(j, input)| (i, j, format!("{output} ← {input}"))))
}
