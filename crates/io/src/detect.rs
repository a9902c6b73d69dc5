//! Which format a file has: by its content, and by its suffix where the content does not tell.

use crate::error::IoError;
use crate::formats::{FORMATS, Format, Reader, TEXT, Writer};
use std::path::Path;

/// First bytes of what is sometimes mistaken for a recording: (bytes, what it is, what to do).
const STRANGERS: &[(&[u8], &str, &str)] = &[
    (b"\x93NUMPY", "it is a single NumPy array without channel names", "save named arrays with numpy.savez(\"file.npz\", force_x=..., t=...)"),
    (b"\x1f\x8b", "it is compressed with gzip", "unpack it with gunzip"),
    (b"BZh", "it is compressed with bzip2", "unpack it with bunzip2"),
    (b"\x28\xb5\x2f\xfd", "it is compressed with zstd", "unpack it with unzstd"),
    (b"\xff\xfe", "it is text in UTF-16", "save it as UTF-8"),
    (b"\xfe\xff", "it is text in UTF-16", "save it as UTF-8"),
    (b"\xd0\xcf\x11\xe0", "it is an Excel workbook", "export the sheet as CSV"),
    (b"#ROSBAG V2.0", "it is a bag of ROS 1", "make MCAP of it with `mcap convert`"),
    (b"SQLite format 3\0", "it is an SQLite database, such as the older bags of ROS 2", "make MCAP of it with `ros2 bag convert`"),
    (b"%PDF", "it is a PDF", "export the numbers as CSV"),
];

fn suffix(file: &str) -> String {
    Path::new(file).extension().map_or(String::new(), |s| s.to_string_lossy().to_ascii_lowercase())
}

fn by_suffix(file: &str) -> Option<&'static Format> {
    let suffix = suffix(file);
    FORMATS.iter().find(|f| f.suffixes.contains(&suffix.as_str()))
}

/// The format of these bytes.
pub(crate) fn detect(bytes: &[u8], file: &str) -> Result<&'static Format, IoError> {
    if bytes.is_empty() {
        return Err(IoError::Empty { file: file.to_owned() });
    }
    if let Some(format) = FORMATS.iter().find(|f| (f.is)(bytes)) {
        return Ok(format);
    }
    let unknown = |found: &str, remedy: &str| IoError::UnknownFormat { file: file.to_owned(), found: found.to_owned(), remedy: remedy.to_owned() };
    if let Some((_, found, remedy)) = STRANGERS.iter().find(|(start, ..)| bytes.starts_with(start)) {
        return Err(unknown(found, remedy));
    }
    if let Some(format) = by_suffix(file).filter(|f| f.name != TEXT) {
        return Err(unknown(
            &format!("it is called .{}, but does not begin as {} does", suffix(file), format.name),
            "write or copy it again, or rename it if it is text (a MAT file of version 4 is read after saving it with -v7)",
        ));
    }
    if bytes[..bytes.len().min(4096)].contains(&0) {
        return Err(unknown("it is binary, in no format that is known here", &format!("convert it to one of {}", names())));
    }
    FORMATS.iter().find(|f| f.name == TEXT).ok_or_else(|| unknown("it is text", "convert it"))
}

fn names() -> String {
    FORMATS.iter().map(|f| f.name).collect::<Vec<_>>().join(", ")
}

pub(crate) fn reader(format: &'static Format, file: &str) -> Result<Reader, IoError> {
    format.reader.ok_or_else(|| IoError::NotBuiltIn { file: file.to_owned(), format: format.name, feature: format.feature })
}

pub(crate) fn writer(file: &str) -> Result<Writer, IoError> {
    let writable = || FORMATS.iter().filter(|f| f.writes).flat_map(|f| f.suffixes).map(|s| format!(".{s}")).collect();
    match by_suffix(file) {
        Some(format) if format.writes => {
            format.writer.ok_or_else(|| IoError::NotBuiltIn { file: file.to_owned(), format: format.name, feature: format.feature })
        }
        _ => Err(IoError::UnknownSuffix { file: file.to_owned(), known: writable() }),
    }
}

/// Bytes at the end of a ZIP in which its directory is looked for.
const DIRECTORY: usize = 1 << 20;

/// Bytes in which the header of OpenSim ends; it has a few hundred.
const HEADER: usize = 1 << 16;

/// Whether this is a ZIP.
pub(crate) fn is_zip(bytes: &[u8]) -> bool {
    [&b"PK\x03\x04"[..], b"PK\x05\x06"].iter().any(|start| bytes.starts_with(start))
}

/// Whether this is a ZIP whose directory lists a C3D file.
pub(crate) fn is_zip_of_c3d(bytes: &[u8]) -> bool {
    let tail = &bytes[bytes.len().saturating_sub(DIRECTORY)..];
    // An entry: its mark, 24 bytes, the length of its name, 16 bytes, the name.
    let name = |entry: &[u8]| {
        let length = entry.get(28..30).map(|b| usize::from(u16::from_le_bytes([b[0], b[1]])))?;
        entry.get(46..46 + length).map(|name| name.to_ascii_lowercase().ends_with(b".c3d"))
    };
    is_zip(bytes) && tail.windows(4).enumerate().any(|(at, four)| four == b"PK\x01\x02" && name(&tail[at..]) == Some(true))
}

/// Whether this is a C3D file: the key, and a processor in the parameters.
pub(crate) fn is_c3d(bytes: &[u8]) -> bool {
    let [block, 0x50, ..] = bytes else { return false };
    *block > 1 && bytes.get((usize::from(*block) - 1) * 512 + 3).is_some_and(|processor| (84..=86).contains(processor))
}

/// Whether this is text with the line that ends a header of OpenSim.
pub(crate) fn is_opensim(bytes: &[u8]) -> bool {
    let head = &bytes[..bytes.len().min(HEADER)];
    !head.contains(&0) && head.split(|b| *b == b'\n').any(|line| line.trim_ascii().eq_ignore_ascii_case(b"endheader"))
}
