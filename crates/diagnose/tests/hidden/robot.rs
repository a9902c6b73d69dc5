//! The robot's own side: two carts whose simulation has one mass wrong, held on springs by a sampled controller, pushing an arm.

use ndof_diagnose::{Endpoint, Mechanism, MechanismParameter, Options, RobotSide, Status, diagnose_robot};
use ndof_models::effects::Value;
use ndof_signal::{Channel, FilteredNoise, Quantity, Recording, Unit};
use ndof_sysid::Ports;
use num_complex::Complex64;

const RATE_HZ: f64 = 500.0;
/// Steps of the integration in a sample.
const FINER: usize = 20;
/// Masses (kg), damping (N s/m) and dry friction (N) of the carts as they are.
const CARTS: [f64; 4] = [1.3, 0.9, 2.0, 0.3];
/// Stiffness and damping of the controller, and mass, damping and stiffness of the arm on each axis.
const HELD: [f64; 2] = [60.0, 2.0];
const ARM: [f64; 3] = [2.0, 12.0, 300.0];

fn friction(size: f64, v: f64) -> f64 {
    size * (v / 0.005).tanh()
}

/// Commanded force, measured force and motion of both axes. The controller knows position and velocity at the ticks, and holds.
fn trial(seed: u64) -> Recording {
    let samples = 15 * RATE_HZ as usize;
    let command = FilteredNoise { axes: 2, samples, rms: 4.0, ..FilteredNoise::default() }.generate(seed).expect("valid settings");
    let mut channels = Vec::new();
    for (axis, name) in ["x", "y"].into_iter().enumerate() {
        let h = 1.0 / (RATE_HZ * FINER as f64);
        let (mut x, mut v) = (0.0, 0.0);
        let (mut force, mut motion) = (Vec::new(), Vec::new());
        for command in &command[axis] {
            let given = command - HELD[0] * x - HELD[1] * v;
            let (mut mean_force, mut mean_motion) = (0.0, 0.0);
            for _ in 0..FINER {
                let rate = |x: f64, v: f64| (given - (CARTS[2] + ARM[1]) * v - friction(CARTS[3], v) - ARM[2] * x) / (CARTS[axis] + ARM[0]);
                let a = rate(x, v);
                let later = rate(x + h * v, v + h * a);
                let (now, x_before) = (0.5 * (a + later), x);
                x += h * (v + 0.5 * h * a);
                let v_before = v;
                v += h * now;
                let (middle_x, middle_v) = (0.5 * (x + x_before), 0.5 * (v + v_before));
                mean_force += (ARM[0] * now + ARM[1] * middle_v + ARM[2] * middle_x) / FINER as f64;
                mean_motion += middle_x / FINER as f64;
            }
            force.push(mean_force);
            motion.push(mean_motion);
        }
        for (word, quantity, samples) in
            [("cmd", Quantity::Effort, command[axis].clone()), ("force", Quantity::Effort, force), ("pos", Quantity::Displacement, motion)]
        {
            channels.push(Channel::new(format!("{word}_{name}"), Unit::si(quantity, false), samples));
        }
    }
    Recording::new(RATE_HZ, channels).expect("columns of one length")
}

struct Carts(Vec<MechanismParameter>);

struct Endpoints(Vec<f64>);

impl Carts {
    /// As the simulation has them: one mass is wrong, the damping not known.
    fn simulated() -> Self {
        let of =
            |name: &str, unit: &str, value: f64, status| MechanismParameter { name: name.to_owned(), unit: unit.to_owned(), value, status, geometry: false };
        Carts(vec![
            of("mass_x_kg", "kg", 1.0, Status::Nominal),
            of("mass_y_kg", "kg", CARTS[1], Status::Nominal),
            of("damping_N_s_per_m", "N s/m", 1.0, Status::Free),
            of("friction_N", "N", CARTS[3], Status::Nominal),
            of("ratio", "1", 1.0, Status::Fixed),
        ])
    }
}

impl Mechanism for Carts {
    fn parameters(&self) -> &[MechanismParameter] {
        &self.0
    }

    fn with(&self, values: &[f64]) -> Option<Box<dyn Endpoint + '_>> {
        values[..2].iter().all(|m| *m > 0.0).then(|| Box::new(Endpoints(values.to_vec())) as Box<dyn Endpoint>)
    }

    fn hold(&self, _: usize, s: Complex64) -> Complex64 {
        HELD[0] + HELD[1] * s
    }
}

impl Endpoint for Endpoints {
    fn needed(&mut self, _: &[f64], velocity: &[f64], acceleration: &[f64], force: &mut [f64]) -> bool {
        for (axis, force) in force.iter_mut().enumerate() {
            *force = self.0[4] * (self.0[axis] * acceleration[axis] + self.0[2] * velocity[axis] + friction(self.0[3], velocity[axis]));
        }
        true
    }
}

fn side() -> RobotSide {
    let ports = Ports { references: vec![0, 3], inputs: vec![1, 4], outputs: vec![2, 5] };
    diagnose_robot(&[trial(1), trial(2)], &ports, &Options::default(), &Carts::simulated()).expect("a robot's side")
}

#[test]
fn the_mass_that_the_simulation_has_wrong_is_named_and_corrected() {
    let side = side();
    let [cause] = &side.causes[..] else { panic!("{:?}", side.causes) };
    assert_eq!((cause.effect.as_str(), cause.site.side.as_str()), ("parameter-error", "robot"));
    let mass = cause.parameters.iter().find(|p| p.unit == "kg").expect("a mass");
    let (Value::Number(value), Some([low, high])) = (&mass.value, mass.ci95) else { panic!("{mass:?}") };
    assert!((low..=high).contains(&CARTS[0]) && (value / CARTS[0] - 1.0).abs() < 0.05, "{mass:?}");
    let damping = side.corrected.iter().find(|p| p.unit == "N s/m").expect("damping");
    assert!((damping.value / CARTS[2] - 1.0).abs() < 0.1, "{damping:?}");
}
