//! Fits of arbitrary numbers, and of a plant's numbers with errors of any size: one kind of fit an execution, of few bins or samples.

use crate::numbers::Given;
use crate::response::arbitrary;
use ndarray::Array3;
use ndof_models::time::{Causality, FreeRunFit, Mechanism, Noise, TimeTrial, laws};
use ndof_models::{
    Arm, Axis, CovarianceKind, Fit, InertiaDampingStiffness, InertiaDampingStiffnessModel, Kinematics, KinematicsSd, LoopModel, PaperFit, ParametricModel,
    Projection, Smoothing, Symmetry, Transducer, WeightedFit, agreement, linear_start,
};
use ndof_sysid::{FrequencyResponse, ResponseKind};

/// Bytes that choose model, data and settings.
const CHOICES: usize = 8;
/// Numbers that one execution takes at most.
const MOST: usize = 160;
/// Samples of a fit in time, which integrates them anew for each of its iterations.
const MOST_IN_TIME: usize = 20;
const BAND_HZ: [f64; 2] = [0.25, 10.0];

/// One fit, and what its result must be.
pub fn fits(data: &[u8]) {
    let Some(given) = Given::of(data, CHOICES, MOST) else { return };
    let axes = 1 + usize::from(given.bit(1, 0));
    let symmetry = given.one_of(1, &[Symmetry::Symmetric, Symmetry::Free, Symmetry::PositiveSemidefinite]);
    let model = InertiaDampingStiffnessModel::new((0..axes).map(|k| Axis::linear(&format!("x{k}"))).collect(), symmetry);
    match given.choose(0, 8) {
        1 => in_time(&given),
        kind => to_response(&given, &model, axes, kind),
    }
}

/// A response of arbitrary numbers, or a plant's with relative errors.
fn response(given: &Given, model: &InertiaDampingStiffnessModel, axes: usize) -> FrequencyResponse {
    let bins = 2 + given.choose(5, 8);
    let any = arbitrary(given, (axes, axes), bins);
    if given.bit(4, 7) {
        return any;
    }
    let plant = model.matrix(&vec![1.0; model.entries().len()]);
    let diagonal = |value: f64| ndarray::Array2::from_shape_fn((axes, axes), |(i, j)| if i == j { value } else { 0.1 * value * plant[[i, j]] });
    let limb = InertiaDampingStiffness { axes: model.axes().to_vec(), inertia: diagonal(2.0), damping: diagonal(12.0), stiffness: diagonal(300.0) };
    let hz: Vec<f64> = (0..bins).map(|k| 0.5 + k as f64).collect();
    let kind = if any.kind == ResponseKind::Transfer { ResponseKind::Compliance } else { any.kind };
    let right = limb.response(&hz, kind);
    let value = Array3::from_shape_fn(right.value.dim(), |at| right.value[at] * (1.0 + any.value[at]));
    FrequencyResponse { value, uncertainty: any.uncertainty, ..right }
}

/// Fits to a response, its projection to joints and its agreement.
fn to_response(given: &Given, model: &InertiaDampingStiffnessModel, axes: usize, kind: usize) {
    let response = response(given, model, axes);
    let weight = Array3::from_shape_fn(response.value.dim(), |(f, i, j)| if given.bit(4, 6) { given.value(f + i + j) } else { 0.9 });
    let start = if given.bit(4, 5) { Some((0..3 * model.entries().len()).map(|k| given.value(k)).collect()) } else { linear_start(model, &response).ok() };
    let Some(start) = start else { return };
    let settings = WeightedFit {
        band_hz: BAND_HZ,
        smoothing: if given.bit(4, 4) { Smoothing::Open } else { Smoothing::None },
        transducer: given.bit(4, 3).then(|| Transducer { stiffness: given.value(0), damping: given.value(1) }),
        covariance: if given.bit(4, 2) { CovarianceKind::Sandwich } else { CovarianceKind::Model },
        ..WeightedFit::default()
    };
    match kind {
        3 | 4 => {
            if let Ok(fit) = settings.fit(model, &response, &start) {
                sound(&fit, &start);
                joints(given, model, &fit, axes);
            }
        }
        5 => {
            if let Ok(fit) = (PaperFit { band_hz: BAND_HZ }).fit(model, &response, &weight, &start) {
                sound(&fit, &start);
            }
        }
        6 => {
            let seen = model.matrices(&start).response(&response.frequency_hz, ResponseKind::Impedance);
            if let Ok(found) = agreement(&response, &seen, &weight, BAND_HZ) {
                assert!(found.vaf_percent.iter().flatten().flatten().all(|v| !(*v > 100.0)), "{found:?}");
            }
        }
        _ => {
            let _ = LoopModel::estimate(&response, &arbitrary(given, (axes, axes), response.len()), BAND_HZ);
        }
    }
}

