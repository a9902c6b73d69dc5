//! One array as NumPy writes it: a header in Python's syntax, then the numbers.

use crate::arrays::{Value, in_c_order};
use crate::number::Number;
use crate::table::Rounding;
use num_complex::Complex;

const MAGIC: &[u8] = b"\x93NUMPY";

/// Bytes of a header; NumPy itself refuses more than 10 000.
const MAX_HEADER: usize = 10_000;

/// The kind, width and byte order of the elements.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Dtype {
    kind: char,
    bytes: usize,
    big: bool,
}

/// The array in `bytes`, or what is wrong with it.
pub(crate) fn parse(bytes: &[u8]) -> Result<Value, String> {
    let (header, data) = split_header(bytes)?;
    let descr = field(header, "descr").ok_or("its header has no descr")?;
    let shape = shape(field(header, "shape").ok_or("its header has no shape")?).ok_or("its shape is no tuple of sizes")?;
    let Some(dtype) = dtype(descr) else {
        return Ok(Value::Other("a structured or Python type"));
    };
    let count = shape.iter().try_fold(1usize, |n, &size| n.checked_mul(size));
    let expected = count.and_then(|n| n.checked_mul(dtype.bytes)).ok_or("its shape is larger than any memory")?;
    if dtype.kind == 'O' {
        return Ok(Value::Other("Python objects, which are never unpacked"));
    }
    if data.len() != expected {
        return Err(format!("its header promises {expected} bytes of numbers, {} are there", data.len()));
    }
    match dtype.kind {
        'U' | 'S' if shape.is_empty() => Ok(text(data, dtype).map_or(Value::Other("text that is not Unicode"), Value::Text)),
        'U' | 'S' => Ok(Value::Other("several texts")),
        'c' => Ok(Value::Other("complex numbers")),
        _ => Ok(match numbers(data, dtype) {
            Some((values, rounding)) => {
                let values = if is_fortran(header) { in_c_order(&shape, &values) } else { values };
                Value::Numbers { shape, values, rounding }
            }
            None => Value::Other("a type of numbers that is not known here"),
        }),
    }
}

/// Whether the first index of its arrays runs fastest.
fn is_fortran(header: &str) -> bool {
    field(header, "fortran_order").is_some_and(|order| order.starts_with("True"))
}

/// An array of complex or real numbers, in C's order, with its sizes; [`None`] for anything else.
pub(crate) fn complex(bytes: &[u8]) -> Option<(Vec<usize>, Vec<Complex<f64>>)> {
    let (header, data) = split_header(bytes).ok()?;
    let shape = shape(field(header, "shape")?)?;
    let plain = dtype(field(header, "descr")?)?;
    let parts = if plain.kind == 'c' { Dtype { kind: 'f', bytes: plain.bytes / 2, ..plain } } else { plain };
    let count = shape.iter().try_fold(1usize, |n, &size| n.checked_mul(size))?;
    if Some(data.len()) != count.checked_mul(plain.bytes) {
        return None;
    }
    let (numbers, _) = numbers(data, parts)?;
    let values: Vec<Complex<f64>> = match plain.kind {
        'c' => numbers.as_chunks::<2>().0.iter().map(|&[re, im]| Complex::new(re, im)).collect(),
        _ => numbers.into_iter().map(Complex::from).collect(),
    };
    let values = if is_fortran(header) { in_c_order(&shape, &values) } else { values };
    Some((shape, values))
}

/// An array of texts; [`None`] for anything else.
pub(crate) fn texts(bytes: &[u8]) -> Option<Vec<String>> {
    let (header, data) = split_header(bytes).ok()?;
    let dtype = dtype(field(header, "descr")?)?;
    if !matches!(dtype.kind, 'U' | 'S') || dtype.bytes == 0 {
        return None;
    }
    data.chunks_exact(dtype.bytes).map(|one| text(one, dtype)).collect()
}

