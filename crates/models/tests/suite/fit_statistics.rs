//! Reported standard errors against the scatter over many draws of a response whose covariance is known.

use ndarray::{Array2, Array3, arr2};
use ndof_models::blocks::{Composite, find};
use ndof_models::{
    Axis, CovarianceKind, Fit, InertiaDampingStiffness, InertiaDampingStiffnessModel, LikelihoodRatio, NullLaw, PaperFit, ParametricModel, Smoothing, Symmetry,
    WeightedFit, likelihood_ratio, linear_start,
};
use ndof_signal::Kernel;
use ndof_sysid::{FrequencyResponse, ResponseKind, Uncertainty};
use num_complex::Complex64;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;

const DRAWS: u64 = 300;
/// A standard deviation from 300 draws is known to 1/√600: four of that.
const SCATTER: f64 = 4.0 * 0.041;
/// Bins 0.1 Hz apart and independent.
const BINS: usize = 76;

fn complex(rng: &mut ChaCha8Rng) -> Complex64 {
    let mut normal = || -> f64 { StandardNormal.sample(&mut *rng) };
    Complex64::new(normal(), normal()) * 0.5f64.sqrt()
}

/// Output and input side of a covariance, known by so many averages on independent lines.
fn errors([noise, input_inverse]: [Array3<Complex64>; 2], degrees: usize, unexplained: Option<Array3<Complex64>>) -> Uncertainty {
    let kernel = Kernel { offset_hz: vec![0.0], weight: vec![1.0] };
    Uncertainty { noise, input_inverse, degrees_of_freedom: degrees as f64, independent_spacing_hz: 0.1, unexplained, kernel, inverted: false }
}

/// The true response with circular noise whose covariance is `noise` ⊗ `input`, the noise part estimated with
/// `degrees` complex degrees of freedom.
fn draw(truth: &FrequencyResponse, relative: f64, degrees: usize, seed: u64) -> FrequencyResponse {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let n = truth.shape().0;
    let mut out = truth.clone();
    let mut noise = Array3::zeros((truth.len(), n, n));
    let mut input = Array3::zeros((truth.len(), n, n));
    for f in 0..truth.len() {
        let size = truth.at(f).iter().map(|v| v.norm()).fold(0.0, f64::max) * relative;
        // Correlated outputs, inputs of different power.
        let left = Array2::from_shape_fn((n, n), |(i, j)| {
            Complex64::new(
                if i == j {
                    size
                } else if i > j {
                    0.4 * size
                } else {
                    0.0
                },
                if i > j { 0.3 * size } else { 0.0 },
            )
        });
        let right = Array2::from_shape_fn((n, n), |(i, j)| Complex64::new(if i == j { 1.0 + i as f64 } else { 0.0 }, 0.0));
        let mut sample = |rows: usize, columns: usize| Array2::from_shape_fn((rows, columns), |_| complex(&mut rng));
        let error = left.dot(&sample(n, n)).dot(&right.t());
        let residual = left.dot(&sample(n, degrees));
        let adjoint = |a: &Array2<Complex64>| a.t().mapv(|v| v.conj());
        noise.index_axis_mut(ndarray::Axis(0), f).assign(&(residual.dot(&adjoint(&residual)) / degrees as f64));
        input.index_axis_mut(ndarray::Axis(0), f).assign(&right.dot(&adjoint(&right)));
        out.value.index_axis_mut(ndarray::Axis(0), f).zip_mut_with(&error, |v, e| *v += e);
    }
    out.uncertainty = Some(errors([noise, input], degrees, None));
    out
}

fn limb(axes: usize) -> InertiaDampingStiffness {
    if axes == 2 {
        return crate::support::patient();
    }
    let one = |v: f64| Array2::from_elem((1, 1), v);
    InertiaDampingStiffness { axes: vec![Axis::rotational("ankle")], inertia: one(0.02), damping: one(1.0), stiffness: one(80.0) }
}

