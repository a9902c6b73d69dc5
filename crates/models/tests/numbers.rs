//! Whole results of fits, number by number, as they were when they were last looked at.
//!
//! `reference/numbers/` holds them for two axes in frequency, every block and every law, noise on both sides and state-space models.
//! Whether they are right the other files ask. A change is to be looked at; `NDOF_WRITE_NUMBERS=1 cargo test --release -p ndof-models --test
//! numbers` writes it anew.

#[path = "../../../tests/support/stored.rs"]
mod stored;

use ndarray::{Array2, Array3, arr2};
use ndof_models::blocks::{BLOCKS, Composite, find};
use ndof_models::physical::{ellipse, fitted_modes, passivity, symmetry_test, unit_matrices};
use ndof_models::state_space::{LinearTrial, Subspace, select};
use ndof_models::time::{Causality, Disturbance, FreeRunFit, Mechanism, Noise, TimeTrial, laws, simulate};
use ndof_models::{
    Arm, Axis, CovarianceKind, ErrorsInVariables, Fit, InertiaDampingStiffness, InertiaDampingStiffnessModel, Kinematics, KinematicsSd, LoopModel, PaperFit,
    PeriodSpectra, Projection, Smoothing, Symmetry, Transducer, WeightedFit, agreement, likelihood_ratio, linear_start,
};
use ndof_signal::Kernel;
use ndof_sysid::{FrequencyResponse, ResponseKind, Uncertainty};
use num_complex::Complex64;
use rayon::prelude::*;
use serde_json::{Value, json};
use std::f64::consts::TAU;
use std::ops::RangeBounds;
use stored::{held, nudge};

/// By how much numbers may differ: searches stop at some 1e-6 of a parameter, wherever round-off leads them.
const RELATIVE: f64 = 1e-4;

/// Numbers between −1 and 1 that look like noise.
fn noise(number: usize, seed: f64) -> f64 {
    let x = (12.9898 * number as f64 + 78.233 * seed).sin() * 43758.5453;
    (2.0 * (x - x.floor()) - 1.0) * nudge(number)
}

fn limb() -> InertiaDampingStiffness {
    let matrix = |k, xx: f64, xy: f64, yy: f64| arr2(&[[xx * nudge(k), xy * nudge(k + 1)], [xy * nudge(k + 1), yy * nudge(k + 2)]]);
    InertiaDampingStiffness {
        axes: vec![Axis::linear("x"), Axis::linear("y")],
        inertia: matrix(1, 2.1, -0.55, 1.9),
        damping: matrix(4, 26.0, -4.0, 30.0),
        stiffness: matrix(7, 300.0, -60.0, 420.0),
    }
}

/// The limb's compliance as an estimate with few degrees of freedom has it, seen through three frequencies.
fn response() -> FrequencyResponse {
    let grid: Vec<f64> = (0..40).map(|k| 0.25 * k as f64).collect();
    let mut response = limb().response(&grid, ResponseKind::Compliance);
    let (n, mut at) = (grid.len(), 0);
    let mut draw = || {
        at += 1;
        noise(at, 1.0)
    };
    let mut hermitian = |size: f64| -> Array3<Complex64> {
        let mut all = Array3::zeros((n, 2, 2));
        for f in 0..n {
            let (a, b) = (size * (1.0 + 0.3 * draw()), size * (1.5 + 0.3 * draw()));
            let cross = 0.4 * size * Complex64::new(draw(), draw());
            (all[[f, 0, 0]], all[[f, 1, 1]], all[[f, 0, 1]], all[[f, 1, 0]]) = (a.into(), b.into(), cross, cross.conj());
        }
        all
    };
    let (output, input_inverse) = (hermitian(4e-9), hermitian(1.0));
    response.value.iter_mut().for_each(|v| *v += 4e-5 * Complex64::new(draw(), draw()));
    let kernel = Kernel { offset_hz: vec![-0.2, 0.0, 0.2], weight: vec![0.25, 0.5, 0.25] };
    response.uncertainty = Some(Uncertainty { noise: output, input_inverse, degrees_of_freedom: 12.0, independent_spacing_hz: 0.4, kernel, inverted: false });
    response
}

fn band(settings: WeightedFit) -> WeightedFit {
    WeightedFit { band_hz: [0.5, 8.0], ..settings }
}

