//! Parquet piece by piece: a page of each column at a time.

use super::kind::{Kind, append};
use super::read::{caught, check_compression, check_places, check_size, facts};
use super::{PARQUET, episodes};
use crate::arrays::{self, Entry, Value};
use crate::assemble::{SAMPLES_KEY, assemble, is_time, name_time, require_count};
use crate::error::{IoError, Place};
use crate::names::split_name;
use crate::options::ReadOptions;
use crate::pieces::Piece;
use crate::timing::{RATE_AGREEMENT, irregular, number};
use ::parquet::column::reader::ColumnReader;
use ::parquet::file::metadata::KeyValue;
use ::parquet::file::reader::{FileReader, SerializedFileReader};
use ndof_signal::{Recording, RecordingError};
use std::fs::File;

/// Rows of a piece.
const ROWS: usize = 1 << 16;
/// Rows that are read again with the next ones, so that the step between two pieces is seen among others.
const OVERLAP: usize = 64;

/// A Parquet file whose rows are read in order.
pub(crate) struct ParquetStream {
    file: String,
    options: ReadOptions,
    reader: SerializedFileReader<File>,
    /// Columns of numbers: place, name and how they are taken.
    columns: Vec<(usize, String, Kind)>,
    /// Rows of a piece.
    rows: usize,
    /// The samples that the file says it has, besides its directory.
    declared: Option<f64>,
    /// What is no column of numbers.
    others: Vec<Entry>,
    /// The next row group.
    group: usize,
    /// Columns of the one that is read, and its rows that are left.
    open: Vec<ColumnReader>,
    left: usize,
    /// The last rows of the piece before.
    kept: Vec<Vec<f64>>,
    /// Rate and start, once they are known, and samples handed out.
    clock: Option<(f64, f64)>,
    seen: usize,
}

impl ParquetStream {
    /// Reads the directory of `handle`, which `file` names in errors.
    pub fn open(handle: File, file: &str, options: ReadOptions) -> Result<Self, IoError> {
        let damaged = |what: String| IoError::Damaged { file: file.to_owned(), format: PARQUET, what };
        let len = handle.metadata().map_err(|source| IoError::Read { file: file.to_owned(), source })?.len() as usize;
        caught(file, || {
            let reader = SerializedFileReader::new(handle).map_err(|e| damaged(format!("its directory cannot be read ({e}); it may be cut off")))?;
            let metadata = reader.metadata();
            check_places(len, metadata).map_err(damaged)?;
            check_compression(file, metadata)?;
            let (mut columns, mut others, mut declared) = (Vec::new(), Vec::new(), None);
            for (i, column) in metadata.file_metadata().schema_descr().columns().iter().enumerate() {
                let name = column.path().parts().join(".");
                match Kind::of(column) {
                    Some(kind) => columns.push((i, name, kind)),
                    None => others.push(Entry::new(vec![name], Value::Other("no column of plain numbers"))),
                }
            }
            for KeyValue { key, value } in metadata.file_metadata().key_value_metadata().into_iter().flatten() {
                // A piece does not have the number of samples of the whole.
                if key == SAMPLES_KEY {
                    declared = value.as_deref().and_then(number);
                } else {
                    facts(key, value.as_deref().unwrap_or_default(), &mut others);
                }
            }
            let options = ReadOptions { allow_nan: true, resample: None, ..options };
            let kept = vec![Vec::new(); columns.len()];
            Ok(ParquetStream {
                file: file.to_owned(),
                options,
                reader,
                columns,
                rows: ROWS,
                declared,
                others,
                group: 0,
                open: Vec::new(),
                left: 0,
                kept,
                clock: None,
                seen: 0,
            })
        })
    }

    /// The samples of each channel where the channels can be read one by one, and are then what they are in the whole file; `None` of a file that also holds
    /// something else, or several trials.
    pub fn samples_apart(&self, bytes: usize) -> Option<usize> {
        let plain = self.others.iter().all(|entry| !matches!(entry.value, Value::Other(_)));
        let told = self.columns.iter().any(|(_, name, _)| episodes::are_told_by(name));
        (plain && !told && check_size(&self.file, bytes, self.reader.metadata()).is_ok()).then(|| self.total())
    }

