//! Robots in MuJoCo's format MJCF: the path of bodies with hinges and slides from the world to the tip.

use super::body::{Body, Described, Drive, Pose, end_of, hold_still, robot, six, tensor};
use super::config::{JointConfig, JointKind, RobotConfig};
use super::mjcf_settings::{Classes, Compiler, FromGeoms};
use super::shape;
use super::xml::Element;
use crate::vector3::{Matrix, about, dot, product, scale, sub, turn};

/// Elements of the root that are read on their own, that neither move nor weigh anything, or that are about contact, which is not modelled.
const SILENT: [&str; 12] = ["actuator", "compiler", "option", "default", "size", "statistic", "visual", "asset", "contact", "sensor", "keyframe", "custom"];
/// Elements of the root whose children are forces or constraints.
const FORCES: [&str; 4] = ["equality", "tendon", "deformable", "extension"];
/// Elements of a body besides its joints, inertia, shapes and children.
const MARKS: [&str; 3] = ["site", "camera", "light"];
/// Actuators that are a torque at a joint, whatever commands it.
const MOTORS: [&str; 6] = ["motor", "general", "position", "velocity", "intvelocity", "pid"];

/// Reads `<mujoco>`; `tip` names the body that carries the limb, the last of the chain where absent.
pub(super) fn read(root: &Element, tip: Option<&str>) -> Result<RobotConfig, String> {
    let model = Model::of(root)?;
    let (tip, ends) = model.tip(tip)?;
    let path = model.path(tip);
    let moves = |at: usize| path.contains(&at);
    model.check_forces(&path)?;
    let mut config = robot(root.attribute("model").unwrap_or("robot"));
    config.ends = ends;
    let off: Vec<&str> = (0..model.bodies.len()).filter(|at| !moves(*at)).flat_map(|at| &model.bodies[at].joints).map(|j| j.name.as_str()).collect();
    hold_still(&mut config, off.into_iter(), model.name(tip));
    config.notes.extend(model.floating.iter().map(|body| format!("{} floats freely, and is no part of the robot", body.called())));
    config.gravity_m_per_s2 = gravity(root)?;
    let mut lead = Pose::IDENTITY;
    for at in path.iter().copied() {
        let body = &model.bodies[at];
        lead = lead.then(&body.pose);
        for (k, joint) in body.joints.iter().enumerate() {
            let place = joint.filled.numbers("pos", Some([0.0; 3]))?;
            lead = lead.then(&Pose::at(place));
            let carried = if k + 1 == body.joints.len() { model.gather(at, &Pose::at(scale(place, -1.0)), &moves)? } else { Body::default() };
            config.joints.push(model.moving(joint, &lead, &carried)?);
            lead = Pose::at(scale(place, -1.0));
        }
    }
    config.end_effector.translation_m = lead.place;
    Ok(config)
}

/// The joint called `name` in a chain of joints, or, where it is empty, in a robot all of whose joints move.
pub(super) fn described<'a>(root: &'a Element, name: &str, chain: &[String]) -> Result<Described<'a>, String> {
    let model = Model::of(root)?;
    let place = |(at, b): (usize, &Node<'a>)| b.joints.iter().position(|j| j.name == name).map(|k| (at, k));
    let names = || model.joints().map(|j| j.name.as_str()).collect::<Vec<_>>().join(", ");
    let (at, k) = model.bodies.iter().enumerate().find_map(place).ok_or_else(|| format!("no joint \"{name}\"; there are: {}", names()))?;
    let (body, joint) = (&model.bodies[at], &model.bodies[at].joints[k]);
    let offset = scale(joint.filled.numbers("pos", Some([0.0; 3]))?, -1.0);
    let (last, inertial) = (&body.joints[body.joints.len() - 1], body.element.child("inertial"));
    let moves = |at: usize| model.bodies[at].joints.iter().any(|j| chain.is_empty() || chain.contains(&j.name));
    let total = if last.name == name { model.gather(at, &Pose::at(offset), &moves)? } else { Body::default() };
    let massless = match model.compiler.from_geoms {
        _ if last.name != name => Some(format!("its body has another joint, \"{}\", after it, which carries the mass", last.name)),
        FromGeoms::Always => Some("inertiafromgeom=\"true\" takes the mass of its body from shapes".to_owned()),
        _ => None,
    };
    let rest = total.without(&model.own(body, &Pose::at(offset))?);
    let inertial = inertial.map(|i| model.compiler.pose(i).map(|pose| (i, pose.rotation))).transpose()?;
    let drive = Drive { unit: model.unit(joint), ..model.drive(joint)? };
    Ok(Described { config: model.moving(joint, &Pose::IDENTITY, &total)?, joint: joint.element, body: body.element, inertial, offset, rest, massless, drive })
}

