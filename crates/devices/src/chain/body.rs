//! Rigid bodies as the readers of robot descriptions gather them.

use super::config::{EndEffectorConfig, JointConfig, RobotConfig};
use super::xml::Element;
use crate::vector3::{IDENTITY, Matrix, Vector, add, carried, plus, product, scale, steiner, sub, turn};
use ndof_linear::cholesky_in_place;

/// A frame in another.
#[derive(Clone, Copy)]
pub(super) struct Pose {
    pub(super) rotation: Matrix,
    pub(super) place: Vector,
}

impl Pose {
    pub(super) const IDENTITY: Pose = Pose { rotation: IDENTITY, place: [0.0; 3] };

    pub(super) fn at(place: Vector) -> Pose {
        Pose { place, ..Pose::IDENTITY }
    }

    pub(super) fn then(&self, inner: &Pose) -> Pose {
        Pose { rotation: product(&self.rotation, &inner.rotation), place: add(self.place, turn(&self.rotation, inner.place)) }
    }

    /// Roll, pitch and yaw of its rotation.
    pub(super) fn angles(&self) -> Vector {
        let r = &self.rotation;
        let level = r[0][0].hypot(r[1][0]);
        let pitch = (-r[2][0]).atan2(level);
        if level > 1e-12 { [r[2][1].atan2(r[2][2]), pitch, r[1][0].atan2(r[0][0])] } else { [0.0, pitch, (-r[0][1]).atan2(r[1][1])] }
    }
}

/// A rigid body in a frame, by its moments, which add up.
#[derive(Clone, Copy, Default)]
pub(super) struct Body {
    pub(super) mass: f64,
    /// Mass times centre.
    first: Vector,
    /// Inertia about the frame's origin.
    second: Matrix,
}

impl Body {
    /// Of a mass whose centre stands at `pose`, with the inertia about it in the axes there.
    pub(super) fn new(mass: f64, pose: &Pose, inertia: &Matrix) -> Self {
        Body { mass, first: scale(pose.place, mass), second: plus(&carried(&pose.rotation, inertia), &steiner(mass, pose.place)) }
    }

    /// Of the numbers of a joint.
    pub(super) fn of(joint: &JointConfig) -> Self {
        Body::new(joint.mass_kg, &Pose::at(joint.centre_m), &tensor(joint.inertia_kg_m2))
    }

    pub(super) fn add(&mut self, other: &Body) {
        self.mass += other.mass;
        self.first = add(self.first, other.first);
        self.second = plus(&self.second, &other.second);
    }

    /// What is left where `other` is taken away.
    pub(super) fn without(&self, other: &Body) -> Body {
        Body { mass: self.mass - other.mass, first: sub(self.first, other.first), second: std::array::from_fn(|i| sub(self.second[i], other.second[i])) }
    }

    /// Centre of mass; the origin where there is no mass.
    pub(super) fn centre(&self) -> Vector {
        if self.mass == 0.0 { [0.0; 3] } else { scale(self.first, 1.0 / self.mass) }
    }

    /// Inertia about the centre of mass.
    pub(super) fn inertia(&self) -> Matrix {
        let shift = steiner(self.mass, self.centre());
        std::array::from_fn(|i| sub(self.second[i], shift[i]))
    }

    /// Whether masses that are none below zero can make it: Σ = ½ tr(I) 1 − I, their second moment about the centre, is positive semidefinite
    /// (P. M. Wensing, S. Kim and J.-J. E. Slotine, Linear matrix inequalities for physically consistent inertial parameter identification, 2018).
    pub(super) fn exists(&self) -> bool {
        let inertia = self.inertia();
        let half = 0.5 * (inertia[0][0] + inertia[1][1] + inertia[2][2]);
        // A rod or a plate is on the border: as far as `Link::check` lets digits of a file go beyond it.
        let slack = 1e-9 * half + f64::MIN_POSITIVE;
        let mut spread: Vec<f64> = (0..9).map(|k| if k % 4 == 0 { half + slack } else { 0.0 } - inertia[k / 3][k % 3]).collect();
        let largest = inertia.iter().flatten().fold(0.0_f64, |s, v| s.max(v.abs()));
        self.mass > 0.0 && half.is_finite() && (largest == 0.0 || cholesky_in_place(&mut spread, 3))
    }
}

