//! Numbers at the edge of what there is: a typed error or what is right, never something that only looks right.

use crate::draws::seeded;
use ndof_signal::{Channel, Multitaper, Quantity, Recording, Unit, Welch};
use ndof_sysid::{
    Direct, EstimateError, Estimates, Labels, LocalPolynomial, LocalRational, Ports, SpectralMethod, estimate, estimate_from_spectra, robust_spectra,
};
use rand::RngExt;
use rand_distr::StandardNormal;

const SAMPLES: usize = 2000;
/// Two computations of the same thing in another order of magnitude: some thousand roundings.
const SAME: f64 = 1e-9;

fn white(seed: u64) -> Vec<f64> {
    let mut rng = seeded(seed);
    (0..SAMPLES).map(|_| rng.sample(StandardNormal)).collect()
}

/// y(k) = 0.5 u(k) + 0.4 u(k − 1) with a little noise.
fn filtered(u: &[f64], seed: u64) -> Vec<f64> {
    let noise = white(seed);
    (0..u.len()).map(|k| 0.5 * u[k] + 0.4 * u[k.saturating_sub(1)] + 0.01 * noise[k]).collect()
}

fn methods() -> Vec<SpectralMethod> {
    vec![
        SpectralMethod::Welch(Welch::new(128)),
        SpectralMethod::Multitaper(Multitaper::default()),
        SpectralMethod::LocalPolynomial(LocalPolynomial::default()),
        SpectralMethod::LocalRational(LocalRational::default()),
    ]
}

fn run(inputs: &[&[f64]], outputs: &[&[f64]], method: &SpectralMethod) -> Result<Estimates, EstimateError> {
    let effort = |(k, x): (usize, &&[f64])| Channel::new(format!("force_{k}"), Unit::si(Quantity::Effort, false), x.to_vec());
    let motion = |(k, x): (usize, &&[f64])| Channel::new(format!("pos_{k}"), Unit::si(Quantity::Displacement, false), x.to_vec());
    let channels = inputs.iter().enumerate().map(effort).chain(outputs.iter().enumerate().map(motion)).collect();
    let recording = Recording::new(100.0, channels).expect("a recording");
    let ports = Ports { references: vec![], inputs: (0..inputs.len()).collect(), outputs: (inputs.len()..inputs.len() + outputs.len()).collect() };
    estimate(&[&recording], &ports, &Labels::of(&recording, &ports), method, Direct::H1)
}

#[test]
fn units_from_the_smallest_to_the_largest_give_the_same_response_or_are_refused() {
    let u = white(1);
    let y = filtered(&u, 2);
    for method in methods() {
        let truth = run(&[&u], &[&y], &method).expect("an estimate").direct.response.value;
        let mut answers = 0;
        for (a, b) in [
            (-1074, -1074),
            (-1000, 0),
            (0, -1000),
            (-540, -540),
            (-520, 500),
            (-100, 100),
            (-180, -180),
            (180, -180),
            (500, -520),
            (520, 520),
            (0, 1000),
            (1000, 1000),
        ] {
            let scaled = |x: &[f64], power: i32| x.iter().map(|v| v * 2f64.powi(power / 2) * 2f64.powi(power - power / 2)).collect::<Vec<f64>>();
            match run(&[&scaled(&u, a)], &[&scaled(&y, b)], &method) {
                Ok(found) => {
                    answers += 1;
                    for (one, other) in found.direct.response.value.iter().zip(&truth) {
                        let back = one * 2f64.powi((a - b) / 2) * 2f64.powi((a - b) - (a - b) / 2);
                        let same = (back - other).norm() <= SAME * other.norm() || (one.is_nan() && other.is_nan());
                        assert!(same, "{}: 2^{a}, 2^{b}: {back} is not {other}", method.name());
                    }
                }
                Err(error) => assert!(matches!(error, EstimateError::Size { .. } | EstimateError::Silent { .. }), "2^{a}, 2^{b}: {error}"),
            }
        }
        assert!(answers >= 2, "{}: {answers}", method.name());
    }
}

#[test]
fn constant_and_empty_channels_are_named_or_have_no_response() {
    let u = white(3);
    let still = vec![7.5; SAMPLES];
    let zero = vec![0.0; SAMPLES];
    for method in methods() {
        for silent in [&still, &zero] {
            let error = run(&[silent], &[&filtered(&u, 4)], &method).err();
            assert!(matches!(&error, Some(EstimateError::Silent { name, .. }) if name == "force_0"), "{}: {error:?}", method.name());
            // What does not move answers nothing: the response is zero to rounding.
            let found = run(&[&u], &[silent], &method).expect("an estimate");
            let largest = found.direct.response.value.iter().filter(|v| v.re.is_finite()).map(|v| v.norm()).fold(0.0, f64::max);
            assert!(largest < 1e-10, "{}: {largest}", method.name());
            assert!(found.direct.coherence.multiple.iter().all(|c| c.is_nan() || (-SAME..=1.0 + SAME).contains(c)));
        }
    }
}

