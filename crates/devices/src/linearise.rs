//! The linear human-machine model: what the simulation does for small motions.

use crate::error::DeviceError;
use crate::limb::{Impedance, Limb};
use crate::velocity::velocity_filter;
use ndarray::{Array2, Axis};
use ndof_linear::{inverse, phi_functions};
use ndof_models::Transducer;
use ndof_models::robot::{EndpointKinematics, Robot, RobotError};
use num_complex::Complex64;

/// Gains and clock of the hold, as the linear model needs them.
#[derive(Clone, Debug, PartialEq)]
pub struct HoldGains {
    /// Stiffness of each axis (N/m, N m/rad).
    pub kp: Vec<f64>,
    /// Damping of each axis (N s/m, N m s/rad).
    pub kd: Vec<f64>,
    /// Cut-off of the first-order Butterworth filter behind the velocity's backward difference (Hz).
    pub velocity_cutoff_hz: f64,
    /// Rate of the controller (Hz).
    pub sample_rate_hz: f64,
}

impl HoldGains {
    /// The commanded force per displacement at the ticks of an axis, k_p + k_d V, with V the backward difference behind its
    /// filter (N/m, N m/rad).
    pub fn at_ticks(&self, axis: usize, s: Complex64) -> Complex64 {
        let delay = (-s / self.sample_rate_hz).exp();
        let (gain, pole) = velocity_filter(self.velocity_cutoff_hz, self.sample_rate_hz);
        let velocity = (Complex64::ONE - delay) * self.sample_rate_hz * gain * (Complex64::ONE + delay) / (Complex64::ONE - delay * pole);
        velocity * self.kd[axis] + self.kp[axis]
    }
}

/// The linear model of robot, hold, transducer and limb about the posture (Palazzolo et al. 2007, eq. 3), with the controller at its
/// ticks.
///
/// A mean force adds nothing to the robot's rows: at rest F_c = F₀; it acts in the limb's stiffness.
#[derive(Clone, Debug, PartialEq)]
pub struct Linearised {
    /// The limb's matrices at the endpoint, the geometric stiffness of its mean force included.
    pub limb: Impedance,
    /// The limb's matrices in its joints and the Jacobian between, where it has joints.
    pub limb_joints: Option<(Impedance, Array2<f64>)>,
    /// Endpoint inertia of the robot Λ = (J H⁻¹ Jᵀ)⁻¹ (kg, kg m²).
    pub robot_inertia: Array2<f64>,
    /// The transducer between robot and limb.
    pub transducer: Transducer,
    /// The hold.
    pub hold: HoldGains,
    sampled: Sampled,
}

/// Exact discrete-time model: controller at its ticks, held commands, interval means.
#[derive(Clone, Debug, PartialEq)]
struct Sampled {
    a: Array2<f64>,
    b: Array2<f64>,
    c: Array2<f64>,
    d: Array2<f64>,
}

/// H and J at joint coordinates `q`.
pub(crate) fn rigid_body(robot: &dyn Robot, q: &[f64]) -> (Array2<f64>, Array2<f64>) {
    let (m, n) = (robot.axes().len(), q.len());
    let mut kinematics = EndpointKinematics::new(m, n);
    robot.kinematics(q, &vec![0.0; n], &mut kinematics);
    let mut mass = vec![0.0; n * n];
    robot.mass_matrix(q, &mut mass);
    let square = |data: &[f64], rows: usize| Array2::from_shape_fn((rows, n), |(i, j)| data[i * n + j]);
    (square(&mass, n), square(&kinematics.jacobian, m))
}

/// Writes `block` into `out` with its corner at (`top`, `left`).
fn put(out: &mut Array2<f64>, top: usize, left: usize, block: &Array2<f64>) {
    for ((i, j), v) in block.indexed_iter() {
        out[[top + i, left + j]] = *v;
    }
}

