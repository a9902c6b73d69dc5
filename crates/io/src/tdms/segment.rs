//! The segments of a TDMS file: what they say of each object, and where its numbers lie.

use crate::cursor::Cursor;
use crate::number::Number;
use std::collections::BTreeMap;
use std::rc::Rc;

/// Bytes of a lead-in.
const LEAD: usize = 28;

/// Objects of a file, properties of an object: more are no measurement.
const MAX_OBJECTS: usize = 1 << 16;

/// What a lead-in says of its segment.
const HAS_METADATA: u32 = 1 << 1;
const NEW_LIST: u32 = 1 << 2;
const HAS_RAW: u32 = 1 << 3;
const INTERLEAVED: u32 = 1 << 5;
const BIG_ENDIAN: u32 = 1 << 6;

/// Seconds and fractions of 2⁻⁶⁴ s since 1904.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Stamp {
    pub seconds: i64,
    pub fraction: u64,
}

impl Stamp {
    /// Seconds since another one.
    pub fn since(self, other: Stamp) -> f64 {
        self.seconds.saturating_sub(other.seconds) as f64 + (self.fraction as f64 - other.fraction as f64) / 2f64.powi(64)
    }
}

/// A property's value.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Property {
    Number(f64),
    Text(String),
    Time(Stamp),
}

/// The type of values, as far as they are numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    Number(Number),
    Time,
    /// What is no number, with the bytes of one value.
    Other(usize),
    /// Texts, which say their bytes as a whole.
    Texts,
}

impl Kind {
    fn of(code: u32) -> Option<Self> {
        Some(match code {
            1 => Kind::Number(Number::I8),
            2 => Kind::Number(Number::I16),
            3 => Kind::Number(Number::I32),
            4 => Kind::Number(Number::I64),
            5 | 0x21 => Kind::Number(Number::U8),
            6 => Kind::Number(Number::U16),
            7 => Kind::Number(Number::U32),
            8 => Kind::Number(Number::U64),
            9 | 0x19 => Kind::Number(Number::F32),
            10 | 0x1a => Kind::Number(Number::F64),
            0x44 => Kind::Time,
            0x20 => Kind::Texts,
            0x0008_000c => Kind::Other(8),
            0x0010_000d => Kind::Other(16),
            _ => return None,
        })
    }

    pub fn size(self) -> usize {
        match self {
            Kind::Number(number) => number.size(),
            Kind::Time => 16,
            Kind::Other(size) => size,
            Kind::Texts => 0,
        }
    }

    /// The next value as a number; a time as seconds since `first`, which the first one sets.
    pub fn number(self, cursor: &mut Cursor<'_>, first: &mut Option<Stamp>) -> Option<f64> {
        match self {
            Kind::Number(number) => number.next(cursor),
            Kind::Time => stamp(cursor).map(|stamp| stamp.since(*first.get_or_insert(stamp))),
            Kind::Other(_) | Kind::Texts => None,
        }
    }
}

fn stamp(cursor: &mut Cursor<'_>) -> Option<Stamp> {
    // The halves change places with the byte order.
    let (a, b) = (cursor.u64()?, cursor.u64()?);
    Some(if cursor.big { Stamp { seconds: a.cast_signed(), fraction: b } } else { Stamp { seconds: b.cast_signed(), fraction: a } })
}

/// How many values of an object each chunk of a segment has.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Index {
    pub kind: Kind,
    pub count: usize,
    /// Bytes of a chunk.
    pub bytes: usize,
}

/// An object of a file: its path and what is known of it.
#[derive(Clone, Debug, Default)]
pub(super) struct Object {
    pub index: Option<Index>,
    pub properties: BTreeMap<String, Property>,
}

/// A stretch of raw data: the objects that are in each of its chunks.
#[derive(Clone, Debug)]
pub(super) struct Raw<'a> {
    pub data: &'a [u8],
    pub big: bool,
    pub interleaved: bool,
    pub objects: Rc<Vec<(String, Index)>>,
}

/// All segments of a file.
#[derive(Debug, Default)]
pub(super) struct Segments<'a> {
    /// In the order in which they came.
    pub paths: Vec<String>,
    pub objects: BTreeMap<String, Object>,
    pub raw: Vec<Raw<'a>>,
}