#[test]
fn inputs_of_less_than_full_rank_are_named() {
    let (a, b) = (white(5), white(6));
    let sum: Vec<f64> = a.iter().zip(&b).map(|(a, b)| a + 2.0 * b).collect();
    let y = filtered(&a, 7);
    for method in methods() {
        let error = run(&[&a, &b, &sum], &[&y], &method).err();
        assert!(matches!(&error, Some(EstimateError::Dependent { names, .. }) if names.len() >= 2), "{}: {error:?}", method.name());
    }
}

#[test]
fn references_that_are_one_are_named_by_every_method() {
    let (reference, own) = (white(20), white(21));
    let u: Vec<f64> = reference.iter().zip(&own).map(|(r, own)| r + own).collect();
    let channels = [("a", reference.clone()), ("b", reference.iter().map(|r| 2.0 * r).collect()), ("u", u.clone()), ("y", filtered(&u, 22))];
    let channels = channels.map(|(name, samples)| Channel::new(name, Unit::si(Quantity::Effort, false), samples));
    let recording = Recording::new(100.0, channels.to_vec()).expect("a recording");
    let ports = Ports { references: vec![0, 1], inputs: vec![2], outputs: vec![3] };
    for method in methods() {
        let error = estimate(&[&recording], &ports, &Labels::of(&recording, &ports), &method, Direct::H1).err();
        assert!(matches!(&error, Some(EstimateError::Dependent { role: "reference", names }) if names == &["a", "b"]), "{}: {error:?}", method.name());
    }
}

#[test]
fn frequency_zero_has_no_answer_after_the_mean_is_gone_and_nyquist_has_a_real_one() {
    let u = white(8);
    let found = run(&[&u], &[&filtered(&u, 9)], &SpectralMethod::Welch(Welch::new(128))).expect("an estimate");
    let response = &found.direct.response;
    let last = response.len() - 1;
    assert_eq!((response.frequency_hz[0], response.frequency_hz[last]), (0.0, 50.0));
    assert!(response.value[[0, 0, 0]].re.is_nan());
    // H(π) = 0.5 − 0.4, seen through the window; both transforms are real there.
    assert!((response.value[[last, 0, 0]].re - 0.1).abs() < 0.02 && response.value[[last, 0, 0]].im == 0.0, "{}", response.value[[last, 0, 0]]);
}

#[test]
fn one_segment_is_refused_by_each_method_that_averages() {
    let u = white(10);
    let y = filtered(&u, 11);
    for method in [SpectralMethod::Welch(Welch::new(SAMPLES)), SpectralMethod::Multitaper(Multitaper { tapers: Some(1), ..Multitaper::default() })] {
        let error = run(&[&u], &[&y], &method).err();
        assert!(matches!(error, Some(EstimateError::TooFewAverages { .. })), "{}: {error:?}", method.name());
    }
}

#[test]
fn sizes_that_powers_cannot_be_computed_of_are_refused_without_wrecked_segments_too() {
    // Found by fuzzing: the coherence was infinite.
    let (u, y) = (white(12), filtered(&white(12), 13));
    for scale in [1e117, 1e-117] {
        let channel = |name: &str, quantity, x: &[f64]| Channel::new(name, Unit::si(quantity, false), x.iter().map(|v| v * scale).collect());
        let recording =
            Recording::new(100.0, vec![channel("force_0", Quantity::Effort, &u), channel("pos_0", Quantity::Displacement, &y)]).expect("a recording");
        let ports = Ports { references: vec![], inputs: vec![0], outputs: vec![1] };
        let error = robust_spectra(&[&recording], &ports, &Welch::new(128)).err();
        assert!(matches!(&error, Some(EstimateError::Size { name, .. }) if name.contains("force_0")), "{scale}: {error:?}");
        // Spectra that were summed elsewhere have no samples to look at.
        let spectra = Welch::new(128).spectra(100.0, &recording.columns(&[0, 1])).expect("spectra");
        let error = estimate_from_spectra(spectra, &ports, &Labels::of(&recording, &ports), &SpectralMethod::Welch(Welch::new(128)), Direct::H1).err();
        assert!(matches!(&error, Some(EstimateError::Size { name, .. }) if name.contains("force_0")), "{scale}: {error:?}");
    }
}
