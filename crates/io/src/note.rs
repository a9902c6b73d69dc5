//! What reading a file did that its user should know.

use serde::Serialize;

/// Something that was understood, converted or left out on the way from a file to a recording.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Note {
    /// A short fixed word, e.g. `unit-converted`.
    pub code: &'static str,
    /// What happened, with its numbers.
    pub message: String,
    /// What to do if that is not what was meant.
    pub action: String,
}

impl Note {
    /// A note from its parts.
    pub fn new(code: &'static str, message: impl Into<String>, action: impl Into<String>) -> Self {
        Note { code, message: message.into(), action: action.into() }
    }
}
