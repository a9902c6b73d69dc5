//! Inverse dynamics, linear in the inertial parameters.

use super::serial::SerialChain;
use crate::vector3::{Matrix, Vector, add, cross, dot, plus, steiner, sub, transpose, turn};
use ndarray::Array2;

/// Inertial parameters of a body: m, m c_x, m c_y, m c_z and xx, xy, yy, xz, yz, zz of the inertia about its joint's origin, in the joint's axes.
pub const TERMS_OF_A_LINK: usize = 10;

/// Rows and columns of the last six.
pub(super) const ENTRIES: [(usize, usize); 6] = [(0, 0), (0, 1), (1, 1), (0, 2), (1, 2), (2, 2)];

impl SerialChain {
    /// π of τ = Y(q, q̇, q̈) π: ten numbers a body ([`TERMS_OF_A_LINK`]), then the rotor of each joint.
    pub fn inertial_parameters(&self) -> Vec<f64> {
        let bodies = self.links.iter().flat_map(|link| {
            let inertia = plus(&link.inertia, &steiner(link.mass, link.centre));
            let first = link.centre.map(|c| link.mass * c);
            std::iter::once(link.mass).chain(first).chain(ENTRIES.map(|(r, c)| inertia[r][c])).collect::<Vec<_>>()
        });
        bodies.chain(self.links.iter().map(|link| link.rotor)).collect()
    }

    /// The same chain with these [`SerialChain::inertial_parameters`]. They need not be those of bodies: a fit goes through others. `None` where one has a
    /// moment and no mass.
    #[must_use]
    pub fn with_inertial_parameters(mut self, parameters: &[f64]) -> Option<Self> {
        let (bodies, rotors) = parameters.split_at(TERMS_OF_A_LINK * self.links.len());
        for ((link, own), rotor) in self.links.iter_mut().zip(bodies.chunks_exact(TERMS_OF_A_LINK)).zip(rotors) {
            (link.mass, link.rotor) = (own[0], *rotor);
            link.centre = [1, 2, 3].map(|k| if own[k] == 0.0 { 0.0 } else { own[k] / link.mass });
            let shifted = steiner(link.mass, link.centre);
            for ((r, c), entry) in ENTRIES.into_iter().zip(&own[4..]) {
                link.inertia[r][c] = entry - shifted[r][c];
                link.inertia[c][r] = link.inertia[r][c];
            }
        }
        self.links.iter().all(|link| link.centre.iter().all(|c| c.is_finite())).then_some(self)
    }

    /// The regressor Y(q, q̇, q̈), joints × 11 joints, in which the torques without friction are linear: τ = Y π with
    /// [`SerialChain::inertial_parameters`].
    ///
    /// Of body i with angular velocity ω, its rate α and the acceleration a of its origin (gravity included), in its own axes:
    /// force m a + α × m c + ω × (ω × m c), moment m c × a + I α + ω × I ω.
    ///
    /// W. Khalil and E. Dombre, Modeling, Identification and Control of Robots (2002), ch. 12.
    pub fn regressor(&self, q: &[f64], rates: &[f64], accelerations: &[f64]) -> Array2<f64> {
        let (n, frames) = (self.links.len(), self.frames(q));
        let mut out = Array2::zeros((n, (TERMS_OF_A_LINK + 1) * n));
        frames.carry(
            self.gravity,
            &self.links,
            rates,
            |i| accelerations[i],
            |i, spin| {
                let outer = &frames.rotation[i];
                let inner = transpose(outer);
                let [velocity, turning, linear] = [spin.velocity, spin.acceleration, spin.linear].map(|v| turn(&inner, v));
                for (term, (force, moment)) in terms(velocity, turning, linear).into_iter().enumerate() {
                    let (force, moment) = (turn(outer, force), turn(outer, moment));
                    for j in 0..=i {
                        let lever = sub(frames.origin[i], frames.origin[j]);
                        let felt = if self.links[j].slides { force } else { add(moment, cross(lever, force)) };
                        out[[j, TERMS_OF_A_LINK * i + term]] = dot(frames.axis[j], felt);
                    }
                }
            },
        );
        for (j, acceleration) in accelerations.iter().enumerate() {
            out[[j, TERMS_OF_A_LINK * n + j]] = *acceleration;
        }
        out
    }
}

/// Force on a body and moment about its origin for each of its ten parameters at one.
fn terms(velocity: Vector, turning: Vector, linear: Vector) -> [(Vector, Vector); TERMS_OF_A_LINK] {
    let unit = |k: usize| -> Vector { std::array::from_fn(|i| f64::from(u8::from(i == k))) };
    std::array::from_fn(|term| match term {
        0 => (linear, [0.0; 3]),
        1..=3 => {
            let e = unit(term - 1);
            (add(cross(turning, e), cross(velocity, cross(velocity, e))), cross(e, linear))
        }
        _ => {
            let (r, c) = ENTRIES[term - 4];
            let inertia: Matrix = std::array::from_fn(|i| std::array::from_fn(|j| f64::from(u8::from((i, j) == (r, c) || (i, j) == (c, r)))));
            ([0.0; 3], add(turn(&inertia, turning), cross(velocity, turn(&inertia, velocity))))
        }
    })
}
