//! TDMS, LabVIEW's measurement files: groups of channels, each with its own rate.
//!
//! Groups that hold the same channels and differ in their number alone are trials. Otherwise all channels are of one recording, on one clock (see [`crate::join`]). A
//! channel's rate is its property `wf_increment`, its unit `unit_string`. After "TDMS File Format Internal Structure", NI.

mod segment;

use crate::assemble::is_time;
use crate::cursor::Cursor;
use crate::error::{IoError, listed};
use crate::join::{Stream, Times, join};
use crate::limits::Budget;
use crate::names::key;
use crate::recording::Note;
use crate::table::{Column, Rounding, Table};
use crate::time::simplest;
use crate::timing::RATE_KEY;
use crate::trials::stem;
use segment::{Index, Kind, Property, Raw, Stamp, segments};
use std::collections::BTreeMap;

/// The format's name in messages.
const TDMS: &str = "TDMS";

/// Properties that say a rate.
const RATES: [&str; 5] = [RATE_KEY, "fs", "sample_rate", "samplerate", "sampling rate"];

/// Rate in Hz and beginning in s.
type Clock = (f64, f64);

/// One channel of a group.
struct Channel {
    group: String,
    column: Column,
    /// Where it has them.
    clock: Option<Clock>,
}

/// Reads a TDMS file: its trials.
pub(crate) fn read(bytes: &[u8], file: &str) -> Result<Vec<Table>, IoError> {
    let damaged = |what: String| IoError::Damaged { file: file.to_owned(), format: TDMS, what };
    let mut budget = Budget::of(bytes.len());
    let segments = segments(bytes).map_err(damaged)?;
    let mut numbers: BTreeMap<&str, Values> = BTreeMap::new();
    for raw in &segments.raw {
        // A value takes at least a byte in the file and eight in memory.
        budget.claim(file, 8 * raw.data.len() as u64)?;
        append(raw, &mut numbers);
    }
    let mut facts = BTreeMap::new();
    let mut ignored = Vec::new();
    let mut channels = Vec::new();
    let begin = segments.objects.values().filter_map(|o| time(o.properties.get("wf_start_time"))).min_by(|a, b| a.since(*b).total_cmp(&0.0));
    for path in &segments.paths {
        let Some(object) = segments.objects.get(path) else { continue };
        let names = parts(path);
        let [group, name] = &names[..] else {
            object.properties.iter().for_each(|(property, value)| fact(&mut facts, names.first(), property, value));
            continue;
        };
        match numbers.remove(path.as_str()) {
            Some(values) => channels.push(channel(group, name, values, &object.properties, begin)),
            None if object.index.is_some() => ignored.push(format!("{group}.{name}")),
            None => {}
        }
    }
    let mut tables = trials(file, channels, &mut budget)?;
    for table in &mut tables {
        table.rename_repeated();
        for (key, value) in &facts {
            table.metadata.entry(key.clone()).or_insert_with(|| value.clone());
        }
        if !ignored.is_empty() {
            table.notes.push(Note::new("ignored-arrays", format!("not read, since they are no real numbers: {}", listed(&ignored)), "save them as numbers"));
        }
    }
    Ok(tables)
}

/// The numbers of a channel as they are gathered.
struct Values {
    kind: Kind,
    numbers: Vec<f64>,
    /// The first of its times, from which the others count.
    first: Option<Stamp>,
}

