//! Robots in the Unified Robot Description Format: the path of moving joints from the root to the tip.

use super::body::{Body, Described, Drive, Pose, end_of, hold_still, robot, six, tensor};
use super::config::{JointConfig, JointKind, RobotConfig};
use super::xml::Element;
use crate::vector3::roll_pitch_yaw;

/// Reads `<robot>`; `asked` names the link that carries the limb, the last of the chain where absent.
pub(super) fn read(root: &Element, asked: Option<&str>) -> Result<RobotConfig, String> {
    unexpanded(root).map_or(Ok(()), Err)?;
    let (names, joints) = parts(root)?;
    let base = root_of(&names, &joints)?;
    let (tip, ends) = tip_of(&names, &joints, (base, asked))?;
    let mut path = path_to(tip, base, &joints)?;
    // What mimics at the end of a chain that no one named is no part of it.
    while let Some(last) = path.iter().rposition(|j| !j.is_fixed()).filter(|k| asked.is_none() && path[*k].mimics()) {
        path.truncate(last);
    }
    let tip = path.last().map_or(base, |j| j.child);
    let moves = |joint: &Joint<'_>| !joint.is_fixed() && path.iter().any(|p| p.child == joint.child);
    let links = Links { root, joints: &joints, moves: &moves };
    let mut config = robot(root.attribute("name").unwrap_or("robot"));
    config.ends = ends;
    hold_still(&mut config, joints.iter().filter(|j| !j.is_fixed() && !moves(j)).map(Joint::name), tip);
    // Fixed joints before a moving one shift its origin; what stands on the base does not move and needs no mass.
    let mut lead = Pose::IDENTITY;
    links.gather(base, &Pose::IDENTITY)?;
    for joint in &path {
        let pose = lead.then(&origin(joint.element)?);
        if joint.is_fixed() {
            lead = pose;
            continue;
        }
        lead = Pose::IDENTITY;
        let body = links.gather(joint.child, &Pose::IDENTITY)?;
        if body.mass == 0.0 {
            config.notes.push(format!(
                "line {}: nothing that joint \"{}\" moves before the next has an <inertial>: link \"{}\" weighs nothing here",
                links.line(joint.child),
                joint.name(),
                joint.child
            ));
        }
        config.joints.push(moving(joint, &pose, &body)?);
    }
    config.end_effector.translation_m = lead.place;
    Ok(config)
}

/// Whether xacro puts something in this element's place; what it only defines may have been left over.
fn asks_for_more(name: &str) -> bool {
    name.strip_prefix("xacro:").is_some_and(|what| !["property", "arg", "macro"].contains(&what))
}

/// What xacro has to expand before it is a URDF.
fn unexpanded(element: &Element) -> Option<String> {
    let inner = element.attributes.iter().find(|a| a.value.contains("${") || a.value.contains("$("));
    let what = inner.map(|a| format!("{}=\"{}\" of {}", a.name, a.value, element.called())).or_else(|| asks_for_more(&element.name).then(|| element.called()));
    let place = what.map(|what| format!("{what} is of xacro, not of URDF; run xacro first: `xacro robot.urdf.xacro > robot.urdf`"));
    place.or_else(|| element.children.iter().find_map(unexpanded))
}

/// The joint called `name` in a chain of joints, or, where it is empty, in a robot all of whose joints move.
pub(super) fn described<'a>(root: &'a Element, name: &str, chain: &[String]) -> Result<Described<'a>, String> {
    let (names, joints) = parts(root)?;
    root_of(&names, &joints)?;
    let found = joints.iter().find(|j| j.name() == name && !j.is_fixed());
    let joint = found.ok_or_else(|| format!("no moving joint \"{name}\"; there are: {}", listed(joints.iter().filter(|j| !j.is_fixed()).map(Joint::name))))?;
    let body = root.children("link").find(|l| l.attribute("name") == Some(joint.child)).ok_or_else(|| format!("no link \"{}\"", joint.child))?;
    let moves = |joint: &Joint<'_>| !joint.is_fixed() && (chain.is_empty() || chain.iter().any(|own| own == joint.name()));
    let total = Links { root, joints: &joints, moves: &moves }.gather(joint.child, &Pose::IDENTITY)?;
    let rest = total.without(&inertial(body, &Pose::IDENTITY)?);
    let inertial = body.child("inertial").map(|i| origin(i).map(|pose| (i, pose.rotation))).transpose()?;
    let config = moving(joint, &origin(joint.element)?, &total)?;
    Ok(Described { config, joint: joint.element, body, inertial, offset: [0.0; 3], rest, massless: None, drive: Drive { unit: 1.0, ..Drive::default() } })
}

