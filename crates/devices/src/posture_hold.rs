//! What keeps the idle joints of a robot with more joints than axes in place.

use crate::linearise::velocity_filter;
use crate::matrix::{add_transposed, cholesky, cholesky_solve, multiply};
use crate::robot::Robot;

/// Natural frequency of the idle joints (Hz), critically damped.
const FREQUENCY_HZ: f64 = 2.0;

/// Joint torques that hold the posture and that the endpoint does not feel: N τ₀ with τ₀ = −k δq − d q̇ and the dynamically
/// consistent projector N = 1 − Jᵀ Λ J H⁻¹ (O. Khatib, IEEE J. Robot. Autom. 3 (1987) 43).
pub(crate) struct PostureHold {
    rest: Vec<f64>,
    stiffness: Vec<f64>,
    damping: Vec<f64>,
    sample_rate_hz: f64,
    filter: (f64, f64),
    last: Vec<f64>,
    last_rate: Vec<f64>,
    rate: Vec<f64>,
    mass: Vec<f64>,
    reach: Vec<f64>,
    mobility: Vec<f64>,
    torque: Vec<f64>,
    felt: Vec<f64>,
}

impl PostureHold {
    /// A hold of the posture `rest`; `None` for a robot without idle joints.
    pub(crate) fn new(robot: &dyn Robot, rest: &[f64], cutoff_hz: f64, sample_rate_hz: f64) -> Option<Self> {
        let (n, m) = (rest.len(), robot.axes().len());
        if n == m {
            return None;
        }
        let mut mass = vec![0.0; n * n];
        robot.mass_matrix(rest, &mut mass);
        let w = std::f64::consts::TAU * FREQUENCY_HZ;
        Some(PostureHold {
            rest: rest.to_vec(),
            stiffness: (0..n).map(|i| w * w * mass[i * n + i]).collect(),
            damping: (0..n).map(|i| 2.0 * w * mass[i * n + i]).collect(),
            sample_rate_hz,
            filter: velocity_filter(cutoff_hz, sample_rate_hz),
            last: rest.to_vec(),
            last_rate: vec![0.0; n],
            rate: vec![0.0; n],
            mass,
            reach: vec![0.0; n * m],
            mobility: vec![0.0; m * m],
            torque: vec![0.0; n],
            felt: vec![0.0; m],
        })
    }

    /// One tick: adds the torque for measured joints `q` and the Jacobian there.
    pub(crate) fn add(&mut self, robot: &dyn Robot, q: &[f64], jacobian: &[f64], out: &mut [f64]) {
        let (n, m) = (q.len(), self.felt.len());
        let (gain, pole) = self.filter;
        for j in 0..n {
            let rate = (q[j] - self.last[j]) * self.sample_rate_hz;
            self.rate[j] = gain * (rate + self.last_rate[j]) + pole * self.rate[j];
            self.last[j] = q[j];
            self.last_rate[j] = rate;
            self.torque[j] = -self.stiffness[j] * (q[j] - self.rest[j]) - self.damping[j] * self.rate[j];
        }
        robot.mass_matrix(q, &mut self.mass);
        if !cholesky(&mut self.mass, n) {
            return;
        }
        // Rows of `reach`: H⁻¹ Jᵀ, one an axis.
        self.reach.copy_from_slice(jacobian);
        self.reach.chunks_exact_mut(n).for_each(|row| cholesky_solve(&self.mass, n, row));
        for a in 0..m {
            multiply(jacobian, &self.reach[a * n..(a + 1) * n], &mut self.mobility[a * m..(a + 1) * m]);
        }
        multiply(&self.reach, &self.torque, &mut self.felt);
        if cholesky(&mut self.mobility, m) {
            cholesky_solve(&self.mobility, m, &mut self.felt);
            add_transposed(jacobian, &self.felt, -1.0, &mut self.torque);
            out.iter_mut().zip(&self.torque).for_each(|(o, t)| *o += t);
        }
    }
}
