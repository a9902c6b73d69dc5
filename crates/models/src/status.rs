//! What a diagnosis may do with a number.

use serde::{Deserialize, Serialize};

/// Whether a number of a simulation may be wrong.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Status {
    /// It is right, whatever the data say.
    Fixed,
    /// It is a number that the diagnosis may call wrong.
    Nominal,
    /// It is fitted.
    #[default]
    Free,
}
