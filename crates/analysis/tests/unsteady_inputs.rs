//! Sweeps, bursts and rest: what they do to averages is known, said, and avoided.

use ndof_analysis::{Estimate, Fit, Fitted, MethodName, RoleNames, Trial, Trials, check, estimate};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use std::f64::consts::TAU;

const RATE_HZ: f64 = 200.0;
const SECONDS: f64 = 60.0;
/// kg, N s/m, N/m: 1.9 Hz, a damping ratio of a quarter.
const TRUTH: [f64; 3] = [2.0, 12.0, 300.0];

/// The motion by steps of 0.5 ms of a force that is known at all times, whose error is 1e-5 of the motion, and noise of a share of its size.
fn moved_in(noise: f64, force: &dyn Fn(f64) -> f64, seed: u64) -> Trial {
    let [m, b, k] = TRUTH;
    let (steps, count) = (10, (SECONDS * RATE_HZ) as usize);
    let h = 1.0 / (RATE_HZ * f64::from(steps));
    let slope = |t: f64, x: f64, v: f64| (force(t) - b * v - k * x) / m;
    let (mut x, mut v) = (0.0, 0.0);
    let mut positions = Vec::with_capacity(count);
    for n in 0..count {
        positions.push(x);
        for step in 0..steps {
            let t = n as f64 / RATE_HZ + f64::from(step) * h;
            let (xm, vm) = (x + h / 2.0 * v, v + h / 2.0 * slope(t, x, v));
            (x, v) = (x + h * vm, v + h * slope(t + h / 2.0, xm, vm));
        }
    }
    let size = (positions.iter().map(|x| x * x).sum::<f64>() / count as f64).sqrt();
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let seen: Vec<f64> = positions.iter().map(|x| x + noise * size * Distribution::<f64>::sample(&StandardNormal, &mut rng)).collect();
    let forces: Vec<f64> = (0..count).map(|n| force(n as f64 / RATE_HZ)).collect();
    Trial::new(RATE_HZ).effort("x", forces).displacement("x", seen).expect("a trial")
}

/// The same in noise of a hundredth.
fn moved(force: &dyn Fn(f64) -> f64, seed: u64) -> Trial {
    moved_in(0.01, force, seed)
}

/// 5 N, from 0.3 to 12 Hz.
fn sweep(t: f64) -> f64 {
    5.0 * (TAU * (0.3 * t + 11.7 * t * t / (2.0 * SECONDS))).sin()
}

/// The sum of sines of unrelated frequencies below 12 Hz: neither periodic nor ever at rest.
fn steady(t: f64) -> f64 {
    (1..60).map(|k| (TAU * 0.2 * f64::from(k) * t * (1.0 + 0.01 * f64::from(k).sin()) + f64::from(k * k)).sin()).sum()
}

/// Steps at unrelated times, and nothing in between.
fn steps(t: f64) -> f64 {
    5.0 * f64::from(u8::from((7.3..31.9).contains(&t))) - 3.0 * f64::from(u8::from(t > 44.1))
}

fn codes(trial: &Trial) -> Vec<String> {
    check(std::slice::from_ref(trial), &RoleNames::default()).findings.into_iter().map(|finding| finding.code).collect()
}

fn fitted(trial: &Trial, estimate: &Estimate) -> Fitted {
    Fit::default().run(&estimate.run([trial]).expect("an estimate")).expect("a fit")
}

#[test]
fn a_sweep_is_called_one_and_its_fit_holds_the_truth() {
    let mut held = [0; 3];
    for seed in 0..40 {
        let trial = moved_in(0.05, &sweep, seed);
        let estimated = Estimate::default().run([&trial]).expect("an estimate");
        assert_eq!(estimated.result.method.name, "local-polynomial");
        assert!(estimated.result.method.why.contains("force_x is a sweep"), "{}", estimated.result.method.why);
        let fit = Fit::default().run(&estimated).expect("a fit").result;
        for ((held, p), truth) in held.iter_mut().zip(&fit.parameters).zip(TRUTH) {
            let [low, high] = p.ci95.expect("an interval");
            *held += usize::from((low..=high).contains(&truth));
            assert!(high - low < 0.05 * truth, "{p:?}");
        }
        // Beyond 12 Hz there is nothing to fit.
        assert!(fit.band_hz[1] < 12.5, "{:?}", fit.band_hz);
    }
    // Of 40 with 95 % each, four binomial standard deviations below.
    assert!(held.iter().all(|held| *held >= 32), "{held:?}");
    assert!(codes(&moved(&sweep, 1)).contains(&"sweep".to_owned()));
    // In hardly any noise what polynomials leave of a sweep shows: 8 turns of phase a hertz are few for a window of 13 lines of 1/60 Hz. Their
    // bias is of the fourth power of a quarter, the window's half width over that of the resonance.
    let fit = fitted(&moved_in(0.002, &sweep, 1), &Estimate::default());
    assert!(fit.theta.iter().zip(TRUTH).all(|(found, truth)| (found / truth - 1.0).abs() < 0.25f64.powi(4)), "{:?}", fit.theta);
}

#[test]
fn averages_over_segments_of_a_sweep_say_so_and_know_less() {
    let trial = moved(&sweep, 3);
    let width = |estimate: &Estimate| {
        let fit = fitted(&trial, estimate).result;
        let [low, high] = fit.parameters[2].ci95.expect("an interval");
        assert!((low..=high).contains(&TRUTH[2]), "{low} {high}");
        (high - low, fit.head.warnings.iter().map(|warning| warning.code.clone()).collect::<Vec<_>>())
    };
    let [welch, local] = [MethodName::Welch, MethodName::Auto].map(|method| width(&Estimate { method, ..Estimate::default() }));
    assert!(welch.1.iter().any(|code| *code == "sweep"));
    assert!(welch.0 > local.0, "{} of {}", welch.0, local.0);
}

#[test]
fn steps_are_no_sweep_and_a_steady_input_is_left_as_it_was() {
    let found = codes(&moved(&steps, 1));
    assert!(found.contains(&"unsteady-input".to_owned()) && !found.contains(&"sweep".to_owned()), "{found:?}");
    let why = |trials: &Trials| estimate(trials, &Estimate::default()).expect("an estimate").result.method.why;
    assert!(why(&Trials::of([&moved(&steps, 1)]).expect("roles")).contains("comes and goes"));
    let trials = Trials::of([&moved(&steady, 1)]).expect("roles");
    assert!(!why(&trials).contains("comes and goes"));
    let found = codes(&trials.trials[0]);
    assert!(["sweep", "unsteady-input", "rest"].iter().all(|code| !found.contains(&(*code).to_owned())), "{found:?}");
}

#[test]
fn a_rest_at_the_end_costs_nothing_and_changes_nothing() {
    let trial = moved(&|t| if t < 40.0 { steady(t) } else { 0.0 }, 2);
    let estimated = Estimate::default().run([&trial]).expect("an estimate");
    let left = estimated.trials.trials[0].recording.duration_s();
    // Stretches of a sixteenth of a minute: the first that is whole within the rest begins at 41.25 s.
    assert!((left - 41.25).abs() < 0.01, "{left}");
    let fit = Fit::default().run(&estimated).expect("a fit").result;
    for (p, truth) in fit.parameters.iter().zip(TRUTH) {
        let [low, high] = p.ci95.expect("an interval");
        // Twice the interval: four standard errors.
        assert!((p.value.expect("a number") - truth).abs() < high - low, "{p:?}");
    }
}