fn complex(values: impl IntoIterator<Item = Complex64>) -> Vec<[f64; 2]> {
    values.into_iter().map(|v| [v.re, v.im]).collect()
}

fn in_frequency() -> Value {
    let response = response();
    let weight = Array3::from_shape_fn(response.value.dim(), |(f, i, j)| 0.9 - 0.01 * f as f64 - 0.1 * (i + 2 * j) as f64 / 3.0);
    let fits: Vec<Value> = [Symmetry::Symmetric, Symmetry::Free, Symmetry::PositiveSemidefinite]
        .into_par_iter()
        .map(|symmetry| {
            let model = InertiaDampingStiffnessModel::new(limb().axes, symmetry);
            let start = linear_start(&model, &response.band(0.5, 8.0)).expect("a start");
            let settings = band(WeightedFit::default());
            let plain = settings.fit(&model, &response, &start).expect("a fit");
            let sandwich = WeightedFit { covariance: CovarianceKind::Sandwich, ..band(WeightedFit::default()) }.fit(&model, &response, &start);
            let transducer = Some(Transducer { stiffness: 1e5, damping: 80.0 });
            let given = WeightedFit { transducer, smoothing: Smoothing::None, ..band(WeightedFit::default()) }.fit(&model, &response, &start);
            let paper = PaperFit { band_hz: [0.5, 8.0] }.fit(&model, &response, &weight, &start).expect("a fit");
            let fitted = model.matrices(&plain.theta);
            let first = plain.theta.len() - if symmetry == Symmetry::Free { 4 } else { 3 };
            let of_stiffness = Array2::from_shape_fn((plain.theta.len() - first, plain.theta.len() - first), |(i, j)| plain.covariance[[first + i, first + j]]);
            let projection = Projection {
                kinematics: Kinematics::planar_two_link(Arm::Right, [0.3, 0.33], [0.7, 1.4]).expect("an arm"),
                mean_force_n: vec![1.5, -0.8],
                sd: KinematicsSd::default(),
            };
            let joints = projection.fit_to_joints(&model, &plain).expect("joints");
            let turned = projection.response_to_joints(&response).expect("joints");
            let late = Composite::of_cards(&model, &[find("delay").expect("a delay")]);
            let late = settings.fit_from(&late, &response, &late.starts(&start)).expect("a fit");
            json!({
                "start": start,
                "with a delay": late.parameters,
                "plain": plain,
                "sandwich": sandwich.expect("a fit"),
                "with a transducer, unsmoothed": given.expect("a fit"),
                "paper": paper,
                "symmetry": symmetry_test(&model, &plain),
                "passivity": passivity(&model, &plain),
                "ellipse": ellipse(&fitted.stiffness, &unit_matrices(symmetry != Symmetry::Free), &of_stiffness, 2.0),
                "modes": fitted_modes(&model, &plain.theta, &plain.covariance, 2.0),
                "agreement": agreement(&response, &fitted.response(&response.frequency_hz, ResponseKind::Compliance), &weight, [0.5, 8.0]).expect("one shape"),
                "joints": joints,
                "at the joints": complex(turned.value.iter().copied().step_by(7)),
                "and back": complex(projection.response_to_endpoint(&turned, &limb().axes).expect("a hand").value.iter().copied().step_by(7)),
            })
        })
        .collect();
    json!(fits)
}

/// Every block added to one axis of the limb.
fn blocks() -> Value {
    let response = response();
    let model = InertiaDampingStiffnessModel::new(limb().axes, Symmetry::Symmetric);
    let settings = band(WeightedFit::default());
    let start = linear_start(&model, &response.band(0.5, 8.0)).expect("a start");
    let plain = settings.fit(&model, &response, &start).expect("a fit");
    let fits: Vec<Value> = BLOCKS
        .par_iter()
        .map(|card| {
            let larger = Composite::of_cards(&model, &[card]);
            let starts = larger.starts(&start);
            match settings.fit_from(&larger, &response, &starts) {
                // Where the data say nothing of a block its parameters end anywhere.
                Ok(fit) => json!({ "block": card.name(), "starts": starts, "chi2": fit.chi2, "bins": fit.bins, "ratio": likelihood_ratio(&plain, &fit).statistic,
                    "sensor": card.is_sensor(), "at the starts": starts.iter().map(|s| complex(settings.seen(&larger, s, ResponseKind::Compliance, &[1.3, 4.7], &Kernel::default()))).collect::<Vec<_>>() }),
                Err(error) => json!({ "block": card.name(), "starts": starts, "refused": error.to_string() }),
            }
        })
        .collect();
    json!(fits)
}

