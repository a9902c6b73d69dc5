//! CSV that is still being written: samples as they come.

use super::head::{LOOKED_AT, is_row, is_words};
use super::read::{read_piece, text};
use crate::assemble::{SAMPLES_KEY, assemble, is_time, name_time, require_count};
use crate::csv::header::metadata;
use crate::error::{IoError, Place};
use crate::options::ReadOptions;
use crate::pieces::Piece;
use crate::recording::Note;
use crate::table::Table;
use crate::timing::{RATE_AGREEMENT, irregular, number};
use ndof_signal::{Recording, RecordingError};

/// Rows from which the rate is read where there is a time column: stamps in whole milliseconds then give it to a thousandth.
const FIRST_ROWS: usize = 1000;
/// Rows that are read again with the next ones, so that the step between two pieces is seen among others.
const OVERLAP: usize = 64;
/// Irregular steps among so many rows that are gaps; more of them are a clock that is no clock.
const FEW_GAPS: usize = 3;

/// Reads a CSV recording while it is being written.
///
/// ```
/// use ndof_io::{CsvStream, ReadOptions};
/// let mut stream = CsvStream::new("the robot", ReadOptions::default());
/// assert!(stream.push(b"# sample_rate_hz: 500\nforce_x [N],pos_x [mm]\n1.5,2")?.is_empty(), "no whole row yet");
/// let pieces = stream.push(b".0\n1.25,2.5\n3")?;
/// assert_eq!(pieces[0].recording.channel("pos_x")?.samples, [0.002, 0.0025]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, Default)]
pub struct CsvStream {
    file: String,
    options: ReadOptions,
    /// The file is complete: what a whole read refuses is refused.
    complete: bool,
    /// The samples that a complete file says it has.
    declared: Option<f64>,
    /// Bytes behind the last line end; of a complete file the last line too, which may be all that is new at the end.
    pending: Vec<u8>,
    /// All that comes before the first line of numbers: comments, names, units.
    head: String,
    head_lines: usize,
    /// Its lines that are neither blank nor comments.
    words: usize,
    /// Whether it is whole.
    named: bool,
    timed: bool,
    /// Lines behind the head that are kept: those of the overlap, then those that wait.
    lines: Vec<String>,
    /// Lines behind the head that came before them.
    dropped: usize,
    /// The number of the last line that was handed out.
    last_line: usize,
    /// Rate, once it is known.
    rate_hz: Option<f64>,
    /// Beginning of the stretch and its samples so far.
    stretch: Option<(f64, usize)>,
    /// Samples handed out.
    seen: usize,
    /// Lines behind which a gap was.
    gaps: Vec<usize>,
    /// What the next piece has to tell.
    notes: Vec<Note>,
}

impl CsvStream {
    /// A stream that `file` names in errors; missing samples are kept, and nothing is resampled.
    pub fn new(file: &str, options: ReadOptions) -> Self {
        CsvStream { file: file.to_owned(), options: ReadOptions { allow_nan: true, resample: None, window_s: None, ..options }, ..CsvStream::default() }
    }

    /// A file that is complete, piece by piece: gaps, a wrong count of samples and a cut last line are what they are to a whole read.
    pub(crate) fn of_complete(file: &str, options: ReadOptions) -> Self {
        CsvStream { complete: true, ..CsvStream::new(file, options) }
    }

    /// Takes the next bytes and gives the samples of the lines that are whole.
    ///
    /// # Errors
    /// [`IoError`] as for a whole file.
    pub fn push(&mut self, bytes: &[u8]) -> Result<Vec<Piece>, IoError> {
        self.pending.extend_from_slice(bytes);
        let mut ends = self.pending.iter().enumerate().rev().filter(|(_, b)| **b == b'\n').map(|(at, _)| at);
        let Some(end) = ends.nth(usize::from(self.complete)) else { return Ok(Vec::new()) };
        let rest = self.pending.split_off(end + 1);
        let whole = std::mem::replace(&mut self.pending, rest);
        self.take_lines(&whole)?;
        if self.rate_hz.is_none() && self.lines.len() < FIRST_ROWS {
            // One look tells whether there is a time column, which gives the rate only over many rows.
            let rows = self.rows()?;
            if self.timed || rows.is_none() {
                return Ok(Vec::new());
            }
        }
        self.pieces()
    }

