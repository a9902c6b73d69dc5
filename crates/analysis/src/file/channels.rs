//! `ndof/channels/1`: what the columns of a file are, and the matrices that turn sensors into axes.

use super::parse::check_schema;
use crate::error::AnalysisError;
use ndof_io::is_time;
use ndof_signal::{Channel, Recording, Unit};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// What the columns of a file are.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ChannelsFile {
    /// `ndof/channels/1`.
    pub schema: Option<String>,
    /// By the new name of a channel, where it comes from; channels that are not named keep their names.
    pub channels: BTreeMap<String, ChannelSource>,
    /// Matrices that make channels of others, in order.
    pub transform: Option<Transforms>,
}

/// Where a channel comes from: the column's name, alone or with more about it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum ChannelSource {
    /// The column's name.
    Name(String),
    /// With unit or sign.
    Table(ChannelTable),
}

/// Where a channel comes from, with its unit and sign.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ChannelTable {
    /// The column's name; the channel's own where it is not given.
    pub from: Option<String>,
    /// Its unit, where the file gives none or a wrong one.
    pub unit: Option<String>,
    /// Whether the sign is turned.
    #[serde(default)]
    pub negate: bool,
}

/// One matrix or several.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Transforms {
    /// `[transform]`.
    One(Transform),
    /// `[[transform]]`.
    Many(Vec<Transform>),
}

/// Channels made of others by a matrix: to = matrix · from.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Transform {
    /// Channels that are used up.
    pub from: Vec<String>,
    /// Channels that are made, each as `name` or `name [unit]`; those of `from` where it is not given.
    pub to: Option<Vec<String>>,
    /// One row a channel that is made; not with `angle_rad`.
    pub matrix: Option<Vec<Vec<f64>>>,
    /// In place of a matrix: by how much the sensor's two axes are turned counter-clockwise against those of the robot.
    pub angle_rad: Option<f64>,
}

impl ChannelsFile {
    /// The schema's name.
    pub const SCHEMA: &str = "ndof/channels/1";

    /// A mapping as it is written in one line: `force_x=Fx,pos_x=x [mm]`.
    ///
    /// # Errors
    /// [`AnalysisError::Meaning`] for a part without an equals sign.
    pub fn from_pairs(text: &str) -> Result<Self, AnalysisError> {
        let mut file = ChannelsFile::default();
        for pair in text.split(',') {
            let (new, old) =
                pair.split_once('=').map(|(new, old)| (new.trim(), old.trim())).filter(|(new, old)| !new.is_empty() && !old.is_empty()).ok_or_else(|| {
                    AnalysisError::Meaning {
                        file: "`channels`".to_owned(),
                        what: format!("\"{pair}\" is no mapping; write NEW=OLD, such as force_x=Fx, or a file"),
                    }
                })?;
            let (from, unit) = name_and_unit(old);
            let source = ChannelSource::Table(ChannelTable { from: Some(from.to_owned()), unit: unit.map(str::to_owned), negate: false });
            if file.channels.insert(new.to_owned(), source).is_some() {
                return Err(AnalysisError::Meaning { file: "`channels`".to_owned(), what: format!("\"{new}\" is given twice; a channel has one source") });
            }
        }
        Ok(file)
    }

    /// Checks what the types do not.
    ///
    /// # Errors
    /// [`AnalysisError::Meaning`] in the name of `file`.
    pub fn check(&self, file: &str) -> Result<(), AnalysisError> {
        check_schema(self.schema.as_deref(), Self::SCHEMA, file)?;
        for transform in self.transforms() {
            let wrong = |what: String| Err(AnalysisError::Meaning { file: file.to_owned(), what });
            match (&transform.matrix, transform.angle_rad) {
                (Some(_), Some(_)) => return wrong("a transform has matrix and angle_rad; keep one of them".to_owned()),
                (None, None) => return wrong("a transform has neither matrix nor angle_rad; give one of them".to_owned()),
                (None, Some(_)) if transform.from.len() != 2 => {
                    return wrong(format!("angle_rad turns two channels, from has {}; give a matrix", transform.from.len()));
                }
                _ => {}
            }
        }
        Ok(())
    }