    /// The rows of all row groups, as the directory claims them.
    fn total(&self) -> usize {
        self.reader.metadata().row_groups().iter().filter_map(|group| usize::try_from(group.num_rows()).ok()).fold(0, usize::saturating_add)
    }

    /// The same file as one piece that holds a single channel, and the time.
    pub fn of_channel(mut self, name: &str) -> Self {
        let time = |own: &str| is_time(own) || self.options.time.as_deref() == Some(own);
        self.columns.retain(|(_, own, _)| [own.as_str(), &split_name(own).0].into_iter().any(|own| own == name || time(own)));
        // Room for all, since a vector that grows is there twice.
        self.kept = self.columns.iter().map(|_| Vec::with_capacity(self.total())).collect();
        self.options.units_elsewhere = true;
        self.rows = usize::MAX;
        self
    }

    /// The next rows; nothing at the end.
    pub fn next_piece(&mut self) -> Result<Option<Piece>, IoError> {
        let file = self.file.clone();
        caught(&file, || self.decode())
    }

    fn decode(&mut self) -> Result<Option<Piece>, IoError> {
        let overlap = self.kept.first().map_or(0, Vec::len);
        let mut values = std::mem::take(&mut self.kept);
        let mut new = 0;
        while new < self.rows && self.advance()? {
            let wanted = self.left.min(self.rows - new);
            for ((column, values), (_, name, kind)) in self.open.iter_mut().zip(&mut values).zip(&self.columns) {
                let damaged = |what: String| IoError::Damaged { file: self.file.clone(), format: PARQUET, what: format!("column \"{name}\"{what}") };
                let read = append(column, *kind, wanted, values).map_err(|e| damaged(format!(": {e}")))?;
                if read != wanted {
                    return Err(damaged(format!(" ends {} rows before row group {} does", wanted - read, self.group)));
                }
            }
            self.left -= wanted;
            new += wanted;
        }
        if new == 0 && self.seen > 0 {
            return require_count(&self.file, self.declared, self.seen).map(|()| None);
        }
        let kept = overlap + new - OVERLAP.min(overlap + new);
        self.kept = values.iter().map(|column| column[kept..].to_vec()).collect();
        let numbers = values.into_iter().zip(&self.columns).map(|(values, (_, name, kind))| Entry {
            unit: kind.unit.map(str::to_owned),
            ..Entry::new(vec![name.clone()], Value::Numbers { shape: vec![values.len()], values, rounding: kind.rounding })
        });
        let mut table = arrays::table(&self.file, numbers.chain(self.others.iter().cloned()).collect())?;
        if let Some(name) = name_time(&mut table, &self.options) {
            self.options.time = Some(name);
        }
        let read = assemble(&self.file, table, &self.options)?;
        let (rate_hz, start_s) = *self.clock.get_or_insert((read.recording.sample_rate_hz(), read.recording.start_s()));
        let timed = self.columns.iter().any(|(_, name, _)| is_time(name) || self.options.time.as_ref() == Some(name));
        let (elapsed_s, own_s) = (self.seen as f64 / rate_hz, read.recording.start_s() + overlap as f64 / read.recording.sample_rate_hz() - start_s);
        if timed && (own_s - elapsed_s).abs() > 0.5 / rate_hz + RATE_AGREEMENT * elapsed_s {
            return Err(irregular(&self.file, Place::Sample(self.seen), own_s - elapsed_s + 1.0 / rate_hz, rate_hz, self.seen));
        }
        let wrap = |source: RecordingError| IoError::Recording { file: self.file.clone(), source };
        let own = if overlap == 0 { read.recording } else { read.recording.slice(overlap..overlap + new).map_err(wrap)? };
        let metadata = own.metadata().clone();
        let recording = Recording::new(rate_hz, own.into_channels()).map_err(wrap)?.starting_at(start_s + self.seen as f64 / rate_hz).with_metadata(metadata);
        let follows = self.seen > 0;
        self.seen += new;
        Ok(Some(Piece { recording, follows, notes: read.notes }))
    }

