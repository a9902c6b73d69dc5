//! Sweeps, bursts and rest: what they do to averages is known, said, and avoided.

use ndof_analysis::{Estimate, Estimated, Fit, Fitted, MethodName, Question, RoleNames, Trial, Trials, check, estimate};
use ndof_diagnose::Verdict;
use num_complex::Complex64;
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

/// The same limb on a robot of 1 kg that holds it, with a force of its own of 0.3 N whose corner is a hertz: what the robot is told, the force between the two and the
/// motion, by steps of a tenth of a sample.
fn held(told: &dyn Fn(f64) -> f64, seconds: f64, seed: u64) -> Trial {
    let ([m, b, k], [m_r, b_r, k_r]) = (TRUTH, [1.0, 20.0, 300.0]);
    let (steps, count, own) = (10, (seconds * RATE_HZ) as usize, 0.3);
    let h = 1.0 / (RATE_HZ * f64::from(steps));
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut draw = move || Distribution::<f64>::sample(&StandardNormal, &mut rng);
    let (mut x, mut v, mut w) = (0.0, 0.0, 0.0);
    let (mut commands, mut forces, mut places) = (Vec::new(), Vec::new(), Vec::new());
    for n in 0..count {
        let slope = |t: f64, x: f64, v: f64, w: f64| (told(t) + w - (b + b_r) * v - (k + k_r) * x) / (m + m_r);
        let at = n as f64 / RATE_HZ;
        commands.push(told(at));
        forces.push(told(at) - m_r * slope(at, x, v, w) - b_r * v - k_r * x + 0.01 * draw());
        places.push(x + 2e-6 * draw());
        for step in 0..steps {
            let t = at + f64::from(step) * h;
            let (xm, vm) = (x + h / 2.0 * v, v + h / 2.0 * slope(t, x, v, w));
            (x, v) = (x + h * vm, v + h * slope(t + h / 2.0, xm, vm, w));
            let decay = (-TAU * h).exp();
            w = decay * w + own * (1.0 - decay * decay).sqrt() * draw();
        }
    }
    Trial::new(RATE_HZ).command("x", commands).effort("x", forces).displacement("x", places).expect("a trial")
}

/// What sweeps past as the record begins is as smooth in frequency as what every record begins with. Local polynomials leave next to nothing of such a command, and
/// what a limb does by itself then passes for its answer, −1 over the hold.
#[test]
fn a_sweep_that_a_record_of_a_held_limb_begins_with_is_taken_by_tapers() {
    let [m, b, k] = TRUTH;
    // The median error of the response below 1 Hz, as a share of it.
    let missed = |estimated: &Estimated| {
        let response = estimated.best();
        let error = |f: usize| {
            let s = Complex64::new(0.0, TAU * response.frequency_hz[f]);
            (response.value[[f, 0, 0]] * (m * s * s + b * s + k) - 1.0).norm()
        };
        let mut errors: Vec<f64> = response.within([0.2, 1.0]).into_iter().map(error).collect();
        errors.sort_by(f64::total_cmp);
        errors[errors.len() / 2]
    };
    let mut holds = [0; 3];
    for seed in 0..20 {
        let trial = held(&sweep, SECONDS, seed);
        let local = Estimate { method: MethodName::LocalPolynomial, ..Estimate::default() };
        let by_polynomials = missed(&local.run([&trial]).expect("an estimate"));
        let estimated = Estimate::default().run([&trial]).expect("an estimate");
        assert_eq!(estimated.result.method.name, "multitaper", "{}", estimated.result.method.why);
        assert!(missed(&estimated) < 0.5 * by_polynomials, "{by_polynomials} {}", missed(&estimated));
        let fit = Fit::default().run(&estimated).expect("a fit").result;
        for ((holds, p), truth) in holds.iter_mut().zip(&fit.parameters).zip(TRUTH) {
            let [low, high] = p.ci95.expect("an interval");
            *holds += usize::from((low..=high).contains(&truth));
            assert!(high - low < 0.25 * truth, "{p:?}");
        }
    }
    // Of 20 with 95 % each, four binomial standard deviations below.
    assert!(holds.iter().all(|holds| *holds >= 16), "{holds:?}");
    let steady = Estimate::default().run([&held(&steady, SECONDS, 1)]).expect("an estimate");
    assert_eq!(steady.result.method.name, "local-polynomial", "{}", steady.result.method.why);
}

/// Where the sweep has gone beyond what the limb follows, its own force moves it more than the command does, and the hold keeps both small: a free run from the
/// measured force then errs by more than the motion is, as a right model must.
#[test]
fn a_held_out_part_that_a_limb_moves_by_itself_does_not_condemn_the_model() {
    for seed in 0..4 {
        let found = Question::new([&held(&sweep, SECONDS, 100 + seed)]).run().expect("a diagnosis").result.diagnosis;
        let error = found.baseline.held_out.nrmse[0].expect("a free run");
        assert!(error > 1.0 && found.verdict == Verdict::Adequate && found.causes.is_empty(), "{seed}: {error} {:?} {:?}", found.verdict, found.causes);
        assert!(found.discrepancy.notes.iter().any(|note| note.contains("does not judge the model")), "{:?}", found.discrepancy.notes);
    }
}

/// Of two averages no line has a scatter to go by; all lines together have.
#[test]
fn a_few_periods_of_a_multisine_are_fitted() {
    let multisine = |t: f64| (1..100).map(|k| 0.5 * (TAU * 0.1 * f64::from(k) * t + f64::from(k * k)).sin()).sum::<f64>();
    let mut holds = [0; 3];
    for (seed, periods) in (0_u32..20).map(|seed| (u64::from(seed), 3 + seed % 3)) {
        let trial = held(&multisine, f64::from(periods) * 10.0, seed);
        let estimated = Estimate::default().run([&trial]).expect("an estimate");
        let expected = if periods < 5 { "local-polynomial" } else { "periodic" };
        assert_eq!(estimated.result.method.name, expected, "{periods} {}", estimated.result.method.why);
        let fit = Fit::default().run(&estimated).expect("a fit").result;
        for ((holds, p), truth) in holds.iter_mut().zip(&fit.parameters).zip(TRUTH) {
            let [low, high] = p.ci95.expect("an interval");
            *holds += usize::from((low..=high).contains(&truth));
            assert!(high - low < 0.25 * truth, "{periods} {p:?}");
        }
    }
    // Of 20 with 95 % each, four binomial standard deviations below.
    assert!(holds.iter().all(|holds| *holds >= 16), "{holds:?}");
}
