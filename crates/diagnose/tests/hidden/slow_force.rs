//! A limb whose own force is slow: most of what it moves by itself is slower than a block, and some of it is there when a run begins.

use ndof_diagnose::{Diagnosis, Options, Verdict, diagnose};
use ndof_models::effects::Value;
use ndof_signal::{Channel, FilteredNoise, Quantity, Recording, Unit};
use ndof_sysid::Ports;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::f64::consts::TAU;

const RATE_HZ: f64 = 250.0;
const INSIDE: usize = 20;
const SAMPLES: usize = 12_500;
/// Corner of the limb's own force, of first order.
const SLOW_HZ: f64 = 0.08;

/// 50 s of 1.5 kg, 20 N s/m and 300 N/m, which may swing every 8 s, with dry friction, moved by 4 N rms up to 12 Hz and by an own force of `own` N rms.
fn limb([dry, swing]: [f64; 2], own: f64, seed: u64) -> Recording {
    let noise = FilteredNoise { axes: 1, samples: SAMPLES, sample_rate_hz: RATE_HZ, cutoff_hz: 12.0, rms: 4.0, ..FilteredNoise::default() };
    let force = noise.generate(seed).expect("noise").remove(0);
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let (h, keep) = (1.0 / (RATE_HZ * INSIDE as f64), (-TAU * SLOW_HZ / RATE_HZ).exp());
    let mut next = |last: f64| keep * last + (1.0 - keep * keep).sqrt() * own * 3f64.sqrt() * random.random_range(-1.0..1.0);
    // Ten of its times: it is there from the first sample on.
    let mut push = (0..(10.0 * RATE_HZ / SLOW_HZ / TAU) as usize).fold(0.0, |last, _| next(last));
    let (mut x, mut v) = (push / 300.0, 0.0);
    let mut motion = Vec::with_capacity(SAMPLES);
    for (k, f) in force.iter().enumerate() {
        let stiffness = 300.0 + swing * (TAU * k as f64 / (8.0 * RATE_HZ)).sin();
        push = next(push);
        let mut mean = 0.0;
        for _ in 0..INSIDE {
            v += h * (f + push - 20.0 * v - stiffness * x - dry * (v / 5e-4_f64).tanh()) / 1.5;
            x += h * v;
            mean += x / INSIDE as f64;
        }
        motion.push(mean);
    }
    let channel = |name: &str, quantity, samples| Channel::new(name, Unit::si(quantity, false), samples);
    Recording::new(RATE_HZ, vec![channel("force_x", Quantity::Effort, force), channel("pos_x", Quantity::Displacement, motion)]).expect("one length")
}

fn diagnosed(missing: [f64; 2], own: f64, seed: u64) -> Diagnosis {
    let trials: Vec<Recording> = (0..3).map(|trial| limb(missing, own, 10 * seed + trial)).collect();
    let ports = Ports { references: vec![], inputs: vec![0], outputs: vec![1] };
    diagnose(&trials, &ports, &Options::default(), None, &mut |_| {}).expect("a diagnosis")
}

#[test]
fn a_slow_force_of_the_limbs_own_is_no_missing_physics() {
    for seed in 1..=3 {
        let d = diagnosed([0.0; 2], 1.0, seed);
        assert!(d.baseline.held_out.nrmse[0].is_some_and(|error| (0.2..0.9).contains(&error)), "{:?}", d.baseline.held_out);
        assert!(d.causes.iter().all(|cause| cause.effect == "limb-noise"), "{seed}: {:?}", d.causes);
        assert!(!matches!(d.verdict, Verdict::Unexplained | Verdict::PartlyExplained), "{seed}: {:?} {:?}", d.verdict, d.discrepancy.notes);
    }
}

#[test]
fn beside_a_slow_force_a_friction_is_named_and_nothing_is_left() {
    for seed in 4..=6 {
        let d = diagnosed([0.25, 0.0], 0.4, seed);
        assert_eq!((d.verdict, d.causes[0].effect.as_str()), (Verdict::Explained, "coulomb-friction"), "{seed}: {:?}", d.discrepancy.notes);
        let level = d.causes[0].parameters.iter().find(|p| p.name == "level_n").expect("a level");
        let Value::Number(value) = level.value else { panic!("a number") };
        assert!((value - 0.25).abs() < 0.03 && d.causes[0].probability > 0.9, "{seed}: {value} at {}", d.causes[0].probability);
    }
}

/// No known cause swings like that, and what it leaves is no force of the limb's own.
#[test]
fn a_stiffness_that_comes_and_goes_is_told_and_nothing_is_sure_beside_it() {
    for seed in 7..=9 {
        let d = diagnosed([0.0, 130.0], 0.2, seed);
        assert!(matches!(d.verdict, Verdict::Unexplained | Verdict::PartlyExplained), "{seed}: {:?}", d.verdict);
        assert!(d.discrepancy.notes.iter().any(|note| note.contains("changes slowly with time")), "{seed}: {:?}", d.discrepancy.notes);
        assert!(d.causes.iter().all(|cause| cause.effect != "limb-noise" && cause.probability <= 0.6), "{seed}: {:?}", d.causes);
    }
}
