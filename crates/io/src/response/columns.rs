//! A response as CSV: one row a frequency.
//!
//! `frequency_hz`, then for each pair `re_OUT_IN` and `im_OUT_IN`, or `gain_OUT_IN` (or `gain_db_OUT_IN`) and `phase_deg_OUT_IN` (or
//! `phase_rad_OUT_IN`), perhaps `std_OUT_IN` and `coherence_OUT_IN`. A single pair may go without names: `re`, `im`. The comments
//! `# outputs: a, b` and `# inputs: c` say which is which where names have underscores that tell it in several ways.

use super::bins::{Pair, response};
use super::pairs::axes;
use super::table::ResponseTable;
use crate::csv::{Shortest, read_piece, text};
use crate::error::IoError;
use crate::names::{key, split_name};
use crate::table::{Column, Table};
use num_complex::Complex;
use std::fmt::Write;

/// Bytes that tell a response from a recording.
const LOOKED_AT: usize = 1 << 16;

/// What the columns of a pair begin with; longer ones before those that they begin with.
const PARTS: [&str; 9] = ["gain_db", "gain", "phase_deg", "phase_rad", "re", "im", "std", "coherence", "phase"];

/// Frequencies, with the factor to Hz where the name says it.
const FREQUENCIES: [(&str, f64); 6] =
    [("frequency_hz", 1.0), ("frequency", 1.0), ("freq_hz", 1.0), ("freq", 1.0), ("f_hz", 1.0), ("omega_rad_s", 1.0 / std::f64::consts::TAU)];

/// Whether the line of names is that of a response.
pub(super) fn is(bytes: &[u8]) -> bool {
    let head = String::from_utf8_lossy(&bytes[..bytes.len().min(LOOKED_AT)]);
    let Some(header) = head.trim_start_matches('\u{feff}').lines().map(str::trim).find(|line| !line.is_empty() && !line.starts_with('#')) else {
        return false;
    };
    let names: Vec<String> = header.split([',', ';', '\t']).map(|cell| split_name(cell.trim().trim_matches('"')).0.to_ascii_lowercase()).collect();
    let any = |wanted: &[&str]| names.iter().any(|name| part(name).is_some_and(|(part, _)| wanted.contains(&part)));
    names.iter().any(|name| FREQUENCIES.iter().any(|(known, _)| name == known))
        && any(&["re", "gain", "gain_db"])
        && any(&["im", "phase_deg", "phase_rad", "phase"])
}

/// The part and the pair of a column's name.
fn part(name: &str) -> Option<(&'static str, &str)> {
    PARTS.iter().find_map(|part| {
        let pair = name.strip_prefix(part)?;
        if pair.is_empty() { Some((*part, "")) } else { pair.strip_prefix('_').map(|pair| (*part, pair)) }
    })
}

