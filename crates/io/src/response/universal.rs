//! Universal File 58: functions of modal analysis, in ASCII or (58b) with binary numbers.
//!
//! Read are frequency responses (type 4) and coherences (type 6), one a pair of response and reference, whose names are node and
//! direction (`7_z`). After "Universal file formats for modal analysis testing", SDRC, University of Cincinnati.

use super::bins::{MAX_VALUES, Pair, response};
use super::table::ResponseTable;
use super::touchstone::left_out;
use crate::cursor::Cursor;
use crate::error::IoError;
use crate::recording::Note;
use num_complex::Complex;
use std::fmt::Write;

/// The format's name in messages.
const UNIVERSAL: &str = "Universal File 58";

/// Lines before the numbers.
const HEAD: usize = 11;

/// Bytes that tell such a file from others.
const LOOKED_AT: usize = 4096;

/// Types of functions.
const RESPONSE: i64 = 4;
const COHERENCE: i64 = 6;

/// Directions by their numbers.
const DIRECTIONS: [&str; 7] = ["", "x", "y", "z", "rx", "ry", "rz"];

/// What the fifth line says of a response that was written here.
const OWN: &str = "ndof: ";

/// Whether it begins as a universal file of type 58.
pub(super) fn is(bytes: &[u8]) -> bool {
    let mut lines = Lines { rest: &bytes[..bytes.len().min(LOOKED_AT)] };
    let first = std::iter::from_fn(|| lines.next()).find(|line| !line.trim().is_empty());
    first.is_some_and(|line| line.trim() == "-1") && lines.next().is_some_and(|line| line.trim_start().starts_with("58"))
}

/// Lines of a file that is not text everywhere.
struct Lines<'a> {
    rest: &'a [u8],
}

impl<'a> Lines<'a> {
    fn next(&mut self) -> Option<std::borrow::Cow<'a, str>> {
        if self.rest.is_empty() {
            return None;
        }
        let end = self.rest.iter().position(|&b| b == b'\n').unwrap_or(self.rest.len());
        let line = &self.rest[..end];
        self.rest = self.rest.get(end + 1..).unwrap_or_default();
        Some(String::from_utf8_lossy(line.strip_suffix(b"\r").unwrap_or(line)))
    }
}

/// One function of a file.
struct Function {
    kind: i64,
    pair: Pair,
    frequency_hz: Vec<f64>,
}

/// Reads the responses of a universal file.
pub(super) fn read(bytes: &[u8], file: &str) -> Result<ResponseTable, IoError> {
    let damaged = |what: String| IoError::Damaged { file: file.to_owned(), format: UNIVERSAL, what };
    let mut lines = Lines { rest: bytes };
    let mut functions = Vec::new();
    while let Some(line) = lines.next() {
        if line.trim() != "-1" {
            continue;
        }
        let Some(head) = lines.next() else { break };
        if head.trim_start().starts_with("58") {
            let number = functions.len() + 1;
            functions.extend(function(&head, &mut lines).map_err(|what| damaged(format!("function {number}: {what}")))?);
        }
        while lines.next().is_some_and(|line| line.trim() != "-1") {}
    }
    let (responses, others): (Vec<Function>, Vec<Function>) = functions.into_iter().partition(|f| f.kind == RESPONSE);
    let Some(frequency_hz) = responses.first().map(|f| f.frequency_hz.clone()) else {
        return Err(IoError::unsuitable(
            file,
            "there is no frequency response (function type 4) in it",
            "export the responses; time histories are read from CSV or MAT",
        ));
    };
    if let Some(other) = responses.iter().find(|f| f.frequency_hz != frequency_hz) {
        let (what, remedy) =
            (format!("\"{}\" has other frequencies than the first response", other.pair.output), "export responses of one measurement".to_owned());
        return Err(IoError::Unsuitable { file: file.to_owned(), what, remedy });
    }
    let mut pairs: Vec<Pair> = responses.into_iter().map(|f| f.pair).collect();
    for coherence in others.into_iter().filter(|f| f.kind == COHERENCE && f.frequency_hz == frequency_hz) {
        if let Some(pair) = pairs.iter_mut().find(|p| p.output == coherence.pair.output && p.input == coherence.pair.input) {
            pair.coherence = Some(coherence.pair.values.iter().map(|v| v.re).collect());
        }
    }
    response(frequency_hz, pairs).map_err(damaged)
}

/// The text of some columns, and the whole number in it.
fn field(line: &str, columns: std::ops::Range<usize>) -> &str {
    let end = columns.end.min(line.len());
    line.get(columns.start.min(end)..end).unwrap_or_default().trim()
}

fn whole(line: &str, columns: std::ops::Range<usize>) -> i64 {
    field(line, columns).parse().unwrap_or(0)
}

