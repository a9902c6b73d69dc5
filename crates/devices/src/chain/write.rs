//! Corrections written back into the file of a robot.

use super::body::{Body, Described, six};
use super::config::{JointConfig, RobotConfig};
use super::edits::{Edits, one_line};
use super::xml::{self, Element};
use super::{mjcf, toml_edit, urdf};
use crate::error::DeviceError;
use crate::vector3::{carried, sub, transpose};

/// Round-off of sums over the bodies of a link: a difference below it is none.
const SAME: f64 = 1e-13;

/// A number of a robot's file that data correct.
#[derive(Clone, Debug, PartialEq)]
pub struct Correction {
    /// The joint; without meaning for [`Corrected::Gravity`].
    pub joint: String,
    /// What is corrected.
    pub what: Corrected,
    /// Its value, in the units of [`JointConfig`].
    pub value: f64,
    /// Why, for who reads the file.
    pub why: String,
}

/// What of a joint, or of the body that it moves, is corrected.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Corrected {
    /// Viscous friction (N m s/rad, N s/m).
    Viscous,
    /// Dry friction (N m, N).
    Coulomb,
    /// Time by which dry friction turns before the joint (s).
    FrictionAhead,
    /// Inertia of the rotor as the joint feels it, gear included (kg m², kg).
    Rotor,
    /// Time by which the torque follows its command (s).
    TorqueDelay,
    /// Stiffness of a spring at the joint (N m/rad, N/m).
    Stiffness,
    /// Angle at which that spring rests (rad, m).
    SpringRest,
    /// Mass of the body (kg), its centre and the inertia about it remaining.
    Mass,
    /// Centre of mass: 0, 1, 2 are x, y, z in the joint's frame (m).
    Centre(usize),
    /// Inertia about the centre of mass: 0 to 5 are xx, yy, zz, xy, xz, yz in the joint's axes (kg m²).
    Inertia(usize),
    /// Gravity: 0, 1, 2 are x, y, z of the base (m/s²).
    Gravity(usize),
    /// Lower (0) and upper (1) end of the range (rad, m).
    Range(usize),
}

/// A robot's file with corrections in it.
#[derive(Clone, Debug, PartialEq)]
pub struct Written {
    /// The whole file.
    pub text: String,
    /// What changed, as a unified diff under the reasons.
    pub patch: String,
    /// Sentences about what the format has no word for.
    pub left_out: Vec<String>,
}

/// Writes corrections into the text of a robot's `file`: URDF, MJCF or TOML. Comments, order and format of everything else stay; a comment before each change
/// says why. Where several links make up a body, that of its joint takes the difference, so that the whole is right.
///
/// # Errors
/// [`DeviceError::File`] that names a joint that is not there, a number that cannot be, or a body that no masses make.
///
/// ```
/// use ndof_devices::{Corrected, Correction, write_back};
///
/// let text = r#"<robot name="arm">
///   <link name="base"/><link name="upper"><inertial><mass value="1"/><inertia ixx="0.1" iyy="0.1" izz="0.1"/></inertial></link>
///   <joint name="shoulder" type="continuous"><parent link="base"/><child link="upper"/><dynamics damping="0.1"/></joint>
/// </robot>"#;
/// let less = Correction { joint: "shoulder".into(), what: Corrected::Viscous, value: 0.06, why: "0.06 ± 0.01 in ten trials".into() };
/// let written = write_back("arm.urdf", text, &[less])?;
/// assert!(written.text.contains(r#"<!-- 0.06 ± 0.01 in ten trials -->"#) && written.text.contains(r#"damping="0.06""#));
/// # Ok::<(), ndof_devices::DeviceError>(())
/// ```
pub fn write_back(file: &str, text: &str, corrections: &[Correction]) -> Result<Written, DeviceError> {
    write_back_chain(file, text, &[], corrections)
}

/// [`write_back`] for a chain of some of a robot's joints: what others carry is part of the body on which they hang.
///
/// # Errors
/// As there.
pub fn write_back_chain(file: &str, text: &str, chain: &[String], corrections: &[Correction]) -> Result<Written, DeviceError> {
    let wrong = |what: String| DeviceError::File { file: file.to_owned(), what };
    corrections.iter().try_for_each(check).map_err(wrong)?;
    let (mut edits, mut left_out) = (Edits::new(text), Vec::new());
    if text.trim_start().starts_with('<') {
        let root = xml::parse(text).map_err(wrong)?;
        into_xml(&root, chain, corrections, &mut edits, &mut left_out).map_err(wrong)?;
    } else {
        let config = RobotConfig::parse(file, text, None)?;
        toml_edit::into_toml(text, config, corrections, &mut edits, &mut left_out).map_err(wrong)?;
    }
    let text = edits.applied();
    let reasons: String = corrections.chunk_by(|a, b| a.why == b.why).map(reason).collect();
    Ok(Written { text, patch: reasons + &edits.patch(file), left_out })
}

