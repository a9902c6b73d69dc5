//! Which channel is input, output and reference: from prefixes, or as the user says.

use crate::error::AnalysisError;
use crate::result::Warning;
use ndof_signal::{Channel, Quantity, Recording, Unit};
use ndof_sysid::{Ports, ResponseKind};

/// Prefixes that give a channel its role, with what they measure.
const PREFIXES: &[(&str, Prefix)] = &[
    ("cmd_", Prefix::Command),
    ("force_", Prefix::Effort),
    ("torque_", Prefix::Effort),
    ("pos_", Prefix::Displacement),
    ("angle_", Prefix::Displacement),
    ("vel_", Prefix::Velocity),
    ("acc_", Prefix::Acceleration),
];

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Prefix {
    Command,
    Effort,
    Displacement,
    Velocity,
    Acceleration,
}

pub(crate) fn prefix(name: &str) -> Option<Prefix> {
    PREFIXES.iter().find(|(text, _)| name.starts_with(text)).map(|(_, prefix)| *prefix)
}

/// A channel's name without its role prefix: `pos_x` moves along the axis `x`.
///
/// ```
/// assert_eq!(ndof_analysis::axis_of("pos_x"), "x");
/// assert_eq!(ndof_analysis::axis_of("handle"), "handle");
/// ```
pub fn axis_of(name: &str) -> &str {
    PREFIXES.iter().find_map(|(text, _)| name.strip_prefix(text)).unwrap_or(name)
}

/// What the user says about roles; `None` leaves it to the prefixes.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RoleNames {
    /// Commanded perturbations.
    pub references: Option<Vec<String>>,
    /// Inputs, columns of the response.
    pub inputs: Option<Vec<String>>,
    /// Outputs, rows of the response.
    pub outputs: Option<Vec<String>>,
    /// Channels that are kept without a role, as what a schedule is made of.
    pub kept: Vec<String>,
}

/// Refuses channels that are called forces or motions and have a unit that nobody knows; what is said to do is said of all of them.
fn known_units(recording: &Recording, file: &str, inputs: &[usize], outputs: &[usize]) -> Result<(), AnalysisError> {
    let channels = recording.channels();
    let is_unknown = |&i: &usize| {
        let unit = &channels[i].unit;
        matches!(unit.quantity(), Quantity::Other | Quantity::Time) && !unit.symbol().is_empty() && prefix(&channels[i].name).is_some()
    };
    let unknown = |role: &'static str, own: &[usize]| own.iter().copied().filter(is_unknown).map(|i| (role, i)).collect::<Vec<_>>();
    let all = [unknown("input", inputs), unknown("output", outputs)].concat();
    let Some((role, first)) = all.first().map(|(role, i)| (*role, &channels[*i])) else { return Ok(()) };
    let beside = |i: usize| {
        let pairs = inputs.iter().zip(outputs);
        pairs.flat_map(|(a, b)| [(*a, *b), (*b, *a)]).find(|(own, _)| *own == i).map(|(_, other)| &channels[other].unit)
    };
    let named = |(_, i): &(&str, usize)| format!("{0}=\"{0} [{1}]\"", channels[*i].name, would_be(&channels[*i].name, beside(*i)));
    Err(AnalysisError::UnknownUnit {
        file: file.to_owned(),
        name: first.name.clone(),
        role,
        unit: first.unit.symbol().to_owned(),
        channels: all.iter().map(named).collect::<Vec<_>>().join(","),
        current: is_current(first.unit.symbol()),
    })
}

/// The unit that a channel of such a name has beside its partner's.
fn would_be(name: &str, beside: Option<&Unit>) -> String {
    let quantity = match prefix(name) {
        Some(Prefix::Effort) => Quantity::Effort,
        Some(Prefix::Velocity) => Quantity::Velocity,
        Some(Prefix::Acceleration) => Quantity::Acceleration,
        Some(Prefix::Displacement) | None => Quantity::Displacement,
        Some(Prefix::Command) => Quantity::Other,
    };
    let partner = beside.filter(|unit| !matches!(unit.quantity(), Quantity::Other | Quantity::Time)).map(|unit| Unit::si(quantity, unit.is_rotational()));
    let unit = partner.filter(|_| quantity != Quantity::Other).or_else(|| ndof_io::infer_unit(name));
    unit.map_or_else(|| "UNIT".to_owned(), |unit| unit.symbol().to_owned())
}

