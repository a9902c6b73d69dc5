//! What a person should know about a result, and what to do about it.

use serde::{Deserialize, Serialize};

/// A finding that does not stop a computation.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Warning {
    /// A fixed word for programs, e.g. `weak-instrument`.
    pub code: String,
    /// What was seen, with numbers.
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