/// Scatter over draws against the reported standard errors in their mean of power `power`, the worst parameter; and the
/// mean reduced χ².
fn compare(
    power: f64,
    axes: usize,
    kind: ResponseKind,
    degrees: usize,
    fit: impl Fn(&InertiaDampingStiffnessModel, &FrequencyResponse, &[f64]) -> Fit + Sync,
) -> (f64, f64) {
    let model = InertiaDampingStiffnessModel::new(limb(axes).axes, Symmetry::Symmetric);
    let grid: Vec<f64> = (0..BINS).map(|k| 0.5 + 0.1 * k as f64).collect();
    let truth = limb(axes).response(&grid, kind);
    let theta = model.theta(&limb(axes));
    let fits: Vec<Fit> = (0..DRAWS)
        .into_par_iter()
        .map(|seed| {
            let response = draw(&truth, 0.02, degrees, seed);
            let start = linear_start(&model, &response).expect("start");
            fit(&model, &response, &start)
        })
        .collect();
    let mut worst: f64 = 0.0;
    for (k, t) in theta.iter().enumerate() {
        let scatter = (fits.iter().map(|f| (f.theta[k] - t).powi(2)).sum::<f64>() / DRAWS as f64).sqrt();
        let reported = (fits.iter().map(|f| f.parameters[k].std_error.powf(power)).sum::<f64>() / DRAWS as f64).powf(1.0 / power);
        let ratio = scatter / reported;
        if (ratio - 1.0).abs() > (worst - 1.0).abs() || worst == 0.0 {
            worst = ratio;
        }
    }
    (worst, fits.iter().map(|f| f.chi2_reduced).sum::<f64>() / DRAWS as f64)
}

fn weighted(covariance: CovarianceKind) -> impl Fn(&InertiaDampingStiffnessModel, &FrequencyResponse, &[f64]) -> Fit + Sync {
    move |model, response, start| WeightedFit { smoothing: Smoothing::None, covariance, ..WeightedFit::default() }.fit(model, response, start).expect("fit")
}

#[test]
fn weighted_standard_errors_are_the_scatter_with_full_and_with_diagonal_covariance() {
    // 27 degrees of freedom are six trials of the fine setting; 4 are one trial, and call for the diagonal.
    for (axes, kind, degrees) in [
        (2, ResponseKind::Compliance, 27),
        (2, ResponseKind::Compliance, 4),
        (2, ResponseKind::DynamicStiffness, 12),
        (1, ResponseKind::DynamicStiffness, 10),
        (1, ResponseKind::Admittance, 60),
    ] {
        let (ratio, chi2) = compare(2.0, axes, kind, degrees, weighted(CovarianceKind::Model));
        assert!((ratio - 1.0).abs() < SCATTER, "{axes} {kind:?} {degrees}: {ratio}");
        // χ² of 600 real data, 300 draws; a diagonal of few degrees of freedom has heavy tails (Var F is large at ν = 4).
        assert!((chi2 - 1.0).abs() < if degrees == 4 { 0.05 } else { 0.02 }, "{axes} {kind:?} {degrees}: χ² {chi2}");
    }
}

#[test]
fn a_sandwich_needs_no_right_weights() {
    let (ratio, _) = compare(2.0, 2, ResponseKind::Compliance, 27, |model, response, start| {
        let mut wrong = response.clone();
        if let Some(u) = &mut wrong.uncertainty {
            u.noise.mapv_inplace(|v| v * 9.0);
        }
        weighted(CovarianceKind::Sandwich)(model, &wrong, start)
    });
    assert!((ratio - 1.0).abs() < SCATTER, "{ratio}");
}