    fn transforms(&self) -> &[Transform] {
        match &self.transform {
            None => &[],
            Some(Transforms::One(one)) => std::slice::from_ref(one),
            Some(Transforms::Many(many)) => many,
        }
    }

    /// Column and new name, unit and sign of every channel that is named.
    fn sources(&self) -> impl Iterator<Item = (&str, &str, Option<&str>, bool)> {
        self.channels.iter().map(|(new, source)| match source {
            ChannelSource::Name(old) => (old.as_str(), new.as_str(), None, false),
            ChannelSource::Table(table) => (table.from.as_deref().unwrap_or(new), new.as_str(), table.unit.as_deref(), table.negate),
        })
    }

    /// Units by the names of the columns, for the reader of the recording.
    pub fn units(&self) -> BTreeMap<String, String> {
        self.sources().filter_map(|(old, _, unit, _)| Some((old.to_owned(), unit?.to_owned()))).collect()
    }

    /// The column that is called the time, for the reader of the recording.
    pub fn time(&self) -> Option<String> {
        self.sources().find(|(_, new, ..)| is_time(new)).map(|(old, ..)| old.to_owned())
    }

    /// Renames, turns and transforms the channels of `recording`, which `file` names in errors.
    ///
    /// # Errors
    /// [`AnalysisError`] if there is no such column, a name is taken, or a matrix does not fit.
    pub fn apply(&self, recording: &Recording, file: &str) -> Result<Recording, AnalysisError> {
        let available = recording.names();
        let mut channels: Vec<Channel> = recording.channels().to_vec();
        let mut renamed = Vec::new();
        // The time is the reader's.
        for (old, new, _, negate) in self.sources().filter(|(_, new, ..)| !is_time(new)) {
            let index = available.iter().position(|name| name == old).ok_or_else(|| AnalysisError::no_channel(file, old, available.clone()))?;
            if renamed.contains(&index) {
                return Err(AnalysisError::Meaning {
                    file: file.to_owned(),
                    what: format!("column \"{old}\" is given two names, \"{}\" and \"{new}\"; name it once", channels[index].name),
                });
            }
            renamed.push(index);
            channels[index].name = new.to_owned();
            if negate {
                channels[index].samples.iter_mut().for_each(|sample| *sample = -*sample);
            }
        }
        let wrap = |source| AnalysisError::Recording { file: file.to_owned(), source };
        let mut turned = recording.with_channels(channels).map_err(wrap)?;
        for transform in self.transforms() {
            if let Some(name) = transform.from.iter().find(|name| turned.channel(name).is_err()) {
                return Err(AnalysisError::no_channel(file, name, turned.names()));
            }
            turned = transform.apply(&turned, file)?;
        }
        Ok(turned)
    }
}

impl Transform {
    fn apply(&self, recording: &Recording, file: &str) -> Result<Recording, AnalysisError> {
        let wrong = |what: String| AnalysisError::Meaning { file: file.to_owned(), what };
        let mut matrix = match (&self.matrix, self.angle_rad) {
            (Some(matrix), _) => matrix.clone(),
            (None, angle) => {
                let (sin, cos) = angle.unwrap_or(0.0).sin_cos();
                vec![vec![cos, -sin], vec![sin, cos]]
            }
        };
        let to = self.to.as_ref().unwrap_or(&self.from);
        let units: Vec<Unit> = self.from.iter().filter_map(|name| recording.channel(name).ok()).map(|channel| channel.unit.clone()).collect();
        let same = units.first().filter(|first| units.iter().all(|unit| unit == *first));
        let mut made = Vec::with_capacity(to.len());
        for (row, text) in to.iter().enumerate() {
            let (name, unit) = name_and_unit(text);
            let unit = match unit {
                Some(symbol) => {
                    let (unit, factor) = Unit::parse(symbol).map_err(|error| wrong(format!("transform to \"{text}\": {error}")))?;
                    matrix.get_mut(row).into_iter().flatten().for_each(|entry| *entry *= factor);
                    unit
                }
                None => ndof_io::infer_unit(name).or_else(|| same.cloned()).unwrap_or_else(|| Unit::other("")),
            };
            made.push((name, unit));
        }
        let from: Vec<&str> = self.from.iter().map(String::as_str).collect();
        ndof_io::calibrate(recording, &from, &matrix, &made).map_err(|error| wrong(format!("transform to {}: {error}", to.join(", "))))
    }
}

