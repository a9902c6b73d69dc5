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
    /// The Cargo feature that builds it in; empty where every build has it.
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

impl Format {
    const fn new(name: &'static str, suffixes: &'static [&'static str], feature: &'static str, is: fn(&[u8]) -> bool, reader: Option<Reader>) -> Self {
        Format { name, suffixes, feature, built_in: reader.is_some(), writes: false, is, reader, writer: None }
    }

    const fn written(self, writer: Option<Writer>) -> Self {
        Format { writes: true, writer, ..self }
    }
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

const HDF5: &[u8] = b"\x89HDF\r\n\x1a\n";

/// The format of text in columns, which is what a file is that is none of the others.
pub(crate) const TEXT: &str = "CSV";

pub(crate) static FORMATS: &[Format] = &[
    Format::new(
        "CSV",
        &["csv", "tsv", "txt", "dat", "asc"],
        "",
        |_| false,
        Some(|bytes, file, options| crate::csv::read(bytes, file, options).map(|table| vec![table])),
    )
    .written(Some(crate::csv::write)),
    Format::new("OpenSim", &["sto", "mot"], "", is_opensim, Some(|bytes, file, _| crate::opensim::read(bytes, file).map(|table| vec![table]))),
    Format::new("KINARM archive of C3D", &["zip", "kinarm"], "", is_zip_of_c3d, Some(|bytes, file, _| crate::kinarm::read(bytes, file))),
    Format::new("NPZ", &["npz"], "", is_zip, Some(|bytes, file, _| crate::npz::read(bytes, file).map(|table| vec![table]))).written(Some(crate::npz::write)),
    Format::new("MAT v5", &["mat"], "", |bytes| bytes.starts_with(b"MATLAB 5.0 MAT-file"), Some(|bytes, file, _| crate::mat::read(bytes, file)))
        .written(Some(crate::mat::write)),
    Format::new(
        "Parquet",
        &["parquet"],
        "parquet",
        |bytes| bytes.starts_with(b"PAR1"),
        where_built!("parquet", |bytes, file, _| crate::parquet::read(bytes, file)),
    )
    .written(where_built!("parquet", crate::parquet::write)),
    Format::new(
        "HDF5 / MAT v7.3",
        &["h5", "hdf5"],
        "hdf5",
        |bytes| bytes.starts_with(HDF5) || bytes.get(512..).is_some_and(|b| b.starts_with(HDF5)),
        where_built!("hdf5", |bytes, file, _| crate::hdf5::read(bytes, file)),
    ),
    Format::new("C3D", &["c3d"], "", is_c3d, Some(|bytes, file, _| crate::c3d::read(bytes, file).map(|table| vec![table]))),
    Format::new("XDF", &["xdf"], "", |bytes| bytes.starts_with(b"XDF:"), Some(|bytes, file, _| crate::xdf::read(bytes, file).map(|table| vec![table]))),
    Format::new("TDMS", &["tdms"], "", |bytes| bytes.starts_with(b"TDSm"), Some(|bytes, file, _| crate::tdms::read(bytes, file))),
    Format::new(
        "MCAP",
        &["mcap"],
        "mcap",
        |bytes| bytes.starts_with(b"\x89MCAP0\r\n"),
        where_built!("mcap", |bytes, file, _| crate::mcap::read(bytes, file).map(|table| vec![table])),
    ),
];
