//! The parameter section of a C3D file: groups of named values.

use crate::cursor::Cursor;
use crate::names::key;
use std::collections::BTreeMap;

/// Bytes of a block, in which places are counted.
pub(super) const BLOCK: usize = 512;

/// Characters of a value that is kept as a fact.
const MAX_FACT: usize = 4000;

/// How a processor writes its numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Processor {
    Intel,
    Dec,
    Mips,
}

impl Processor {
    pub fn of(byte: u8) -> Option<Self> {
        Some(match byte {
            84 => Processor::Intel,
            85 => Processor::Dec,
            86 => Processor::Mips,
            _ => return None,
        })
    }

    pub fn cursor(self, bytes: &[u8]) -> Cursor<'_> {
        Cursor { rest: bytes, big: self == Processor::Mips }
    }

    /// A number of 32 bits; DEC's have their halves exchanged and an exponent that is two higher.
    pub fn f32(self, cursor: &mut Cursor<'_>) -> Option<f32> {
        match self {
            Processor::Dec => cursor.u32().map(|bits| f32::from_bits(bits.rotate_left(16)) / 4.0),
            _ => cursor.f32(),
        }
    }
}

/// The values of a parameter.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Data {
    Texts(Vec<String>),
    Numbers(Vec<f64>),
}

/// All parameters by group and name, in capitals.
#[derive(Clone, Debug, Default)]
pub(crate) struct Parameters {
    values: BTreeMap<(String, String), Data>,
}

impl Parameters {
    /// Reads the section that begins at `start`.
    pub(super) fn read(bytes: &[u8], start: usize, processor: Processor) -> Result<Self, String> {
        let mut groups: BTreeMap<i8, String> = BTreeMap::new();
        let mut found: Vec<(i8, String, Data)> = Vec::new();
        // Behind the section's own four bytes.
        let mut at = start + 4;
        let ended = |at: usize| format!("the parameters end in the middle of one (byte {at})");
        while let Some([name_len, id]) = bytes.get(at..at + 2).map(|b| [b[0].cast_signed(), b[1].cast_signed()]) {
            if name_len == 0 {
                break;
            }
            let mut cursor = processor.cursor(&bytes[at + 2..]);
            let name = text(cursor.take(usize::from(name_len.unsigned_abs())).ok_or_else(|| ended(at))?).to_uppercase();
            let here = bytes.len() - cursor.rest.len();
            let next = usize::from(cursor.u16().ok_or_else(|| ended(at))?);
            if id < 0 {
                groups.insert(id.saturating_neg(), name);
            } else {
                let data = values(&mut cursor, processor).ok_or_else(|| ended(at))?;
                found.push((id, name, data));
            }
            if next == 0 {
                break;
            }
            // At least behind the two bytes that say where; so it goes on.
            at = here + next.max(2);
        }
        let values = found.into_iter().filter_map(|(id, name, data)| Some(((groups.get(&id)?.clone(), name), data))).collect();
        Ok(Parameters { values })
    }

    fn get(&self, group: &str, name: &str) -> Option<&Data> {
        self.values.get(&(group.to_owned(), name.to_owned()))
    }

    /// The texts of a parameter, and of those that go on where 255 of them were not enough: `LABELS`, `LABELS2` …
    pub fn texts(&self, group: &str, name: &str) -> Vec<String> {
        self.all(group, name).filter_map(|data| if let Data::Texts(texts) = data { Some(texts.iter().cloned()) } else { None }).flatten().collect()
    }

    /// The numbers of a parameter and those that go on.
    pub fn numbers(&self, group: &str, name: &str) -> Vec<f64> {
        self.all(group, name).filter_map(|data| if let Data::Numbers(numbers) = data { Some(numbers.iter().copied()) } else { None }).flatten().collect()
    }

    fn all<'a>(&'a self, group: &'a str, name: &'a str) -> impl Iterator<Item = &'a Data> {
        let more = (2..).map_while(move |k| self.get(group, &format!("{name}{k}")));
        self.get(group, name).into_iter().chain(more)
    }

    /// The first number of a parameter.
    pub fn number(&self, group: &str, name: &str) -> Option<f64> {
        self.numbers(group, name).first().copied()
    }

    /// Adds what only `other` has.
    pub fn add_missing(&mut self, other: &Parameters) {
        other.values.iter().for_each(|(key, data)| {
            self.values.entry(key.clone()).or_insert_with(|| data.clone());
        });
    }

    /// Every value that describes no channel, as `GROUP.NAME` and text.
    pub fn facts(&self) -> impl Iterator<Item = (String, String)> {
        self.values.iter().filter(|((group, _), _)| !["POINT", "ANALOG", "EVENT", "EVENTS"].contains(&group.as_str())).filter_map(|((group, name), data)| {
            let text = match data {
                Data::Texts(texts) => texts.iter().map(|t| t.trim()).collect::<Vec<_>>().join(", "),
                Data::Numbers(numbers) => numbers.iter().map(|n| n.to_string()).collect::<Vec<_>>().join(", "),
            };
            let kept = !text.trim_matches([',', ' ']).is_empty() && text.len() <= MAX_FACT && !text.contains(char::is_control);
            kept.then(|| (key(&format!("{group}.{name}")), text))
        })
    }
}

/// Texts of these files are in one byte a character.
pub(super) fn text(bytes: &[u8]) -> String {
    match std::str::from_utf8(bytes) {
        Ok(text) => text.trim_end_matches(['\0', ' ']).trim_start().to_owned(),
        Err(_) => bytes.iter().map(|&b| char::from(b)).collect::<String>().trim_end_matches(['\0', ' ']).to_owned(),
    }
}

fn values(cursor: &mut Cursor<'_>, processor: Processor) -> Option<Data> {
    let kind = cursor.i8()?;
    let dimensions = cursor.u8()?;
    let sizes: Vec<usize> = cursor.take(usize::from(dimensions))?.iter().map(|&n| usize::from(n)).collect();
    let count = sizes.iter().try_fold(1usize, |n, &size| n.checked_mul(size))?;
    let data = cursor.take(count.checked_mul(usize::from(kind.unsigned_abs()))?)?;
    Some(match kind {
        -1 => {
            let width = sizes.first().copied().unwrap_or(1);
            Data::Texts(if width == 0 { Vec::new() } else { data.chunks(width).map(text).collect() })
        }
        1 => Data::Numbers(data.iter().map(|&b| f64::from(b.cast_signed())).collect()),
        2 => Data::Numbers(numbers(processor.cursor(data), |c| c.i16().map(f64::from))),
        4 => Data::Numbers(numbers(processor.cursor(data), |c| processor.f32(c).map(f64::from))),
        _ => return None,
    })
}

fn numbers(mut cursor: Cursor<'_>, mut next: impl FnMut(&mut Cursor<'_>) -> Option<f64>) -> Vec<f64> {
    std::iter::from_fn(|| next(&mut cursor)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_of_a_vax_are_understood() {
        // 1.0 is 0x4080 in the first half, by the F format of VAX.
        let mut cursor = Cursor::little(&[0x80, 0x40, 0, 0, 0x20, 0xc1, 0, 0]);
        assert_eq!(Processor::Dec.f32(&mut cursor), Some(1.0));
        assert_eq!(Processor::Dec.f32(&mut cursor), Some(-2.5));
    }
}
