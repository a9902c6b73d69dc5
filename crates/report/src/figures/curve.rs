//! One response as a curve.

use crate::plot::{Color, Dash};
use ndarray::Array3;
use num_complex::Complex64;

/// How a curve is drawn: measured curves are coloured lines with bands, models are lines over them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct CurveStyle {
    /// Its colour.
    pub color: Color,
    /// How its line is broken.
    pub dash: Dash,
}

impl CurveStyle {
    /// The estimate that the page is about.
    pub const MEASURED: Self = Self { color: Color::Blue, dash: Dash::Solid };
    /// An estimate beside it.
    pub const SECOND: Self = Self { color: Color::Orange, dash: Dash::Solid };
    /// A fitted model.
    pub const FITTED: Self = Self { color: Color::Vermillion, dash: Dash::Dashed };
    /// What was simulated.
    pub const TRUE: Self = Self { color: Color::Ink, dash: Dash::Dotted };
}

/// One response, measured or modelled; shapes are `[output][input][frequency]`, NaN where there is no value.
#[derive(Debug, Clone, PartialEq)]
pub struct Curve {
    /// As in the legend.
    pub label: String,
    /// |H|.
    pub gain: Array3<f64>,
    /// Lower and upper end of the gain's 95 % interval.
    pub gain_ci95: Option<(Array3<f64>, Array3<f64>)>,
    /// arg H in radians, of any turn.
    pub phase_rad: Array3<f64>,
    /// Lower and upper end of the phase's 95 % interval; NaN beside a finite phase is the full circle.
    pub phase_ci95_rad: Option<(Array3<f64>, Array3<f64>)>,
    /// How it is drawn.
    pub style: CurveStyle,
}

impl Curve {
    /// Gain and phase of a complex response, without intervals.
    pub fn from_response(label: impl Into<String>, response: &Array3<Complex64>, style: CurveStyle) -> Self {
        Self {
            label: label.into(),
            gain: response.mapv(|value| value.norm()),
            gain_ci95: None,
            phase_rad: response.mapv(|value| value.arg()),
            phase_ci95_rad: None,
            style,
        }
    }
}
