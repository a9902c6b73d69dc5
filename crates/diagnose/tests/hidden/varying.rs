//! An ankle that is moved to and fro and shaken on the way: does its stiffness follow the phase of the cycle, or is it something else?
//!
//! Laws and their integration are this file's own. The effort of an imposed motion is M ẍ + B ẋ + K x + f₀(phase) + f(x, ẋ) + noise.

use ndof_diagnose::{Cause, Diagnosis, Options, Schedule, diagnose};
use ndof_models::effects::Value;
use ndof_signal::{Channel, FilteredNoise, Quantity, Recording, Unit};
use ndof_sysid::Ports;
use std::f64::consts::TAU;

const RATE_HZ: f64 = 250.0;
const CYCLE_S: f64 = 1.5;
const SAMPLES: usize = 22_500;
/// kg m², N m s/rad, N m/rad.
const PLANT: [f64; 3] = [0.02, 0.6, 40.0];
/// Stretches that are integrated in one sample, for laws with a memory.
const STEPS: usize = 8;

#[derive(Clone, Copy, PartialEq)]
enum Truth {
    Nothing,
    /// K goes from 10 to 70 N m/rad within the cycle.
    Varies,
    /// B goes from 0.2 to 1 N m s/rad within the cycle.
    Damps,
    /// 2 N m s/rad behind 40 ms, through a muscle of 4 Hz.
    Reflex,
    /// 3 N m s/rad upon stretches to one side only.
    OneSided,
    /// The same reflex, its gain from 0 to 4 N m s/rad within the cycle.
    VaryingReflex,
    /// The same, upon stretches to one side only.
    VaryingOneSided,
    /// The varying reflex beside the varying stiffness.
    Both,
    /// Dry friction that yields within 0.03 rad, 1.2 N m.
    Hysteresis,
    /// A spring that goes soft: -1200 N m/rad³.
    Softens,
    /// K grows by 1 % a second.
    Drifts,
}

/// N m s/rad.
fn reflex_gain(phase: f64) -> f64 {
    2.0 - 2.0 * (TAU * (phase - 0.3)).cos()
}

/// Angle and torque; noise of the limb's own of 0.1 N m.
fn recording(truth: Truth, seed: u64) -> Recording {
    let noise = |rms: f64, cutoff_hz: f64, seed: u64| {
        let made = FilteredNoise { axes: 1, samples: SAMPLES, sample_rate_hz: RATE_HZ, rms, cutoff_hz, ..FilteredNoise::default() };
        made.generate(seed).expect("noise").remove(0)
    };
    let (shaken, own) = (noise(0.02, 8.0, seed), noise(0.1, 15.0, seed + 1000));
    let phase = |t: f64| (t / CYCLE_S).fract();
    let x: Vec<f64> = shaken.iter().enumerate().map(|(k, d)| d - 0.06 * (TAU * phase(k as f64 / RATE_HZ)).cos()).collect();
    let slope = |k: usize, order: usize| match (k, order) {
        (0, _) => 0.0,
        (k, _) if k + 1 >= SAMPLES => 0.0,
        (_, 1) => 0.5 * RATE_HZ * (x[k + 1] - x[k - 1]),
        _ => RATE_HZ * RATE_HZ * (x[k + 1] - 2.0 * x[k] + x[k - 1]),
    };
    // States: activation and its rate; the elastic stretch behind the friction.
    let (mut a, mut rate, mut z) = (0.0, 0.0, 0.0_f64);
    let late = (0.04 * RATE_HZ) as usize;
    let torque = (0..SAMPLES).map(|k| {
        let (t, v) = (k as f64 / RATE_HZ, slope(k, 1));
        let h = 1.0 / (RATE_HZ * STEPS as f64);
        let omega = TAU * 4.0;
        for _ in 0..STEPS {
            let stretch = if k > late { slope(k - late, 1) } else { 0.0 };
            let drive = match truth {
                Truth::OneSided => 3.0 * stretch.max(0.0),
                Truth::VaryingReflex | Truth::Both => reflex_gain(phase(t)) * stretch,
                Truth::VaryingOneSided => reflex_gain(phase(t)) * stretch.max(0.0),
                _ => 2.0 * stretch,
            };
            rate += h * (omega * (omega * (drive - a) - 2.0 * rate));
            a += h * rate;
            z = (z + h * v).clamp(-0.03, 0.03);
        }
        let stiffer = -30.0 * (TAU * (phase(t) - 0.1)).cos() * x[k];
        let hidden = match truth {
            Truth::Nothing => 0.0,
            Truth::Varies => stiffer,
            Truth::Damps => 0.4 * (TAU * (phase(t) - 0.4)).cos() * v,
            Truth::Both => stiffer + a,
            Truth::Reflex | Truth::OneSided | Truth::VaryingReflex | Truth::VaryingOneSided => a,
            Truth::Hysteresis => 1.2 * z / 0.03,
            Truth::Softens => -1200.0 * x[k].powi(3),
            Truth::Drifts => 0.01 * (t - 45.0) * PLANT[2] * x[k],
        };
        // What the muscles do by themselves comes back with the phase.
        let active = 1.5 * (TAU * phase(t)).sin().max(0.0).powi(2);
        PLANT[0] * slope(k, 2) + PLANT[1] * v + PLANT[2] * x[k] + active + hidden + own[k]
    });
    let channel = |name: &str, quantity, samples: Vec<f64>| Channel::new(name, Unit::si(quantity, true), samples);
    let torque = torque.collect();
    Recording::new(RATE_HZ, vec![channel("angle_ankle", Quantity::Displacement, x), channel("torque_ankle", Quantity::Effort, torque)]).expect("channels")
}