/// Whether a unit is one of electric current.
fn is_current(symbol: &str) -> bool {
    ["A", "mA", "kA"].contains(&symbol)
}

/// Refuses a force beside an angle, or a torque beside a distance.
fn turn_or_shift(recording: &Recording, file: &str, inputs: &[usize], outputs: &[usize]) -> Result<(), AnalysisError> {
    let channels = recording.channels();
    let mechanical = |channel: &Channel| !matches!(channel.unit.quantity(), Quantity::Other | Quantity::Time);
    let effort = |channel: &Channel| channel.unit.quantity() == Quantity::Effort;
    let apart = |(i, o): &(&Channel, &Channel)| mechanical(i) && mechanical(o) && effort(i) != effort(o) && i.unit.is_rotational() != o.unit.is_rotational();
    let Some((i, o)) = inputs.iter().map(|&i| &channels[i]).zip(outputs.iter().map(|&o| &channels[o])).find(apart) else { return Ok(()) };
    let written = |channel: &Channel| format!("\"{}\" [{}]", channel.name, channel.unit.symbol());
    let (effort, motion) = if effort(i) { (written(i), written(o)) } else { (written(o), written(i)) };
    Err(AnalysisError::TurnAndShift { file: file.to_owned(), effort, motion })
}

/// What is said of channels that play no part.
fn ignored(available: &[String], used: &[usize], kept: &[usize]) -> Option<Warning> {
    let ignored: Vec<usize> = (0..available.len()).filter(|i| !used.contains(i) && !kept.contains(i)).collect();
    (!ignored.is_empty()).then(|| {
        Warning::new(
            "ignored-channels",
            format!("channels without a role in this estimate: {}", list(available, &ignored)),
            "nothing, unless one of them should be used: then name it with `input`, `output` or `reference`",
        )
    })
}

/// A channel whose name and unit say two things.
fn misnamed(channel: &Channel) -> Option<Warning> {
    let (name, unit) = (&channel.name, channel.unit.quantity());
    let called = match prefix(name)? {
        Prefix::Effort => Quantity::Effort,
        Prefix::Displacement => Quantity::Displacement,
        Prefix::Velocity => Quantity::Velocity,
        Prefix::Acceleration => Quantity::Acceleration,
        Prefix::Command => return None,
    };
    (!matches!(unit, Quantity::Other | Quantity::Time) && unit != called).then(|| {
        Warning::new(
            "name-and-unit",
            format!("channel \"{name}\" is in {}, which its name does not say; it is taken for what its unit is", channel.unit.symbol()),
            format!("correct the header, or give it with `channels={name}=\"{name} [UNIT]\"`"),
        )
    })
}

/// Roles found for a recording's channels.
#[derive(Clone, Debug, PartialEq)]
pub struct Roles {
    /// Indices into the recording's channels, paired by axis.
    pub ports: Ports,
    /// Power of s by which each input stands above displacement (0, 1, 2), or `None` for an effort.
    pub input_motion: Vec<Option<i32>>,
    /// The same of each output.
    pub output_motion: Vec<Option<i32>>,
    /// Channels that are kept without a role.
    pub kept: Vec<usize>,
    /// What the reader should know.
    pub warnings: Vec<Warning>,
}

impl Roles {
    /// Of what fills a role (references, inputs, outputs): `Some(None)` of an effort, of a motion how often its displacement was differentiated; nothing
    /// is known of references.
    pub(super) fn motion(&self, role: usize) -> Option<Option<i32>> {
        self.input_motion.iter().chain(&self.output_motion).nth(role.wrapping_sub(self.ports.references.len())).copied()
    }

    /// Channels that hold a motion.
    pub(crate) fn motions(&self) -> impl Iterator<Item = usize> {
        let [inputs, outputs] =
            [(&self.ports.inputs, &self.input_motion), (&self.ports.outputs, &self.output_motion)].map(|(channels, motion)| channels.iter().zip(motion));
        inputs.chain(outputs).filter(|(_, motion)| motion.is_some()).map(|(channel, _)| *channel)
    }

