//! What keeps the idle joints of a robot with more joints than axes in place.

use crate::velocity::Velocity;
use ndof_linear::square::{add_transposed, multiply};
use ndof_linear::{cholesky_in_place, cholesky_solve};
use ndof_models::robot::Robot;

/// Natural frequency of the idle joints (Hz), critically damped.
const FREQUENCY_HZ: f64 = 2.0;

/// Joint torques that hold the posture and that the endpoint does not feel: N τ₀ with τ₀ = −k δq − d q̇ and the dynamically
/// consistent projector N = 1 − Jᵀ Λ J H⁻¹ (O. Khatib, IEEE J. Robot. Autom. 3 (1987) 43).
pub(crate) struct PostureHold {
    rest: Vec<f64>,
    stiffness: Vec<f64>,
    damping: Vec<f64>,
    rates: Vec<Velocity>,
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
            rates: rest.iter().map(|q| Velocity::at_rest(*q, cutoff_hz, sample_rate_hz)).collect(),
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
        for j in 0..n {
            self.torque[j] = -self.stiffness[j] * (q[j] - self.rest[j]) - self.damping[j] * self.rates[j].step(q[j]);
        }
        robot.mass_matrix(q, &mut self.mass);
        if !cholesky_in_place(&mut self.mass, n) {
            return;
        }
        // Rows of `reach`: H⁻¹ Jᵀ, one an axis.
        self.reach.copy_from_slice(jacobian);
        self.reach.chunks_exact_mut(n).for_each(|row| cholesky_solve(&self.mass, n, row));
        for a in 0..m {
            multiply(jacobian, &self.reach[a * n..(a + 1) * n], &mut self.mobility[a * m..(a + 1) * m]);
        }
        multiply(&self.reach, &self.torque, &mut self.felt);
        if cholesky_in_place(&mut self.mobility, m) {
            cholesky_solve(&self.mobility, m, &mut self.felt);
            add_transposed(jacobian, &self.felt, -1.0, &mut self.torque);
            out.iter_mut().zip(&self.torque).for_each(|(o, t)| *o += t);
        }
    }
}
