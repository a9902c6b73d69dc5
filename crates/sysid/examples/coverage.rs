//! How often 95 % intervals hold the truth: every method, open loop and held by a robot.
//!
//! `cargo run --release -p ndof-sysid --example coverage [TRIALS]` prints a table: the share of simulated experiments in
//! which the interval of gain, of phase, and the disc of both hold the true response, at several coherences.

use ndof_signal::{Channel, Multitaper, Periodic, Quantity, Recording, RecordingError, Unit, Welch};
use ndof_sysid::{Confidence, Direct, FrequencyResponse, Labels, LocalPolynomial, Ports, SpectralMethod, estimate};
use num_complex::Complex64;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use rayon::prelude::*;
use std::f64::consts::TAU;

const RATE_HZ: f64 = 100.0;
const SAMPLES: usize = 4096;
const PERIOD: usize = 512;
/// Smooth limbs, so that what is tested is the interval and not the window's bias.
const LIMBS: [(f64, f64); 2] = [(6.0, 1.0), (9.0, 0.9)];
const JUDGED_HZ: [f64; 4] = [2.34375, 4.6875, 7.8125, 11.71875];

/// A second-order limb as an exact difference equation, y_k = a₁ y_{k−1} + a₂ y_{k−2} + g u_k.
#[derive(Clone, Copy)]
struct Limb {
    a1: f64,
    a2: f64,
    gain: f64,
}

impl Limb {
    fn new((frequency_hz, damping): (f64, f64)) -> Self {
        let w = TAU * frequency_hz / RATE_HZ;
        let decay = (-damping * w).exp();
        let turn = w * (1.0 - damping * damping).max(0.0).sqrt();
        let (a1, a2) = (2.0 * decay * turn.cos(), -decay * decay);
        Limb { a1, a2, gain: 1.0 - a1 - a2 }
    }

    fn at(&self, frequency_hz: f64) -> Complex64 {
        let z = Complex64::from_polar(1.0, -TAU * frequency_hz / RATE_HZ);
        self.gain / (1.0 - self.a1 * z - self.a2 * z * z)
    }
}

/// Two limbs in a loop of stiffness `hold` (0: open loop); `noise` acts on the limb, like a force of its own.
fn experiment(seed: u64, periodic: bool, hold: f64, noise: f64) -> Result<Recording, RecordingError> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let limbs = LIMBS.map(Limb::new);
    let repeat = if periodic { PERIOD } else { SAMPLES };
    let commands: [Vec<f64>; 2] = std::array::from_fn(|_| (0..repeat).map(|_| rng.sample(StandardNormal)).collect());
    let mut state = [[0.0; 2]; 2];
    let mut columns: [Vec<f64>; 6] = std::array::from_fn(|_| Vec::with_capacity(SAMPLES));
    for k in 0..SAMPLES {
        let last = state.map(|s| s[0]);
        for i in 0..2 {
            let command = commands[i][k % repeat];
            let force = command - hold * (last[i] + 0.3 * last[1 - i]);
            let own: f64 = rng.sample(StandardNormal);
            let y = limbs[i].a1 * state[i][0] + limbs[i].a2 * state[i][1] + limbs[i].gain * (force + noise * own);
            state[i] = [y, state[i][0]];
            columns[i].push(command);
            columns[2 + i].push(force);
            columns[4 + i].push(y);
        }
    }
    let names = ["cmd_x", "cmd_y", "force_x", "force_y", "pos_x", "pos_y"];
    let quantity = |name: &str| if name.starts_with("pos") { Quantity::Displacement } else { Quantity::Effort };
    let channels = names.iter().zip(columns).map(|(name, samples)| Channel::new(*name, Unit::si(quantity(name), false), samples)).collect();
    Recording::new(RATE_HZ, channels)
}

/// Hits of gain, phase, disc over the diagonal entries at the judged frequencies.
#[derive(Clone, Copy, Default)]
struct Hits {
    gain: u32,
    phase: u32,
    disc: u32,
    cells: u32,
}