    /// Finds the roles in `recording`, which `file` names in errors.
    ///
    /// # Errors
    /// [`AnalysisError`] if a named channel does not exist or has two roles, or there is no input or output.
    pub fn find(recording: &Recording, file: &str, names: &RoleNames) -> Result<Self, AnalysisError> {
        let available = recording.names();
        let index = |name: &String| available.iter().position(|n| n == name).ok_or_else(|| AnalysisError::no_channel(file, name, available.clone()));
        let chosen = |list: &Option<Vec<String>>| list.as_ref().map(|list| list.iter().map(index).collect::<Result<Vec<_>, _>>()).transpose();
        let (references, inputs, outputs) = (chosen(&names.references)?, chosen(&names.inputs)?, chosen(&names.outputs)?);
        let taken: Vec<usize> = [&references, &inputs, &outputs].into_iter().flatten().flatten().copied().collect();
        if let Some((_, &twice)) = taken.iter().enumerate().find(|(i, c)| taken[..*i].contains(c)) {
            return Err(AnalysisError::TwoRoles { file: file.to_owned(), name: available[twice].clone() });
        }
        let free = |wanted: Prefix| -> Vec<usize> { (0..available.len()).filter(|i| prefix(&available[*i]) == Some(wanted) && !taken.contains(i)).collect() };
        let motion =
            || [Prefix::Displacement, Prefix::Velocity, Prefix::Acceleration].into_iter().map(free).find(|found| !found.is_empty()).unwrap_or_default();
        let is_motion = |indices: &[usize]| indices.iter().all(|&i| motion_of(recording, i, Prefix::Effort).is_some());
        let is_effort = |indices: &[usize]| indices.iter().all(|&i| motion_of(recording, i, Prefix::Displacement).is_none());

        let references = references.unwrap_or_else(|| free(Prefix::Command));
        let (inputs, outputs) = match (inputs, outputs) {
            (Some(inputs), Some(outputs)) => (inputs, outputs),
            (Some(inputs), None) => {
                let outputs = if is_motion(&inputs) { free(Prefix::Effort) } else { motion() };
                (inputs, outputs)
            }
            (None, Some(outputs)) => {
                let inputs = if is_effort(&outputs) { motion() } else { free(Prefix::Effort) };
                (inputs, outputs)
            }
            (None, None) => (free(Prefix::Effort), motion()),
        };
        if inputs.is_empty() {
            return Err(AnalysisError::NoInput { file: file.to_owned(), available });
        }
        if outputs.is_empty() {
            return Err(AnalysisError::NoOutput { file: file.to_owned(), available });
        }
        let mut warnings = Vec::new();
        let axes = |indices: &[usize]| indices.iter().map(|&i| axis_of(&available[i])).collect::<Vec<_>>();
        let input_axes = axes(&inputs);
        let mut pair = |indices: Vec<usize>, what: &str| match by_axis(&axes(&indices), &input_axes) {
            Some(order) => order.into_iter().map(|k| indices[k]).collect(),
            None => {
                if !indices.is_empty() && !is_only_pair(&axes(&indices), &input_axes) {
                    warnings.push(Warning::new(
                        "paired-by-order",
                        format!(
                            "{what} {} do not carry the axes of inputs {}; they are paired by their order",
                            list(&available, &indices),
                            list(&available, &inputs)
                        ),
                        "name channels by axis (force_x, pos_x), or check that `input`, `output` and `reference` list the axes in one order",
                    ));
                }
                indices
            }
        };
        let outputs = pair(outputs, "outputs");
        let references = pair(references, "references");
        let used: Vec<usize> = references.iter().chain(&inputs).chain(&outputs).copied().collect();
        known_units(recording, file, &inputs, &outputs)?;
        turn_or_shift(recording, file, &inputs, &outputs)?;
        let kept: Vec<usize> = names.kept.iter().map(index).collect::<Result<Vec<_>, _>>()?.into_iter().filter(|i| !used.contains(i)).collect();
        warnings.extend(ignored(&available, &used, &kept));
        warnings.extend(inputs.iter().chain(&outputs).filter_map(|&i| misnamed(&recording.channels()[i])));
        let orders = |indices: &[usize], role: Prefix| indices.iter().map(|&i| motion_of(recording, i, role)).collect();
        Ok(Roles {
            input_motion: orders(&inputs, Prefix::Effort),
            output_motion: orders(&outputs, Prefix::Displacement),
            ports: Ports { references, inputs, outputs },
            kept,
            warnings,
        })
    }

