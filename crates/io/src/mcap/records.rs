//! The records of an MCAP file, chunks unpacked: schemas, channels and messages in the order of the file.

use crate::cursor::Cursor;
use crate::error::IoError;
use crate::limits::Budget;
use flate2::Crc;
use std::io::Read;

/// What every file begins and ends with.
/// The format's name in messages.
pub(super) const MCAP: &str = "MCAP";
pub(super) const MAGIC: &[u8] = b"\x89MCAP0\r\n";

/// Bytes that a chunk of zstd may look back; chunks of MCAP have one to four MB.
const MAX_WINDOW: u64 = 1 << 23;

/// Kinds of records.
const FOOTER: u8 = 2;
const SCHEMA: u8 = 3;
const CHANNEL: u8 = 4;
const MESSAGE: u8 = 5;
const CHUNK: u8 = 6;
const DATA_END: u8 = 15;

/// A record that tells of messages.
#[derive(Debug)]
pub(super) enum Record<'a> {
    Schema { id: u16, name: String, encoding: String, data: &'a [u8] },
    Channel { id: u16, schema: u16, topic: String, encoding: String },
    Message { channel: u16, log_ns: u64, data: &'a [u8] },
}

/// Hands every record of the file to `take`.
pub(super) fn each(bytes: &[u8], file: &str, budget: &mut Budget, take: &mut dyn FnMut(Record<'_>, &mut Budget) -> Result<(), IoError>) -> Result<(), IoError> {
    let damaged = |what: String| IoError::Damaged { file: file.to_owned(), format: MCAP, what };
    let mut cursor = Cursor::little(bytes.get(MAGIC.len()..).unwrap_or_default());
    loop {
        let at = bytes.len() - cursor.rest.len();
        let cut = || damaged(format!("the record at byte {at} is not complete; `mcap recover` saves what is there"));
        let (kind, content) = record(&mut cursor).ok_or_else(cut)?;
        match kind {
            DATA_END | FOOTER => return Ok(()),
            CHUNK => {
                let inside = unpacked(content, file, budget)?.map_err(|what| damaged(format!("the chunk at byte {at} {what}")))?;
                let mut cursor = Cursor::little(&inside);
                while !cursor.rest.is_empty() {
                    let (kind, content) = record(&mut cursor).ok_or_else(cut)?;
                    if let Some(record) = understood(kind, content).ok_or_else(cut)? {
                        take(record, budget)?;
                    }
                }
            }
            kind => {
                if let Some(record) = understood(kind, content).ok_or_else(cut)? {
                    take(record, budget)?;
                }
            }
        }
    }
}

fn record<'a>(cursor: &mut Cursor<'a>) -> Option<(u8, &'a [u8])> {
    let kind = cursor.u8()?;
    let len = usize::try_from(cursor.u64()?).ok()?;
    Some((kind, cursor.take(len)?))
}

/// The record, nothing for a kind that does not matter here, [`None`] if it is damaged.
fn understood(kind: u8, content: &[u8]) -> Option<Option<Record<'_>>> {
    let mut c = Cursor::little(content);
    Some(match kind {
        SCHEMA => Some(Record::Schema { id: c.u16()?, name: c.text()?, encoding: c.text()?, data: c.block()? }),
        CHANNEL => Some(Record::Channel { id: c.u16()?, schema: c.u16()?, topic: c.text()?, encoding: c.text()? }),
        MESSAGE => {
            let (channel, _sequence, log_ns, _publish_ns) = (c.u16()?, c.u32()?, c.u64()?, c.u64()?);
            Some(Record::Message { channel, log_ns, data: c.rest })
        }
        _ => None,
    })
}

/// The records of a chunk.
fn unpacked(content: &[u8], file: &str, budget: &mut Budget) -> Result<Result<Vec<u8>, String>, IoError> {
    let mut c = Cursor::little(content);
    let head = (|| Some((c.u64()?, c.u64()?, c.u64()?, c.u32()?, c.text()?, c.u64()?)))();
    let Some((_start, _end, size, checksum, compression, packed)) = head else { return Ok(Err("is not complete".to_owned())) };
    let Some(packed) = usize::try_from(packed).ok().and_then(|len| c.take(len)) else { return Ok(Err("is not complete".to_owned())) };
    let unpack = |stream: &mut dyn Read, budget: &mut Budget| Ok::<_, IoError>(budget.unpack(file, stream)?.map_err(|e| format!("cannot be unpacked ({e})")));
    let unpacked = match compression.as_str() {
        "" => unpack(&mut { packed }, budget)?,
        "lz4" => unpack(&mut lz4_flex::frame::FrameDecoder::new(packed), budget)?,
        "zstd" => match window(packed) {
            Some(window) if window <= MAX_WINDOW.max(size.min(4 * packed.len() as u64)) => match ruzstd::decoding::StreamingDecoder::new(packed) {
                Ok(mut stream) => unpack(&mut stream, budget)?,
                Err(e) => Err(format!("cannot be unpacked ({e})")),
            },
            _ => Err("does not begin as zstd does, or looks back too far".to_owned()),
        },
        other => Err(format!("is compressed with \"{other}\", which is not known here")),
    };
    Ok(unpacked.and_then(|data| {
        let mut crc = Crc::new();
        crc.update(&data);
        if data.len() as u64 != size || (checksum != 0 && crc.sum() != checksum) { Err("is not what its size and checksum say".to_owned()) } else { Ok(data) }
    }))
}

/// Bytes that a frame of zstd looks back, by its header (RFC 8878, 3.1.1.1).
fn window(frame: &[u8]) -> Option<u64> {
    let [0x28, 0xb5, 0x2f, 0xfd, descriptor, rest @ ..] = frame else { return None };
    if descriptor & 0x20 == 0 {
        let [window, ..] = rest else { return None };
        let base = 1u64 << (10 + (window >> 3));
        return Some(base + base / 8 * u64::from(window & 7));
    }
    // A single segment: the window is the size of the content, behind the number of a dictionary.
    let dictionary = [0, 1, 2, 4][usize::from(descriptor & 3)];
    let mut c = Cursor::little(rest.get(dictionary..)?);
    Some(match descriptor >> 6 {
        0 => c.u8()?.into(),
        1 => u64::from(c.u16()?) + 256,
        2 => c.u32()?.into(),
        _ => c.u64()?,
    })
}
