//! Lines of numbers into columns.

use super::cells::{Cell, Separator, digits, split};
use super::header::Named;
use super::plain;
use crate::assemble::is_time;
use crate::error::{IoError, Place};
use crate::recording::Note;
use crate::table::{Column, Rounding, Table};
use std::borrow::Cow;

/// What people and programs write where a sample is missing.
const MISSING: [&str; 9] = ["nan", "na", "n/a", "#n/a", "null", "none", "-", "--", "?"];

/// Whether a cell says that its sample is missing.
pub(super) fn is_missing(text: &str) -> bool {
    text.is_empty() || (text.len() <= 4 && MISSING.iter().any(|m| text.eq_ignore_ascii_case(m)))
}

/// One line of the text.
pub(super) struct Line<'a> {
    pub number: usize,
    pub text: &'a str,
    pub terminated: bool,
}

/// The lines of a text, which may end with a carriage return alone.
pub(super) fn lines(text: &str) -> impl Iterator<Item = Line<'_>> {
    let end = if text.contains('\n') { '\n' } else { '\r' };
    text.split_inclusive(end).enumerate().map(move |(i, line)| Line {
        number: i + 1,
        text: line.trim_end_matches(['\n', '\r']),
        terminated: line.ends_with(end),
    })
}

/// Columns that grow line by line.
#[derive(Default)]
pub(super) struct Rows<'a> {
    file: &'a str,
    separator: Separator,
    /// Cells of a line.
    width: usize,
    /// Which of them are read, in the order of the columns.
    picked: Vec<usize>,
    columns: Vec<Column>,
    lines: Vec<usize>,
    time: Option<usize>,
    decimals: u32,
    significant: u32,
    first_comma: Option<usize>,
    first_point: Option<usize>,
    empty_row: Option<usize>,
}

impl<'a> Rows<'a> {
    /// Columns for the cells `picked` of lines of `width`.
    pub fn new(file: &'a str, named: Vec<Named>, separator: Separator, width: usize, picked: Vec<usize>) -> Self {
        let time = named.iter().position(|n| is_time(&n.name));
        let columns = named.into_iter().map(|n| Column { name: n.name, unit: n.unit, ..Default::default() }).collect();
        Rows { file, separator, width, picked, columns, time, ..Rows::default() }
    }

    /// Keeps the numbers of `text`, whose first line has `number`, if all its lines are plain; whether they were.
    pub fn push_plain(&mut self, text: &str, number: usize) -> bool {
        let Some(plain) = plain::read(text, self.separator, self.width, self.time) else { return false };
        self.columns.iter_mut().zip(plain.columns).for_each(|(column, samples)| column.samples = samples);
        self.lines = (number..number + plain.count).collect();
        (self.decimals, self.significant) = plain.digits;
        true
    }

