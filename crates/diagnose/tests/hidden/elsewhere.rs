//! Motion that is measured elsewhere than the effort acts: what lies between has a mode of its own, and pushes either way beyond it.

use ndof_diagnose::{Diagnosis, Options, Verdict, diagnose};
use ndof_models::effects::Value;
use ndof_signal::{Channel, Quantity, Recording, Unit};
use ndof_sysid::Ports;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::f64::consts::TAU;

const RATE_HZ: f64 = 200.0;
/// A hundredth of the motion.
const NOISE_M: f64 = 2e-3;

/// The motion of the second of two masses of 1 kg, the first pushed and sprung to the ground: both on springs and light dampers.
fn far_mass(seed: u64) -> Recording {
    let (mass, [ground, between], [slow, light]) = (1.0, [300.0, 1500.0], [2.0, 1.0]);
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let lines: Vec<(f64, f64)> = (4..400).map(|k| (0.025 * f64::from(k), random.random_range(0.0..TAU))).collect();
    let force = |t: f64| lines.iter().map(|(f, phase)| (TAU * f * t + phase).sin()).sum::<f64>();
    let rates = |t: f64, [x, y, v, w]: [f64; 4]| {
        let spring = between * (y - x) + light * (w - v);
        [v, w, (force(t) - ground * x - slow * v + spring) / mass, -spring / mass]
    };
    let h = 0.5 / RATE_HZ;
    let mut state = [0.0; 4];
    let (mut efforts, mut motion) = (Vec::new(), Vec::new());
    let along = |a: [f64; 4], k: [f64; 4], h: f64| std::array::from_fn::<f64, 4, _>(|i| a[i] + h * k[i]);
    for step in 0..(130.0 / h) as usize {
        let t = step as f64 * h;
        // What is transient has gone after ten seconds.
        if step % 2 == 0 && t >= 10.0 {
            efforts.push(force(t));
            motion.push(state[1] + NOISE_M * (random.random::<f64>() - 0.5));
        }
        let k1 = rates(t, state);
        let k2 = rates(t + 0.5 * h, along(state, k1, 0.5 * h));
        let k3 = rates(t + 0.5 * h, along(state, k2, 0.5 * h));
        let k4 = rates(t + h, along(state, k3, h));
        state = std::array::from_fn(|i| state[i] + h / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]));
    }
    let channel = |name: &str, quantity, samples| Channel::new(name, Unit::si(quantity, false), samples);
    Recording::new(RATE_HZ, vec![channel("force_x", Quantity::Effort, efforts), channel("pos_x", Quantity::Displacement, motion)])
        .expect("columns of one length")
}

fn answer(recording: Recording) -> Diagnosis {
    let ports = Ports { references: vec![], inputs: vec![0], outputs: vec![1] };
    diagnose(&[recording], &ports, &Options::default(), None, &mut |_| {}).expect("a diagnosis")
}

#[test]
fn a_mode_between_effort_and_motion_is_named_with_its_numbers() {
    // K = [[1800, -1500], [-1500, 1500]] has the eigenvalues 1650 ± √(150² + 1500²); the faster's vector is (1, q), and its damping that of [[3, -1], [-1, 1]].
    let w = (1650.0 + 150.0_f64.hypot(1500.0)).sqrt();
    let q = (1800.0 - w * w) / 1500.0;
    let ratio = (3.0 - 2.0 * q + q * q) / (1.0 + q * q) / (2.0 * w);
    for seed in [1, 2, 3] {
        let d = answer(far_mass(seed));
        let first = d.causes.first().expect("a cause");
        assert_eq!((first.effect.as_str(), &d.verdict), ("extra-resonance", &Verdict::Explained), "{:?}", d.causes);
        for (name, truth) in [("frequency_hz", w / TAU), ("damping_ratio", ratio)] {
            let told = first.parameters.iter().find(|p| p.name == name).expect("a number of the mode");
            let (Value::Number(value), Some([low, high])) = (&told.value, told.ci95) else { panic!("{told:?}") };
            assert!(low < truth && truth < high && (value / truth - 1.0).abs() < 0.02, "{truth}: {told:?}");
        }
        let [before, after] = [&d.baseline.held_out, &d.extended.held_out].map(|score| score.nrmse[0].expect("runs"));
        assert!(before > 0.5 && after < 0.01, "{before} {after}");
    }
}
