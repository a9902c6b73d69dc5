//! Small promises that whole fits do not show: names, refusals, what a constant adds, where a sign turns.

use ndarray::{Array2, arr2};
use ndof_models::blocks::{BLOCKS, Composite, find};
use ndof_models::effects::Evidence;
use ndof_models::physical::{ellipse, symmetry_test, unit_matrices};
use ndof_models::time::{FreeRunFit, Mechanism, TimeTrial, laws, simulate};
use ndof_models::{
    Arm, Axis, Fit, FitError, InertiaDampingStiffness, InertiaDampingStiffnessModel, Kinematics, KinematicsSd, LeastSquares, LevenbergMarquardt, PaperFit,
    ParametricModel, Projection, StopReason, Symmetry, parametric_response,
};
use ndof_sysid::ResponseKind;
use num_complex::Complex64;

fn limb() -> InertiaDampingStiffness {
    InertiaDampingStiffness {
        axes: vec![Axis::linear("x"), Axis::linear("y")],
        inertia: arr2(&[[2.1, -0.5], [-0.4, 1.9]]),
        damping: arr2(&[[11.0, -2.0], [-2.3, 15.0]]),
        stiffness: arr2(&[[300.0, -60.0], [-50.0, 520.0]]),
    }
}

/// A fit of all twelve entries with that variance of each.
fn fit(model: &InertiaDampingStiffnessModel, variance: [f64; 12]) -> Fit {
    let response = limb().response(&[0.5, 1.0, 2.0, 4.0], ResponseKind::Compliance);
    let weight = ndarray::Array3::from_elem(response.value.dim(), 1.0);
    let fit = PaperFit::default().fit(model, &response, &weight, &model.theta(&limb())).expect("a fit");
    Fit { covariance: Array2::from_diag(&ndarray::Array1::from(variance.to_vec())), theta: model.theta(&limb()), ..fit }
}

#[test]
fn blocks_and_laws_are_found_by_the_names_they_give_themselves() {
    let names: Vec<&str> = BLOCKS.iter().map(|card| card.name()).collect();
    let expected =
        ["delay", "first-order-filter", "second-order-filter", "series-compliance", "flexible-mode", "standard-linear-solid", "fractional", "reflex"];
    assert_eq!(names, expected);
    let baseline = InertiaDampingStiffnessModel::new(limb().axes, Symmetry::Symmetric);
    let larger = Composite::of_cards(&baseline, &[find("delay").expect("a delay")]);
    assert_eq!(larger.name(), "inertia-damping-stiffness+delay");
    // An entry off the diagonal matters beside its diagonal, a block's parameter beside itself.
    let theta = [4.0, 0.1, 9.0, 1.0, 0.1, 1.0, 1.0, 0.1, 1.0, -0.03];
    assert_eq!([0, 1, 2, 9].map(|k| larger.scales(&theta)[k]), [4.0, 6.0, 9.0, 0.03]);
    assert!(laws::all().iter().all(|law| laws::find(law.name()).is_some_and(|found| found.name() == law.name())));
    assert!(laws::find("no-law").is_none() && laws::all().len() > 15);
}

#[test]
fn parameters_of_laws_are_named_by_their_units_along_and_about_an_axis() {
    let named = |law: &str, rotational: bool| -> Vec<(String, String)> {
        laws::find(law).expect("a law").parameters(rotational).into_iter().map(|p| (p.name, p.unit)).collect()
    };
    let owned = |pairs: &[(&str, &str)]| -> Vec<(String, String)> { pairs.iter().map(|(a, b)| ((*a).to_owned(), (*b).to_owned())).collect() };
    assert_eq!(named("coulomb-friction", false), owned(&[("coulomb_n", "N")]));
    assert_eq!(named("coulomb-friction", true), owned(&[("coulomb_nm", "N m")]));
    assert_eq!(named("maxwell-slip", false), owned(&[("loop_n_per_m", "N/m"), ("yield_m", "m")]));
    assert_eq!(named("maxwell-slip", true), owned(&[("loop_nm_per_rad", "N m/rad"), ("yield_rad", "rad")]));
    assert_eq!(named("cubic-stiffness", false), owned(&[("k3_n_per_m3", "N/m^3")]));
    assert_eq!(named("cubic-stiffness", true), owned(&[("k3_nm_per_rad3", "N m/rad^3")]));
    assert_eq!(named("stribeck-friction", false)[2], ("stribeck_m_per_s".to_owned(), "m/s".to_owned()));
    assert_eq!(named("stribeck-friction", true)[2], ("stribeck_rad_per_s".to_owned(), "rad/s".to_owned()));
}

#[test]
fn a_search_that_ran_out_of_steps_has_not_converged_and_every_other_has() {
    use StopReason::{CostConverged, GradientConverged, IterationLimit, StepConverged};
    assert_eq!([CostConverged, StepConverged, GradientConverged, IterationLimit].map(StopReason::converged), [true, true, true, false]);
}