const RATE_HZ: f64 = 200.0;

fn force() -> Vec<f64> {
    (0..1000).map(|k| (0..12).map(|l| (TAU * (0.3 + 0.71 * f64::from(l)) * k as f64 / RATE_HZ + f64::from(l * l)).sin()).sum::<f64>()).collect()
}

/// Laws with orders of magnitude for their parameters, simulated, and fitted to what came out.
fn in_time(which: impl RangeBounds<usize>) -> Value {
    let force = force();
    let of = |law: &std::sync::Arc<dyn ndof_models::time::Law>| {
        let mechanism = Mechanism::new(vec![Axis::linear("x")]).with_law(law.clone(), 0);
        let truth = mechanism.starts(&[2.0, 14.0, 300.0]).swap_remove(0);
        let still = vec![0.0; 2];
        let motion = simulate(&mechanism, &truth, &still, &[&force], RATE_HZ, 2).swap_remove(0);
        let motion: Vec<f64> = motion.iter().enumerate().map(|(k, x)| x + 1e-4 * noise(k, 3.0)).collect();
        let trial = TimeTrial { force: vec![&force], motion: vec![&motion], velocity: vec![] };
        let settings = FreeRunFit { substeps: 2, ..FreeRunFit::new(RATE_HZ) };
        let score = settings.validate(&mechanism, &truth, std::slice::from_ref(&trial));
        let fit = settings.fit(&mechanism, &[trial], &truth);
        json!({
            "law": law.name(),
            "truth": truth,
            "motion": motion.iter().step_by(83).collect::<Vec<_>>(),
            "score": score.ok(),
            "fit": fit.map(|f| json!({ "score": f.score, "bic": f.bic })).map_err(|error| error.to_string()).ok(),
        })
    };
    let mut laws = laws::all();
    json!(laws.drain(which).collect::<Vec<_>>().par_iter().map(of).collect::<Vec<Value>>())
}

/// The ways of fitting in time, on a limb without a law and on one with a threshold.
fn ways() -> Value {
    let force = force();
    let linear = Mechanism::new(vec![Axis::linear("x")]);
    let truth = [2.0, 14.0, 300.0];
    let motion = simulate(&linear, &truth, &[0.0, 0.0], &[&force], RATE_HZ, 1).swap_remove(0);
    let slow = |k: usize| (0..40).map(|l| noise(k.saturating_sub(l), 5.0)).sum::<f64>() / 40.0;
    let motion: Vec<f64> = motion.iter().enumerate().map(|(k, x)| x + 1e-4 * noise(k, 4.0) + 3e-4 * slow(k)).collect();
    let velocity: Vec<f64> = motion.windows(2).map(|pair| (pair[1] - pair[0]) * RATE_HZ).chain([0.0]).collect();
    let trial = || TimeTrial { force: vec![&force], motion: vec![&motion], velocity: vec![] };
    let fresh = || FreeRunFit::new(RATE_HZ);
    let ways = [
        ("blocks", fresh()),
        ("white", FreeRunFit { noise: Noise::Autoregressive(0), ..fresh() }),
        ("autoregressive", FreeRunFit { noise: Noise::Autoregressive(5), ..fresh() }),
        ("laguerre", FreeRunFit { noise: Noise::Laguerre { order: 6, memory: 5 }, ..fresh() }),
        ("a force of the limb", FreeRunFit { noise: Noise::Laguerre { order: 6, memory: 5 }, disturbance: Disturbance::Force, ..fresh() }),
        ("windows", FreeRunFit { window_s: Some(1.0), ..fresh() }),
        ("settled", FreeRunFit { settle_s: 0.5, ..fresh() }),
        ("low-passed", FreeRunFit { output_low_pass_hz: Some(12.0), ..fresh() }),
        ("motion in", FreeRunFit { causality: Causality::MotionIn, motion_low_pass_hz: Some(20.0), ..fresh() }),
    ];
    let start = [1.6, 18.0, 260.0];
    let fits = ways.par_iter().map(|(name, settings)| {
        let fit = settings.fit(&linear, &[trial()], &start).map_err(|error| error.to_string());
        let profile = fit.as_ref().ok().map(|fit| settings.profile(&linear, &[trial()], fit, 1).map_err(|error| error.to_string()));
        json!({ "way": name, "fit": fit, "profile": profile })
    });
    let with_velocity = FreeRunFit { causality: Causality::MotionIn, ..fresh() }.fit(&linear, &[TimeTrial { velocity: vec![&velocity], ..trial() }], &start);
    json!([fits.collect::<Vec<Value>>(), with_velocity.map_err(|error| error.to_string())])
}

