//! Sensors that show another thing than a place, or not all of it.

use ndof_diagnose::{Diagnosis, Options, Verdict, diagnose};
use ndof_signal::{Channel, Quantity, Recording, Unit};
use ndof_sysid::Ports;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::f64::consts::TAU;

const RATE_HZ: f64 = 200.0;
const SAMPLES: usize = 12_000;

/// The force, no more than `most` deviations, on a body of 2 kg with a damper of 8 N s/m on a spring of so much, and its place and speed, from zero on.
fn body(stiffness: f64, most: f64, seed: u64) -> [Vec<f64>; 3] {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let lines: Vec<(f64, f64)> = (1..200).map(|k| (0.05 * f64::from(k), random.random_range(0.0..TAU))).collect();
    let most = most * (0.5 * lines.len() as f64).sqrt();
    let force = |t: f64| lines.iter().map(|(f, phase)| (TAU * f * t + phase).sin()).sum::<f64>().clamp(-most, most);
    let rates = |f: f64, [x, v]: [f64; 2]| [v, (f - 8.0 * v - stiffness * x) / 2.0];
    let (h, mut state, mut out) = (1.0 / RATE_HZ, [0.0; 2], <[Vec<f64>; 3]>::default());
    let mut before = force(0.0);
    for k in 0..SAMPLES {
        let (t, [x, v]) = (k as f64 * h, state);
        out.iter_mut().zip([before, x, v]).for_each(|(series, value)| series.push(value));
        let [middle, after] = [force(t + 0.5 * h), force(t + h)];
        let along = |k: [f64; 2], h: f64| [x + h * k[0], v + h * k[1]];
        let k1 = rates(before, state);
        let k2 = rates(middle, along(k1, 0.5 * h));
        let k3 = rates(middle, along(k2, 0.5 * h));
        let k4 = rates(after, along(k3, h));
        state = std::array::from_fn(|i| state[i] + h / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]));
        before = after;
    }
    out
}

fn deviation(x: &[f64]) -> f64 {
    let mean = x.iter().sum::<f64>() / x.len() as f64;
    (x.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / x.len() as f64).sqrt()
}

fn answer(force: Vec<f64>, name: &str, quantity: Quantity, motion: Vec<f64>) -> Diagnosis {
    let channel = |name: &str, quantity, samples| Channel::new(name, Unit::si(quantity, false), samples);
    let recording = Recording::new(RATE_HZ, vec![channel("force_x", Quantity::Effort, force), channel(name, quantity, motion)]).expect("columns of one length");
    let ports = Ports { references: vec![], inputs: vec![0], outputs: vec![1] };
    diagnose(&[recording], &ports, &Options::default(), None, &mut |_| {}).expect("a diagnosis")
}

/// A damper brings a speed back, though no spring brings the place back: the whole held-out part is run from its beginning, and leaves what is noise.
#[test]
fn a_speed_that_damping_brings_back_is_run_from_beginning_to_end() {
    let [force, _, mut speed] = body(0.0, f64::INFINITY, 3);
    let mut random = ChaCha8Rng::seed_from_u64(4);
    let spread = deviation(&speed);
    // Of uniform noise the deviation is its width over √12.
    speed.iter_mut().for_each(|v| *v += 0.05 * spread * 12.0_f64.sqrt() * (random.random::<f64>() - 0.5));
    let d = answer(force, "vel_x", Quantity::Velocity, speed);
    let left = d.baseline.held_out.nrmse[0].expect("it runs");
    // Within the band alone there is less noise than at all frequencies.
    assert!(d.split.windows_s.is_none() && left < 0.055, "{:?} {left}", d.split.windows_s);
    assert_eq!((&d.verdict, d.causes.len()), (&Verdict::Adequate, 0), "{:?}", d.discrepancy.notes);
}

#[test]
fn no_model_is_adequate_to_a_force_that_its_sensor_cuts_off() {
    let [force, place, _] = body(300.0, f64::INFINITY, 5);
    let most = 0.8 * deviation(&force);
    let cut = force.iter().map(|f| f.clamp(-most, most)).collect();
    let d = answer(cut, "pos_x", Quantity::Displacement, place.clone());
    assert_ne!(d.verdict, Verdict::Adequate);
    assert!(d.discrepancy.notes.iter().any(|note| note.contains("force_x stands still at its limits")), "{:?}", d.discrepancy.notes);
    // A motor that gives no more, and a sensor that shows it, hide nothing.
    let [limited, moved, _] = body(300.0, 0.8, 5);
    let shown = answer(limited, "pos_x", Quantity::Displacement, moved);
    assert_eq!((shown.verdict, shown.discrepancy.notes), (Verdict::Adequate, vec![]));
    let whole = answer(force, "pos_x", Quantity::Displacement, place);
    assert_eq!((whole.verdict, whole.discrepancy.notes), (Verdict::Adequate, vec![]));
}