/// Appends the chunks of a stretch of raw data; what is left at its end is a chunk that was not finished.
fn append<'p>(raw: &'p Raw<'_>, numbers: &mut BTreeMap<&'p str, Values>) {
    let chunk = raw.objects.iter().map(|(_, index)| index.bytes).fold(0, usize::saturating_add);
    let row: usize = raw.objects.iter().map(|(_, index)| index.kind.size()).sum();
    if chunk == 0 {
        return;
    }
    let taken = |(path, index): &'p (String, Index)| {
        let before = numbers.remove(path.as_str());
        before.unwrap_or_else(|| Values { kind: index.kind, numbers: Vec::new(), first: None })
    };
    let mut values: Vec<Values> = raw.objects.iter().map(taken).collect();
    for data in raw.data.chunks(chunk) {
        if raw.interleaved {
            for row in data.chunks_exact(row.max(1)) {
                let mut cursor = Cursor { rest: row, big: raw.big };
                for (values, (_, index)) in values.iter_mut().zip(&*raw.objects) {
                    values.numbers.extend(index.kind.number(&mut cursor, &mut values.first));
                }
            }
        } else {
            let mut cursor = Cursor { rest: data, big: raw.big };
            for (values, (_, index)) in values.iter_mut().zip(&*raw.objects) {
                let mut own = Cursor { rest: cursor.take(index.bytes.min(cursor.rest.len())).unwrap_or_default(), big: raw.big };
                let next = || index.kind.number(&mut own, &mut values.first);
                values.numbers.extend(std::iter::from_fn(next));
            }
        }
    }
    let read = raw.objects.iter().zip(values).filter(|((_, index), _)| !matches!(index.kind, Kind::Texts | Kind::Other(_)));
    numbers.extend(read.map(|((path, _), values)| (path.as_str(), values)));
}

/// `/'group'/'channel'` into its names; a quotation mark is doubled within.
fn parts(path: &str) -> Vec<String> {
    let mut names = Vec::new();
    let mut chars = path.chars().peekable();
    while let Some(c) = chars.next() {
        if c != '\'' {
            continue;
        }
        let mut name = String::new();
        while let Some(c) = chars.next() {
            if c == '\'' && chars.next_if_eq(&'\'').is_none() {
                break;
            }
            name.push(c);
        }
        names.push(name);
    }
    names
}

fn time(property: Option<&Property>) -> Option<Stamp> {
    if let Some(Property::Time(stamp)) = property { Some(*stamp) } else { None }
}

fn number(property: Option<&Property>) -> Option<f64> {
    if let Some(Property::Number(number)) = property { Some(*number).filter(|n| n.is_finite()) } else { None }
}

/// Keeps a property of the file or of a group.
fn fact(facts: &mut BTreeMap<String, String>, group: Option<&String>, name: &str, value: &Property) {
    let text = match value {
        Property::Number(number) => number.to_string(),
        Property::Text(text) => text.clone(),
        Property::Time(_) => return,
    };
    if RATES.contains(&name.to_ascii_lowercase().as_str()) {
        facts.entry(RATE_KEY.to_owned()).or_insert(text);
    } else if !text.trim().is_empty() {
        facts.insert(key(&group.map_or_else(|| name.to_owned(), |group| format!("{group}.{name}"))), text);
    }
}

fn channel(group: &str, name: &str, values: Values, properties: &BTreeMap<String, Property>, begin: Option<Stamp>) -> Channel {
    let unit = ["unit_string", "NI_UnitDescription", "unit", "Unit"].iter().find_map(|name| match properties.get(*name) {
        Some(Property::Text(text)) if !text.trim().is_empty() => Some(text.trim().to_owned()),
        _ => None,
    });
    let rounding = match values.kind {
        Kind::Number(number) => number.rounding(),
        _ => Rounding::default(),
    };
    let start_s = time(properties.get("wf_start_time")).zip(begin).map_or(0.0, |(own, begin)| own.since(begin));
    let clock = number(properties.get("wf_increment")).filter(|step| *step > 0.0).map(|step_s| {
        // The step has the rounding of one number, and a rate of few digits is meant.
        (simplest(1.0 / step_s, 4.0 * f64::EPSILON), start_s + number(properties.get("wf_start_offset")).unwrap_or(0.0))
    });
    let unit = unit.or_else(|| (values.kind == Kind::Time).then(|| "s".to_owned()));
    Channel { group: group.to_owned(), column: Column { name: name.to_owned(), unit, samples: values.numbers, rounding }, clock }
}

