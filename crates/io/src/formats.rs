//! The formats that there are, and which one a file has.

use crate::error::IoError;
use crate::table::Table;
use ndof_signal::Recording;
use std::path::Path;

/// A reader of one format: bytes and the file's name to columns.
pub(crate) type Reader = fn(&[u8], &str) -> Result<Table, IoError>;
/// A writer of one format: a recording and the file's name to bytes.
pub(crate) type Writer = fn(&Recording, &str) -> Result<Vec<u8>, IoError>;

/// A file format for recordings.
#[derive(Debug)]
pub struct Format {
    /// Its name, e.g. `CSV`.
    pub name: &'static str,
    /// Suffixes without the dot, lower case.
    pub suffixes: &'static [&'static str],
    /// The Cargo feature that builds it in.
    pub feature: &'static str,
    /// Whether this build has it.
    pub built_in: bool,
    /// Whether recordings can be written in it, where it is built in.
    pub writes: bool,
    is: fn(&[u8]) -> bool,
    reader: Option<Reader>,
    writer: Option<Writer>,
}

/// Every format, built in or not, in the order in which content is compared.
///
/// ```
/// assert!(ndof_io::formats().iter().any(|format| format.name == "CSV" && format.suffixes.contains(&"tsv") && format.writes));
/// ```
pub fn formats() -> &'static [Format] {
    FORMATS
}

static FORMATS: &[Format] = &[
    Format {
        name: "CSV",
        suffixes: &["csv", "tsv", "txt", "dat"],
        feature: "csv",
        built_in: cfg!(feature = "csv"),
        writes: true,
        is: |_| false,
        #[cfg(feature = "csv")]
        reader: Some(crate::csv::read),
        #[cfg(feature = "csv")]
        writer: Some(crate::csv::write),
        #[cfg(not(feature = "csv"))]
        reader: None,
        #[cfg(not(feature = "csv"))]
        writer: None,
    },
    Format {
        name: "NPZ",
        suffixes: &["npz"],
        feature: "npz",
        built_in: cfg!(feature = "npz"),
        writes: true,
        is: |bytes| bytes.starts_with(b"PK\x03\x04") || bytes.starts_with(b"PK\x05\x06"),
        #[cfg(feature = "npz")]
        reader: Some(crate::npz::read),
        #[cfg(feature = "npz")]
        writer: Some(crate::npz::write),
        #[cfg(not(feature = "npz"))]
        reader: None,
        #[cfg(not(feature = "npz"))]
        writer: None,
    },
    Format {
        name: "MAT v5",
        suffixes: &["mat"],
        feature: "mat",
        built_in: cfg!(feature = "mat"),
        writes: false,
        is: |bytes| bytes.starts_with(b"MATLAB 5.0 MAT-file"),
        #[cfg(feature = "mat")]
        reader: Some(crate::mat::read),
        #[cfg(not(feature = "mat"))]
        reader: None,
        writer: None,
    },
    Format {
        name: "Parquet",
        suffixes: &["parquet"],
        feature: "parquet",
        built_in: cfg!(feature = "parquet"),
        writes: true,
        is: |bytes| bytes.starts_with(b"PAR1"),
        #[cfg(feature = "parquet")]
        reader: Some(crate::parquet::read),
        #[cfg(feature = "parquet")]
        writer: Some(crate::parquet::write),
        #[cfg(not(feature = "parquet"))]
        reader: None,
        #[cfg(not(feature = "parquet"))]
        writer: None,
    },
    Format {
        name: "HDF5 / MAT v7.3",
        suffixes: &["h5", "hdf5"],
        feature: "hdf5",
        built_in: cfg!(feature = "hdf5"),
        writes: false,
        is: |bytes| bytes.starts_with(HDF5) || bytes.get(512..).is_some_and(|b| b.starts_with(HDF5)),
        #[cfg(feature = "hdf5")]
        reader: Some(crate::hdf5::read),
        #[cfg(not(feature = "hdf5"))]
        reader: None,
        writer: None,
    },
];

const HDF5: &[u8] = b"\x89HDF\r\n\x1a\n";

/// First bytes of what is sometimes mistaken for a recording: (bytes, what it is, what to do).
const STRANGERS: &[(&[u8], &str, &str)] = &[
    (b"\x93NUMPY", "it is a single NumPy array without channel names", "save named arrays with numpy.savez(\"file.npz\", force_x=..., t=...)"),
    (b"\x1f\x8b", "it is compressed with gzip", "unpack it with gunzip"),
    (b"BZh", "it is compressed with bzip2", "unpack it with bunzip2"),
    (b"\x28\xb5\x2f\xfd", "it is compressed with zstd", "unpack it with unzstd"),
    (b"\xff\xfe", "it is text in UTF-16", "save it as UTF-8"),
    (b"\xfe\xff", "it is text in UTF-16", "save it as UTF-8"),
    (b"\xd0\xcf\x11\xe0", "it is an Excel workbook", "export the sheet as CSV"),
    (b"c3d\x01", "it is a C3D file", "export the channels as CSV"),
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
    if let Some(format) = by_suffix(file).filter(|f| f.name != "CSV") {
        return Err(unknown(
            &format!("it is called .{}, but does not begin as {} does", suffix(file), format.name),
            "write or copy it again, or rename it if it is text (a MAT file of version 4 is read after saving it with -v7)",
        ));
    }
    if bytes[..bytes.len().min(4096)].contains(&0) {
        return Err(unknown("it is binary, in no format that is known here", &format!("convert it to one of {}", names())));
    }
    FORMATS.iter().find(|f| f.name == "CSV").ok_or_else(|| unknown("it is text", "convert it"))
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
