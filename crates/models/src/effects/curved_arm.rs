//! A planar arm whose hand moves so far that its geometry is felt.

use crate::{Kinematics, planar_jacobian, planar_links};

type Matrix2 = [[f64; 2]; 2];

/// Two links in a plane that carry what endpoint matrices at one posture say along the curve of the arm:
///
/// F = Pᵀ (M w₂ + B w₁ + K w₀) + β c(q, q̇, q̈) + g(q)
///
/// with the hand's displacement x = f(q) − f(q₀) from the posture, P = J(q₀) J(q)⁻¹, w₀ = J(q₀) (q − q₀), w₁ = J(q₀) q̇, w₂ = J(q₀) q̈. At the
/// posture w₀, w₁, w₂ are x, ẋ, ẍ, P is one, and c, g and their slopes are zero: M, B and K are those of the linear model, of the joints J₀ᵀ M J₀,
/// J₀ᵀ B J₀ and J₀ᵀ K J₀ + Γ(F₀), all of them constant. What M(q) changes with the elbow is c with one number β = m₂ l₁ c₂ + m_hand l₁ l₂,
///
/// c = J⁻ᵀ ([2Δ Δ; Δ 0] q̈ + sin q₂ [−q̇₂ (2 q̇₁ + q̇₂); q̇₁²]),  Δ = cos q₂ − cos q₂₀,
///
/// and g = J⁻ᵀ (Γ(F₀) (q − q₀) + J₀ᵀ F₀) − F₀ what turns with the force F₀ that holds the arm.
#[derive(Clone, Debug, PartialEq)]
pub struct CurvedArm {
    /// Upper arm and forearm to the hand (m).
    pub link_lengths_m: [f64; 2],
    /// Angle of the upper arm from +x and of the forearm from the upper arm, where the displacement is zero (rad).
    pub posture_rad: [f64; 2],
    /// F₀ on the hand (N).
    pub mean_force_n: [f64; 2],
}

/// An arm displaced from its posture.
#[derive(Clone, Copy, Debug)]
pub struct Displaced {
    /// P.
    pub turned: Matrix2,
    /// w₀.
    pub stretch: [f64; 2],
    /// q − q₀.
    pub angles: [f64; 2],
    /// g.
    pub held: [f64; 2],
    jacobian_back: Matrix2,
    links: Matrix2,
    lengths_product: f64,
    elbow_cosine: f64,
}

/// What moves with a displaced arm.
#[derive(Clone, Copy, Debug)]
pub struct Carried {
    /// w₀, w₁, w₂.
    pub order: [[f64; 2]; 3],
    /// c.
    pub coupling: [f64; 2],
}

fn times(m: &Matrix2, v: [f64; 2]) -> [f64; 2] {
    m.map(|row| row[0] * v[0] + row[1] * v[1])
}

fn transposed_times(m: &Matrix2, v: [f64; 2]) -> [f64; 2] {
    [0, 1].map(|k| m[0][k] * v[0] + m[1][k] * v[1])
}

impl CurvedArm {
    /// Its kinematics at the posture.
    pub fn kinematics(&self) -> Kinematics {
        Kinematics::PlanarTwoLink { link_lengths_m: self.link_lengths_m, posture_rad: self.posture_rad }
    }

    /// The arm with its hand displaced; nothing where the hand is out of reach, or the elbow straight or folded.
    pub fn displaced(&self, x: [f64; 2]) -> Option<Displaced> {
        let rest = planar_links(self.link_lengths_m, self.posture_rad);
        let [l1, l2] = self.link_lengths_m;
        let hand = [0, 1].map(|k| rest[0][k] + rest[1][k] + x[k]);
        let cosine = (hand[0] * hand[0] + hand[1] * hand[1] - l1 * l1 - l2 * l2) / (2.0 * l1 * l2);
        if cosine.is_nan() || cosine.abs() >= 1.0 {
            return None;
        }
        let sine = (1.0 - cosine * cosine).sqrt().copysign(self.posture_rad[1]);
        // The upper arm stands where the bent arm's line to its hand is turned onto the hand.
        let [along, aside] = [l1 + l2 * cosine, l2 * sine];
        let squared = hand[0] * hand[0] + hand[1] * hand[1];
        let upper = [l1 * (hand[0] * along + hand[1] * aside) / squared, l1 * (hand[1] * along - hand[0] * aside) / squared];
        let here = [upper, [hand[0] - upper[0], hand[1] - upper[1]]];
        let shoulder = (rest[0][0] * upper[1] - rest[0][1] * upper[0]).atan2(rest[0][0] * upper[0] + rest[0][1] * upper[1]);
        let angles = [shoulder, sine.atan2(cosine) - self.posture_rad[1]];
        let start = planar_jacobian(rest);
        let j = planar_jacobian(here);
        let area = j[0][0] * j[1][1] - j[0][1] * j[1][0];
        let back = [[j[1][1] / area, -j[0][1] / area], [-j[1][0] / area, j[0][0] / area]];
        let turned = [0, 1].map(|i| [0, 1].map(|k| start[i][0] * back[0][k] + start[i][1] * back[1][k]));
        let force = self.mean_force_n;
        let reach = rest.map(|link| force[0] * link[0] + force[1] * link[1]);
        let geometric = [-(reach[0] + reach[1]) * angles[0] - reach[1] * angles[1], -reach[1] * (angles[0] + angles[1])];
        let torque = transposed_times(&start, force);
        let pushed = transposed_times(&back, [geometric[0] + torque[0], geometric[1] + torque[1]]);
        Some(Displaced {
            turned,
            stretch: times(&start, angles),
            angles,
            held: [pushed[0] - force[0], pushed[1] - force[1]],
            jacobian_back: back,
            links: here,
            lengths_product: l1 * l2,
            elbow_cosine: (rest[0][0] * rest[1][0] + rest[0][1] * rest[1][1]) / (l1 * l2),
        })
    }
}

impl Displaced {
    /// J⁻ᵀ of joint torques: the force on the hand.
    pub fn at_the_hand(&self, torque: [f64; 2]) -> [f64; 2] {
        transposed_times(&self.jacobian_back, torque)
    }

    /// What moves at this velocity and acceleration of the hand.
    pub fn moving(&self, v: [f64; 2], a: [f64; 2]) -> Carried {
        let [[x1, y1], [x2, y2]] = self.links;
        let [w1, w2] = times(&self.jacobian_back, v);
        let (first, second) = (w1 * w1, (w1 + w2) * (w1 + w2));
        // ẍ = J q̈ + J̇ q̇.
        let free = [a[0] + x1 * first + x2 * second, a[1] + y1 * first + y2 * second];
        let [a1, a2] = times(&self.jacobian_back, free);
        let (cosine, sine) = ((x1 * x2 + y1 * y2) / self.lengths_product, (x1 * y2 - y1 * x2) / self.lengths_product);
        let more = cosine - self.elbow_cosine;
        let torque = [more * (2.0 * a1 + a2) - sine * w2 * (2.0 * w1 + w2), more * a1 + sine * w1 * w1];
        Carried { order: [self.stretch, times(&self.turned, v), times(&self.turned, free)], coupling: self.at_the_hand(torque) }
    }

    /// Pᵀ of a force at the posture.
    pub fn carried(&self, force: [f64; 2]) -> [f64; 2] {
        transposed_times(&self.turned, force)
    }
}