fn listed<'a>(names: impl Iterator<Item = &'a str>) -> String {
    names.collect::<Vec<_>>().join(", ")
}

/// The links' names and the joints.
fn parts(root: &Element) -> Result<(Vec<&str>, Vec<Joint<'_>>), String> {
    let mut joints = Vec::new();
    for joint in root.children("joint") {
        joints.push(Joint { element: joint, parent: link_of(joint, "parent")?, child: link_of(joint, "child")? });
    }
    let names: Vec<&str> = root.children("link").map(|l| l.required("name")).collect::<Result<_, _>>()?;
    for joint in &joints {
        for link in [joint.parent, joint.child] {
            if !names.contains(&link) {
                return Err(format!("line {}: joint \"{}\" names the link \"{link}\", which is not described", joint.element.line, joint.name()));
            }
        }
        if joints.iter().filter(|j| j.child == joint.child).count() > 1 {
            return Err(format!("link \"{}\" is the child of more than one joint; closed loops need a device of their own", joint.child));
        }
    }
    Ok((names, joints))
}

/// The one link that hangs on nothing and carries all others.
fn root_of<'a>(names: &[&'a str], joints: &[Joint<'a>]) -> Result<&'a str, String> {
    let mut roots = names.iter().filter(|n| !joints.iter().any(|j| j.child == **n));
    let base = match (roots.next(), roots.next()) {
        (Some(base), None) => *base,
        (Some(a), Some(b)) => return Err(format!("links \"{a}\" and \"{b}\" both have no parent; a robot has one root")),
        _ => return Err("no link is the root: the joints go round in a circle".to_owned()),
    };
    for name in names {
        let mut at = *name;
        for _ in 0..=joints.len() {
            at = joints.iter().find(|j| j.child == at).map_or(at, |j| j.parent);
        }
        if at != base {
            return Err(format!("link \"{name}\" does not hang on the root \"{base}\": the joints go round in a circle"));
        }
    }
    Ok(base)
}

/// The link that carries the limb: the one that is named, else the end of the chain ([`end_of`]).
fn tip_of<'a>(names: &[&'a str], joints: &[Joint<'a>], (base, tip): (&'a str, Option<&'a str>)) -> Result<(&'a str, Vec<String>), String> {
    match tip {
        Some(tip) if names.contains(&tip) => return Ok((tip, Vec::new())),
        Some(tip) => return Err(format!("no link \"{tip}\"; there are: {}", names.join(", "))),
        None => {}
    }
    let up = |link: &'a str| joints.iter().find(|j| j.child == link);
    let moved = |leaf: &'a str| {
        let mut at = leaf;
        // What mimics another joint has no motor: it is held.
        while let Some(fixed) = up(at).filter(|j| j.is_fixed() || j.mimics()) {
            at = fixed.parent;
        }
        (at != base).then_some(at)
    };
    let hangs_on = |link: &'a str, part: &'a str| std::iter::successors(Some(link), |at| up(at).map(|j| j.parent)).any(|at| at == part);
    let leaves: Vec<&str> = names.iter().filter(|n| !joints.iter().any(|j| j.parent == **n)).copied().collect();
    if leaves.is_empty() {
        return Err("no link is an end".to_owned());
    }
    match end_of(&leaves, moved, hangs_on) {
        Ok((tip, still)) => Ok((tip, still.into_iter().map(str::to_owned).collect())),
        Err([a, b]) => Err(format!("links \"{a}\" and \"{b}\" are both ends; say with `tip` which carries the limb")),
    }
}

/// The joints from the base to the tip.
fn path_to<'a, 'b>(tip: &str, base: &str, joints: &'b [Joint<'a>]) -> Result<Vec<&'b Joint<'a>>, String> {
    let mut path = Vec::new();
    let mut at = tip;
    while at != base {
        let joint = joints.iter().find(|j| j.child == at).ok_or_else(|| format!("link \"{at}\" hangs on nothing"))?;
        path.push(joint);
        at = joint.parent;
    }
    path.reverse();
    Ok(path)
}

struct Joint<'a> {
    element: &'a Element,
    parent: &'a str,
    child: &'a str,
}

impl Joint<'_> {
    fn name(&self) -> &str {
        self.element.attribute("name").unwrap_or("?")
    }

    fn mimics(&self) -> bool {
        self.element.child("mimic").is_some()
    }

    fn is_fixed(&self) -> bool {
        self.element.attribute("type") == Some("fixed")
    }
}

struct Links<'a> {
    root: &'a Element,
    joints: &'a [Joint<'a>],
    moves: &'a dyn Fn(&Joint<'_>) -> bool,
}

