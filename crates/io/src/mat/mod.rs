//! MAT version 5 (MATLAB's `-v6` and `-v7`, SciPy's `savemat`): one numeric vector a channel, also inside a struct.
//!
//! `fs` or `sample_rate_hz` is a single number, or there is a vector `t`. A struct `units` holds the units of the
//! channels of the same names as texts. The elements of an array of structs are trials. After "MAT-File Format", The MathWorks, version 5.

mod element;
mod identifier;
mod matrix;
mod write;

use crate::arrays::Entry;
use crate::error::IoError;
use crate::limits::{Budget, MAX_ENTRIES};
use crate::table::Table;
use crate::trials;
use element::{COMPRESSED, Elements, MATRIX};
use flate2::read::ZlibDecoder;
use matrix::Matrices;

pub(crate) use write::write;

/// The format's name in messages.
const MAT: &str = "MAT v5";

/// What the files begin with that are written here; in them, names of other characters are escaped.
const OWN: &str = concat!("MATLAB 5.0 MAT-file, written by ndof ", env!("CARGO_PKG_VERSION"));

/// Bytes before the first variable.
const HEADER: usize = 128;

/// Reads a MAT file.
pub(crate) fn read(bytes: &[u8], file: &str) -> Result<Vec<Table>, IoError> {
    let damaged = |what: String| IoError::Damaged { file: file.to_owned(), format: MAT, what };
    let big = match bytes.get(126..HEADER) {
        Some(b"IM") => false,
        Some(b"MI") => true,
        _ => return Err(damaged("its header of 128 bytes is incomplete".to_owned())),
    };
    let mut budget = Budget::of(bytes.len());
    let mut entries: Vec<Entry> = Vec::new();
    let mut elements = Elements::new(&bytes[HEADER..], big);
    let mut variable = 0;
    while let Some(element) = elements.next().map_err(|what| damaged(format!("variable {variable}: {what}")))? {
        let unpacked;
        let data = match element.kind {
            COMPRESSED => {
                let stream = ZlibDecoder::new(element.data);
                unpacked = budget.unpack(file, stream)?.map_err(|e| damaged(format!("variable {variable}: its packed data are broken ({e})")))?;
                match Elements::new(&unpacked, big).next() {
                    Ok(Some(inner)) if inner.kind == MATRIX => inner.data,
                    Ok(_) => return Err(damaged(format!("variable {variable}: no matrix in its packed data"))),
                    Err(what) => return Err(damaged(format!("variable {variable}: {what}"))),
                }
            }
            MATRIX => element.data,
            _ => continue,
        };
        let mut matrices = Matrices { file, big, budget: &mut budget, entries: &mut entries };
        matrices.read(data).map_err(|problem| match problem {
            matrix::Problem::Damaged(what) => damaged(format!("variable {variable}: {what}")),
            matrix::Problem::Limit(error) => error,
        })?;
        if entries.len() > MAX_ENTRIES {
            return Err(IoError::too_large(file, "arrays", entries.len(), MAX_ENTRIES, "save one array a channel"));
        }
        variable += 1;
    }
    if bytes.starts_with(OWN.as_bytes()) {
        entries.iter_mut().flat_map(|entry| &mut entry.path).for_each(|name| *name = identifier::unescape(name));
    }
    trials::tables(file, entries)
}
