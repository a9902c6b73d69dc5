//! A recording as MAT v5 (`-v6`, not compressed), such that reading it gives the same recording bit for bit.
//!
//! Each channel is a column vector under its name, beside `sample_rate_hz`, the struct `units` and the struct `metadata`.

use super::element::MATRIX;
use super::identifier::escape;
use super::{HEADER, MAT, OWN};
use crate::assemble::{RESERVED_KEYS, is_time};
use crate::error::IoError;
use crate::names::{indexed, read_back};
use crate::write::{own_metadata, times};
use ndof_signal::Recording;

/// Types of elements.
const INT8: u32 = 1;
const UINT16: u32 = 4;
const INT32: u32 = 5;
const UINT32: u32 = 6;
const DOUBLES: u32 = 9;
/// Classes of matrices.
const STRUCT: u32 = 2;
const CHAR: u32 = 4;
const DOUBLE: u32 = 6;
/// Bytes of a field's name, its end included.
const FIELD: usize = 64;
/// Names that stand for something else.
const TAKEN: [&str; 5] = ["unit", "units", "metadata", "fs", "Fs"];

/// The bytes of the file.
pub(crate) fn write(recording: &Recording, file: &str) -> Result<Vec<u8>, IoError> {
    let unwritable = |what: String, remedy| IoError::Unwritable { file: file.to_owned(), what, format: MAT, remedy };
    if recording.len() < 2 {
        return Err(unwritable("a recording of less than two samples".to_owned(), "keep at least two: one is a number in MATLAB and no vector"));
    }
    if recording.len() > (u32::MAX / 16) as usize {
        return Err(unwritable("a channel of more than 2 GB".to_owned(), "split the recording, or write Parquet"));
    }
    let mut out = OWN.as_bytes().to_vec();
    out.resize(HEADER - 4, b' ');
    out.extend_from_slice(&[0, 1, b'I', b'M']);
    out.extend(times(recording).flat_map(|(key, value)| numbers(key, &[value])));
    let mut units = Vec::new();
    for channel in recording.channels() {
        let (name, symbol) = (&channel.name, channel.unit.symbol());
        let strange = is_time(name) || TAKEN.contains(&name.as_str()) || RESERVED_KEYS.contains(&name.as_str()) || indexed(name) != *name;
        let identifier = escape(name).filter(|_| !strange && read_back(symbol) == channel.unit && !symbol.contains('\0'));
        let identifier = identifier.ok_or_else(|| unwritable(format!("channel {name:?} in {symbol:?}"), "give it another, shorter name or another unit"))?;
        out.extend(numbers(&identifier, &channel.samples));
        units.push((identifier, text("", symbol)));
    }
    let mut metadata = Vec::new();
    for (key, value) in own_metadata(recording) {
        let identifier = escape(key).filter(|_| !value.contains('\0'));
        let identifier = identifier.ok_or_else(|| unwritable(format!("metadata {key:?}"), "use a shorter key, and text without NUL"))?;
        metadata.push((identifier, text("", value)));
    }
    out.extend(structure("units", &units));
    if !metadata.is_empty() {
        out.extend(structure("metadata", &metadata));
    }
    Ok(out)
}

fn element(kind: u32, data: &[u8]) -> Vec<u8> {
    let mut out = kind.to_le_bytes().to_vec();
    // Longer ones were refused.
    out.extend_from_slice(&(data.len() as u32).to_le_bytes());
    out.extend_from_slice(data);
    out.resize(out.len().next_multiple_of(8), 0);
    out
}

/// Flags, sizes and name, which each matrix begins with.
fn matrix(class: u32, sizes: [usize; 2], name: &str, parts: &[Vec<u8>]) -> Vec<u8> {
    let mut data = element(UINT32, &[class.to_le_bytes(), [0; 4]].concat());
    data.extend(element(INT32, &[(sizes[0] as u32).to_le_bytes(), (sizes[1] as u32).to_le_bytes()].concat()));
    data.extend(element(INT8, name.as_bytes()));
    parts.iter().for_each(|part| data.extend_from_slice(part));
    element(MATRIX, &data)
}

fn numbers(name: &str, values: &[f64]) -> Vec<u8> {
    let bytes: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
    matrix(DOUBLE, [values.len(), 1], name, &[element(DOUBLES, &bytes)])
}

fn text(name: &str, text: &str) -> Vec<u8> {
    let units: Vec<u16> = text.encode_utf16().collect();
    let bytes: Vec<u8> = units.iter().flat_map(|u| u.to_le_bytes()).collect();
    matrix(CHAR, [usize::from(!units.is_empty()), units.len()], name, &[element(UINT16, &bytes)])
}

fn structure(name: &str, fields: &[(String, Vec<u8>)]) -> Vec<u8> {
    let mut names = Vec::with_capacity(FIELD * fields.len());
    for (field, _) in fields {
        names.extend_from_slice(field.as_bytes());
        names.resize(names.len().next_multiple_of(FIELD), 0);
    }
    let mut parts = vec![element(INT32, &(FIELD as u32).to_le_bytes()), element(INT8, &names)];
    parts.extend(fields.iter().map(|(_, value)| value.clone()));
    matrix(STRUCT, [1, 1], name, &parts)
}
