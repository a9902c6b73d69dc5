//! The formats that there are.

use crate::detect::{is_c3d, is_opensim, is_zip, is_zip_of_c3d};
use crate::error::IoError;
use crate::options::ReadOptions;
use crate::table::Table;
use ndof_signal::Recording;

/// A reader of one format: bytes, the file's name and what the caller adds, to one table a trial.
pub(crate) type Reader = fn(&[u8], &str, &ReadOptions) -> Result<Vec<Table>, IoError>;
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
    pub(crate) is: fn(&[u8]) -> bool,
    pub(crate) reader: Option<Reader>,
    pub(crate) writer: Option<Writer>,
}

/// Every format, built in or not, in the order in which content is compared.
///
/// ```
/// assert!(ndof_io::formats().iter().any(|format| format.name == "CSV" && format.suffixes.contains(&"tsv") && format.writes));
/// ```
pub fn formats() -> &'static [Format] {
    FORMATS
}

/// The item where its feature is built in.
macro_rules! where_built {
    ($feature:literal, $item:expr) => {{
        #[cfg(feature = $feature)]
        {
            Some($item)
        }
        #[cfg(not(feature = $feature))]
        {
            None
        }
    }};
}

/// A format that is read only.
macro_rules! read_only {
    ($name:literal, $suffixes:expr, $feature:literal, $is:expr, $reader:expr) => {
        Format {
            name: $name,
            suffixes: $suffixes,
            feature: $feature,
            built_in: cfg!(feature = $feature),
            writes: false,
            is: $is,
            reader: where_built!($feature, $reader),
            writer: None,
        }
    };
}

/// A format that is read and written.
macro_rules! read_and_written {
    ($name:literal, $suffixes:expr, $feature:literal, $is:expr, $reader:expr, $writer:expr) => {
        Format { writes: true, writer: where_built!($feature, $writer), ..read_only!($name, $suffixes, $feature, $is, $reader) }
    };
}

const HDF5: &[u8] = b"\x89HDF\r\n\x1a\n";

/// The format of text in columns, which is what a file is that is none of the others.
pub(crate) const TEXT: &str = "CSV";

pub(crate) static FORMATS: &[Format] = &[
    read_and_written!(
        "CSV",
        &["csv", "tsv", "txt", "dat", "asc"],
        "csv",
        |_| false,
        |bytes, file, options| crate::csv::read(bytes, file, options).map(|table| vec![table]),
        crate::csv::write
    ),
    read_only!("OpenSim", &["sto", "mot"], "csv", is_opensim, |bytes, file, _| crate::opensim::read(bytes, file).map(|table| vec![table])),
    read_only!("KINARM archive of C3D", &["zip", "kinarm"], "c3d", is_zip_of_c3d, |bytes, file, _| crate::kinarm::read(bytes, file)),
    read_and_written!("NPZ", &["npz"], "npz", is_zip, |bytes, file, _| crate::npz::read(bytes, file).map(|table| vec![table]), crate::npz::write),
    read_and_written!(
        "MAT v5",
        &["mat"],
        "mat",
        |bytes| bytes.starts_with(b"MATLAB 5.0 MAT-file"),
        |bytes, file, _| crate::mat::read(bytes, file),
        crate::mat::write
    ),
    read_and_written!(
        "Parquet",
        &["parquet"],
        "parquet",
        |bytes| bytes.starts_with(b"PAR1"),
        |bytes, file, _| crate::parquet::read(bytes, file),
        crate::parquet::write
    ),
    read_only!(
        "HDF5 / MAT v7.3",
        &["h5", "hdf5"],
        "hdf5",
        |bytes| bytes.starts_with(HDF5) || bytes.get(512..).is_some_and(|b| b.starts_with(HDF5)),
        |bytes, file, _| crate::hdf5::read(bytes, file)
    ),
    read_only!("C3D", &["c3d"], "c3d", is_c3d, |bytes, file, _| crate::c3d::read(bytes, file).map(|table| vec![table])),
    read_only!("XDF", &["xdf"], "xdf", |bytes| bytes.starts_with(b"XDF:"), |bytes, file, _| crate::xdf::read(bytes, file).map(|table| vec![table])),
    read_only!("TDMS", &["tdms"], "tdms", |bytes| bytes.starts_with(b"TDSm"), |bytes, file, _| crate::tdms::read(bytes, file)),
    read_only!("MCAP", &["mcap"], "mcap", |bytes| bytes.starts_with(b"\x89MCAP0\r\n"), |bytes, file, _| crate::mcap::read(bytes, file)
        .map(|table| vec![table])),
];
