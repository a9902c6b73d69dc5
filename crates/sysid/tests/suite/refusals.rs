//! What cannot be estimated is refused, with the place and the remedy.

use crate::draws::{normal, seeded, spectra, stack};
use ndof_signal::{Channel, CrossSpectra, Kernel, Multitaper, Periodic, Recording, SpectraError, Unit, Welch};
use ndof_sysid::{
    Direct, EstimateError, Labels, LocalPolynomial, LocalRational, Ports, ResponseKind, SpectralMethod, derived, direct, estimate, robust_spectra,
};
use num_complex::Complex64;

fn two_by_one() -> (Ports, Labels) {
    let ports = Ports { references: vec![], inputs: vec![0, 1], outputs: vec![2] };
    let labels = Labels { references: vec![], inputs: vec!["force_x".into(), "force_y".into()], outputs: vec!["pos_x".into()], kind: ResponseKind::Compliance };
    (ports, labels)
}

#[test]
fn one_segment_only_is_refused_because_its_coherence_is_always_one() {
    let mut rng = seeded(1);
    let s = spectra(5, |_| normal(&mut rng, 2, 1));
    let ports = Ports { references: vec![], inputs: vec![0], outputs: vec![1] };
    let error = direct(&s, &ports, &Labels::numbered(&ports, ResponseKind::Transfer), Direct::H1).expect_err("one average");
    assert!(matches!(error, EstimateError::TooFewAverages { unknowns: 1, .. }));
    assert!(error.to_string().contains("--nperseg"), "{error}");
}

#[test]
fn inputs_that_are_copies_are_named() {
    let mut rng = seeded(2);
    let s = spectra(5, |_| {
        let u = normal(&mut rng, 1, 30);
        stack(&[&u, &(&u * Complex64::new(-2.0, 0.5)), &normal(&mut rng, 1, 30)])
    });
    let (ports, labels) = two_by_one();
    let error = direct(&s, &ports, &labels, Direct::H1).expect_err("copies");
    assert_eq!(error, EstimateError::Dependent { role: "input", names: vec!["force_x".into(), "force_y".into()] });
}

#[test]
fn copies_at_one_frequency_cost_that_frequency_only() {
    let mut rng = seeded(3);
    let s = spectra(5, |f| {
        let u = normal(&mut rng, 1, 30);
        // At one all but a copy, which could be inverted.
        let own = normal(&mut rng, 1, 30);
        let other = match f {
            3 => &u * Complex64::new(0.0, 1.0),
            4 => &u + &(own * Complex64::from(1e-5)),
            _ => own,
        };
        stack(&[&u, &other, &normal(&mut rng, 1, 30)])
    });
    let (ports, labels) = two_by_one();
    let estimate = direct(&s, &ports, &labels, Direct::H1).expect("others exist");
    assert_eq!(estimate.singular_bins, [3, 4]);
    for f in 1..5 {
        assert!(estimate.response.value.index_axis(ndarray::Axis(0), f).iter().all(|v| v.re.is_nan() == (f > 2)));
        assert!(estimate.coherence.multiple[[f, 0]].is_nan() == (f > 2) && estimate.input_coherence[[f, 0, 1]].is_finite());
        assert!((estimate.input_condition_number[f] > 1e8) == (f > 2));
    }
}

#[test]
fn a_silent_input_is_named() {
    let mut rng = seeded(4);
    let s = spectra(5, |_| stack(&[&normal(&mut rng, 1, 30), &(normal(&mut rng, 1, 30) * Complex64::from(0.0)), &normal(&mut rng, 1, 30)]));
    let (ports, labels) = two_by_one();
    let error = direct(&s, &ports, &labels, Direct::H1).expect_err("silent");
    assert_eq!(error, EstimateError::Silent { role: "input", name: "force_y".into() });
}

#[test]
fn fewer_references_than_inputs_are_refused() {
    let mut rng = seeded(5);
    let s = spectra(5, |_| normal(&mut rng, 4, 30));
    let ports = Ports { references: vec![3], inputs: vec![0, 1], outputs: vec![2] };
    let error = derived(&s, &ports, &Labels::numbered(&ports, ResponseKind::Transfer)).expect_err("one reference");
    assert_eq!(error, EstimateError::TooFewReferences { references: 1, inputs: 2 });
}

