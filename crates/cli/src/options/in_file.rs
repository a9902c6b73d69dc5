//! A long recording that is not read into memory.

use super::{Channels, Reading};
use ndof_analysis::ApartRecording;
use ndof_io::{Apart, Note, Piece};
use ndof_signal::Recording;
use std::path::PathBuf;

/// A recording in its file, and how it is read.
pub struct InFile<'a> {
    pub name: String,
    file: Apart,
    reading: &'a Reading,
}

impl Reading {
    /// The only file, if it is long, its channels can be read one by one, and no option needs them together.
    pub fn in_file(&self, files: &[PathBuf]) -> Option<InFile<'_>> {
        let [path] = files else { return None };
        let Channels { sample_rate, reference, input, output, negate, .. } = self.channels.clone();
        let alone = Reading { channels: Channels { sample_rate, reference, input, output, negate, channels: None }, ..Reading::default() };
        if *self != alone {
            return None;
        }
        Some(InFile { name: path.display().to_string(), file: Apart::open(path, &self.channels.reading())?, reading: self })
    }
}

impl ApartRecording for InFile<'_> {
    fn samples(&self) -> usize {
        self.file.samples()
    }

    fn channel(&self, name: &str) -> Option<Recording> {
        let mut recording = self.file.channel(name).ok()??.recording;
        if self.reading.channels.negate.iter().any(|turned| turned == name) {
            recording.map_channel(name, |sample| -sample).ok()?;
        }
        Some(recording)
    }

    fn pieces(&self) -> impl Iterator<Item = Option<(Recording, Vec<Note>)>> + Send {
        self.file.pieces().ok().into_iter().flatten().map(|piece| {
            let Piece { mut recording, notes, .. } = piece.ok()?;
            self.reading.channels.apply(&mut recording, &self.name).ok()?;
            Some((recording, notes))
        })
    }
}