impl Hits {
    fn count(&mut self, response: &FrequencyResponse) {
        let Some(uncertainty) = &response.uncertainty else { return };
        let confidence = Confidence::new(0.95, uncertainty.degrees_of_freedom);
        for frequency_hz in JUDGED_HZ {
            let nearest = (0..response.len())
                .min_by(|&a, &b| (response.frequency_hz[a] - frequency_hz).abs().total_cmp(&(response.frequency_hz[b] - frequency_hz).abs()));
            let Some(f) = nearest else { continue };
            for (i, limb) in LIMBS.map(Limb::new).iter().enumerate() {
                let (truth, value, variance) = (limb.at(response.frequency_hz[f]), response.value[[f, i, i]], response.variance(f, i, i));
                let entry = confidence.gain_phase(value, variance);
                self.cells += 1;
                self.gain += u32::from((entry.gain_interval[0]..=entry.gain_interval[1]).contains(&truth.norm()));
                let turned = (truth / value).arg();
                let half = entry.phase_interval_rad.map_or(f64::INFINITY, |[low, high]| (high - low) / 2.0);
                self.phase += u32::from(turned.abs() <= half);
                self.disc += u32::from((value - truth).norm() <= confidence.radius(variance));
            }
        }
    }

    fn plus(self, other: Hits) -> Hits {
        Hits { gain: self.gain + other.gain, phase: self.phase + other.phase, disc: self.disc + other.disc, cells: self.cells + other.cells }
    }

    fn shares(&self) -> String {
        let share = |n: u32| 100.0 * f64::from(n) / f64::from(self.cells.max(1));
        format!("{:5.1} {:5.1} {:5.1}", share(self.gain), share(self.phase), share(self.disc))
    }
}

fn main() {
    let count: u64 = std::env::args().nth(1).and_then(|a| a.parse().ok()).unwrap_or(200);
    let ports = Ports { references: vec![0, 1], inputs: vec![2, 3], outputs: vec![4, 5] };
    let methods = [
        ("welch", SpectralMethod::Welch(Welch::new(512))),
        ("multitaper", SpectralMethod::Multitaper(Multitaper { time_bandwidth: 6.0, ..Multitaper::default() })),
        ("local polynomial", SpectralMethod::LocalPolynomial(LocalPolynomial::default())),
        ("periodic", SpectralMethod::Periodic(Periodic { period: PERIOD, discard: 1 })),
    ];
    println!("{count} experiments; % of 95 % intervals that hold the truth: gain, phase, disc");
    println!("{:<18}{:<8}{:>7}   {:<19} {:<19} coherence", "method", "loop", "noise", "direct", "derived");
    // Every row has experiments of its own.
    let mut row = 0;
    for (name, method) in &methods {
        for (hold, label) in [(0.0, "open"), (0.6, "held")] {
            for noise in [0.1, 0.3, 0.7, 1.0] {
                row += 1;
                let periodic = matches!(method, SpectralMethod::Periodic(_));
                let results: Vec<(Hits, Hits, f64)> = (0..count)
                    .into_par_iter()
                    .filter_map(|seed| {
                        let trials: Result<Vec<Recording>, RecordingError> =
                            (0..2).map(|t| experiment((row * count + seed) * 2 + t, periodic, hold, noise)).collect();
                        let trials = trials.ok()?;
                        let references: Vec<&Recording> = trials.iter().collect();
                        let found = estimate(&references, &ports, &Labels::of(&trials[0], &ports), method, Direct::H1).ok()?;
                        let (mut direct, mut derived) = (Hits::default(), Hits::default());
                        direct.count(&found.direct.response);
                        derived.count(&found.derived.as_ref()?.response);
                        let coherence = &found.direct.coherence.multiple;
                        let known: Vec<f64> = coherence.iter().copied().filter(|g| g.is_finite()).collect();
                        Some((direct, derived, known.iter().sum::<f64>() / known.len() as f64))
                    })
                    .collect();
                let direct = results.iter().fold(Hits::default(), |sum, r| sum.plus(r.0));
                let derived = results.iter().fold(Hits::default(), |sum, r| sum.plus(r.1));
                let coherence = results.iter().map(|r| r.2).sum::<f64>() / results.len() as f64;
                println!("{name:<18}{label:<8}{noise:>7.2}   {:<19} {:<19} {coherence:.3}", direct.shares(), derived.shares());
            }
        }
    }
}