    /// What is left at the end; a line without an end may be cut off and is left out.
    ///
    /// # Errors
    /// [`IoError`] as for a whole file.
    pub fn finish(&mut self) -> Result<Vec<Piece>, IoError> {
        if self.complete {
            let rest = std::mem::take(&mut self.pending);
            self.take_lines(&rest)?;
        }
        if !self.named {
            read_piece(&self.head, &self.file, (0, 0))?;
            self.rows_have_words();
        }
        if !self.named {
            return Err(IoError::HeaderOnly { file: self.file.clone(), line: self.head_lines });
        }
        let pieces = self.pieces()?;
        require_count(&self.file, self.declared, self.seen)?;
        Ok(pieces)
    }

    fn take_lines(&mut self, bytes: &[u8]) -> Result<(), IoError> {
        let text = text(bytes, &self.file, self.head_lines + self.dropped + self.lines.len())?;
        for line in text.split_inclusive('\n') {
            if self.named {
                self.lines.push(line.to_owned());
                continue;
            }
            let words = is_words(line);
            if words && (self.words > 0 && is_row(line.trim_end()) || self.words >= LOOKED_AT) {
                self.rows_have_words();
                self.named = true;
                self.lines.push(line.to_owned());
                continue;
            }
            self.words += usize::from(words);
            // Blank in place of a count that no piece has, so that lines keep their numbers.
            let count = line.trim_start().strip_prefix('#').and_then(metadata).filter(|(key, _)| key == SAMPLES_KEY);
            self.head += if count.is_some() { "#\n" } else { line };
            if let Some((_, text)) = count.filter(|_| self.complete) {
                self.declared = self.declared.or(number(&text));
            }
            self.head_lines += 1;
        }
        Ok(())
    }

    /// Where no line is of numbers alone, but lines behind the names can be read: each of them has a column of words, and is a row.
    fn rows_have_words(&mut self) {
        if self.words < 2 || read_piece(&self.head, &self.file, (0, 0)).map_or(0, |table| table.lines.len()) + 1 < self.words {
            return;
        }
        let lines: Vec<&str> = self.head.split_inclusive('\n').collect();
        let names = lines.iter().position(|line| is_words(line)).map_or(0, |k| k + 1);
        self.lines = lines[names..].iter().map(|line| (*line).to_owned()).collect();
        self.head = lines[..names].concat();
        (self.head_lines, self.words, self.named) = (names, 1, true);
    }

    /// Hands out what waits: more than one piece where there is a gap within.
    fn pieces(&mut self) -> Result<Vec<Piece>, IoError> {
        let mut pieces = Vec::new();
        while let Some(rows) = self.rows()? {
            let until = match self.piece(rows) {
                Ok(piece) => {
                    pieces.extend(piece);
                    break;
                }
                Err(IoError::IrregularTime { place: Place::Line(line), count, .. }) if self.is_gap(line, count) => line,
                Err(error) => return Err(error),
            };
            self.gaps.push(until);
            let behind = self.lines.split_off((until - 1).saturating_sub(self.head_lines + self.dropped));
            match self.rows()? {
                Some(rows) => pieces.extend(self.piece(rows)?),
                None if self.last_line + 1 < until && !self.lines.is_empty() => self.notes.push(Note::new(
                    "sample-timing",
                    format!("the sample before the gap at line {until} stands alone between two gaps and is left out"),
                    "look for lost samples",
                )),
                None => {}
            }
            self.dropped = until - 1 - self.head_lines;
            self.last_line = until - 1;
            self.lines = behind;
            self.stretch = None;
        }
        Ok(pieces)
    }

    /// Whether an irregular step, one of `count` among the kept lines, is a gap in a clock that is one otherwise.
    fn is_gap(&self, line: usize, count: usize) -> bool {
        let often = self.gaps.len() >= FEW_GAPS && line.saturating_sub(self.gaps[self.gaps.len() - FEW_GAPS]) < OVERLAP;
        !self.complete && !often && (self.rate_hz.is_some() || count <= FEW_GAPS)
    }

    /// The lines that are kept as a table, if it has rows that were not handed out and enough to tell the time.
    fn rows(&mut self) -> Result<Option<Table>, IoError> {
        if self.lines.is_empty() {
            return Ok(None);
        }
        let text = self.head.clone() + &self.lines.concat();
        let mut table = match read_piece(&text, &self.file, (self.head_lines, self.dropped)) {
            Err(IoError::HeaderOnly { .. }) => return Ok(None),
            table => table?,
        };
        if let Some(name) = name_time(&mut table, &self.options) {
            self.options.time = Some(name);
        }
        self.timed = table.columns.iter().any(|c| is_time(&c.name));
        let new = table.lines.iter().any(|line| *line > self.last_line);
        Ok((new && (table.lines.len() > 1 || !self.timed)).then_some(table))
    }

