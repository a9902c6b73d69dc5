//! Measured frequency responses as files: what modal and control engineers exchange in place of recordings.

mod bins;
mod columns;
mod npz;
mod pairs;
mod table;
mod touchstone;
mod universal;

use crate::atomic::write_atomic;
use crate::contents::contents;
use crate::error::IoError;
use crate::recording::Note;
use std::io::Read;
use std::path::Path;

pub use table::ResponseTable;

/// Bytes that tell a response from a recording.
const LOOKED_AT: u64 = 1 << 17;

/// What an NPZ begins with.
const ZIP: &[u8] = b"PK\x03\x04";

/// Reads a frequency response: CSV with `frequency_hz` and `re_OUT_IN`, `im_OUT_IN` or `gain_OUT_IN`, `phase_deg_OUT_IN` (perhaps
/// `std_OUT_IN`, `coherence_OUT_IN`), Universal File 58 (ASCII and binary), Touchstone 1.1, or NPZ. The format follows from the content.
///
/// # Errors
/// [`IoError`] with file, place and remedy.
///
/// ```
/// let csv = b"frequency_hz,re_x_f,im_x_f\n1.0,0.5,-0.25\n2.0,0.25,-0.5\n";
/// let response = ndof_io::read_response_bytes(csv, "frf.csv")?;
/// assert_eq!((response.outputs[0].as_str(), response.inputs[0].as_str(), response.values[0][0][1].im), ("x", "f", -0.5));
/// # Ok::<(), ndof_io::IoError>(())
/// ```
pub fn read_response(path: &Path) -> Result<ResponseTable, IoError> {
    let (bytes, file) = contents(path)?;
    read_response_bytes(&bytes, &file)
}

/// As [`read_response`], from the bytes of a file called `file`.
///
/// # Errors
/// As [`read_response`].
pub fn read_response_bytes(bytes: &[u8], file: &str) -> Result<ResponseTable, IoError> {
    if bytes.is_empty() {
        return Err(IoError::Empty { file: file.to_owned() });
    }
    let response = match kind(bytes) {
        Some(Kind::Universal) => universal::read(bytes, file)?,
        Some(Kind::Touchstone) => touchstone::read(bytes, file)?,
        Some(Kind::Npz) => npz::read(bytes, file)?,
        _ => columns::read(bytes, file)?,
    };
    response.check().map_err(|what| IoError::Unsuitable { file: file.to_owned(), what, remedy: "a response has one value a frequency".to_owned() })?;
    Ok(response)
}

/// Whether these are the bytes of a frequency response, and of no recording.
pub fn is_response(bytes: &[u8]) -> bool {
    kind(bytes).is_some()
}

/// What the format of these bytes is called, if they are a frequency response.
pub(crate) fn format_name(bytes: &[u8]) -> Option<&'static str> {
    kind(bytes).map(|kind| match kind {
        Kind::Universal => "Universal File 58",
        Kind::Touchstone => "Touchstone",
        Kind::Npz => "NPZ",
        Kind::Columns => "CSV",
    })
}

/// Whether a file holds a frequency response, and no recording. No more of it is read than its content needs to tell.
///
/// # Errors
/// [`IoError::Read`].
pub fn holds_response(path: &Path) -> Result<bool, IoError> {
    let file = path.display().to_string();
    if path.as_os_str() == "-" || path.is_dir() {
        return Ok(false);
    }
    let mut head = Vec::new();
    let opened = std::fs::File::open(path).and_then(|opened| opened.take(LOOKED_AT).read_to_end(&mut head));
    opened.map_err(|source| IoError::Read { file: file.clone(), source })?;
    if head.starts_with(ZIP) {
        return Ok(is_response(&contents(path)?.0));
    }
    Ok(is_response(&head))
}

/// Writes a frequency response in the format of the suffix (`.csv`, `.tsv`, `.npz`, `.uff`, `.unv`, `.sNp`), atomically. What the format has
/// no room for is told.
///
/// # Errors
/// [`IoError`] if no format has this suffix, the format cannot hold the response, or the disk fails.
pub fn write_response(path: &Path, response: &ResponseTable) -> Result<Vec<Note>, IoError> {
    let (bytes, notes) = encode_response(response, &path.display().to_string())?;
    write_atomic(path, &bytes)?;
    Ok(notes)
}

/// The bytes of a frequency response in the format of the suffix of `file`, and what they have no room for.
///
/// # Errors
/// As [`write_response`], without the disk's.
pub fn encode_response(response: &ResponseTable, file: &str) -> Result<(Vec<u8>, Vec<Note>), IoError> {
    let unwritable = |what: String| IoError::Unwritable { file: file.to_owned(), what, format: "a response", remedy: "correct it where it was made" };
    response.check().map_err(unwritable)?;
    let suffix = Path::new(file).extension().map_or(String::new(), |s| s.to_string_lossy().to_ascii_lowercase());
    match suffix.as_str() {
        "csv" | "tsv" => Ok((columns::write(response, file)?, Vec::new())),
        "npz" => Ok((npz::write(response, file)?, Vec::new())),
        "uff" | "unv" | "u58" => universal::write(response, file),
        other if touchstone::ports(other).is_some() => touchstone::write(response, file),
        _ => {
            let known = [".csv", ".tsv", ".npz", ".uff", ".unv", ".s1p", ".s2p"].map(str::to_owned).to_vec();
            Err(IoError::UnknownSuffix { file: file.to_owned(), known })
        }
    }
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Kind {
    Universal,
    Touchstone,
    Npz,
    Columns,
}

/// What kind of a response these bytes are; [`None`] if they are none.
fn kind(bytes: &[u8]) -> Option<Kind> {
    if universal::is(bytes) {
        Some(Kind::Universal)
    } else if touchstone::is(bytes) {
        Some(Kind::Touchstone)
    } else if bytes.starts_with(ZIP) {
        npz::is(bytes).then_some(Kind::Npz)
    } else {
        columns::is(bytes).then_some(Kind::Columns)
    }
}
