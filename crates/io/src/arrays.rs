//! From the named arrays of a binary file to columns and metadata: one rule for NPZ, MAT and HDF5.

use crate::assemble::is_time;
use crate::error::{IoError, listed};
use crate::limits::MAX_CHANNELS;
use crate::names::{indexed, split_name, uniquely};
use crate::recording::Note;
use crate::table::{Column, Rounding, Table};
use crate::timing::RATE_KEY;
use std::collections::BTreeMap;

/// What stands under one name in a file.
#[derive(Clone, Debug)]
pub(crate) struct Entry {
    /// Group and name, e.g. `["data", "force_x"]`; the last is the channel's.
    pub path: Vec<String>,
    pub value: Value,
    /// The unit, where the format keeps it with the array.
    pub unit: Option<String>,
}

impl Entry {
    pub fn new(path: Vec<String>, value: Value) -> Self {
        Entry { path, value, unit: None }
    }
}

/// The value of an [`Entry`].
#[derive(Clone, Debug)]
pub(crate) enum Value {
    /// Real numbers with the sizes of their dimensions (none: a single number).
    Numbers { shape: Vec<usize>, values: Vec<f64>, rounding: Rounding },
    /// Text.
    Text(String),
    /// What is neither, in words.
    Other(&'static str),
}

impl Rounding {
    /// Numbers of 32-bit floating point.
    pub const SINGLE: Rounding = Rounding { place: 0.0, significant: 0, relative: f32::EPSILON as f64 };
    /// Whole numbers.
    pub const INTEGER: Rounding = Rounding { place: 1.0, significant: 0, relative: 0.0 };
}

/// Other names under which a lone number is the sample rate; `sample_rate_hz` wins over them.
const RATE_NAMES: [&str; 3] = ["fs", "Fs", "sample_rate"];

/// Groups whose texts are the units of the channels of the same names.
const UNIT_GROUPS: [&str; 2] = ["unit", "units"];

/// The group of free-form facts.
const METADATA_GROUP: &str = "metadata";

/// Vectors shorter than this share of the longest are settings, not channels; longer ones that differ are an error.
const SHORT: f64 = 0.5;

/// Sorts the entries of a file into channels, units and metadata.
///
/// Vectors are channels, single numbers and texts are metadata. A channel in a group goes by its last name where that
/// is unique, else by its whole path joined by dots.
pub(crate) fn table(file: &str, entries: Vec<Entry>) -> Result<Table, IoError> {
    let mut table = Table::default();
    let mut units = BTreeMap::new();
    let mut vectors = Vec::new();
    let mut ignored = Vec::new();
    let vector = entries.iter().filter_map(|e| vector_len(&e.value)).max().filter(|n| *n > 1);
    let entries: Vec<Entry> = entries.into_iter().flat_map(|entry| apart(entry, vector)).collect();
    let longest = entries.iter().filter_map(|e| vector_len(&e.value)).max().unwrap_or(0);
    for Entry { path, value, unit } in entries {
        let Some(name) = path.last() else { continue };
        let group = path.len().checked_sub(2).and_then(|i| path.get(i)).map(String::as_str);
        match value {
            Value::Text(text) if group.is_some_and(|g| UNIT_GROUPS.contains(&g)) => {
                units.insert(name.clone(), text);
            }
            Value::Text(text) => {
                table.metadata.insert(metadata_key(&path), text);
            }
            Value::Numbers { shape, values, rounding } => match values[..] {
                [number] if shape.is_empty() || longest > 1 => {
                    let text = format!("{number}");
                    if name == RATE_KEY {
                        table.metadata.insert(RATE_KEY.to_owned(), text);
                    } else if RATE_NAMES.contains(&name.as_str()) {
                        table.metadata.entry(RATE_KEY.to_owned()).or_insert(text);
                    } else {
                        table.metadata.insert(metadata_key(&path), text);
                    }
                }
                _ if !is_vector(&shape) => ignored.push(format!("{} ({})", path.join("."), sizes(&shape))),
                _ if (values.len() as f64) < SHORT * longest as f64 => ignored.push(format!("{} ({} numbers)", path.join("."), values.len())),
                _ => vectors.push((path, values, rounding, unit)),
            },
            Value::Other(what) => ignored.push(format!("{} ({what})", path.join("."))),
        }
    }
    if !ignored.is_empty() {
        ignored.sort();
        table.notes.push(Note::new(
            "ignored-arrays",
            format!("not read, since a channel is one vector of real numbers as long as the recording: {}", listed(&ignored)),
            "save each channel as a vector of its own",
        ));
    }
    if vectors.is_empty() {
        return Err(IoError::unsuitable(file, "there is no vector of numbers in it", "save each channel as one vector under its name, such as force_x"));
    }
    let (paths, vectors): (Vec<_>, Vec<_>) = vectors.into_iter().map(|(path, samples, rounding, unit)| (path, (samples, rounding, unit))).unzip();
    for ((path, full), (samples, rounding, own)) in paths.iter().zip(uniquely(&paths)).zip(vectors) {
        let last = path.last().cloned().unwrap_or_default();
        let (name, unit) = match units.get(&last).cloned().or(own) {
            Some(unit) => (indexed(&full).into_owned(), Some(unit)),
            None => {
                let (name, unit) = split_name(&full);
                (name.into_owned(), unit.map(str::to_owned))
            }
        };
        table.columns.push(Column { name, unit, samples, rounding });
    }
    table.columns.sort_by_key(|c| !is_time(&c.name));
    Ok(table)
}

fn metadata_key(path: &[String]) -> String {
    match path {
        [group, rest @ ..] if group == METADATA_GROUP && !rest.is_empty() => rest.join("."),
        path => path.join("."),
    }
}

/// Numbers of which the first index runs fastest, in the order of C, where it runs slowest.
pub(crate) fn in_c_order<T: Copy>(shape: &[usize], values: &[T]) -> Vec<T> {
    let at = |k: usize| {
        let (mut k, mut place, mut inner, mut stride) = (k, 0, values.len(), 1);
        for size in shape {
            inner /= size;
            place += k / inner * stride;
            k %= inner;
            stride *= size;
        }
        values[place]
    };
    (0..values.len()).map(at).collect()
}

/// A table of as many rows, or columns, as the recording has samples is a channel each of its columns, or rows: `q` is `q_0`, `q_1` …
fn apart(entry: Entry, samples: Option<usize>) -> Vec<Entry> {
    let Value::Numbers { shape, values, rounding } = &entry.value else { return vec![entry] };
    let long: Vec<usize> = shape.iter().copied().filter(|n| *n != 1).collect();
    let &[rows, columns] = &long[..] else { return vec![entry] };
    let samples = samples.unwrap_or(rows.max(columns));
    if (rows == samples) == (columns == samples) || rows.min(columns) > MAX_CHANNELS {
        return vec![entry];
    }
    let [each, step, from] = if rows == samples { [columns, columns, 1] } else { [rows, 1, columns] };
    let one = |k: usize| {
        let values: Vec<f64> = values.iter().skip(k * from).step_by(step).take(samples).copied().collect();
        let mut path = entry.path.clone();
        if let Some(name) = path.last_mut() {
            *name = format!("{name}_{k}");
        }
        Entry { path, value: Value::Numbers { shape: vec![samples], values, rounding: *rounding }, unit: entry.unit.clone() }
    };
    (0..each).map(one).collect()
}

fn is_vector(shape: &[usize]) -> bool {
    shape.iter().filter(|&&n| n != 1).count() <= 1 && !shape.is_empty()
}

fn vector_len(value: &Value) -> Option<usize> {
    match value {
        Value::Numbers { shape, values, .. } if is_vector(shape) => Some(values.len()),
        _ => None,
    }
}

fn sizes(shape: &[usize]) -> String {
    shape.iter().map(usize::to_string).collect::<Vec<_>>().join(" × ")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn numbers(path: &[&str], shape: &[usize]) -> Entry {
        let len = shape.iter().product();
        let values = (0..len).map(|k| k as f64).collect();
        Entry::new(path.iter().map(|&p| p.to_owned()).collect(), Value::Numbers { shape: shape.to_vec(), values, rounding: Rounding::default() })
    }

    fn text(path: &[&str], text: &str) -> Entry {
        Entry::new(path.iter().map(|&p| p.to_owned()).collect(), Value::Text(text.to_owned()))
    }

    #[test]
    fn vectors_are_channels_and_the_rest_is_said() {
        let table = table(
            "f",
            vec![
                numbers(&["left", "force_x"], &[100, 1]),
                numbers(&["right", "force_x"], &[1, 100]),
                numbers(&["pos_y"], &[100]),
                numbers(&["t"], &[100]),
                numbers(&["K"], &[2, 2]),
                numbers(&["gains"], &[3]),
                numbers(&["fs"], &[1, 1]),
                text(&["units", "pos_y"], "mm"),
                text(&["metadata", "arm"], "left"),
            ],
        )
        .unwrap();
        let names: Vec<_> = table.columns.iter().map(|c| c.name.as_str()).collect();
        assert_eq!(names, ["t", "left.force_x", "right.force_x", "pos_y"]);
        assert_eq!(table.columns[3].unit.as_deref(), Some("mm"));
        assert_eq!(table.metadata.get("sample_rate_hz").map(String::as_str), Some("0"));
        assert_eq!(table.metadata.get("arm").map(String::as_str), Some("left"));
        assert!(table.notes[0].message.contains("K (2 × 2)") && table.notes[0].message.contains("gains (3 numbers)"), "{}", table.notes[0].message);
    }

    #[test]
    fn a_table_as_long_as_the_recording_is_a_channel_a_column() {
        let both = table("f", vec![numbers(&["t"], &[5]), numbers(&["q"], &[5, 2]), numbers(&["tau"], &[2, 5]), numbers(&["K"], &[3, 3])]).unwrap();
        let of = |name: &str| both.columns.iter().find(|c| c.name == name).map(|c| c.samples.clone());
        assert_eq!(of("q_1"), Some(vec![1.0, 3.0, 5.0, 7.0, 9.0]));
        assert_eq!(of("tau_1"), Some(vec![5.0, 6.0, 7.0, 8.0, 9.0]));
        assert_eq!(both.columns.len(), 5, "K is no channel");
        // Without a vector the longer side is of samples; of a square neither is.
        let alone = table("f", vec![numbers(&["q"], &[2, 4])]).unwrap();
        assert_eq!(alone.columns.iter().map(|c| c.samples.clone()).collect::<Vec<_>>(), [[0.0, 1.0, 2.0, 3.0], [4.0, 5.0, 6.0, 7.0]]);
        assert!(table("f", vec![numbers(&["q"], &[3, 3])]).is_err());
        // Of MAT and of Fortran the first index runs fastest.
        assert_eq!(in_c_order(&[2, 3], &[0, 3, 1, 4, 2, 5]), [0, 1, 2, 3, 4, 5]);
    }

    #[test]
    fn a_file_without_vectors_is_no_recording() {
        assert!(matches!(table("f", vec![numbers(&["fs"], &[])]), Err(IoError::Unsuitable { .. })));
    }
}
