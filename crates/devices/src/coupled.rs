//! Robot, transducer and limb as one system of differential equations.

use crate::history::History;
use crate::limb::Limb;
use crate::linearise::coupled_matrix;
use ndarray::Array2;
use ndof_linear::square::add_transposed;
use ndof_models::Transducer;
use ndof_models::robot::{EndpointKinematics, Robot};
use ndof_models::{ForceLaw, Motion};

/// The coupled system with the inputs that hold over a sample: motor torque and force from within the limb.
///
/// States y = [q − q₀, q̇, e, ė, z] with the transducer's deflection e = d(q) − x. With e as a state the stiff force
/// F = k e + b ė is linear, and no small difference of large numbers is ever taken. ẏ follows from
/// H q̈ + h + τ_f = τ − Jᵀ(F + f_r), ë = J q̈ + J̇ q̇ − ẍ, and ẍ of the limb under F + w − f_l, where f_r and f_l are force laws.
pub(crate) struct Coupled<'a> {
    pub(crate) robot: &'a dyn Robot,
    pub(crate) limb: &'a dyn Limb,
    pub(crate) transducer: Transducer,
    robot_laws: &'a [Box<dyn ForceLaw>],
    limb_laws: Vec<&'a dyn ForceLaw>,
    pub(crate) rest: Vec<f64>,
    pub(crate) rest_endpoint: Vec<f64>,
    // The transducer's deflection under the limb's mean force.
    preload: Vec<f64>,
    /// Motor torque, held over the sample.
    pub(crate) torque: Vec<f64>,
    /// Force that the limb makes by itself, held over the sample.
    pub(crate) limb_force: Vec<f64>,
    history: Vec<History>,
    work: Work,
}

/// Buffers of one evaluation; what it left there can be read until the next.
struct Work {
    q: Vec<f64>,
    kinematics: EndpointKinematics,
    force: Vec<f64>,
    net: Vec<f64>,
    x: Vec<f64>,
    v: Vec<f64>,
    xdd: Vec<f64>,
    robot_v: Vec<f64>,
    torque: Vec<f64>,
    // Torque of friction, transducer and laws.
    passive: Vec<f64>,
    // Force on the limb less that of the laws.
    felt: Vec<f64>,
    solve: Vec<f64>,
    delayed_x: Vec<f64>,
    delayed_v: Vec<f64>,
}

