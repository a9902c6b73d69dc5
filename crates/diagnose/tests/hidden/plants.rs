//! Linear plants, exactly: what a lightly damped one makes of a late channel, and what becomes of an answer where the held-out trial is of another one.

use ndof_diagnose::{Diagnosis, Options, UNSURE, Verdict, diagnose};
use ndof_models::effects::Value;
use ndof_signal::{Channel, Quantity, Recording, Unit};
use ndof_sysid::Ports;
use num_complex::Complex64;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::f64::consts::TAU;

const RATE_HZ: f64 = 1000.0;
const SAMPLES: u32 = 40_000;
/// Corner of the force, of fourth order: beyond it both channels sink into their noise.
const CORNER_HZ: f64 = 20.0;
/// Noise of each channel over its rms.
const NOISE: f64 = 5e-3;

/// Inertia (kg), damping (N s/m), stiffness (N/m), how much later than it is force and position are recorded (s), a damping (N s/m) that answers by so much late (s),
/// and a force of its own below 3 Hz, as a share of the force's rms.
#[derive(Clone, Copy, Default)]
struct Plant {
    matrices: [f64; 3],
    late_s: [f64; 2],
    answers_late: [f64; 2],
    own_force: f64,
}

/// 40 s of a force of 3200 sines up to 80 Hz, as near to each other as the record can tell, and of the motion that it has made for ever.
fn recorded(plant: Plant, seed: u64) -> Recording {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let lines: Vec<(f64, f64)> = (0..3200).map(|_| (random.random_range(0.1..80.0), random.random_range(0.0..TAU))).collect();
    let [mass, damping, stiffness] = plant.matrices;
    let mut channel = |late_s: f64, response: &dyn Fn(Complex64) -> Complex64| -> Vec<f64> {
        let mut all = vec![0.0; SAMPLES as usize];
        for (hz, phase) in &lines {
            let rate = TAU * hz;
            let size = (1.0 + (hz / CORNER_HZ).powi(8)).powf(-0.5);
            let mut now = Complex64::from_polar(size, phase - rate * late_s) * response(Complex64::new(0.0, rate));
            let turn = Complex64::from_polar(1.0, rate / RATE_HZ);
            for x in &mut all {
                *x += now.re;
                now *= turn;
            }
        }
        let rms = (all.iter().map(|x| x * x).sum::<f64>() / f64::from(SAMPLES)).sqrt();
        all.iter().map(|x| x + NOISE * rms * 12_f64.sqrt() * (random.random::<f64>() - 0.5)).collect()
    };
    let force = channel(plant.late_s[0], &|_| Complex64::ONE);
    let [feedback, by_s] = plant.answers_late;
    // Sines whose phases the force does not know take the place of some of its own.
    let own = |hz: f64| if hz < 3.0 { Complex64::from_polar(plant.own_force * (CORNER_HZ / 3.0).sqrt(), 1e4 * hz * hz) } else { Complex64::ZERO };
    let position = channel(plant.late_s[1], &|s| (1.0 + own(s.im / TAU)) / (mass * s * s + (damping + feedback * (-by_s * s).exp()) * s + stiffness));
    let of = |name: &str, quantity, samples| Channel::new(name, Unit::si(quantity, false), samples);
    Recording::new(RATE_HZ, vec![of("force_x", Quantity::Effort, force), of("pos_x", Quantity::Displacement, position)]).expect("one length")
}

fn diagnosed(plants: &[Plant], seed: u64) -> Diagnosis {
    of_recordings(&(1..).zip(plants).map(|(k, plant)| recorded(*plant, 100 * seed + k)).collect::<Vec<_>>())
}

fn of_recordings(trials: &[Recording]) -> Diagnosis {
    let ports = Ports { references: vec![], inputs: vec![0], outputs: vec![1] };
    diagnose(trials, &ports, &Options::default(), None, &mut |_| {}).expect("a diagnosis")
}

