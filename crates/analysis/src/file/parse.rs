//! TOML text to what it says, with errors that name file, line and remedy.

use crate::error::AnalysisError;
use crate::suggest::{did_you_mean, nearest};
use serde::de::DeserializeOwned;
use std::path::Path;

/// Reads a TOML file of type `T`.
///
/// # Errors
/// [`AnalysisError::Read`] if there is no such file, [`AnalysisError::File`] with the line if it is not what `T` wants.
pub fn read<T: DeserializeOwned>(path: &Path) -> Result<T, AnalysisError> {
    let (file, text) = read_text(path)?;
    parse(&text, &file)
}

/// A file's name as errors give it, and its text.
///
/// # Errors
/// [`AnalysisError::Read`] if there is no such file, [`ndof_io::IoError::NotUtf8`] with what it seems to be where it is text of another kind.
pub fn read_text(path: &Path) -> Result<(String, String), AnalysisError> {
    let file = path.display().to_string();
    let bytes = match std::fs::read(path) {
        Ok(bytes) => bytes,
        Err(source) => return Err(AnalysisError::Read { file, source }),
    };
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(&bytes);
    match std::str::from_utf8(bytes) {
        Ok(text) => Ok((file, text.to_owned())),
        Err(wrong) => {
            let at = wrong.valid_up_to();
            let line = 1 + bytes[..at].iter().filter(|b| **b == b'\n').count();
            Err(ndof_io::IoError::NotUtf8 { file, line, byte: bytes[at] }.into())
        }
    }
}

/// Reads TOML text of type `T`; `file` is the name that errors give.
///
/// # Errors
/// [`AnalysisError::File`] with the line and, for an unknown key, the nearest known one.
pub fn parse<T: DeserializeOwned>(text: &str, file: &str) -> Result<T, AnalysisError> {
    toml::from_str(text).map_err(|error| {
        let line = error.span().map_or(1, |span| 1 + text[..span.start.min(text.len())].matches('\n').count());
        let message = error.message().trim().to_owned();
        let what = match unknown_key(&message) {
            Some((key, known)) => {
                format!("unknown key \"{key}\"{}; known here: {}", did_you_mean(nearest(key, known.iter().copied()).as_deref()), known.join(", "))
            }
            None if message.starts_with("missing field") => format!("{message}; add this key"),
            None => format!("{message}; correct this line"),
        };
        AnalysisError::File { file: file.to_owned(), line, what }
    })
}

/// serde's "unknown field `a`, expected one of `b`, `c`" as (a, [b, c]).
fn unknown_key(message: &str) -> Option<(&str, Vec<&str>)> {
    let rest = message.strip_prefix("unknown field ")?;
    let mut names = rest.split('`').skip(1).step_by(2);
    Some((names.next()?, names.collect()))
}

/// Checks the `schema` line of a file.
///
/// # Errors
/// [`AnalysisError::Meaning`] if it names another schema than `expected`.
pub fn check_schema(found: Option<&str>, expected: &str, file: &str) -> Result<(), AnalysisError> {
    match found {
        Some(found) if found != expected => {
            Err(AnalysisError::Meaning { file: file.to_owned(), what: format!("schema = \"{found}\"; this place takes \"{expected}\"") })
        }
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::file::{BaselineFile, KinematicsFile, Status};

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

    #[test]
    fn a_baseline_as_the_contract_writes_it_is_understood() {
        let text =
            "model = \"inertia-damping-stiffness\"\n[parameters.M]\nvalue = [[2.1, -0.55], [-0.55, 1.9]]\nstatus = \"fixed\"\n[parameters.K]\nvalue = 300.0\n";
        let baseline: BaselineFile = parse(text, "b.toml").expect("understood");
        baseline.check("b.toml").expect("makes sense");
        assert_eq!((baseline.parameters["M"].status, baseline.parameters["K"].status), (Status::Fixed, Status::Free));
        assert_eq!(baseline.parameters["K"].value.rows(), [[300.0]]);
        let error = |text: &str| parse::<BaselineFile>(text, "b.toml").and_then(|baseline| baseline.check("b.toml")).unwrap_err().to_string();
        assert!(error("[parameters.Q]\nvalue = 1.0\n").contains("M, B and K"));
        assert!(error("[parameters.K]\nvalue = [[1.0, 2.0]]\n").contains("not a square matrix"));
    }
}
