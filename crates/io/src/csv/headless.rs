//! A table without names, read by the numbers of its columns.

use super::cells::{Cell, Separator, split};
use super::head::LOOKED_AT;
use super::header::{Named, separator};
use super::rows::{Line, Rows, lines};
use crate::columns::ColumnsFile;
use crate::error::IoError;
use crate::limits::MAX_CHANNELS;
use crate::recording::Note;
use crate::table::Table;
use crate::timing::RATE_KEY;

/// Reads a table without names. Lines at its beginning that are not as wide as the others, or not numbers, are left out and told.
pub(super) fn read(text: &str, file: &str, columns: &ColumnsFile) -> Result<Table, IoError> {
    let mut lines = lines(text).filter(|line| !line.text.trim_start().is_empty() && !line.text.trim_start().starts_with('#'));
    let first: Vec<Line<'_>> = lines.by_ref().take(LOOKED_AT).collect();
    let Some(last) = first.last() else { return Err(IoError::Empty { file: file.to_owned() }) };
    let separator = match separator(last.text, Some(last.text)) {
        Separator::None => Separator::Spaces,
        separator => separator,
    };
    let width = usual_width(&first, separator);
    if width > MAX_CHANNELS {
        return Err(IoError::too_large(file, "columns", width, MAX_CHANNELS, "split the file; if it has a row for each channel, transpose it"));
    }
    let mut asked: Vec<_> = columns.columns.iter().collect();
    asked.sort_by_key(|(_, column)| column.number);
    if let Some((name, column)) = asked.iter().find(|(_, column)| column.number > width) {
        return Err(IoError::unsuitable(
            file,
            format!("channel {name} is column {}, and a line has {width}", column.number),
            "correct its number in the columns file, or take the one of this robot",
        ));
    }
    let named = asked.iter().map(|(name, column)| Named { name: (*name).clone(), unit: column.unit.clone() }).collect();
    let picked = asked.iter().map(|(_, column)| column.number - 1).collect();
    let mut cells = Vec::new();
    let begin = first.iter().position(|line| cells_of(line, separator, &mut cells) == Some(width)).unwrap_or(first.len());
    let begin_line = first.get(begin).map_or(last.number, |line| line.number);
    let rows = first[begin..].iter().map(|l| Line { ..*l }).chain(lines);
    let mut table = Rows::new(file, named, separator, width, picked).read(rows, begin_line)?;
    if begin > 0 {
        let numbers: Vec<String> = first[..begin].iter().map(|l| l.number.to_string()).collect();
        table.notes.push(Note::new(
            "partial-lines",
            format!("the table begins in line {begin_line}: what stands before (line {}) has not its {width} numbers and is left out", numbers.join(", ")),
            "look at these lines if samples should be in them",
        ));
    }
    if let Some(rate_hz) = columns.sample_rate_hz {
        table.metadata.insert(RATE_KEY.to_owned(), rate_hz.to_string());
    }
    Ok(table)
}

/// The cells of a line where all of them are numbers, or missing ones.
fn cells_of<'l>(line: &Line<'l>, separator: Separator, cells: &mut Vec<Cell<'l>>) -> Option<usize> {
    split(line.text, separator, cells).ok()?;
    while cells.last().is_some_and(|c| c.text.is_empty()) {
        cells.pop();
    }
    cells.iter().any(Cell::is_number).then_some(cells.len())
}

/// The number of cells that most of these lines have; the larger of two as frequent ones.
fn usual_width<'l>(lines: &[Line<'l>], separator: Separator) -> usize {
    let mut cells = Vec::new();
    let mut widths: Vec<usize> = lines.iter().filter_map(|line| cells_of(line, separator, &mut cells)).collect();
    widths.sort_unstable();
    widths.chunk_by(|a, b| a == b).max_by_key(|same| same.len()).and_then(|same| same.first().copied()).unwrap_or(0)
}
