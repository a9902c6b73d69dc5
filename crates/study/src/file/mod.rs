//! The TOML files that people write: unknown keys are errors, and an error names file, line and remedy.

mod baseline;
mod experiment;
mod kinematics;
mod study;

pub use baseline::{BaselineFile, BaselineParameter, Status, Value};
pub use experiment::{Excitation, ExperimentFile, HiddenEffect};
pub use kinematics::{KinematicsFile, KinematicsSd, MeanForce};
pub use study::{EstimateSection, FitSection, StudyDocument, StudyFile};

use crate::error::{StudyError, did_you_mean};
use crate::suggest::nearest;
use serde::de::DeserializeOwned;
use std::path::Path;

/// Reads a TOML file of type `T`.
///
/// # Errors
/// [`StudyError::Read`] if there is no such file, [`StudyError::File`] with the line if it is not what `T` wants.
pub fn read<T: DeserializeOwned>(path: &Path) -> Result<T, StudyError> {
    let file = path.display().to_string();
    let text = std::fs::read_to_string(path).map_err(|source| StudyError::Read { file: file.clone(), source })?;
    parse(&text, &file)
}

/// Reads TOML text of type `T`; `file` is the name that errors give.
///
/// # Errors
/// [`StudyError::File`] with the line and, for an unknown key, the nearest known one.
pub fn parse<T: DeserializeOwned>(text: &str, file: &str) -> Result<T, StudyError> {
    toml::from_str(text).map_err(|error| {
        let line = error.span().map_or(1, |span| 1 + text[..span.start.min(text.len())].matches('\n').count());
        let message = error.message().trim().to_owned();
        let what = match unknown_key(&message) {
            Some((key, known)) => {
                format!("unknown key \"{key}\"{}; known here: {}", did_you_mean(nearest(key, known.iter().copied()).as_deref()), known.join(", "))
            }
            None => message,
        };
        StudyError::File { file: file.to_owned(), line, what }
    })
}

/// serde's "unknown field `a`, expected one of `b`, `c`" as (a, [b, c]).
fn unknown_key(message: &str) -> Option<(&str, Vec<&str>)> {
    let rest = message.strip_prefix("unknown field ")?;
    let mut names = rest.split('`').skip(1).step_by(2);
    Some((names.next()?, names.collect()))
}

/// Checks the `schema` line of a file.
pub(crate) fn check_schema(found: Option<&str>, expected: &str, file: &str) -> Result<(), StudyError> {
    match found {
        Some(found) if found != expected => {
            Err(StudyError::Meaning { file: file.to_owned(), what: format!("schema = \"{found}\"; this place takes \"{expected}\"") })
        }
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_unknown_key_is_named_with_its_line_and_the_nearest_known_one() {
        let text = "kind = \"planar-two-link\"\nlink_lenghts_m = [0.3, 0.3]\nposture_rad = [0.7, 1.5]\n";
        let error = parse::<KinematicsFile>(text, "arm.toml").unwrap_err().to_string();
        assert!(error.starts_with("arm.toml:2: unknown key \"link_lenghts_m\" (did you mean \"link_lengths_m\"?)"), "{error}");
    }

    #[test]
    fn a_wrong_type_is_named_with_its_line() {
        let error = parse::<KinematicsFile>("kind = \"planar-two-link\"\nlink_lengths_m = \"long\"\n", "arm.toml").unwrap_err().to_string();
        assert!(error.starts_with("arm.toml:2: "), "{error}");
    }
}