/// Reads one function; nothing where it is of another kind.
fn function(head: &str, lines: &mut Lines<'_>) -> Result<Option<Function>, String> {
    let binary = head.trim_start().starts_with("58b");
    let mut records = Vec::with_capacity(HEAD);
    for _ in 0..HEAD {
        records.push(lines.next().ok_or("it ends in its first lines")?.into_owned());
    }
    let (about, form) = (&records[5], &records[6]);
    let kind = whole(about, 0..5);
    let (ordinate, count, even) = (whole(form, 0..10), whole(form, 10..20), whole(form, 20..30) == 1);
    let numbers: Vec<f64> = form.get(30..).unwrap_or_default().split_whitespace().filter_map(number).collect();
    let (double, complex) = match ordinate {
        2 => (false, false),
        4 => (true, false),
        5 => (false, true),
        6 => (true, true),
        other => return Err(format!("its numbers are of type {other}, and 2, 4, 5 and 6 are known")),
    };
    let columns = usize::from(!even) + 1 + usize::from(complex);
    let wanted = usize::try_from(count).ok().and_then(|n| n.checked_mul(columns)).filter(|n| *n <= MAX_VALUES).ok_or("it has no number of values")?;
    let values = if binary {
        // The count of bytes in the head is not relied on: pyuff 2.5 writes half of it for complex numbers.
        let bytes = wanted.saturating_mul(if double { 8 } else { 4 });
        let (data, rest) = lines.rest.split_at_checked(bytes).ok_or("its numbers are cut off")?;
        lines.rest = rest;
        let mut cursor = Cursor { rest: data, big: whole(head, 7..13) == 2 };
        std::iter::from_fn(|| if double { cursor.f64() } else { cursor.f32().map(f64::from) }).take(wanted).collect::<Vec<f64>>()
    } else {
        ascii(lines, wanted)?
    };
    if values.len() != wanted {
        return Err(format!("it has {} of its {wanted} numbers", values.len()));
    }
    if ![RESPONSE, COHERENCE].contains(&kind) {
        return Ok(None);
    }
    let (begin, step) = (numbers.first().copied().unwrap_or(0.0), numbers.get(1).copied().unwrap_or(0.0));
    let mut function = Function { kind, pair: named(&records), frequency_hz: Vec::new() };
    for (k, row) in values.chunks(columns).enumerate() {
        function.frequency_hz.push(if even { begin + step * k as f64 } else { row[0] });
        let value = &row[usize::from(!even)..];
        function.pair.values.push(Complex::new(value[0], value.get(1).copied().unwrap_or(0.0)));
    }
    Ok(Some(function))
}

/// Numbers up to the line that ends them, which stays.
fn ascii(lines: &mut Lines<'_>, wanted: usize) -> Result<Vec<f64>, String> {
    let mut values = Vec::new();
    while values.len() < wanted {
        let before = lines.rest;
        let Some(line) = lines.next() else { break };
        if line.trim() == "-1" {
            lines.rest = before;
            break;
        }
        for word in line.split_whitespace() {
            values.push(number(word).ok_or_else(|| format!("\"{}\" is no number", word.chars().take(40).collect::<String>()))?);
        }
    }
    Ok(values)
}

/// A number as Fortran writes it.
fn number(word: &str) -> Option<f64> {
    word.replace(['D', 'd'], "e").parse().ok()
}

/// Response and reference, with their units.
fn named(records: &[String]) -> Pair {
    let about = &records[5];
    let name = |entity: std::ops::Range<usize>, node: std::ops::Range<usize>, direction: std::ops::Range<usize>, plain: &str| {
        let (entity, node, direction) = (field(about, entity), whole(about, node), whole(about, direction));
        let letters = usize::try_from(direction.unsigned_abs()).ok().and_then(|d| DIRECTIONS.get(d)).copied().unwrap_or_default();
        let entity = if entity.eq_ignore_ascii_case("none") { "" } else { entity };
        let node = if node == 0 { String::new() } else { node.to_string() };
        let letters = if direction < 0 { format!("-{letters}") } else { letters.to_owned() };
        let parts: Vec<&str> = [entity, &node, &letters].into_iter().filter(|part| !part.is_empty()).collect();
        if parts.is_empty() { plain.to_owned() } else { parts.join("_") }
    };
    let (mut output, mut input) = (name(31..41, 41..51, 51..55, "y"), name(56..66, 66..76, 76..80, "u"));
    if let Some((own_output, own_input)) = records[4].trim().strip_prefix(OWN).and_then(|own| own.split_once(" / ")) {
        (output, input) = (own_output.to_owned(), own_input.to_owned());
    }
    let unit = |line: &str| Some(field(line, 47..67)).filter(|unit| !unit.eq_ignore_ascii_case("none")).unwrap_or_default().to_owned();
    Pair { output, input, output_unit: unit(&records[8]), input_unit: unit(&records[9]), ..Pair::default() }
}

