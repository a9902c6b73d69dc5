//! A recording as NPZ, such that reading it gives the same recording bit for bit.

use super::{NPZ, npy};
use crate::assemble::{RESERVED_KEYS, is_time};
use crate::error::IoError;
use crate::names::{indexed, read_back};
use crate::write::{own_metadata, times};
use ndof_signal::Recording;
use std::io::{Cursor, Write};
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, DateTime, ZipWriter};

/// The bytes of the file.
pub(crate) fn write(recording: &Recording, file: &str) -> Result<Vec<u8>, IoError> {
    let unwritable = |what: String, remedy| IoError::Unwritable { file: file.to_owned(), what, format: NPZ, remedy };
    if recording.is_empty() {
        return Err(unwritable("a recording without samples".to_owned(), "record or keep at least one"));
    }
    let mut arrays: Vec<_> = times(recording).map(|(key, value)| (key.to_owned(), npy::encode_numbers(&[], &[value]))).collect();
    for (key, value) in own_metadata(recording) {
        if key.is_empty() || key.contains(['\0', '\\']) || value.contains('\0') {
            return Err(unwritable(format!("metadata {key:?}"), "use a key of one word and text without NUL"));
        }
        arrays.push((format!("metadata/{key}"), npy::encode_texts(&[], &[value])));
    }
    for channel in recording.channels() {
        let name = &channel.name;
        let strange = name.is_empty() || name.contains(['\0', '\\']) || RESERVED_KEYS.contains(&name.as_str());
        if strange
            || name.starts_with("unit/")
            || name.starts_with("metadata/")
            || is_time(name)
            || indexed(name) != *name
            || read_back(channel.unit.symbol()) != channel.unit
        {
            return Err(unwritable(format!("channel {name:?} in {:?}", channel.unit.symbol()), "give it another name or unit"));
        }
        arrays.push((name.clone(), npy::encode_numbers(&[channel.samples.len()], &channel.samples)));
        arrays.push((format!("unit/{name}"), npy::encode_texts(&[], &[channel.unit.symbol()])));
    }
    zip(&arrays).map_err(|e| unwritable(format!("the recording ({e})"), "use shorter names, or CSV"))
}

/// The archive, not compressed (measured noise does not shrink) and without the time of day.
pub(crate) fn zip(arrays: &[(String, Vec<u8>)]) -> Result<Vec<u8>, zip::result::ZipError> {
    let options = SimpleFileOptions::default().compression_method(CompressionMethod::Stored).last_modified_time(DateTime::default());
    let mut writer = ZipWriter::new(Cursor::new(Vec::new()));
    for (name, data) in arrays {
        writer.start_file(format!("{name}.npy"), options.large_file(data.len() > u32::MAX as usize))?;
        writer.write_all(data)?;
    }
    Ok(writer.finish()?.into_inner())
}
