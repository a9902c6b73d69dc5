//! Recording files: one module a format, and writing that never leaves half a file.
//!
//! [`read`] turns a file into a [`ReadRecording`]: channels in SI units at one rate, with a [`Note`] for everything
//! that was done to get there (a unit converted, a stretch resampled, a column ignored). [`write()`] is its inverse.
//! What a file does not say is never guessed in silence: it is an [`IoError`] that names the file, the place and the
//! remedy, or a note.
//!
//! ```
//! use ndof_io::{ReadOptions, read_bytes};
//! let file = b"# sample_rate_hz: 500\nforce_x [N],pos_x [mm]\n1.5,2.0\n1.25,2.5\n";
//! let read = read_bytes(file, "trial.csv", &ReadOptions::default())?;
//! assert_eq!(read.recording.channel("pos_x")?.samples, [0.002, 0.0025]);
//! assert_eq!(read.notes[0].code, "unit-converted");
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

#![cfg_attr(docsrs, feature(doc_cfg))]
#![cfg_attr(not(feature = "full"), allow(dead_code, reason = "a build without a format leaves what only that one uses"))]

mod apart;
mod arrays;
mod assemble;
mod atomic;
mod bids;
mod c3d;
mod columns;
mod contents;
mod csv;
mod cursor;
mod detect;
mod error;
mod explain;
mod formats;
#[cfg(feature = "hdf5")]
mod hdf5;
mod join;
mod kinarm;
mod limits;
mod mat;
#[cfg(feature = "mcap")]
mod mcap;
mod names;
mod npz;
mod number;
mod opensim;
mod options;
#[cfg(feature = "parquet")]
mod parquet;
mod pieces;
mod prepare;
mod read;
mod recording;
mod resample;
mod response;
mod results;
mod table;
mod tdms;
mod time;
mod timing;
mod trials;
mod units;
mod write;
mod xdf;

pub use apart::Apart;
pub use assemble::is_time;
pub use atomic::{abandon_writes, keep, write_atomic, write_atomic_with};
pub use columns::{ColumnNumber, ColumnsFile};
pub use csv::CsvStream;
pub use error::{IoError, Place};
pub use explain::{ExplainedChannel, ExplainedTrial, Explanation, Holds, explain};
pub use formats::{Format, formats};
pub use options::{ReadOptions, Resample};
pub use pieces::{Piece, Pieces};
pub use prepare::{Aligned, PrepareError, align, calibrate, negate, tare, without_handle};
pub use read::{from_columns, read, read_bytes, read_trials, read_trials_bytes};
pub use recording::{MissingSamples, Note, ReadRecording};
pub use response::{ResponseTable, encode_response, holds_response, is_response, read_response, read_response_bytes, write_response};
pub use results::{ResultColumn, write_results_csv, write_results_parquet};
pub use units::infer_unit;
pub use write::{encode, write};