/// Complex numbers in C's order.
pub(crate) fn encode_complex(shape: &[usize], values: impl Iterator<Item = Complex<f64>>) -> Vec<u8> {
    let mut out = header("<c16", shape);
    values.for_each(|v| [v.re, v.im].iter().for_each(|x| out.extend_from_slice(&x.to_le_bytes())));
    out
}

/// Texts, or a single one without a shape. NumPy knows no text of width 0 in a file; it pads with NUL.
pub(crate) fn encode_texts(shape: &[usize], texts: &[impl AsRef<str>]) -> Vec<u8> {
    let width = texts.iter().map(|t| t.as_ref().chars().count()).max().unwrap_or(0).max(1);
    let mut out = header(&format!("<U{width}"), shape);
    for text in texts {
        let mut codes: Vec<u32> = text.as_ref().chars().map(u32::from).collect();
        codes.resize(width, 0);
        codes.iter().for_each(|c| out.extend_from_slice(&c.to_le_bytes()));
    }
    out
}

fn split_header(bytes: &[u8]) -> Result<(&str, &[u8]), String> {
    let rest = bytes.strip_prefix(MAGIC).ok_or("it does not begin as an array")?;
    let (len, start) = match *rest {
        [1, _, a, b, ..] => (usize::from(u16::from_le_bytes([a, b])), 4),
        [2 | 3, _, a, b, c, d, ..] => (u32::from_le_bytes([a, b, c, d]) as usize, 6),
        _ => return Err("its version is not known, or it ends in the header".to_owned()),
    };
    if len > MAX_HEADER {
        return Err(format!("its header claims {len} bytes, the limit is {MAX_HEADER}"));
    }
    let header = rest.get(start..start + len).ok_or("it ends in the header")?;
    Ok((std::str::from_utf8(header).map_err(|_| "its header is no text")?, &rest[start + len..]))
}

/// What stands behind `'key':`.
fn field<'a>(header: &'a str, key: &str) -> Option<&'a str> {
    let at = header.find(&format!("'{key}'"))? + key.len() + 2;
    header[at..].trim_start().strip_prefix(':').map(str::trim_start)
}

fn shape(text: &str) -> Option<Vec<usize>> {
    let inside = text.strip_prefix('(')?.split_once(')')?.0;
    inside.split(',').map(str::trim).filter(|s| !s.is_empty()).map(|s| s.trim_end_matches('L').parse().ok()).collect()
}

/// The type that a header's field names, in quotes.
fn dtype(field: &str) -> Option<Dtype> {
    let descr = field.strip_prefix(['\'', '"'])?.split(['\'', '"']).next()?;
    let (order, rest) = match descr.chars().next()? {
        c @ ('<' | '>' | '|' | '=') => (c, &descr[1..]),
        _ => ('<', descr),
    };
    let kind = rest.chars().next().filter(char::is_ascii)?;
    let width: usize = match &rest[1..] {
        "" if kind == 'O' => 0,
        width => width.parse().ok()?,
    };
    let bytes = if kind == 'U' { width.checked_mul(4)? } else { width };
    Some(Dtype { kind, bytes, big: order == '>' })
}

fn text(data: &[u8], dtype: Dtype) -> Option<String> {
    let text = match dtype.kind {
        'U' => data
            .as_chunks::<4>()
            .0
            .iter()
            .map(|&b| char::from_u32(if dtype.big { u32::from_be_bytes(b) } else { u32::from_le_bytes(b) }))
            .collect::<Option<String>>()?,
        _ => std::str::from_utf8(data).ok()?.to_owned(),
    };
    Some(text.trim_end_matches('\0').to_owned())
}

fn numbers(data: &[u8], dtype: Dtype) -> Option<(Vec<f64>, Rounding)> {
    let number = match (dtype.kind, dtype.bytes) {
        ('f', 8) => Number::F64,
        ('f', 4) => Number::F32,
        ('i', 1) => Number::I8,
        ('i', 2) => Number::I16,
        ('i', 4) => Number::I32,
        ('i', 8) => Number::I64,
        ('u' | 'b', 1) => Number::U8,
        ('u', 2) => Number::U16,
        ('u', 4) => Number::U32,
        ('u', 8) => Number::U64,
        _ => return None,
    };
    Some((number.all(data, dtype.big)?, number.rounding()))
}