#[test]
fn admittance_is_the_rate_of_compliance() {
    let model = InertiaDampingStiffnessModel::new(limb().axes, Symmetry::Free);
    let of = |kind| parametric_response(&model, &model.theta(&limb()), &[1.7], kind).value;
    let s = Complex64::new(0.0, std::f64::consts::TAU * 1.7);
    assert!(of(ResponseKind::Admittance).iter().zip(&of(ResponseKind::Compliance)).all(|(a, c)| (a - s * c).norm() < 1e-15));
}

#[test]
fn only_a_finite_matrix_of_a_plane_has_an_ellipse() {
    let of = |matrix: &Array2<f64>| ellipse(matrix, &unit_matrices(true), &Array2::eye(3), 2.0).is_some();
    assert!(of(&arr2(&[[3.0, 1.0], [1.0, 2.0]])));
    assert!(!of(&arr2(&[[3.0, f64::NAN], [1.0, 2.0]])) && !of(&Array2::eye(3)));
}

#[test]
fn each_matrix_that_is_not_symmetric_means_something_of_its_own() {
    let model = InertiaDampingStiffnessModel::new(limb().axes, Symmetry::Free);
    let meaning = |variance: [f64; 12]| symmetry_test(&model, &fit(&model, variance)).into_iter().map(|t| t.meaning).collect::<Vec<_>>();
    let sure = meaning([1e-6; 12]);
    assert!(["M is not", "B is not", "K is not"].iter().zip(&sure).all(|(start, text)| text.starts_with(start)), "{sure:?}");
    assert!(meaning([1e6; 12]).iter().all(|text| text.contains("is symmetric within")));
    assert!(symmetry_test(&InertiaDampingStiffnessModel::new(limb().axes, Symmetry::Symmetric), &fit(&model, [1.0; 12])).is_empty());
    let curl = Fit { theta: vec![2.0, 0.1, 0.1, 1.9, 10.0, 0.2, 0.1, 12.0, 300.0, 5.0, 4.0, 500.0], ..fit(&model, [0.01; 12]) };
    let stiffness = symmetry_test(&model, &curl).swap_remove(2);
    // Half the difference of two independent entries of variance 0.01 has the variance 0.005; (0.5)²/0.005 = 50 on one degree of freedom.
    assert!((stiffness.antisymmetric[0].half_difference.std_error - 0.005f64.sqrt()).abs() < 1e-12);
    assert!((stiffness.p_value / 1.537e-12 - 1.0).abs() < 0.01, "{}", stiffness.p_value);
}

#[test]
fn what_is_not_known_of_an_arm_widens_its_joints_by_the_half_difference() {
    let model = InertiaDampingStiffnessModel::new(limb().axes, Symmetry::Free);
    let sd = KinematicsSd { link_lengths_m: 0.01, posture_rad: 0.03, mean_force_n: 0.5 };
    let at = |lengths: [f64; 2], angles: [f64; 2], force: [f64; 2], sd: KinematicsSd| Projection {
        kinematics: Kinematics::planar_two_link(Arm::Right, lengths, angles).expect("an arm"),
        mean_force_n: force.to_vec(),
        sd,
    };
    let (lengths, angles, force) = ([0.3, 0.33], [0.7, 1.4], [1.5, -0.8]);
    let own = at(lengths, angles, force, sd);
    let found = own.fit_to_joints(&model, &fit(&model, [0.0; 12])).expect("joints");
    assert_eq!(found.posture_rad, angles);
    let moved = |which: usize, times: f64| {
        let (mut lengths, mut angles, mut force) = (lengths, angles, force);
        match which / 2 {
            0 => lengths[which % 2] += times * sd.link_lengths_m,
            1 => angles[which % 2] += times * sd.posture_rad,
            _ => force[which % 2] += times * sd.mean_force_n,
        }
        model.theta(&at(lengths, angles, force, sd).matrices_to_joints(&limb()).expect("joints"))
    };
    let changes: Vec<Vec<f64>> = (0..6).map(|w| moved(w, 1.0).iter().zip(moved(w, -1.0)).map(|(a, b)| 0.5 * (a - b)).collect()).collect();
    for r in 0..12 {
        for c in 0..12 {
            let want: f64 = changes.iter().map(|change| change[r] * change[c]).sum();
            assert!((found.covariance[[r, c]] - want).abs() < 1e-9 * want.abs().max(1e-6), "{r} {c}: {} {want}", found.covariance[[r, c]]);
        }
    }
    // A stiffness that is not known leaves every stiffness of the joints open, and nothing else.
    let mut variance = [1.0; 12];
    variance[8] = f64::INFINITY;
    let open = own.fit_to_joints(&model, &fit(&model, variance)).expect("joints");
    assert!((0..12).all(|r| open.covariance[[r, r]].is_finite() == (r < 8)), "{}", open.covariance);
    assert!((0..8).all(|r| (8..12).all(|c| open.covariance[[r, c]] == 0.0)));
    // An arm without joints, or of another size than the matrices, is none.
    let matrix = |rows, columns| Projection {
        kinematics: Kinematics::Jacobian { matrix: Array2::from_shape_fn((rows, columns), |(i, j)| f64::from(u8::from(i == j))) },
        ..own.clone()
    };
    for (rows, columns) in [(2, 0), (0, 2), (3, 2)] {
        assert!(matrix(rows, columns).matrices_to_joints(&limb()).is_err(), "{rows} {columns}");
    }
    assert!(matrix(2, 2).matrices_to_joints(&limb()).is_ok() && matrix(2, 2).kinematics.posture_rad().is_empty());
}