fn periods() -> Value {
    let (rate, period, lines) = (128.0, 256, [1, 2, 3, 5, 7, 9, 12, 15]);
    let limb = limb();
    let experiment = |number: usize| {
        let mut channels = vec![vec![0.0; 6 * period]; 4];
        for &line in &lines {
            let s = Complex64::new(0.0, TAU * line as f64 * rate / period as f64);
            let force = [0, 1].map(|axis| Complex64::from_polar(1.0, 40.0 * noise(line + 50 * axis, number as f64)));
            let z = |i: usize, j: usize| limb.inertia[[i, j]] * s * s + limb.damping[[i, j]] * s + limb.stiffness[[i, j]];
            let determinant = z(0, 0) * z(1, 1) - z(0, 1) * z(1, 0);
            let motion = [(z(1, 1) * force[0] - z(0, 1) * force[1]) / determinant, (z(0, 0) * force[1] - z(1, 0) * force[0]) / determinant];
            for (channel, line_of) in channels.iter_mut().zip([force[0], force[1], motion[0], motion[1]]) {
                channel.iter_mut().enumerate().for_each(|(k, x)| *x += (line_of * Complex64::cis(TAU * (line * k) as f64 / period as f64)).re);
            }
        }
        for (c, channel) in channels.iter_mut().enumerate() {
            let size = if c < 2 { 0.3 } else { 1e-3 };
            channel.iter_mut().enumerate().for_each(|(k, x)| *x += size * noise(k + 7000 * c, 8.0 + number as f64));
        }
        PeriodSpectra::of_periods(rate, period, &[&channels[0], &channels[1]], &[&channels[2], &channels[3]], &lines).expect("whole periods")
    };
    let model = InertiaDampingStiffnessModel::new(limb.axes.clone(), Symmetry::Symmetric);
    let fit = ErrorsInVariables { band_hz: [0.3, 8.0] }.fit(&model, &[experiment(1), experiment(2)], &model.theta(&limb));
    json!(fit.map_err(|error| error.to_string()))
}

fn states() -> Value {
    let inputs: Vec<Vec<f64>> = (0..2).map(|c| (0..600).map(|k| noise(k, 20.0 + f64::from(c))).collect()).collect();
    let mut state = [0.0; 4];
    let mut outputs = vec![Vec::new(); 2];
    for (k, u) in inputs[0].iter().zip(&inputs[1]).enumerate() {
        outputs[0].push(state[0] + 0.5 * state[2] + 0.02 * noise(k, 30.0) + 0.4);
        outputs[1].push(0.6 * state[1] + state[2] + 0.3 * state[3] + 0.02 * noise(k, 31.0) - 1.0);
        let (u, x) = ([*u.0, *u.1], state);
        state = [
            0.96 * x[0] + 0.19 * x[1] + u[0] + 0.3 * u[1],
            -0.19 * x[0] + 0.96 * x[1] - 0.5 * u[1],
            0.73 * x[2] + 0.61 * x[3] + 0.4 * u[0] + u[1],
            -0.61 * x[2] + 0.73 * x[3] + 0.2 * u[0],
        ];
    }
    let part =
        |from: usize, to: usize| LinearTrial { inputs: inputs.iter().map(|c| &c[from..to]).collect(), outputs: outputs.iter().map(|c| &c[from..to]).collect() };
    let found = select(&Subspace { past: 8 }, &[part(0, 250), part(250, 450)], &[part(450, 600)], 6, 20).expect("a model");
    let candidates = found.candidates.iter().map(|candidate| {
        let response = |hz: f64| complex(candidate.model.response(hz, 50.0).expect("no pole").into_iter().flatten());
        json!([candidate.model.order(), candidate.held_out_nrmse, candidate.held_out_vaf_percent, response(0.0), response(2.0), response(9.0)])
    });
    json!({
        "best": found.best,
        "singular values": found.singular_values,
        "modes": found.chosen().model.modes(50.0),
        "offset": found.chosen().model.offset,
        "candidates": candidates.collect::<Vec<_>>(),
    })
}

