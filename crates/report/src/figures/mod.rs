//! The pictures of this field, each from plain data to a [`Figure`](crate::Figure).
//!
//! A new picture is one file here: a struct of plain data, if it needs one, and a function that checks its shapes
//! and returns a figure. Drawing, zoom, read-out, tables, files and dark mode come with the figure.

mod bode;
mod calibration;
mod coherence;
mod confusion;
mod diagnosis;
mod ellipse;
mod error;
mod forest;
mod frequency;
mod nyquist;
mod residual;
mod sessions;
mod spectra;
mod traces;

pub use bode::{Curve, CurveStyle, ResponseCurves, bode};
pub use calibration::{ConfidenceBin, reliability};
pub use coherence::{Coherences, coherence, input_coherence};
pub use confusion::confusion;
pub use diagnosis::{Considered, HeldOut, MOST_DOTS, StatePicture, Stretches, against_state, before_after, considered, discrepancy, shares};
pub use ellipse::{Ellipse, axes as ellipse_axes, ellipse};
pub use error::FigureError;
pub use forest::{Estimate, Forest, ForestGroup, forest};
pub use nyquist::nyquist;
pub use residual::{Residual, residual};
pub use sessions::{Course, agreement, course};
pub use spectra::{Spectrum, spectra};
pub use traces::{Trace, Traces, traces};
