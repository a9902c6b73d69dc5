//! Events of a C3D file, wherever programs keep them.

use super::parameters::{BLOCK, Parameters, Processor, text};
use crate::cursor::Cursor;
use crate::names::key;
use std::collections::BTreeMap;

/// What a header says where it keeps events.
const PRESENT: u16 = 12345;
/// Where the header speaks of its own events.
const IN_HEADER: usize = 298;
/// Where the header speaks of a section of events.
const IN_SECTION: usize = 294;
/// Events that a header has room for.
const MAX_IN_HEADER: usize = 18;
/// The first byte but one of a section of events.
const SECTION_KEY: u8 = 90;

/// The times of each event as facts: `event/LABEL` with seconds, in order.
pub(super) fn facts(bytes: &[u8], processor: Processor, parameters: &Parameters) -> BTreeMap<String, String> {
    let mut found = of_section(bytes, processor).unwrap_or_default();
    if found.is_empty() {
        found = of_group(parameters);
    }
    if found.is_empty() {
        found = of_header(bytes, processor).unwrap_or_default();
    }
    found.sort_by(|a, b| a.1.total_cmp(&b.1));
    let mut facts: BTreeMap<String, String> = BTreeMap::new();
    for (label, time_s) in found.into_iter().filter(|(label, time_s)| !label.is_empty() && time_s.is_finite()) {
        let times = facts.entry(format!("event/{}", key(&label))).or_default();
        if !times.is_empty() {
            times.push_str(", ");
        }
        times.push_str(&time_s.to_string());
    }
    facts
}

/// The groups `EVENT` (minutes and seconds) and, of KINARM, `EVENTS` (a number that is not used, and seconds).
fn of_group(parameters: &Parameters) -> Vec<(String, f64)> {
    let events = |group: &str, minutes: f64| -> Vec<(String, f64)> {
        let (labels, times, contexts) = (parameters.texts(group, "LABELS"), parameters.numbers(group, "TIMES"), parameters.texts(group, "CONTEXTS"));
        let pairs = times.len() >= 2 * labels.len();
        let time = |k: usize| if pairs { Some(minutes * times.get(2 * k)? + times.get(2 * k + 1)?) } else { times.get(k).copied() };
        let named = |k: usize, label: String| match contexts.get(k).filter(|c| !c.is_empty()) {
            Some(context) => format!("{context} {label}"),
            None => label,
        };
        labels.into_iter().enumerate().filter_map(|(k, label)| Some((named(k, label), time(k)?))).collect()
    };
    let found = events("EVENT", 60.0);
    if found.is_empty() { events("EVENTS", 0.0) } else { found }
}

/// Up to 18 events with four letters each.
fn of_header(bytes: &[u8], processor: Processor) -> Option<Vec<(String, f64)>> {
    let mut cursor = processor.cursor(bytes.get(IN_HEADER..BLOCK)?);
    if cursor.u16()? != PRESENT {
        return None;
    }
    let count = usize::from(cursor.u16()?).min(MAX_IN_HEADER);
    let mut times = processor.cursor(bytes.get(304..BLOCK)?);
    let mut labels = processor.cursor(bytes.get(396..BLOCK)?);
    (0..count).map(|_| Some((text(labels.take(4)?), f64::from(processor.f32(&mut times)?)))).collect()
}

/// The section of events and ranges, of which the events are read.
fn of_section(bytes: &[u8], processor: Processor) -> Option<Vec<(String, f64)>> {
    let mut cursor = processor.cursor(bytes.get(IN_SECTION..BLOCK)?);
    if cursor.u16()? != PRESENT {
        return None;
    }
    let start = usize::from(cursor.u16()?).checked_sub(1)? * BLOCK;
    let mut cursor: Cursor<'_> = processor.cursor(bytes.get(start..)?);
    if cursor.u8()? != SECTION_KEY {
        return None;
    }
    let (_records, count, width, _ranges, _range_width) = (cursor.u16()?, cursor.u16()?, cursor.u16()?, cursor.u16()?, cursor.u16()?);
    let mut events = Vec::new();
    for _ in 0..count {
        let label = text(cursor.take(usize::from(width))?);
        events.push((label, f64::from(processor.f32(&mut cursor)?)));
        // A switch of the display, and four bytes that nothing uses.
        cursor.take(5)?;
    }
    Some(events)
}
