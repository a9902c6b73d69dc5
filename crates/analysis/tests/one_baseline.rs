//! What `fit` finds is what a diagnosis begins from, and a force that is held between its samples is no cause.

use ndof_analysis::{Diagnose, Estimate, Fit, Question, Trial, Trials, diagnose_simulator};
use ndof_diagnose::{ParameterFlag, Verdict};
use ndof_models::Hold;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

const RATE_HZ: f64 = 100.0;
const SAMPLES: usize = 6000;
const FITTED: usize = 4200;

/// 2 kg, 15 N s/m and 500 N/m moved by a force that stays between its samples, by midpoint steps of 0.1 ms; noise of the sensor of 0.5 %.
fn record(seed: u64, sign: f64) -> (Vec<f64>, Vec<f64>) {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let white: Vec<f64> = (0..SAMPLES + 4).map(|_| StandardNormal.sample(&mut random)).collect();
    let force: Vec<f64> = white.windows(4).take(SAMPLES).map(|w| 2.5 * w.iter().sum::<f64>()).collect();
    let slope = |f: f64, x: f64, v: f64| (f - 15.0 * v - 500.0 * x) / 2.0;
    let (mut x, mut v, h) = (0.0, 0.0, 1e-4);
    let mut along = |f: f64| {
        let now = x;
        for _ in 0..100 {
            let (xm, vm) = (x + h / 2.0 * v, v + h / 2.0 * slope(f, x, v));
            (x, v) = (x + h * vm, v + h * slope(f, xm, vm));
        }
        now
    };
    let motion: Vec<f64> = force.iter().map(|f| along(*f)).collect();
    let noise = 0.005 * (motion.iter().map(|x| x * x).sum::<f64>() / SAMPLES as f64).sqrt();
    let seen = motion.iter().map(|x| x + noise * <StandardNormal as Distribution<f64>>::sample(&StandardNormal, &mut random)).collect();
    (force.iter().map(|f| sign * f).collect(), seen)
}

fn trial((force, motion): (&[f64], &[f64])) -> Trial {
    Trial::new(RATE_HZ).effort("x", force).displacement("x", motion).expect("a trial")
}

#[test]
fn a_diagnosis_judges_what_fit_finds_and_half_a_sample_is_no_cause() {
    let (force, motion) = record(11, 1.0);
    let found = Question::new([&trial((&force, &motion))]).run().expect("a diagnosis").result.diagnosis;
    assert_eq!(found.verdict, Verdict::Adequate, "{:?}", found.causes);
    assert!(found.causes.is_empty() && found.extended.parameters == found.baseline.parameters);
    // The same part, the first 70 %, put to `fit`: the same numbers to the last bit.
    let fitted = Fit::default().run(&Estimate::default().run([&trial((&force[..FITTED], &motion[..FITTED]))]).expect("an estimate")).expect("a fit");
    let told: Vec<(&str, f64, Option<f64>)> = found.baseline.parameters.iter().map(|p| (p.name.as_str(), p.value, p.std_error)).collect();
    let there: Vec<(&str, f64, Option<f64>)> = fitted.result.parameters.iter().map(|p| (p.name.as_str(), p.value.unwrap_or(f64::NAN), p.std_error)).collect();
    assert_eq!(told, there);
}

/// How a recording was sampled is told by all of it, where the part that is fitted does not: that is said, and `fit` finds the same with it.
#[test]
fn the_whole_recording_says_how_it_was_sampled() {
    // Noise by which 21 s tell too little now and then, and 30 s enough.
    let mut told = 0;
    for (seed, share) in (0..12).flat_map(|seed| [0.22, 0.28, 0.34].map(|share| (seed, share))) {
        let (force, motion) = record(seed, 1.0);
        let (count, fitted) = (3000, 2100);
        let mut random = ChaCha8Rng::seed_from_u64(100 + seed);
        let size = (motion.iter().map(|x| x * x).sum::<f64>() / SAMPLES as f64).sqrt();
        let seen: Vec<f64> =
            motion[..count].iter().map(|x| x + share * size * <StandardNormal as Distribution<f64>>::sample(&StandardNormal, &mut random)).collect();
        let found = Question::new([&trial((&force[..count], &seen))]).run().expect("a diagnosis").result.diagnosis;
        if !found.discrepancy.notes.iter().any(|note| note.contains("the whole recording shows")) {
            continue;
        }
        told += 1;
        let part = trial((&force[..fitted], &seen[..fitted]));
        let alone = Fit { hold: Some(Hold::Zero), ..Fit::default() }.run(&Estimate::default().run([&part]).expect("an estimate")).expect("a fit");
        let numbers: Vec<f64> = found.baseline.parameters.iter().map(|p| p.value).collect();
        assert_eq!(numbers, alone.result.parameters.iter().map(|p| p.value.unwrap_or(f64::NAN)).collect::<Vec<_>>());
    }
    assert!(told > 0);
}