    /// The channels that have a role: references, inputs, outputs.
    pub fn used(&self) -> Vec<usize> {
        self.ports.references.iter().chain(&self.ports.inputs).chain(&self.ports.outputs).copied().collect()
    }

    /// What outputs over inputs are as they stand, once velocities and accelerations are brought to displacement.
    pub fn natural_kind(&self) -> ResponseKind {
        let motion = |orders: &[Option<i32>]| orders.iter().all(Option::is_some);
        let effort = |orders: &[Option<i32>]| orders.iter().all(Option::is_none);
        if effort(&self.input_motion) && motion(&self.output_motion) {
            ResponseKind::Compliance
        } else if motion(&self.input_motion) && effort(&self.output_motion) {
            ResponseKind::DynamicStiffness
        } else {
            ResponseKind::Transfer
        }
    }

    /// The kind to report where the user does not say: compliance with an effort in, dynamic stiffness with a
    /// displacement in, impedance with a velocity in.
    pub fn default_kind(&self) -> ResponseKind {
        match self.natural_kind() {
            ResponseKind::DynamicStiffness if self.input_motion.iter().all(|order| *order == Some(1)) => ResponseKind::Impedance,
            kind => kind,
        }
    }
}

/// How many times a channel is the derivative of a displacement, by its unit, then its prefix; `None` for all else.
pub(crate) fn motion_order(recording: &Recording, index: usize) -> Option<i32> {
    motion_of(recording, index, Prefix::Effort)
}

/// How many times a channel is the derivative of a displacement; `None` for an effort. Unit first, then prefix, then role.
fn motion_of(recording: &Recording, index: usize, role: Prefix) -> Option<i32> {
    let channel = &recording.channels()[index];
    let by_prefix = |prefix: Prefix| match prefix {
        Prefix::Displacement => Some(0),
        Prefix::Velocity => Some(1),
        Prefix::Acceleration => Some(2),
        Prefix::Effort | Prefix::Command => None,
    };
    match channel.unit.quantity() {
        Quantity::Displacement => Some(0),
        Quantity::Velocity => Some(1),
        Quantity::Acceleration => Some(2),
        Quantity::Effort => None,
        Quantity::Time | Quantity::Other => by_prefix(prefix(&channel.name).filter(|p| *p != Prefix::Command).unwrap_or(role)),
    }
}

/// The order that brings `axes` to that of `wanted`, if they are the same axes.
fn by_axis(axes: &[&str], wanted: &[&str]) -> Option<Vec<usize>> {
    let mut order: Vec<usize> = Vec::new();
    for axis in wanted.iter().filter(|axis| axes.contains(axis)) {
        order.extend((0..axes.len()).find(|k| axes[*k] == *axis && !order.contains(k)));
    }
    let all = wanted.iter().all(|axis| axes.contains(axis)) || axes.iter().all(|axis| wanted.contains(axis));
    let rest: Vec<usize> = (0..axes.len()).filter(|k| !order.contains(k)).collect();
    order.extend(rest);
    (all && !axes.is_empty()).then_some(order)
}

/// One channel for one input can only belong together, unless they name two axes as x and y or fe and ud do.
fn is_only_pair(axes: &[&str], inputs: &[&str]) -> bool {
    matches!((axes, inputs), ([one], [other]) if one.chars().count() > 2 || other.chars().count() > 2)
}