    /// Takes a line apart and keeps its numbers.
    pub fn push<'l>(&mut self, line: &Line<'l>, cells: &mut Vec<Cell<'l>>) -> Result<(), IoError> {
        split(line.text, self.separator, cells).map_err(|_| IoError::OpenQuote { file: self.file.to_owned(), line: line.number })?;
        let expected = self.width;
        if line.text.trim().is_empty() && expected > 1 {
            return Ok(());
        }
        // With one column a blank line may be a lost sample.
        if cells.iter().all(|c| c.text.is_empty()) {
            self.empty_row.get_or_insert(line.number);
            return Ok(());
        }
        if let Some(number) = self.empty_row {
            return Err(self.ragged(number, 0, true));
        }
        while cells.len() > expected && cells.last().is_some_and(|c| c.text.is_empty()) {
            cells.pop();
        }
        if cells.len() != expected {
            return Err(self.ragged(line.number, cells.len(), line.terminated));
        }
        self.lines.push(line.number);
        for i in 0..self.picked.len() {
            let value = self.number(&cells[self.picked[i]].text, i, line.number)?;
            self.columns[i].samples.push(value);
        }
        Ok(())
    }

    fn ragged(&self, line: usize, found: usize, terminated: bool) -> IoError {
        let expected = self.width;
        let file = self.file.to_owned();
        if !terminated && found < expected {
            return IoError::CutOff { file, line };
        }
        let hint = if found > expected && self.separator == Separator::Sign(',') {
            "if commas are decimal signs here, write points, or separate the columns by semicolons; else name every column".to_owned()
        } else if found > expected {
            "name every column in the header".to_owned()
        } else {
            "fill in what is missing (NaN for a lost sample), or delete the line".to_owned()
        };
        IoError::Ragged { file, line, expected, found, hint }
    }

    fn number(&mut self, text: &str, column: usize, line: usize) -> Result<f64, IoError> {
        if is_missing(text) {
            return Ok(f64::NAN);
        }
        let comma = text.contains(',');
        if comma {
            self.first_comma.get_or_insert(line);
        } else if text.contains('.') {
            self.first_point.get_or_insert(line);
        }
        let written: Cow<'_, str> = if comma { text.replacen(',', ".", 1).into() } else { text.into() };
        let allowed = !comma || matches!(self.separator, Separator::Sign(';' | '\t') | Separator::Spaces);
        let value = if allowed { written.parse::<f64>().ok() } else { None };
        let hint = match value {
            Some(value) => match (self.first_comma, self.first_point) {
                (Some(comma), Some(point)) => {
                    format!("line {comma} has a decimal comma and line {point} a decimal point; write all numbers alike, without signs between thousands")
                }
                _ => {
                    if self.time == Some(column) {
                        let (decimals, significant) = digits(&written);
                        self.decimals = self.decimals.max(decimals);
                        self.significant = self.significant.max(significant);
                    }
                    return Ok(value);
                }
            },
            None if comma && self.separator != Separator::None && text.contains('.') => "write it without signs between thousands".to_owned(),
            None if comma => "write a decimal point, or separate the columns by semicolons".to_owned(),
            None if self.time == Some(column) => "write the seconds since the beginning, such as 0.002".to_owned(),
            None => "write a number, or NaN for a lost sample; a line of text has to begin with #".to_owned(),
        };
        let shown: String = text.chars().take(40).map(|c| if c.is_control() { '\u{fffd}' } else { c }).collect();
        Err(IoError::NotANumber { file: self.file.to_owned(), place: Place::Line(line), channel: self.columns[column].name.clone(), text: shown, hint })
    }

    /// The table of these lines. The last number of a line without an end may be cut short, "12" instead of "12.5": nothing shows it.
    pub fn read<'l>(mut self, lines: impl Iterator<Item = Line<'l>>, header: usize) -> Result<Table, IoError> {
        let (mut unterminated, mut cells, file) = (None, Vec::new(), self.file);
        for line in lines {
            if !line.terminated {
                unterminated = Some(line.number);
            }
            self.push(&line, &mut cells)?;
        }
        let mut table = self.finish(header)?;
        let Some(line) = unterminated.filter(|line| table.lines.last() == Some(line)) else { return Ok(table) };
        table.lines.pop();
        table.columns.iter_mut().for_each(|c| {
            c.samples.pop();
        });
        if table.lines.is_empty() {
            return Err(IoError::CutOff { file: file.to_owned(), line });
        }
        table.notes.push(Note::new(
            "unterminated-line",
            format!("line {line}, the last, has no line end, so that its last number may be cut off; this sample is left out"),
            "end the last line if the file is complete, else copy the file again",
        ));
        Ok(table)
    }

    /// The table; `header` is the line of names.
    pub fn finish(mut self, header: usize) -> Result<Table, IoError> {
        if self.lines.is_empty() {
            return Err(IoError::HeaderOnly { file: self.file.to_owned(), line: header });
        }
        let mut notes = Vec::new();
        if self.first_comma.is_some() {
            notes.push(Note::new("decimal-comma", "commas were read as decimal signs", "write decimal points if they separate thousands"));
        }
        if let Some(line) = self.empty_row {
            notes.push(Note::new("empty-rows", format!("empty lines from line {line} to the end were left out"), "delete these lines"));
        }
        if let Some(i) = self.time {
            self.columns[i].rounding = Rounding { place: 10f64.powi(-(self.decimals as i32)), significant: self.significant, ..Default::default() };
        }
        Ok(Table { columns: self.columns, lines: self.lines, notes, ..Default::default() })
    }
}