struct Joint<'a> {
    name: String,
    element: &'a Element,
    /// With what its classes say of it.
    filled: Element,
}

struct Node<'a> {
    element: &'a Element,
    parent: Option<usize>,
    pose: Pose,
    /// The class of what has none.
    class: Option<&'a str>,
    joints: Vec<Joint<'a>>,
}

struct Model<'a> {
    root: &'a Element,
    compiler: Compiler,
    classes: Classes<'a>,
    bodies: Vec<Node<'a>>,
    /// Those that no joint holds to anything, with all that they carry.
    floating: Vec<&'a Element>,
}

impl<'a> Model<'a> {
    fn of(root: &'a Element) -> Result<Self, String> {
        whole(root)?;
        let mut model = Model { root, compiler: Compiler::of(root)?, classes: Classes::of(root)?, bodies: Vec::new(), floating: Vec::new() };
        for section in &root.children {
            match section.name.as_str() {
                "worldbody" => model.descend(section, None, section.attribute("childclass"))?,
                name if FORCES.contains(&name) => {}
                name if SILENT.contains(&name) => {}
                _ => return Err(refused(section)),
            }
        }
        model.check_actuators()?;
        Ok(model)
    }

    /// Lists the bodies in `element`.
    fn descend(&mut self, element: &'a Element, parent: Option<usize>, class: Option<&'a str>) -> Result<(), String> {
        for child in &element.children {
            match child.name.as_str() {
                "body" if floats(child) => self.floating.push(child),
                "body" => {
                    if child.number("gravcomp", 0.0)? != 0.0 {
                        return Err(format!("{} has gravcomp, which is not read", child.called()));
                    }
                    let class = child.attribute("childclass").or(class);
                    let mut node = Node { element: child, parent, pose: self.compiler.pose(child)?, class, joints: Vec::new() };
                    for joint in child.children("joint") {
                        let name = joint.attribute("name").map_or_else(|| format!("joint_{}", self.joints().count() + node.joints.len() + 1), str::to_owned);
                        node.joints.push(Joint { name, element: joint, filled: self.classes.fill(joint, &["joint"], class)? });
                    }
                    self.bodies.push(node);
                    self.descend(child, Some(self.bodies.len() - 1), class)?;
                }
                "joint" | "inertial" | "geom" if parent.is_some() => {}
                "geom" => {}
                name if MARKS.contains(&name) => {}
                _ => return Err(refused(child)),
            }
        }
        Ok(())
    }

