//! Robots in the Unified Robot Description Format: the path of moving joints from the root to the tip.

use super::config::{EndEffectorConfig, JointConfig, JointKind, RobotConfig};
use super::xml::{Element, parse};
use crate::vector3::{IDENTITY, Matrix, Vector, add, carried, plus, product, roll_pitch_yaw, scale, steiner, sub, turn};

/// A rigid body gathered from links that fixed joints hold together, in the frame of its moving joint.
struct Body {
    mass: f64,
    centre: Vector,
    /// About the frame's origin.
    inertia: Matrix,
}

/// A frame in another.
#[derive(Clone, Copy)]
struct Pose {
    rotation: Matrix,
    place: Vector,
}

impl Pose {
    const IDENTITY: Pose = Pose { rotation: IDENTITY, place: [0.0; 3] };

    fn then(&self, inner: &Pose) -> Pose {
        Pose { rotation: product(&self.rotation, &inner.rotation), place: add(self.place, turn(&self.rotation, inner.place)) }
    }
}

/// Reads `<robot>`; `tip` names the link that carries the limb, the last of the chain where absent.
pub(super) fn read(text: &str, tip: Option<&str>) -> Result<RobotConfig, String> {
    let root = parse(text)?;
    if root.name != "robot" {
        return Err(format!("line {}: the root is <{}>, a URDF has <robot>", root.line, root.name));
    }
    let mut joints = Vec::new();
    for joint in root.children("joint") {
        joints.push(Joint { element: joint, parent: link_of(joint, "parent")?, child: link_of(joint, "child")? });
    }
    let names: Vec<&str> = root.children("link").map(|l| required(l, "name")).collect::<Result<_, _>>()?;
    for joint in &joints {
        for link in [joint.parent, joint.child] {
            if !names.contains(&link) {
                return Err(format!("line {}: joint \"{}\" names the link \"{link}\", which is not described", joint.element.line, joint.name()));
            }
        }
    }
    let base = root_of(&names, &joints)?;
    let path = path_to(tip_of(&names, &joints, tip)?, base, &joints)?;
    let links = Links { root: &root, joints: &joints };
    let mut config = RobotConfig {
        schema: "ndof/robot/1".to_owned(),
        name: root.attribute("name").unwrap_or("robot").to_owned(),
        axes: Vec::new(),
        gravity_m_per_s2: [0.0, 0.0, -9.81],
        joints: Vec::new(),
        end_effector: EndEffectorConfig::default(),
        transducer: Default::default(),
        hold: Default::default(),
    };
    // Fixed joints before a moving one shift its origin; what stands on the base does not move and needs no mass.
    let mut lead = Pose::IDENTITY;
    links.gather(base, &Pose::IDENTITY, &path, &mut Body { mass: 0.0, centre: [0.0; 3], inertia: [[0.0; 3]; 3] })?;
    for joint in &path {
        let pose = lead.then(&origin(joint.element)?);
        if joint.is_fixed() {
            lead = pose;
            continue;
        }
        lead = Pose::IDENTITY;
        let mut body = Body { mass: 0.0, centre: [0.0; 3], inertia: [[0.0; 3]; 3] };
        links.gather(joint.child, &Pose::IDENTITY, &path, &mut body)?;
        config.joints.push(moving(joint, &pose, &body)?);
    }
    config.end_effector.translation_m = lead.place;
    Ok(config)
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

/// The link that carries the limb: the one that is named, else the only end.
fn tip_of<'a>(names: &[&'a str], joints: &[Joint<'a>], tip: Option<&'a str>) -> Result<&'a str, String> {
    match tip {
        Some(tip) if names.contains(&tip) => Ok(tip),
        Some(tip) => Err(format!("no link \"{tip}\"; there are: {}", names.join(", "))),
        None => {
            let mut leaves = names.iter().filter(|n| !joints.iter().any(|j| j.parent == **n));
            match (leaves.next(), leaves.next()) {
                (Some(leaf), None) => Ok(*leaf),
                (Some(a), Some(b)) => Err(format!("links \"{a}\" and \"{b}\" are both ends; say with device.tip which carries the limb")),
                _ => Err("no link is an end".to_owned()),
            }
        }
    }
}

/// The joints from the base to the tip.
fn path_to<'a, 'b>(tip: &str, base: &str, joints: &'b [Joint<'a>]) -> Result<Vec<&'b Joint<'a>>, String> {
    let mut path = Vec::new();
    let mut at = tip;
    while at != base {
        let mut parents = joints.iter().filter(|j| j.child == at);
        let joint = parents.next().ok_or(format!("link \"{at}\" hangs on nothing"))?;
        if parents.next().is_some() || path.len() > joints.len() {
            return Err(format!("link \"{at}\" is the child of more than one joint; closed loops need a device of their own"));
        }
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

    fn is_fixed(&self) -> bool {
        self.element.attribute("type") == Some("fixed")
    }
}

struct Links<'a> {
    root: &'a Element,
    joints: &'a [Joint<'a>],
}