/// The response, in ASCII where its frequencies are even and have no more digits than it keeps, else with binary numbers.
pub(super) fn write(response: &ResponseTable, file: &str) -> Result<(Vec<u8>, Vec<Note>), IoError> {
    let grid = even(&response.frequency_hz);
    let mut out = Vec::new();
    for (p, output) in response.outputs.iter().enumerate() {
        for (q, input) in response.inputs.iter().enumerate() {
            let name = format!("{OWN}{output} / {input}");
            if name.len() > 80 || name.contains(char::is_control) || !name.is_ascii() {
                let (what, remedy) = (format!("the pair {output:?}, {input:?}"), "give them shorter names of ASCII, or write CSV");
                return Err(IoError::Unwritable { file: file.to_owned(), what, format: UNIVERSAL, remedy });
            }
            let units = (response.output_units[p].as_str(), response.input_units[q].as_str());
            let values: Vec<[f64; 2]> = response.values[p][q].iter().map(|v| [v.re, v.im]).collect();
            set(&mut out, RESPONSE, (&name, p, q), units, (&response.frequency_hz, grid), &values);
            if let Some(coherence) = &response.coherence {
                let values: Vec<[f64; 2]> = coherence[p][q].iter().map(|v| [*v, 0.0]).collect();
                set(&mut out, COHERENCE, (&name, p, q), units, (&response.frequency_hz, grid), &values);
            }
        }
    }
    Ok((out, left_out(response, UNIVERSAL)))
}

/// Begin and step of frequencies that five digits behind the point say exactly.
fn even(frequency_hz: &[f64]) -> Option<(f64, f64)> {
    let exact = |x: f64| format!("{x:.5e}").parse() == Ok(x);
    let (begin, step) = (*frequency_hz.first()?, frequency_hz.get(1).map_or(1.0, |f| f - frequency_hz[0]));
    let all = frequency_hz.iter().enumerate().all(|(k, f)| begin + step * k as f64 == *f);
    (all && exact(begin) && exact(step)).then_some((begin, step))
}

/// Fortran's exponent has a sign and two digits at least.
fn fortran(x: f64, digits: usize, width: usize) -> String {
    let text = format!("{x:.digits$e}");
    let text = match text.split_once('e') {
        Some((mantissa, exponent)) => {
            let (sign, digits) = exponent.strip_prefix('-').map_or(("+", exponent), |digits| ("-", digits));
            format!("{mantissa}E{sign}{digits:0>2}")
        }
        None => text,
    };
    format!("{text:>width$}")
}

/// Writes one function.
fn set(out: &mut Vec<u8>, kind: i64, (name, p, q): (&str, usize, usize), units: (&str, &str), (f, grid): (&[f64], Option<(f64, f64)>), values: &[[f64; 2]]) {
    let (complex, double) = (kind == RESPONSE, 20);
    let mut head = String::new();
    let title = if complex { "Frequency response" } else { "Coherence" };
    let _ = writeln!(head, "{title}\nNONE\nNONE\nNONE\n{name}");
    let _ = writeln!(head, "{kind:5}{:10}{:5}{:10} {:<10}{:10}{:4} {:<10}{:10}{:4}", 0, 0, 0, "NONE", p + 1, 0, "NONE", q + 1, 0);
    let (begin, step) = grid.unwrap_or((0.0, 0.0));
    let numbers = [begin, step, 0.0].map(|x| fortran(x, 5, 13)).concat();
    let _ = writeln!(head, "{:10}{:10}{:10}{numbers}", if complex { 6 } else { 4 }, values.len(), i32::from(grid.is_some()));
    let axis = |code: i32, label: &str, unit: &str| format!("{code:10}{:5}{:5}{:5} {label:<20} {:<20}\n", 0, 0, 0, if unit.is_empty() { "NONE" } else { unit });
    head += &axis(18, "Frequency", "Hz");
    head += &axis(0, "NONE", if complex { units.0 } else { "" });
    head += &axis(0, "NONE", if complex { units.1 } else { "" });
    head += &axis(0, "NONE", "");
    let take = if complex { 2 } else { 1 };
    if grid.is_some() {
        let mut text = format!("    -1\n    58\n{head}");
        let numbers: Vec<String> = values.iter().flat_map(|v| &v[..take]).map(|x| fortran(*x, 12, double)).collect();
        numbers.chunks(4).for_each(|row| {
            let _ = writeln!(text, "{}", row.concat());
        });
        out.extend_from_slice((text + "    -1\n").as_bytes());
    } else {
        let data: Vec<u8> = f.iter().zip(values).flat_map(|(f, v)| std::iter::once(*f).chain(v[..take].iter().copied())).flat_map(f64::to_le_bytes).collect();
        out.extend_from_slice(format!("    -1\n    58b{:6}{:6}{:12}{:12}{:6}{:6}{:12}{:12}\n{head}", 1, 2, HEAD, data.len(), 0, 0, 0, 0).as_bytes());
        out.extend_from_slice(&data);
        out.extend_from_slice(b"\n    -1\n");
    }
}