#[test]
fn the_papers_cost_reports_its_own_scatter_and_that_is_larger() {
    let paper = |model: &InertiaDampingStiffnessModel, response: &FrequencyResponse, start: &[f64]| {
        let weight = Array3::ones(response.value.dim());
        PaperFit { band_hz: [0.5, 8.0] }.fit(model, response, &weight, start).expect("fit")
    };
    // The off-diagonal impedance passes near zero, where decibels have heavy tails: the rms of their errors has no limit.
    let (ratio, _) = compare(1.0, 2, ResponseKind::Compliance, 27, paper);
    assert!((ratio - 1.0).abs() < SCATTER, "{ratio}");
    let model = InertiaDampingStiffnessModel::new(limb(2).axes, Symmetry::Symmetric);
    let grid: Vec<f64> = (0..BINS).map(|k| 0.5 + 0.1 * k as f64).collect();
    let response = draw(&limb(2).response(&grid, ResponseKind::Compliance), 0.02, 27, 1);
    let start = linear_start(&model, &response).expect("start");
    let (own, best) = (paper(&model, &response, &start), weighted(CovarianceKind::Model)(&model, &response, &start));
    assert!(own.parameters.iter().zip(&best.parameters).all(|(a, b)| a.std_error > b.std_error));
    assert_eq!(model.parameters().len(), own.parameters.len());
    // Weights say which data count for more, not how good they are.
    let threefold = PaperFit { band_hz: [0.5, 8.0] }.fit(&model, &response, &Array3::from_elem(response.value.dim(), 3.0), &start).expect("fit");
    for (a, b) in own.parameters.iter().zip(&threefold.parameters) {
        assert!((a.value - b.value).abs() < 1e-6 * a.std_error && (a.std_error / b.std_error - 1.0).abs() < 1e-6, "{a:?} {b:?}");
    }
    assert!((threefold.chi2 / own.chi2 / 9.0 - 1.0).abs() < 1e-9);
}

#[test]
fn a_positive_semidefinite_fit_is_the_symmetric_one_inside_and_stops_at_the_edge() {
    let grid: Vec<f64> = (0..BINS).map(|k| 0.5 + 0.1 * k as f64).collect();
    let [symmetric, semidefinite] = [Symmetry::Symmetric, Symmetry::PositiveSemidefinite].map(|s| InertiaDampingStiffnessModel::new(limb(2).axes, s));
    let run = |model: &InertiaDampingStiffnessModel, response: &FrequencyResponse| {
        let start = linear_start(model, response).expect("start");
        weighted(CovarianceKind::Model)(model, response, &start)
    };
    let inside = draw(&limb(2).response(&grid, ResponseKind::Compliance), 0.02, 27, 5);
    let (plain, bound) = (run(&symmetric, &inside), run(&semidefinite, &inside));
    for (a, b) in plain.parameters.iter().zip(&bound.parameters) {
        assert!((a.value - b.value).abs() < 1e-4 * a.std_error && (a.std_error / b.std_error - 1.0).abs() < 1e-6, "{a:?} {b:?}");
    }
    let mut edge = limb(2);
    edge.damping = arr2(&[[9.0, 6.0], [6.0, 4.0]]);
    edge.damping[[1, 1]] -= 0.3;
    let beyond = draw(&edge.response(&grid, ResponseKind::Compliance), 0.01, 27, 6);
    let (plain, bound) = (run(&symmetric, &beyond), run(&semidefinite, &beyond));
    let least = |fit: &Fit| (fit.theta[3] * fit.theta[5] - fit.theta[4].powi(2)) / (fit.theta[3] + fit.theta[5]);
    assert!(least(&plain) < -0.02 && least(&bound) >= -1e-12 && least(&bound) < 1e-3, "{} {}", least(&plain), least(&bound));
    assert!(bound.reason.converged() && bound.chi2 > plain.chi2);
}