impl Links<'_> {
    fn line(&self, link: &str) -> usize {
        self.root.children("link").find(|l| l.attribute("name") == Some(link)).map_or(0, |l| l.line)
    }

    /// `link`, standing at `pose` in the body's frame, and all that joints hang on it that do not move.
    fn gather(&self, link: &str, pose: &Pose) -> Result<Body, String> {
        let mut body = Body::default();
        if let Some(element) = self.root.children("link").find(|l| l.attribute("name") == Some(link)) {
            body.add(&inertial(element, pose)?);
        }
        for joint in self.joints.iter().filter(|j| j.parent == link && !(self.moves)(j)) {
            body.add(&self.gather(joint.child, &pose.then(&origin(joint.element)?))?);
        }
        Ok(body)
    }
}

/// What a link weighs by itself, standing at `pose`.
fn inertial(link: &Element, pose: &Pose) -> Result<Body, String> {
    let Some(inertial) = link.child("inertial") else { return Ok(Body::default()) };
    let mass = inertial.child("mass").map_or(Ok(0.0), |m| m.numbers("value", None).map(|[v]| v))?;
    let about = match inertial.child("inertia") {
        None => [0.0; 6],
        Some(i) => {
            let v = |name| i.number(name, 0.0);
            [v("ixx")?, v("iyy")?, v("izz")?, v("ixy")?, v("ixz")?, v("iyz")?]
        }
    };
    Ok(Body::new(mass, &pose.then(&origin(inertial)?), &tensor(about)))
}

fn moving(joint: &Joint<'_>, pose: &Pose, body: &Body) -> Result<JointConfig, String> {
    let element = joint.element;
    let kind = match element.required("type")? {
        "revolute" | "continuous" => JointKind::Revolute,
        "prismatic" => JointKind::Prismatic,
        other => {
            return Err(format!("line {}: joint \"{}\" is of type \"{other}\"; known are revolute, continuous, prismatic, fixed", element.line, joint.name()));
        }
    };
    if let Some(mimic) = element.child("mimic") {
        return Err(format!(
            "line {}: joint \"{}\" mimics another, and is on the way to the tip; choose the link before it with `tip`",
            mimic.line,
            joint.name()
        ));
    }
    let optional = |parent: &str, name: &str| match element.child(parent) {
        Some(e) if e.attribute(name).is_some() => e.numbers(name, None).map(|[v]: [f64; 1]| Some(v)),
        _ => Ok(None),
    };
    let range_rad = match (element.attribute("type"), optional("limit", "lower")?, optional("limit", "upper")?) {
        (Some("continuous"), ..) | (_, None, None) => None,
        (_, lower, upper) => Some([lower.unwrap_or(0.0), upper.unwrap_or(0.0)]),
    };
    Ok(JointConfig {
        name: joint.name().to_owned(),
        kind,
        axis: element.child("axis").map_or(Ok([1.0, 0.0, 0.0]), |a| a.numbers("xyz", None))?,
        origin_m: pose.place,
        origin_rpy_rad: pose.angles(),
        mass_kg: body.mass,
        centre_m: body.centre(),
        inertia_kg_m2: six(&body.inertia()),
        gear_ratio: 1.0,
        rotor_inertia_kg_m2: 0.0,
        coulomb_nm: optional("dynamics", "friction")?.unwrap_or(0.0),
        friction_ahead_s: 0.0,
        friction_softness: 0.0,
        viscous_nm_s_per_rad: optional("dynamics", "damping")?.unwrap_or(0.0),
        stiffness_nm_per_rad: 0.0,
        spring_rest_rad: 0.0,
        torque_limit_nm: optional("limit", "effort")?.filter(|e| *e > 0.0),
        rate_limit_rad_per_s: optional("limit", "velocity")?.filter(|v| *v > 0.0),
        range_rad,
        home_rad: 0.0,
    })
}

/// Where the `<origin>` of an element puts it.
pub(super) fn origin(element: &Element) -> Result<Pose, String> {
    let Some(origin) = element.child("origin") else { return Ok(Pose::IDENTITY) };
    let read = |name| origin.numbers(name, Some([0.0; 3]));
    Ok(Pose { rotation: roll_pitch_yaw(read("rpy")?), place: read("xyz")? })
}

fn link_of<'a>(joint: &'a Element, role: &str) -> Result<&'a str, String> {
    let link = joint.child(role).and_then(|c| c.attribute("link"));
    link.ok_or_else(|| format!("line {}: joint \"{}\" has no <{role} link=…>", joint.line, joint.attribute("name").unwrap_or("?")))
}
