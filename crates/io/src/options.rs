//! What a caller adds to what a file says.

use crate::columns::ColumnsFile;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Onto which rate irregular time is interpolated.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Resample {
    /// The median step of the file.
    Auto,
    /// This rate in Hz.
    #[serde(untagged)]
    Hz(f64),
}

/// How to read a file; the default trusts the file alone and refuses missing samples.
///
/// ```
/// let options = ndof_io::ReadOptions { sample_rate_hz: Some(500.0), ..Default::default() };
/// assert!(options.resample.is_none());
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ReadOptions {
    /// Samples a second, for a file that has neither a time column nor a rate.
    pub sample_rate_hz: Option<f64>,
    /// Repair irregular time by interpolation onto a regular grid; without it irregular time is an error.
    pub resample: Option<Resample>,
    /// The unit of a channel where the file gives none or a wrong one, by channel name.
    pub units: BTreeMap<String, String>,
    /// The column that is the time, where its name does not say so.
    pub time: Option<String>,
    /// What the columns of a table of text without a header are.
    pub columns: Option<ColumnsFile>,
    /// Which trial to read of a file that holds several, by its name or by its number from 1.
    pub trial: Option<String>,
    /// Whether `units` and `time` may name channels that the file does not have, those of another that is read beside it.
    pub units_elsewhere: bool,
    /// Keep only the rows from this time to before that, on the clock of the file: what lies outside may be irregular. It has
    /// no effect on a file without a time column.
    pub window_s: Option<(f64, f64)>,
    /// Take the rows as they come, at the median rate, where time is irregular or the file is shorter than it says, with a
    /// note `sample-timing` that says what is wrong: to look at a file that cannot be used as it is.
    pub any_timing: bool,
    /// Keep missing samples as NaN instead of refusing the file.
    pub allow_nan: bool,
}
