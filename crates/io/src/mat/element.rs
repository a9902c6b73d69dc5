//! The tagged pieces that a MAT file is made of.

use crate::number::Number;

/// A matrix, which holds further elements.
pub(super) const MATRIX: u32 = 14;
/// An element packed with zlib.
pub(super) const COMPRESSED: u32 = 15;

/// One piece: its type and its bytes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Element<'a> {
    pub kind: u32,
    pub data: &'a [u8],
}

/// The pieces of a stretch of bytes, one after the other.
#[derive(Debug)]
pub(super) struct Elements<'a> {
    rest: &'a [u8],
    big: bool,
}

impl<'a> Elements<'a> {
    pub fn new(bytes: &'a [u8], big: bool) -> Self {
        Elements { rest: bytes, big }
    }

    /// The next piece, [`None`] at the end.
    pub fn next(&mut self) -> Result<Option<Element<'a>>, String> {
        if self.rest.is_empty() {
            return Ok(None);
        }
        let (Some(first), Some(second)) = (self.u32_at(0), self.u32_at(4)) else {
            return Err(format!("{} bytes are left where a tag of 8 should be", self.rest.len()));
        };
        let (small_len, small_kind) = (first >> 16, first & 0xffff);
        let (kind, start, len, end) = if small_len != 0 {
            if small_len > 4 {
                return Err(format!("a short element of {small_len} bytes, at most 4 fit"));
            }
            (small_kind, 4, small_len as usize, 8)
        } else {
            let len = second as usize;
            let padded = if first == COMPRESSED { len } else { len.next_multiple_of(8) };
            (first, 8, len, 8 + padded)
        };
        let Some(data) = self.rest.get(start..start + len) else {
            return Err(format!("an element of {len} bytes where {} are left", self.rest.len() - start));
        };
        // The last element may lack its padding.
        self.rest = self.rest.get(end..).unwrap_or_default();
        Ok(Some(Element { kind, data }))
    }

    /// The next piece, which has to be there.
    pub fn required(&mut self, what: &str) -> Result<Element<'a>, String> {
        self.next()?.ok_or_else(|| format!("its {what} is missing"))
    }

    fn u32_at(&self, at: usize) -> Option<u32> {
        let bytes: [u8; 4] = self.rest.get(at..at + 4)?.try_into().ok()?;
        Some(if self.big { u32::from_be_bytes(bytes) } else { u32::from_le_bytes(bytes) })
    }
}

/// The numbers of an element, whatever type they are stored in; [`None`] if it holds none.
pub(super) fn numbers(element: Element<'_>, big: bool) -> Option<Vec<f64>> {
    let number = match element.kind {
        1 => Number::I8,
        2 => Number::U8,
        3 => Number::I16,
        4 => Number::U16,
        5 => Number::I32,
        6 => Number::U32,
        7 => Number::F32,
        9 => Number::F64,
        12 => Number::I64,
        13 => Number::U64,
        _ => return None,
    };
    number.all(element.data, big)
}

/// The text of an element in any of the encodings that there are; [`None`] if it is none.
pub(super) fn text(element: Element<'_>, big: bool) -> Option<String> {
    let text = match element.kind {
        1 | 2 | 16 => String::from_utf8(element.data.to_vec()).ok()?,
        3 | 4 | 17 => {
            let units: Vec<u16> = element.data.as_chunks::<2>().0.iter().map(|&b| if big { u16::from_be_bytes(b) } else { u16::from_le_bytes(b) }).collect();
            String::from_utf16(&units).ok()?
        }
        5 | 6 | 18 => element
            .data
            .as_chunks::<4>()
            .0
            .iter()
            .map(|&b| char::from_u32(if big { u32::from_be_bytes(b) } else { u32::from_le_bytes(b) }))
            .collect::<Option<String>>()?,
        _ => return None,
    };
    Some(text.trim_end_matches('\0').to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn short_and_long_elements_in_both_byte_orders() {
        let little = [1, 0, 2, 0, b'a', b'b', 0, 0, 9, 0, 0, 0, 8, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0xf0, 0x3f];
        let mut elements = Elements::new(&little, false);
        assert_eq!(text(elements.required("name").unwrap(), false).as_deref(), Some("ab"));
        assert_eq!(numbers(elements.required("real part").unwrap(), false), Some(vec![1.0]));
        assert!(elements.next().unwrap().is_none());
        let big = [0, 0, 0, 3, 0, 0, 0, 2, 1, 2];
        assert_eq!(numbers(Elements::new(&big, true).required("numbers").unwrap(), true), Some(vec![258.0]));
    }

    #[test]
    fn lengths_that_lie_are_errors() {
        assert!(Elements::new(&[9, 0, 0, 0, 255, 255, 255, 255], false).next().is_err());
        assert!(Elements::new(&[9, 0, 5, 0, 0, 0, 0, 0], false).next().is_err());
        assert!(Elements::new(&[9, 0, 0], false).next().is_err());
    }
}
