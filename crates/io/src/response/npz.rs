//! A response as NPZ: `frequency_hz`, the complex array `response` by output, input and frequency, and lists of names.
//!
//! Other programs' arrays are understood as `H`, `frf` or `G` too, as one row of values or with the frequency last, or first.

use super::bins::{Pair, response};
use super::table::ResponseTable;
use crate::error::IoError;
use crate::npz::{arrays_of, npy, zip};
use num_complex::Complex;
use std::collections::BTreeMap;
use std::io::Cursor;
use zip::ZipArchive;

/// The format's name in messages.
const NPZ: &str = "NPZ";

/// What the frequencies are called, with the factor to Hz.
const FREQUENCIES: [(&str, f64); 5] = [("frequency_hz", 1.0), ("frequency", 1.0), ("freq", 1.0), ("f", 1.0), ("omega", 1.0 / std::f64::consts::TAU)];

/// What the values are called.
const VALUES: [&str; 5] = ["response", "H", "frf", "FRF", "G"];

/// Whether there are frequencies and values among the arrays.
pub(super) fn is(bytes: &[u8]) -> bool {
    let Ok(archive) = ZipArchive::new(Cursor::new(bytes)) else { return false };
    let has = |wanted: &str| archive.file_names().any(|name| name.is_ok_and(|name| name.strip_suffix(".npy") == Some(wanted)));
    FREQUENCIES.iter().any(|(name, _)| has(name)) && VALUES.iter().any(|name| has(name))
}

/// Reads a response.
pub(super) fn read(bytes: &[u8], file: &str) -> Result<ResponseTable, IoError> {
    let unsuitable = |what: String| IoError::unsuitable(file, what, "save response[output, input, frequency] beside frequency_hz");
    let arrays: BTreeMap<String, Vec<u8>> = arrays_of(bytes, file)?.into_iter().collect();
    let array = |name: &str| arrays.get(name).and_then(|data| npy::complex(data));
    let found = FREQUENCIES.iter().find_map(|(name, factor)| Some((array(name)?.1, *factor)));
    let frequency_hz: Vec<f64> =
        found.map(|(f, factor)| f.into_iter().map(|f| f.re * factor).collect()).ok_or_else(|| unsuitable("frequency_hz is no array of numbers".to_owned()))?;
    let (shape, values) = VALUES.iter().find_map(|name| array(name)).ok_or_else(|| unsuitable("its response is no array of complex numbers".to_owned()))?;
    let n = frequency_hz.len();
    let (rows, columns, first) = match shape[..] {
        [f] if f == n => (1, 1, false),
        [p, q, f] if f == n => (p, q, false),
        [f, p, q] if f == n => (p, q, true),
        _ => return Err(unsuitable(format!("its response has the sizes {shape:?} and there are {n} frequencies"))),
    };
    let place = |p: usize, q: usize, k: usize| if first { (k * rows + p) * columns + q } else { (p * columns + q) * n + k };
    let names = |key: &str, count: usize, start: &str| {
        let given = arrays.get(key).and_then(|data| npy::texts(data)).filter(|names| names.len() == count);
        given.unwrap_or_else(|| if count == 1 { vec![start.to_owned()] } else { (1..=count).map(|k| format!("{start}{k}")).collect() })
    };
    let (outputs, inputs) = (names("outputs", rows, "y"), names("inputs", columns, "u"));
    let units = |key: &str, count: usize| {
        arrays.get(key).and_then(|data| npy::texts(data)).filter(|units| units.len() == count).unwrap_or_else(|| vec![String::new(); count])
    };
    let (output_units, input_units) = (units("output_units", rows), units("input_units", columns));
    let real = |key: &str| array(key).filter(|(own, _)| *own == shape).map(|(_, values)| values);
    let (std, coherence) = (real("std"), real("coherence"));
    let mut pairs = Vec::with_capacity(rows * columns);
    for p in 0..rows {
        for q in 0..columns {
            let of = |values: &Vec<Complex<f64>>| (0..n).map(|k| values[place(p, q, k)].re).collect::<Vec<f64>>();
            pairs.push(Pair {
                output: outputs[p].clone(),
                input: inputs[q].clone(),
                output_unit: output_units[p].clone(),
                input_unit: input_units[q].clone(),
                values: (0..n).map(|k| values[place(p, q, k)]).collect(),
                std: std.as_ref().map(of),
                coherence: coherence.as_ref().map(of),
            });
        }
    }
    response(frequency_hz, pairs).map_err(unsuitable)
}

/// The response; reading it gives the same numbers bit for bit.
pub(super) fn write(response: &ResponseTable, file: &str) -> Result<Vec<u8>, IoError> {
    let shape = [response.outputs.len(), response.inputs.len(), response.frequency_hz.len()];
    let mut arrays = vec![
        ("frequency_hz".to_owned(), npy::encode_numbers(&shape[2..], &response.frequency_hz)),
        ("response".to_owned(), npy::encode_complex(&shape, response.values.iter().flatten().flatten().copied())),
    ];
    for (name, texts) in
        [("outputs", &response.outputs), ("inputs", &response.inputs), ("output_units", &response.output_units), ("input_units", &response.input_units)]
    {
        if texts.iter().any(|text| text.contains('\0')) {
            return Err(IoError::Unwritable { file: file.to_owned(), what: format!("a name with NUL in {name}"), format: NPZ, remedy: "give it another name" });
        }
        arrays.push((name.to_owned(), npy::encode_texts(&[texts.len()], texts)));
    }
    for (name, values) in [("std", &response.std), ("coherence", &response.coherence)] {
        if let Some(values) = values {
            let flat: Vec<f64> = values.iter().flatten().flatten().copied().collect();
            arrays.push((name.to_owned(), npy::encode_numbers(&shape, &flat)));
        }
    }
    zip(&arrays).map_err(|e| IoError::Unwritable { file: file.to_owned(), what: format!("the response ({e})"), format: NPZ, remedy: "write CSV" })
}