#[test]
fn a_likelihood_ratio_is_wrong_as_often_as_it_says_within_the_bounds_and_at_one() {
    const RATIOS: u64 = 1000;
    // Four standard deviations of a count in 1000 draws.
    let near = |found: usize, share: f64| (found as f64 - RATIOS as f64 * share).abs() < 4.0 * (RATIOS as f64 * share * (1.0 - share)).sqrt();
    let arm = InertiaDampingStiffnessModel::new(limb(1).axes, Symmetry::Symmetric);
    let grid: Vec<f64> = (0..BINS).map(|k| 0.5 + 0.1 * k as f64).collect();
    let truth = limb(1).response(&grid, ResponseKind::DynamicStiffness);
    let settings = WeightedFit { smoothing: Smoothing::None, ..WeightedFit::default() };
    let rivals =
        [("delay", NullLaw::ChiSquared), ("first-order-filter", NullLaw::HalfAtBound), ("second-order-filter", NullLaw::HalfAtBound)].map(|(name, law)| {
            let card = find(name).expect("in the registry");
            assert_eq!(NullLaw::of(&[(card.block)().as_ref()]), law);
            (name, law, Composite::of_cards(&arm, &[card]))
        });
    let ratios: Vec<[LikelihoodRatio; 3]> = (0..RATIOS)
        .into_par_iter()
        .map(|seed| {
            let response = draw(&truth, 0.02, 200, 9000 + seed);
            let start = linear_start(&arm, &response).expect("start");
            let plain = settings.fit(&arm, &response, &start).expect("fit");
            rivals
                .each_ref()
                .map(|(_, law, model)| likelihood_ratio(&plain, &settings.fit_from(model, &response, &model.starts(&start)).expect("fit")).under(*law))
        })
        .collect();
    for (k, (name, law, _)) in rivals.iter().enumerate() {
        let below = |level: f64| ratios.iter().filter(|r| r[k].p_value < level).count();
        let none = ratios.iter().filter(|r| r[k].statistic < 1e-4).count();
        println!("{name}: p < 0.05 in {}, < 0.2 in {} of {RATIOS}, nothing gained in {none}", below(0.05), below(0.2));
        assert!(near(below(0.05), 0.05) && near(below(0.2), 0.2), "{name}: {} {}", below(0.05), below(0.2));
        // By χ² of one degree p would be below 0.05 half as often as it says.
        if *law == NullLaw::HalfAtBound {
            assert!(near(none, 0.5), "{none}");
        }
    }
    let reflex = find("reflex").expect("in the registry");
    assert_eq!(NullLaw::of(&[(reflex.block)().as_ref()]), NullLaw::Unknown);
    let filters = [find("first-order-filter"), find("delay")].map(|c| (c.expect("in the registry").block)());
    assert_eq!(NullLaw::of(&[filters[0].as_ref(), filters[1].as_ref()]), NullLaw::Unknown);
}

/// P1 on a robot, moved by a command and, at each frequency by a force of that size, by itself: what both do to motion and force, and what the command leaves
/// of them by so many averages.
fn held(size: f64, degrees: usize, seed: u64) -> FrequencyResponse {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let robot = InertiaDampingStiffness {
        inertia: arr2(&[[1.0, 0.0], [0.0, 1.0]]),
        damping: arr2(&[[10.0, 0.0], [0.0, 10.0]]),
        stiffness: arr2(&[[100.0, 0.0], [0.0, 100.0]]),
        ..limb(2)
    };
    let grid: Vec<f64> = (0..BINS).map(|k| 0.5 + 0.1 * k as f64).collect();
    let mut out = limb(2).response(&grid, ResponseKind::Compliance);
    let adjoint = |a: &Array2<Complex64>| a.t().mapv(|v| v.conj());
    let inverse = |a: &Array2<Complex64>| ndof_linear::inverse(a).expect("regular");
    let [mut noise, mut input] = [(); 2].map(|()| Array3::zeros((BINS, 2, 2)));
    let mut unexplained = Array3::zeros((BINS, 4, 4));
    for (f, hz) in grid.iter().enumerate() {
        let at = |mut all: Array3<Complex64>| all.index_axis_mut(ndarray::Axis(0), 0).to_owned();
        let d_robot = at(robot.response(&[*hz], ResponseKind::DynamicStiffness).value);
        let both = inverse(&(&d_robot + &inverse(&out.at(f))));
        let gone = d_robot.dot(&both);
        // Of each column, motions and then forces of what the limb does by itself; and of a force sensor.
        let mut left = |columns: usize| {
            let own = Array2::from_shape_fn((2, columns), |_| complex(&mut rng) * size);
            let sensor = Array2::from_shape_fn((2, columns), |_| complex(&mut rng) * (0.02 * size));
            ndarray::concatenate(ndarray::Axis(0), &[both.dot(&own).view(), (sensor - gone.dot(&own)).view()]).expect("alike")
        };
        let (error, rest) = (left(2), left(degrees));
        let sigma = rest.dot(&adjoint(&rest)) / Complex64::from(degrees as f64);
        let cut = |a: &Array2<Complex64>, rows: [usize; 2]| a.slice_axis(ndarray::Axis(0), ndarray::Slice::from(rows[0]..rows[1])).to_owned();
        let r = both + cut(&error, [0, 2]);
        let t = Array2::<Complex64>::eye(2) - gone + cut(&error, [2, 4]);
        let c = r.dot(&inverse(&t));
        let a = ndarray::concatenate(ndarray::Axis(1), &[Array2::eye(2).view(), c.mapv(|v| -v).view()]).expect("alike");
        let told = inverse(&t.dot(&adjoint(&t)));
        let of_inputs = cut(&cut(&sigma, [2, 4]).t().to_owned(), [2, 4]).t().to_owned();
        let taken_in = told.dot(&of_inputs).diag().sum().re;
        let put = |to: &mut Array3<Complex64>, what: &Array2<Complex64>| to.index_axis_mut(ndarray::Axis(0), f).assign(what);
        put(&mut noise, &(a.dot(&sigma).dot(&adjoint(&a)) / Complex64::from(1.0 + taken_in)));
        put(&mut input, &told);
        put(&mut unexplained, &sigma);
        put(&mut out.value, &c);
    }
    out.uncertainty = Some(errors([noise, input], degrees, Some(unexplained)));
    out
}

