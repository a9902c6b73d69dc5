//! Touchstone 1.1 (`.s1p`, `.s2p` …): as many outputs as inputs, called ports.
//!
//! A line `# HZ S RI R 1` says the unit of the frequency and how complex numbers are written (real and imaginary, magnitude and
//! angle, decibel and angle); then the matrix at each frequency, for two ports column by column. After "Touchstone File Format
//! Specification", Rev 1.1, EIA/IBIS.

use super::bins::{Pair, response};
use super::table::ResponseTable;
use crate::csv::{Shortest, text};
use crate::error::IoError;
use crate::recording::Note;
use num_complex::Complex;
use std::fmt::Write;

/// The format's name in messages.
const TOUCHSTONE: &str = "Touchstone";

/// Ports of one file.
const MAX_PORTS: usize = 64;

/// Bytes in which the line of options stands.
const LOOKED_AT: usize = 1 << 14;

/// The ports that a suffix `sNp` says.
pub(super) fn ports(suffix: &str) -> Option<usize> {
    suffix.strip_prefix('s')?.strip_suffix('p')?.parse().ok().filter(|n| (1..=MAX_PORTS).contains(n))
}

/// Whether there is a line of options.
pub(super) fn is(bytes: &[u8]) -> bool {
    let head = String::from_utf8_lossy(&bytes[..bytes.len().min(LOOKED_AT)]);
    head.lines().map(str::trim).find(|line| !line.is_empty() && !line.starts_with('!')).is_some_and(|line| options(line).is_some())
}

/// The factor to Hz and how numbers are written.
fn options(line: &str) -> Option<(f64, Form)> {
    let words: Vec<String> = line.strip_prefix('#')?.split_whitespace().map(str::to_ascii_uppercase).collect();
    let factor = words.iter().find_map(|w| [("HZ", 1.0), ("KHZ", 1e3), ("MHZ", 1e6), ("GHZ", 1e9)].iter().find(|(name, _)| w == name).map(|(_, f)| *f));
    let form =
        words.iter().find_map(|w| [("RI", Form::Parts), ("MA", Form::Magnitude), ("DB", Form::Decibel)].iter().find(|(name, _)| w == name).map(|(_, f)| *f));
    let kind = words.iter().any(|w| ["S", "Y", "Z", "G", "H"].contains(&w.as_str()));
    // A comment of a table is no line of options: the kind and one of the others are there at least.
    (kind && (factor.is_some() || form.is_some())).then(|| (factor.unwrap_or(1e9), form.unwrap_or(Form::Magnitude)))
}

#[derive(Clone, Copy)]
enum Form {
    Parts,
    Magnitude,
    Decibel,
}

impl Form {
    fn value(self, a: f64, b: f64) -> Complex<f64> {
        match self {
            Form::Parts => Complex::new(a, b),
            Form::Magnitude => Complex::from_polar(a, b.to_radians()),
            Form::Decibel => Complex::from_polar(10f64.powf(a / 20.0), b.to_radians()),
        }
    }
}