/// The linear part of the coupled system in its states [δq, q̇, e, ė], without hold.
pub(crate) fn coupled_matrix(robot: &dyn Robot, limb: &dyn Limb, transducer: Transducer, q: &[f64]) -> Array2<f64> {
    let (h, j) = rigid_body(robot, q);
    let (n, m) = (j.ncols(), j.nrows());
    let impedance = limb.linearised();
    let zero = |r: usize, c: usize| Array2::<f64>::zeros((r, c));
    // A singular inertia gives no useful linear part; zero keeps the integrator right, only slower.
    let h_inverse = inverse(&h).unwrap_or_else(|| zero(n, n));
    let mobility = inverse(&impedance.inertia).unwrap_or_else(|| zero(m, m));
    let viscous = Array2::from_diag(&ndarray::Array1::from(robot.joints().viscous.clone()));
    let (k, b) = (transducer.stiffness, transducer.damping);
    let reach = h_inverse.dot(&j.t());
    let robot_rows = [zero(n, n), -h_inverse.dot(&viscous), reach.clone() * -k, reach.clone() * -b];
    let (mk, mb) = (mobility.dot(&impedance.stiffness), mobility.dot(&impedance.damping));
    let limb_rows = [-mk.dot(&j), -mb.dot(&j), &mobility * k + &mk, &mobility * b + &mb];
    let mut out = zero(2 * (n + m), 2 * (n + m));
    put(&mut out, 0, n, &Array2::eye(n));
    put(&mut out, 2 * n, 2 * n + m, &Array2::eye(m));
    for (left, (robot, limb)) in [0, n, 2 * n, 2 * n + m].into_iter().zip(robot_rows.iter().zip(&limb_rows)) {
        put(&mut out, n, left, robot);
        put(&mut out, 2 * n + m, left, &(j.dot(robot) - limb));
    }
    out
}

fn complex(a: &Array2<f64>) -> Array2<Complex64> {
    a.mapv(|v| Complex64::new(v, 0.0))
}

impl Linearised {
    /// The model at joint coordinates `q` of the robot.
    ///
    /// # Errors
    /// [`DeviceError`] if the robot is singular there or an inertia is not positive definite.
    pub fn new(robot: &dyn Robot, limb: &dyn Limb, transducer: Transducer, hold: HoldGains, q: &[f64]) -> Result<Self, DeviceError> {
        let (h, j) = rigid_body(robot, q);
        let singular = |what: &str| DeviceError::Inertia(format!("{what} at the posture"));
        let h_inverse = inverse(&h).ok_or_else(|| singular("the robot's mass matrix"))?;
        let reach = h_inverse.dot(&j.t());
        let robot_inertia = inverse(&j.dot(&reach)).ok_or_else(|| RobotError::Reach {
            who: "the robot".to_owned(),
            target: q.to_vec(),
            why: "its Jacobian is singular in this posture".to_owned(),
        })?;
        let impedance = limb.linearised();
        inverse(&impedance.inertia).ok_or_else(|| singular("the limb's inertia"))?;
        let open = coupled_matrix(robot, limb, transducer, q);
        let sampled = Sampled::new(&open, &reach, &j, transducer, &hold);
        Ok(Linearised { limb: impedance, limb_joints: limb.joint_impedance(), robot_inertia, transducer, hold, sampled })
    }

    /// The limb's dynamic compliance C = (M s² + B s + K)⁻¹ at `frequency_hz` (m/N), `None` where it is singular.
    pub fn limb_compliance(&self, frequency_hz: f64) -> Option<Array2<Complex64>> {
        let s = Complex64::new(0.0, std::f64::consts::TAU * frequency_hz);
        let Impedance { inertia, damping, stiffness } = &self.limb;
        inverse(&(complex(inertia) * (s * s) + complex(damping) * s + complex(stiffness)))
    }

    /// C + Z_f⁻¹: what force and the robot's motion show, the transducer's own compliance included.
    pub fn compliance_with_transducer(&self, frequency_hz: f64) -> Option<Array2<Complex64>> {
        let s = Complex64::new(0.0, std::f64::consts::TAU * frequency_hz);
        let transducer = (self.transducer.damping * s + self.transducer.stiffness).inv();
        let mut c = self.limb_compliance(frequency_hz)?;
        c.diag_mut().mapv_inplace(|v| v + transducer);
        Some(c)
    }