/// Without the delay the linear model runs away (its damping is below zero) or is that of another sign: neither says anything of a spring, or of how the force
/// was counted.
#[test]
fn a_late_channel_of_a_lightly_damped_plant_is_that_alone() {
    let matrices = [1.0, 5.0, 400.0];
    for (seed, late_s) in [(1, [0.015, 0.0]), (2, [0.02, 0.0]), (3, [0.0, 0.015]), (4, [0.0, 0.025])] {
        let d = diagnosed(&[Plant { matrices, late_s, ..Plant::default() }], seed);
        assert_eq!(d.causes.iter().map(|c| c.effect.as_str()).collect::<Vec<_>>(), ["measurement-delay"], "{late_s:?} {:?}", d.discrepancy.notes);
        let delay = d.causes[0].parameters.iter().find(|p| p.name == "delay_s").map(|p| p.value.clone());
        assert!(matches!(delay, Some(Value::Number(found)) if (found - late_s[0] - late_s[1]).abs() < 3e-4), "{late_s:?} {delay:?}");
        assert_eq!(d.verdict, Verdict::Explained, "{:?}", d.discrepancy.notes);
        for (found, truth) in d.extended.parameters.iter().zip(matrices) {
            assert!((found.value / truth - 1.0).abs() < 0.02, "{late_s:?} {} {}", found.name, found.value);
        }
    }
}

fn is_told_of_another_plant(d: &Diagnosis) -> bool {
    d.discrepancy.another_plant.is_some()
}

/// Of a single trial the last 12 of 40 s are held out; some seconds before its end the plant becomes another.
#[test]
fn a_change_within_the_held_out_part_is_no_noise() {
    let of = |damping: f64, stiffness: f64, own_force: f64| Plant { matrices: [2.0, damping, stiffness], own_force, ..Plant::default() };
    // Of a light damping errors grow, and differ from block to block.
    let (first, light, restless) = (of(10.0, 300.0, 0.0), of(2.0, 300.0, 0.0), of(10.0, 300.0, 0.3));
    let changes = [
        (first, of(10.0, 450.0, 0.0), 7),
        (first, of(10.0, 330.0, 0.0), 7),
        (first, of(30.0, 300.0, 0.0), 7),
        (light, of(2.0, 330.0, 0.0), 7),
        (light, of(2.0, 450.0, 0.0), 4),
        (first, of(10.0, 450.0, 0.0), 4),
        (restless, of(10.0, 450.0, 0.3), 7),
    ];
    // What changes by less than the tolerance is none, though it is likelier; nor is what the limb does by itself, though a model of its own errs less there.
    let nothing = [(first, first), (light, light), (first, of(10.0, 301.0, 0.0)), (restless, restless), (restless, restless), (restless, restless)];
    let nothing = nothing.map(|(first, last)| (first, last, 7));
    for (seed, (first, last, seconds)) in (1..).zip(changes.into_iter().chain(nothing)) {
        let [mut trial, other] = [first, last].map(|plant| recorded(plant, seed));
        let mut both = trial.columns(&[1])[0]
            .iter()
            .zip(other.columns(&[1])[0])
            .enumerate()
            .map(|(k, (a, b))| if k < 1000 * (40 - seconds) { *a } else { *b })
            .collect::<Vec<_>>()
            .into_iter();
        trial.map_channel("pos_x", |x| both.next().unwrap_or(x)).expect("a position");
        let d = of_recordings(&[trial]);
        let changed = seed <= changes.len() as u64;
        assert_eq!(is_told_of_another_plant(&d), changed, "{seed} {:?}", d.discrepancy.notes);
        let expected = if changed { Verdict::Unexplained } else { Verdict::Adequate };
        assert!(first.own_force > 0.0 || d.verdict == expected, "{seed} {:?} {:?}", d.verdict, d.discrepancy.notes);
    }
}