/// Reads what each segment says.
pub(super) fn segments(bytes: &[u8]) -> Result<Segments<'_>, String> {
    let mut found = Segments::default();
    let mut active: Vec<String> = Vec::new();
    let mut listed = Rc::default();
    let mut at = 0;
    while bytes.len() - at >= LEAD {
        let wrong = |what: &str| format!("the segment at byte {at} {what}");
        let segment = &bytes[at..];
        if !segment.starts_with(b"TDSm") {
            return Err(wrong("does not begin as one"));
        }
        let mut lead = Cursor::little(&segment[4..]);
        let flags = lead.u32().unwrap_or(0);
        lead.big = flags & BIG_ENDIAN != 0;
        let (Some(_version), Some(next), Some(raw)) = (lead.u32(), lead.u64(), lead.u64()) else { return Err(wrong("ends in its lead-in")) };
        let body = &segment[LEAD..];
        // A program that stopped while writing leaves all ones: the segment goes to the end of the file.
        let body = if next == u64::MAX { body } else { usize::try_from(next).ok().and_then(|n| body.get(..n)).ok_or_else(|| wrong("is cut off"))? };
        let (metadata, raw) = usize::try_from(raw).ok().and_then(|n| body.split_at_checked(n)).ok_or_else(|| wrong("has its numbers outside of itself"))?;
        if flags & HAS_METADATA != 0 {
            if flags & NEW_LIST != 0 {
                active.clear();
            }
            let mut cursor = Cursor { rest: metadata, big: lead.big };
            objects(&mut cursor, &mut found, &mut active).ok_or_else(|| wrong("has metadata that are not understood"))??;
            listed = Rc::new(active.iter().filter_map(|path| Some((path.clone(), found.objects.get(path)?.index?))).collect());
        }
        if flags & HAS_RAW != 0 {
            found.raw.push(Raw { data: raw, big: lead.big, interleaved: flags & INTERLEAVED != 0, objects: Rc::clone(&listed) });
        }
        at += LEAD + body.len();
    }
    Ok(found)
}

/// Reads the objects of a segment into `found` and the list of those that have raw data.
fn objects(cursor: &mut Cursor<'_>, found: &mut Segments<'_>, active: &mut Vec<String>) -> Option<Result<(), String>> {
    let count = cursor.u32()?;
    for _ in 0..count {
        let path = cursor.text()?;
        if !found.objects.contains_key(&path) {
            if found.paths.len() >= MAX_OBJECTS {
                return Some(Err(format!("it has more than {MAX_OBJECTS} objects")));
            }
            found.paths.push(path.clone());
        }
        let object = found.objects.entry(path.clone()).or_default();
        match cursor.u32()? {
            // No raw data here.
            u32::MAX => active.retain(|other| *other != path),
            // As before.
            0 => activate(active, path),
            0x6912_0000 | 0x6913_0000 => return Some(Err(format!("{path} holds raw data of a DAQmx device; save it scaled"))),
            _ => {
                let code = cursor.u32()?;
                let (_dimension, count) = (cursor.u32()?, usize::try_from(cursor.u64()?).ok()?);
                let Some(kind) = Kind::of(code) else { return Some(Err(format!("{path} has values of type {code:#x}, which is not known here"))) };
                let bytes = if kind == Kind::Texts { usize::try_from(cursor.u64()?).ok()? } else { count.checked_mul(kind.size())? };
                object.index = Some(Index { kind, count, bytes });
                activate(active, path);
            }
        }
        for _ in 0..cursor.u32()? {
            let name = cursor.text()?;
            let code = cursor.u32()?;
            let value = match (code, Kind::of(code)) {
                (0x20, _) => Property::Text(cursor.text()?),
                (_, Some(Kind::Time)) => Property::Time(stamp(cursor)?),
                (_, Some(kind)) if !matches!(kind, Kind::Other(_) | Kind::Texts) => Property::Number(kind.number(cursor, &mut None)?),
                _ => return None,
            };
            object.properties.insert(name, value);
        }
    }
    Some(Ok(()))
}

fn activate(active: &mut Vec<String>, path: String) {
    if !active.contains(&path) {
        active.push(path);
    }
}
