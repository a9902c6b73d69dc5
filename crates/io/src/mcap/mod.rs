//! MCAP, what ROS 2 records: messages of many topics, with the definitions of their types.
//!
//! The numbers of every message are channels, by their path (`wrench.force.x`). A `JointState` gives `angle_JOINT`, `vel_JOINT` and
//! `torque_JOINT`, a `Wrench` `force_x` … `torque_z`. Topics are joined on one clock (see [`crate::join`]): that of the headers where
//! all have one, else the recorder's. After "MCAP Format Specification", Foxglove, and OMG's CDR.

mod definition;
mod message;
mod naming;
mod records;

use crate::error::{IoError, listed};
use crate::join::{Stream, Times, join};
use crate::limits::{Budget, MAX_CHANNELS, MAX_ENTRIES};
use crate::recording::Note;
use crate::table::{Column, Rounding, Table};
use definition::Definitions;
use message::{Encoding, Numbers, numbers};
use naming::channel_names;
use records::Record;
use std::collections::{BTreeMap, BTreeSet};

/// Kinds of messages of one topic, told apart by the lengths of their lists and the names in them.
const MAX_KINDS: usize = 8;

/// A topic whose messages are understood.
struct Topic {
    name: String,
    schema: u16,
    encoding: Encoding,
    kinds: Vec<Messages>,
}

/// Messages of one kind.
struct Messages {
    first: Numbers,
    log_ns: Vec<u64>,
    stamps_ns: Vec<i64>,
    columns: Vec<Vec<f64>>,
}

/// Reads an MCAP file.
pub(crate) fn read(bytes: &[u8], file: &str) -> Result<Table, IoError> {
    let mut budget = Budget::of(bytes.len());
    let mut gathered = Gathered::default();
    records::each(bytes, file, &mut budget, &mut |record, budget| gathered.take(record, file, budget))?;
    gathered.table(file, &mut budget)
}

#[derive(Default)]
struct Gathered {
    schemas: BTreeMap<u16, (String, Option<Definitions>)>,
    topics: BTreeMap<u16, Topic>,
    /// What is not read, and why.
    ignored: BTreeSet<String>,
}

impl Gathered {
    fn take(&mut self, record: Record<'_>, file: &str, budget: &mut Budget) -> Result<(), IoError> {
        match record {
            Record::Schema { id, name, encoding, data } => {
                let known = matches!(encoding.as_str(), "ros2msg" | "ros1msg");
                let definitions = std::str::from_utf8(data).ok().filter(|_| known).and_then(|text| Definitions::parse(&name, text));
                self.schemas.entry(id).or_insert((name, definitions));
            }
            Record::Channel { id, schema, topic, encoding } => {
                let encoding = match encoding.as_str() {
                    "cdr" => Some(Encoding::Cdr),
                    "ros1" => Some(Encoding::Ros1),
                    _ => None,
                };
                match (encoding, self.schemas.get(&schema)) {
                    (Some(encoding), Some((_, Some(_)))) if self.topics.len() < MAX_ENTRIES => {
                        self.topics.entry(id).or_insert(Topic { name: topic, schema, encoding, kinds: Vec::new() });
                    }
                    (_, known) => {
                        let name = known.map_or("no definition", |(name, _)| name.as_str());
                        self.ignored.insert(format!("{topic} ({name})"));
                    }
                }
            }
            Record::Message { channel, log_ns, data } => {
                let Some(topic) = self.topics.get_mut(&channel) else { return Ok(()) };
                let Some((_, Some(definitions))) = self.schemas.get(&topic.schema) else { return Ok(()) };
                if !topic.take(definitions, log_ns, data, file, budget)? {
                    self.ignored.insert(format!("{} (messages that are not as defined, or of too many kinds)", topic.name));
                }
            }
        }
        Ok(())
    }