/// xx, yy, zz, xy, xz, yz.
pub(super) fn six(m: &Matrix) -> [f64; 6] {
    [m[0][0], m[1][1], m[2][2], m[0][1], m[0][2], m[1][2]]
}

/// The tensor of xx, yy, zz, xy, xz, yz.
pub(super) fn tensor([xx, yy, zz, xy, xz, yz]: [f64; 6]) -> Matrix {
    [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]
}

/// A joint as its file has it, and where data may correct it.
pub(super) struct Described<'a> {
    pub(super) config: JointConfig,
    pub(super) joint: &'a Element,
    /// The element of the body that it moves.
    pub(super) body: &'a Element,
    /// What says of that body what it weighs, and how its axes are turned there.
    pub(super) inertial: Option<(&'a Element, Matrix)>,
    /// The origin of that body in the joint's frame; their axes are parallel.
    pub(super) offset: Vector,
    /// What other bodies that are fixed to it add, in the joint's frame.
    pub(super) rest: Body,
    /// Why the joint has no mass of its own to correct.
    pub(super) massless: Option<String>,
    pub(super) drive: Drive<'a>,
}

/// What an MJCF says of the motors of a joint.
#[derive(Default)]
pub(super) struct Drive<'a> {
    pub(super) actuators: Vec<&'a Element>,
    /// Their rotors' inertia at the joint (kg m²).
    pub(super) armature: f64,
    /// Their damping at the joint (N m s/rad).
    pub(super) damping: f64,
    /// Their largest torque at the joint (N m).
    pub(super) limit: Option<f64>,
    /// The unit of the joint's range (rad).
    pub(super) unit: f64,
    /// The step of the simulation, of which a delay is so many.
    pub(super) timestep_s: f64,
}

/// The end of a chain, or its last part that moves and the ends that stand still on it, where there are several. What stands still on a part that carries
/// the last one, or on the base, is no end. Two ends that move apart where there is no such chain.
///
/// `moved` is the last part that moves on the way to one, `hangs_on` whether the first carries nothing but what the second carries, or is it.
pub(super) fn end_of<T: Copy + PartialEq>(ends: &[T], moved: impl Fn(T) -> Option<T>, hangs_on: impl Fn(T, T) -> bool) -> Result<(T, Vec<T>), [T; 2]> {
    let moving: Vec<(T, T)> = ends.iter().filter_map(|end| Some((*end, moved(*end)?))).collect();
    let last = moving.iter().copied().reduce(|a, b| if hangs_on(b.1, a.1) { b } else { a });
    let Some((end, part)) = last else {
        return if let [first, second, ..] = ends { Err([*first, *second]) } else { Ok((ends[0], Vec::new())) };
    };
    if let Some((other, _)) = moving.iter().find(|(_, of)| !hangs_on(part, *of)) {
        return Err([end, *other]);
    }
    let still: Vec<T> = moving.iter().filter(|(_, of)| *of == part).map(|(end, _)| *end).collect();
    Ok(if still.len() > 1 { (part, still) } else { (end, Vec::new()) })
}

/// Notes joints that hang on the chain and are not in it.
pub(super) fn hold_still<'a>(config: &mut RobotConfig, names: impl Iterator<Item = &'a str>, tip: &str) {
    config.held = names.map(str::to_owned).collect();
    let them = config.held.join(", ");
    let said = || {
        format!(
            "{them}: not on the way to \"{tip}\", and taken as held still where the file has them, with what they carry part of the body on which they hang"
        )
    };
    config.notes.extend((!config.held.is_empty()).then(said));
}

/// A robot without joints.
pub(super) fn robot(name: &str) -> RobotConfig {
    RobotConfig {
        schema: "ndof/robot/1".to_owned(),
        name: name.to_owned(),
        axes: Vec::new(),
        gravity_m_per_s2: [0.0, 0.0, -9.81],
        joints: Vec::new(),
        end_effector: EndEffectorConfig::default(),
        transducer: Default::default(),
        hold: Default::default(),
        ends: Vec::new(),
        held: Vec::new(),
        notes: Vec::new(),
    }
}