/// Corrections for one reason.
fn reason(alike: &[Correction]) -> String {
    let called: Vec<String> = alike.iter().map(Correction::called).collect();
    format!("{}: {}\n", called.join(", "), one_line(&alike[0].why))
}

impl Correction {
    /// The number in words.
    pub(super) fn called(&self) -> String {
        let of = |names: &[&str], k: usize| names.get(k).copied().unwrap_or("?").to_owned();
        let what = match self.what {
            Corrected::Viscous => "viscous friction".to_owned(),
            Corrected::Coulomb => "dry friction".to_owned(),
            Corrected::FrictionAhead => "time ahead of the dry friction".to_owned(),
            Corrected::Rotor => "rotor inertia".to_owned(),
            Corrected::TorqueDelay => "delay of the torque".to_owned(),
            Corrected::Stiffness => "stiffness".to_owned(),
            Corrected::SpringRest => "rest of the spring".to_owned(),
            Corrected::Mass => "mass".to_owned(),
            Corrected::Centre(k) => format!("centre of mass {}", of(&["x", "y", "z"], k)),
            Corrected::Inertia(k) => format!("inertia {}", of(&["xx", "yy", "zz", "xy", "xz", "yz"], k)),
            Corrected::Gravity(k) => return format!("gravity {}", of(&["x", "y", "z"], k)),
            Corrected::Range(k) => format!("{} end of the range", of(&["lower", "upper"], k)),
        };
        format!("{what} of joint \"{}\"", self.joint)
    }

    pub(super) fn is_inertial(&self) -> bool {
        matches!(self.what, Corrected::Mass | Corrected::Centre(_) | Corrected::Inertia(_))
    }
}

/// Refuses what no robot has.
fn check(correction: &Correction) -> Result<(), String> {
    let (count, positive) = match correction.what {
        Corrected::Centre(k) | Corrected::Gravity(k) => (k < 3, false),
        Corrected::Inertia(k) => (k < 6, false),
        Corrected::Range(k) => (k < 2, false),
        Corrected::SpringRest => (true, false),
        _ => (true, true),
    };
    if !count {
        return Err(format!("{}: no such component", correction.called()));
    }
    if !correction.value.is_finite() || (positive && correction.value < 0.0) {
        return Err(format!("{} would be {}; no robot has that", correction.called(), correction.value));
    }
    Ok(())
}

/// A joint with its corrections, the range beyond any where it has none.
pub(super) fn corrected(joint: &JointConfig, corrections: &[&Correction]) -> Result<JointConfig, String> {
    let mut target = joint.clone();
    for correction in corrections {
        let value = correction.value;
        match correction.what {
            Corrected::Viscous => target.viscous_nm_s_per_rad = value,
            Corrected::Coulomb => target.coulomb_nm = value,
            Corrected::FrictionAhead => target.friction_ahead_s = value,
            Corrected::Rotor => target.rotor_inertia_kg_m2 = value / target.gear_ratio.powi(2),
            Corrected::Stiffness => target.stiffness_nm_per_rad = value,
            Corrected::SpringRest => target.spring_rest_rad = value,
            Corrected::Mass => target.mass_kg = value,
            Corrected::Centre(k) => target.centre_m[k] = value,
            Corrected::Inertia(k) => target.inertia_kg_m2[k] = value,
            Corrected::Range(k) => target.range_rad.get_or_insert([f64::NEG_INFINITY, f64::INFINITY])[k] = value,
            Corrected::TorqueDelay | Corrected::Gravity(_) => {}
        }
    }
    let called = |want: fn(&Correction) -> bool| corrections.iter().find(|c| want(c)).map(|c| c.called());
    if let Some(called) = called(Correction::is_inertial).filter(|_| !Body::of(&target).exists()) {
        return Err(format!(
            "with the {called}, its body would be one that no masses make: a mass of {} kg, inertia {:?} kg m²",
            target.mass_kg, target.inertia_kg_m2
        ));
    }
    if let (Some([low, high]), Some(called)) = (target.range_rad, called(|c| matches!(c.what, Corrected::Range(_))))
        && !(low < high && low.is_finite() && high.is_finite())
    {
        return Err(format!("with the {called}, its range would be {low} to {high}; it needs two ends, the lower before the upper"));
    }
    Ok(target)
}

