//! OpenSim's storage and motion files (`.sto`, `.mot`): a header down to `endheader`, a line of names, rows of numbers.
//!
//! `inDegrees=yes` says that rotations are in degrees, not which columns are rotations; those follow from the endings that
//! OpenSim gives (`_tx` a translation, `_moment` a torque, `_vx` of a force …), and a note says what was taken. After "Storage
//! (.sto) Files" and "Motion (.mot) Files", OpenSim documentation.

use crate::assemble::{SAMPLES_KEY, is_time};
use crate::csv;
use crate::error::{IoError, listed};
use crate::names::key;
use crate::recording::Note;
use crate::table::Table;
use std::collections::BTreeMap;
use std::fmt::Write;

/// The line between the header and the table.
const END: &str = "endheader";

/// Components that a cell of vectors may have.
const MAX_COMPONENTS: usize = 12;

/// Reads a file of OpenSim.
pub(crate) fn read(bytes: &[u8], file: &str) -> Result<Table, IoError> {
    let text = csv::text(bytes, file, 0)?;
    let mut facts: BTreeMap<String, String> = BTreeMap::new();
    let (mut lines, mut at) = (0, 0);
    for line in text.split_inclusive('\n') {
        lines += 1;
        at += line.len();
        let line = line.trim();
        if line.eq_ignore_ascii_case(END) {
            break;
        }
        match line.split_once('=').or_else(|| line.split_once(char::is_whitespace).filter(|(_, value)| value.trim().parse::<f64>().is_ok())) {
            Some((name, value)) if !name.trim().is_empty() => {
                facts.insert(key(name), value.trim().to_owned());
            }
            _ if lines == 1 && !line.is_empty() => {
                facts.insert("name".to_owned(), line.to_owned());
            }
            _ => {}
        }
    }
    let fact = |names: &[&str]| facts.iter().find(|(key, _)| names.iter().any(|name| key.eq_ignore_ascii_case(name))).map(|(_, value)| value.clone());
    let in_degrees = fact(&["inDegrees"]).is_some_and(|value| value.eq_ignore_ascii_case("yes"));
    let mut rest = text[at..].to_owned();
    if let Some(components) = fact(&["DataType"]).and_then(|kind| components(&kind)) {
        rest = flattened(&rest, components);
    }
    let mut table = csv::read_piece(&rest, file, (0, lines))?;
    if let Some(count) = fact(&["nRows", "datarows"]) {
        table.metadata.insert(SAMPLES_KEY.to_owned(), count);
    }
    for (key, value) in facts.into_iter().filter(|(key, _)| !["nrows", "ncolumns", "datarows", "datacolumns"].contains(&key.to_ascii_lowercase().as_str())) {
        table.metadata.entry(key).or_insert(value);
    }
    let mut angles = Vec::new();
    for column in table.columns.iter_mut().filter(|c| c.unit.is_none() && !is_time(&c.name)) {
        column.unit = unit(&column.name, in_degrees).map(str::to_owned);
        if column.unit.as_deref().is_some_and(|unit| unit.starts_with("deg")) {
            angles.push(column.name.clone());
        }
    }
    if !angles.is_empty() {
        table.notes.push(Note::new(
            "unit-inferred",
            format!("the header says inDegrees=yes, so these are read as angles: {}", listed(&angles)),
            "give a column's unit with --channels NEW=\"OLD [UNIT]\" where it is none",
        ));
    }
    Ok(table)
}

/// The components of each cell of a table of vectors.
fn components(kind: &str) -> Option<usize> {
    match kind.to_ascii_lowercase().as_str() {
        "quaternion" => Some(4),
        "spatialvec" => Some(6),
        other => other.strip_prefix("vec")?.parse().ok().filter(|n| (2..=MAX_COMPONENTS).contains(n)),
    }
}