fn schedule(cycle_s: Option<f64>, value: impl Fn(f64) -> f64) -> Schedule {
    let values = vec![(0..SAMPLES).map(|k| value(k as f64 / RATE_HZ)).collect()];
    Schedule { words: "the phase of the cycle".to_owned(), unit: String::new(), ends: [0.0, 1.0], cycle_s, values }
}

fn answer(truth: Truth, seed: u64, schedule: Option<Schedule>) -> Diagnosis {
    let ports = Ports { references: vec![], inputs: vec![0], outputs: vec![1] };
    let options = Options { schedule, ..Options::default() };
    diagnose(&[recording(truth, seed)], &ports, &options, None, &mut |_| {}).expect("a diagnosis")
}

fn by_phase(truth: Truth, seed: u64) -> Diagnosis {
    answer(truth, seed, Some(schedule(Some(CYCLE_S), |t| (t / CYCLE_S).fract())))
}

/// How many seeds: `SEEDS`, or so many.
fn seeds(without: u64) -> u64 {
    std::env::var("SEEDS").ok().and_then(|text| text.parse().ok()).unwrap_or(without)
}

fn names(d: &Diagnosis) -> Vec<String> {
    let share = |c: &Cause| format!("{} {:.2}", c.effect, c.gain.explained_fraction.unwrap_or(f64::NAN));
    d.causes.iter().map(share).collect()
}

fn error(score: &ndof_diagnose::Score) -> f64 {
    score.nrmse[0].expect("finite")
}

#[test]
fn a_stiffness_that_follows_the_phase_is_named_first_with_its_curve() {
    for seed in 1..=seeds(4) {
        let d = by_phase(Truth::Varies, seed);
        let first = d.causes.first().expect("a cause");
        assert_eq!(first.effect, "varying-stiffness", "seed {seed}: {:?} {:?}", names(&d), d.considered.first());
        assert!(first.gain.explained_fraction.is_some_and(|share| share > 0.9), "{:?}", names(&d));
        assert!(error(&d.extended.held_out) < error(&d.baseline.held_out));
        let ends: Vec<(f64, [f64; 2])> =
            first.parameters.iter().map(|p| (if let Value::Number(v) = p.value { v } else { f64::NAN }, p.ci95.expect("an interval"))).collect();
        // Half a spread beyond the interval: an extreme is chosen among many places.
        for ((value, [low, high]), truth) in ends.iter().zip([10.0, 70.0]) {
            assert!((value - truth).abs() < 1.5 * (high - low), "{value} ({low} … {high}) for {truth}");
        }
        let curve = &first.over_schedule[0];
        let inside = (0..100).filter(|k| {
            let truth = 40.0 - 30.0 * (TAU * (curve.at[*k] - 0.1)).cos();
            curve.ci95[0][*k] <= truth && truth <= curve.ci95[1][*k]
        });
        assert!(inside.count() > 60, "seed {seed}");
    }
}

