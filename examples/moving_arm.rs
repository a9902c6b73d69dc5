//! An arm that moves to and fro while its stiffness rises and falls, held and shaken by a robot: writes `moving_arm.csv` and says what is true.
//!
//! cargo run --release --example moving_arm

use ndof::signal::{Channel, FilteredNoise, Quantity, Recording, Unit};
use std::error::Error;
use std::f64::consts::TAU;
use std::path::Path;

const RATE_HZ: f64 = 250.0;
const CYCLE_S: f64 = 1.5;
const CYCLES: f64 = 60.0;
/// Steps of the integrator in a sample.
const STEPS: usize = 10;
/// Of the limb: kg, N s/m.
const INERTIA: [[f64; 2]; 2] = [[1.8, -0.4], [-0.4, 1.6]];
const DAMPING: [[f64; 2]; 2] = [[11.0, -2.0], [-2.0, 14.0]];
/// Of the robot, alike along both axes: kg, N s/m, N/m.
const ROBOT: [f64; 3] = [1.0, 12.0, 150.0];

/// The limb's stiffness (N/m): it co-contracts in the middle of the cycle.
fn stiffness(phase: f64) -> [[f64; 2]; 2] {
    let stiff = (-((phase - 0.5) / 0.15).powi(2)).exp();
    [[200.0 + 300.0 * stiff, -50.0 * (1.0 + stiff)], [-50.0 * (1.0 + stiff), 350.0 + 100.0 * (TAU * phase).sin()]]
}

/// Where the robot's spring is drawn to (m): to and fro along x with the least jerk, half a cycle each.
fn reference(phase: f64) -> [f64; 2] {
    let least_jerk = |s: f64| s * s * s * (10.0 - 15.0 * s + 6.0 * s * s);
    [0.1 * if phase < 0.5 { least_jerk(2.0 * phase) } else { least_jerk(2.0 - 2.0 * phase) }, 0.0]
}

fn times(matrix: &[[f64; 2]; 2], v: [f64; 2]) -> [f64; 2] {
    matrix.map(|row| row[0] * v[0] + row[1] * v[1])
}

/// Semi-implicit steps of Euler; each channel is the mean over its interval, as an anti-alias filter makes it.
fn simulate(command: &[Vec<f64>], limb: &[Vec<f64>]) -> [Vec<Vec<f64>>; 2] {
    let whole = [[INERTIA[0][0] + ROBOT[0], INERTIA[0][1]], [INERTIA[1][0], INERTIA[1][1] + ROBOT[0]]];
    let determinant = whole[0][0] * whole[1][1] - whole[0][1] * whole[1][0];
    let inverse = [[whole[1][1] / determinant, -whole[0][1] / determinant], [-whole[1][0] / determinant, whole[0][0] / determinant]];
    let (mut x, mut v) = ([0.0; 2], [0.0; 2]);
    let mut measured = [vec![Vec::new(); 2], vec![Vec::new(); 2]];
    let step_s = 1.0 / (RATE_HZ * STEPS as f64);
    for t in 0..command[0].len() {
        let mut mean = [[0.0; 2]; 2];
        for step in 0..STEPS {
            let phase = ((t as f64 + step as f64 / STEPS as f64) / RATE_HZ / CYCLE_S).fract();
            let drawn = reference(phase);
            let spring = times(&stiffness(phase), [x[0] - drawn[0], x[1] - drawn[1]]);
            let damper = times(&DAMPING, v);
            let own: [f64; 2] = std::array::from_fn(|i| spring[i] + damper[i] + limb[i][t]);
            let push = std::array::from_fn(|i| command[i][t] - ROBOT[1] * v[i] - ROBOT[2] * (x[i] - drawn[i]) - own[i]);
            let acceleration = times(&inverse, push);
            let inertial = times(&INERTIA, acceleration);
            for i in 0..2 {
                mean[0][i] += (own[i] + inertial[i]) / STEPS as f64;
                mean[1][i] += x[i] / STEPS as f64;
                v[i] += step_s * acceleration[i];
                x[i] += step_s * v[i];
            }
        }
        (0..2).for_each(|kind| (0..2).for_each(|i| measured[kind][i].push(mean[kind][i])));
    }
    measured
}

fn main() -> Result<(), Box<dyn Error>> {
    let samples = (CYCLES * CYCLE_S * RATE_HZ) as usize;
    let noise = |rms: f64, cutoff_hz: f64, order: usize, seed: u64| {
        FilteredNoise { axes: 2, samples, sample_rate_hz: RATE_HZ, rms, cutoff_hz, order, ..FilteredNoise::default() }.generate(seed)
    };
    let (command, limb) = (noise(5.0, 10.0, 8, 1)?, noise(0.5, 3.0, 1, 2)?);
    let [force, position] = simulate(&command, &limb);
    let mut channels = Vec::new();
    for (prefix, quantity, signals) in [("cmd", Quantity::Effort, command), ("force", Quantity::Effort, force), ("pos", Quantity::Displacement, position)] {
        let named = ["x", "y"].into_iter().zip(signals);
        channels.extend(named.map(|(axis, samples)| Channel::new(format!("{prefix}_{axis}"), Unit::si(quantity, false), samples)));
    }
    ndof::io::write(Path::new("moving_arm.csv"), &Recording::new(RATE_HZ, channels)?)?;
    println!("moving_arm.csv: {CYCLES} cycles of {CYCLE_S} s; what is true of the stiffness in N/m:");
    println!("phase  K_x_x  K_x_y  K_y_y");
    for phase in [0.0, 0.2, 0.4, 0.6, 0.8, 1.0] {
        let [[xx, xy], [_, yy]] = stiffness(phase);
        println!("{phase:5.1} {xx:6.1} {xy:6.1} {yy:6.1}");
    }
    Ok(())
}
