//! Values of analyses to the plain data that pictures are drawn from.

use crate::figures::{Curve, CurveStyle, Trace};
use crate::number::{nan, significant};
use ndarray::Array3;
use ndof_analysis::result::word;
use ndof_signal::Recording;
use ndof_sysid::{FrequencyResponse, ResponseKind};
use serde::Serialize;
use serde_json::Value;

/// A response as a curve, with its 95 % intervals where it has a covariance.
pub(super) fn curve(label: &str, response: &FrequencyResponse, style: CurveStyle) -> Curve {
    let (p, q) = response.shape();
    let value = Array3::from_shape_fn((p, q, response.len()), |(i, j, f)| response.value[[f, i, j]]);
    let mut curve = Curve::from_response(label, &value, style);
    if response.uncertainty.is_some() {
        let entries: Vec<Vec<_>> = (0..p).map(|i| (0..q).map(|j| response.gain_phase(i, j, 0.95)).collect()).collect();
        let ends = |end: usize| {
            Array3::from_shape_fn(value.dim(), |(i, j, f)| Some(entries[i][j][f].gain_interval[end]).filter(|end| end.is_finite()).unwrap_or(f64::NAN))
        };
        let phases = |end: usize| Array3::from_shape_fn(value.dim(), |(i, j, f)| entries[i][j][f].phase_interval_rad.map_or(f64::NAN, |ends| ends[end]));
        curve.gain_ci95 = Some((ends(0), ends(1)));
        curve.phase_ci95_rad = Some((phases(0), phases(1)));
    }
    curve
}

/// Every channel of a recording as it was measured.
pub fn channel_traces(recording: &Recording) -> Vec<Trace> {
    let trace =
        |c: &ndof_signal::Channel| Trace { label: c.name.clone(), unit: c.unit.symbol().to_owned(), measured: c.samples.clone(), simulated: Vec::new() };
    recording.channels().iter().map(trace).collect()
}

/// What is shown of a number that does not exist, or a setting that was left to the program.
pub(super) const UNKNOWN: &str = "–";

/// Settings by the names of their options, one a row, so that none can be forgotten; what was left to the program is a dash.
pub fn settings_rows(settings: &impl Serialize) -> Vec<(String, String)> {
    fn words(value: &Value) -> String {
        match value {
            Value::Null => UNKNOWN.to_owned(),
            Value::Bool(yes) => if *yes { "yes" } else { "no" }.to_owned(),
            Value::Number(number) if number.is_f64() => significant(nan(number.as_f64()), 6),
            Value::String(text) => text.clone(),
            Value::Array(list) => list.iter().map(words).collect::<Vec<_>>().join(", "),
            Value::Object(table) => table.iter().map(|(name, value)| format!("{name} = {}", words(value))).collect::<Vec<_>>().join("; "),
            other => other.to_string(),
        }
    }
    let Ok(Value::Object(table)) = serde_json::to_value(settings) else { return Vec::new() };
    table.into_iter().map(|(name, value)| (name, words(&value))).collect()
}

/// What a kind of response is called: "dynamic stiffness".
pub(super) fn quantity(kind: ResponseKind) -> String {
    word(&kind).replace('-', " ")
}

/// Its unit.
pub(super) fn unit(kind: ResponseKind, rotational: bool) -> &'static str {
    match (kind, rotational) {
        (ResponseKind::Compliance, false) => "m/N",
        (ResponseKind::Compliance, true) => "rad/(N m)",
        (ResponseKind::DynamicStiffness, false) => "N/m",
        (ResponseKind::DynamicStiffness, true) => "N m/rad",
        (ResponseKind::Impedance, false) => "N s/m",
        (ResponseKind::Impedance, true) => "N m s/rad",
        (ResponseKind::Admittance, false) => "m/(N s)",
        (ResponseKind::Admittance, true) => "rad/(N m s)",
        _ => "",
    }
}
