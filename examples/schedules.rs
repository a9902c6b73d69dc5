//! Do the bands of a stiffness over a cycle hold it, and does the test for variation cry as often as it says?
//!
//! `cargo run --release --example schedules [SEEDS]` (default 200) simulates limbs of one, two and three axes whose stiffness follows the phase of a
//! movement, held by a soft robot that moves its reference and pushes with a commanded force of 5 N, and whose own force is 0.5 N. Each recording is
//! fitted over its phase. Then come limbs whose stiffness does not change, two and a half times as many recordings.

use ndof::analysis::fit::schedule::result::ScheduleResult;
use ndof::models::schedule::Term;
use ndof::signal::{Channel, FilteredNoise, Quantity, Recording, Unit};
use ndof::{Estimate, Fit, Trial};
use rayon::prelude::*;
use std::error::Error;
use std::f64::consts::TAU;

type Failure = Box<dyn Error + Send + Sync>;
type Matrix = [[f64; 3]; 3];

const RATE_HZ: f64 = 200.0;
const CYCLE_S: f64 = 1.5;
const BAND_HZ: [f64; 2] = [0.3, 10.0];
/// Steps of the integrator in a sample.
const STEPS: usize = 10;
/// Of the limb: kg, N s/m, N/m; fewer axes take the leading part. Then what co-contraction adds to the stiffness, and what a change of posture does.
const INERTIA: Matrix = [[1.8, -0.4, 0.1], [-0.4, 1.6, 0.2], [0.1, 0.2, 1.5]];
const DAMPING: Matrix = [[11.0, -2.0, 1.0], [-2.0, 14.0, -1.0], [1.0, -1.0, 12.0]];
const STIFFNESS: Matrix = [[200.0, -50.0, 20.0], [-50.0, 350.0, -30.0], [20.0, -30.0, 250.0]];
const CONTRACTION: Matrix = [[300.0, -100.0, 50.0], [-100.0, 150.0, 0.0], [50.0, 0.0, 200.0]];
const POSTURE: Matrix = [[0.0, 0.0, 0.0], [0.0, 100.0, 50.0], [0.0, 50.0, -40.0]];
/// Of the robot, alike along all axes: kg, N s/m, N/m.
const ROBOT: [f64; 3] = [1.0, 12.0, 150.0];
/// How far it moves its reference, m.
const PATH: [f64; 3] = [0.1, 0.05, -0.05];
/// Corner of the limb's own force, of first order: its power falls as that of a hand does.
const LIMB_HZ: f64 = 3.0;

/// What is measured: how many axes, over how many cycles, and whether the stiffness moves.
#[derive(Clone, Copy)]
struct Limb {
    axes: usize,
    cycles: usize,
    moves: bool,
}

impl Limb {
    fn stiffness(self, phase: f64, i: usize, j: usize) -> f64 {
        let contraction = (-((phase - 0.5) / 0.15).powi(2)).exp();
        let change = CONTRACTION[i][j] * contraction + POSTURE[i][j] * (TAU * phase).sin();
        STIFFNESS[i][j] + if self.moves { change } else { 0.0 }
    }

    /// Inverse of the inertia of limb and robot, by Gauss and Jordan.
    fn mobility(self) -> Matrix {
        let n = self.axes;
        let whole = |i: usize, j: usize| INERTIA[i][j] + if i == j { ROBOT[0] } else { 0.0 };
        let mut rows: Vec<Vec<f64>> = (0..n).map(|i| (0..n).map(|j| whole(i, j)).chain((0..n).map(|j| f64::from(u8::from(i == j)))).collect()).collect();
        for k in 0..n {
            let pivot: Vec<f64> = rows[k].iter().map(|v| v / rows[k][k]).collect();
            rows.iter_mut().enumerate().filter(|(i, _)| *i != k).for_each(|(_, row)| {
                let factor = row[k];
                row.iter_mut().zip(&pivot).for_each(|(v, p)| *v -= factor * p);
            });
            rows[k] = pivot;
        }
        std::array::from_fn(|i| std::array::from_fn(|j| if i < n && j < n { rows[i][n + j] } else { 0.0 }))
    }