    /// Goes to the next row group where this one is at its end; false at the end of the file.
    fn advance(&mut self) -> Result<bool, IoError> {
        while self.left == 0 {
            if self.group == self.reader.num_row_groups() {
                return Ok(false);
            }
            let damaged = |e| IoError::Damaged { file: self.file.clone(), format: PARQUET, what: format!("row group {}: {e}", self.group) };
            let rows = self.reader.get_row_group(self.group).map_err(damaged)?;
            self.open = self.columns.iter().map(|(i, ..)| rows.get_column_reader(*i)).collect::<Result<_, _>>().map_err(damaged)?;
            self.left = usize::try_from(rows.metadata().num_rows()).unwrap_or(0);
            self.group += 1;
        }
        Ok(true)
    }
}

#[cfg(test)]
mod tests {
    use crate::{Apart, Pieces, ReadOptions, encode, read};
    use ndof_signal::{Channel, Quantity, Recording, Unit};
    use std::path::PathBuf;

    const NAMES: [&str; 2] = ["force_x", "pos_x"];

    /// A recording of 200 s, in a file.
    fn long() -> (tempfile::TempDir, PathBuf, Recording) {
        let samples = |seed: usize| (0..200_000).map(|k| ((k * seed) % 1009) as f64 - 500.0).collect::<Vec<f64>>();
        let channel = |name: &str, quantity, seed| Channel::new(name, Unit::si(quantity, false), samples(seed));
        let channels = vec![channel("force_x", Quantity::Effort, 7), channel("pos_x", Quantity::Displacement, 31)];
        let whole = Recording::new(1000.0, channels).unwrap().starting_at(2.5);
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("long.parquet");
        std::fs::write(&path, encode(&whole, "long.parquet").unwrap()).unwrap();
        (folder, path, whole)
    }

    #[test]
    fn a_channel_apart_is_the_channel_of_the_whole() {
        let (_folder, path, _) = long();
        let options = ReadOptions::default();
        let whole = read(&path, &options).unwrap().recording;
        let apart = Apart::of(&path, &options).unwrap();
        assert_eq!(apart.samples(), whole.len());
        for name in NAMES {
            let alone = apart.channel(name).unwrap().unwrap().recording;
            assert_eq!(alone.channels(), [whole.channel(name).unwrap().clone()]);
            assert_eq!((alone.sample_rate_hz(), alone.start_s()), (whole.sample_rate_hz(), whole.start_s()));
        }
        assert!(apart.channel("pos_y").is_err());
        assert!(Apart::open(&path, &options).is_none(), "it is short");
    }

    #[test]
    fn the_pieces_of_a_file_are_the_file() {
        let (_folder, path, whole) = long();
        let pieces: Vec<_> = Pieces::open(&path, ReadOptions::default()).unwrap().map(Result::unwrap).collect();
        assert_eq!(pieces.len(), 4);
        for name in NAMES {
            let joined: Vec<f64> = pieces.iter().flat_map(|piece| piece.recording.channel(name).unwrap().samples.clone()).collect();
            assert_eq!(joined, whole.channel(name).unwrap().samples);
        }
        assert!(!pieces[0].follows && pieces[1..].iter().all(|piece| piece.follows));
        assert_eq!(pieces[0].recording.start_s(), 2.5);
        assert!((pieces[2].recording.start_s() - 2.5 - 131.072).abs() < 1e-9);
        let cut = std::fs::read(&path).unwrap();
        std::fs::write(&path, &cut[..cut.len() / 2]).unwrap();
        assert!(Pieces::open(&path, ReadOptions::default()).is_err());
    }
}
