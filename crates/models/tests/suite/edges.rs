//! Fits at the edge: what the data do not determine is flagged, what cannot be computed is a typed error.

use faer::Mat;
use ndarray::{Array3, arr2};
use ndof_models::time::{Causality, FreeRunError, FreeRunFit, Mechanism, TimeTrial};
use ndof_models::{
    Axis, FitError, InertiaDampingStiffness, InertiaDampingStiffnessModel, LeastSquares, LevenbergMarquardt, MinimiseError, PaperFit, Smoothing, Symmetry,
    WeightedFit, linear_start,
};
use ndof_signal::Kernel;
use ndof_sysid::{FrequencyResponse, ResponseError, ResponseKind, Uncertainty};
use num_complex::Complex64;

/// Relative error of an estimate of which nothing but its own accuracy is known.
const RELATIVE: f64 = 0.01;

fn one(m: f64, b: f64, k: f64) -> InertiaDampingStiffness {
    model().matrices(&[m, b, k])
}

fn model() -> InertiaDampingStiffnessModel {
    InertiaDampingStiffnessModel::new(vec![Axis::linear("x")], Symmetry::Symmetric)
}

/// The compliance of a mass on a spring, with errors of one percent at each of 200 frequencies.
fn estimated(matrices: &InertiaDampingStiffness, from_hz: f64, to_hz: f64) -> FrequencyResponse {
    let hz: Vec<f64> = (0..200).map(|k| from_hz + (to_hz - from_hz) * f64::from(k) / 199.0).collect();
    let response = matrices.response(&hz, ResponseKind::Compliance);
    let noise = response.value.mapv(|v| Complex64::new((RELATIVE * v.norm()).powi(2), 0.0));
    let uncertainty = Uncertainty {
        noise,
        input_inverse: Array3::from_elem(response.value.dim(), Complex64::ONE),
        degrees_of_freedom: 40.0,
        independent_spacing_hz: hz[1] - hz[0],
        kernel: Kernel::default(),
        unexplained: None,
        inverted: false,
    };
    FrequencyResponse { uncertainty: Some(uncertainty), ..response }
}

fn settings(band_hz: [f64; 2]) -> WeightedFit {
    WeightedFit { band_hz, smoothing: Smoothing::None, ..WeightedFit::default() }
}

#[test]
fn a_stiffness_that_the_band_does_not_show_is_flagged() {
    // Far above the resonance a spring of 1e-4 N/m beside 2 kg is a part in 1e10 of the force.
    let response = estimated(&one(2.0, 10.0, 1e-4), 100.0, 200.0);
    let fit = settings([100.0, 200.0]).fit(&model(), &response, &[1.0, 5.0, 1.0]).expect("a fit");
    let parameter = |name: &str| fit.parameter(name).expect("there").clone();
    assert!(parameter("M").identifiable && !parameter("K").identifiable, "{:?}", fit.parameters);
    assert!((parameter("M").value - 2.0).abs() < 4.0 * parameter("M").std_error);
}

#[test]
fn an_unstable_plant_is_found_as_it_is() {
    let response = estimated(&one(2.0, -10.0, 300.0), 0.5, 10.0);
    let fit = settings([0.5, 10.0]).fit(&model(), &response, &linear_start(&model(), &response).expect("a start")).expect("a fit");
    let b = fit.parameter("B").expect("there");
    assert!((b.value + 10.0).abs() < 4.0 * b.std_error && b.ci95[1] < 0.0, "{b:?}");
}

#[test]
fn sizes_far_from_one_are_fitted_like_any_other() {
    for scale in [1e-30, 1e-12, 1e12, 1e30] {
        let response = estimated(&one(2.0 * scale, 10.0 * scale, 300.0 * scale), 0.5, 10.0);
        let start = linear_start(&model(), &response).expect("a start");
        let fit = settings([0.5, 10.0]).fit(&model(), &response, &start).expect("a fit");
        for (found, truth) in fit.theta.iter().zip([2.0, 10.0, 300.0]) {
            assert!((found / scale / truth - 1.0).abs() < 1e-6, "{scale}: {:?}", fit.theta);
        }
    }
}

#[test]
fn a_response_without_numbers_or_without_bins_is_refused() {
    let mut response = estimated(&one(2.0, 10.0, 300.0), 0.5, 10.0);
    let outside = settings([20.0, 30.0]).fit(&model(), &response, &[2.0, 10.0, 300.0]);
    assert!(matches!(outside, Err(FitError::TooFewBins { bins: 0, .. })), "{outside:?}");
    response.value.fill(Complex64::new(f64::NAN, 0.0));
    let empty = settings([0.5, 10.0]).fit(&model(), &response, &[2.0, 10.0, 300.0]);
    assert!(matches!(empty, Err(FitError::TooFewBins { bins: 0, .. })), "{empty:?}");
}