impl Links<'_> {
    /// Adds the inertia of `link`, standing at `pose` in the body's frame, and of all that fixed joints hang on it.
    fn gather(&self, link: &str, pose: &Pose, path: &[&Joint<'_>], body: &mut Body) -> Result<(), String> {
        if let Some(inertial) = self.root.children("link").find(|l| l.attribute("name") == Some(link)).and_then(|l| l.child("inertial")) {
            let mass = inertial.child("mass").map_or(Ok(0.0), |m| number(m, "value"))?;
            let here = pose.then(&origin(inertial)?);
            let tensor = match inertial.child("inertia") {
                None => [[0.0; 3]; 3],
                Some(i) => {
                    let v = |name| if i.attribute(name).is_some() { number(i, name) } else { Ok(0.0) };
                    let (xx, yy, zz, xy, xz, yz) = (v("ixx")?, v("iyy")?, v("izz")?, v("ixy")?, v("ixz")?, v("iyz")?);
                    [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]
                }
            };
            let total = body.mass + mass;
            if total > 0.0 {
                body.centre = scale(add(scale(body.centre, body.mass), scale(here.place, mass)), 1.0 / total);
            }
            body.mass = total;
            body.inertia = plus(&body.inertia, &plus(&carried(&here.rotation, &tensor), &steiner(mass, here.place)));
        }
        for joint in self.joints.iter().filter(|j| j.parent == link) {
            if joint.is_fixed() {
                self.gather(joint.child, &pose.then(&origin(joint.element)?), path, body)?;
            } else if !path.iter().any(|j| j.child == joint.child) {
                return Err(format!(
                    "line {}: joint \"{}\" branches off the way to the end effector; make it fixed or choose another device.tip",
                    joint.element.line,
                    joint.name()
                ));
            }
        }
        Ok(())
    }
}

fn moving(joint: &Joint<'_>, pose: &Pose, body: &Body) -> Result<JointConfig, String> {
    let element = joint.element;
    let kind = match required(element, "type")? {
        "revolute" | "continuous" => JointKind::Revolute,
        "prismatic" => JointKind::Prismatic,
        other => {
            return Err(format!("line {}: joint \"{}\" is of type \"{other}\"; known are revolute, continuous, prismatic, fixed", element.line, joint.name()));
        }
    };
    if let Some(mimic) = element.child("mimic") {
        return Err(format!("line {}: joint \"{}\" mimics another; such couplings need a device of their own", mimic.line, joint.name()));
    }
    let optional = |parent: &str, name: &str| match element.child(parent) {
        Some(e) if e.attribute(name).is_some() => number(e, name).map(Some),
        _ => Ok(None),
    };
    let range_rad = match (element.attribute("type"), optional("limit", "lower")?, optional("limit", "upper")?) {
        (Some("continuous"), ..) | (_, None, None) => None,
        (_, lower, upper) => Some([lower.unwrap_or(0.0), upper.unwrap_or(0.0)]),
    };
    // About the centre of mass in place of the origin.
    let shift = steiner(body.mass, body.centre);
    let about: Matrix = std::array::from_fn(|i| sub(body.inertia[i], shift[i]));
    Ok(JointConfig {
        name: joint.name().to_owned(),
        kind,
        axis: element.child("axis").map_or(Ok([1.0, 0.0, 0.0]), |a| triple(a, "xyz"))?,
        origin_m: pose.place,
        origin_rpy_rad: angles(&pose.rotation),
        mass_kg: body.mass,
        centre_m: body.centre,
        inertia_kg_m2: [about[0][0], about[1][1], about[2][2], about[0][1], about[0][2], about[1][2]],
        gear_ratio: 1.0,
        rotor_inertia_kg_m2: 0.0,
        coulomb_nm: optional("dynamics", "friction")?.unwrap_or(0.0),
        viscous_nm_s_per_rad: optional("dynamics", "damping")?.unwrap_or(0.0),
        torque_limit_nm: optional("limit", "effort")?.filter(|e| *e > 0.0),
        rate_limit_rad_per_s: optional("limit", "velocity")?.filter(|v| *v > 0.0),
        range_rad,
        home_rad: 0.0,
    })
}

/// Roll, pitch and yaw of a rotation.
fn angles(r: &Matrix) -> Vector {
    let level = r[0][0].hypot(r[1][0]);
    let pitch = (-r[2][0]).atan2(level);
    if level > 1e-12 { [r[2][1].atan2(r[2][2]), pitch, r[1][0].atan2(r[0][0])] } else { [0.0, pitch, (-r[0][1]).atan2(r[1][1])] }
}

fn origin(element: &Element) -> Result<Pose, String> {
    let Some(origin) = element.child("origin") else { return Ok(Pose::IDENTITY) };
    let read = |name| if origin.attribute(name).is_some() { triple(origin, name) } else { Ok([0.0; 3]) };
    Ok(Pose { rotation: roll_pitch_yaw(read("rpy")?), place: read("xyz")? })
}

fn link_of<'a>(joint: &'a Element, role: &str) -> Result<&'a str, String> {
    let child = joint.children.iter().find(|c| c.name == role);
    child.and_then(|c| c.attribute("link")).ok_or(format!("line {}: joint \"{}\" has no <{role} link=…>", joint.line, joint.attribute("name").unwrap_or("?")))
}

fn required<'a>(element: &'a Element, name: &str) -> Result<&'a str, String> {
    element.attribute(name).ok_or(format!("line {}: <{}> has no {name}", element.line, element.name))
}

fn number(element: &Element, name: &str) -> Result<f64, String> {
    let text = required(element, name)?;
    text.trim().parse().ok().filter(|v: &f64| v.is_finite()).ok_or(format!("line {}: {name}=\"{text}\" of <{}> is no number", element.line, element.name))
}

fn triple(element: &Element, name: &str) -> Result<Vector, String> {
    let text = required(element, name)?;
    let values: Option<Vec<f64>> = text.split_whitespace().map(|v| v.parse().ok().filter(|v: &f64| v.is_finite())).collect();
    match values.as_deref() {
        Some(&[x, y, z]) => Ok([x, y, z]),
        _ => Err(format!("line {}: {name}=\"{text}\" of <{}> is not three numbers", element.line, element.name)),
    }
}