    fn table(mut self, file: &str, budget: &mut Budget) -> Result<Table, IoError> {
        let mut streams = Vec::new();
        let (mut dropped, mut rotating) = (0, false);
        let kinds = || self.topics.values().flat_map(|topic| topic.kinds.iter().filter(|kind| !kind.columns.is_empty()).map(move |kind| (topic, kind)));
        let by_header = kinds().all(|(_, kind)| kind.stamps_ns.len() == kind.log_ns.len() && kind.stamps_ns.iter().all(|ns| *ns > 0));
        let time_ns = |kind: &Messages, k: usize| if by_header { kind.stamps_ns[k] } else { i64::try_from(kind.log_ns[k]).unwrap_or(i64::MAX) };
        let begin_ns = kinds().flat_map(|(_, kind)| (0..kind.log_ns.len()).map(|k| time_ns(kind, k))).min().unwrap_or(0);
        let total: usize = kinds().map(|(_, kind)| kind.columns.len()).sum();
        if total > MAX_CHANNELS {
            return Err(IoError::too_large(file, "channels", total, MAX_CHANNELS, "record or filter the topics that are needed"));
        }
        for (topic, kind) in kinds() {
            let schema = self.schemas.get(&topic.schema).map_or("", |(name, _)| name.as_str());
            self.ignored.extend(kind.first.long.iter().map(|path| format!("{}.{path} (a long list)", topic.name)));
            let mut order: Vec<usize> = (0..kind.log_ns.len()).collect();
            order.sort_by_key(|&k| time_ns(kind, k));
            let all = order.len();
            order.dedup_by_key(|k| time_ns(kind, *k));
            dropped += all - order.len();
            let times = order.iter().map(|&k| time_ns(kind, k).saturating_sub(begin_ns) as f64 * 1e-9).collect();
            rotating |= schema.ends_with("/JointState");
            let names = channel_names(schema, &kind.first);
            let columns = kind.columns.iter().zip(names).map(|(values, (name, unit))| Column {
                name,
                unit: unit.map(str::to_owned),
                samples: order.iter().map(|&k| values[k]).collect(),
                rounding: Rounding::default(),
            });
            streams.push(Stream { name: topic.name.trim_start_matches('/').to_owned(), times: Times::Stamps(times), columns: columns.collect() });
        }
        let mut table = join(file, streams, budget)?;
        table.rename_repeated();
        table.metadata.insert("start_unix_ns".to_owned(), begin_ns.to_string());
        let clock = if by_header { "the stamps in the messages' headers" } else { "the times at which they were recorded" };
        table.notes.push(Note::new(
            "clock-of-messages",
            format!("the times of the messages are {clock}"),
            "let every topic have a header if they should be the sensors'",
        ));
        if rotating {
            let text = "joint states are read as rotating joints, in rad, rad/s and N m";
            table.notes.push(Note::new("unit-inferred", text, "give the unit of a sliding joint with --channels NEW=\"OLD [UNIT]\""));
        }
        if dropped > 0 {
            let text = format!("{dropped} messages with the time of another one of their topic are left out");
            table.notes.push(Note::new("sample-timing", text, "look for a topic with two publishers, or one recorded twice"));
        }
        if !self.ignored.is_empty() {
            let ignored: Vec<String> = std::mem::take(&mut self.ignored).into_iter().collect();
            table.notes.push(Note::new("ignored-streams", format!("topics that are not read: {}", listed(&ignored)), "none where they are no measurements"));
        }
        Ok(table)
    }
}

impl Topic {
    /// Takes the numbers of a message; false if it is not as its definition says.
    fn take(&mut self, definitions: &Definitions, log_ns: u64, data: &[u8], file: &str, budget: &mut Budget) -> Result<bool, IoError> {
        let Some(found) = numbers(definitions, data, self.encoding, false) else { return Ok(false) };
        let same = |kind: &Messages| kind.first.lengths == found.lengths && kind.first.names == found.names;
        let kind = match self.kinds.iter().position(same) {
            Some(at) => &mut self.kinds[at],
            None if self.kinds.len() < MAX_KINDS => {
                let Some(first) = numbers(definitions, data, self.encoding, true) else { return Ok(false) };
                // Names, paths and the heads of columns.
                budget.claim(file, 256 * first.values.len() as u64 + data.len() as u64)?;
                let columns = vec![Vec::new(); first.values.len()];
                self.kinds.push(Messages { first, log_ns: Vec::new(), stamps_ns: Vec::new(), columns });
                let last = self.kinds.len() - 1;
                &mut self.kinds[last]
            }
            None => return Ok(false),
        };
        budget.claim(file, 8 * (found.values.len() as u64 + 2))?;
        kind.log_ns.push(log_ns);
        kind.stamps_ns.extend(found.stamp_ns);
        kind.columns.iter_mut().zip(found.values).for_each(|(column, value)| column.push(value));
        Ok(true)
    }
}
