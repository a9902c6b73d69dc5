//! The recursions of a chain, in the coordinates of the base (R. Featherstone, Rigid Body Dynamics Algorithms, 2008, ch. 5 and 6).

use super::{Link, MAX_JOINTS, SerialChain};
use crate::vector3::{IDENTITY, Matrix, Vector, about, add, carried, cross, dot, plus, product, scale, steiner, sub, turn};

/// Where each body is; entries beyond the chain's length are unused.
pub(crate) struct Frames {
    /// Origins of the bodies' frames.
    pub(super) origin: [Vector; MAX_JOINTS],
    /// Joint axes.
    axis: [Vector; MAX_JOINTS],
    /// Orientations of the bodies.
    rotation: [Matrix; MAX_JOINTS],
    /// The end effector.
    pub(super) tip: Vector,
}

/// Mass properties of the bodies in the base's axes.
pub(super) struct Bodies {
    /// Centre of mass, from the body's origin.
    centre: [Vector; MAX_JOINTS],
    /// Inertia about the centre of mass.
    inertia: [Matrix; MAX_JOINTS],
}

/// Rates of a body's frame.
#[derive(Clone, Copy)]
struct Spin {
    velocity: Vector,
    acceleration: Vector,
    /// Linear acceleration of the frame's origin.
    linear: Vector,
}

impl Spin {
    /// Linear acceleration of a point of the body, `r` away from the origin.
    fn at(&self, r: Vector) -> Vector {
        add(self.linear, add(cross(self.acceleration, r), cross(self.velocity, cross(self.velocity, r))))
    }

    /// The rates of the next body, whose joint turns or slides at `rate` without acceleration.
    fn carried_on(&self, link: &Link, r: Vector, axis: Vector, rate: f64) -> Spin {
        let linear = self.at(r);
        if link.slides {
            Spin { linear: add(linear, scale(cross(self.velocity, axis), 2.0 * rate)), ..*self }
        } else {
            Spin { velocity: add(self.velocity, scale(axis, rate)), acceleration: add(self.acceleration, scale(cross(self.velocity, axis), rate)), linear }
        }
    }
}

impl SerialChain {
    /// Forward kinematics.
    pub(super) fn frames(&self, q: &[f64]) -> Frames {
        let mut frames = Frames { origin: [[0.0; 3]; MAX_JOINTS], axis: [[0.0; 3]; MAX_JOINTS], rotation: [IDENTITY; MAX_JOINTS], tip: [0.0; 3] };
        let (mut place, mut rotation) = ([0.0; 3], IDENTITY);
        for (i, (link, q)) in self.links.iter().zip(q).enumerate() {
            place = add(place, turn(&rotation, link.origin));
            rotation = product(&rotation, &link.rotation);
            let axis = turn(&rotation, link.axis);
            if link.slides {
                place = add(place, scale(axis, *q));
            } else {
                rotation = product(&rotation, &about(link.axis, *q));
            }
            frames.origin[i] = place;
            frames.axis[i] = axis;
            frames.rotation[i] = rotation;
        }
        frames.tip = add(place, turn(&rotation, self.tip));
        frames
    }

    /// Centres and inertias, turned with the bodies.
    pub(super) fn bodies(&self, frames: &Frames) -> Bodies {
        let mut bodies = Bodies { centre: [[0.0; 3]; MAX_JOINTS], inertia: [[[0.0; 3]; 3]; MAX_JOINTS] };
        for (i, link) in self.links.iter().enumerate() {
            bodies.centre[i] = turn(&frames.rotation[i], link.centre);
            bodies.inertia[i] = carried(&frames.rotation[i], &link.inertia);
        }
        bodies
    }

    /// How joint `j` moves the tip.
    pub(super) fn tip_column(&self, frames: &Frames, j: usize) -> Vector {
        if self.links[j].slides { frames.axis[j] } else { cross(frames.axis[j], sub(frames.tip, frames.origin[j])) }
    }

    /// Acceleration of the tip at constant joint rates, J̇ q̇.
    pub(super) fn tip_drift(&self, frames: &Frames, rates: &[f64]) -> Vector {
        let mut spin = Spin { velocity: [0.0; 3], acceleration: [0.0; 3], linear: [0.0; 3] };
        let mut last = [0.0; 3];
        for (i, link) in self.links.iter().enumerate() {
            spin = spin.carried_on(link, sub(frames.origin[i], last), frames.axis[i], rates[i]);
            last = frames.origin[i];
        }
        spin.at(sub(frames.tip, last))
    }

    /// Torques that keep the joint rates constant against Coriolis forces and gravity: recursive Newton-Euler.
    pub(super) fn inverse_dynamics(&self, frames: &Frames, bodies: &Bodies, rates: &[f64], out: &mut [f64]) {
        let n = self.links.len();
        let (mut force, mut moment) = ([[0.0; 3]; MAX_JOINTS], [[0.0; 3]; MAX_JOINTS]);
        // Gravity is the base accelerating upwards.
        let mut spin = Spin { velocity: [0.0; 3], acceleration: [0.0; 3], linear: scale(self.gravity, -1.0) };
        let mut last = [0.0; 3];
        for (i, link) in self.links.iter().enumerate() {
            spin = spin.carried_on(link, sub(frames.origin[i], last), frames.axis[i], rates[i]);
            last = frames.origin[i];
            let (centre, inertia) = (bodies.centre[i], &bodies.inertia[i]);
            force[i] = scale(spin.at(centre), link.mass);
            let own = add(turn(inertia, spin.acceleration), cross(spin.velocity, turn(inertia, spin.velocity)));
            moment[i] = add(own, cross(centre, force[i]));
        }
        for i in (0..n).rev() {
            out[i] = dot(frames.axis[i], if self.links[i].slides { force[i] } else { moment[i] });
            if i > 0 {
                let lever = sub(frames.origin[i], frames.origin[i - 1]);
                moment[i - 1] = add(moment[i - 1], add(moment[i], cross(lever, force[i])));
                force[i - 1] = add(force[i - 1], force[i]);
            }
        }
    }

    /// The mass matrix by composite rigid bodies, moments about the base's origin.
    pub(super) fn composite_inertia(&self, frames: &Frames, bodies: &Bodies, out: &mut [f64]) {
        let n = self.links.len();
        let (mut mass, mut first, mut second) = (0.0, [0.0; 3], [[0.0; 3]; 3]);
        // A joint's motion as the velocity of the point at the origin, with the angular velocity.
        let motion = |j: usize| -> (Vector, Vector) {
            if self.links[j].slides { ([0.0; 3], frames.axis[j]) } else { (frames.axis[j], cross(frames.origin[j], frames.axis[j])) }
        };
        for i in (0..n).rev() {
            let link = &self.links[i];
            let centre = add(frames.origin[i], bodies.centre[i]);
            mass += link.mass;
            first = add(first, scale(centre, link.mass));
            second = plus(&second, &plus(&bodies.inertia[i], &steiner(link.mass, centre)));
            let (angular, linear) = motion(i);
            let momentum = add(scale(linear, mass), cross(angular, first));
            let spin = add(turn(&second, angular), cross(first, linear));
            for j in 0..=i {
                let (angular, linear) = motion(j);
                let entry = dot(angular, spin) + dot(linear, momentum);
                out[i * n + j] = entry;
                out[j * n + i] = entry;
            }
            out[i * n + i] += link.rotor;
        }
    }
}
