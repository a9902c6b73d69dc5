//! A limb held by a robot, stepped exactly: an integration that shares nothing with the models it tests.

use ndarray::{Array1, Array2, arr2};
use ndof_models::{Axis, InertiaDampingStiffness};
use ndof_signal::{FilteredNoise, Passband, SosFilter};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

pub const RATE_HZ: f64 = 500.0;
/// Stiffness and damping of the force transducer.
pub const TRANSDUCER: (f64, f64) = (1e6, 800.0);

/// The patient-like arm P1.
pub fn patient() -> InertiaDampingStiffness {
    InertiaDampingStiffness {
        axes: vec![Axis::linear("x"), Axis::linear("y")],
        inertia: arr2(&[[2.1, -0.55], [-0.55, 1.9]]),
        damping: arr2(&[[11.0, -2.0], [-2.0, 15.0]]),
        stiffness: arr2(&[[300.0, -60.0], [-60.0, 520.0]]),
    }
}

/// e^A by scaling and squaring of the Taylor series.
fn exponential(a: &Array2<f64>) -> Array2<f64> {
    let norm = a.rows().into_iter().map(|r| r.iter().map(|v| v.abs()).sum::<f64>()).fold(0.0, f64::max);
    let halvings = (norm.log2().ceil() as i32 + 4).max(0);
    let small = a * 0.5f64.powi(halvings);
    let (mut sum, mut term) = (Array2::eye(a.nrows()), Array2::eye(a.nrows()));
    for k in 1..20 {
        term = term.dot(&small) / f64::from(k);
        sum += &term;
    }
    (0..halvings).fold(sum, |m, _| m.dot(&m))
}

/// One 50 s trial: commanded force, force on the limb through a transducer of that stiffness and damping, displacement of the
/// robot; two channels each, both measured as means over the sample interval.
pub fn trial(limb: &InertiaDampingStiffness, transducer: (f64, f64), limb_noise_n: f64, seed: u64) -> Vec<Vec<f64>> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut white = || -> f64 { StandardNormal.sample(&mut rng) };
    let command = FilteredNoise { axes: 2, rms: 4.0, ..FilteredNoise::default() }.generate(seed).expect("valid");
    let samples = command[0].len();
    let lowpass = SosFilter::butterworth(2, Passband::Low(2.0), RATE_HZ).expect("valid");
    let own: Vec<Vec<f64>> = (0..2)
        .map(|_| {
            let raw: Vec<f64> = (0..samples + 2000).map(|_| white()).collect();
            let noise = lowpass.filter(&raw)[2000..].to_vec();
            let rms = (noise.iter().map(|v| v * v).sum::<f64>() / samples as f64).sqrt();
            noise.iter().map(|v| v / rms * limb_noise_n).collect()
        })
        .collect();
    // States d, ḋ, x, ẋ, ∫F, ∫d and the held inputs F_c, w.
    let robot = arr2(&[[0.932, -0.305], [-0.305, 1.050]]);
    let inverse = |m: &Array2<f64>| arr2(&[[m[[1, 1]], -m[[0, 1]]], [-m[[1, 0]], m[[0, 0]]]]) / (m[[0, 0]] * m[[1, 1]] - m[[0, 1]] * m[[1, 0]]);
    let (robot, mass) = (inverse(&robot), inverse(&limb.inertia));
    let (k, b) = transducer;
    let mut a = Array2::<f64>::zeros((16, 16));
    for i in 0..2 {
        a[[i, 2 + i]] = 1.0;
        a[[4 + i, 6 + i]] = 1.0;
        for j in 0..2 {
            for (column, gain) in [(0, k), (2, b), (4, -k), (6, -b)] {
                a[[2 + i, column + j]] -= robot[[i, j]] * gain;
                a[[6 + i, column + j]] += mass[[i, j]] * gain;
            }
            a[[2 + i, 12 + j]] = robot[[i, j]];
            a[[6 + i, 14 + j]] = mass[[i, j]];
            for l in 0..2 {
                a[[6 + i, 4 + j]] -= mass[[i, l]] * limb.stiffness[[l, j]];
                a[[6 + i, 6 + j]] -= mass[[i, l]] * limb.damping[[l, j]];
            }
        }
        for (column, gain) in [(0, k), (2, b), (4, -k), (6, -b)] {
            a[[8 + i, column + i]] += gain;
        }
        a[[10 + i, i]] = 1.0;
    }
    let step = exponential(&(a / RATE_HZ));
    let (kp, kd) = (100.0, 5.0);
    let g = (std::f64::consts::PI * 20.0 / RATE_HZ).tan();
    let (gain, pole) = (g / (g + 1.0), (1.0 - g) / (1.0 + g));
    let mut state = Array1::<f64>::zeros(16);
    let (mut last, mut raw, mut filtered) = ([0.0; 2], [0.0; 2], [0.0; 2]);
    let mut out: Vec<Vec<f64>> = (0..6).map(|_| Vec::with_capacity(samples)).collect();
    for n in 0..samples {
        for i in 0..2 {
            let velocity = (state[i] - last[i]) * RATE_HZ;
            filtered[i] = gain * (velocity + raw[i]) + pole * filtered[i];
            (last[i], raw[i]) = (state[i], velocity);
            state[12 + i] = command[i][n] - kp * state[i] - kd * filtered[i];
            state[14 + i] = own[i][n];
            state[8 + i] = 0.0;
            state[10 + i] = 0.0;
        }
        state = step.dot(&state);
        for i in 0..2 {
            out[i].push(command[i][n]);
            out[2 + i].push(state[8 + i] * RATE_HZ + 0.03 * white());
            out[4 + i].push((state[10 + i] * RATE_HZ / 5e-5).round() * 5e-5);
        }
    }
    out
}
