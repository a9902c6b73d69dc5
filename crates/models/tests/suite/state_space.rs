//! Subspace fits of systems that are known.

use ndarray::{Array2, array};
use ndof_models::state_space::{LinearTrial, StateSpace, Subspace, select};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// Two outputs, two inputs, two lightly damped modes.
fn system() -> StateSpace {
    let pole = |radius: f64, angle: f64| [radius * angle.cos(), radius * angle.sin()];
    let ([a, b], [c, d]) = (pole(0.98, 0.2), pole(0.95, 0.7));
    StateSpace {
        a: array![[a, b, 0.0, 0.0], [-b, a, 0.0, 0.0], [0.0, 0.0, c, d], [0.0, 0.0, -d, c]],
        b: array![[1.0, 0.3], [0.0, -0.5], [0.4, 1.0], [0.2, 0.0]],
        c: array![[1.0, 0.0, 0.5, 0.0], [0.0, 0.6, 1.0, 0.3]],
        d: Array2::zeros((2, 2)),
        offset: vec![0.4, -1.0],
    }
}

/// Inputs and outputs, white input, with white noise of `noise` of each output's size.
fn record(samples: usize, noise: f64, seed: u64) -> [Vec<f64>; 4] {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut white = || -> Vec<f64> { (0..samples).map(|_| StandardNormal.sample(&mut rng)).collect() };
    let u = [white(), white()];
    let e = [white(), white()];
    let mut y = system().simulate(&[&u[0], &u[1]], &[0.0; 4]).into_iter();
    let mut noisy = |k: usize| -> Vec<f64> {
        let clean = y.next().expect("two outputs");
        let size = (clean.iter().map(|v| v * v).sum::<f64>() / samples as f64).sqrt();
        clean.iter().zip(&e[k]).map(|(y, e)| y + noise * size * e).collect()
    };
    let (y0, y1) = (noisy(0), noisy(1));
    let [u0, u1] = u;
    [u0, u1, y0, y1]
}

fn trial(r: &[Vec<f64>; 4]) -> LinearTrial<'_> {
    LinearTrial { inputs: vec![&r[0], &r[1]], outputs: vec![&r[2], &r[3]] }
}

#[test]
fn a_system_without_noise_comes_back_exactly() {
    let data = record(1500, 0.0, 1);
    let model = Subspace { past: 8 }.fit(&[trial(&data)], 4).expect("fit");
    for hz in [0.0, 0.03, 0.1, 0.3] {
        let (found, truth) = (model.response(hz, 1.0).expect("no pole"), system().response(hz, 1.0).expect("no pole"));
        for (f, t) in found.iter().flatten().zip(truth.iter().flatten()) {
            // Squared condition of the Gram matrices, with the ridge of 1e-12.
            assert!((f - t).norm() < 1e-5 * truth.iter().flatten().map(|t| t.norm()).fold(0.0, f64::max), "{hz}: {f} {t}");
        }
    }
}

/// Error of the response, as a white input of unit variance sees it at each output, over the variance of the noise there, summed.
fn excess(model: &StateSpace, noise: f64) -> f64 {
    const BINS: usize = 512;
    let mut power = [0.0; 2];
    let mut error = [0.0; 2];
    for k in 0..BINS {
        let hz = 0.5 * (k as f64 + 0.5) / BINS as f64;
        let (found, truth) = (model.response(hz, 1.0).expect("no pole"), system().response(hz, 1.0).expect("no pole"));
        for i in 0..2 {
            error[i] += found[i].iter().zip(&truth[i]).map(|(f, t)| (f - t).norm_sqr()).sum::<f64>();
            power[i] += truth[i].iter().map(|t| t.norm_sqr()).sum::<f64>();
        }
    }
    (0..2).map(|i| error[i] / (noise * noise * power[i])).sum()
}

#[test]
fn noise_leaves_the_modes_where_they_are_and_costs_what_an_efficient_estimate_of_as_many_parameters_costs() {
    const SAMPLES: usize = 8000;
    let (data, held_out) = (record(SAMPLES, 0.1, 2), record(4000, 0.1, 3));
    let found = select(&Subspace { past: 30 }, &[trial(&data)], &[trial(&held_out)], 8, 50).expect("models");
    let model = &found.chosen().model;
    assert_eq!(model.order(), 4, "{:?}", found.candidates.iter().map(|c| c.held_out_nrmse.clone()).collect::<Vec<_>>());
    // What is left of the held-out record is its noise, 0.1 beside 1 of each output; a mode that rings for 50 samples has some 100 independent
    // ones in 3950, so the record's own power is 1 ± 0.14 (one standard deviation).
    for (nrmse, vaf) in found.chosen().held_out_nrmse.iter().zip(&found.chosen().held_out_vaf_percent) {
        let expected = 0.1 / 1.01f64.sqrt();
        assert!((nrmse / expected - 1.0).abs() < 2.0 * 0.14, "{nrmse}");
        assert!(((100.0 - vaf) / (100.0 * expected * expected) - 1.0).abs() < 4.0 * 0.14, "{vaf}");
    }
    // n (m + p) + p m = 20 parameters: χ²₂₀/N of an efficient estimate, 20/N ± 4 √40/N.
    let (parameters, cost) = (20.0, excess(model, 0.1));
    println!("excess {cost:.5} of the noise, an efficient estimate {:.5}", parameters / SAMPLES as f64);
    assert!(cost < (parameters + 4.0 * f64::sqrt(2.0 * parameters)) / SAMPLES as f64, "{cost}");
    // Four states stand out of a noise of a tenth by more than that tenth.
    assert!(found.singular_values[3] > 10.0 * found.singular_values[4], "{:?}", found.singular_values);
    let modes = model.modes(1.0);
    assert!((modes[0][0] - 0.2 / std::f64::consts::TAU).abs() < 1e-3 && (modes[1][0] - 0.7 / std::f64::consts::TAU).abs() < 2e-3, "{modes:?}");
}