/// Three axes, no two entries alike.
fn three() -> InertiaDampingStiffness {
    let matrix = |size: f64, k: usize| {
        Array2::from_shape_fn((3, 3), |(i, j)| {
            nudge(k + 3 * i.min(j) + i.max(j)) * size * if i == j { 1.0 + 0.2 * i as f64 } else { 0.04 * (i + 2 * j).min(j + 2 * i) as f64 - 0.1 }
        })
    };
    InertiaDampingStiffness {
        axes: ["x", "y", "z"].map(Axis::linear).to_vec(),
        inertia: matrix(2.0, 1),
        damping: matrix(26.0, 20),
        stiffness: matrix(320.0, 40),
    }
}

/// Their compliance with errors and a covariance of the estimate, another one by the seed.
fn response_of_three(seed: f64) -> FrequencyResponse {
    let grid: Vec<f64> = (0..24).map(|k| 0.4 * k as f64).collect();
    let mut response = three().response(&grid, ResponseKind::Compliance);
    let (n, mut at) = (grid.len(), 0);
    let mut draw = || {
        at += 1;
        noise(at, seed)
    };
    let mut hermitian = |size: f64| -> Array3<Complex64> {
        let mut all = Array3::zeros((n, 3, 3));
        for f in 0..n {
            for i in 0..3 {
                all[[f, i, i]] = (size * (1.0 + 0.3 * i as f64 + 0.2 * draw())).into();
                for j in 0..i {
                    let cross = 0.25 * size * Complex64::new(draw(), draw());
                    (all[[f, i, j]], all[[f, j, i]]) = (cross, cross.conj());
                }
            }
        }
        all
    };
    let (output, input_inverse) = (hermitian(4e-9), hermitian(1.0));
    response.value.iter_mut().for_each(|v| *v += 4e-5 * Complex64::new(draw(), draw()));
    let kernel = Kernel { offset_hz: vec![-0.3, 0.0, 0.3], weight: vec![0.25, 0.5, 0.25] };
    response.uncertainty = Some(Uncertainty { noise: output, input_inverse, degrees_of_freedom: 14.0, independent_spacing_hz: 0.6, kernel, inverted: false });
    response
}