fn list(names: &[String], indices: &[usize]) -> String {
    indices.iter().map(|&i| names[i].as_str()).collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndof_signal::{Channel, Unit};

    fn recording(channels: &[(&str, &str)]) -> Recording {
        let channels = channels.iter().map(|(name, unit)| Channel::new(*name, Unit::parse(unit).expect("unit").0, vec![0.0, 1.0])).collect();
        Recording::new(10.0, channels).expect("valid")
    }

    /// What an error advises is taken, whatever the channels' own unit is.
    #[test]
    fn a_unit_that_nobody_knows_is_refused_with_what_is_then_taken() {
        let units = |own: &dyn Fn(&str) -> Unit| {
            let names = ["torque_a", "torque_b", "angle_b", "angle_a"];
            let channel =
                |name: &str| Channel::new(name, if name.starts_with("angle") { Unit::parse("rad").expect("unit").0 } else { own(name) }, vec![0.0, 1.0]);
            Recording::new(10.0, names.map(channel).to_vec()).expect("valid")
        };
        for unit in ["A", "counts"] {
            let error = Roles::find(&units(&|_| Unit::other(unit)), "a.csv", &RoleNames::default()).unwrap_err().to_string();
            assert_eq!(error.contains("[transform]"), unit == "A", "{error}");
            let advice = error.split_once("`channels=").and_then(|(_, rest)| rest.split_once('`')).expect("advice").0.replace('"', "");
            let named = crate::file::ChannelsFile::from_pairs(&advice).expect("pairs").units();
            let taken = units(&|name| Unit::parse(&named[name]).expect("a unit").0);
            assert!(Roles::find(&taken, "a.csv", &RoleNames::default()).is_ok(), "{advice}");
        }
    }

    fn find(channels: &[(&str, &str)], inputs: Option<&str>, outputs: Option<&str>) -> Result<(Recording, Roles), AnalysisError> {
        let split = |text: &str| text.split(',').map(str::to_owned).collect();
        let recording = recording(channels);
        let names = RoleNames { inputs: inputs.map(split), outputs: outputs.map(split), ..RoleNames::default() };
        let roles = Roles::find(&recording, "a.csv", &names)?;
        Ok((recording, roles))
    }

    #[test]
    fn prefixes_give_roles_and_axes_give_the_order() {
        let channels = [("cmd_x", "N"), ("cmd_y", "N"), ("force_x", "N"), ("force_y", "N"), ("pos_y", "m"), ("pos_x", "m"), ("vel_x", "m/s")];
        let (_, roles) = find(&channels, None, None).expect("roles");
        assert_eq!(roles.ports, Ports { references: vec![0, 1], inputs: vec![2, 3], outputs: vec![5, 4] });
        assert_eq!(roles.natural_kind(), ResponseKind::Compliance);
        assert_eq!(roles.warnings.iter().map(|w| w.code.as_str()).collect::<Vec<_>>(), ["ignored-channels"]);
    }

    #[test]
    fn motion_may_be_the_input() {
        let ankle = [("angle_ankle", "rad"), ("torque_ankle", "N m")];
        assert_eq!(find(&ankle, None, None).expect("roles").1.natural_kind(), ResponseKind::Compliance);
        let (_, roles) = find(&ankle, Some("angle_ankle"), None).expect("roles");
        assert_eq!((roles.ports.inputs.as_slice(), roles.ports.outputs.as_slice()), ([0].as_slice(), [1].as_slice()));
        assert_eq!(roles.natural_kind(), ResponseKind::DynamicStiffness);
        let damper = [("vel_piston", "cm/s"), ("force_damper", "N")];
        let (_, roles) = find(&damper, Some("vel_piston"), Some("force_damper")).expect("roles");
        assert_eq!((roles.natural_kind(), roles.default_kind(), roles.input_motion[0]), (ResponseKind::DynamicStiffness, ResponseKind::Impedance, Some(1)));
    }

    #[test]
    fn channels_without_a_prefix_are_effort_in_and_displacement_out() {
        let (_, roles) = find(&[("u", ""), ("y", "")], Some("u"), Some("y")).expect("roles");
        assert_eq!(roles.natural_kind(), ResponseKind::Compliance);
    }

    #[test]
    fn other_axes_are_paired_by_order_with_a_warning() {
        for channels in [&[("force_motor", "N"), ("force_brake", "N"), ("pos_carriage", "m"), ("pos_wheel", "m")][..], &[("force_x", "N"), ("pos_y", "m")]] {
            assert_eq!(find(channels, None, None).expect("roles").1.warnings[0].code, "paired-by-order");
        }
        assert!(find(&[("force_motor", "N"), ("pos_carriage", "m")], None, None).expect("roles").1.warnings.is_empty());
    }

    #[test]
    fn a_missing_channel_is_named_with_the_nearest_one() {
        let error = find(&[("force_x", "N"), ("pos_x", "m")], Some("force_X"), None).unwrap_err().to_string();
        assert!(error.contains("no channel \"force_X\" (did you mean \"force_x\"?)"), "{error}");
        assert!(matches!(find(&[("emg", "")], None, None), Err(AnalysisError::NoInput { .. })));
    }
}
