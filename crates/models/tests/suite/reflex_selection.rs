//! On data with a reflex the reflex wins, and what mends a phase that rolls off does not.

use crate::support::patient;
use ndarray::{Array2, Array3, arr2};
use ndof_models::blocks::{Block, Composite, Delay, FirstOrderFilter, Place, Placed, Reflex, SeriesCompliance};
use ndof_models::{Fit, InertiaDampingStiffnessModel, ParametricModel, Smoothing, Symmetry, WeightedFit, likelihood_ratio, linear_start};
use ndof_signal::Kernel;
use ndof_sysid::{FrequencyResponse, ResponseKind, Uncertainty};
use num_complex::Complex64;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// Noise of each element relative to the largest, and its degrees of freedom: six trials of the paper's coarse setting.
const NOISE: f64 = 0.01;
const DEGREES: f64 = 140.0;

/// Compliance of the patient's arm with a reflex of 50 ms in both axes, written from its equation, with circular noise.
fn estimate(seed: u64) -> FrequencyResponse {
    let hz: Vec<f64> = (0..116).map(|k| 0.5 + 0.1 * f64::from(k)).collect();
    let mut response = patient().response(&hz, ResponseKind::Compliance);
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
    let mut noise = Array3::zeros((hz.len(), 2, 2));
    let mut input = Array3::zeros((hz.len(), 2, 2));
    for (f, hz) in hz.iter().enumerate() {
        let s = Complex64::new(0.0, std::f64::consts::TAU * hz);
        let omega = std::f64::consts::TAU * 4.0;
        let reflex = (120.0 + 8.0 * s) * (-0.05 * s).exp() * omega * omega / ((s + omega) * (s + omega));
        let mut d = patient().dynamic_stiffness(s);
        d[[0, 0]] += reflex;
        d[[1, 1]] += reflex;
        let determinant = d[[0, 0]] * d[[1, 1]] - d[[0, 1]] * d[[1, 0]];
        let c = arr2(&[[d[[1, 1]], -d[[0, 1]]], [-d[[1, 0]], d[[0, 0]]]]).mapv(|v| v / determinant);
        let size = NOISE * c.iter().map(|v| v.norm()).fold(0.0, f64::max);
        let error = Array2::from_shape_fn((2, 2), |_| Complex64::new(normal(), normal()) * size * 0.5f64.sqrt());
        response.value.index_axis_mut(ndarray::Axis(0), f).assign(&(c + error));
        for i in 0..2 {
            noise[[f, i, i]] = Complex64::new(size * size, 0.0);
            input[[f, i, i]] = Complex64::new(1.0, 0.0);
        }
    }
    let kernel = Kernel { offset_hz: vec![0.0], weight: vec![1.0] };
    response.uncertainty =
        Some(Uncertainty { noise, input_inverse: input, degrees_of_freedom: DEGREES, independent_spacing_hz: 0.1, kernel, unexplained: None, inverted: false });
    response
}

#[test]
fn on_data_with_a_reflex_the_reflex_wins() {
    let response = estimate(7);
    let arm = || InertiaDampingStiffnessModel::new(patient().axes, Symmetry::Symmetric);
    let start = linear_start(&arm(), &response.band(0.5, 8.0)).expect("start");
    let settings = WeightedFit { band_hz: [0.4, 12.0], smoothing: Smoothing::None, ..WeightedFit::default() };
    let fit = |extension: Option<(Box<dyn Block>, Place)>| -> Fit {
        let model = Composite::new(Box::new(arm()), extension.into_iter().map(|(block, place)| Placed { block, place }).collect());
        assert_eq!(model.axes().len(), 2);
        settings.fit_from(&model, &response, &model.starts(&start)).expect("fit")
    };
    let both = || vec![0, 1];
    let plain = fit(None);
    let reflex = fit(Some((Box::new(Reflex), Place::Parallel(both()))));
    let rivals = [
        fit(Some((Box::new(Delay), Place::EffortChannel(both())))),
        fit(Some((Box::new(FirstOrderFilter), Place::EffortChannel(both())))),
        fit(Some((Box::new(SeriesCompliance), Place::Series(both())))),
    ];
    assert!(likelihood_ratio(&plain, &reflex).p_value < 1e-12);
    // χ²/ν of some 900 real data: 1 ± 0.047; four of that.
    assert!((reflex.chi2_reduced - 1.0).abs() < 0.2, "{}", reflex.chi2_reduced);
    assert!(rivals.iter().all(|r| r.bic() > reflex.bic() + 10.0), "{:?} against {}", rivals.iter().map(Fit::bic).collect::<Vec<_>>(), reflex.bic());
    for (name, truth) in [("reflex_stiffness_n_per_m", 120.0), ("reflex_damping_n_s_per_m", 8.0), ("reflex_delay_s", 0.05), ("reflex_cutoff_hz", 4.0)] {
        let p = reflex.parameter(name).expect("a parameter");
        assert!((p.value - truth).abs() < 4.0 * p.std_error, "{p:?}");
    }
}