#[test]
fn a_reflex_that_is_late_and_fast_is_judged_in_the_time_of_its_own_plant() {
    let effect = ndof_models::effects::find("reflex-delay").expect("an effect");
    let told = |time_s: f64, parameters: &[(&str, f64)]| {
        let scale = ndof_models::effects::Scale {
            position: vec![0.01],
            far: vec![0.018],
            centre: vec![0.0],
            velocity: vec![0.1],
            effort: vec![3.0],
            time_s,
            duration_s: 30.0,
            middle_s: 15.0,
            mass: vec![vec![2.0]],
            stiffness: vec![vec![300.0]],
            spring: true,
            integrals: 0,
            rotational: false,
            motion_imposed: false,
            effort_is_command: false,
            effort_names: vec!["force".to_owned()],
            motion_names: vec!["pos".to_owned()],
            nominal: vec![],
            held: vec![],
            symmetric: false,
            closed_schedule: None,
            arm: None,
        };
        let coefficients: [&[f64]; 1] = [&[1.0]];
        let evidence = Evidence { parameters, coefficients: &coefficients, axis: Some(0), scale: &scale, beside: &[], gain_worth: &|| None };
        effect.stands_for(&evidence).to_vec()
    };
    // What is told of a plant is told of one twelve times as slow with a delay twelve times as long and a twelfth of the cut-off.
    for (delay_s, cutoff_hz) in [(0.001, 0.5), (0.05, 3.0), (0.05, 30.0), (0.3, 3.0), (0.3, 30.0), (0.001, 30.0)] {
        let own = told(1.0, &[("cutoff_hz", cutoff_hz), ("delay_s", delay_s)]);
        assert_eq!(own.is_empty(), delay_s < 0.1 && cutoff_hz < 15.0, "{delay_s} {cutoff_hz}");
        assert_eq!(own, told(12.0, &[("delay_s", 12.0 * delay_s), ("cutoff_hz", cutoff_hz / 12.0)]), "{delay_s} {cutoff_hz}");
    }
}

#[test]
fn a_straight_arm_is_either_arm() {
    for arm in [Arm::Right, Arm::Left] {
        assert!(Kinematics::planar_two_link(arm, [0.3, 0.33], [0.4, 0.0]).is_ok());
        let (own, other) = if matches!(arm, Arm::Right) { (1.0, -1.0) } else { (-1.0, 1.0) };
        assert!(Kinematics::planar_two_link(arm, [0.3, 0.33], [0.4, own]).is_ok() && Kinematics::planar_two_link(arm, [0.3, 0.33], [0.4, other]).is_err());
    }
}

#[test]
fn nothing_in_the_band_agrees_with_nothing() {
    let response = limb().response(&[0.5, 1.0, 2.0], ResponseKind::Compliance);
    let weight = ndarray::Array3::from_elem(response.value.dim(), 1.0);
    let outside = ndof_models::agreement(&response, &response, &weight, [5.0, 8.0]).expect("one shape");
    assert!(outside.r2.is_none() && outside.vaf_percent.iter().flatten().all(Option::is_none));
    let silent = ndof_models::agreement(&response, &response, &ndarray::Array3::zeros(response.value.dim()), [0.1, 8.0]).expect("one shape");
    assert!(silent.r2.is_none() && silent.vaf_percent.iter().flatten().all(Option::is_none));
}

