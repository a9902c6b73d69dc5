//! Where the names stand: in the first line, or behind what a laboratory's program says of itself; and the row of units below them.

use super::cells::{Cell, Separator, split};
use super::header::separator;
use super::rows::{Line, is_missing};
use ndof_signal::Unit;

/// Lines that tell how a file begins: what laboratories' programs write before the numbers is shorter, and of a log that was begun in the middle of a line one
/// or two are.
pub(super) const LOOKED_AT: usize = 64;

/// The beginning of a file's lines.
#[derive(Debug, Default, PartialEq, Eq)]
pub(super) struct Head {
    /// Lines before that of the names.
    pub before: usize,
    /// The unit of each column, of a row below the names.
    pub units: Vec<String>,
}

impl Head {
    /// Of lines that are neither blank nor comments: the first has the names if it has one for each number of the first line of numbers, else the last line of
    /// words before that, if it has; units may stand between. What fits nowhere is left to the reader, which says so.
    pub fn of<'l>(lines: impl Iterator<Item = &'l Line<'l>>) -> Self {
        let lines: Vec<&str> = lines.map(|line| line.text).collect();
        let alike = |k: usize| lines.get(k + 1).is_none_or(|next| is_numbers(next) && cells(next, next).len() == cells(lines[k], lines[k]).len());
        let Some(first) = (1..lines.len()).find(|&k| is_numbers(lines[k]) && alike(k)) else { return Head::default() };
        let units_of = |names: usize| if first == names + 2 { units(lines[names], lines[names + 1], lines[first]) } else { None };
        let with_units = [0].into_iter().chain((first >= 3).then(|| first - 2)).find_map(|names| units_of(names).map(|units| Head { before: names, units }));
        with_units.unwrap_or_else(|| {
            let behind = first > 1 && !fits(lines[0], lines[first]) && fits(lines[first - 1], lines[first]);
            let before = if behind { first - 1 } else { 0 };
            Head { before, units: Vec::new() }
        })
    }
}

/// A line's cells between the signs of a row of numbers, without empty ones at the end.
fn cells<'l>(line: &'l str, row: &str) -> Vec<Cell<'l>> {
    let mut cells = Vec::new();
    let separator = match separator(row, Some(row)) {
        sign @ Separator::Sign(_) => sign,
        _ => separator(line, Some(row)),
    };
    if split(line, separator, &mut cells).is_err() {
        return Vec::new();
    }
    while cells.len() > 1 && cells.last().is_some_and(|c| c.text.is_empty()) {
        cells.pop();
    }
    cells
}

/// Whether a line says something: it is not blank, no comment, and not where a spreadsheet names its separator.
pub(super) fn is_words(line: &str) -> bool {
    !line.trim().is_empty() && !line.trim_start().starts_with('#') && !line.starts_with("sep=")
}

/// Whether a line has nothing but numbers and what stands for missing ones.
pub(super) fn is_row(line: &str) -> bool {
    let cells = cells(line, line);
    cells.iter().any(|c| !c.text.is_empty()) && cells.iter().all(|c| c.is_number() || is_missing(&c.text))
}

/// Whether one of them at least is a number.
fn is_numbers(line: &str) -> bool {
    is_row(line) && cells(line, line).iter().any(|c| c.is_number() && !is_missing(&c.text))
}

/// Whether a line of words has a name for each number of another.
fn fits(names: &str, row: &str) -> bool {
    let names = cells(names, row);
    names.len() == cells(row, row).len() && names.iter().all(|c| !c.text.is_empty() && (c.quoted || !c.is_number()))
}

/// The units in the line between names and numbers, of which one at least is one of mechanics.
fn units(names: &str, line: &str, row: &str) -> Option<Vec<String>> {
    let found: Vec<String> = cells(line, row).iter().map(|c| c.text.trim_matches(['[', ']', '(', ')']).trim().to_owned()).collect();
    let all = fits(names, row) && found.len() <= cells(row, row).len() && !cells(line, row).iter().any(Cell::is_number);
    (all && found.iter().any(|unit| Unit::parse(unit).is_ok())).then_some(found)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn head(text: &str) -> (usize, Vec<String>) {
        let lines: Vec<Line<'_>> = text.lines().enumerate().map(|(i, text)| Line { number: i + 1, text, terminated: true }).collect();
        let Head { before, units } = Head::of(lines.iter());
        (before, units)
    }

    #[test]
    fn names_are_in_the_first_line_that_fits_the_numbers() {
        let units = |u: &[&str]| u.iter().map(|u| (*u).to_owned()).collect::<Vec<_>>();
        assert_eq!(head("t,force\n0,1\n"), (0, vec![]));
        assert_eq!(head("t,force\ns,N\n0,1\n"), (0, units(&["s", "N"])));
        assert_eq!(head("Robot 3\nDate;today;;\nt;force\n[s];[N]\n0,5;1\n"), (2, units(&["s", "N"])));
        assert_eq!(head("Robot 3\nRate: 500\nt\tforce\n0\tnan\n"), (2, vec![]));
        assert_eq!(head("Robot 3\nt force\n0 1\n"), (1, vec![]));
        // Words among the numbers are an error, not names.
        assert_eq!(head("t,force\noops,1\n0,1\n"), (0, vec![]));
        assert_eq!(head("t,force\nx,y\n0,1\n"), (0, vec![]));
        assert_eq!(head("force\nN\n1\n"), (0, units(&["N"])));
        // Of one column a title cannot be told from a name; a number by itself is no row.
        assert_eq!(head("Robot\nforce\n1\n"), (0, vec![]));
        assert_eq!(head("Robot\n500\nt,force\n0,1\n1,2\n"), (2, vec![]));
        assert_eq!(head("words\nwithout numbers\n"), (0, vec![]));
    }
}