#[test]
fn a_hold_is_of_the_linear_model_alone() {
    let (force, motion) = record(11, 1.0);
    let trial = trial((&force, &motion));
    let settings = Diagnose { hold: Some(Hold::Zero), ..Diagnose::default() };
    let trials = Trials::of([&trial]).expect("roles");
    let error = diagnose_simulator(&trials, &trials, &settings, &mut |_| {}).expect_err("a simulator stands for the model").to_string();
    assert!(error.contains("hold") && error.contains("simulator"), "{error}");
}

#[test]
fn an_effort_that_was_counted_the_other_way_is_turned_and_said() {
    let (force, motion) = record(11, -1.0);
    let found = Question::new([&trial((&force, &motion))]).run().expect("a diagnosis").result.diagnosis;
    assert!(found.discrepancy.notes.iter().any(|note| note.contains("force-sign")), "{:?}", found.discrepancy.notes);
    assert!(found.baseline.parameters.iter().all(|p| p.value > 0.0), "{:?}", found.baseline.parameters);
}

/// Of one axis of two, by whichever of its channels: its inertia, damping and stiffness would be below zero.
#[test]
fn an_axis_whose_effort_goes_against_its_motion_is_said_and_turned() {
    let [(fx, x), (fy, y)] = [record(11, 1.0), record(12, 1.0)];
    let turned = |series: &[f64]| series.iter().map(|v| -v).collect::<Vec<f64>>();
    let (fy_turned, y_turned) = (turned(&fy), turned(&y));
    let trial = |fx: &[f64], fy: &[f64], x: &[f64], y: &[f64]| {
        let trial = Trial::new(RATE_HZ).effort("x", fx).effort("y", fy).displacement("x", x);
        trial.and_then(|trial| trial.displacement("y", y)).expect("a trial")
    };
    for (fy, y) in [(&fy_turned, &y), (&fy, &y_turned)] {
        let trial = trial(&fx, fy, &x, y);
        let fitted = Fit::default().run(&Estimate::default().run([&trial]).expect("an estimate")).expect("a fit");
        let warnings = &fitted.result.head.warnings;
        assert_eq!(fitted.opposed, ["force_y"]);
        assert!(warnings.iter().any(|w| w.code == "force-sign" && w.message.contains("force_y")) && warnings.iter().all(|w| w.code != "negative-diagonal"));
        let found = Question::new([&trial]).run().expect("a diagnosis").result.diagnosis;
        assert_eq!((found.verdict, found.causes.len()), (Verdict::Adequate, 0), "{:?}", found.causes);
        assert!(found.discrepancy.notes.iter().any(|note| note.contains("force-sign") && note.contains("force_y")), "{:?}", found.discrepancy.notes);
        for name in ["M_x_x", "M_y_y", "K_y_y"] {
            assert!(found.baseline.parameters.iter().any(|p| p.name == name && p.value > 0.0), "{name}");
        }
    }
}

/// Two motions that stand in each other's place, of axes without a coupling and of axes whose inertias, dampings and stiffnesses between them are negative: no
/// body's matrices, no effort that was turned, and no name that is sure.
#[test]
fn beside_matrices_of_no_body_no_name_is_sure() {
    let [(fx, x), (fy, y)] = [record(11, 1.0), record(12, 1.0)];
    for (between, flag) in [(0.0, ParameterFlag::OfNoBody), (-0.4, ParameterFlag::BelowZero)] {
        // With x = q_x + c q_y and y = s q_y, s² = 1 - c², 2 kg along x and y is 2 kg along q_x and q_y and 2 c kg between them.
        let (c, s) = (between, f64::sqrt(1.0 - between * between));
        let mixed = |a: &[f64], b: &[f64], [along, across]: [f64; 2]| a.iter().zip(b).map(|(a, b)| along * a + across * b).collect::<Vec<f64>>();
        let trial = Trial::new(RATE_HZ).effort("x", &*fx).effort("y", mixed(&fx, &fy, [c, s]));
        let trial = trial.displacement("x", mixed(&x, &y, [0.0, 1.0 / s])).and_then(|trial| trial.displacement("y", mixed(&x, &y, [1.0, -c / s])));
        let trial = trial.expect("a trial");
        let fitted = Fit::default().run(&Estimate::default().run([&trial]).expect("an estimate")).expect("a fit");
        assert!(fitted.result.head.warnings.iter().all(|w| w.code != "force-sign"), "{:?}", fitted.result.head.warnings);
        let found = Question::new([&trial]).run().expect("a diagnosis").result.diagnosis;
        assert!(found.discrepancy.notes.iter().all(|note| !note.contains("force-sign")), "{:?}", found.discrepancy.notes);
        assert!(found.baseline.parameters.iter().any(|p| p.flag == Some(flag)), "{:?}", found.baseline.parameters);
        assert!(found.causes.iter().all(|cause| cause.probability <= 0.6) && found.verdict != Verdict::Explained, "{:?}", found.causes);
    }
}
