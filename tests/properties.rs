//! What must hold for every recording, whatever its numbers: across signal, sysid and models, through the public interface.

use ndof::models::{
    Arm, Axis, InertiaDampingStiffness, InertiaDampingStiffnessModel, Kinematics, KinematicsSd, Projection, Symmetry, WeightedFit, linear_start,
};
use ndof::signal::{Channel, Multitaper, Periodic, Quantity, Recording, Unit, Welch};
use ndof::sysid::{Coherence, Direct, Estimates, Labels, LocalPolynomial, Ports, ResponseKind, SpectralMethod, estimate};
use num_complex::Complex64;
use proptest::prelude::*;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

const RATE_HZ: f64 = 100.0;
const SAMPLES: usize = 600;
/// The period of the periodic method; every other method takes the record as it comes.
const PERIOD: usize = 100;

/// Two references, two inputs that they drive, two outputs of a resonant, coupled system, and a little noise everywhere.
fn columns(seed: u64) -> Vec<Vec<f64>> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let period: Vec<Vec<f64>> = (0..2).map(|_| (0..PERIOD).map(|_| rng.random_range(-1.0..1.0)).collect()).collect();
    let mut noise = |size: f64| size * rng.random_range(-1.0..1.0);
    let reference: Vec<Vec<f64>> = period.iter().map(|p| (0..SAMPLES).map(|k| p[k % PERIOD] + noise(0.2)).collect()).collect();
    let mut input = vec![vec![0.0; SAMPLES]; 2];
    let mut output = vec![vec![0.0; SAMPLES]; 2];
    for k in 0..SAMPLES {
        for a in 0..2 {
            input[a][k] = reference[a][k] - 0.3 * reference[1 - a][k.saturating_sub(1)] + noise(0.1);
            let (one, two) = (output[a][k.saturating_sub(1)], output[a][k.saturating_sub(2)]);
            output[a][k] = 1.2 * one - 0.6 * two + input[a][k] + 0.2 * input[1 - a][k] + noise(0.1);
        }
    }
    reference.into_iter().chain(input).chain(output).collect()
}

/// The columns at `order`, the one at place k multiplied by `factor[order[k]]`.
fn recording(columns: &[Vec<f64>], order: &[usize], factor: &[f64]) -> Recording {
    let quantity = |k: usize| if k < 4 { Quantity::Effort } else { Quantity::Displacement };
    let channels = order.iter().map(|&k| Channel::new(format!("c{k}"), Unit::si(quantity(k), false), columns[k].iter().map(|v| v * factor[k]).collect()));
    Recording::new(RATE_HZ, channels.collect()).expect("equal lengths")
}

fn ports() -> Ports {
    Ports { references: vec![0, 1], inputs: vec![2, 3], outputs: vec![4, 5] }
}

fn methods() -> Vec<SpectralMethod> {
    vec![
        SpectralMethod::Welch(Welch::new(128)),
        SpectralMethod::Multitaper(Multitaper { time_bandwidth: 5.0, ..Multitaper::default() }),
        SpectralMethod::LocalPolynomial(LocalPolynomial::default()),
        SpectralMethod::Periodic(Periodic { period: PERIOD, discard: 0 }),
    ]
}

fn run(trials: &[Recording], ports: &Ports, method: &SpectralMethod) -> Estimates {
    let trials: Vec<&Recording> = trials.iter().collect();
    estimate(&trials, ports, &Labels::of(trials[0], ports), method, Direct::H1).expect("an estimate")
}

/// Three trials, since one realisation of a periodic force cannot tell two inputs apart.
fn trials(seed: u64, order: &[usize; 6], factor: &[f64]) -> Vec<Recording> {
    (0..3).map(|trial| recording(&columns(seed + 100_000 * trial), order, factor)).collect()
}

const IN_ORDER: [usize; 6] = [0, 1, 2, 3, 4, 5];

/// Coherences of the direct and the derived estimate.
fn coherences(found: &Estimates) -> Vec<&Coherence> {
    let derived = found.derived.as_ref().expect("references");
    vec![&found.direct.coherence, &derived.coherence_paper, &derived.coherence_iv]
}

/// Condition times round-off, for systems as mild as these.
const ROUND_OFF: f64 = 1e-8;