    fn piece(&mut self, table: Table) -> Result<Option<Piece>, IoError> {
        let lines = table.lines.clone();
        let first = lines.iter().position(|line| *line > self.last_line).unwrap_or(lines.len());
        let read = assemble(&self.file, table, &self.options)?;
        let rate_hz = *self.rate_hz.get_or_insert(read.recording.sample_rate_hz());
        let wrap = |source: RecordingError| IoError::Recording { file: self.file.clone(), source };
        let own = read.recording.slice(first..lines.len()).map_err(wrap)?;
        let start_s = if self.timed { own.start_s() } else { read.recording.start_s() + self.seen as f64 / rate_hz };
        let follows = self.stretch.is_some_and(|(begin_s, count)| {
            let elapsed_s = count as f64 / rate_hz;
            (start_s - begin_s - elapsed_s).abs() <= 0.5 / rate_hz + RATE_AGREEMENT * elapsed_s
        });
        if self.complete && !follows && self.seen > 0 {
            let (begin_s, count) = self.stretch.unwrap_or((start_s, 0));
            let place = Place::Line(lines.get(first).copied().unwrap_or(self.last_line));
            return Err(irregular(&self.file, place, start_s - begin_s - (count as f64 - 1.0) / rate_hz, rate_hz, self.seen));
        }
        self.stretch = match self.stretch.filter(|_| follows) {
            Some((begin_s, count)) => Some((begin_s, count + own.len())),
            None => Some((start_s, own.len())),
        };
        self.seen += own.len();
        self.last_line = lines.last().copied().unwrap_or(self.last_line);
        let surplus = self.lines.len().saturating_sub(OVERLAP);
        self.dropped += surplus;
        self.lines.drain(..surplus);
        let recording = Recording::new(rate_hz, own.channels().to_vec()).map_err(wrap)?.starting_at(start_s).with_metadata(own.metadata().clone());
        let notes = self.notes.drain(..).chain(read.notes).collect();
        Ok(Some(Piece { recording, follows, notes }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fmt::Write;

    fn text(rows: std::ops::Range<usize>) -> String {
        rows.fold(String::new(), |mut text, k| {
            writeln!(text, "{:.3},{},{}", k as f64 * 0.002, k % 7, k).unwrap();
            text
        })
    }

    fn all(text: &str, size: usize) -> Result<Vec<Piece>, IoError> {
        all_by(text, size, ReadOptions::default())
    }

    fn all_by(text: &str, size: usize, options: ReadOptions) -> Result<Vec<Piece>, IoError> {
        let mut stream = CsvStream::new("live", options);
        let mut pieces = Vec::new();
        for bytes in text.as_bytes().chunks(size) {
            pieces.extend(stream.push(bytes)?);
        }
        pieces.extend(stream.finish()?);
        Ok(pieces)
    }

    #[test]
    fn pieces_of_any_size_are_the_file() {
        let file = format!("t [s],force_x [N],pos_x [mm]\n{}", text(0..3000));
        let whole = crate::read_bytes(file.as_bytes(), "live.csv", &ReadOptions::default()).unwrap().recording;
        for size in [1, 17, 4096, 1 << 20] {
            let pieces = all(&file, size).unwrap();
            let samples: Vec<f64> = pieces.iter().flat_map(|p| p.recording.channel("pos_x").unwrap().samples.clone()).collect();
            assert_eq!(samples, whole.channel("pos_x").unwrap().samples, "{size}");
            assert!(pieces.iter().skip(1).all(|p| p.follows) && !pieces[0].follows, "{size}");
            assert!(pieces.iter().all(|p| p.recording.sample_rate_hz() == 500.0), "{size}");
        }
    }

    /// Its later pieces are not looked at anew.
    #[test]
    fn the_time_of_a_stream_is_the_column_that_its_beginning_tells() {
        let rows = text(0..3000);
        let own = all(&format!("t [s],force_x [N],pos_x [mm]\n{rows}"), 4096).unwrap();
        let told = ReadOptions { units: [("Zeit".to_owned(), "s".to_owned())].into(), ..Default::default() };
        let seen = all(&format!("Zeit [s],force_x [N],pos_x [mm]\n{rows}"), 4096).unwrap();
        for other in [seen, all_by(&format!("Zeit,force_x [N],pos_x [mm]\n{rows}"), 4096, told).unwrap()] {
            assert!(own.len() > 1 && own.len() == other.len());
            for (own, other) in own.iter().zip(&other) {
                assert_eq!((own.recording.names(), own.recording.start_s()), (other.recording.names(), other.recording.start_s()));
            }
        }
    }

    #[test]
    fn a_stream_knows_what_stands_before_and_below_its_names() {
        let (rows, plain) = (text(0..3000), "t [s],force_x [N],pos_x [mm]\n");
        let own = all(&format!("{plain}{rows}"), 4096).unwrap();
        let quoted: String = (0..100).map(|k| format!("\"{:.3}\",\"{k}\"\n", f64::from(k) * 0.002)).collect();
        assert_eq!(all(&format!("t [s],force_x [N]\n{quoted}"), 64).unwrap().iter().map(|p| p.recording.len()).sum::<usize>(), 100);
        for size in [1, 4096] {
            let other = all(&format!("Robot 3,,\nDate: today,,\n,,\nt,force_x,pos_x\ns,N,mm\n{rows}"), size).unwrap();
            let count = |pieces: &[Piece]| pieces.iter().map(|p| p.recording.len()).sum::<usize>();
            assert_eq!((count(&other), other[0].recording.channels()[1].unit.symbol()), (count(&own), "m"));
            assert!(other[0].notes.iter().any(|n| n.code == "preamble") && other[0].notes.iter().any(|n| n.code == "units-row"));
        }
    }

    #[test]
    fn a_gap_begins_a_new_stretch_and_no_sample_is_lost() {
        for (size, gap) in [(64, 2000), (1 << 20, 2000), (1 << 20, 1500), (999, 1001)] {
            let file = format!("t [s],force_x [N],pos_x [m]\n{}{}", text(0..gap), text(gap + 5..3000));
            let pieces = all(&file, size).unwrap();
            let starts: Vec<f64> = pieces.iter().filter(|p| !p.follows).map(|p| p.recording.start_s()).collect();
            assert_eq!(starts.len(), 2, "{size} {gap}: {starts:?}");
            assert!((starts[1] - (gap + 5) as f64 * 0.002).abs() < 1e-9, "{size} {gap}: {starts:?}");
            assert_eq!(pieces.iter().map(|p| p.recording.len()).sum::<usize>(), 2995, "{size} {gap}");
        }
    }

    #[test]
    fn a_complete_file_is_held_to_what_a_whole_read_asks() {
        let complete = |text: &str| {
            let mut stream = CsvStream::of_complete("whole.csv", ReadOptions::default());
            let mut pieces = stream.push(text.as_bytes())?;
            pieces.extend(stream.finish()?);
            Ok(pieces)
        };
        let head = "t [s],force_x [N],pos_x [mm]\n";
        let gap = format!("{head}{}{}", text(0..2000), text(2005..3000));
        assert!(matches!(complete(&gap), Err(IoError::IrregularTime { place: Place::Line(2002), .. })), "{:?}", complete(&gap));
        let drifted = (0..5000).fold(format!("# samples: 5000\n{head}"), |mut text, k| {
            writeln!(text, "{:.6},1,2", k as f64 * 0.002 + if k < 1500 { 0.0 } else { (k - 1500) as f64 * 1e-5 }).unwrap();
            text
        });
        assert!(matches!(complete(&drifted), Err(IoError::IrregularTime { .. })));
        let counted = format!("# samples: 3000\n{head}{}", text(0..2999));
        assert!(matches!(complete(&counted), Err(IoError::SampleCount { found: 2999, .. })));
        let unended = complete(format!("{head}{}", text(0..3000)).trim_end()).unwrap();
        assert_eq!(unended.iter().map(|piece| piece.recording.len()).sum::<usize>(), 2999);
        assert_eq!(unended.last().unwrap().notes[0].code, "unterminated-line");
    }

    /// 3000 rows of which every second one is late from `from` on.
    fn jittered(from: usize) -> String {
        (0..3000).fold("t [s],force_x [N]\n".to_owned(), |mut text, k| {
            writeln!(text, "{},1", k as f64 * 0.002 + if k < from || k % 2 == 0 { 0.0 } else { 0.0007 }).unwrap();
            text
        })
    }

    #[test]
    fn jitter_behind_a_good_beginning_is_no_series_of_gaps() {
        for size in [64, 1 << 20] {
            assert!(matches!(all(&jittered(2000), size), Err(IoError::IrregularTime { .. })), "{size}");
        }
    }

    #[test]
    fn a_clock_that_is_none_and_text_are_refused_with_their_line() {
        assert!(matches!(all(&jittered(0), 100), Err(IoError::IrregularTime { .. })));
        let wrong = format!("t [s],force_x [N],pos_x [m]\n{}3,oops,1\n", text(0..2000));
        assert!(all(&wrong, 100).unwrap_err().to_string().contains("line 2002"), "{}", all(&wrong, 100).unwrap_err());
        assert!(matches!(all("t,a\n", 100), Err(IoError::HeaderOnly { .. })));
        assert!(matches!(all("", 100), Err(IoError::Empty { .. })));
    }
}