/// An array of numbers, 1-D, or 0-D where `shape` is empty.
pub(crate) fn encode_numbers(shape: &[usize], values: &[f64]) -> Vec<u8> {
    let mut out = header("<f8", shape);
    values.iter().for_each(|v| out.extend_from_slice(&v.to_le_bytes()));
    out
}

fn header(descr: &str, shape: &[usize]) -> Vec<u8> {
    let sizes = shape.iter().map(|n| format!("{n},")).collect::<String>();
    let mut text = format!("{{'descr': '{descr}', 'fortran_order': False, 'shape': ({sizes}), }}");
    // The numbers begin at a multiple of 64 bytes.
    while !(MAGIC.len() + 4 + text.len() + 1).is_multiple_of(64) {
        text.push(' ');
    }
    text.push('\n');
    let mut out = MAGIC.to_vec();
    out.extend_from_slice(&[1, 0]);
    out.extend_from_slice(&(text.len() as u16).to_le_bytes());
    out.extend_from_slice(text.as_bytes());
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_and_texts_come_back() {
        let Value::Numbers { shape, values, .. } = parse(&encode_numbers(&[3], &[1.0, -0.5, 1e300])).unwrap() else { panic!("numbers") };
        assert_eq!((shape, values), (vec![3], vec![1.0, -0.5, 1e300]));
        for text in ["", "N m", "größe °", "two\nlines"] {
            let Value::Text(back) = parse(&encode_texts(&[], &[text])).unwrap() else { panic!("text") };
            assert_eq!(back, text);
        }
    }

    #[test]
    fn complex_arrays_of_both_orders() {
        let values: Vec<Complex<f64>> = (0..6).map(|k| Complex::new(f64::from(k), -f64::from(k))).collect();
        let bytes = encode_complex(&[2, 3], values.iter().copied());
        assert_eq!(complex(&bytes), Some((vec![2, 3], values.clone())));
        let mut fortran = bytes;
        let at = fortran.windows(5).position(|five| five == b"False").unwrap();
        fortran[at..at + 5].copy_from_slice(b"True ");
        let (_, columns) = complex(&fortran).unwrap();
        let order: Vec<f64> = columns.iter().map(|v| v.re).collect();
        assert_eq!(order, [0.0, 2.0, 4.0, 1.0, 3.0, 5.0]);
        assert_eq!(texts(&encode_texts(&[2], &["a", "größe"])), Some(vec!["a".to_owned(), "größe".to_owned()]));
    }

    #[test]
    fn a_shape_that_promises_too_much_is_refused_before_memory_is_taken() {
        let mut bytes = header("<f8", &[usize::MAX, 2]);
        assert!(parse(&bytes).unwrap_err().contains("larger"));
        bytes = header("<f8", &[1_000_000_000_000]);
        assert!(parse(&bytes).unwrap_err().contains("promises"));
        bytes = MAGIC.to_vec();
        bytes.extend_from_slice(&[2, 0, 0xff, 0xff, 0xff, 0xff]);
        assert!(parse(&bytes).unwrap_err().contains("limit"));
    }

    #[test]
    fn types_of_numpy_are_understood() {
        assert_eq!(dtype("'>i2'"), Some(Dtype { kind: 'i', bytes: 2, big: true }));
        assert_eq!(dtype("'|O'"), Some(Dtype { kind: 'O', bytes: 0, big: false }));
        assert_eq!(shape("(5,)"), Some(vec![5]));
        assert_eq!(shape("()"), Some(vec![]));
        assert_eq!(shape("(2, 3)"), Some(vec![2, 3]));
        assert_eq!(shape("(-1,)"), None);
    }
}