impl<'a> Coupled<'a> {
    /// The system at rest at joint coordinates `rest`; `step_s` is the longest time step that will be taken.
    pub(crate) fn new(
        robot: &'a dyn Robot,
        limb: &'a dyn Limb,
        transducer: Transducer,
        laws: [&'a [Box<dyn ForceLaw>]; 2],
        rest: Vec<f64>,
        shortest_step_s: f64,
    ) -> Self {
        let (m, n) = (robot.axes().len(), rest.len());
        let mut kinematics = EndpointKinematics::new(m, n);
        robot.kinematics(&rest, &vec![0.0; n], &mut kinematics);
        let rest_endpoint = kinematics.endpoint.clone();
        let [robot_laws, limb_laws] = laws;
        let limb_laws: Vec<&dyn ForceLaw> = limb.moving().map(|arm| arm as &dyn ForceLaw).into_iter().chain(limb_laws.iter().map(AsRef::as_ref)).collect();
        let history = (robot_laws.iter().map(AsRef::as_ref).chain(limb_laws.iter().copied()))
            .map(|law: &dyn ForceLaw| History::new(m, if law.delay_s() > 0.0 { (law.delay_s() / shortest_step_s).ceil() as usize + 4 } else { 0 }))
            .collect();
        let preload = limb.mean_force().iter().map(|f| f / transducer.stiffness).collect();
        let axis = || vec![0.0; m];
        let work = Work {
            q: rest.clone(),
            kinematics,
            force: axis(),
            net: axis(),
            x: axis(),
            v: axis(),
            xdd: axis(),
            robot_v: axis(),
            torque: vec![0.0; n],
            passive: vec![0.0; n],
            felt: axis(),
            solve: vec![0.0; n * n],
            delayed_x: axis(),
            delayed_v: axis(),
        };
        Coupled { robot, limb, transducer, robot_laws, limb_laws, rest, rest_endpoint, preload, torque: vec![0.0; n], limb_force: axis(), history, work }
    }

    pub(crate) fn joints(&self) -> usize {
        self.rest.len()
    }

    pub(crate) fn axes(&self) -> usize {
        self.rest_endpoint.len()
    }

    fn laws(&self) -> impl Iterator<Item = &dyn ForceLaw> {
        self.robot_laws.iter().map(AsRef::as_ref).chain(self.limb_laws.iter().copied())
    }

    /// Number of states y.
    pub(crate) fn dimension(&self) -> usize {
        2 * (self.joints() + self.axes()) + self.laws().map(|l| l.states()).sum::<usize>()
    }

    /// The shortest delay of any law, infinite if there is none.
    pub(crate) fn shortest_delay_s(&self) -> f64 {
        self.laws().map(|l| l.delay_s()).filter(|d| *d > 0.0).fold(f64::INFINITY, f64::min)
    }

    /// The state of rest at the posture, the transducer bent by the limb's mean force.
    pub(crate) fn equilibrium(&self) -> Vec<f64> {
        let mut y = vec![0.0; self.dimension()];
        let start = 2 * self.joints();
        y[start..start + self.preload.len()].copy_from_slice(&self.preload);
        y
    }

    /// The matrix of ẏ = L y + … at the posture, without dry friction and force laws.
    pub(crate) fn linear_part(&self) -> Array2<f64> {
        let small = coupled_matrix(self.robot, self.limb, self.transducer, &self.rest);
        Array2::from_shape_fn((self.dimension(), self.dimension()), |place| small.get(place).copied().unwrap_or(0.0))
    }

    /// Writes ẏ at time `time_s` since the recording's first sample.
    pub(crate) fn derivative(&mut self, time_s: f64, y: &[f64], out: &mut [f64]) {
        self.derivative_of(time_s, y, out, self.joints(), self.axes());
    }

    /// The same where numbers of joints and axes are known.
    #[inline(always)]
    pub(crate) fn derivative_of(&mut self, time_s: f64, y: &[f64], out: &mut [f64], n: usize, m: usize) {
        let (position, rest) = y.split_at(n);
        let (rates, rest) = rest.split_at(n);
        let (e, rest) = rest.split_at(m);
        let (e_rate, mut states) = rest.split_at(m);
        let (_, mut state_rates) = out.split_at_mut(2 * (n + m));
        let w = &mut self.work;
        for ((q, rest), moved) in w.q[..n].iter_mut().zip(&self.rest[..n]).zip(position) {
            *q = rest + moved;
        }
        self.robot.kinematics(&w.q, rates, &mut w.kinematics);
        let (jacobian, endpoint, start) = (&w.kinematics.jacobian[..m * n], &w.kinematics.endpoint[..m], &self.rest_endpoint[..m]);
        let (x, v, robot_v, force, preload) = (&mut w.x[..m], &mut w.v[..m], &mut w.robot_v[..m], &mut w.force[..m], &self.preload[..m]);
        for i in 0..m {
            robot_v[i] = jacobian[i * n..(i + 1) * n].iter().zip(rates).map(|(j, r)| j * r).sum();
            x[i] = endpoint[i] - start[i] - (e[i] - preload[i]);
            v[i] = robot_v[i] - e_rate[i];
            force[i] = self.transducer.stiffness * e[i] + self.transducer.damping * e_rate[i];
        }
        let joints = self.robot.joints();
        let passive = &mut w.passive[..n];
        for j in 0..n {
            passive[j] = -joints.friction(j, rates[j]);
        }
        add_transposed(jacobian, force, -1.0, passive);

        let mut history = self.history.iter();
        if !self.robot_laws.is_empty() {
            w.net.fill(0.0);
            // x of the robot itself: its endpoint's displacement.
            for i in 0..m {
                w.xdd[i] = w.kinematics.endpoint[i] - self.rest_endpoint[i];
            }
            for law in self.robot_laws {
                apply(
                    law.as_ref(),
                    time_s,
                    [&w.xdd, &w.robot_v],
                    history.next(),
                    [&mut w.delayed_x, &mut w.delayed_v],
                    &mut states,
                    &mut w.net,
                    &mut state_rates,
                );
            }
            add_transposed(&w.kinematics.jacobian, &w.net, -1.0, &mut w.passive);
        }
        w.net.fill(0.0);
        for law in &self.limb_laws {
            apply(*law, time_s, [&w.x, &w.v], history.next(), [&mut w.delayed_x, &mut w.delayed_v], &mut states, &mut w.net, &mut state_rates);
        }
        for ((felt, force), net) in w.felt[..m].iter_mut().zip(&w.force[..m]).zip(&w.net[..m]) {
            *felt = force - net;
        }
        self.accelerate(y, out, n, m);
    }

    /// Writes ẏ again after torque or limb force have changed, the state being that of the last evaluation at `time_s`.
    pub(crate) fn inputs_changed(&mut self, time_s: f64, y: &[f64], out: &mut [f64]) {
        if self.robot_laws.is_empty() && self.limb_laws.is_empty() {
            self.accelerate(y, out, self.joints(), self.axes());
        } else {
            // A law may jump in time just where the inputs do.
            self.derivative(time_s, y, out);
        }
    }

    /// Accelerations from the forces that the last evaluation left, and the inputs.
    #[inline(always)]
    fn accelerate(&mut self, y: &[f64], out: &mut [f64], n: usize, m: usize) {
        let (rates, e_rate) = (&y[n..2 * n], &y[2 * n + m..2 * (n + m)]);
        let w = &mut self.work;
        for ((sum, motor), passive) in w.torque[..n].iter_mut().zip(&self.torque[..n]).zip(&w.passive[..n]) {
            *sum = motor + passive;
        }
        for ((net, felt), own) in w.net[..m].iter_mut().zip(&w.felt[..m]).zip(&self.limb_force[..m]) {
            *net = felt + own;
        }
        self.limb.acceleration(&w.x, &w.v, &w.net, &mut w.xdd);
        let (position_rate, rest) = out.split_at_mut(n);
        let (acceleration, rest) = rest.split_at_mut(n);
        let (deflection_rate, rest) = rest.split_at_mut(m);
        let deflection_acceleration = &mut rest[..m];
        position_rate.copy_from_slice(rates);
        deflection_rate.copy_from_slice(e_rate);
        self.robot.acceleration(&w.q, rates, &w.kinematics, &w.torque, &mut w.solve, acceleration);
        let (jacobian, turning, limb) = (&w.kinematics.jacobian[..m * n], &w.kinematics.jacobian_rate[..m], &w.xdd[..m]);
        for i in 0..m {
            let tip: f64 = jacobian[i * n..(i + 1) * n].iter().zip(acceleration.iter()).map(|(j, a)| j * a).sum();
            deflection_acceleration[i] = tip + turning[i] - limb[i];
        }
    }

    /// Endpoint coordinates of the last evaluation.
    pub(crate) fn endpoint(&self) -> &[f64] {
        &self.work.kinematics.endpoint
    }

    /// Jacobian of the last evaluation.
    pub(crate) fn jacobian(&self) -> &[f64] {
        &self.work.kinematics.jacobian
    }

    /// Endpoint velocity of the last evaluation.
    pub(crate) fn endpoint_velocity(&self) -> &[f64] {
        &self.work.robot_v
    }

    /// Remembers the last evaluation as having happened at `time_s`; `after` says that the inputs have just changed.
    pub(crate) fn remember(&mut self, time_s: f64, rates: &[f64], after: bool) {
        if self.history.is_empty() {
            return;
        }
        let (n, m) = (self.joints(), self.axes());
        let w = &mut self.work;
        let count = self.robot_laws.len();
        for (k, (law, history)) in self.robot_laws.iter().map(AsRef::as_ref).chain(self.limb_laws.iter().copied()).zip(&mut self.history).enumerate() {
            if law.delay_s() == 0.0 {
                continue;
            }
            let tip = &rates[2 * n + m..2 * n + 2 * m];
            let on_robot = k < count;
            // The robot's own tip accelerates by the limb's acceleration and the deflection's.
            for i in 0..m {
                w.net[i] = w.xdd[i] + if on_robot { tip[i] } else { 0.0 };
                w.delayed_x[i] = if on_robot { w.kinematics.endpoint[i] - self.rest_endpoint[i] } else { w.x[i] };
            }
            if after {
                history.restart(&w.net);
            } else {
                history.push(time_s, &w.delayed_x, if on_robot { &w.robot_v } else { &w.v }, &w.net);
            }
        }
    }
}

/// Evaluates one law and moves on to the states of the next.
#[expect(clippy::too_many_arguments, reason = "one law's share of every buffer")]
fn apply(
    law: &dyn ForceLaw,
    time_s: f64,
    [position, velocity]: [&[f64]; 2],
    history: Option<&History>,
    [delayed_x, delayed_v]: [&mut [f64]; 2],
    states: &mut &[f64],
    force: &mut [f64],
    rates: &mut &mut [f64],
) {
    let (own, rest) = states.split_at(law.states());
    *states = rest;
    let (own_rates, rest) = std::mem::take(rates).split_at_mut(law.states());
    *rates = rest;
    let motion = match history.filter(|_| law.delay_s() > 0.0) {
        Some(history) => {
            history.at(time_s - law.delay_s(), delayed_x, delayed_v);
            Motion { delayed_position: delayed_x, delayed_velocity: delayed_v, ..Motion::now(time_s, position, velocity) }
        }
        None => Motion::now(time_s, position, velocity),
    };
    law.evaluate(&motion, own, force, own_rates);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::five_bar::FiveBar;
    use crate::integrate::{Accuracy, Means, Stepper};
    use crate::limb::{EndpointLinear, PlanarTwoLink, PlanarTwoLinkConfig};
    use ndarray::array;
    use ndof_models::robot::Joints;

    fn conservative() -> (FiveBar, EndpointLinear) {
        let robot = FiveBar::new([0.4064, 0.51435], [0.0, -0.65], [0.215, 0.18, 0.03], Joints::ideal(&["1", "2"])).expect("valid");
        let impedance = crate::limb::Impedance {
            inertia: array![[2.1, -0.55], [-0.55, 1.9]],
            damping: Array2::zeros((2, 2)),
            stiffness: array![[300.0, -60.0], [-60.0, 520.0]],
        };
        (robot, EndpointLinear::from_matrices(impedance, vec![0.0; 2]).expect("valid"))
    }

    /// Kinetic and elastic energy of robot, transducer and limb (J).
    fn energy(system: &Coupled<'_>, y: &[f64]) -> f64 {
        let (q, rates): (Vec<f64>, &[f64]) = (system.rest.iter().zip(y).map(|(r, d)| r + d).collect(), &y[2..4]);
        let (mut h, mut kinematics) = ([0.0; 4], EndpointKinematics::new(2, 2));
        system.robot.mass_matrix(&q, &mut h);
        system.robot.kinematics(&q, rates, &mut kinematics);
        let j = &kinematics.jacobian;
        let x = array![kinematics.endpoint[0] - system.rest_endpoint[0] - y[4], kinematics.endpoint[1] - system.rest_endpoint[1] - y[5]];
        let v = array![j[0] * rates[0] + j[1] * rates[1] - y[6], j[2] * rates[0] + j[3] * rates[1] - y[7]];
        let limb = system.limb.linearised();
        0.5 * (h[0] * rates[0] * rates[0] + 2.0 * h[1] * rates[0] * rates[1] + h[3] * rates[1] * rates[1])
            + 0.5 * system.transducer.stiffness * (y[4] * y[4] + y[5] * y[5])
            + 0.5 * v.dot(&limb.inertia.dot(&v))
            + 0.5 * x.dot(&limb.stiffness.dot(&x))
    }

    #[test]
    fn without_friction_energy_is_kept() {
        let (robot, limb) = conservative();
        let transducer = Transducer { stiffness: 1e6, damping: 0.0 };
        let rest = robot.inverse_kinematics(&[0.0, 0.0]).expect("reach");
        let mut system = Coupled::new(&robot, &limb, transducer, [&[], &[]], rest, 1e-4);
        let mut drifts = Vec::new();
        for level in [2, 3] {
            let mut stepper = Stepper::new(&system, 2e-3, Accuracy::Fixed(level));
            // Moving together at the start: a hand speed of about 0.2 m/s.
            let mut y = stepper.state(&[0.0, 0.0, 0.4, -0.3, 0.0, 0.0, 0.0, 0.0]);
            let start = energy(&system, &y);
            let mut means = Means::new(2, 2);
            for k in 0..1000 {
                stepper.interval(&mut system, f64::from(k) * 2e-3, &mut y, &mut means);
            }
            drifts.push((energy(&system, &y) / start - 1.0).abs());
        }
        // Two seconds, some five swings of the hand and 400 of the undamped transducer; order 4 gains 16 a halving.
        assert!(drifts[0] < 1e-6 && drifts[1] < drifts[0] / 8.0, "{drifts:?}");
    }

    #[test]
    fn the_linear_part_is_the_derivative_at_rest() {
        let robot = FiveBar::new([0.4064, 0.51435], [0.0, -0.65], [0.215, 0.18, 0.03], Joints { viscous: vec![0.2, 0.3], ..Joints::ideal(&["1", "2"]) })
            .expect("valid");
        let limb = PlanarTwoLink::new(&PlanarTwoLinkConfig::default(), [0.0; 2], None).expect("valid");
        let transducer = Transducer { stiffness: 1e6, damping: 800.0 };
        let rest = robot.inverse_kinematics(&[0.05, -0.03]).expect("reach");
        let mut system = Coupled::new(&robot, &limb, transducer, [&[], &[]], rest, 1e-4);
        let linear = system.linear_part();
        let (mut plus, mut minus) = ([0.0; 8], [0.0; 8]);
        for j in 0..8 {
            let step = 1e-6;
            let mut y = [0.0; 8];
            y[j] = step;
            system.derivative(0.0, &y, &mut plus);
            y[j] = -step;
            system.derivative(0.0, &y, &mut minus);
            for i in 0..8 {
                let slope = (plus[i] - minus[i]) / (2.0 * step);
                // Central differences: ε/h of the largest acceleration.
                assert!((slope - linear[[i, j]]).abs() < 1e-7 * linear.column(j).iter().fold(1.0, |m, v| v.abs().max(m)), "({i}, {j}): {slope} for {linear}");
            }
        }
    }
}
