//! What a person should know about a recording or a result, and what to do about it.

use serde::{Deserialize, Serialize};

/// Something that the reader of a result should know: it does not stop a computation.
///
/// Messages and errors name arguments in backticks (`` `nperseg` ``, `` `method=welch` ``); a command line shows them as its flags.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Warning {
    /// A fixed word that programs can match, e.g. `weak-instrument`.
    pub code: String,
    /// What was seen, with its numbers.
    pub message: String,
    /// What to do.
    pub action: String,
}

impl Warning {
    /// A warning from its parts.
    pub fn new(code: &str, message: impl Into<String>, action: impl Into<String>) -> Self {
        Warning { code: code.to_owned(), message: message.into(), action: action.into() }
    }
}
