//! Noise on effort and motion alike: the fit that knows of both is unbiased, the plain one is not, and intervals hold.

use crate::support::patient as limb;
use ndof_models::{ErrorsInVariables, InertiaDampingStiffnessModel, PeriodMeans, Symmetry};
use num_complex::Complex64;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;
use std::f64::consts::TAU;

const RATE_HZ: f64 = 128.0;
const PERIOD: usize = 512;
const PERIODS: usize = 16;
const SEEDS: u64 = 200;

/// Lines 0.25 to 10 Hz.
fn lines() -> Vec<usize> {
    (1..=40).collect()
}

/// One period of force and motion of both axes without noise, from the equation of motion: forces of random phases.
fn clean(experiment: u64) -> [Vec<f64>; 4] {
    let mut rng = ChaCha8Rng::seed_from_u64(experiment);
    let mut out = [const { Vec::new() }; 4];
    out.iter_mut().for_each(|c| *c = vec![0.0; PERIOD]);
    for line in lines() {
        let s = Complex64::new(0.0, TAU * line as f64 * RATE_HZ / PERIOD as f64);
        let f = [0, 1].map(|_| Complex64::from_polar(0.8, rng.random_range(0.0..TAU)));
        let (l, (a, b, d)) = (limb(), ([0, 0], [0, 1], [1, 1]));
        let entry = |e: [usize; 2]| l.inertia[e] * s * s + l.damping[e] * s + l.stiffness[e];
        let determinant = entry(a) * entry(d) - entry(b) * entry(b);
        let x = [(entry(d) * f[0] - entry(b) * f[1]) / determinant, (entry(a) * f[1] - entry(b) * f[0]) / determinant];
        for k in 0..PERIOD {
            let turn = Complex64::from_polar(1.0, TAU * (line * k) as f64 / PERIOD as f64);
            for (channel, v) in out.iter_mut().zip([f[0], f[1], x[0], x[1]]) {
                channel[k] += (v * turn).re;
            }
        }
    }
    out
}

/// Periods of both experiments with white noise: 1 N, which both axes share in part, and 8 mm.
fn measured(clean: &[[Vec<f64>; 4]], seed: u64) -> Vec<PeriodMeans> {
    let mut rng = ChaCha8Rng::seed_from_u64(7000 + seed);
    let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
    clean
        .iter()
        .map(|clean| {
            let [mut fx, mut fy, mut x, mut y] = clean.clone().map(|c| c.repeat(PERIODS));
            for (((fx, fy), x), y) in fx.iter_mut().zip(&mut fy).zip(&mut x).zip(&mut y) {
                let shared = 0.6 * normal();
                *fx += shared + 0.8 * normal();
                *fy += shared + 0.8 * normal();
                // The motion's noise follows the force's in part, as under feedback.
                *x += 4e-3 * shared + 8e-3 * normal();
                *y += 8e-3 * normal();
            }
            PeriodMeans::of_periods(RATE_HZ, PERIOD, &[&fx, &fy], &[&x, &y], &lines()).expect("whole periods")
        })
        .collect()
}

/// Fits of one set of records with both noises and with the effort's alone.
struct Answer {
    theta: Vec<f64>,
    held: Vec<bool>,
    plain: Vec<f64>,
    chi2_reduced: f64,
}

#[test]
fn with_noise_on_both_sides_the_fit_is_unbiased_where_the_plain_one_is_not_and_its_intervals_hold() {
    let clean: Vec<[Vec<f64>; 4]> = (0..2).map(clean).collect();
    let model = InertiaDampingStiffnessModel::new(limb().axes, Symmetry::Symmetric);
    let truth = [2.1, -0.55, 1.9, 11.0, -2.0, 15.0, 300.0, -60.0, 520.0];
    let start: Vec<f64> = truth.iter().map(|t| 0.8 * t).collect();
    let settings = ErrorsInVariables { band_hz: [0.2, 10.1] };
    let answers: Vec<Answer> = (0..SEEDS)
        .into_par_iter()
        .map(|seed| {
            let both = measured(&clean, seed);
            let fit = settings.fit(&model, &both, &start).expect("fit");
            let held = fit.parameters.iter().zip(truth).map(|(p, t)| (p.ci95[0]..=p.ci95[1]).contains(&t)).collect();
            // The plain fit believes the motion.
            let mut plain = both;
            plain.iter_mut().flat_map(|e| &mut e.covariance).for_each(|c| (0..16).filter(|e| e / 4 > 1 || e % 4 > 1).for_each(|e| c[e] = Complex64::default()));
            Answer { theta: fit.theta, held, plain: settings.fit(&model, &plain, &start).expect("fit").theta, chi2_reduced: fit.chi2_reduced }
        })
        .collect();
    let count = SEEDS as f64;
    let moments = |of: &dyn Fn(usize) -> f64| {
        let mean = (0..answers.len()).map(of).sum::<f64>() / count;
        (mean, ((0..answers.len()).map(|i| (of(i) - mean).powi(2)).sum::<f64>() / (count - 1.0)).sqrt())
    };
    let mut worst_plain = 0.0f64;
    for (k, t) in truth.iter().enumerate() {
        let (mean, spread) = moments(&|i| answers[i].theta[k]);
        let (plain, plain_spread) = moments(&|i| answers[i].plain[k]);
        let held = answers.iter().filter(|a| a.held[k]).count() as f64 / count;
        let bias = (mean - t) / (spread / count.sqrt());
        let plain_bias = (plain - t) / (plain_spread / count.sqrt());
        println!(
            "{}: {t} found {mean:.4} ± {spread:.4} ({bias:+.1} sigma of the mean), held {:.1} %; plain {plain:.4} ({plain_bias:+.1})",
            model_name(&model, k),
            100.0 * held
        );
        // Four standard errors of the mean; 99.9 % band of 200 trials of 95 %, for nine of them.
        assert!(bias.abs() < 4.0);
        assert!((0.895..=0.995).contains(&held), "{held}");
        worst_plain = worst_plain.max(plain_bias.abs());
    }
    assert!(worst_plain > 20.0, "{worst_plain}");
    let (chi2, spread) = moments(&|i| answers[i].chi2_reduced);
    assert!((chi2 - 1.0).abs() < 4.0 * spread / count.sqrt() + 0.01, "{chi2}");
}

fn model_name(model: &InertiaDampingStiffnessModel, k: usize) -> String {
    use ndof_models::ParametricModel;
    model.parameters()[k].name.clone()
}