/// `name [unit]` into its parts.
fn name_and_unit(text: &str) -> (&str, Option<&str>) {
    match text.trim().strip_suffix(']').and_then(|text| text.split_once('[')) {
        Some((name, unit)) => (name.trim(), Some(unit.trim())),
        None => (text.trim(), None),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn recording() -> Recording {
        let channel = |name: &str, samples: &[f64]| Channel::new(name, Unit::other(""), samples.to_vec());
        Recording::new(100.0, vec![channel("Fx", &[1.0, 0.0]), channel("Fy", &[0.0, 2.0]), channel("emg", &[5.0, 5.0])]).expect("valid").starting_at(3.0)
    }

    fn applied(text: &str) -> Result<Recording, AnalysisError> {
        let file: ChannelsFile = super::super::parse::parse(text, "channels.toml")?;
        file.check("channels.toml")?;
        file.apply(&recording(), "a.csv")
    }

    #[test]
    fn columns_are_renamed_turned_and_calibrated() {
        let text = "
            [channels]
            g1 = \"Fx\"
            g2 = { from = \"Fy\", negate = true }
            [transform]
            from = [\"g1\", \"g2\"]
            to = [\"force_x [kN]\", \"torque_z\"]
            matrix = [[1.0, 0.0], [2.0, 3.0]]
        ";
        let made = applied(text).expect("fits");
        assert_eq!(made.names(), ["force_x", "torque_z", "emg"]);
        assert_eq!((&made.channels()[0].samples, &made.channels()[1].samples), (&vec![1000.0, 0.0], &vec![2.0, -6.0]));
        assert_eq!((made.channels()[0].unit.symbol(), made.channels()[1].unit.symbol(), made.start_s()), ("N", "N m", 3.0));
    }

    #[test]
    fn two_axes_are_turned_by_an_angle() {
        let made = applied("[transform]\nfrom = [\"Fx\", \"Fy\"]\nangle_rad = 1.5707963267948966\n").expect("fits");
        let [x, y] = [0, 1].map(|k| made.channels()[k].samples.clone());
        assert!(x.iter().zip([0.0, -2.0]).chain(y.iter().zip([1.0, 0.0])).all(|(found, truth)| (found - truth).abs() < 1e-15), "{x:?} {y:?}");
    }

    #[test]
    fn what_does_not_fit_is_named() {
        let error = |text: &str| applied(text).unwrap_err().to_string();
        assert!(error("[channels]\nforce_x = \"fx\"\n").contains("no channel \"fx\" (did you mean \"Fx\"?)"));
        assert!(error("[channels]\na = \"Fx\"\nb = \"Fx\"\n").contains("two names"));
        assert!(error("[transform]\nfrom = [\"Fx\"]\n").contains("neither matrix nor angle_rad"));
        assert!(error("[transform]\nfrom = [\"Fx\", \"Fz\"]\nangle_rad = 0.1\n").contains("no channel \"Fz\""));
        assert!(error("[transform]\nfrom = [\"Fx\", \"Fy\"]\nmatrix = [[1.0]]\n").contains("matrix has 1 rows"));
        assert!(error("[chanels]\n").contains("did you mean \"channels\"?"));
        assert!(ChannelsFile::from_pairs("force_x:Fx").unwrap_err().to_string().contains("NEW=OLD"));
    }

    #[test]
    fn a_mapping_may_stand_in_one_line() {
        let file = ChannelsFile::from_pairs("force_x=Fx, force_y=Fy [kN]").expect("a mapping");
        assert_eq!(file.units(), [("Fy".to_owned(), "kN".to_owned())].into());
        assert_eq!(file.apply(&recording(), "a.csv").expect("fits").names(), ["force_x", "force_y", "emg"]);
    }
}