    /// Force between limb and robot, and position; each the mean over its interval, as an anti-alias filter makes it. Semi-implicit steps of Euler.
    fn motion(self, command: &[Vec<f64>], own: &[Vec<f64>]) -> [Vec<Vec<f64>>; 2] {
        let (n, mobility, step_s) = (self.axes, self.mobility(), 1.0 / (RATE_HZ * STEPS as f64));
        let (mut x, mut v) = ([0.0; 3], [0.0; 3]);
        let mut measured = [vec![Vec::new(); n], vec![Vec::new(); n]];
        for t in 0..command[0].len() {
            let mut mean = [[0.0; 3]; 2];
            for step in 0..STEPS {
                // The middle of the interval is where its sample stands.
                let phase = (((t * STEPS + step) as f64 - 0.5 * (STEPS - 1) as f64) * step_s / CYCLE_S).rem_euclid(1.0);
                // To and fro with the least jerk, half a cycle each.
                let s = 1.0 - (2.0 * phase - 1.0).abs();
                let drawn = PATH.map(|reach| reach * s * s * s * (10.0 - 15.0 * s + 6.0 * s * s));
                let row = |i: usize| (0..n).map(|j| DAMPING[i][j] * v[j] + self.stiffness(phase, i, j) * (x[j] - drawn[j])).sum::<f64>() + own[i][t];
                let limb: [f64; 3] = std::array::from_fn(|i| if i < n { row(i) } else { 0.0 });
                let push: [f64; 3] =
                    std::array::from_fn(|i| if i < n { command[i][t] - ROBOT[1] * v[i] - ROBOT[2] * (x[i] - drawn[i]) - limb[i] } else { 0.0 });
                let acceleration: [f64; 3] = std::array::from_fn(|i| (0..n).map(|j| mobility[i][j] * push[j]).sum());
                for i in 0..n {
                    mean[0][i] += (limb[i] + (0..n).map(|j| INERTIA[i][j] * acceleration[j]).sum::<f64>()) / STEPS as f64;
                    mean[1][i] += x[i] / STEPS as f64;
                    v[i] += step_s * acceleration[i];
                    x[i] += step_s * v[i];
                }
            }
            (0..2).for_each(|kind| (0..n).for_each(|i| measured[kind][i].push(mean[kind][i])));
        }
        measured
    }

    /// One recording, fitted over its phase.
    fn fitted(self, seed: u64) -> Result<ScheduleResult, Failure> {
        let samples = (self.cycles as f64 * CYCLE_S * RATE_HZ) as usize;
        let noise = |rms: f64, cutoff_hz: f64, order: usize, seed: u64| {
            FilteredNoise { axes: self.axes, samples, sample_rate_hz: RATE_HZ, rms, cutoff_hz, order, ..FilteredNoise::default() }.generate(seed)
        };
        let (command, own) = (noise(5.0, BAND_HZ[1], 8, 2 * seed)?, noise(0.5, LIMB_HZ, 1, 2 * seed + 1)?);
        let [force, position] = self.motion(&command, &own);
        let mut channels = Vec::new();
        for (prefix, quantity, signals) in [("cmd", Quantity::Effort, command), ("force", Quantity::Effort, force), ("pos", Quantity::Displacement, position)] {
            let named = ["x", "y", "z"].into_iter().zip(signals);
            channels.extend(named.map(|(axis, samples)| Channel::new(format!("{prefix}_{axis}"), Unit::si(quantity, false), samples)));
        }
        let estimated = Estimate::welch(512).run([&Trial::of("moving", Recording::new(RATE_HZ, channels)?)])?;
        let fit = Fit { schedule: Some("phase".to_owned()), cycle_s: Some(CYCLE_S), band_hz: Some(BAND_HZ), ..Fit::default() };
        fit.run(&estimated)?.result.schedule.ok_or_else(|| "no schedule".into())
    }

