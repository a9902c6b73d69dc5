//! What the pages of a file claim, compared with what the directory claims, before the decoder believes them.
//!
//! The decoder (parquet 60.1) reserves what a page's header says. The headers are Thrift's compact protocol; of them, the sizes and
//! counts are read here and everything else is passed over.

use super::PARQUET;
use crate::error::IoError;
use ::parquet::file::metadata::{ColumnChunkMetaData, ParquetMetaData};

/// Structs and lists within one another in a page's header.
const MAX_DEPTH: usize = 8;

/// Values that one byte of a page may hold: bits.
const OF_BYTE: i64 = 8;

/// The fields of a page's header that tell sizes.
const UNCOMPRESSED: i64 = 2;
const COMPRESSED: i64 = 3;
const DATA: i64 = 5;
const DICTIONARY: i64 = 7;
const DATA_V2: i64 = 8;

/// Refuses pages that claim more than their column does.
pub(super) fn check(bytes: &[u8], file: &str, metadata: &ParquetMetaData) -> Result<(), IoError> {
    for (g, group) in metadata.row_groups().iter().enumerate() {
        for column in group.columns() {
            check_column(bytes, column).ok_or_else(|| IoError::Damaged {
                file: file.to_owned(),
                format: PARQUET,
                what: format!("the pages of column \"{}\" in row group {g} are not as its directory says", column.column_path().string()),
            })?;
        }
    }
    Ok(())
}

/// Whether the pages of a column stay within its claims.
fn check_column(bytes: &[u8], column: &ColumnChunkMetaData) -> Option<()> {
    let start = usize::try_from(column.dictionary_page_offset().unwrap_or(column.data_page_offset())).ok()?;
    // To the end of the file: some writers leave the dictionary's header out of a column's size (PARQUET-816).
    let mut rest = bytes.get(start..)?;
    let (mut size, mut values) = (column.uncompressed_size(), column.num_values());
    while !rest.is_empty() && values > 0 {
        let mut page = Page::default();
        structure(&mut rest, 0, &mut |path, value| match path {
            [UNCOMPRESSED] => page.uncompressed = value,
            [COMPRESSED] => page.compressed = value,
            [DATA | DATA_V2, 1] => page.values = value,
            [DICTIONARY, 1] => page.dictionary = value,
            _ => {}
        })?;
        size = size.checked_sub(page.uncompressed).filter(|left| *left >= 0 && page.uncompressed >= 0)?;
        values = values.checked_sub(page.values).filter(|left| *left >= 0 && page.values >= 0)?;
        (0..=OF_BYTE * page.uncompressed).contains(&page.dictionary).then_some(())?;
        rest = rest.get(usize::try_from(page.compressed).ok()?..)?;
    }
    (values == 0).then_some(())
}

#[derive(Default)]
struct Page {
    uncompressed: i64,
    compressed: i64,
    values: i64,
    dictionary: i64,
}

/// Passes over a struct and tells `number` each whole number in it with the numbers of the fields that lead there.
fn structure(rest: &mut &[u8], depth: usize, number: &mut dyn FnMut(&[i64], i64)) -> Option<()> {
    if depth >= MAX_DEPTH {
        return None;
    }
    let mut field = 0i64;
    loop {
        let head = byte(rest)?;
        if head == 0 {
            return Some(());
        }
        field = match head >> 4 {
            0 => zigzag(rest)?,
            step => field + i64::from(step),
        };
        value(rest, head & 0x0f, depth, &mut |path, found| number(&[&[field], path].concat(), found))?;
    }
}

fn value(rest: &mut &[u8], kind: u8, depth: usize, number: &mut dyn FnMut(&[i64], i64)) -> Option<()> {
    match kind {
        1 | 2 => {}
        3 => skip(rest, 1)?,
        4..=6 => number(&[], zigzag(rest)?),
        7 => skip(rest, 8)?,
        8 => {
            let len = varint(rest)?;
            skip(rest, usize::try_from(len).ok()?)?;
        }
        9 | 10 => {
            let head = byte(rest)?;
            let count = if head >> 4 == 15 { varint(rest)? } else { u64::from(head >> 4) };
            for _ in 0..count {
                // Truth values take a byte each in a list.
                match head & 0x0f {
                    1 | 2 => skip(rest, 1)?,
                    kind if depth + 1 < MAX_DEPTH => value(rest, kind, depth + 1, &mut |_, _| {})?,
                    _ => return None,
                }
            }
        }
        12 => structure(rest, depth + 1, number)?,
        _ => return None,
    }
    Some(())
}

fn byte(rest: &mut &[u8]) -> Option<u8> {
    let (first, behind) = rest.split_first()?;
    *rest = behind;
    Some(*first)
}

fn skip(rest: &mut &[u8], count: usize) -> Option<()> {
    *rest = rest.get(count..)?;
    Some(())
}

fn varint(rest: &mut &[u8]) -> Option<u64> {
    let mut value = 0u64;
    for shift in (0..64).step_by(7) {
        let next = byte(rest)?;
        value |= u64::from(next & 0x7f).checked_shl(shift)?;
        if next < 0x80 {
            return Some(value);
        }
    }
    None
}

fn zigzag(rest: &mut &[u8]) -> Option<i64> {
    varint(rest).map(|n| (n >> 1).cast_signed() ^ -((n & 1).cast_signed()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_of_a_header_are_found_by_their_fields() {
        // Field 1 = 0, field 2 = 150, field 3 = -1, field 5 a struct whose field 1 is 64; then the end.
        let mut rest: &[u8] = &[0x15, 0, 0x15, 0xac, 0x02, 0x15, 0x01, 0x2c, 0x15, 0x80, 0x01, 0, 0, 9];
        let mut found = Vec::new();
        structure(&mut rest, 0, &mut |path, value| found.push((path.to_vec(), value))).unwrap();
        assert_eq!(found, [(vec![1], 0), (vec![2], 150), (vec![3], -1), (vec![5, 1], 64)]);
        assert_eq!(rest, [9]);
        assert!(structure(&mut &[0x1c; 40][..], 0, &mut |_, _| {}).is_none(), "structs without an end");
    }
}