    fn joints(&self) -> impl Iterator<Item = &Joint<'a>> {
        self.bodies.iter().flat_map(|b| &b.joints)
    }

    /// The body that carries the limb: the one that is named, else the end of the chain ([`end_of`]).
    fn tip(&self, tip: Option<&str>) -> Result<(usize, Vec<String>), String> {
        let name = |at: usize| self.name(at);
        if let Some(tip) = tip {
            let known = || (0..self.bodies.len()).map(name).collect::<Vec<_>>().join(", ");
            let found = self.bodies.iter().position(|b| b.element.attribute("name") == Some(tip));
            return found.map(|at| (at, Vec::new())).ok_or_else(|| format!("no body \"{tip}\"; there are: {}", known()));
        }
        let up = |at: usize| std::iter::successors(Some(at), |at| self.bodies[*at].parent);
        let ends: Vec<usize> = (0..self.bodies.len()).filter(|at| !self.bodies.iter().any(|b| b.parent == Some(*at))).collect();
        if ends.is_empty() {
            return Err(match self.floating.first() {
                Some(body) => format!("{} floats freely, and nothing else is in <worldbody>; the base of a robot stands still here", body.called()),
                None => "no <body> in <worldbody>".to_owned(),
            });
        }
        match end_of(&ends, |end| up(end).find(|at| !self.bodies[*at].joints.is_empty()), |at, part| up(at).any(|at| at == part)) {
            Ok((tip, still)) => Ok((tip, still.into_iter().map(|end| name(end).to_owned()).collect())),
            Err([a, b]) => Err(format!("bodies \"{}\" and \"{}\" are both ends; say with `tip` which carries the limb", name(a), name(b))),
        }
    }

    fn name(&self, at: usize) -> &'a str {
        self.bodies[at].element.attribute("name").unwrap_or("without a name")
    }

    /// Bodies from the world to the tip.
    fn path(&self, tip: usize) -> Vec<usize> {
        let mut path: Vec<usize> = std::iter::successors(Some(tip), |at| self.bodies[*at].parent).collect();
        path.reverse();
        path
    }

    /// Refuses forces and constraints that act on the joints of a path, or between bodies that these move against each other.
    fn check_forces(&self, path: &[usize]) -> Result<(), String> {
        // The last of the path's bodies with a joint that carries a body; none for the world, what stands on it and what floats.
        let carrier = |name: Option<&str>| -> Option<usize> {
            let at = self.bodies.iter().position(|b| name.is_some() && b.element.attribute("name") == name)?;
            std::iter::successors(Some(at), |at| self.bodies[*at].parent).find(|at| path.contains(at) && !self.bodies[*at].joints.is_empty())
        };
        let in_chain = |name: &str| path.iter().flat_map(|at| &self.bodies[*at].joints).any(|j| j.name == name);
        for force in self.root.children.iter().filter(|s| FORCES.contains(&s.name.as_str())).flat_map(|s| &s.children) {
            let joints = |element: &Element| ["joint", "joint1", "joint2"].iter().filter_map(|name| element.attribute(name)).any(in_chain);
            let harmless = match force.name.as_str() {
                "connect" | "weld" | "joint" | "tendon" if force.attribute("active") == Some("false") => true,
                "joint" | "fixed" => !joints(force) && !force.children.iter().any(joints),
                // Joints couple tendons, which are refused themselves where they act on the chain.
                "tendon" => true,
                "connect" | "weld" => force.attribute("body1").is_some() && carrier(force.attribute("body1")) == carrier(force.attribute("body2")),
                _ => false,
            };
            if !harmless {
                return Err(refused(force));
            }
        }
        Ok(())
    }

    /// A body standing at `pose`, with all that hangs on it and has no joint, or none that moves.
    fn gather(&self, at: usize, pose: &Pose, moves: &dyn Fn(usize) -> bool) -> Result<Body, String> {
        let mut body = self.own(&self.bodies[at], pose)?;
        for (child, node) in self.bodies.iter().enumerate().filter(|(k, n)| n.parent == Some(at) && (n.joints.is_empty() || !moves(*k))) {
            body.add(&self.gather(child, &pose.then(&node.pose), moves)?);
        }
        Ok(body)
    }

    /// What a body weighs by its `<inertial>` or its shapes.
    fn own(&self, node: &Node<'_>, pose: &Pose) -> Result<Body, String> {
        let inertial = node.element.child("inertial").filter(|_| self.compiler.from_geoms != FromGeoms::Always);
        if let Some(inertial) = inertial {
            let [mass] = inertial.numbers("mass", None)?;
            let [x, y, z] = inertial.numbers("diaginertia", Some([0.0; 3]))?;
            let about = inertial.numbers("fullinertia", Some([x, y, z, 0.0, 0.0, 0.0]))?;
            return Ok(Body::new(mass, &pose.then(&self.compiler.pose(inertial)?), &tensor(about)));
        }
        let mut body = Body::default();
        if self.compiler.from_geoms != FromGeoms::Never {
            for geom in node.element.children("geom") {
                let filled = self.classes.fill(geom, &["geom"], node.class)?;
                body.add(&shape::body(&filled, &self.compiler, pose)?);
            }
        }
        Ok(body)
    }

    /// What angles of a joint are given in (rad); 1 where it slides.
    fn unit(&self, joint: &Joint<'_>) -> f64 {
        if joint.filled.attribute("type") == Some("slide") { 1.0 } else { self.compiler.angle_rad }
    }

    fn moving(&self, joint: &Joint<'_>, pose: &Pose, body: &Body) -> Result<JointConfig, String> {
        let (filled, unit) = (&joint.filled, self.unit(joint));
        let kind = match filled.attribute("type") {
            None | Some("hinge") => JointKind::Revolute,
            Some("slide") => JointKind::Prismatic,
            Some(other) => return Err(format!("{} is of type \"{other}\"; known are hinge and slide", filled.called())),
        };
        for name in ["springdamper", "springyield"] {
            if filled.attribute(name).is_some() && filled.list(name)?.iter().any(|v| *v != 0.0) {
                return Err(format!("{} has {name}, which is not read", filled.called()));
            }
        }
        let axis = filled.numbers("axis", Some([0.0, 0.0, 1.0]))?;
        let unit_axis = scale(axis, 1.0 / dot(axis, axis).sqrt().max(f64::MIN_POSITIVE));
        // The coordinate is `ref` where the body stands as it is drawn.
        let zero = -unit * filled.number("ref", 0.0)?;
        let turned: Matrix = if kind == JointKind::Revolute { product(&pose.rotation, &about(unit_axis, zero)) } else { pose.rotation };
        let slid = if kind == JointKind::Prismatic { turn(&pose.rotation, scale(unit_axis, -zero)) } else { [0.0; 3] };
        let pose = Pose { rotation: turned, place: sub(pose.place, slid) };
        let (range, drive) = (filled.numbers("range", Some([0.0; 2]))?.map(|v| v * unit), self.drive(joint)?);
        let [friction_ahead_s, friction_softness] = self.soft_friction(filled)?;
        let force = filled.numbers("actuatorfrcrange", Some([0.0; 2]))?;
        let own_limit = self.compiler.limited(filled, "actuatorfrclimited", force)?.then_some(force[1].max(-force[0]));
        Ok(JointConfig {
            name: joint.name.clone(),
            kind,
            axis,
            origin_m: pose.place,
            origin_rpy_rad: pose.angles(),
            mass_kg: body.mass,
            centre_m: body.centre(),
            inertia_kg_m2: six(&body.inertia()),
            gear_ratio: 1.0,
            rotor_inertia_kg_m2: filled.number("armature", 0.0)? + drive.armature,
            coulomb_nm: filled.number("frictionloss", 0.0)?,
            friction_ahead_s,
            friction_softness,
            viscous_nm_s_per_rad: linear(filled, "damping")? + drive.damping,
            stiffness_nm_per_rad: linear(filled, "stiffness")?,
            spring_rest_rad: unit * filled.number("springref", 0.0)?,
            torque_limit_nm: own_limit.into_iter().chain(drive.limit).reduce(f64::min).filter(|l| *l > 0.0),
            rate_limit_rad_per_s: None,
            range_rad: self.compiler.limited(filled, "limited", range)?.then_some(range),
            home_rad: 0.0,
        })
    }

    /// Dry friction is a soft constraint, f = −(b q̇ + q̈)/R within the level: 1/b of its `solref` and R/A = (1 − d)/d of its `solimp`
    /// (MuJoCo's documentation, Computation, "Parameters").
    fn soft_friction(&self, joint: &Element) -> Result<[f64; 2], String> {
        let list = |name: &str, absent: [f64; 2]| -> Result<[f64; 2], String> {
            let given = if joint.attribute(name).is_some() { joint.list(name)? } else { vec![] };
            Ok([0, 1].map(|k| given.get(k).copied().unwrap_or(absent[k])))
        };
        let ([time, damping], impedance) = (list("solreffriction", [0.02, 1.0])?, list("solimpfriction", [0.9, 0.95])?);
        if time <= 0.0 && damping >= 0.0 {
            return Err(format!("{} has a solreffriction without damping: nothing of its dry friction follows from the speed", joint.called()));
        }
        // The engine keeps these, and times of two steps.
        let [least, most] = impedance.map(|d| d.clamp(1e-4, 0.9999));
        let ahead = if time > 0.0 { 0.5 * most * time.max(2.0 * self.timestep_s()?) } else { most / -damping };
        Ok([ahead, (1.0 - least) / least])
    }

    fn timestep_s(&self) -> Result<f64, String> {
        self.root.children("option").try_fold(0.002, |step, option| option.number("timestep", step))
    }

    /// What drives a joint.
    fn drive(&self, joint: &Joint<'_>) -> Result<Drive<'a>, String> {
        let mut drive = Drive { timestep_s: self.timestep_s()?, limit: Some(0.0), ..Drive::default() };
        for actuator in self.root.children("actuator").flat_map(|a| &a.children) {
            if joint_of(actuator) != Some(&joint.name) {
                continue;
            }
            let filled = self.classes.fill(actuator, &MOTORS, None)?;
            let gear = if filled.attribute("gear").is_some() { filled.list("gear")?.first().copied().unwrap_or(1.0) } else { 1.0 };
            drive.armature += gear * gear * filled.number("armature", 0.0)?;
            drive.damping += gear * gear * linear(&filled, "damping")?;
            let [force, control] = ["forcerange", "ctrlrange"].map(|name| filled.numbers(name, Some([0.0; 2])));
            let (force, control) = (force?, control?);
            let own = if self.compiler.limited(&filled, "forcelimited", force)? {
                Some(force)
            } else if actuator.name == "motor" && self.compiler.limited(&filled, "ctrllimited", control)? {
                Some(control)
            } else {
                None
            };
            drive.limit = drive.limit.zip(own).map(|(sum, [low, high])| sum + gear.abs() * high.max(-low));
            drive.actuators.push(actuator);
        }
        drive.limit = drive.limit.filter(|_| !drive.actuators.is_empty());
        Ok(drive)
    }

    /// Refuses what is no torque at a joint.
    fn check_actuators(&self) -> Result<(), String> {
        for actuator in self.root.children("actuator").flat_map(|a| &a.children) {
            if !MOTORS.contains(&actuator.name.as_str()) {
                return Err(refused(actuator));
            }
            // A fixed tendon on the chain is refused by itself.
            if actuator.attribute("tendon").is_some() {
                continue;
            }
            let joint = joint_of(actuator).ok_or_else(|| format!("{} drives no joint; nothing else is read", actuator.called()))?;
            let floats = self.floating.iter().any(|body| has_joint(body, joint));
            if !floats && !self.joints().any(|j| j.name == joint) {
                return Err(format!("{} drives the joint \"{joint}\", which is not described", actuator.called()));
            }
        }
        Ok(())
    }
}

