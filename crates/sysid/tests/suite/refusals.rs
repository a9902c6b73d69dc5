//! What cannot be estimated is refused, with the place and the remedy.

use crate::draws::{normal, seeded, spectra, stack};
use ndof_signal::{Channel, Recording, Unit};
use ndof_sysid::{Direct, EstimateError, Labels, LocalPolynomial, Ports, ResponseKind, SpectralMethod, derived, direct, estimate};
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
        let other = if f == 3 { &u * Complex64::new(0.0, 1.0) } else { normal(&mut rng, 1, 30) };
        stack(&[&u, &other, &normal(&mut rng, 1, 30)])
    });
    let (ports, labels) = two_by_one();
    let estimate = direct(&s, &ports, &labels, Direct::H1).expect("others exist");
    assert_eq!(estimate.singular_bins, [3]);
    assert!(estimate.response.value[[3, 0, 0]].re.is_nan() && estimate.response.value[[2, 0, 0]].re.is_finite());
    assert!(estimate.input_condition_number[3] > 1e8);
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
