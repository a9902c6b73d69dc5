//! The pictures of this field, each from plain data to a [`Figure`](crate::Figure).

mod bode;
mod error;
mod frequency;

pub use bode::{Curve, CurveStyle, ResponseCurves, bode};
pub use error::FigureError;
