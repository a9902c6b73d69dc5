//! Efforts with rests in between, in which a limb moves by its own noise.

use ndof_diagnose::{Options, Verdict, diagnose};
use ndof_signal::{Channel, Quantity, Recording, Unit};
use ndof_sysid::Ports;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::f64::consts::TAU;

const RATE_HZ: f64 = 500.0;
const INSIDE: usize = 8;

/// Twice a low-pass of first order.
struct Smooth([f64; 2], f64);

impl Smooth {
    fn new(cutoff_hz: f64) -> Self {
        Smooth([0.0; 2], 1.0 - (-TAU * cutoff_hz / (RATE_HZ * INSIDE as f64)).exp())
    }

    fn next(&mut self, x: f64) -> f64 {
        self.0[0] += self.1 * (x - self.0[0]);
        self.0[1] += self.1 * (self.0[0] - self.0[1]);
        self.0[1]
    }
}

/// Torques that step at random on an ankle of 0.015 kg m², 0.5 N m s/rad and 40 N m/rad, which moves by itself, below 4 Hz, by some hundredths of that.
fn ankle(seed: u64) -> Recording {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let (mut command, mut own, h) = (Smooth::new(30.0), Smooth::new(4.0), 1.0 / (RATE_HZ * INSIDE as f64));
    let (mut level, mut until, [mut x, mut v]) = (0.0, 0, [0.0; 2]);
    let (mut torque, mut angle) = (Vec::new(), Vec::new());
    for step in 0..(25.0 / h) as usize {
        if step >= until {
            until = step + (random.random_range(0.15..0.9) / h) as usize;
            level = [-1.0, -0.5, 0.0, 0.5, 1.0][random.random_range(0..5)];
        }
        let (applied, tremor) = (2.0 * command.next(level), own.next(6.0 * (random.random::<f64>() - 0.5)));
        if step % INSIDE == 0 && step as f64 * h >= 5.0 {
            torque.push(applied + 2e-3 * (random.random::<f64>() - 0.5));
            angle.push(x + 2e-5 * (random.random::<f64>() - 0.5));
        }
        v += h * (applied + tremor - 0.5 * v - 40.0 * x) / 0.015;
        x += h * v;
    }
    let channel = |name: &str, quantity, samples| Channel::new(name, Unit::si(quantity, true), samples);
    Recording::new(RATE_HZ, vec![channel("torque_x", Quantity::Effort, torque), channel("angle_x", Quantity::Displacement, angle)])
        .expect("columns of one length")
}

/// Less of a damper where a limb is slow is what made it move, and no law of the motion.
#[test]
fn what_a_limb_does_by_itself_between_steps_is_no_missing_physics() {
    let ports = Ports { references: vec![], inputs: vec![0], outputs: vec![1] };
    for seed in 1..=4 {
        let trials: Vec<Recording> = (0..3).map(|trial| ankle(10 * seed + trial)).collect();
        let d = diagnose(&trials, &ports, &Options::default(), None, &mut |_| {}).expect("a diagnosis");
        let left = d.baseline.held_out.nrmse[0].expect("it runs");
        assert!((0.02..0.1).contains(&left), "{left}");
        assert_eq!((&d.verdict, d.causes.len()), (&Verdict::Adequate, 0), "{seed}: {left} {:?} {:?}", d.causes, d.discrepancy.notes);
    }
}