fn close(a: Complex64, b: Complex64, scale: f64) -> bool {
    (a.re.is_nan() && b.re.is_nan()) || (a - b).norm() <= ROUND_OFF * scale
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn units_and_order_of_channels_change_the_response_as_they_must_and_no_coherence(seed in 0..10_000_u64, unit in prop::collection::vec(-6..6_i32, 6)) {
        let factor: Vec<f64> = unit.iter().map(|&u| 10.0_f64.powi(u)).collect();
        let plain = trials(seed, &IN_ORDER, &[1.0; 6]);
        let other = trials(seed, &[5, 3, 1, 4, 2, 0], &factor);
        let turned = Ports { references: vec![5, 2], inputs: vec![4, 1], outputs: vec![3, 0] };
        for method in methods() {
            let [a, b] = [(&plain, ports()), (&other, turned.clone())].map(|(r, p)| run(r, &p, &method));
            for (one, two) in [(&a.direct.response, &b.direct.response), (&a.derived.as_ref().expect("both").response, &b.derived.as_ref().expect("both").response)] {
                prop_assert_eq!(&one.frequency_hz, &two.frequency_hz);
                for ((f, i, j), value) in one.value.indexed_iter() {
                    let scale = factor[4 + i] / factor[2 + j];
                    let largest = one.value.index_axis(ndarray::Axis(0), f).iter().fold(0.0_f64, |m, v| m.max(v.norm()));
                    prop_assert!(close(*value, two.value[[f, i, j]] / scale, largest), "{} at bin {f}: {value} {}", method.name(), two.value[[f, i, j]] / scale);
                }
            }
            for (one, two) in coherences(&a).into_iter().zip(coherences(&b)) {
                for (x, y) in one.partial.iter().chain(&one.multiple).zip(two.partial.iter().chain(&two.multiple)) {
                    prop_assert!((x.is_nan() && y.is_nan()) || (x - y).abs() < 1e-6, "{}: {x} {y}", method.name());
                }
            }
        }
    }

    #[test]
    fn coherences_lie_between_zero_and_one_and_the_multiple_one_is_the_largest(seed in 0..10_000_u64) {
        let trials = trials(seed, &IN_ORDER, &[1.0; 6]);
        for method in methods() {
            let found = run(&trials, &ports(), &method);
            for coherence in coherences(&found) {
                for ((f, i, j), &partial) in coherence.partial.indexed_iter() {
                    let multiple = coherence.multiple[[f, i]];
                    prop_assert!(partial.is_nan() || ((0.0..=1.0).contains(&partial) && partial <= multiple * (1.0 + ROUND_OFF)), "{}: {f} {i} {j}", method.name());
                }
            }
        }
    }

    #[test]
    fn the_order_of_trials_does_not_matter_nor_does_the_number_of_threads(seed in 0..10_000_u64) {
        let trials = trials(seed, &IN_ORDER, &[1.0; 6]);
        let turned = [trials[2].clone(), trials[0].clone(), trials[1].clone()];
        for method in methods() {
            let threads = |n| rayon::ThreadPoolBuilder::new().num_threads(n).build().expect("a pool").install(|| run(&trials, &ports(), &method));
            let [one, three] = [threads(1), threads(3)];
            // Debug prints every digit that distinguishes two numbers, and NaN as equal to itself.
            prop_assert_eq!(format!("{one:?}"), format!("{three:?}"));
            let turned = run(&turned, &ports(), &method);
            for (a, b) in one.direct.response.value.iter().zip(&turned.direct.response.value) {
                prop_assert!(close(*a, *b, a.norm().max(1e-3)), "{}", method.name());
            }
        }
    }

    #[test]
    fn any_numbers_give_an_estimate_or_a_reason(
        values in prop::collection::vec(prop_oneof![4 => -1.0..1.0_f64, 1 => any::<f64>(), 1 => Just(0.0), 1 => Just(1e300), 1 => Just(-1e-300)], 6 * 64..6 * 200)
    ) {
        let samples = values.len() / 6;
        let columns: Vec<Vec<f64>> = values.chunks_exact(samples).take(6).map(<[f64]>::to_vec).collect();
        let trial = recording(&columns, &IN_ORDER, &[1.0; 6]);
        for method in [SpectralMethod::Welch(Welch::new(32)), SpectralMethod::LocalPolynomial(LocalPolynomial::default()), SpectralMethod::Periodic(Periodic { period: 16, discard: 0 })] {
            match estimate(&[&trial], &ports(), &Labels::of(&trial, &ports()), &method, Direct::H1) {
                Ok(found) => {
                    for &c in &found.direct.coherence.multiple {
                        prop_assert!(c.is_nan() || (-1e-9..=1.0 + 1e-9).contains(&c), "{}: {c}", method.name());
                    }
                }
                Err(reason) => prop_assert!(!reason.to_string().is_empty()),
            }
        }
    }

    #[test]
    fn a_response_survives_the_way_to_any_kind_and_back(seed in 0..10_000_u64) {
        let trials = trials(seed, &IN_ORDER, &[1.0; 6]);
        let found = run(&trials, &ports(), &SpectralMethod::Welch(Welch::new(128))).direct.response.band(1.0, 40.0);
        prop_assert_eq!(found.kind, ResponseKind::Compliance);
        for kind in [ResponseKind::DynamicStiffness, ResponseKind::Impedance, ResponseKind::Admittance] {
            let back = found.to_kind(kind).and_then(|r| r.to_kind(ResponseKind::Compliance)).expect("square");
            for ((f, i, j), value) in found.value.indexed_iter() {
                let largest = found.value.index_axis(ndarray::Axis(0), f).iter().fold(0.0_f64, |m, v| m.max(v.norm()));
                prop_assert!(close(*value, back.value[[f, i, j]], largest), "{kind:?}");
                prop_assert!((found.variance(f, i, j) / back.variance(f, i, j) - 1.0).abs() < 1e-6, "{kind:?}");
            }
        }
    }

    #[test]
    fn impedance_at_the_hand_comes_back_from_the_joints_and_stays_positive(
        entries in prop::collection::vec(0.1..2.0_f64, 9), shoulder in -1.0..1.5_f64, elbow in 0.3..2.6_f64, force in prop::collection::vec(-20.0..20.0_f64, 2)
    ) {
        // L Lᵀ of each triple of entries.
        let matrix = |k: usize| {
            let [a, b, c] = [entries[3 * k], entries[3 * k + 1], entries[3 * k + 2]];
            ndarray::array![[a * a, a * b], [a * b, b * b + c * c]]
        };
        let kinematics = Kinematics::planar_two_link(Arm::Right, [0.3, 0.33], [shoulder, elbow]).expect("lengths");
        let axes = vec![Axis::linear("x"), Axis::linear("y")];
        let hand = InertiaDampingStiffness { axes, inertia: matrix(0), damping: matrix(1), stiffness: matrix(2) };
        let j = kinematics.jacobian();
        let inverse = ndarray::array![[j[[1, 1]], -j[[0, 1]]], [-j[[1, 0]], j[[0, 0]]]] / (j[[0, 0]] * j[[1, 1]] - j[[0, 1]] * j[[1, 0]]);
        for force in [vec![0.0, 0.0], force] {
            let projection = Projection { kinematics: kinematics.clone(), mean_force_n: force.clone(), sd: KinematicsSd::default() };
            let mut joint = projection.matrices_to_joints(&hand).expect("not singular");
            joint.stiffness -= &kinematics.geometric_stiffness(&force);
            let backwards = Projection { kinematics: Kinematics::Jacobian { matrix: inverse.clone() }, mean_force_n: vec![0.0; 2], sd: KinematicsSd::default() };
            let back = backwards.matrices_to_joints(&joint).expect("not singular");
            for (a, b) in [(&hand.inertia, &back.inertia), (&hand.damping, &back.damping), (&hand.stiffness, &back.stiffness)] {
                let largest = a.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
                prop_assert!(a.iter().zip(b).all(|(x, y)| (x - y).abs() < ROUND_OFF * largest));
            }
            // A congruence keeps the sign of definite matrices; the mean force only touches the stiffness.
            for m in [&joint.inertia, &joint.damping] {
                prop_assert!(m[[0, 0]] > 0.0 && m[[0, 0]] * m[[1, 1]] - m[[0, 1]] * m[[1, 0]] > 0.0);
            }
        }
    }

    #[test]
    fn a_fit_does_not_depend_on_the_name_of_the_axes(seed in 0..10_000_u64) {
        let model = InertiaDampingStiffnessModel::new(vec![Axis::linear("x"), Axis::linear("y")], Symmetry::Symmetric);
        let fit = |order: [usize; 6]| {
            let trials = trials(seed, &order, &[1.0; 6]);
            let found = run(&trials, &ports(), &SpectralMethod::Welch(Welch::new(128)));
            let settings = WeightedFit { band_hz: [2.0, 12.0], ..WeightedFit::default() };
            let start = linear_start(&model, &found.direct.response.band(2.0, 12.0)).expect("a start");
            settings.fit(&model, &found.direct.response, &start).expect("a fit")
        };
        let (plain, turned) = (fit([0, 1, 2, 3, 4, 5]), fit([1, 0, 3, 2, 5, 4]));
        // xx, xy, yy become yy, xy, xx; a minimum is found to the square root of round-off in θ, to round-off in the cost.
        prop_assert!((plain.chi2 - turned.chi2).abs() <= 1e-6 * plain.chi2, "{} {}", plain.chi2, turned.chi2);
        for (k, p) in plain.parameters.iter().enumerate() {
            let other = &turned.parameters[k / 3 * 3 + 2 - k % 3];
            prop_assert!((p.value - other.value).abs() <= 1e-2 * p.std_error, "{} {} {} {}", p.name, p.value, other.name, other.value);
        }
    }
}
