//! The numbers of a message: CDR of ROS 2, or the plain bytes of ROS 1.

use super::definition::{Count, Definitions, Field, Kind};
use crate::cursor::Cursor;
use crate::number::Number;

/// Messages within messages.
const MAX_DEPTH: usize = 16;

/// Elements of a list that become channels; longer ones are pictures, scans and the like.
const MAX_ELEMENTS: usize = 64;

/// Numbers of one message that become channels.
const MAX_NUMBERS: usize = 1024;

/// How messages are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Encoding {
    Cdr,
    Ros1,
}

/// What a message holds.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Numbers {
    pub values: Vec<f64>,
    /// The path of each value; empty where none were asked for.
    pub paths: Vec<String>,
    /// Lengths of lists, which tell two kinds of messages of one topic apart.
    pub lengths: Vec<usize>,
    /// Texts in lists, such as the names of joints.
    pub names: Vec<String>,
    /// `header.stamp` in ns.
    pub stamp_ns: Option<i64>,
    /// Lists that were too long.
    pub long: Vec<String>,
}

/// Reads a message; [`None`] if it is not as its definition says.
pub(super) fn numbers(definitions: &Definitions, data: &[u8], encoding: Encoding, paths: bool) -> Option<Numbers> {
    let (cursor, widest) = match encoding {
        Encoding::Ros1 => (Cursor::little(data), 1),
        Encoding::Cdr => {
            let (header, rest) = data.split_first_chunk::<4>()?;
            // 0 and 1 are CDR, 6 and 7 its second version, which aligns to four bytes at most; odd ones are little-endian.
            let widest = match header[1] {
                0 | 1 => 8,
                6 | 7 => 4,
                _ => return None,
            };
            (Cursor { rest, big: header[1].is_multiple_of(2) }, widest)
        }
    };
    let mut reader =
        Reader { definitions, cursor, whole: cursor.rest.len(), widest, encoding, want_paths: paths, path: String::new(), found: Numbers::default() };
    reader.message(&definitions.root, 0)?;
    Some(reader.found)
}

struct Reader<'a> {
    definitions: &'a Definitions,
    cursor: Cursor<'a>,
    /// Bytes from which alignment counts.
    whole: usize,
    /// The widest alignment.
    widest: usize,
    encoding: Encoding,
    want_paths: bool,
    path: String,
    found: Numbers,
}

impl<'a> Reader<'a> {
    fn align(&mut self, size: usize) -> Option<()> {
        let at = self.whole - self.cursor.rest.len();
        let step = size.min(self.widest);
        self.cursor.take(at.next_multiple_of(step) - at).map(|_| ())
    }

    fn u32(&mut self) -> Option<usize> {
        self.align(4)?;
        usize::try_from(self.cursor.u32()?).ok()
    }

    fn message(&mut self, name: &str, depth: usize) -> Option<()> {
        let definitions = self.definitions;
        let fields = definitions.messages.get(name).filter(|_| depth < MAX_DEPTH)?;
        if fields.is_empty() && self.encoding == Encoding::Cdr {
            // An empty message has one byte.
            self.cursor.take(1)?;
        }
        fields.iter().try_for_each(|field| {
            let len = self.path.len();
            if self.want_paths {
                if len > 0 {
                    self.path.push('.');
                }
                self.path.push_str(&field.name);
            }
            self.field(field, depth)?;
            self.path.truncate(len);
            Some(())
        })
    }

    fn field(&mut self, field: &Field, depth: usize) -> Option<()> {
        let count = match field.count {
            Count::One => return self.value(field, depth, false),
            Count::Fixed(count) => count,
            Count::Counted => {
                let count = self.u32()?;
                self.found.lengths.push(count);
                count
            }
        };
        // Every element takes a byte at least, so that a wrong count ends here.
        if count > self.cursor.rest.len() {
            return None;
        }
        if let Kind::Number(number) = field.kind
            && count > MAX_ELEMENTS
        {
            if self.want_paths {
                self.found.long.push(self.path.clone());
            }
            self.align(number.size())?;
            return self.cursor.take(count.checked_mul(number.size())?).map(|_| ());
        }
        let len = self.path.len();
        for k in 0..count {
            if self.want_paths {
                self.path.push_str(&format!("_{k}"));
            }
            self.value(field, depth, true)?;
            self.path.truncate(len);
        }
        Some(())
    }

    fn value(&mut self, field: &Field, depth: usize, in_list: bool) -> Option<()> {
        match &field.kind {
            Kind::Number(number) => {
                let value = self.number(*number)?;
                self.add(value);
            }
            Kind::Text => {
                let count = self.u32()?;
                let text = self.cursor.take(count)?;
                if in_list {
                    self.found.names.push(String::from_utf8_lossy(text).trim_end_matches('\0').to_owned());
                }
            }
            Kind::WideText => {
                let count = self.u32()?;
                self.cursor.take(count.checked_mul(2)?)?;
            }
            Kind::Time(signed) => {
                self.align(4)?;
                let (seconds, nanoseconds) = (self.cursor.u32()?, self.cursor.u32()?);
                let seconds = if *signed { i64::from(seconds.cast_signed()) } else { i64::from(seconds) };
                let ns = 1_000_000_000 * seconds + i64::from(nanoseconds);
                // The one of the header comes first, and the header is the first field.
                if depth == 1 && self.found.stamp_ns.is_none() && self.found.values.is_empty() && field.name == "stamp" {
                    self.found.stamp_ns = Some(ns);
                } else {
                    self.add(ns as f64 * 1e-9);
                }
            }
            Kind::Message(name) => self.message(name, depth + 1)?,
        }
        Some(())
    }

    fn add(&mut self, value: f64) {
        if self.found.values.len() < MAX_NUMBERS {
            self.found.values.push(value);
            if self.want_paths {
                self.found.paths.push(self.path.clone());
            }
        }
    }

    fn number(&mut self, number: Number) -> Option<f64> {
        self.align(number.size())?;
        number.next(&mut self.cursor)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_aligned_behind_the_four_bytes_of_the_header() {
        let definitions = Definitions::parse("a/B", "uint8 flag\nfloat64 x\nstring s\nint16[] k\n").unwrap();
        let mut data = vec![0, 1, 0, 0, 7, 0, 0, 0, 0, 0, 0, 0];
        data.extend_from_slice(&1.5f64.to_le_bytes());
        data.extend_from_slice(&[3, 0, 0, 0, b'h', b'i', 0, 0, 2, 0, 0, 0, 5, 0, 0xff, 0xff]);
        let found = numbers(&definitions, &data, Encoding::Cdr, true).unwrap();
        assert_eq!(found.values, [7.0, 1.5, 5.0, -1.0]);
        assert_eq!(found.paths, ["flag", "x", "k_0", "k_1"]);
        assert_eq!(found.lengths, [2]);
        for cut in 0..data.len() {
            assert_eq!(numbers(&definitions, &data[..cut], Encoding::Cdr, true), None, "{cut}");
        }
    }

    #[test]
    fn a_message_that_holds_itself_ends() {
        let definitions = Definitions::parse("a/B", "B inner\n").unwrap();
        assert_eq!(numbers(&definitions, &[0, 1, 0, 0, 1], Encoding::Cdr, false), None);
    }
}