/// Gravity, in a world without air and with all forces.
pub(super) fn gravity(root: &Element) -> Result<[f64; 3], String> {
    let mut gravity = [0.0, 0.0, -9.81];
    for option in root.children("option") {
        gravity = option.numbers("gravity", Some(gravity))?;
        for name in ["density", "viscosity"] {
            if option.number(name, 0.0)? != 0.0 {
                return Err(format!("{} has a {name} of the air, which is not read", option.called()));
            }
        }
        for name in ["gravity", "passive", "spring", "damper", "frictionloss", "actuation"] {
            if let Some(flag) = option.child("flag").filter(|f| f.attribute(name) == Some("disable")) {
                return Err(format!("{} disables {name}, which is not read", flag.called()));
            }
        }
    }
    Ok(gravity)
}

/// Whether a body is held by nothing.
fn floats(body: &Element) -> bool {
    body.child("freejoint").is_some() || body.children("joint").any(|j| j.attribute("type") == Some("free"))
}

/// Whether a body or what it carries has this joint.
fn has_joint(body: &Element, name: &str) -> bool {
    body.children.iter().any(|e| if e.name == "body" { has_joint(e, name) } else { e.name.ends_with("joint") && e.attribute("name") == Some(name) })
}

fn joint_of(actuator: &Element) -> Option<&str> {
    actuator.attribute("joint").or_else(|| actuator.attribute("jointinparent"))
}

/// The first of the coefficients of a polynomial, where the others are zero.
fn linear(element: &Element, name: &str) -> Result<f64, String> {
    if element.attribute(name).is_none() {
        return Ok(0.0);
    }
    match element.list(name)?.as_slice() {
        [first, others @ ..] if others.iter().all(|v| *v == 0.0) => Ok(*first),
        [] => Err(format!("{}: {name} is empty", element.called())),
        _ => Err(format!("{} has a {name} that is no constant, which is not read", element.called())),
    }
}

/// Refuses what stands in other files and programs, wherever it is asked for.
fn whole(element: &Element) -> Result<(), String> {
    match element.name.as_str() {
        "include" => Err(format!("{}: other files are not read; save the model in one, as MuJoCo's mj_saveLastXML does", element.called())),
        "plugin" => Err(refused(element)),
        _ => element.children.iter().try_for_each(whole),
    }
}

fn refused(element: &Element) -> String {
    format!("{} is not read, and may change how the robot moves", element.called())
}