/// The same for three axes, whose squares are no doubles, and with trials that disagree.
fn three_axes() -> Value {
    let (response, without) = (response_of_three(11.0), [12.0, 13.0, 14.0, 15.0].map(response_of_three));
    let held_by = LoopModel { impedance: InertiaDampingStiffness { inertia: three().inertia * 0.4, damping: three().damping * 0.2, ..three() } };
    let weight = Array3::from_shape_fn(response.value.dim(), |(f, i, j)| 0.9 - 0.01 * f as f64 - 0.1 * (i + 2 * j) as f64 / 3.0);
    let unknown = FrequencyResponse { uncertainty: None, ..response.clone() };
    let few = |degrees_of_freedom: f64| {
        let uncertainty = response.uncertainty.clone().map(|u| Uncertainty { degrees_of_freedom, ..u });
        FrequencyResponse { uncertainty, ..response.clone() }
    };
    let fits: Vec<Value> = [Symmetry::Symmetric, Symmetry::Free, Symmetry::PositiveSemidefinite]
        .into_par_iter()
        .map(|symmetry| {
            let model = InertiaDampingStiffnessModel::new(three().axes, symmetry);
            let start = linear_start(&model, &response.band(0.5, 8.0)).expect("a start");
            let with = |settings: WeightedFit| band(settings).fit(&model, &response, &start).expect("a fit");
            let transducer = Some(Transducer { stiffness: 1e5, damping: 80.0 });
            let plain = with(WeightedFit::default());
            let paper = PaperFit { band_hz: [0.5, 8.0] };
            let muscles = Composite::of_cards(&model, &[find("reflex").expect("a reflex"), find("delay").expect("a delay")]);
            let at = muscles.starts(&start).swap_remove(0);
            let seen = [ResponseKind::Compliance, ResponseKind::Impedance, ResponseKind::Admittance].map(|kind| complex(band(WeightedFit { transducer, ..WeightedFit::default() }).seen(&muscles, &at, kind, &[1.3, 4.7], &Kernel::default())));
            json!({
                "start": start,
                "without a covariance": linear_start(&model, &unknown).expect("a start"),
                "plain": short(&plain),
                "sandwich": short(&with(WeightedFit { covariance: CovarianceKind::Sandwich, transducer, ..WeightedFit::default() })),
                "derived in a loop": short(&with(WeightedFit { smoothing: Smoothing::Derived(held_by.clone()), transducer, ..WeightedFit::default() })),
                "direct in a loop": short(&with(WeightedFit { smoothing: Smoothing::Direct(held_by.clone()), ..WeightedFit::default() })),
                "few degrees": short(&band(WeightedFit::default()).fit(&model, &few(6.0), &start).expect("a fit")),
                "just enough": short(&band(WeightedFit::default()).fit(&model, &few(7.0), &start).expect("a fit")),
                "by trials": short(&band(WeightedFit::default()).fit_trials(&model, &response, &without, &start).expect("a fit")),
                "paper": short(&paper.fit(&model, &response, &weight, &start).expect("a fit")),
                "paper without a covariance": short(&paper.fit(&model, &unknown, &weight, &start).expect("a fit")),
                "paper by trials": short(&paper.fit_trials(&model, &response, &without, &weight, &start).expect("a fit")),
                "symmetry": symmetry_test(&model, &plain),
                "passivity": passivity(&model, &plain),
                "modes": fitted_modes(&model, &plain.theta, &plain.covariance, 2.0),
                "agreement": agreement(&response, &model.matrices(&plain.theta).response(&response.frequency_hz, ResponseKind::Compliance), &weight, [0.5, 8.0]).expect("one shape"),
                "seen": seen,
                "with blocks": settings_of(&response, &muscles, &at),
            })
        })
        .collect();
    json!(fits)
}

/// What a fit comes to, without the covariance.
fn short(fit: &Fit) -> Value {
    let errors: Vec<f64> = fit.parameters.iter().map(|p| p.std_error).collect();
    json!([fit.theta, errors, fit.chi2, fit.degrees_of_freedom, fit.condition, fit.interval_quantile, fit.covariance_scale])
}

/// χ² of a model with blocks where its search ends; its parameters may end anywhere.
fn settings_of(response: &FrequencyResponse, model: &Composite, start: &[f64]) -> Value {
    band(WeightedFit::default()).fit(model, response, start).map_or_else(|error| json!(error.to_string()), |fit| json!([fit.chi2, fit.bins]))
}

