//! Corrections in the text of a URDF or MJCF.

use super::body::{Body, Described, six};
use super::config::JointConfig;
use super::correction::{Corrected, Correction, by_joint, corrected, missing};
use super::edits::Edits;
use super::xml::Element;
use super::{mjcf, urdf};
use crate::vector3::{carried, sub, transpose};

/// Round-off of sums over the bodies of a link: a difference below it is none.
const SAME: f64 = 1e-13;

/// Into the elements of each joint and body.
pub(super) fn into_xml(root: &Element, chain: &[String], corrections: &[Correction], edits: &mut Edits<'_>, left_out: &mut Vec<String>) -> Result<(), String> {
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

fn into_urdf(joint: &Described<'_>, target: &JointConfig, corrections: &[&Correction], edits: &mut Edits<'_>, left_out: &mut Vec<String>) {
    let (mut dynamics, mut limit) = (Changes::default(), Changes::default());
    let limits = joint.joint.child("limit");
    // A joint without a range becomes one with both ends, and its <limit> has to say its effort and velocity by then.
    let endless = joint.joint.attribute("type") == Some("continuous");
    let ends = corrections.iter().filter(|c| matches!(c.what, Corrected::Range(_))).count();
    let is_whole = limits.is_some_and(|limit| ["effort", "velocity"].iter().all(|name| limit.attribute(name).is_some()));
    for correction in corrections {
        match correction.what {
            Corrected::Viscous => dynamics.push("damping", target.viscous_nm_s_per_rad, correction),
            Corrected::Coulomb => dynamics.push("friction", target.coulomb_nm, correction),
            Corrected::FrictionAhead | Corrected::Rotor | Corrected::TorqueDelay | Corrected::Stiffness | Corrected::SpringRest => {
                left_out.push(missing(correction, "URDF"));
            }
            Corrected::Range(_) if limits.is_none() || endless && !(ends == 2 && is_whole) => {
                left_out.push(format!(
                    "joint \"{}\" has no <limit> that counts: the {}, {}, is not written; give it one, with effort and velocity, and write again",
                    correction.joint,
                    correction.called(),
                    correction.value
                ));
            }
            Corrected::Range(k) => limit.push(["lower", "upper"][k], correction.value, correction),
            _ => {}
        }
    }
    if endless && !limit.values.is_empty() {
        edits.set(joint.joint, "type", "revolute");
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
fn word(value: f64) -> String {
    format!("{value:?}")
}

fn words(values: &[f64]) -> String {
    values.iter().map(|v| word(*v)).collect::<Vec<_>>().join(" ")
}
