//! Trials of one table: the episodes of data sets for robot learning.

use crate::assemble::is_time;
use crate::table::{Column, Table};

/// The column that counts episodes.
const EPISODE: &str = "episode_index";

/// What these data sets call the time.
const TIMESTAMP: &str = "timestamp";

/// Whether a column of this name tells of several trials, or is the time of one.
pub(super) fn are_told_by(name: &str) -> bool {
    [EPISODE, TIMESTAMP].contains(&name)
}

/// A table for each episode, where a column counts several.
pub(super) fn split(mut table: Table) -> Vec<Table> {
    if !table.columns.iter().any(|c| is_time(&c.name))
        && let Some(time) = table.columns.iter_mut().find(|c| c.name == TIMESTAMP)
    {
        time.name = "t".to_owned();
    }
    let Some(episodes) = table.columns.iter().find(|c| c.name == EPISODE) else { return vec![table] };
    let bounds: Vec<usize> = (1..episodes.samples.len()).filter(|&k| episodes.samples[k] != episodes.samples[k - 1]).collect();
    if bounds.is_empty() {
        return vec![table];
    }
    let names: Vec<String> = std::iter::once(0).chain(bounds.iter().copied()).map(|k| format!("episode {}", episodes.samples[k])).collect();
    let ends = bounds.iter().copied().chain([episodes.samples.len()]);
    let mut from = 0;
    let mut trials = Vec::with_capacity(names.len());
    for (name, to) in names.into_iter().zip(ends) {
        let part = |c: &Column| Column { samples: c.samples[from..to].to_vec(), ..c.header() };
        trials.push(Table { trial: Some(name), columns: table.columns.iter().map(part).collect(), ..table.facts() });
        from = to;
    }
    trials
}