/// One column a component: `name_1`, `name_2` …, and cells `1,2,3` in cells of their own. A vector of three has `_x`, `_y`, `_z`.
fn flattened(rows: &str, components: usize) -> String {
    let mut out = String::with_capacity(rows.len());
    let mut named = false;
    for line in rows.split_inclusive('\n') {
        if named || line.trim().is_empty() {
            out.push_str(&line.replace(',', "\t").replace("~", ""));
            continue;
        }
        named = true;
        for (i, name) in line.trim().split('\t').map(str::trim).enumerate() {
            if i > 0 {
                out.push('\t');
            }
            if is_time(name) {
                out.push_str(name);
                continue;
            }
            for k in 0..components {
                let end = if components == 3 { ["x", "y", "z"][k].to_owned() } else { (k + 1).to_string() };
                let _ = write!(out, "{}{name}_{end}", if k > 0 { "\t" } else { "" });
            }
        }
        out.push('\n');
    }
    out
}

/// The unit of a column by the endings that OpenSim gives.
fn unit(name: &str, in_degrees: bool) -> Option<&'static str> {
    let name = name.to_ascii_lowercase();
    let ends = |endings: &[&str]| endings.iter().any(|ending| name.ends_with(ending));
    let muscular = ["activation", "fiber", "excitation", "norm_", "tendon", "reserve"].iter().any(|part| name.contains(part));
    if name.contains("force") && ends(&["_vx", "_vy", "_vz"]) || ends(&["_force"]) {
        Some("N")
    } else if name.contains("torque") || ends(&["_moment", "_mx", "_my", "_mz"]) {
        Some("N m")
    } else if ends(&["_px", "_py", "_pz", "_tx", "_ty", "_tz"]) {
        Some("m")
    } else if !in_degrees || muscular {
        None
    } else if ends(&["/speed", "_u"]) {
        Some("deg/s")
    } else {
        Some("deg")
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{ReadOptions, read_bytes};

    const MOTION: &str = "Coordinates\nversion=1\nnRows=3\nnColumns=3\ninDegrees=yes\n\nUnits are S.I. units (second, meters, Newtons, ...)\nendheader\n\
        time\tknee_angle_r\tpelvis_tx\n0.00\t90\t0.5\n0.01\t45\t0.25\n0.02\t-90\t0.125\n";

    #[test]
    fn rotations_are_converted_and_translations_are_not() {
        let read = read_bytes(MOTION.as_bytes(), "walk.mot", &ReadOptions::default()).unwrap();
        assert_eq!(read.recording.sample_rate_hz(), 100.0);
        let knee = read.recording.channel("knee_angle_r").unwrap();
        let right = std::f64::consts::FRAC_PI_2;
        assert_eq!((knee.unit.symbol(), &knee.samples), ("rad", &vec![right, right / 2.0, -right]));
        let pelvis = read.recording.channel("pelvis_tx").unwrap();
        assert_eq!((pelvis.unit.symbol(), pelvis.samples[2]), ("m", 0.125));
        assert_eq!(read.recording.metadata()["name"], "Coordinates");
        assert!(read.notes.iter().any(|n| n.message.contains("inDegrees=yes") && n.message.contains("knee_angle_r")), "{:?}", read.notes);
    }

    #[test]
    fn a_file_that_lost_rows_is_refused() {
        let cut = &MOTION[..MOTION.len() - "0.02\t-90\t0.125\n".len()];
        let error = read_bytes(cut.as_bytes(), "walk.mot", &ReadOptions::default()).unwrap_err();
        assert!(matches!(error, IoError::SampleCount { found: 2, .. }), "{error}");
        let text = MOTION.replace("45", "x");
        let error = read_bytes(text.as_bytes(), "walk.mot", &ReadOptions::default()).unwrap_err();
        assert!(error.to_string().contains("line 11"), "{error}");
    }

    #[test]
    fn vectors_and_ground_reactions() {
        let text = "DataRate=100\nDataType=Vec3\nversion=3\nendheader\ntime\tforce\n0\t1,2,3\n0.01\t4,5,6\n";
        let read = read_bytes(text.as_bytes(), "imu.sto", &ReadOptions::default()).unwrap();
        assert_eq!(read.recording.names(), ["force_x", "force_y", "force_z"]);
        assert_eq!(read.recording.channel("force_z").unwrap().samples, [3.0, 6.0]);
        assert_eq!((unit("ground_force_vy", true), unit("1_ground_torque_x", true), unit("ground_force_px", true)), (Some("N"), Some("N m"), Some("m")));
        assert_eq!((unit("soleus_r/activation", true), unit("knee_angle_r", false)), (None, None));
    }
}