/// r = (a + b − 1, 2 (a + b − 1)): a line of minima.
struct Valley;

impl LeastSquares for Valley {
    fn residuals(&self, x: &[f64]) -> Vec<f64> {
        let r = x[0] + x[1] - 1.0;
        vec![r, 2.0 * r]
    }

    fn jacobian(&self, _: &[f64]) -> Mat<f64> {
        Mat::from_fn(2, 2, |i, _| 1.0 + i as f64)
    }
}

/// r = 1 / x: nothing at zero.
struct Pole;

impl LeastSquares for Pole {
    fn residuals(&self, x: &[f64]) -> Vec<f64> {
        vec![1.0 / x[0]]
    }

    fn jacobian(&self, x: &[f64]) -> Mat<f64> {
        Mat::from_fn(1, 1, |_, _| -1.0 / (x[0] * x[0]))
    }
}

#[test]
fn a_singular_jacobian_ends_in_a_minimum_and_a_start_without_numbers_in_an_error() {
    let free = |n: usize| LevenbergMarquardt::new(vec![(f64::NEG_INFINITY, f64::INFINITY); n]);
    let found = free(2).minimise(&Valley, &[10.0, -3.0]).expect("a minimum");
    assert!(found.cost < 1e-20 && found.x.iter().all(|x| x.is_finite()), "{found:?}");
    let error = free(1).minimise(&Pole, &[0.0]).err();
    assert!(matches!(error, Some(MinimiseError::StartNotFinite { residual: 0 })), "{error:?}");
}

#[test]
fn a_response_of_another_size_than_the_model_is_refused() {
    let two = InertiaDampingStiffnessModel::new(vec![Axis::linear("x"), Axis::linear("y")], Symmetry::Symmetric);
    let error = linear_start(&two, &estimated(&one(2.0, 12.0, 300.0), 0.5, 8.0)).err();
    assert_eq!(error, Some(ResponseError::Size { outputs: 1, inputs: 1, axes: 2 }));
}

#[test]
fn a_trial_without_samples_is_refused_whatever_is_imposed() {
    // Found by fuzzing: an imposed motion was differentiated before anybody asked whether there was one.
    let mechanism = Mechanism::new(vec![Axis::linear("x")]);
    for causality in [Causality::ForceIn, Causality::MotionIn] {
        let trial = TimeTrial { force: vec![&[]], motion: vec![&[]], velocity: Vec::new() };
        let found = FreeRunFit { causality, ..FreeRunFit::new(100.0) }.fit(&mechanism, &[trial], &[2.0, 10.0, 300.0]);
        assert_eq!(found.err(), Some(FreeRunError::Empty), "{causality:?}");
    }
}

/// Eight numbers a frequency, twelve parameters.
#[test]
fn two_frequencies_are_enough_for_two_axes_and_one_is_not() {
    let truth = InertiaDampingStiffness {
        axes: vec![Axis::linear("x"), Axis::linear("y")],
        inertia: arr2(&[[2.1, -0.5], [-0.6, 1.9]]),
        damping: arr2(&[[11.0, -2.0], [-1.0, 15.0]]),
        stiffness: arr2(&[[300.0, -60.0], [-50.0, 520.0]]),
    };
    let model = InertiaDampingStiffnessModel::new(truth.axes.clone(), Symmetry::Free);
    let mut response = estimated(&truth, 1.0, 10.0);
    let uncertainty = response.uncertainty.as_mut().expect("a covariance");
    for of in [&mut uncertainty.noise, &mut uncertainty.input_inverse] {
        *of = Array3::from_shape_fn(of.dim(), |(_, i, j)| if i == j { Complex64::new(1e-5, 0.0) } else { Complex64::ZERO });
    }
    let (weight, start) = (Array3::from_elem(response.value.dim(), 1.0), model.theta(&truth));
    for bins in [1, 2] {
        let band_hz = [0.0, response.frequency_hz[bins - 1] + 1e-9];
        let weighted = settings(band_hz).fit(&model, &response, &start);
        let paper = PaperFit { band_hz }.fit(&model, &response, &weight, &start);
        for fit in [weighted, paper] {
            match fit {
                Ok(fit) => assert!(bins == 2 && fit.bins == 2, "{bins}"),
                Err(error) => assert!(bins == 1 && matches!(error, FitError::TooFewBins { bins: 1, needed: 2, .. }), "{bins}: {error}"),
            }
        }
    }
}