#[test]
fn h2_of_a_system_that_is_not_square_is_refused() {
    let mut rng = seeded(6);
    let s = spectra(5, |_| normal(&mut rng, 3, 30));
    let (ports, labels) = two_by_one();
    assert!(matches!(direct(&s, &ports, &labels, Direct::H2), Err(EstimateError::NotSquare { .. })));
    assert!(direct(&s, &ports, &labels, Direct::Hv).is_ok());
}

#[test]
fn h2_by_a_method_without_spectra_is_refused_and_not_silently_h1() {
    let channel = |name: &str| Channel::new(name, Unit::other(""), (0..500).map(|k| f64::from(k * k % 17)).collect());
    let trial = Recording::new(10.0, vec![channel("u"), channel("y")]).expect("equal lengths");
    let ports = Ports { references: vec![], inputs: vec![0], outputs: vec![1] };
    let method = SpectralMethod::LocalPolynomial(LocalPolynomial::default());
    let error = estimate(&[&trial], &ports, &Labels::of(&trial, &ports), &method, Direct::H2).expect_err("no spectra");
    assert_eq!(error, EstimateError::NoSpectra { estimator: Direct::H2, method: "local-polynomial" });
}

#[test]
fn trials_of_other_channels_or_another_rate_are_refused_by_every_method() {
    let channel = |name: &str, k: u32| Channel::new(name, Unit::other(""), (0..400).map(|n: u32| f64::from((n * n + k * n) % 17)).collect());
    let trial =
        |rate_hz: f64, names: &[&str]| Recording::new(rate_hz, names.iter().zip(1..).map(|(name, k)| channel(name, k)).collect()).expect("equal lengths");
    let (first, ports) = (trial(10.0, &["u", "y"]), Ports { references: vec![], inputs: vec![0], outputs: vec![1] });
    let methods = [
        SpectralMethod::Welch(Welch::new(32)),
        SpectralMethod::Multitaper(Multitaper::default()),
        SpectralMethod::LocalPolynomial(LocalPolynomial::default()),
        SpectralMethod::LocalRational(LocalRational::default()),
        SpectralMethod::Periodic(Periodic { period: 40, discard: 1 }),
    ];
    for (other, expected) in [(trial(10.0, &["u"]), "channels"), (trial(10.0, &["u", "y", "z"]), "channels"), (trial(12.0, &["u", "y"]), "Hz sample rate")] {
        let labels = Labels::of(&first, &ports);
        for method in &methods {
            let error = estimate(&[&first, &other], &ports, &labels, method, Direct::H1).expect_err("another experiment");
            assert!(matches!(error, EstimateError::Pool(SpectraError::Mismatch { trial: 2, what, .. }) if what == expected), "{}: {error}", method.name());
        }
        assert!(matches!(robust_spectra(&[&first, &other], &ports, &Welch::new(32)), Err(EstimateError::Pool(_))));
    }
}

#[test]
fn references_that_are_copies_at_one_frequency_cost_that_frequency_only() {
    let mut rng = seeded(8);
    let s = spectra(12, |f| {
        let r = normal(&mut rng, 1, 30);
        let own = normal(&mut rng, 1, 30);
        let other = match f {
            9 => &r * Complex64::new(0.0, 1.0),
            10 => &r + &(&own * Complex64::from(1e-5)),
            _ => own.clone(),
        };
        let u = &own + &(&r * Complex64::new(0.3, 0.0));
        stack(&[&r, &other, &u, &(&u + &normal(&mut rng, 1, 30))])
    });
    let ports = Ports { references: vec![0, 1], inputs: vec![2], outputs: vec![3] };
    let found = derived(&s, &ports, &Labels::numbered(&ports, ResponseKind::Transfer)).expect("others exist");
    assert_eq!(found.singular_bins, [9, 10]);
    for f in 0..12 {
        let all = [
            found.response.value[[f, 0, 0]].re,
            found.response.variance(f, 0, 0),
            found.to_reference.r.value[[f, 0, 1]].re,
            found.to_reference.t.value[[f, 0, 1]].re,
            found.to_reference.t.variance(f, 0, 1),
            found.to_reference.input_coherence[[f, 0]],
            found.to_reference.output_coherence[[f, 0]],
            found.coherence_paper.multiple[[f, 0]],
            found.coherence_iv.partial[[f, 0, 0]],
            found.instrument_strength[f],
        ];
        assert!(all.iter().all(|v| v.is_nan() == [0, 9, 10].contains(&f)), "{f}: {all:?}");
        assert!(!found.weak_instrument[f]);
    }
}

