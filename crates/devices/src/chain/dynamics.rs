//! The recursions of a chain, in the coordinates of the base (R. Featherstone, Rigid Body Dynamics Algorithms, 2008, ch. 5 and 6).

use super::link::{Link, MAX_JOINTS};
use crate::vector3::{IDENTITY, Matrix, Vector, about, add, carried, cross, dot, plus, product, scale, steiner, sub, turn};

/// Where each body is; entries beyond the chain's length are unused.
pub(crate) struct Frames {
    /// Origins of the bodies' frames.
    pub(super) origin: [Vector; MAX_JOINTS],
    /// Joint axes.
    pub(super) axis: [Vector; MAX_JOINTS],
    /// Orientations of the bodies.
    pub(super) rotation: [Matrix; MAX_JOINTS],
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
pub(super) struct Spin {
    pub(super) velocity: Vector,
    pub(super) acceleration: Vector,
    /// Linear acceleration of the frame's origin.
    pub(super) linear: Vector,
}

impl Spin {
    /// Linear acceleration of a point of the body, `r` away from the origin.
    fn at(&self, r: Vector) -> Vector {
        add(self.linear, add(cross(self.acceleration, r), cross(self.velocity, cross(self.velocity, r))))
    }

    /// The rates of the next body, whose joint turns or slides at `rate` and speeds up by `acceleration`.
    fn carried_on(&self, link: &Link, r: Vector, axis: Vector, rate: f64, acceleration: f64) -> Spin {
        let (linear, own) = (self.at(r), scale(axis, acceleration));
        if link.slides {
            Spin { linear: add(add(linear, scale(cross(self.velocity, axis), 2.0 * rate)), own), ..*self }
        } else {
            let turning = add(scale(cross(self.velocity, axis), rate), own);
            Spin { velocity: add(self.velocity, scale(axis, rate)), acceleration: add(self.acceleration, turning), linear }
        }
    }
}

impl Frames {
    /// Forward kinematics.
    pub(super) fn of(links: &[Link], tip: Vector, q: &[f64]) -> Self {
        let mut frames = Frames { origin: [[0.0; 3]; MAX_JOINTS], axis: [[0.0; 3]; MAX_JOINTS], rotation: [IDENTITY; MAX_JOINTS], tip: [0.0; 3] };
        let (mut place, mut rotation) = ([0.0; 3], IDENTITY);
        for (i, (link, q)) in links.iter().zip(q).enumerate() {
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
        frames.tip = add(place, turn(&rotation, tip));
        frames
    }

    /// How joint `j` moves the tip.
    pub(super) fn tip_column(&self, links: &[Link], j: usize) -> Vector {
        if links[j].slides { self.axis[j] } else { cross(self.axis[j], sub(self.tip, self.origin[j])) }
    }

    /// Acceleration of the tip at constant joint rates, J̇ q̇.
    pub(super) fn tip_drift(&self, links: &[Link], rates: &[f64]) -> Vector {
        let mut drift = [0.0; 3];
        self.carry([0.0; 3], links, rates, |_| 0.0, |i, spin| drift = spin.at(sub(self.tip, self.origin[i])));
        drift
    }

    /// Tells each body's rates from the base outwards; gravity is the base accelerating upwards.
    pub(super) fn carry(&self, gravity: Vector, links: &[Link], rates: &[f64], acceleration: impl Fn(usize) -> f64, mut told: impl FnMut(usize, &Spin)) {
        let mut spin = Spin { velocity: [0.0; 3], acceleration: [0.0; 3], linear: scale(gravity, -1.0) };
        let mut last = [0.0; 3];
        for (i, link) in links.iter().enumerate() {
            spin = spin.carried_on(link, sub(self.origin[i], last), self.axis[i], rates[i], acceleration(i));
            last = self.origin[i];
            told(i, &spin);
        }
    }
}

impl Bodies {
    /// Centres and inertias, turned with the bodies.
    pub(super) fn of(links: &[Link], frames: &Frames) -> Self {
        let mut bodies = Bodies { centre: [[0.0; 3]; MAX_JOINTS], inertia: [[[0.0; 3]; 3]; MAX_JOINTS] };
        for (i, link) in links.iter().enumerate() {
            bodies.centre[i] = turn(&frames.rotation[i], link.centre);
            bodies.inertia[i] = carried(&frames.rotation[i], &link.inertia);
        }
        bodies
    }

    /// Torques that joint rates and accelerations need against inertia, Coriolis forces and gravity: recursive Newton-Euler.
    pub(super) fn inverse_dynamics(
        &self,
        gravity: Vector,
        links: &[Link],
        frames: &Frames,
        rates: &[f64],
        acceleration: impl Fn(usize) -> f64,
        out: &mut [f64],
    ) {
        let n = links.len();
        let (mut force, mut moment) = ([[0.0; 3]; MAX_JOINTS], [[0.0; 3]; MAX_JOINTS]);
        frames.carry(gravity, links, rates, &acceleration, |i, spin| {
            let (centre, inertia) = (self.centre[i], &self.inertia[i]);
            force[i] = scale(spin.at(centre), links[i].mass);
            let own = add(turn(inertia, spin.acceleration), cross(spin.velocity, turn(inertia, spin.velocity)));
            moment[i] = add(own, cross(centre, force[i]));
        });
        for i in (0..n).rev() {
            out[i] = dot(frames.axis[i], if links[i].slides { force[i] } else { moment[i] }) + links[i].rotor * acceleration(i);
            if i > 0 {
                let lever = sub(frames.origin[i], frames.origin[i - 1]);
                moment[i - 1] = add(moment[i - 1], add(moment[i], cross(lever, force[i])));
                force[i - 1] = add(force[i - 1], force[i]);
            }
        }
    }

    /// The mass matrix by composite rigid bodies, moments about the base's origin.
    pub(super) fn composite_inertia(&self, links: &[Link], frames: &Frames, out: &mut [f64]) {
        let n = links.len();
        let (mut mass, mut first, mut second) = (0.0, [0.0; 3], [[0.0; 3]; 3]);
        // A joint's motion as the velocity of the point at the origin, with the angular velocity.
        let motion = |j: usize| -> (Vector, Vector) {
            if links[j].slides { ([0.0; 3], frames.axis[j]) } else { (frames.axis[j], cross(frames.origin[j], frames.axis[j])) }
        };
        for i in (0..n).rev() {
            let link = &links[i];
            let centre = add(frames.origin[i], self.centre[i]);
            mass += link.mass;
            first = add(first, scale(centre, link.mass));
            second = plus(&second, &plus(&self.inertia[i], &steiner(link.mass, centre)));
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