/// Two axes with laws on the second: runs, fits by every causality and the noise that a limb makes.
fn two_axes() -> Value {
    let force: Vec<Vec<f64>> = (0..2).map(|a| force().into_iter().skip(170 * a).take(260).collect()).collect();
    let limb = || Mechanism::new(vec![Axis::linear("x"), Axis::linear("y")]);
    let base = [2.1, -0.3, 1.7, 17.0, -2.0, 21.0, 330.0, -40.0, 410.0];
    let fresh = || FreeRunFit { substeps: 2, ..FreeRunFit::new(RATE_HZ) };
    let windows = || FreeRunFit { window_s: Some(0.4), settle_s: 0.05, noise: Noise::Autoregressive(2), ..fresh() };
    let motion_in = || FreeRunFit { causality: Causality::MotionIn, motion_low_pass_hz: Some(20.0), ..fresh() };
    let force_of_limb = || FreeRunFit { disturbance: Disturbance::Force, noise: Noise::Laguerre { order: 2, memory: 5 }, ..fresh() };
    let mechanisms = [
        ("reflex", limb().with(laws::LinearReflex, 1), windows()),
        ("slip", limb().with(laws::CubicStiffness, 0).with(laws::MaxwellSlip, 1), motion_in()),
        ("one direction", limb().with(laws::OneDirectionalReflex { positive: false }, 0), motion_in()),
        ("stop", limb().with_offset().with(laws::EndStop { positive: false }, 1), fresh()),
        ("loop", Mechanism { trend: true, ..limb() }.with(laws::BoucWen, 0), motion_in()),
        ("low-passed", limb(), FreeRunFit { output_low_pass_hz: Some(12.0), settle_s: 0.1, window_s: Some(0.5), ..fresh() }),
        ("without", limb(), force_of_limb()),
    ];
    let of = |(name, mechanism, settings): &(&str, Mechanism, FreeRunFit)| {
        let mut base = base.to_vec();
        base.extend(std::iter::repeat_n(0.4, mechanism.baseline_parameters() - base.len()));
        let truth = mechanism.starts(&base).swap_remove(0);
        let force: Vec<&[f64]> = force.iter().map(Vec::as_slice).collect();
        // A limb that pushes by itself, where that is looked for.
        let own = |a: usize, k: usize| (0..15).map(|l| 2.0 * noise(k.saturating_sub(l), 55.0 + a as f64)).sum::<f64>() / 15.0;
        let pushed: Vec<Vec<f64>> = if settings.disturbance == Disturbance::Force {
            force.iter().enumerate().map(|(a, f)| f.iter().enumerate().map(|(k, f)| f + own(a, k)).collect()).collect()
        } else {
            force.iter().map(|f| f.to_vec()).collect()
        };
        let run = simulate(mechanism, &truth, &[2e-3, -1e-3, 0.03, 0.01], &pushed.iter().map(Vec::as_slice).collect::<Vec<_>>(), RATE_HZ, 2);
        let noisy = |(a, x): (usize, &Vec<f64>)| -> Vec<f64> { x.iter().enumerate().map(|(k, x)| x + 1e-4 * noise(k, 50.0 + a as f64)).collect() };
        let motion: Vec<Vec<f64>> = run.iter().enumerate().map(noisy).collect();
        let trial = TimeTrial { force, motion: motion.iter().map(Vec::as_slice).collect(), velocity: vec![] };
        let start: Vec<f64> = truth.iter().enumerate().map(|(k, v)| v * (1.0 + 0.02 * noise(k, 60.0))).collect();
        let fit = settings.fit(mechanism, &[trial], &start).map(|f| json!({ "score": f.score, "bic": f.bic, "noise": f.limb_noise }));
        json!({
            "mechanism": name,
            "motion": run.iter().map(|x| x.iter().step_by(53).copied().collect::<Vec<_>>()).collect::<Vec<_>>(),
            "fit": fit.map_err(|error| error.to_string()),
        })
    };
    json!(mechanisms.par_iter().map(of).collect::<Vec<Value>>())
}

/// Profiles of thresholds: ends that are bent, closed by a bound, or open.
fn profiles() -> Value {
    let force: Vec<f64> = force().into_iter().take(500).collect();
    let limb = || Mechanism::new(vec![Axis::linear("x")]);
    let cases = [
        ("friction", limb().with(laws::Coulomb { turn_velocity: 1e-3 }, 0), vec![0.3]),
        ("little friction", limb().with(laws::Coulomb { turn_velocity: 1e-3 }, 0), vec![0.01]),
        ("gap", limb().with(laws::DeadZone, 0), vec![200.0, 4e-3]),
        ("stop that is hardly met", limb().with(laws::EndStop { positive: true }, 0), vec![400.0, 0.022]),
        ("play", limb().with(laws::Backlash, 0), vec![150.0, 2e-3]),
        ("hardening", limb().with(laws::CubicStiffness, 0), vec![1e5]),
    ];
    let of = |(name, mechanism, own): &(&str, Mechanism, Vec<f64>)| {
        let truth: Vec<f64> = [2.0, 14.0, 300.0].iter().chain(own).copied().collect();
        let motion = simulate(mechanism, &truth, &[0.0; 2], &[&force], RATE_HZ, 2).swap_remove(0);
        let motion: Vec<f64> = motion.iter().enumerate().map(|(k, x)| x + 4e-4 * noise(k, 70.0)).collect();
        let trials = [TimeTrial { force: vec![&force], motion: vec![&motion], velocity: vec![] }];
        let settings = FreeRunFit { noise: Noise::Autoregressive(0), substeps: 2, ..FreeRunFit::new(RATE_HZ) };
        let Ok(fit) = settings.fit(mechanism, &trials, &truth) else { return json!(name) };
        let last = truth.len() - 1;
        let near: Vec<f64> = truth.iter().enumerate().map(|(k, v)| if k == last { 1.02 * v } else { *v }).collect();
        let far: Vec<f64> = truth.iter().enumerate().map(|(k, v)| if k == last { 1.9 * v } else { *v }).collect();
        let holds = [&near, &far].map(|theta| settings.holds(mechanism, &trials, &fit, last, theta).expect("a search"));
        let open = |v: f64| if v.is_finite() { json!(v) } else { json!(v.to_string()) };
        let profiled = settings.profiled(mechanism, &trials, fit.clone()).expect("profiles");
        json!({
            "case": name,
            "theta": fit.theta,
            "profile": settings.profile(mechanism, &trials, &fit, last).expect("a profile").map(open),
            "holds": holds,
            "profiled": profiled.profiled,
            "intervals": profiled.parameters.iter().map(|p| json!([p.ci95.map(open), p.identifiable])).collect::<Vec<_>>(),
        })
    };
    json!(cases.par_iter().map(of).collect::<Vec<Value>>())
}

