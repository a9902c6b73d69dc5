//! What all results that other programs read have in common.
//!
//! Every result says which schema it follows, which version wrote it and which subcommand it came from, and carries its
//! warnings. A number that does not exist is `null`. The JSON Schemas come from the types (feature `schema`).

pub use crate::nested::{Matrix, Nested};
pub use ndof_signal::Warning;
use serde::{Deserialize, Serialize};

/// The version that is written into every result.
pub const VERSION: &str = env!("CARGO_PKG_VERSION");

/// What every result begins with.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Head {
    /// Which result it is, e.g. `ndof/estimate/1`.
    pub schema: String,
    /// The version that wrote it.
    pub ndof_version: String,
    /// The subcommand.
    pub command: String,
    /// What the reader should know.
    pub warnings: Vec<Warning>,
}

impl Head {
    /// The head of a result of this schema, as the task of this name makes it.
    pub fn new(schema: &str, command: &str, warnings: Vec<Warning>) -> Self {
        Head { schema: schema.to_owned(), ndof_version: VERSION.to_owned(), command: command.to_owned(), warnings }
    }
}

/// A number, or nothing where it does not exist (never NaN).
pub type Number = Option<f64>;

/// `value`, or nothing if it is not finite.
pub fn number(value: f64) -> Number {
    value.is_finite().then_some(value)
}

/// An interval, if both ends are numbers.
pub fn finite(interval: [f64; 2]) -> Option<[f64; 2]> {
    interval.iter().all(|end| end.is_finite()).then_some(interval)
}

/// A result as the bytes of its file: one line of JSON with a final newline, always the same for the same result.
///
/// # Errors
/// If the result cannot be expressed in JSON.
pub fn to_json(result: &impl Serialize) -> Result<String, serde_json::Error> {
    serde_json::to_string(result).map(|text| text + "\n")
}

/// Writes what [`to_json`] returns, piece by piece. `to` has one type, so that there is one copy of what writes each result, not one for each place to
/// write to.
///
/// # Errors
/// If the result cannot be expressed in JSON or not be written.
///
/// ```
/// use ndof_analysis::result::{Head, to_json, write_json};
///
/// let (head, mut file) = (Head::new("ndof/check/1", "check", vec![]), Vec::new());
/// write_json(&head, &mut file)?;
/// assert_eq!(file, to_json(&head)?.as_bytes());
/// # Ok::<(), std::io::Error>(())
/// ```
pub fn write_json(result: &impl Serialize, to: &mut dyn std::io::Write) -> std::io::Result<()> {
    serde_json::to_writer(&mut *to, result)?;
    to.write_all(b"\n")
}

/// The word that serde writes for a value of an enum without fields.
pub fn word(value: &impl Serialize) -> String {
    serde_json::to_value(value).ok().and_then(|value| value.as_str().map(str::to_owned)).unwrap_or_default()
}

/// The settings that are given, by their names in a file: those that are not as they are by default.
pub fn given<T: Serialize + Default>(settings: &T) -> Vec<String> {
    let [own, plain] = [settings, &T::default()].map(|settings| serde_json::to_value(settings).unwrap_or_default());
    own.as_object().into_iter().flatten().filter(|(name, value)| plain.get(name.as_str()) != Some(*value)).map(|(name, _)| name.clone()).collect()
}

/// At most `count` of the `usable` indices, nearest to logarithmically spaced frequencies.
pub fn log_spaced(usable: &[usize], hz: &[f64], count: usize) -> Vec<usize> {
    let (Some(&first), Some(&last)) = (usable.first(), usable.last()) else { return Vec::new() };
    let (low, high) = (hz[first].ln(), hz[last].ln());
    let mut chosen: Vec<usize> = (0..count)
        .filter_map(|k| {
            let wanted = low + (high - low) * k as f64 / (count - 1) as f64;
            usable.iter().copied().min_by(|&a, &b| (hz[a].ln() - wanted).abs().total_cmp(&(hz[b].ln() - wanted).abs()))
        })
        .collect();
    chosen.dedup();
    chosen
}