/// A feedback that answers late, without a muscle, is no relaxation.
#[test]
fn a_feedback_without_a_muscle_is_a_reflex_without_one() {
    for (seed, [mass, damping, stiffness]) in [(1, [2.5, 31.4, 278.0]), (2, [1.59, 26.2, 506.0])] {
        let d = of_recordings(&[recorded(Plant { matrices: [mass, damping, stiffness], answers_late: [0.8 * damping, 0.04], ..Plant::default() }, seed)]);
        assert_eq!(d.causes.iter().map(|c| c.effect.as_str()).collect::<Vec<_>>(), ["reflex-delay"], "{:?}", d.causes);
        assert_eq!(d.verdict, Verdict::Explained, "{:?}", d.discrepancy.notes);
        let number = |name: &str| d.causes[0].parameters.iter().find(|p| p.name == name).map(|p| p.value.clone());
        assert!(matches!(number("delay_s"), Some(Value::Number(found)) if (found - 0.04).abs() < 1e-3), "{:?}", d.causes);
        assert!(matches!(number("damping_n_s_per_m"), Some(Value::Number(found)) if (found / (0.8 * damping) - 1.0).abs() < 0.1), "{:?}", d.causes);
        assert_eq!(number("cutoff_hz"), None);
    }
}

/// Sooner than a reflex can: what stands for it turns a matrix below zero, or has a sign that it cannot have.
#[test]
fn what_stands_for_a_feedback_that_answers_soon_is_doubted() {
    for (seed, [mass, damping, stiffness], by_s) in [(1, [2.5, 31.4, 278.0], 0.015), (2, [1.59, 26.2, 506.0], 0.015), (3, [1.59, 26.2, 506.0], 0.025)] {
        let d = of_recordings(&[recorded(Plant { matrices: [mass, damping, stiffness], answers_late: [0.8 * damping, by_s], ..Plant::default() }, seed)]);
        assert!(d.causes.iter().all(|cause| cause.probability <= UNSURE), "{:?}", d.causes);
        assert_ne!(d.verdict, Verdict::Explained);
    }
}

/// A position that stands still for 0.12 s, where it is fast, is no knock from outside.
#[test]
fn a_sensor_that_stops_is_no_force() {
    let mut trial = recorded(Plant { matrices: [2.0, 10.0, 300.0], ..Plant::default() }, 7);
    let position = trial.columns(&[1])[0].to_vec();
    let farthest = |a: &usize, b: &usize| (position[a + 120] - position[*a]).abs().total_cmp(&(position[b + 120] - position[*b]).abs());
    let stop = (5000..20_000).max_by(farthest).expect("samples");
    let mut k = 0..;
    trial.map_channel("pos_x", |x| k.next().filter(|k| (stop..stop + 120).contains(k)).map_or(x, |_| position[stop])).expect("a position");
    let d = of_recordings(&[trial]);
    assert!(d.causes.is_empty(), "{:?}", d.causes);
    assert!(d.discrepancy.notes.iter().any(|note| note.contains("its sensor stopped")), "{:?}", d.discrepancy.notes);
}

/// A change between what was fitted and what was held out is no noise.
#[test]
fn a_held_out_trial_of_another_plant_is_told_as_that() {
    let of = |damping: f64, stiffness: f64| Plant { matrices: [2.0, damping, stiffness], ..Plant::default() };
    for (seed, last) in [(1, of(10.0, 450.0)), (2, of(10.0, 330.0)), (3, of(30.0, 300.0))] {
        let d = diagnosed(&[of(10.0, 300.0), of(10.0, 300.0), last], seed);
        assert_eq!((d.verdict, is_told_of_another_plant(&d)), (Verdict::Unexplained, true), "{seed} {:?}", d.discrepancy.notes);
        // What remains at best is what the noise makes.
        assert!(d.noise_floor.nrmse[0].is_some_and(|floor| floor < 4.0 * NOISE), "{:?}", d.noise_floor);
    }
    for seed in 4..=6 {
        let d = diagnosed(&[of(10.0, 300.0); 3], seed);
        assert_eq!((d.verdict, is_told_of_another_plant(&d)), (Verdict::Adequate, false), "{seed} {:?}", d.discrepancy.notes);
    }
}
