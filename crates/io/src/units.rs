//! Which unit a channel has, from what the file says or from its name.

use crate::error::IoError;
use crate::options::ReadOptions;
use crate::recording::Note;
use ndof_signal::{Quantity, Unit};

/// The SI unit that a channel's name stands for, by its prefix: `pos_` m, `angle_` rad, `force_` N, `torque_` N m.
///
/// `vel_` and `acc_` are taken as translational, m/s and m/s² (a file that has `angle_` or `torque_` of the same axis is
/// read otherwise). `cmd_` follows the channel that it commands, and other names stand for nothing: [`None`].
///
/// ```
/// assert_eq!(ndof_io::infer_unit("torque_ankle").map(|u| u.symbol().to_owned()), Some("N m".to_owned()));
/// assert!(ndof_io::infer_unit("cmd_x").is_none());
/// ```
pub fn infer_unit(name: &str) -> Option<Unit> {
    let (prefix, _) = name.split_once('_')?;
    Some(match prefix {
        "pos" => Unit::si(Quantity::Displacement, false),
        "angle" => Unit::si(Quantity::Displacement, true),
        "vel" => Unit::si(Quantity::Velocity, false),
        "acc" => Unit::si(Quantity::Acceleration, false),
        "force" => Unit::si(Quantity::Effort, false),
        "torque" => Unit::si(Quantity::Effort, true),
        _ => return None,
    })
}

/// As [`infer_unit`], for a channel beside `others`: `vel_elbow` beside `angle_elbow` or `torque_elbow` is in rad/s.
fn infer_among(name: &str, others: &[String]) -> Option<Unit> {
    let unit = infer_unit(name)?;
    let (prefix, axis) = name.split_once('_')?;
    let turns = ["angle", "torque"].iter().any(|p| others.iter().any(|o| o.strip_prefix(p).and_then(|o| o.strip_prefix('_')) == Some(axis)));
    Some(if turns && matches!(prefix, "vel" | "acc") { Unit::si(unit.quantity(), true) } else { unit })
}

/// The unit of a channel and the factor to it, with a note where something was converted, inferred or not understood.
pub(crate) fn resolve(
    file: &str,
    name: &str,
    given: Option<&str>,
    others: &[String],
    options: &ReadOptions,
    notes: &mut Vec<Note>,
) -> Result<(Unit, f64), IoError> {
    if let Some(text) = options.units.get(name) {
        let (unit, factor) = Unit::parse(text).map_err(|source| IoError::Unit { file: file.to_owned(), channel: name.to_owned(), source })?;
        notes.push(Note::new(
            "unit-given",
            format!("channel \"{name}\" is read in {text}{}, as given", given.map_or(String::new(), |g| format!(" instead of the file's {g}"))),
            "take the unit off if the file's own is right",
        ));
        return Ok((unit, factor));
    }
    let Some(text) = given else {
        return Ok(match infer_among(name, others) {
            Some(unit) => {
                notes.push(Note::new(
                    "unit-inferred",
                    format!("channel \"{name}\" has no unit in the file and is taken in {unit}, by its name"),
                    format!("write the unit into the header, such as `{name} [{unit}]`, if it is another one"),
                ));
                (unit, 1.0)
            }
            None => (Unit::other(""), 1.0),
        });
    };
    match Unit::parse(text) {
        Ok((unit, factor)) => {
            if factor != 1.0 {
                notes.push(Note::new(
                    "unit-converted",
                    format!("channel \"{name}\": {text} converted to {unit} (times {factor})"),
                    "correct the unit in the header if this is wrong",
                ));
            }
            Ok((unit, factor))
        }
        Err(_) => {
            notes.push(Note::new(
                "unit-unknown",
                format!("channel \"{name}\" has the unit \"{text}\", which is none of mechanics; its samples are kept as they are"),
                "correct the unit in the header if the channel is a position, a speed, an acceleration, a force or a torque",
            ));
            Ok((Unit::other(text), 1.0))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_unit_that_is_not_of_mechanics_is_kept_and_told() {
        let mut notes = Vec::new();
        let (unit, factor) = resolve("f", "emg_1", Some("mV"), &[], &ReadOptions::default(), &mut notes).unwrap();
        assert_eq!((unit, factor, notes[0].code.as_str()), (Unit::other("mV"), 1.0, "unit-unknown"));
    }

    #[test]
    fn the_speed_of_a_joint_is_an_angular_one() {
        let symbol = |name: &str, others: &[&str]| {
            let others: Vec<String> = others.iter().map(|&o| o.to_owned()).collect();
            infer_among(name, &others).map(|u| u.symbol().to_owned())
        };
        assert_eq!(symbol("vel_elbow", &["angle_elbow"]).as_deref(), Some("rad/s"));
        assert_eq!(symbol("acc_elbow", &["torque_elbow"]).as_deref(), Some("rad/s^2"));
        assert_eq!(symbol("vel_x", &["angle_elbow", "pos_x"]).as_deref(), Some("m/s"));
    }

    #[test]
    fn an_unknown_unit_from_the_caller_is_an_error() {
        let options = ReadOptions { units: [("a".to_owned(), "furlong".to_owned())].into(), ..Default::default() };
        let error = resolve("f.csv", "a", None, &[], &options, &mut Vec::new()).unwrap_err();
        assert!(error.to_string().contains("furlong") && error.to_string().contains("f.csv"), "{error}");
    }
}