#[test]
fn weights_that_follow_the_model_have_no_bias_and_those_of_the_estimate_have() {
    let model = InertiaDampingStiffnessModel::new(limb(2).axes, Symmetry::Symmetric);
    let theta = model.theta(&limb(2));
    let fits: Vec<[Fit; 2]> = (0..DRAWS)
        .into_par_iter()
        .map(|seed| {
            let response = held(0.25, 20, seed);
            let mut alone = response.clone();
            alone.uncertainty.iter_mut().for_each(|u| u.unexplained = None);
            [response, alone].map(|response| weighted(CovarianceKind::Model)(&model, &response, &linear_start(&model, &response).expect("start")))
        })
        .collect();
    let count = DRAWS as f64;
    // Of each parameter mean, scatter and the mean's error in standard errors of it.
    let told = |of: usize, k: usize| {
        let mean = fits.iter().map(|both| both[of].theta[k]).sum::<f64>() / count;
        let scatter = (fits.iter().map(|both| (both[of].theta[k] - mean).powi(2)).sum::<f64>() / (count - 1.0)).sqrt();
        (mean, scatter, (mean - theta[k]) * count.sqrt() / scatter)
    };
    for (k, truth) in theta.iter().enumerate() {
        let held = |of: usize| fits.iter().filter(|both| (both[of].parameters[k].ci95[0]..=both[of].parameters[k].ci95[1]).contains(truth)).count();
        let ([(mean, scatter, bias), (own, _, own_bias)], [held, held_own]) =
            ([told(0, k), told(1, k)], [held(0), held(1)].map(|held| 100.0 * held as f64 / count));
        let name = &model.parameters()[k].name;
        println!("| {name} | {truth} | {mean:.4} ± {scatter:.4} | {bias:+.1} | {held:.1} % | {own:.4} | {own_bias:+.1} | {held_own:.1} % |");
        // 99.99 % of 300 trials of 95 %.
        assert!((89.0..=99.5).contains(&held), "{name} {held}");
        assert!(bias.abs() < 4.0, "{name} {bias}");
    }
    let chi2 = fits.iter().map(|both| both[0].chi2_reduced).sum::<f64>() / count;
    assert!((chi2 - 1.0).abs() < 0.02, "{chi2}");
    assert!((0..theta.len()).any(|k| told(1, k).2 > 10.0));
}
