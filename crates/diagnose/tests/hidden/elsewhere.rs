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

/// Two masses of which the first is pushed.
struct Two {
    masses_kg: [f64; 2],
    /// From the ground to the first, between them, from the second to the ground.
    springs: [f64; 3],
    dampers: [f64; 3],
    /// Whose motion is measured.
    seen: usize,
}

/// Two masses of 1 kg, the first sprung to the ground, on springs and light dampers, the second as light as is said, whose motion is measured.
fn far_mass(light: f64, seed: u64) -> Recording {
    shaken(&Two { masses_kg: [1.0; 2], springs: [300.0, 1500.0, 0.0], dampers: [2.0, light, 0.0], seen: 1 }, seed)
}

fn shaken(two: &Two, seed: u64) -> Recording {
    let Two { masses_kg, springs, dampers, seen } = *two;
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let lines: Vec<(f64, f64)> = (4..400).map(|k| (0.025 * f64::from(k), random.random_range(0.0..TAU))).collect();
    let force = |t: f64| lines.iter().map(|(f, phase)| (TAU * f * t + phase).sin()).sum::<f64>();
    let rates = |t: f64, [x, y, v, w]: [f64; 4]| {
        let pulls = |i: usize, x: f64, v: f64| springs[i] * x + dampers[i] * v;
        let [first, between, second] = [pulls(0, x, v), pulls(1, y - x, w - v), pulls(2, y, w)];
        [v, w, (force(t) - first + between) / masses_kg[0], (-between - second) / masses_kg[1]]
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
            motion.push(state[seen] + NOISE_M * (random.random::<f64>() - 0.5));
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
        let d = answer(far_mass(1.0, seed));
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

/// What rings on from before the record: of the second damper the fast mode takes some ten seconds to die away.
#[test]
fn a_light_mode_rings_on_from_before() {
    let d = answer(far_mass(0.02, 1));
    assert_eq!((d.causes[0].effect.as_str(), &d.verdict), ("extra-resonance", &Verdict::Explained), "{:?}", d.causes);
    let after = d.extended.held_out.nrmse[0].expect("runs");
    assert!(after < 0.01, "{after}");
}

/// A handle that holds a limb softly: from outside a mode, with the handle's inertia, and the hold's stiffness and damping, in front of it.
#[test]
fn a_limb_behind_a_soft_hold_is_a_mode_with_the_hold_before_it() {
    let ([handle, limb], [hold, spring], [soft, damper]) = ([0.3, 2.0], [1700.0, 400.0], [5.0, 18.0]);
    let w = f64::sqrt((hold + spring) / limb);
    for seed in [1, 2] {
        let d = answer(shaken(&Two { masses_kg: [handle, limb], springs: [0.0, hold, spring], dampers: [0.0, soft, damper], seen: 0 }, seed));
        let [mode] = &d.causes[..] else { panic!("{:?}", d.causes) };
        assert_eq!((mode.effect.as_str(), &d.verdict), ("extra-resonance", &Verdict::Explained));
        // The limb behind the hold, and the hold.
        let said = mode.evidence.iter().find(|said| said.contains("behind a hold of about")).expect("what is behind");
        let numbers: Vec<f64> = said.split_whitespace().filter_map(|word| word.parse().ok()).collect();
        // A spring and a damper behind are what is left of the sums that a mode shows.
        let truths = [(limb, limb), (damper, damper + soft), (spring, spring + hold), (hold, hold), (soft, damper + soft)];
        for (told, (truth, of)) in numbers.iter().zip(truths) {
            assert!((told - truth).abs() < 0.1 * of, "{truth}: {said}");
        }
        assert_eq!(numbers.len(), 5, "{said}");
        for (name, truth) in [("frequency_hz", w / TAU), ("damping_ratio", (soft + damper) / (2.0 * w * limb))] {
            let told = mode.parameters.iter().find(|p| p.name == name).expect("a number of the mode");
            let (Value::Number(value), Some([low, high])) = (&told.value, told.ci95) else { panic!("{told:?}") };
            assert!(low < truth && truth < high && (value / truth - 1.0).abs() < 0.05, "{truth}: {told:?}");
        }
        // Of (c s + k)² / (m s² + (b + c) s + K + k) a constant c² / m is no mode's.
        for (name, truth) in [("M", handle), ("B", soft), ("K", hold - soft * soft / limb)] {
            let told = d.extended.parameters.iter().find(|p| p.name == name).expect("an entry");
            assert!((told.value - truth).abs() < 4.0 * told.std_error.expect("an error"), "{truth}: {told:?}");
        }
        let after = d.extended.held_out.nrmse[0].expect("runs");
        assert!(after < 0.02, "{after}");
    }
}