/// The corrections of one joint after another.
pub(super) fn by_joint(corrections: &[Correction]) -> Vec<(&str, Vec<&Correction>)> {
    let mut list: Vec<(&str, Vec<&Correction>)> = Vec::new();
    for correction in corrections.iter().filter(|c| !matches!(c.what, Corrected::Gravity(_))) {
        match list.iter_mut().find(|(name, _)| *name == correction.joint) {
            Some((_, own)) => own.push(correction),
            None => list.push((&correction.joint, vec![correction])),
        }
    }
    list
}

fn into_xml(root: &Element, chain: &[String], corrections: &[Correction], edits: &mut Edits<'_>, left_out: &mut Vec<String>) -> Result<(), String> {
    let is_urdf = root.name == "robot";
    for (name, own) in by_joint(corrections) {
        let joint = if is_urdf { urdf::described(root, name, chain)? } else { mjcf::described(root, name, chain)? };
        let target = corrected(&joint.config, &own)?;
        if is_urdf {
            into_urdf(&joint, &target, &own, edits, left_out)
        } else {
            into_mjcf(&joint, &target, &own, edits, left_out)?
        }
        let inertial: Vec<&Correction> = own.iter().copied().filter(|c| c.is_inertial()).collect();
        if !inertial.is_empty() {
            into_body(&joint, &target, &inertial, is_urdf, edits)?;
        }
    }
    let gravity: Vec<&Correction> = corrections.iter().filter(|c| matches!(c.what, Corrected::Gravity(_))).collect();
    if is_urdf {
        left_out.extend(gravity.iter().map(|c| missing(c, "URDF")));
    } else if !gravity.is_empty() {
        let mut target = mjcf::gravity(root)?;
        gravity.iter().for_each(|c| {
            if let Corrected::Gravity(k) = c.what {
                target[k] = c.value
            }
        });
        // The last of several counts.
        let option = root.children("option").filter(|o| o.attribute("gravity").is_some()).last().or(root.child("option"));
        put(edits, (root, option, "option"), &[("gravity", words(&target))], &reasons(&gravity));
    }
    Ok(())
}

pub(super) fn missing(correction: &Correction, format: &str) -> String {
    format!("{format} has no word for the {}: {} is not written", correction.called(), correction.value)
}

fn into_urdf(joint: &Described<'_>, target: &JointConfig, corrections: &[&Correction], edits: &mut Edits<'_>, left_out: &mut Vec<String>) {
    let (mut dynamics, mut limit) = (Changes::default(), Changes::default());
    let limits = joint.joint.child("limit").filter(|_| joint.joint.attribute("type") != Some("continuous"));
    for correction in corrections {
        match correction.what {
            Corrected::Viscous => dynamics.push("damping", target.viscous_nm_s_per_rad, correction),
            Corrected::Coulomb => dynamics.push("friction", target.coulomb_nm, correction),
            Corrected::FrictionAhead | Corrected::Rotor | Corrected::TorqueDelay | Corrected::Stiffness | Corrected::SpringRest => {
                left_out.push(missing(correction, "URDF"));
            }
            Corrected::Range(_) if limits.is_none() => {
                left_out.push(format!("joint \"{}\" has no <limit> that counts: the {} is not written", correction.joint, correction.called()));
            }
            Corrected::Range(k) => limit.push(["lower", "upper"][k], correction.value, correction),
            _ => {}
        }
    }
    for (name, element, changes) in [("dynamics", joint.joint.child("dynamics"), dynamics), ("limit", limits, limit)] {
        if !changes.values.is_empty() {
            put(edits, (joint.joint, element, name), &changes.values, &changes.why);
        }
    }
}