    /// T and R between recorded samples, exact for small motions: sampled hold, held commands, interval means.
    pub fn sampled_responses(&self, frequency_hz: f64) -> Option<(Array2<Complex64>, Array2<Complex64>)> {
        let Sampled { a, b, c, d } = &self.sampled;
        let z = Complex64::new(0.0, std::f64::consts::TAU * frequency_hz / self.hold.sample_rate_hz).exp();
        let mut matrix = complex(a) * -Complex64::ONE;
        matrix.diag_mut().mapv_inplace(|v| v + z);
        let all = complex(c).dot(&inverse(&matrix)?).dot(&complex(b)) + complex(d);
        let (t, r) = all.view().split_at(Axis(0), self.robot_inertia.nrows());
        Some((t.to_owned(), r.to_owned()))
    }

    /// T⁻¹ between recorded samples: commands F_Δ = T⁻¹ F that deliver the forces F for small motions. Without stiffness of the
    /// limb it does not exist at 0 Hz.
    pub fn precompensation(&self, frequency_hz: f64) -> Option<Array2<Complex64>> {
        inverse(&self.sampled_responses(frequency_hz)?.0)
    }
}

impl Sampled {
    /// States [δq, q̇, e, ė, d₋, v₋, v_f₋] at the ticks; outputs mean force and mean endpoint displacement of the interval that follows.
    fn new(open: &Array2<f64>, reach: &Array2<f64>, j: &Array2<f64>, transducer: Transducer, hold: &HoldGains) -> Self {
        let (n, m, total) = (j.ncols(), j.nrows(), open.nrows());
        let step = 1.0 / hold.sample_rate_hz;
        let [exponential, first, second, ..] = phi_functions(&(open * step));
        let mut input = Array2::zeros((total, m));
        put(&mut input, n, 0, reach);
        // The endpoint felt by the force feels J q̈ in the deflection too.
        put(&mut input, 2 * n + m, 0, &j.dot(reach));
        let (gamma, mean_gamma) = (first.dot(&input) * step, second.dot(&input) * step);

        let (fs, (g, p)) = (hold.sample_rate_hz, velocity_filter(hold.velocity_cutoff_hz, hold.sample_rate_hz));
        let size = total + 3 * m;
        // Rows that read, from the augmented state, this tick's d, v and v_f, and the hold's force.
        let mut position = Array2::<f64>::zeros((m, size));
        put(&mut position, 0, 0, j);
        let mut velocity = &position * fs;
        (0..m).for_each(|i| velocity[[i, total + i]] -= fs);
        let mut filtered = &velocity * g;
        for i in 0..m {
            filtered[[i, total + m + i]] += g;
            filtered[[i, total + 2 * m + i]] += p;
        }
        let force = Array2::from_shape_fn((m, size), |(i, k)| -hold.kp[i] * position[[i, k]] - hold.kd[i] * filtered[[i, k]]);
        let mut plant = Array2::<f64>::zeros((total, size));
        put(&mut plant, 0, 0, &exponential);
        let (mut a, mut b) = (Array2::zeros((size, size)), Array2::zeros((size, m)));
        for (top, rows) in [(0, &(plant + gamma.dot(&force))), (total, &position), (total + m, &velocity), (total + 2 * m, &filtered)] {
            put(&mut a, top, 0, rows);
        }
        put(&mut b, 0, 0, &gamma);
        let mut mean = Array2::<f64>::zeros((total, size));
        put(&mut mean, 0, 0, &first);
        let mean = mean + mean_gamma.dot(&force);
        let mut read = Array2::<f64>::zeros((2 * m, total));
        for i in 0..m {
            read[[i, 2 * n + i]] = transducer.stiffness;
            read[[i, 2 * n + m + i]] = transducer.damping;
        }
        put(&mut read, m, 0, j);
        Sampled { a, b, c: read.dot(&mean), d: read.dot(&mean_gamma) }
    }
}
