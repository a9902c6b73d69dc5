//! BIDS motion: `NAME_motion.tsv` without a header, `NAME_channels.tsv` that names its columns, `NAME_motion.json` with the rate.
//!
//! What BIDS has no place for (start, facts) stands under `ndof` in the JSON file, so that a recording comes back bit for bit. After
//! "Brain Imaging Data Structure", version 1.10, motion.

use crate::assemble::assemble;
use crate::atomic::write_atomic;
use crate::contents::contents;
use crate::csv::{Shortest, read_piece, text};
use crate::error::IoError;
use crate::names::{indexed, read_back};
use crate::options::ReadOptions;
use crate::recording::ReadRecording;
use crate::table::{Column, Rounding};
use crate::timing::{RATE_KEY, START_KEY};
use ndof_signal::{Quantity, Recording};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// The format's name in messages.
const BIDS: &str = "BIDS motion";

/// The end of the name of the samples' file.
const MOTION: &str = "_motion.tsv";

/// What a sample is that is missing, and a unit that there is none of.
const NOTHING: &str = "n/a";

/// The files beside the samples' one: of channels, and of facts.
fn beside(path: &Path) -> Option<[PathBuf; 2]> {
    let name = path.file_name()?.to_str()?.strip_suffix(MOTION)?;
    Some([format!("{name}_channels.tsv"), format!("{name}_motion.json")].map(|name| path.with_file_name(name)))
}

/// Whether this is the file of samples, with the others beside it.
pub(crate) fn is(path: &Path) -> bool {
    beside(path).is_some_and(|files| files.iter().all(|file| file.exists()))
}

/// Whether a recording under this name is written as BIDS.
pub(crate) fn is_name(path: &Path) -> bool {
    beside(path).is_some()
}

/// Reads the three files.
pub(crate) fn read(path: &Path, options: &ReadOptions) -> Result<ReadRecording, IoError> {
    let Some([channels, facts]) = beside(path) else { return Err(IoError::Empty { file: path.display().to_string() }) };
    let (bytes, file) = contents(path)?;
    let unsuitable = |what| IoError::unsuitable(&file, what, "compare the three files of BIDS motion with one another");
    let listed = channels_of(&channels)?;
    let (json, json_file) = contents(&facts)?;
    let json: Value = serde_json::from_slice(&json).map_err(|e| IoError::Damaged { file: json_file, format: "JSON", what: e.to_string() })?;
    let rate_hz = json.get("SamplingFrequency").and_then(Value::as_f64).ok_or_else(|| unsuitable("its JSON file says no SamplingFrequency"))?;
    // The samples have no line of names, so that theirs are put above.
    let body = text(&bytes, &file, 0)?;
    let header: Vec<String> = (0..listed.len()).map(|k| format!("column {k}")).collect();
    let mut table = read_piece(&format!("{}\n{body}", header.join("\t")), &file, (1, 0))?;
    table.lines.iter_mut().for_each(|line| *line -= 1);
    let named = |(column, (name, unit)): (Column, (String, Option<String>))| Column { name, unit, rounding: Rounding::default(), ..column };
    table.columns = std::mem::take(&mut table.columns).into_iter().zip(listed).map(named).collect();
    table.metadata = BTreeMap::from([(RATE_KEY.to_owned(), rate_hz.to_string())]);
    for (key, value) in json.as_object().into_iter().flatten() {
        match (key.as_str(), value) {
            ("ndof", Value::Object(own)) => {
                if let Some(start) = own.get(START_KEY).and_then(Value::as_f64) {
                    table.metadata.insert(START_KEY.to_owned(), start.to_string());
                }
                let facts = own.get("metadata").and_then(Value::as_object).into_iter().flatten();
                table.metadata.extend(facts.filter_map(|(key, value)| Some((key.clone(), value.as_str()?.to_owned()))));
            }
            (_, Value::String(text)) if !OWN.contains(&key.as_str()) => {
                table.metadata.insert(key.clone(), text.clone());
            }
            _ => {}
        }
    }
    assemble(&file, table, options)
}

/// Facts that every file has which is written here.
const OWN: [&str; 3] = ["TaskName", "MotionChannelCount", "TrackedPointsCount"];

/// Name and unit of each column.
fn channels_of(path: &Path) -> Result<Vec<(String, Option<String>)>, IoError> {
    let (bytes, file) = contents(path)?;
    let mut lines = text(&bytes, &file, 0)?.lines().map(|line| line.split('\t').map(str::trim).collect::<Vec<_>>());
    let head = lines.next().unwrap_or_default();
    let find = |name: &str| {
        let missing = || IoError::unsuitable(&file, format!("there is no column {name} in it"), "BIDS asks for it");
        head.iter().position(|h| *h == name).ok_or_else(missing)
    };
    let (name, unit) = (find("name")?, find("units")?);
    let cell = |row: &[&str], at: usize| row.get(at).copied().unwrap_or_default().to_owned();
    Ok(lines
        .filter(|row| row.iter().any(|c| !c.is_empty()))
        .map(|row| (cell(&row, name), Some(cell(&row, unit)).map(|u| if u == NOTHING { String::new() } else { u })))
        .collect())
}