fn into_mjcf(
    joint: &Described<'_>,
    target: &JointConfig,
    corrections: &[&Correction],
    edits: &mut Edits<'_>,
    left_out: &mut Vec<String>,
) -> Result<(), String> {
    let (mut changes, drive) = (Changes::default(), &joint.drive);
    let beside = |value: f64, motors: f64, correction: &Correction| {
        let own = value - motors;
        if own >= 0.0 { Ok(own) } else { Err(format!("{} would be {value}, below the {motors} of its actuators", correction.called())) }
    };
    for correction in corrections {
        match correction.what {
            Corrected::Viscous => changes.push("damping", beside(target.viscous_nm_s_per_rad, drive.damping, correction)?, correction),
            Corrected::Coulomb => changes.push("frictionloss", target.coulomb_nm, correction),
            Corrected::FrictionAhead => {
                // No shorter than the engine keeps, with its own damping ratio and impedance.
                let time = (2.0 * correction.value / 0.95).max(2.0 * drive.timestep_s);
                changes.say("solreffriction", format!("{} 1", word(time)), correction);
                changes.say("solimpfriction", "0.9 0.95 0.001 0.5 2".to_owned(), correction);
            }
            Corrected::Rotor => changes.push("armature", beside(target.rotor_inertia_kg_m2, drive.armature, correction)?, correction),
            Corrected::Stiffness => changes.push("stiffness", target.stiffness_nm_per_rad, correction),
            Corrected::SpringRest => changes.push("springref", target.spring_rest_rad / drive.unit, correction),
            Corrected::TorqueDelay if drive.actuators.is_empty() => {
                left_out.push(format!("no actuator drives joint \"{}\": the {} is not written", correction.joint, correction.called()));
            }
            Corrected::TorqueDelay if drive.timestep_s <= 0.0 => return Err(format!("{}: a timestep of {} s", correction.called(), drive.timestep_s)),
            Corrected::TorqueDelay => {
                for actuator in &drive.actuators {
                    // Steps that the actuator remembers: all of the delay, and the one that begins.
                    let steps = (correction.value / drive.timestep_s).ceil() + 1.0;
                    let own = [("delay", word(correction.value)), ("nsample", format!("{steps:.0}"))];
                    put(edits, (actuator, Some(actuator), ""), &own, &[&correction.why]);
                }
            }
            Corrected::Range(_) => {
                changes.why.push(&correction.why);
                let range = target.range_rad.unwrap_or_default().map(|v| v / drive.unit);
                changes.values.retain(|(name, _)| *name != "range" && *name != "limited");
                changes.values.extend([("range", words(&range)), ("limited", "true".to_owned())]);
            }
            _ => {}
        }
    }
    if !changes.values.is_empty() {
        put(edits, (joint.joint, Some(joint.joint), ""), &changes.values, &changes.why);
    }
    Ok(())
}

/// Gives the link or body of the joint the inertia with which all that is fixed to it is `target`.
fn into_body(joint: &Described<'_>, target: &JointConfig, corrections: &[&Correction], is_urdf: bool, edits: &mut Edits<'_>) -> Result<(), String> {
    let called = corrections[0].called();
    if let Some(why) = &joint.massless {
        return Err(format!("{called}: {why}"));
    }
    // Without an <inertial> an MJCF takes the mass of the body from shapes, which the new one stands for; what is fixed to it remains.
    let own = Body::of(target).without(&joint.rest);
    if !own.exists() {
        let body = joint.body.attribute("name").unwrap_or("?");
        return Err(format!("{called}: without what is fixed to it, \"{body}\" would have a mass of {:.6} kg and an inertia that no masses make", own.mass));
    }
    // Round-off of a zero is no number to write.
    let [about, local] =
        [own.inertia(), joint.inertial.map_or(own.inertia(), |(_, turned)| carried(&transpose(&turned), &own.inertia()))].map(|m| tidy(six(&m)));
    let (place, why) = (tidy(sub(own.centre(), joint.offset)), reasons(corrections));
    let Some((element, _)) = joint.inertial else {
        let (mass, centre) = (word(own.mass), words(&place));
        let child = if is_urdf {
            let entries: String = ENTRIES.iter().zip(about).map(|(name, v)| format!(" {name}=\"{}\"", word(v))).collect();
            format!("<inertial><origin xyz=\"{centre}\"/><mass value=\"{mass}\"/><inertia{entries}/></inertial>")
        } else {
            format!("<inertial pos=\"{centre}\" mass=\"{mass}\" fullinertia=\"{}\"/>", words(&about))
        };
        edits.insert(joint.body, &child, &why);
        return Ok(());
    };
    edits.note(element, &why);
    if is_urdf {
        into_child(edits, element, "origin", &[("xyz", &place)]);
        into_child(edits, element, "mass", &[("value", &[own.mass])]);
        let entries: Vec<(&str, &[f64])> = ENTRIES.iter().zip(&local).map(|(name, v)| (*name, std::slice::from_ref(v))).collect();
        into_child(edits, element, "inertia", &entries);
        return Ok(());
    }
    changed(edits, element, "mass", &[own.mass], own.mass);
    changed(edits, element, "pos", &place, largest(&place));
    let size = largest(&local);
    if element.attribute("fullinertia").is_none() && local[3..] == [0.0; 3] {
        changed(edits, element, "diaginertia", &local[..3], size);
    } else {
        // The tensor in the body's axes, with which MJCF allows no turn.
        ["diaginertia", "quat", "axisangle", "xyaxes", "zaxis", "euler"].iter().for_each(|name| edits.remove(element, name));
        changed(edits, element, "fullinertia", &about, size);
    }
    Ok(())
}

