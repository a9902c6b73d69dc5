//! KINARM's archive: a ZIP with one C3D file a trial, and `common.c3d` with what all of them share.

use crate::c3d;
use crate::error::IoError;
use crate::limits::{Budget, MAX_ENTRIES};
use crate::table::Table;
use std::io::Cursor;
use zip::ZipArchive;

/// The format's name in messages.
const KINARM: &str = "KINARM";

/// The suffix of a trial.
const TRIAL: &str = ".c3d";

/// The file whose parameters hold for every trial.
const COMMON: &str = "common";

/// A file of the session; what macOS puts beside each file of an archive is none.
fn is_trial(name: &str) -> bool {
    !stem(name).starts_with("._") && name.len() > TRIAL.len() && name.as_bytes()[name.len() - TRIAL.len()..].eq_ignore_ascii_case(TRIAL.as_bytes())
}

/// The name of a file without folders and suffix; both kinds of slash are met.
fn stem(name: &str) -> &str {
    let name = name.rsplit(['/', '\\']).next().unwrap_or(name);
    name.rsplit_once('.').map_or(name, |(stem, _)| stem)
}

/// Reads the trials of an archive, in the order in which they were run where they say it, else in that of the archive.
pub(crate) fn read(bytes: &[u8], file: &str) -> Result<Vec<Table>, IoError> {
    let damaged = |what: String| IoError::Damaged { file: file.to_owned(), format: KINARM, what };
    let mut archive = ZipArchive::new(Cursor::new(bytes)).map_err(|e| damaged(format!("the archive cannot be opened ({e}); it may be cut off")))?;
    if archive.len() > MAX_ENTRIES {
        return Err(IoError::too_large(file, "files", archive.len(), MAX_ENTRIES, "split the archive"));
    }
    let mut budget = Budget::of(bytes.len());
    let mut trials = Vec::new();
    let mut common = None;
    for i in 0..archive.len() {
        let mut entry = archive.by_index(i).map_err(|e| damaged(format!("entry {i} cannot be opened ({e})")))?;
        let name = entry.name().map_err(|e| damaged(format!("the name of entry {i} cannot be read ({e})")))?.into_owned();
        if !is_trial(&name) {
            continue;
        }
        let data = budget.unpack(file, &mut entry)?.map_err(|e| damaged(format!("{name} cannot be unpacked ({e})")))?;
        let stem = stem(&name).to_owned();
        if stem.eq_ignore_ascii_case(COMMON) {
            common = Some(c3d::parameters(&data, &format!("{file}, {name}"))?);
            continue;
        }
        let (table, parameters) = c3d::read_with_parameters(&data, &format!("{file}, trial {stem}"), &mut budget)?;
        trials.push((parameters.number("TRIAL", "TRIAL_NUM"), Table { trial: Some(stem), ..table }, parameters));
    }
    if trials.is_empty() {
        return Err(IoError::unsuitable(file, "it is an archive of C3D without a trial", "look whether the session was saved completely"));
    }
    if trials.iter().all(|(number, ..)| number.is_some()) {
        trials.sort_by(|a, b| a.0.unwrap_or_default().total_cmp(&b.0.unwrap_or_default()));
    }
    let finish = |(_, mut table, mut parameters): (_, Table, c3d::Parameters)| {
        if let Some(common) = &common {
            parameters.add_missing(common);
        }
        table.metadata.extend(parameters.facts());
        table
    };
    Ok(trials.into_iter().map(finish).collect())
}
