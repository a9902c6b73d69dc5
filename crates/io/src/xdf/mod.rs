//! XDF, what the Lab Streaming Layer records: streams of several clocks, each with its offsets to the recording computer's.
//!
//! Streams of numbers at a rate are channels, on one clock (see [`crate::join`]); texts are events, `event/TEXT` with their times.
//! After "XDF specification", version 1.0, SCCN.

mod clock;
mod xml;

use crate::cursor::Cursor;
use crate::error::{IoError, listed};
use crate::join::{Stream, Times, join};
use crate::limits::{Budget, MAX_CHANNELS, MAX_ENTRIES};
use crate::names::{MAX_NAME, key};
use crate::number::Number;
use crate::recording::Note;
use crate::table::{Column, Table};
use clock::Offsets;
use std::collections::BTreeMap;

/// The format's name in messages.
const XDF: &str = "XDF";

/// Bytes of events that are kept as facts.
const MAX_EVENTS: usize = 1 << 20;

/// Bytes in memory of a channel without samples.
const OF_CHANNEL: u64 = 128;

/// Kinds of chunks.
const STREAM: u16 = 2;
const SAMPLES: u16 = 3;
const OFFSET: u16 = 4;

/// The type of a stream's values by its name: of numbers, or of texts.
fn kind(name: &str) -> Option<Option<Number>> {
    Some(match name {
        "int8" => Some(Number::I8),
        "int16" => Some(Number::I16),
        "int32" => Some(Number::I32),
        "int64" => Some(Number::I64),
        "float32" => Some(Number::F32),
        "double64" => Some(Number::F64),
        "string" => None,
        _ => return None,
    })
}

/// What is read of one stream.
struct Open {
    name: String,
    /// The type of its numbers, if it does not hold texts.
    kind: Option<Number>,
    rate_hz: f64,
    labels: Vec<(String, Option<String>)>,
    columns: Vec<Vec<f64>>,
    stamps_s: Vec<f64>,
    events: Vec<(String, f64)>,
    offsets: Offsets,
}

/// Reads an XDF file.
pub(crate) fn read(bytes: &[u8], file: &str) -> Result<Table, IoError> {
    let damaged = |what: String| IoError::Damaged { file: file.to_owned(), format: XDF, what };
    let mut budget = Budget::of(bytes.len());
    let mut streams: BTreeMap<u32, Open> = BTreeMap::new();
    let mut unknown = Vec::new();
    let mut cursor = Cursor::little(bytes.get(4..).unwrap_or_default());
    while !cursor.rest.is_empty() {
        let at = bytes.len() - cursor.rest.len();
        let cut = || damaged(format!("the chunk at byte {at} is not complete"));
        let len = length(&mut cursor).ok_or_else(cut)?;
        let mut chunk = Cursor::little(cursor.take(len).ok_or_else(cut)?);
        let tag = chunk.u16().ok_or_else(cut)?;
        if ![STREAM, SAMPLES, OFFSET].contains(&tag) {
            continue;
        }
        let id = chunk.u32().ok_or_else(cut)?;
        if tag == STREAM {
            match open(&String::from_utf8_lossy(chunk.rest)) {
                Ok(stream) if streams.len() < MAX_ENTRIES => {
                    budget.claim(file, OF_CHANNEL * stream.labels.len() as u64)?;
                    streams.insert(id, stream);
                }
                Ok(_) => return Err(damaged(format!("it has more than {MAX_ENTRIES} streams"))),
                Err(what) => unknown.push(what),
            }
            continue;
        }
        let Some(stream) = streams.get_mut(&id) else { continue };
        if tag == OFFSET {
            stream.offsets.at_s.push(chunk.f64().ok_or_else(cut)?);
            stream.offsets.offset_s.push(chunk.f64().ok_or_else(cut)?);
        } else {
            // A number takes at least a byte in the file and eight in memory.
            budget.claim(file, 8 * chunk.rest.len() as u64)?;
            samples(stream, &mut chunk).ok_or_else(|| damaged(format!("the samples at byte {at} are not those of stream \"{}\"", stream.name)))?;
        }
    }
    table(file, streams.into_values().collect(), unknown, &mut budget)
}

/// A length in one, four or eight bytes.
fn length(cursor: &mut Cursor<'_>) -> Option<usize> {
    match cursor.u8()? {
        1 => cursor.u8().map(usize::from),
        4 => usize::try_from(cursor.u32()?).ok(),
        8 => usize::try_from(cursor.u64()?).ok(),
        _ => None,
    }
}

