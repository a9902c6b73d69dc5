//! Trials in the groups of one file: `trial_1`, `trial_2` … with the same channels in each.

use crate::arrays::{self, Entry, Value};
use crate::error::IoError;
use crate::table::Table;
use std::collections::{BTreeMap, BTreeSet};

/// What groups of trials have in common: the name without the number at its end; [`None`] without a number.
pub(crate) fn stem(name: &str) -> Option<&str> {
    let stem = name.trim_end_matches(|c: char| c.is_ascii_digit());
    (stem.len() < name.len()).then_some(stem)
}

/// A table for each trial where groups that differ in their number alone hold the same channels, else one of everything.
pub(crate) fn tables(file: &str, entries: Vec<Entry>) -> Result<Vec<Table>, IoError> {
    let Some(groups) = groups(&entries) else { return Ok(vec![arrays::table(file, entries)?]) };
    let (members, shared): (Vec<Entry>, Vec<Entry>) = entries.into_iter().partition(|e| e.path.len() > 1 && groups.contains(&e.path[0]));
    let mut of_group: BTreeMap<String, Vec<Entry>> = BTreeMap::new();
    for mut entry in members {
        let group = entry.path.remove(0);
        of_group.entry(group).or_default().push(entry);
    }
    // Facts and units that stand beside the groups hold for each.
    let shared: Vec<Entry> = shared.into_iter().filter(|entry| !is_channel(entry)).collect();
    let table = |name: String| {
        let own = of_group.remove(&name).unwrap_or_default();
        let named = format!("{file}, trial {name}");
        Ok(Table { trial: Some(name), ..arrays::table(&named, own.into_iter().chain(shared.iter().cloned()).collect())? })
    };
    groups.into_iter().map(table).collect()
}

fn is_channel(entry: &Entry) -> bool {
    matches!(&entry.value, Value::Numbers { values, .. } if values.len() > 1)
}

/// The names of groups that are trials, in the order of the file.
fn groups(entries: &[Entry]) -> Option<Vec<String>> {
    let mut order: Vec<&str> = Vec::new();
    let mut channels: BTreeMap<&str, BTreeSet<&[String]>> = BTreeMap::new();
    for entry in entries.iter().filter(|entry| entry.path.len() > 1 && is_channel(entry)) {
        let group = entry.path[0].as_str();
        if !channels.contains_key(group) {
            order.push(group);
        }
        channels.entry(group).or_default().insert(&entry.path[1..]);
    }
    let alike = |a: &str, b: &str| stem(a).is_some() && stem(a) == stem(b) && channels.get(a) == channels.get(b);
    let groups: Vec<&str> = order.iter().copied().filter(|group| order.iter().any(|other| other != group && alike(group, other))).collect();
    // Several kinds of trials in one file have no order that could be meant.
    let one_kind = groups.windows(2).all(|pair| alike(pair[0], pair[1]));
    (groups.len() > 1 && one_kind).then(|| groups.into_iter().map(str::to_owned).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::table::Rounding;

    fn numbers(path: &[&str], count: usize) -> Entry {
        let values = vec![1.0; count];
        Entry::new(path.iter().map(|&p| p.to_owned()).collect(), Value::Numbers { shape: vec![count], values, rounding: Rounding::default() })
    }

    #[test]
    fn groups_that_differ_in_their_number_are_trials() {
        let entries = vec![numbers(&["trial_1", "force_x"], 50), numbers(&["trial_2", "force_x"], 80), numbers(&["fs"], 1)];
        let tables = tables("f", entries).unwrap();
        let names: Vec<_> = tables.iter().map(|t| t.trial.as_deref()).collect();
        assert_eq!(names, [Some("trial_1"), Some("trial_2")]);
        assert_eq!((tables[1].columns[0].samples.len(), tables[1].columns[0].name.as_str()), (80, "force_x"));
        assert!(tables.iter().all(|t| t.metadata.contains_key("sample_rate_hz")));
    }

    #[test]
    fn other_groups_are_parts_of_one_recording() {
        for groups in [["left", "right"], ["arm1", "leg1"]] {
            let entries = groups.iter().map(|group| numbers(&[group, "force_x"], 50)).collect();
            let tables = tables("f", entries).unwrap();
            assert_eq!((tables.len(), tables[0].columns[0].name.clone()), (1, format!("{}.force_x", groups[0])));
        }
        let entries = vec![numbers(&["trial_1", "force_x"], 50), numbers(&["trial_2", "pos_x"], 50)];
        assert_eq!(tables("f", entries).unwrap().len(), 1);
    }
}
