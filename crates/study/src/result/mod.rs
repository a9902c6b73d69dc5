//! The results that other programs read, one file a schema.
//!
//! Every result says which schema it follows, which version wrote it and which subcommand it came from, and carries its
//! warnings. A number that does not exist is `null`. The JSON Schemas come from these types ([`schema_of`]).

pub mod check;
pub mod compare;
pub mod design;
pub mod diagnosis;
pub mod estimate;
pub mod fit;
pub mod live;
pub mod sensitivity;
pub mod study;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

pub use check::CheckResult;
pub use compare::CompareResult;
pub use design::DesignResult;
pub use diagnosis::DiagnosisResult;
pub use estimate::EstimateResult;
pub use fit::FitResult;
pub use live::LiveResult;
pub use sensitivity::SensitivityResult;
pub use study::StudyResult;

/// The version that is written into every result.
pub const VERSION: &str = env!("CARGO_PKG_VERSION");

/// A number, or nothing where it does not exist (never NaN).
pub type Number = Option<f64>;

/// `value`, or nothing if it is not finite.
pub fn number(value: f64) -> Number {
    value.is_finite().then_some(value)
}

/// Something that the reader of a result should know, with what to do about it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Warning {
    /// A word that programs can match, e.g. `paired-by-order`.
    pub code: String,
    /// What was seen, with its numbers.
    pub message: String,
    /// What to do.
    pub action: String,
}

impl Warning {
    /// A warning from its three parts.
    pub fn new(code: &str, message: impl Into<String>, action: impl Into<String>) -> Self {
        Warning { code: code.to_owned(), message: message.into(), action: action.into() }
    }
}

impl From<ndof_sysid::Warning> for Warning {
    fn from(warning: ndof_sysid::Warning) -> Self {
        Warning { code: warning.code, message: warning.message, action: warning.action }
    }
}

impl From<ndof_io::Note> for Warning {
    fn from(note: ndof_io::Note) -> Self {
        Warning { code: note.code.to_owned(), message: note.message, action: note.action }
    }
}

/// The JSON Schemas by the short names that `ndof schema` takes.
pub const SCHEMAS: &[&str] = &["estimate", "fit", "diagnosis", "check", "compare", "live", "study-result", "design", "sensitivity", "truth"];

/// The JSON Schema of the result called `name`, or nothing if there is none of that name.
pub fn schema_of(name: &str) -> Option<serde_json::Value> {
    let schema = match name {
        "estimate" => schemars::schema_for!(EstimateResult),
        "fit" => schemars::schema_for!(FitResult),
        "diagnosis" => schemars::schema_for!(DiagnosisResult),
        "compare" => schemars::schema_for!(CompareResult),
        "study-result" => schemars::schema_for!(StudyResult),
        "design" => schemars::schema_for!(DesignResult),
        "sensitivity" => schemars::schema_for!(SensitivityResult),
        "live" => schemars::schema_for!(LiveResult),
        "truth" => schemars::schema_for!(crate::pipeline::Truth),
        "check" => schemars::schema_for!(CheckResult),
        _ => return None,
    };
    Some(schema.to_value())
}

/// A result as the bytes of its file: one line of JSON with a final newline, always the same for the same result.
///
/// # Errors
/// If the result cannot be expressed in JSON.
pub fn to_json(result: &impl Serialize) -> Result<String, serde_json::Error> {
    serde_json::to_string(result).map(|text| text + "\n")
}