#[test]
fn a_record_is_cut_into_whole_windows_and_the_last_takes_the_rest() {
    let mechanism = Mechanism::new(vec![Axis::linear("x")]);
    let force: Vec<f64> = (0..250).map(|k| (0.21 * f64::from(k)).sin() + (0.043 * f64::from(k * k)).cos()).collect();
    let motion = simulate(&mechanism, &[2.0, 14.0, 300.0], &[0.0; 2], &[&force], 100.0, 1).swap_remove(0);
    for (samples, windows) in [(100, 1), (199, 1), (200, 2), (250, 2), (60, 1)] {
        let trial = TimeTrial { force: vec![&force[..samples]], motion: vec![&motion[..samples]], velocity: vec![] };
        let settings = FreeRunFit { window_s: Some(1.0), ..FreeRunFit::new(100.0) };
        let fit = settings.fit(&mechanism, &[trial], &[1.9, 15.0, 310.0]).expect("a fit");
        assert_eq!(fit.initial.len(), 2 * windows, "{samples}");
        assert!(fit.theta.iter().zip([2.0, 14.0, 300.0]).all(|(a, b)| (a / b - 1.0).abs() < 1e-6), "{:?}", fit.theta);
    }
    // Of several starts the best is taken, wherever it stands; one of another length is refused.
    let trial = || [TimeTrial { force: vec![&force], motion: vec![&motion], velocity: vec![] }];
    let (near, far) = (vec![1.9, 15.0, 310.0], vec![1e4, 1e5, 1e-3]);
    let settings = FreeRunFit::new(100.0);
    for starts in [[near.clone(), far.clone()], [far, near.clone()]] {
        let fit = settings.fit_from(&mechanism, &trial(), &starts).expect("a fit");
        assert!((fit.theta[2] / 300.0 - 1.0).abs() < 1e-6, "{:?}", fit.theta);
    }
    assert!(settings.fit_from(&mechanism, &trial(), &[near, vec![2.0, 14.0]]).is_err());
}

#[test]
fn a_frequency_of_which_anything_is_missing_is_left_out_and_zero_is_never_used() {
    let model = InertiaDampingStiffnessModel::new(limb().axes, Symmetry::Free);
    let response = limb().response(&[0.0, 0.5, 1.0, 2.0, 4.0], ResponseKind::Compliance);
    let weight = ndarray::Array3::from_elem(response.value.dim(), 1.0);
    let bins = |response: &ndof_sysid::FrequencyResponse, weight: &ndarray::Array3<f64>| {
        PaperFit { band_hz: [0.0, 10.0] }.fit(&model, response, weight, &model.theta(&limb())).expect("a fit").bins
    };
    assert_eq!(bins(&response, &weight), 4);
    for e in 0..4 {
        let mut without = weight.clone();
        without[[2, e / 2, e % 2]] = f64::NAN;
        assert_eq!(bins(&response, &without), 3, "{e}");
    }
}

#[test]
fn one_frequency_of_three_axes_is_too_little_and_two_are_said_to_be_needed() {
    let three = InertiaDampingStiffness {
        axes: ["x", "y", "z"].map(Axis::linear).to_vec(),
        inertia: Array2::eye(3) * 2.0,
        damping: Array2::eye(3) * 12.0 + 0.5,
        stiffness: Array2::eye(3) * 300.0 + 20.0,
    };
    let response = three.response(&[1.0], ResponseKind::Compliance);
    let weight = ndarray::Array3::from_elem(response.value.dim(), 1.0);
    for symmetry in [Symmetry::Symmetric, Symmetry::Free] {
        let model = InertiaDampingStiffnessModel::new(three.axes.clone(), symmetry);
        let error = PaperFit::default().fit(&model, &response, &weight, &model.theta(&three)).err();
        assert!(matches!(error, Some(FitError::TooFewBins { bins: 1, needed: 2, .. })), "{error:?}");
    }
}

#[test]
fn a_minimum_says_which_parameters_a_bound_stops() {
    struct Towards;
    impl LeastSquares for Towards {
        fn residuals(&self, x: &[f64]) -> Vec<f64> {
            vec![x[0] - 3.0, x[1] + 2.0, x[2] - 0.5]
        }
        fn jacobian(&self, _: &[f64]) -> faer::Mat<f64> {
            faer::Mat::identity(3, 3)
        }
    }
    let found = LevenbergMarquardt::new(vec![(0.0, 1.0); 3]).minimise(&Towards, &[0.4; 3]).expect("a minimum");
    assert_eq!((found.at_bound, found.x[0], found.x[1]), (vec![true, true, false], 1.0, 0.0));
}

#[test]
fn a_law_of_fractional_order_has_the_response_of_its_order() {
    let s = Complex64::new(0.0, 9.0);
    let found = laws::find("fractional").expect("a law").response(&[40.0, 0.3], s).expect("linear");
    assert!((found - 40.0 * s.powf(0.3)).norm() < 1e-9 * found.norm());
    assert!(laws::find("cubic-stiffness").expect("a law").response(&[1e5], s).is_none());
}

#[test]
fn sides_have_the_words_that_results_use() {
    use ndof_models::effects::Side::{Actuator, Environment, Limb, Robot, Sensor};
    assert_eq!([Robot, Limb, Sensor, Actuator, Environment].map(|side| side.word()), ["robot", "limb", "sensor", "actuator", "environment"]);
}