/// Reads a Touchstone file; the number of ports follows from the suffix, else from the first line of numbers.
pub(super) fn read(bytes: &[u8], file: &str) -> Result<ResponseTable, IoError> {
    let damaged = |what: String| IoError::Damaged { file: file.to_owned(), format: TOUCHSTONE, what };
    let text = text(bytes, file, 0)?;
    let mut found = None;
    let mut numbers = Vec::new();
    let mut first_line = 0;
    let (mut outputs, mut inputs) = (None, None);
    for (i, line) in text.lines().enumerate() {
        if let Some(comment) = line.trim().strip_prefix('!') {
            let list = |key: &str| comment.trim().strip_prefix(key).map(|list| list.split(',').map(|n| n.trim().to_owned()).collect::<Vec<_>>());
            outputs = outputs.or_else(|| list("outputs:"));
            inputs = inputs.or_else(|| list("inputs:"));
        }
        let line = line.split('!').next().unwrap_or_default().trim();
        if line.starts_with('#') {
            found = found.or_else(|| options(line));
            continue;
        }
        for word in line.split_whitespace() {
            numbers
                .push(word.parse::<f64>().map_err(|_| damaged(format!("\"{}\" in line {} is no number", word.chars().take(40).collect::<String>(), i + 1)))?);
        }
        if first_line == 0 {
            first_line = numbers.len();
        }
    }
    let (factor, form) = found.ok_or_else(|| damaged("there is no line of options".to_owned()))?;
    let suffix = file.rsplit('.').next().unwrap_or_default().to_ascii_lowercase();
    let by_line = [1usize, 2].into_iter().find(|n| 1 + 2 * n * n == first_line);
    let n = ports(&suffix).or(by_line).ok_or_else(|| damaged("neither the suffix .sNp nor the first line says how many ports it has".to_owned()))?;
    let row = 1 + 2 * n * n;
    let mut frequency_hz: Vec<f64> = Vec::new();
    let mut values = vec![Vec::new(); n * n];
    for row in numbers.chunks(row) {
        let f = row[0] * factor;
        // Behind two ports, parameters of noise may follow, from lower frequencies again.
        if frequency_hz.last().is_some_and(|last| f <= *last) {
            break;
        }
        if row.len() < 1 + 2 * n * n {
            return Err(damaged(format!("the matrix at {f} Hz is not complete")));
        }
        frequency_hz.push(f);
        values.iter_mut().zip(row[1..].chunks(2)).for_each(|(values, pair)| values.push(form.value(pair[0], pair[1])));
    }
    let names = |given: Option<Vec<String>>, start: &str| given.filter(|g| g.len() == n).unwrap_or_else(|| (1..=n).map(|k| format!("{start}{k}")).collect());
    let (outputs, inputs) = (names(outputs, "y"), names(inputs, "u"));
    let mut pairs = Vec::with_capacity(n * n);
    for (p, output) in outputs.iter().enumerate() {
        for (q, input) in inputs.iter().enumerate() {
            let at = if n == 2 { q * n + p } else { p * n + q };
            pairs.push(Pair { output: output.clone(), input: input.clone(), values: std::mem::take(&mut values[at]), ..Pair::default() });
        }
    }
    response(frequency_hz, pairs).map_err(damaged)
}

/// The response with real and imaginary parts.
pub(super) fn write(response: &ResponseTable, file: &str) -> Result<(Vec<u8>, Vec<Note>), IoError> {
    let n = response.outputs.len();
    let suffix = file.rsplit('.').next().unwrap_or_default().to_ascii_lowercase();
    if response.inputs.len() != n || ports(&suffix) != Some(n) {
        let what = format!("{n} outputs and {} inputs under the suffix .{suffix}", response.inputs.len());
        return Err(IoError::Unwritable { file: file.to_owned(), what, format: TOUCHSTONE, remedy: "as many outputs as inputs as .sNp says, or write CSV" });
    }
    let mut out = format!("! outputs: {}\n! inputs: {}\n# HZ S RI R 1\n", response.outputs.join(", "), response.inputs.join(", "));
    for (k, f) in response.frequency_hz.iter().enumerate() {
        let _ = write!(out, "{}", Shortest(*f));
        for at in 0..n * n {
            let (p, q) = if n == 2 { (at % n, at / n) } else { (at / n, at % n) };
            let value = response.values[p][q][k];
            let _ = write!(out, "{}{} {}", if at > 0 && at % n == 0 && n > 2 { "\n " } else { " " }, Shortest(value.re), Shortest(value.im));
        }
        out.push('\n');
    }
    Ok((out.into_bytes(), left_out(response, TOUCHSTONE)))
}

/// What a format without room for them leaves out.
pub(super) fn left_out(response: &ResponseTable, format: &str) -> Vec<Note> {
    let parts: Vec<&str> = [(response.std.is_some(), "standard errors"), (response.coherence.is_some() && format == TOUCHSTONE, "coherences")]
        .into_iter()
        .filter_map(|(there, what)| there.then_some(what))
        .collect();
    if parts.is_empty() {
        return Vec::new();
    }
    vec![Note::new("left-out", format!("{format} has no room for {}, which are left out", parts.join(" and ")), "write CSV or NPZ to keep them")]
}