/// u₁ = r₁ + n₁, u₂ = 2 r₁ + a r₂ + n₂, y = u₁ + u₂ + n, all of unit power: where a is 0, both inputs are known and none of them apart.
#[test]
fn inputs_that_references_move_as_one_have_no_estimate_there() {
    let of = |a: f64| [1.0, 0.0, 1.0, 1.0, 0.0, 2.0, 2.0, a, 2.0, 5.0 + a * a, 3.0, a, 4.0, 7.0 + a * a, 12.0 + a * a];
    let lower = of(0.0).into_iter().zip(of(1.0)).flat_map(|(apart, told)| [told, apart, told]).map(Complex64::from).collect();
    let spectra = CrossSpectra::from_parts(5, 100.0, vec![0.0, 1.0, 2.0], lower, 40.0, 40, 1.0, Kernel::default());
    let ports = Ports { references: vec![0, 1], inputs: vec![2, 3], outputs: vec![4] };
    let found = derived(&spectra, &ports, &Labels::numbered(&ports, ResponseKind::Transfer)).expect("one frequency is left");
    assert_eq!(found.singular_bins, [1]);
    assert!(found.response.value[[1, 0, 0]].is_nan() && found.instrument_strength[1].is_nan() && found.to_reference.r.value[[1, 0, 0]].is_nan());
    assert!((0..2).all(|j| (found.response.value[[2, 0, j]] - 1.0).norm() < 1e-13));
}

#[test]
fn of_three_inputs_the_two_that_are_copies_are_named_and_all_where_no_two_are() {
    let mut rng = seeded(9);
    let mut error = |copy: bool| {
        let s = spectra(6, |_| {
            let (a, b) = (normal(&mut rng, 1, 30) * Complex64::from(1e3), normal(&mut rng, 1, 30) * Complex64::from(30.0));
            let c = if copy { &a * Complex64::new(0.5, 2.0) } else { &a + &(&b * Complex64::from(30.0)) };
            stack(&[&a, &b, &c, &normal(&mut rng, 1, 30)])
        });
        let ports = Ports { references: vec![], inputs: vec![0, 1, 2], outputs: vec![3] };
        direct(&s, &ports, &Labels::numbered(&ports, ResponseKind::Transfer), Direct::H1).expect_err("dependent")
    };
    assert_eq!(error(true), EstimateError::Dependent { role: "input", names: vec!["u1".into(), "u3".into()] });
    assert_eq!(error(false), EstimateError::Dependent { role: "input", names: vec!["u1".into(), "u2".into(), "u3".into()] });
}

#[test]
fn the_trial_that_is_too_short_for_a_segment_is_named() {
    let trial =
        |n: u32| Recording::new(10.0, ["u", "y"].map(|name| Channel::new(name, Unit::other(""), (0..n).map(|k| f64::from(k * k % 17)).collect())).to_vec());
    let (long, short) = (trial(400).expect("equal lengths"), trial(20).expect("equal lengths"));
    let ports = Ports { references: vec![], inputs: vec![0], outputs: vec![1] };
    assert!(matches!(robust_spectra(&[&long, &long, &short], &ports, &Welch::new(32)), Err(EstimateError::Welch { trial: 3, .. })));
}

#[test]
fn a_local_fit_needs_as_many_lines_as_its_window_has() {
    let ports = Ports { references: vec![], inputs: vec![0], outputs: vec![1] };
    let method = SpectralMethod::LocalPolynomial(LocalPolynomial { half_width: Some(6), ..LocalPolynomial::default() });
    // 27 samples have 13 lines between 0 Hz and Nyquist, 26 have 12.
    for (samples, enough) in [(27, true), (26, false)] {
        let channel = |name: &str, k: u32| Channel::new(name, Unit::other(""), (0..samples).map(|n: u32| f64::from((n * n * k + 3 * n) % 17)).collect());
        let trial = Recording::new(10.0, vec![channel("u", 1), channel("y", 2)]).expect("equal lengths");
        let found = estimate(&[&trial], &ports, &Labels::of(&trial, &ports), &method, Direct::H1);
        let refused = matches!(found, Err(EstimateError::TooFewLines { lines: 12, needed: 13 }));
        assert!(found.is_ok() == enough && refused != enough, "{samples}");
    }
}
