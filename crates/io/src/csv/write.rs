//! A recording as CSV, such that reading it gives the same recording bit for bit.

use super::header::{escape, is_key};
use crate::assemble::{SAMPLES_KEY, is_time};
use crate::error::IoError;
use crate::names::{read_back, split_name};
use crate::units::infer_unit;
use crate::write::{own_metadata, times};
use ndof_signal::{Channel, Recording};
use std::fmt::Write;

/// The bytes of the file.
pub(crate) fn write(recording: &Recording, file: &str) -> Result<Vec<u8>, IoError> {
    let unwritable = |what: String, remedy| IoError::Unwritable { file: file.to_owned(), what, format: "CSV", remedy };
    if recording.is_empty() {
        return Err(unwritable("a recording without samples".to_owned(), "record or keep at least one"));
    }
    let separator = if file.to_ascii_lowercase().ends_with(".tsv") { '\t' } else { ',' };
    let mut out = String::with_capacity(recording.len() * recording.channels().len() * 20);
    for (key, value) in own_metadata(recording) {
        if !is_key(key) {
            return Err(unwritable(format!("metadata key {key:?}"), "use letters, digits, blanks and _ - . / in keys"));
        }
        let _ = writeln!(out, "# {key}: {}", escape(value));
    }
    for (key, value) in times(recording) {
        let _ = writeln!(out, "# {key}: {}", Shortest(value));
    }
    let _ = writeln!(out, "# {SAMPLES_KEY}: {}", recording.len());
    for (i, channel) in recording.channels().iter().enumerate() {
        if i > 0 {
            out.push(separator);
        }
        let title = title(channel).ok_or_else(|| {
            unwritable(
                format!("channel {:?} in {:?}", channel.name, channel.unit.symbol()),
                "give it a name of one line without blanks at its ends other than `t` or `time`, and a unit without brackets",
            )
        })?;
        out.push_str(&quoted(&title, separator));
    }
    out.push('\n');
    let columns: Vec<&[f64]> = recording.channels().iter().map(|c| c.samples.as_slice()).collect();
    for row in 0..recording.len() {
        for (i, column) in columns.iter().enumerate() {
            if i > 0 {
                out.push(separator);
            }
            let _ = write!(out, "{}", Shortest(column[row]));
        }
        out.push('\n');
    }
    Ok(out.into_bytes())
}

/// `name [unit]`, or [`None`] if that would be read as something else.
fn title(channel: &Channel) -> Option<String> {
    let (name, unit) = (&channel.name, &channel.unit);
    if name.is_empty() || name.trim() != name || is_time(name) || name.contains(char::is_control) {
        return None;
    }
    let title = match unit.symbol() {
        "" if infer_unit(name).is_none() && split_name(name).1.is_none() => name.clone(),
        "" => format!("{name} [1]"),
        symbol => format!("{name} [{symbol}]"),
    };
    let (read_name, read_unit) = split_name(&title);
    (read_name == *name && read_back(read_unit.unwrap_or_default()) == *unit && !unit.symbol().contains(char::is_control)).then_some(title)
}

/// Quotes a title that would otherwise be taken for a number, a comment or several cells.
fn quoted(title: &str, separator: char) -> String {
    let (name, unit) = split_name(title);
    let bracket = |text: &str| text.contains(['[', ']', '(', ')']);
    let nested = bracket(&name) || unit.is_some_and(bracket);
    let plain = !title.contains([',', ';', '\t', '"', '#', separator]) && !nested && name.contains(char::is_alphabetic);
    if plain && name.parse::<f64>().is_err() { title.to_owned() } else { format!("\"{}\"", title.replace('"', "\"\"")) }
}

/// The fewest digits that read back as the same number, with an exponent where that is shorter.
pub(crate) struct Shortest(pub f64);

impl std::fmt::Display for Shortest {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let magnitude = self.0.abs();
        if magnitude == 0.0 || (1e-5..1e16).contains(&magnitude) { write!(f, "{}", self.0) } else { write!(f, "{:e}", self.0) }
    }
}