/// Groups of the same channels as trials, else all in one.
fn trials(file: &str, channels: Vec<Channel>, budget: &mut Budget) -> Result<Vec<Table>, IoError> {
    let mut groups: Vec<(String, Vec<Channel>)> = Vec::new();
    for channel in channels.into_iter().filter(|c| !c.column.samples.is_empty()) {
        match groups.iter_mut().find(|(name, _)| *name == channel.group) {
            Some((_, members)) => members.push(channel),
            None => groups.push((channel.group.clone(), vec![channel])),
        }
    }
    let names = |members: &[Channel]| -> Vec<String> { members.iter().map(|c| c.column.name.clone()).collect() };
    let same = |a: &str, b: &str| stem(a).is_some() && stem(a) == stem(b);
    let alike = groups.len() > 1 && groups.windows(2).all(|pair| same(&pair[0].0, &pair[1].0) && names(&pair[0].1) == names(&pair[1].1));
    if alike {
        return groups.into_iter().map(|(name, members)| Ok(Table { trial: Some(name), ..recording(file, members, budget)? })).collect();
    }
    let all: Vec<Channel> = groups.into_iter().flat_map(|(_, members)| members).collect();
    if all.is_empty() {
        return Err(IoError::unsuitable(file, "there is no channel of numbers in it", "a recording needs channels of numbers over time"));
    }
    Ok(vec![recording(file, all, budget)?])
}

/// The channels of one recording: those of one clock and length together.
fn recording(file: &str, channels: Vec<Channel>, budget: &mut Budget) -> Result<Table, IoError> {
    let mut streams: Vec<(Option<Clock>, usize, Stream)> = Vec::new();
    for Channel { group, column, clock } in channels {
        let len = column.samples.len();
        match streams.iter_mut().find(|(c, n, _)| *c == clock && *n == len) {
            Some((.., stream)) => stream.columns.push(column),
            None => {
                let times = clock.map_or(Times::Stamps(Vec::new()), |(rate_hz, start_s)| Times::Regular { start_s, rate_hz });
                streams.push((clock, len, Stream { name: group, times, columns: vec![column] }));
            }
        }
    }
    if let [(clock, _, stream)] = &mut streams[..] {
        let mut table = Table { columns: std::mem::take(&mut stream.columns), ..Table::default() };
        if let Some((rate_hz, start_s)) = clock {
            table.set_clock(*rate_hz, *start_s);
        }
        table.columns.sort_by_key(|c| !is_time(&c.name));
        return Ok(table);
    }
    // Without a rate, a column of time says when; else the length of a stream with a rate has to be theirs.
    let mut unclocked = Vec::new();
    let mut joined: Vec<Stream> = Vec::new();
    for (clock, _, mut stream) in streams {
        if clock.is_none() {
            match stream.columns.iter().position(|c| is_time(&c.name)) {
                Some(at) => {
                    let stamps = stream.columns.remove(at).samples;
                    let increasing = stamps.iter().all(|t| t.is_finite()) && stamps.windows(2).all(|pair| pair[1] > pair[0]);
                    stream.times = Times::Stamps(stamps);
                    if !increasing || stream.columns.is_empty() {
                        unclocked.extend(stream.columns);
                        continue;
                    }
                }
                None => {
                    unclocked.extend(stream.columns);
                    continue;
                }
            }
        }
        joined.push(stream);
    }
    let mut left_out = Vec::new();
    for column in unclocked {
        match joined.iter_mut().find(|s| s.columns.first().is_some_and(|c| c.samples.len() == column.samples.len())) {
            Some(stream) => stream.columns.push(column),
            None => left_out.push(format!("{} ({} numbers)", column.name, column.samples.len())),
        }
    }
    let mut table = join(file, joined, budget)?;
    if !left_out.is_empty() {
        table.notes.push(Note::new(
            "ignored-arrays",
            format!("not read, since nothing says their rate: {}", listed(&left_out)),
            "save them as waveforms, with wf_increment",
        ));
    }
    Ok(table)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_paths_are_unquoted() {
        assert_eq!(parts("/'group'/'x''s'"), ["group", "x's"]);
        assert!(parts("/").is_empty());
        assert_eq!(parts("/'open"), ["open"]);
    }
}