/// Writes the three files, each atomically; the one that names the others last.
pub(crate) fn write(path: &Path, recording: &Recording) -> Result<(), IoError> {
    let file = path.display().to_string();
    let unwritable = |what: String, remedy| IoError::Unwritable { file: file.clone(), what, format: BIDS, remedy };
    let Some([channels_file, facts_file]) = beside(path) else { return Err(unwritable("a name without _motion.tsv".to_owned(), "end it with _motion.tsv")) };
    if recording.is_empty() {
        return Err(unwritable("a recording without samples".to_owned(), "record or keep at least one"));
    }
    let mut channels = String::from("name\tcomponent\ttype\ttracked_point\tunits\n");
    for channel in recording.channels() {
        let (name, symbol) = (&channel.name, channel.unit.symbol());
        let plain = |text: &str| text.trim() == text && !text.contains(char::is_control) && text != NOTHING;
        if name.is_empty() || !plain(name) || !plain(symbol) || indexed(name) != *name || read_back(symbol) != channel.unit {
            return Err(unwritable(format!("channel {name:?} in {symbol:?}"), "give it another name or unit"));
        }
        let (point, component) = match name.rsplit_once(['_', '.']) {
            Some((point, axis @ ("x" | "y" | "z"))) => (point, axis),
            _ => (name.as_str(), NOTHING),
        };
        let _ = writeln!(
            channels,
            "{name}\t{component}\t{}\t{point}\t{}",
            kind(channel.unit.quantity(), channel.unit.is_rotational()),
            if symbol.is_empty() { NOTHING } else { symbol }
        );
    }
    let mut samples = String::with_capacity(20 * recording.len() * recording.channels().len());
    for k in 0..recording.len() {
        for (i, channel) in recording.channels().iter().enumerate() {
            let value = channel.samples[k];
            let tab = if i > 0 { "\t" } else { "" };
            let _ = if value.is_nan() { write!(samples, "{tab}{NOTHING}") } else { write!(samples, "{tab}{}", Shortest(value)) };
        }
        samples.push('\n');
    }
    let facts = json!({
        "TaskName": recording.metadata().get("TaskName").map_or("task", String::as_str),
        "SamplingFrequency": recording.sample_rate_hz(),
        "MotionChannelCount": recording.channels().len(),
        "ndof": { START_KEY: recording.start_s(), "metadata": recording.metadata() },
    });
    write_atomic(&channels_file, channels.as_bytes())?;
    write_atomic(&facts_file, format!("{facts:#}\n").as_bytes())?;
    write_atomic(path, samples.as_bytes())
}

/// What BIDS calls a quantity.
fn kind(quantity: Quantity, rotational: bool) -> &'static str {
    match (quantity, rotational) {
        (Quantity::Displacement, false) => "POS",
        (Quantity::Displacement, true) => "JNTANG",
        (Quantity::Velocity, false) => "VEL",
        (Quantity::Velocity, true) => "GYRO",
        (Quantity::Acceleration, false) => "ACCEL",
        (Quantity::Acceleration, true) => "ANGACCEL",
        _ => "MISC",
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndof_signal::{Channel, Unit};

    #[test]
    fn the_three_files_are_the_recording() {
        let channel = |name: &str, unit: &str, samples| Channel::new(name, Unit::parse(unit).map_or_else(|_| Unit::other(unit), |(unit, _)| unit), samples);
        let channels =
            vec![channel("pos_x", "m", vec![0.1, 0.2, 1e-300]), channel("emg", "mV", vec![1.0, f64::NAN, 3.0]), channel("ratio", "", vec![0.0, -0.0, 7.0])];
        let metadata = BTreeMap::from([("subject".to_owned(), "S 07".to_owned()), ("TaskName".to_owned(), "reach".to_owned())]);
        let recording = Recording::new(999.9, channels).unwrap().starting_at(2.5).with_metadata(metadata);
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("sub-01_task-reach_motion.tsv");
        crate::write(&path, &recording).unwrap();
        let read = crate::read(&path, &ReadOptions { allow_nan: true, ..Default::default() }).unwrap().recording;
        assert_eq!(format!("{read:?}"), format!("{recording:?}"));
        let listed = std::fs::read_to_string(folder.path().join("sub-01_task-reach_channels.tsv")).unwrap();
        assert_eq!(listed.lines().nth(1), Some("pos_x\tx\tPOS\tpos\tm"));
        let json: Value = serde_json::from_slice(&std::fs::read(folder.path().join("sub-01_task-reach_motion.json")).unwrap()).unwrap();
        assert_eq!((json["TaskName"].as_str(), json["SamplingFrequency"].as_f64()), (Some("reach"), Some(999.9)));
        std::fs::remove_file(folder.path().join("sub-01_task-reach_channels.tsv")).unwrap();
        assert!(crate::read(&path, &ReadOptions::default()).is_err(), "without its channels it is a table without names");
    }
}