    /// A row of the table of bands.
    fn bands(self, seeds: u64) -> Result<(), Failure> {
        let all: Vec<ScheduleResult> = (0..seeds).into_par_iter().map(|seed| self.fitted(seed)).collect::<Result<_, _>>()?;
        let n = self.axes;
        let (mut points, mut held, mut curves, mut whole) = (0.0, 0.0, 0.0, 0.0);
        let mut errors = vec![0.0_f64; n * n];
        // The last place of a cycle is its first.
        let places = all[0].at.len() - 1;
        let truth = |e: usize, k: usize| self.stiffness(k as f64 / places as f64, e / n, e % n);
        for found in &all {
            let stiffness = found.entries.iter().filter(|entry| entry.name.starts_with('K'));
            for (e, entry) in stiffness.enumerate() {
                let within = |band: &[Vec<f64>; 2], k: usize| (band[0][k]..=band[1][k]).contains(&truth(e, k));
                points += places as f64;
                curves += 1.0;
                held += (0..places).filter(|k| within(&entry.ci95, *k)).count() as f64;
                whole += f64::from(u8::from((0..places).all(|k| within(&entry.band95, k))));
                errors[e] += (0..places).map(|k| (entry.value[k] - truth(e, k)).powi(2)).sum::<f64>() / (places as f64 * seeds as f64);
            }
        }
        let relative = |e: usize| {
            let [low, high] = (0..places).map(|k| truth(e, k)).fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], v| [low.min(v), high.max(v)]);
            100.0 * errors[e].sqrt() / (high - low)
        };
        let worst = (0..n * n).map(relative).fold(0.0, f64::max);
        let diagonal = (0..n).map(|i| relative(i * n + i)).fold(0.0, f64::max);
        let [held, whole] = [100.0 * held / points, 100.0 * whole / curves];
        println!("{n:4} {:6}   {held:9.1}   {whole:11.1}   {diagonal:8.1}   {worst:9.1}", self.cycles);
        Ok(())
    }

    /// A row of the table of tests.
    fn alarms(self, seeds: u64) -> Result<(), Failure> {
        let all: Vec<ScheduleResult> = (0..seeds).into_par_iter().map(|seed| self.fitted(seed)).collect::<Result<_, _>>()?;
        let share = |matrix: Term| {
            let cries = |found: &&ScheduleResult| found.tests.iter().any(|test| test.matrix == matrix && test.p_value.is_some_and(|p| p < 0.05));
            100.0 * all.iter().filter(cries).count() as f64 / seeds as f64
        };
        let [k, b, m] = [Term::Stiffness, Term::Damping, Term::Inertia].map(share);
        println!("{:4} {:6}   {k:9.1}   {b:7.1}   {m:7.1}", self.axes, self.cycles);
        Ok(())
    }
}

fn main() -> Result<(), Failure> {
    let seeds: u64 = std::env::args().nth(1).map_or(Ok(200), |text| text.parse())?;
    println!("{seeds} recordings a row: % of points of K within their 95 % interval, % of curves within their band,");
    println!("RMS error in % of the entry's range, the worst entry of the diagonal and of all\n");
    println!("axes cycles   pointwise   whole curve   diagonal   all entries");
    for axes in 1..=3 {
        for cycles in [20, 60, 200] {
            Limb { axes, cycles, moves: true }.bands(seeds)?;
        }
    }
    let seeds = seeds * 5 / 2;
    println!("\n{seeds} recordings a row of a limb that does not change: % with p < 5 %\n");
    println!("axes cycles   stiffness   damping   inertia");
    for axes in 1..=2 {
        for cycles in [20, 60] {
            Limb { axes, cycles, moves: false }.alarms(seeds)?;
        }
    }
    Ok(())
}