/// Names in URDF, in the order of [`six`].
const ENTRIES: [&str; 6] = ["ixx", "iyy", "izz", "ixy", "ixz", "iyz"];

/// Numbers of a child of `<inertial>`, which is made where it is missing.
fn into_child(edits: &mut Edits<'_>, inertial: &Element, name: &str, values: &[(&str, &[f64])]) {
    let size = values.iter().fold(0.0_f64, |s, (_, v)| s.max(largest(v)));
    match inertial.child(name) {
        Some(child) => values.iter().for_each(|(attribute, v)| changed(edits, child, attribute, v, size)),
        None if size > 0.0 => {
            let values: String = values.iter().map(|(attribute, v)| format!(" {attribute}=\"{}\"", words(v))).collect();
            edits.insert(inertial, &format!("<{name}{values}/>"), &[]);
        }
        None => {}
    }
}

/// Sets numbers that differ from those of the file by more than round-off of `size`; those that it lacks are zero.
fn changed(edits: &mut Edits<'_>, element: &Element, name: &str, values: &[f64], size: f64) {
    let old = if element.attribute(name).is_some() { element.list(name).unwrap_or_default() } else { vec![0.0; values.len()] };
    if old.len() != values.len() || old.iter().zip(values).any(|(a, b)| (a - b).abs() > SAME * size) {
        edits.set(element, name, &words(values));
    }
}

/// Attributes of one element that change, and why.
#[derive(Default)]
struct Changes<'a> {
    values: Vec<(&'static str, String)>,
    why: Vec<&'a str>,
}

impl<'a> Changes<'a> {
    fn push(&mut self, name: &'static str, value: f64, correction: &'a Correction) {
        self.say(name, word(value), correction);
    }

    fn say(&mut self, name: &'static str, value: String, correction: &'a Correction) {
        // Of two corrections of one number the later counts, as in `corrected`.
        self.values.retain(|(n, _)| *n != name);
        self.values.push((name, value));
        if self.why.last() != Some(&correction.why.as_str()) {
            self.why.push(&correction.why);
        }
    }
}

/// Sets attributes of an element, or makes it as a child of `parent`.
fn put(edits: &mut Edits<'_>, (parent, element, name): (&Element, Option<&Element>, &str), values: &[(&str, String)], why: &[&str]) {
    match element {
        Some(element) => {
            edits.note(element, why);
            values.iter().for_each(|(name, value)| edits.set(element, name, value));
        }
        None => {
            let values: String = values.iter().map(|(name, value)| format!(" {name}=\"{value}\"")).collect();
            edits.insert(parent, &format!("<{name}{values}/>"), why);
        }
    }
}

fn reasons<'a>(corrections: &[&'a Correction]) -> Vec<&'a str> {
    let mut why: Vec<&str> = corrections.iter().map(|c| c.why.as_str()).collect();
    why.dedup();
    why
}

fn tidy<const N: usize>(values: [f64; N]) -> [f64; N] {
    let size = largest(&values);
    values.map(|v| if v.abs() <= SAME * size { 0.0 } else { v })
}

fn largest(values: &[f64]) -> f64 {
    values.iter().fold(0.0_f64, |s, v| s.max(v.abs()))
}

/// A number that reads back as itself.
pub(super) fn word(value: f64) -> String {
    format!("{value:?}")
}

fn words(values: &[f64]) -> String {
    values.iter().map(|v| word(*v)).collect::<Vec<_>>().join(" ")
}