/// A fit has as many numbers as it was asked for, finite, and intervals that are none or hold the value.
fn sound(fit: &Fit, start: &[f64]) {
    assert_eq!((fit.theta.len(), fit.parameters.len(), fit.covariance.dim()), (start.len(), start.len(), (start.len(), start.len())));
    assert!(fit.theta.iter().all(|v| v.is_finite()), "{:?}", fit.theta);
    for parameter in &fit.parameters {
        let [low, high] = parameter.ci95;
        assert!(!(parameter.std_error < 0.0) && !(low > parameter.value) && !(high < parameter.value), "{parameter:?}");
    }
}

/// To the joints of an arm at any posture, and back.
fn joints(given: &Given, model: &InertiaDampingStiffnessModel, fit: &Fit, axes: usize) {
    let kinematics = if axes == 2 {
        let (lengths, posture) = ([given.value(0).abs(), given.value(1)], [given.value(2), given.value(3)]);
        match given.choose(6, 3) {
            0 => Kinematics::planar_two_link(given.one_of(6, &[Arm::Right, Arm::Left]), lengths, posture).ok(),
            1 => Kinematics::planar_two_link_at(Arm::Right, lengths, [given.value(4), given.value(5)], posture).ok(),
            _ => Kinematics::planar_two_link(Arm::Right, [0.33, 0.34], [0.785, 1.571]).ok(),
        }
    } else {
        Some(Kinematics::Jacobian { matrix: ndarray::arr2(&[[given.value(0)]]) })
    };
    let Some(kinematics) = kinematics else { return };
    let sd = KinematicsSd { link_lengths_m: 0.01, posture_rad: 0.05, mean_force_n: given.value(6) };
    let projection = Projection { kinematics, mean_force_n: vec![given.value(7); axes], sd };
    if let Ok(projected) = projection.fit_to_joints(model, fit) {
        assert_eq!(projected.parameters.len(), fit.parameters.len());
    }
}

/// A free run of one axis with one law beside inertia, damping and stiffness.
fn in_time(given: &Given) {
    let mut columns = given.columns(2);
    columns.iter_mut().for_each(|c| c.truncate(MOST_IN_TIME));
    let trial = TimeTrial { force: vec![&columns[0]], motion: vec![&columns[1]], velocity: Vec::new() };
    let bare = Mechanism::new(vec![Axis::linear("x")]);
    let mechanism = match given.choose(2, 32) {
        0 => bare.with(laws::CubicStiffness, 0),
        1 => bare.with(laws::Coulomb { turn_velocity: 1e-3 }, 0),
        2 => bare.with(laws::Relaxation, 0),
        3 => Mechanism { spring: false, ..bare },
        4 => bare.with_offset(),
        _ => bare,
    };
    let settings = FreeRunFit {
        window_s: given.bit(3, 0).then_some(1.0),
        causality: if given.bit(3, 1) { Causality::MotionIn } else { Causality::ForceIn },
        noise: if given.bit(3, 2) { Noise::Autoregressive(given.choose(3, 32) / 8) } else { Noise::Blocks },
        settle_s: if given.bit(3, 5) { 0.2 } else { 0.0 },
        output_low_pass_hz: given.bit(3, 6).then_some(5.0),
        ..FreeRunFit::new(20.0)
    };
    let mut baseline = vec![2.0, 12.0, 300.0];
    baseline.resize(mechanism.baseline_parameters(), 0.0);
    let start = match given.bit(3, 7) {
        true => (0..mechanism.parameters().len()).map(|k| given.value(k)).collect(),
        false => mechanism.starts(&baseline).into_iter().next().unwrap_or_default(),
    };
    if let Ok(run) = settings.fit(&mechanism, &[trial], &start) {
        assert_eq!(run.theta.len(), start.len());
        assert!(run.theta.iter().all(|v| v.is_finite()), "{:?}", run.theta);
    }
}
