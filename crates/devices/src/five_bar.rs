//! The planar five-bar parallelogram of MIT-MANUS and InMotion2, in absolute joint angles.

use crate::error::DeviceError;
use crate::robot::{Axis, Joints, Kinematics, Robot};

/// Five-bar robot: upper link on angle q₁, forearm driven to the absolute angle q₂ by crank and coupler.
///
/// d = b + l₁ (cos q₁, sin q₁) + l₂ (cos q₂, sin q₂),
/// [H₁₁, H₁₂ c; H₁₂ c, H₂₂] q̈ + H₁₂ s (q̇₂², −q̇₁²) = τ − Jᵀ F with c, s = cos, sin (q₁ − q₂). The plane is level: no gravity.
#[derive(Clone, Debug, PartialEq)]
pub struct FiveBar {
    /// Lengths of upper link and forearm (m).
    pub links_m: [f64; 2],
    /// Where the motors' common axis stands, in coordinates whose origin is the workspace's centre (m).
    pub base_m: [f64; 2],
    /// H₁₁, H₂₂, H₁₂ (kg m²).
    pub inertia_kg_m2: [f64; 3],
    joints: Joints,
    axes: Vec<Axis>,
}

impl FiveBar {
    /// A five-bar from its lengths, base, inertias and joints.
    ///
    /// # Errors
    /// [`DeviceError`] if a length is not positive or the inertia is not positive definite in every posture.
    pub fn new(links_m: [f64; 2], base_m: [f64; 2], inertia_kg_m2: [f64; 3], joints: Joints) -> Result<Self, DeviceError> {
        for (i, l) in links_m.iter().enumerate() {
            if !(l.is_finite() && *l > 0.0) {
                return Err(DeviceError::value(format!("link_{}_m", i + 1), *l, "a positive length"));
            }
        }
        let [h11, h22, h12] = inertia_kg_m2;
        if !(h11 > 0.0 && h22 > 0.0 && h12 * h12 < h11 * h22) {
            return Err(DeviceError::Inertia(format!("the five-bar's inertia H11 {h11}, H22 {h22}, H12 {h12}")));
        }
        let axes = ["x", "y"].map(|name| Axis { name: name.to_owned(), rotational: false }).to_vec();
        Ok(FiveBar { links_m, base_m, inertia_kg_m2, joints, axes })
    }
}

impl Robot for FiveBar {
    fn axes(&self) -> &[Axis] {
        &self.axes
    }

    fn joints(&self) -> &Joints {
        &self.joints
    }

    fn kinematics(&self, q: &[f64], rates: &[f64], out: &mut Kinematics) {
        let ((s1, c1), (s2, c2)) = (q[0].sin_cos(), q[1].sin_cos());
        let [l1, l2] = self.links_m;
        let (x1, y1, x2, y2) = (l1 * c1, l1 * s1, l2 * c2, l2 * s2);
        out.endpoint.copy_from_slice(&[self.base_m[0] + x1 + x2, self.base_m[1] + y1 + y2]);
        out.jacobian.copy_from_slice(&[-y1, -y2, x1, x2]);
        let (w1, w2) = (rates[0] * rates[0], rates[1] * rates[1]);
        out.jacobian_rate.copy_from_slice(&[-(x1 * w1 + x2 * w2), -(y1 * w1 + y2 * w2)]);
    }

    fn mass_matrix(&self, q: &[f64], out: &mut [f64]) {
        let [h11, h22, h12] = self.inertia_kg_m2;
        let coupling = h12 * (q[0] - q[1]).cos();
        out.copy_from_slice(&[h11, coupling, coupling, h22]);
    }

    fn bias(&self, q: &[f64], rates: &[f64], out: &mut [f64]) {
        let s = self.inertia_kg_m2[2] * (q[0] - q[1]).sin();
        out.copy_from_slice(&[s * rates[1] * rates[1], -s * rates[0] * rates[0]]);
    }

    fn inverse_kinematics(&self, target: &[f64]) -> Result<Vec<f64>, DeviceError> {
        let &[x, y] = target else { return Err(DeviceError::size("hand_m", target.len(), 2)) };
        let ([l1, l2], x, y) = (self.links_m, x - self.base_m[0], y - self.base_m[1]);
        let cosine = (x * x + y * y - l1 * l1 - l2 * l2) / (2.0 * l1 * l2);
        if cosine.is_nan() || cosine.abs() >= 1.0 {
            let (near, far) = ((l1 - l2).abs(), l1 + l2);
            let why = format!("it lies {:.3} m from the base, links of {l1} m and {l2} m reach {near:.3} to {far:.3} m", x.hypot(y));
            return Err(DeviceError::Reach { who: "the robot".to_owned(), target: target.to_vec(), why });
        }
        let elbow = cosine.acos();
        let first = y.atan2(x) - (l2 * elbow.sin()).atan2(l1 + l2 * elbow.cos());
        Ok(vec![first, first + elbow])
    }

    fn gravity_compensation(&self) -> f64 {
        0.0
    }

    /// The workspace's centre.
    fn home(&self) -> Result<Vec<f64>, DeviceError> {
        self.inverse_kinematics(&[0.0, 0.0])
    }

    fn acceleration(&self, _q: &[f64], rates: &[f64], kinematics: &Kinematics, torque: &[f64], _work: &mut [f64], out: &mut [f64]) {
        // The Jacobian's columns are the links as vectors, turned by 90°: their products hold cos and sin of q₁ − q₂.
        let j = &kinematics.jacobian;
        let [h11, h22, h12] = self.inertia_kg_m2;
        let scale = h12 / (self.links_m[0] * self.links_m[1]);
        let (c, s) = (scale * (j[0] * j[1] + j[2] * j[3]), scale * (j[1] * j[2] - j[0] * j[3]));
        let (t1, t2) = (torque[0] - s * rates[1] * rates[1], torque[1] + s * rates[0] * rates[0]);
        let scale = 1.0 / (h11 * h22 - c * c);
        out[0] = (h22 * t1 - c * t2) * scale;
        out[1] = (h11 * t2 - c * t1) * scale;
    }
}
