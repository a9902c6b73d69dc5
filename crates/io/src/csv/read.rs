//! What stands before the names, a line of names, perhaps one of units, then lines of numbers.

use super::cells::{Separator, split};
use super::head::{Head, LOOKED_AT};
use super::header::{Named, metadata, names, separator};
use super::rows::{Line, Rows, is_missing, lines};
use crate::assemble::is_time;
use crate::error::{IoError, listed};
use crate::recording::Note;
use crate::table::Table;
use std::collections::BTreeMap;

/// Reads a piece of a CSV file: its head, then lines of which `skipped` come behind the first `head` lines in the file.
pub(crate) fn read_piece(text: &str, file: &str, (head, skipped): (usize, usize)) -> Result<Table, IoError> {
    let mut facts = BTreeMap::new();
    let mut lines = lines(text).filter_map(|Line { number, text, terminated }| {
        if let Some(comment) = text.trim_start().strip_prefix('#').filter(|_| !text.trim_start().starts_with("#N/A")) {
            if let Some((key, value)) = metadata(comment) {
                facts.entry(key).or_insert(value);
            }
            return None;
        }
        // Spreadsheets name their separator in a line of its own; it shows in the header too.
        let is_directive = number == 1 && text.trim().len() <= 5 && text.starts_with("sep=");
        let number = if number <= head { number } else { number + skipped };
        (!is_directive).then_some(Line { number, text, terminated })
    });
    let first: Vec<Line<'_>> = lines.by_ref().take(LOOKED_AT).collect();
    let Head { before, units } = Head::of(first.iter().filter(|line| !line.text.trim().is_empty()));
    let looked_at: Vec<(usize, &str)> = first.iter().map(|line| (line.number, line.text)).collect();
    let mut lines = first.into_iter().chain(lines).peekable();
    let mut words = lines.by_ref().filter(|line| !line.text.trim().is_empty());
    let left_out: Vec<usize> = words.by_ref().take(before).map(|line| line.number).collect();
    let Some(header) = words.next() else {
        return Err(IoError::Empty { file: file.to_owned() });
    };
    let below = (!units.is_empty()).then(|| words.next()).flatten();
    while lines.next_if(|l| l.text.trim().is_empty()).is_some() {}
    let separator = separator(header.text, lines.peek().map(|l| l.text));
    let mut named = names(file, header.number, header.text, separator)?;
    for (column, unit) in named.iter_mut().zip(units).filter(|(_, unit)| !unit.is_empty()) {
        column.unit.get_or_insert(unit);
    }
    let behind = below.as_ref().map_or(header.number, |line| line.number);
    let of_words = of_words(looked_at.iter().filter(|(number, _)| *number > behind).map(|(_, text)| *text), separator, &named);
    let width = named.len();
    let picked: Vec<usize> = (0..width).filter(|column| !of_words.contains(column)).collect();
    let names_of_words: Vec<String> = of_words.iter().map(|column| named[*column].name.clone()).collect();
    let named = named.into_iter().enumerate().filter(|(column, _)| picked.contains(column)).map(|(_, named)| named).collect();
    let mut rows = Rows::new(file, named, separator, width, picked);
    // Where the first of them stands in the text; those behind it have the numbers that follow.
    let first = lines.peek().filter(|line| skipped == 0 || line.number > head).map(|line| (line.text.as_ptr() as usize - text.as_ptr() as usize, line.number));
    let plain = first.is_some_and(|(begin, number)| rows.push_plain(&text[begin..], number));
    let mut table = if plain { rows.finish(header.number)? } else { rows.read(lines, header.number)? };
    if let (Some(from), Some(to)) = (left_out.first(), left_out.last()) {
        let which = if from == to { format!("line {from} stands") } else { format!("lines {from} to {to} stand") };
        let message = format!("{which} before the names in line {}: left out", header.number);
        table.notes.push(Note::new("preamble", message, "begin lines that are no numbers with #, and facts with # key: value"));
    }
    if !names_of_words.is_empty() {
        let message = format!("{} holds words: left out", listed(&names_of_words));
        table.notes.push(Note::new("words", message, "write numbers, if it is a signal"));
    }
    if let Some(line) = below {
        let message = format!("line {} below the names is taken as their units", line.number);
        table.notes.push(Note::new("units-row", message, "write units beside the names, such as `force_x [N]`, if it is none"));
    }
    Ok(Table { metadata: facts, ..table })
}

/// Columns that hold words in all of these rows, and are none of times; none where no column would be left.
fn of_words<'l>(rows: impl Iterator<Item = &'l str>, separator: Separator, named: &[Named]) -> Vec<usize> {
    let mut cells = Vec::new();
    let mut open: Vec<usize> = (0..named.len()).filter(|column| !is_time(&named[*column].name)).collect();
    let mut seen = vec![false; named.len()];
    for row in rows.filter(|row| !row.trim().is_empty()) {
        if split(row, separator, &mut cells).is_err() || cells.len() != named.len() {
            continue;
        }
        seen.iter_mut().zip(&cells).for_each(|(seen, cell)| *seen |= cell.is_words());
        open.retain(|column| cells[*column].is_words() || is_missing(&cells[*column].text));
    }
    open.retain(|column| seen[*column]);
    if open.len() < named.len() { open } else { Vec::new() }
}

/// The text of what comes behind `lines` lines of a file.
pub(crate) fn text<'a>(bytes: &'a [u8], file: &str, lines: usize) -> Result<&'a str, IoError> {
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").filter(|_| lines == 0).unwrap_or(bytes);
    std::str::from_utf8(bytes).map_err(|e| {
        let at = e.valid_up_to();
        let line = lines + 1 + bytes[..at].iter().filter(|&&b| b == b'\n').count();
        IoError::NotUtf8 { file: file.to_owned(), line, byte: bytes[at] }
    })
}
