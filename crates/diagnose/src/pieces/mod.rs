//! Tests of the pieces by themselves, on short experiments whose every number is known: the band ends at 6 Hz, so that a unit of time is two seconds.

mod answers;
mod fits;
mod forces;
mod series;

#[path = "../../../../tests/support/stored.rs"]
mod stored;

use crate::Options;
use crate::samples::{Meaning, Samples};
use crate::subject::Subject;
use ndof_models::effects::EFFECTS;
use ndof_signal::{Channel, Quantity, Recording, Unit};
use ndof_sysid::Ports;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use serde_json::Value;
use std::f64::consts::TAU;

const RATE_HZ: f64 = 200.0;
const SAMPLES: usize = 4800;
const BAND_HZ: (f64, f64) = (0.0, 6.0);
const MASS: [[f64; 2]; 2] = [[1.5, 0.2], [0.2, 1.0]];
const DAMPING: [[f64; 2]; 2] = [[9.0, 1.0], [-0.5, 6.0]];
const STIFFNESS: [[f64; 2]; 2] = [[120.0, 15.0], [5.0, 80.0]];
/// Mass, damping and stiffness of the robot that closes the loop.
const ROBOT: [f64; 3] = [3.0, 8.0, 40.0];

/// Where the plant is.
struct At {
    trial: usize,
    t: f64,
    x: [f64; 2],
    v: [f64; 2],
}

/// What is done to the plant, and how it is recorded.
#[derive(Clone, Copy)]
struct Experiment {
    axes: usize,
    trials: usize,
    imposed: bool,
    /// Whether a robot closes the loop, and if so whether its reference is an effort.
    robot: Option<bool>,
    /// Derivative of the displacement that is recorded.
    order: i32,
    rotational: bool,
    /// By how much the effort comes late (s).
    late_s: f64,
    /// Noise of the effort (N).
    noise: f64,
    /// Resisting force beside that of the matrices.
    extra: fn(&At) -> [f64; 2],
}

const PLAIN: Experiment =
    Experiment { axes: 1, trials: 2, imposed: false, robot: None, order: 0, rotational: false, late_s: 0.0, noise: 0.05, extra: |_| [0.0; 2] };

/// Displacement, velocity and acceleration: sines from 0.15 to 6 Hz, on other lines for each axis.
fn motion(trial: usize, axis: usize, t: f64) -> [f64; 3] {
    let mut out = [0.0; 3];
    for q in 0..32 {
        let f = 0.15 + 0.183 * q as f64 + 0.09 * axis as f64;
        let a = 0.008 / (1.0 + f);
        let w = TAU * f;
        let (sin, cos) = (w * t + TAU * (0.618_034 * ((q + 1) * (q + 3 + 7 * trial + 3 * axis)) as f64).fract()).sin_cos();
        out[0] += a * sin;
        out[1] += a * w * cos;
        out[2] -= a * w * w * sin;
    }
    out
}

impl Experiment {
    /// The force that the motion needs, without noise.
    fn effort(&self, trial: usize, t: f64) -> [f64; 2] {
        let k: Vec<[f64; 3]> = (0..2).map(|i| if i < self.axes { motion(trial, i, t) } else { [0.0; 3] }).collect();
        let at = At { trial, t, x: [k[0][0], k[1][0]], v: [k[0][1], k[1][1]] };
        let mut out = (self.extra)(&at);
        for (i, f) in out.iter_mut().enumerate() {
            *f += (0..2).map(|j| MASS[i][j] * k[j][2] + DAMPING[i][j] * k[j][1] + STIFFNESS[i][j] * k[j][0]).sum::<f64>();
        }
        out
    }

    fn recordings(&self) -> (Vec<Recording>, Ports) {
        let mut random = ChaCha8Rng::seed_from_u64(5);
        let trials = (0..self.trials).map(|trial| {
            let mut columns = vec![vec![Vec::with_capacity(SAMPLES); self.axes]; 3];
            for k in 0..SAMPLES {
                let t = k as f64 / RATE_HZ;
                let force = self.effort(trial, t - self.late_s);
                for i in 0..self.axes {
                    let moved = motion(trial, i, t);
                    let noise: f64 = random.sample(StandardNormal);
                    let f = force[i] + self.noise * noise;
                    // As another machine would round.
                    columns[0][i].push(f * stored::nudge(k));
                    columns[1][i].push(moved[self.order as usize] * stored::nudge(k + i + 1));
                    let command = f + ROBOT[0] * moved[2] + ROBOT[1] * moved[1] + ROBOT[2] * moved[0];
                    columns[2][i].push(if self.robot == Some(true) { command } else { command / 100.0 });
                }
            }
            let places = [Quantity::Displacement, Quantity::Velocity, Quantity::Acceleration];
            let third = if self.robot == Some(true) { Quantity::Effort } else { Quantity::Displacement };
            let kinds = [("force", Quantity::Effort), (["pos", "vel", "acc"][self.order as usize], places[self.order as usize]), ("cmd", third)];
            let mut channels = Vec::new();
            for (samples, (word, quantity)) in columns.into_iter().zip(kinds) {
                for (samples, axis) in samples.into_iter().zip(["x", "y"]) {
                    channels.push(Channel::new(format!("{word}_{axis}"), Unit::si(quantity, self.rotational), samples));
                }
            }
            Recording::new(RATE_HZ, channels).unwrap()
        });
        let n = self.axes;
        let (effort, motion): (Vec<usize>, Vec<usize>) = ((0..n).collect(), (n..2 * n).collect());
        let references = if self.robot.is_some() { (2 * n..3 * n).collect() } else { vec![] };
        let (inputs, outputs) = if self.imposed { (motion, effort) } else { (effort, motion) };
        (trials.collect(), Ports { references, inputs, outputs })
    }

    fn samples(&self) -> (Samples, Meaning) {
        let (trials, ports) = self.recordings();
        let meaning = Meaning::new(&trials[0], &ports).unwrap();
        (Samples::new(&trials, &ports, &meaning).unwrap(), meaning)
    }

    /// With these effects to choose from.
    fn subject(&self, effects: &[&str]) -> Subject {
        let (samples, meaning) = self.samples();
        Subject::new(&samples, &meaning, &only(effects), None).unwrap()
    }
}

/// The band, and only these effects.
fn only(effects: &[&str]) -> Options {
    let without = EFFECTS.iter().map(|e| e.name()).filter(|e| !effects.contains(e)).map(str::to_owned).collect();
    Options { band_hz: Some(BAND_HZ), without, resamples: 50, ..Options::default() }
}

/// Holds numbers against `tests/pieces/NAME.json`; `NDOF_WRITE_ANSWERS=1` writes it anew.
fn held(name: &str, found: &Value) {
    stored::held(found, &format!("{}/tests/pieces/{name}.json", env!("CARGO_MANIFEST_DIR")), 1e-4, "NDOF_WRITE_ANSWERS");
}

/// Of numbers their mean, their rms, and one in five of a few.
fn outline(values: &[f64]) -> Vec<f64> {
    let n = values.len() as f64;
    let mut out = vec![n, values.iter().sum::<f64>() / n, (values.iter().map(|v| v * v).sum::<f64>() / n).sqrt()];
    out.extend(values.iter().step_by((values.len() / 5).max(1)));
    out
}

/// The same of complex ones, real and imaginary parts beside each other.
fn outline_of(values: &[num_complex::Complex64]) -> Vec<f64> {
    outline(&values.iter().flat_map(|v| [v.re, v.im]).collect::<Vec<f64>>())
}