fn periods_of_three() -> Value {
    let (rate, period, lines) = (64.0, 128, [1, 2, 3, 5, 7, 9, 12, 15]);
    let experiment = |number: usize| {
        let mut channels = vec![vec![0.0; 9 * period]; 6];
        let compliance = three().response(&lines.map(|l| l as f64 * rate / period as f64), ResponseKind::Compliance);
        for (f, line) in lines.into_iter().enumerate() {
            let force = [0, 1, 2].map(|axis| Complex64::from_polar(1.0, 40.0 * noise(line + 50 * axis, 80.0 + number as f64)));
            let motion = [0, 1, 2].map(|i| (0..3).map(|j| compliance.value[[f, i, j]] * force[j]).sum::<Complex64>());
            for (channel, size) in channels.iter_mut().zip(force.into_iter().chain(motion)) {
                channel.iter_mut().enumerate().for_each(|(k, x)| *x += (size * Complex64::cis(TAU * (line * k) as f64 / period as f64)).re);
            }
        }
        for (c, channel) in channels.iter_mut().enumerate() {
            let size = if c < 3 { 0.3 } else { 1e-3 };
            channel.iter_mut().enumerate().for_each(|(k, x)| *x += size * noise(k + 7000 * c, 90.0 + number as f64));
        }
        let of = |range: std::ops::Range<usize>| channels[range].iter().map(Vec::as_slice).collect::<Vec<_>>();
        PeriodSpectra::of_periods(rate, period, &of(0..3), &of(3..6), &lines).expect("whole periods")
    };
    let model = InertiaDampingStiffnessModel::new(three().axes, Symmetry::Free);
    short(&ErrorsInVariables { band_hz: [0.3, 8.0] }.fit(&model, &[experiment(1), experiment(2)], &model.theta(&three())).expect("a fit"))
}

/// Without how a search ended, which round-off decides.
fn lasting(value: Value) -> Value {
    match value {
        Value::Array(values) => values.into_iter().map(lasting).collect(),
        Value::Object(entries) => {
            Value::Object(entries.into_iter().filter(|(key, _)| key != "reason" && key != "iterations").map(|(key, value)| (key, lasting(value))).collect())
        }
        other => other,
    }
}

macro_rules! numbers {
    ($($name:ident: $found:expr;)*) => { $(
        #[test]
        fn $name() {
            held(&lasting($found), concat!(env!("CARGO_MANIFEST_DIR"), "/tests/reference/numbers/", stringify!($name), ".json"), RELATIVE, "NDOF_WRITE_NUMBERS");
        }
    )* };
}

numbers! {
    of_frequency: in_frequency();
    of_blocks: blocks();
    of_memory: in_time(..3);
    of_lateness: in_time(3..6);
    of_friction: in_time(6..9);
    of_hysteresis: in_time(9..12);
    of_stiffness: in_time(12..15);
    of_limits: in_time(15..);
    of_ways: ways();
    of_three_axes: three_axes();
    of_two_axes_in_time: two_axes();
    of_profiles: profiles();
    of_periods_of_three: periods_of_three();
    of_periods: periods();
    of_states: states();
}