#[test]
fn a_reflex_whose_gain_follows_the_phase_is_named_first_with_its_curve() {
    for (truth, one_sided) in [(Truth::VaryingReflex, false), (Truth::VaryingOneSided, true)] {
        let mut within = Vec::new();
        for seed in 1..=seeds(3) {
            let d = by_phase(truth, seed);
            let first = d.causes.first().expect("a cause");
            assert_eq!(first.effect, "varying-reflex", "seed {seed}: {:?} {:?}", names(&d), d.considered.iter().map(|c| &c.effect).take(4).collect::<Vec<_>>());
            assert!(first.gain.explained_fraction.is_some_and(|share| share > 0.9), "{:?}", names(&d));
            let of = |name: &str| first.parameters.iter().find(|p| p.name == name).expect(name);
            assert_eq!(of("one_directional").value, Value::Flag(one_sided));
            // The muscle is written down at the end of the sample that it was driven through: half a sample early.
            // Half a spread beyond the interval, as above.
            for (name, truth) in [("delay_s", 0.038), ("cutoff_hz", 4.0), ("damping_nm_s_per_rad", 2.0), ("gain_least", 0.0), ("gain_greatest", 4.0)] {
                let (Value::Number(value), Some([low, high])) = (&of(name).value, of(name).ci95) else { panic!("{name}") };
                assert!((value - truth).abs() < 1.5 * (high - low), "{name}, seed {seed}: {value} ({low} … {high}) for {truth}");
            }
            let curve = &first.over_schedule[0];
            let inside = (0..100).filter(|k| (curve.ci95[0][*k]..=curve.ci95[1][*k]).contains(&reflex_gain(curve.at[*k]))).count();
            within.push(inside);
        }
        // Places of one curve err together.
        let mean = within.iter().sum::<usize>() as f64 / within.len() as f64;
        assert!(mean > 75.0, "one-sided {one_sided}: {within:?}");
    }
}

#[test]
fn a_reflex_and_a_stiffness_that_follow_the_phase_are_told_apart() {
    for seed in 1..=seeds(2) {
        let d = by_phase(Truth::Both, seed);
        let mut found: Vec<&str> = d.causes.iter().map(|c| c.effect.as_str()).collect();
        found.sort_unstable();
        assert_eq!(found, ["varying-reflex", "varying-stiffness"], "seed {seed}: {:?}", names(&d));
    }
}

#[test]
fn a_damping_that_follows_the_phase_is_no_reflex() {
    for seed in 1..=seeds(2) {
        let d = by_phase(Truth::Damps, seed);
        assert_eq!(d.causes.iter().map(|c| c.effect.as_str()).collect::<Vec<_>>(), ["varying-damping"], "seed {seed}: {:?}", names(&d));
    }
}

#[test]
fn what_is_no_schedule_keeps_its_name() {
    let truths = [
        (Truth::Reflex, "reflex-delay"),
        (Truth::OneSided, "reflex-delay"),
        (Truth::Hysteresis, "hysteresis"),
        (Truth::Softens, "cubic-stiffness"),
        (Truth::Drifts, "stiffness-drift"),
    ];
    for (truth, name) in truths {
        for seed in 1..=seeds(3) {
            let d = by_phase(truth, seed);
            assert_eq!(d.causes.first().map(|c| c.effect.as_str()), Some(name), "seed {seed}: {:?}", names(&d));
            assert!(d.causes.iter().all(|c| !c.effect.starts_with("varying")), "{name}, seed {seed}: {:?}", names(&d));
        }
    }
}

#[test]
fn nothing_hidden_is_no_schedule() {
    let seeds = seeds(6);
    let mut named = Vec::new();
    for seed in 100..100 + seeds {
        let d = by_phase(Truth::Nothing, seed);
        if !d.causes.is_empty() {
            named.push((seed, names(&d)));
        }
    }
    eprintln!("of {seeds} seeds: {named:?}");
    assert!(named.iter().all(|(_, names)| names.iter().all(|name| !name.starts_with("varying"))), "{named:?}");
}

#[test]
fn without_a_schedule_nothing_of_the_kind_is_tried() {
    let d = answer(Truth::Varies, 1, None);
    assert!(d.causes.iter().all(|c| c.over_schedule.is_empty()) && d.considered.iter().all(|c| !c.effect.starts_with("varying")));
}