/// The stream that a header describes, or what is not understood.
fn open(header: &str) -> Result<Open, String> {
    let name = xml::text(header, "name").unwrap_or_else(|| "stream".to_owned());
    let format = xml::text(header, "channel_format").unwrap_or_default();
    let kind = kind(&format).ok_or_else(|| format!("{name} (values of type \"{format}\")"))?;
    let count = xml::text(header, "channel_count").and_then(|text| text.parse::<usize>().ok()).filter(|n| (1..=MAX_CHANNELS).contains(n));
    let count = count.ok_or_else(|| format!("{name} (no number of channels up to {MAX_CHANNELS})"))?;
    let rate_hz = xml::text(header, "nominal_srate").and_then(|text| text.parse().ok()).filter(|rate: &f64| rate.is_finite() && *rate > 0.0).unwrap_or(0.0);
    let described = xml::elements(header, "channels").next().unwrap_or_default();
    let mut described = xml::elements(described, "channel");
    let label = |k: usize| {
        let channel = described.next().unwrap_or_default();
        let own = xml::text(channel, "label").filter(|label| label.len() <= MAX_NAME);
        let made = || if count == 1 { name.clone() } else { format!("{name}_{}", k + 1) };
        (own.unwrap_or_else(made), xml::text(channel, "unit"))
    };
    let labels = (0..count).map(label).collect();
    Ok(Open { kind, rate_hz, labels, columns: vec![Vec::new(); count], stamps_s: Vec::new(), events: Vec::new(), offsets: Offsets::default(), name })
}

/// Appends a chunk of samples. A sample without a time of its own follows the one before at the nominal rate.
fn samples(stream: &mut Open, chunk: &mut Cursor<'_>) -> Option<()> {
    let count = length(chunk)?;
    let step_s = if stream.rate_hz > 0.0 { 1.0 / stream.rate_hz } else { 0.0 };
    for _ in 0..count {
        let time_s = match chunk.u8()? {
            0 => stream.stamps_s.last().copied().unwrap_or(0.0) + step_s,
            8 => chunk.f64()?,
            _ => return None,
        };
        stream.stamps_s.push(time_s);
        for k in 0..stream.columns.len() {
            if let Some(number) = stream.kind {
                stream.columns[k].push(number.next(chunk)?);
            } else {
                let len = length(chunk)?;
                stream.events.push((String::from_utf8_lossy(chunk.take(len)?).into_owned(), time_s));
            }
        }
    }
    Some(())
}

fn table(file: &str, streams: Vec<Open>, mut unknown: Vec<String>, budget: &mut Budget) -> Result<Table, IoError> {
    let damaged = |what: String| IoError::Damaged { file: file.to_owned(), format: XDF, what };
    let any_regular = streams.iter().any(|s| s.kind.is_some() && s.rate_hz > 0.0);
    let mut facts: BTreeMap<String, String> = BTreeMap::new();
    let mut joined = Vec::new();
    let mut kept = 0;
    for stream in streams {
        let reset = || {
            IoError::unsuitable(
                file,
                format!("the clock of stream \"{}\" was set anew while it was recorded", stream.name),
                "read it with pyxdf, which takes such a recording apart, and save the parts",
            )
        };
        let Some(number) = stream.kind else {
            let times = stream.offsets.apply(stream.events.iter().map(|(_, t)| *t).collect()).ok_or_else(reset)?;
            for ((text, _), time_s) in stream.events.iter().zip(times).filter(|((text, _), _)| !text.trim().is_empty()) {
                kept += text.len() + 24;
                if kept > MAX_EVENTS {
                    break;
                }
                let times = facts.entry(format!("event/{}", key(text))).or_default();
                *times += &if times.is_empty() { time_s.to_string() } else { format!(", {time_s}") };
            }
            continue;
        };
        if stream.rate_hz == 0.0 && any_regular {
            unknown.push(format!("{} (numbers without a rate)", stream.name));
            continue;
        }
        let stamps = stream.offsets.apply(stream.stamps_s).ok_or_else(reset)?;
        let increasing = |stamps: Vec<f64>| stamps.windows(2).all(|pair| pair[1] > pair[0]).then_some(Times::Stamps(stamps));
        let times = if stamps.len() > 2 && stream.rate_hz > 0.0 { clock::smooth(&stamps, stream.rate_hz) } else { increasing(stamps) };
        let times = times.ok_or_else(|| damaged(format!("time runs backwards in stream \"{}\"", stream.name)))?;
        let column = |((name, unit), samples): ((String, Option<String>), Vec<f64>)| Column { name, unit, samples, rounding: number.rounding() };
        joined.push(Stream { times, columns: stream.labels.into_iter().zip(stream.columns).map(column).collect(), name: stream.name });
    }
    let mut table = join(file, joined, budget)?;
    table.rename_repeated();
    table.metadata.extend(facts);
    if !unknown.is_empty() {
        table.notes.push(Note::new("ignored-streams", format!("streams that are not read: {}", listed(&unknown)), "save them as channels with a rate"));
    }
    if kept > MAX_EVENTS {
        table.notes.push(Note::new("ignored-events", format!("of the events, only the first {MAX_EVENTS} bytes are kept"), "read them with pyxdf"));
    }
    Ok(table)
}