/// Reads a response from columns.
pub(super) fn read(bytes: &[u8], file: &str) -> Result<ResponseTable, IoError> {
    let mut table = read_piece(text(bytes, file, 0)?, file, (0, 0))?;
    let unsuitable = |what: String, remedy: &str| IoError::Unsuitable { file: file.to_owned(), what, remedy: remedy.to_owned() };
    let frequency_hz = frequency(&mut table).ok_or_else(|| {
        unsuitable("it has no column frequency_hz, so it is no frequency response".to_owned(), "name the frequencies so, or give it as a recording")
    })?;
    let mut columns: Vec<(&'static str, String, Column)> = Vec::new();
    for column in std::mem::take(&mut table.columns) {
        match part(&column.name) {
            Some((part, pair)) => columns.push((part, pair.to_owned(), column)),
            None => {
                return Err(unsuitable(
                    format!("column \"{}\" is none of a response", column.name),
                    "columns are re_OUT_IN, im_OUT_IN, gain_OUT_IN, phase_deg_OUT_IN, std_OUT_IN and coherence_OUT_IN",
                ));
            }
        }
    }
    let mut names: Vec<String> = Vec::new();
    for (_, pair, _) in &columns {
        if !names.contains(pair) {
            names.push(pair.clone());
        }
    }
    let listed = |key: &str| table.metadata.get(key).map(|list| list.split(',').map(|name| name.trim().to_owned()).collect::<Vec<String>>());
    let (outputs, inputs) = match (listed("outputs"), listed("inputs")) {
        (Some(outputs), Some(inputs)) => (outputs, inputs),
        _ if names == [""] => (vec!["y".to_owned()], vec!["u".to_owned()]),
        _ => axes(&names).ok_or_else(|| {
            let remedy = "add the lines `# outputs: a, b` and `# inputs: c, d` above, and columns for each output and each input";
            unsuitable(format!("the columns of {} tell outputs and inputs in no way, or in several", names.join(", ")), remedy)
        })?,
    };
    let take = |pair: &str, wanted: &str| columns.iter().find(|(part, of, _)| *part == wanted && of == pair).map(|(.., column)| column);
    let unit = |name: &String| table.metadata.get(&format!("unit/{}", key(name))).cloned().unwrap_or_default();
    let mut pairs = Vec::new();
    for output in &outputs {
        for input in &inputs {
            let pair = if names == [""] { String::new() } else { format!("{output}_{input}") };
            let values = values(&|part| take(&pair, part))
                .map_err(|missing| unsuitable(format!("there is no column {missing}_{pair}"), "give both parts of each value"))?;
            let real = |part: &str| take(&pair, part).map(|column| column.samples.clone());
            let (std, coherence) = (real("std"), real("coherence"));
            pairs.push(Pair { output: output.clone(), input: input.clone(), output_unit: unit(output), input_unit: unit(input), values, std, coherence });
        }
    }
    let mut found = response(frequency_hz, pairs).map_err(|what| unsuitable(what, "correct its columns"))?;
    found.metadata = table.metadata.into_iter().filter(|(key, _)| key != "outputs" && key != "inputs" && !key.starts_with("unit/")).collect();
    Ok(found)
}

/// Takes the frequencies out of the table, in Hz.
fn frequency(table: &mut Table) -> Option<Vec<f64>> {
    let find = |c: &Column| FREQUENCIES.iter().find(|(name, _)| c.name.eq_ignore_ascii_case(name)).map(|(_, factor)| *factor);
    let (at, factor) = table.columns.iter().enumerate().find_map(|(at, c)| find(c).map(|factor| (at, factor)))?;
    let column = table.columns.remove(at);
    let factor = match column.unit.as_deref() {
        Some("kHz") => 1e3,
        Some("MHz") => 1e6,
        Some("rad/s") => 1.0 / std::f64::consts::TAU,
        _ => factor,
    };
    Some(column.samples.into_iter().map(|f| f * factor).collect())
}

/// The values of a pair from the columns that it has, or which one is missing.
fn values<'a>(take: &dyn Fn(&str) -> Option<&'a Column>) -> Result<Vec<Complex<f64>>, &'static str> {
    let both = |a: &Column, b: &Column, of: &dyn Fn(f64, f64) -> Complex<f64>| a.samples.iter().zip(&b.samples).map(|(a, b)| of(*a, *b)).collect();
    if let Some(re) = take("re") {
        return Ok(both(re, take("im").ok_or("im")?, &Complex::new));
    }
    let gain = take("gain").or_else(|| take("gain_db")).ok_or("re")?;
    let linear = |gain_value: f64| if take("gain").is_some() { gain_value } else { 10f64.powf(gain_value / 20.0) };
    let phase = take("phase_deg").or_else(|| take("phase_rad")).or_else(|| take("phase")).ok_or("phase_deg")?;
    let radians = phase.name.starts_with("phase_rad") || phase.unit.as_deref() == Some("rad");
    Ok(both(gain, phase, &|gain, phase| Complex::from_polar(linear(gain), if radians { phase } else { phase.to_radians() })))
}

/// The number of a column at a row.
type Cell<'a> = Box<dyn Fn(usize) -> f64 + 'a>;

/// The response as CSV; reading it gives the same numbers bit for bit.
pub(super) fn write(response: &ResponseTable, file: &str) -> Result<Vec<u8>, IoError> {
    let separator = if file.to_ascii_lowercase().ends_with(".tsv") { '\t' } else { ',' };
    for name in response.outputs.iter().chain(&response.inputs) {
        let plain = !name.is_empty() && name.trim() == name && !name.contains([',', ';', '\t', '"', '#']) && !name.contains(char::is_control);
        if !plain || split_name(name) != (name.as_str().into(), None) || key(name) != *name {
            let remedy = "give it a name of letters, digits and _";
            return Err(IoError::Unwritable { file: file.to_owned(), what: format!("channel {name:?}"), format: "CSV", remedy });
        }
    }
    let mut out = String::new();
    for (name, value) in response.metadata.iter().filter(|(name, value)| key(name) == **name && !value.contains(char::is_control)) {
        let _ = writeln!(out, "# {name}: {value}");
    }
    let _ = writeln!(out, "# outputs: {}\n# inputs: {}", response.outputs.join(", "), response.inputs.join(", "));
    for (name, unit) in response.outputs.iter().zip(&response.output_units).chain(response.inputs.iter().zip(&response.input_units)) {
        if !unit.is_empty() {
            let _ = writeln!(out, "# unit/{name}: {unit}");
        }
    }
    let pairs: Vec<(usize, usize)> = (0..response.outputs.len()).flat_map(|p| (0..response.inputs.len()).map(move |q| (p, q))).collect();
    let mut columns: Vec<(String, Cell<'_>)> = vec![("frequency_hz".to_owned(), Box::new(|k| response.frequency_hz[k]))];
    for &(p, q) in &pairs {
        let pair = format!("{}_{}", response.outputs[p], response.inputs[q]);
        columns.push((format!("re_{pair}"), Box::new(move |k| response.values[p][q][k].re)));
        columns.push((format!("im_{pair}"), Box::new(move |k| response.values[p][q][k].im)));
        for (part, values) in [("std", &response.std), ("coherence", &response.coherence)] {
            if let Some(values) = values {
                columns.push((format!("{part}_{pair}"), Box::new(move |k| values[p][q][k])));
            }
        }
    }
    let join = |cells: Vec<String>| cells.join(&separator.to_string());
    let _ = writeln!(out, "{}", join(columns.iter().map(|(name, _)| name.clone()).collect()));
    for k in 0..response.frequency_hz.len() {
        let _ = writeln!(out, "{}", join(columns.iter().map(|(_, value)| Shortest(value(k)).to_string()).collect()));
    }
    Ok(out.into_bytes())
}
