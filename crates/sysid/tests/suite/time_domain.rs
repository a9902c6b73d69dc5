//! Whole estimations from samples: leakage, resonance, periodic excitation, closed loop.

use crate::draws::seeded;
use crate::periodic::multisine;
use ndof_signal::{Channel, Multitaper, Periodic, Quantity, Recording, Unit, Welch};
use ndof_sysid::{
    Direct, Estimates, FrequencyResponse, Labels, LocalPolynomial, LocalRational, Ports, SpectralMethod, choose_method, estimate, estimate_from_spectra,
    robust_spectra, sliding, unresolved,
};
use num_complex::Complex64;
use rand::RngExt;
use rand_distr::StandardNormal;
use std::f64::consts::TAU;

/// A mass, a damper and a spring as an exact discrete filter x_{k+1} = 2 e^{−a} cos(b) x_k − e^{−2a} x_{k−1} + g u_k,
/// whose response is known in closed form.
#[derive(Clone, Copy)]
pub struct Resonance {
    a1: f64,
    a2: f64,
    gain: f64,
    rate: f64,
}

impl Resonance {
    /// The next value after `y1` and, before it, `y2`.
    pub fn next(&self, y1: f64, y2: f64, input: f64) -> f64 {
        self.a1 * y1 + self.a2 * y2 + self.gain * input
    }

    pub fn new(frequency_hz: f64, damping: f64, rate: f64) -> Self {
        let w = TAU * frequency_hz / rate;
        let (decay, turn) = ((-damping * w).exp(), w * (1.0 - damping * damping).sqrt());
        let (a1, a2) = (2.0 * decay * turn.cos(), -decay * decay);
        Resonance { a1, a2, gain: 1.0 - a1 - a2, rate }
    }

    pub fn respond(&self, input: &[f64]) -> Vec<f64> {
        let (mut y1, mut y2) = (0.0, 0.0);
        let step = |u: &f64| {
            let y = self.next(y1, y2, *u);
            (y2, y1) = (y1, y);
            y
        };
        input.iter().map(step).collect()
    }

    pub fn at(&self, frequency_hz: f64) -> Complex64 {
        let z = Complex64::from_polar(1.0, -TAU * frequency_hz / self.rate);
        self.gain / (1.0 - self.a1 * z - self.a2 * z * z)
    }
}

pub fn noise(seed: u64, n: usize) -> Vec<f64> {
    let mut rng = seeded(seed);
    (0..n).map(|_| rng.sample(StandardNormal)).collect()
}

pub fn recording(rate: f64, channels: Vec<(&str, Vec<f64>)>) -> Recording {
    let channels = channels.into_iter().map(|(name, samples)| {
        let quantity = if name.starts_with("pos") { Quantity::Displacement } else { Quantity::Effort };
        Channel::new(name, Unit::si(quantity, false), samples)
    });
    Recording::new(rate, channels.collect()).expect("equal lengths")
}

pub fn run(trials: &[Recording], ports: &Ports, method: SpectralMethod) -> Estimates {
    let trials: Vec<&Recording> = trials.iter().collect();
    estimate(&trials, ports, &Labels::of(trials[0], ports), &method, Direct::H1).expect("estimate")
}

/// Largest |H − truth| around the peak over the peak's height.
fn peak_error(response: &FrequencyResponse, truth: Resonance, peak_hz: f64) -> f64 {
    let height = truth.at(peak_hz).norm();
    let near = (0..response.len()).filter(|&f| (response.frequency_hz[f] - peak_hz).abs() < 0.3);
    near.map(|f| (response.value[[f, 0, 0]] - truth.at(response.frequency_hz[f])).norm() / height).fold(0.0, f64::max)
}

pub fn one_input() -> Ports {
    Ports { references: vec![], inputs: vec![0], outputs: vec![1] }
}

#[test]
fn local_methods_resolve_a_resonance_that_welch_flattens() {
    let (rate, peak_hz, factor) = (500.0, 5.0, 5.0);
    let polynomial = |order: usize| SpectralMethod::LocalPolynomial(LocalPolynomial { order, ..LocalPolynomial::default() });
    let rational = SpectralMethod::LocalRational(LocalRational::default());
    // At a damping of 0.01 a 50 s record has five lines in the half-power width, too few for any polynomial.
    for (damping, duration_s, method) in
        [(0.05, 50, polynomial(2)), (0.02, 50, polynomial(4)), (0.01, 200, polynomial(4)), (0.02, 50, rational.clone()), (0.01, 50, rational)]
    {
        let (system, n) = (Resonance::new(peak_hz, damping, rate), 500 * duration_s);
        let (mut welch_worst, mut local_worst) = (0.0, 0.0);
        for seed in 0..4 {
            let force = noise(seed, n);
            let output = system.respond(&force);
            let trial = [recording(rate, vec![("force", force), ("pos", output)])];
            let welch = run(&trial, &one_input(), SpectralMethod::Welch(Welch::new(8192)));
            let local = run(&trial, &one_input(), method.clone());
            welch_worst += peak_error(&welch.direct.response, system, peak_hz);
            local_worst += peak_error(&local.direct.response, system, peak_hz);
        }
        println!(
            "damping {damping}, {duration_s} s: Welch {:.4}, {} {:.5}, ratio {:.1}",
            welch_worst / 4.0,
            method.name(),
            local_worst / 4.0,
            welch_worst / local_worst
        );
        assert!(factor * local_worst < welch_worst, "damping {damping}, {}: {local_worst} against {welch_worst}", method.name());
    }
}

#[test]
fn intervals_of_the_local_rational_method_hold_a_sharp_resonance() {
    // Two inputs, two outputs with one resonance in common; noise of a tenth of the outputs.
    let (rate, peak_hz, n) = (100.0, 5.0, 5000);
    let (sharp, smooth) = (Resonance::new(peak_hz, 0.01, rate), Resonance::new(12.0, 0.8, rate));
    let ports = Ports { references: vec![], inputs: vec![0, 1], outputs: vec![2, 3] };
    let (mut inside, mut all, mut squares) = (0.0, 0.0, 0.0);
    for seed in 0..40 {
        let forces = [noise(4 * seed + 9000, n), noise(4 * seed + 9001, n)];
        let mode = sharp.respond(&forces[0].iter().zip(&forces[1]).map(|(a, b)| a + 0.6 * b).collect::<Vec<f64>>());
        let own: Vec<Vec<f64>> = forces.iter().map(|f| smooth.respond(f)).collect();
        let output = |i: usize, share: f64| -> Vec<f64> {
            let clean: Vec<f64> = mode.iter().zip(&own[i]).map(|(m, o)| share * m + 5.0 * o).collect();
            let rms = (clean.iter().map(|v| v * v).sum::<f64>() / n as f64).sqrt();
            clean.iter().zip(noise(4 * seed + 9002 + i as u64, n)).map(|(c, e)| c + 0.1 * rms * e).collect()
        };
        let outputs = [output(0, 1.0), output(1, -0.7)];
        let [fx, fy] = forces;
        let [x, y] = outputs;
        let trial = [recording(rate, vec![("force_x", fx), ("force_y", fy), ("pos_x", x), ("pos_y", y)])];
        let found = run(&trial, &ports, SpectralMethod::LocalRational(LocalRational::default()));
        let response = &found.direct.response;
        let truth = |f_hz: f64, i: usize, j: usize| {
            let own = if i == j { 5.0 * smooth.at(f_hz) } else { Complex64::default() };
            sharp.at(f_hz) * [1.0, -0.7][i] * [1.0, 0.6][j] + own
        };
        for (i, j) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
            let entries = response.gain_phase(i, j, 0.95);
            // One line a record: its neighbours share the window.
            let f = (peak_hz * n as f64 / rate).round() as usize;
            let exact = truth(response.frequency_hz[f], i, j);
            inside += f64::from(u8::from((entries[f].gain_interval[0]..=entries[f].gain_interval[1]).contains(&exact.norm())));
            squares += (response.value[[f, i, j]] - exact).norm_sqr() / response.variance(f, i, j);
            all += 1.0;
        }
    }
    println!("{:.3} of {all} intervals hold the peak, mean square error over variance {:.2}", inside / all, squares / all);
    // The four entries of a record share the denominator and its error: 40 independent looks at least.
    assert!((inside / all - 0.95) > -4.0 * (0.95 * 0.05 / 40.0_f64).sqrt(), "{}", inside / all);
    assert!((0.5..2.0).contains(&(squares / all)), "{}", squares / all);
}

#[test]
fn a_delayed_output_has_a_falling_phase() {
    let force = noise(9, 4000);
    let mut late = vec![0.0; 3];
    late.extend_from_slice(&force[..3997]);
    let trial = [recording(100.0, vec![("force", force), ("pos", late)])];
    let methods = [
        SpectralMethod::Welch(Welch::new(512)),
        SpectralMethod::Multitaper(Multitaper::default()),
        SpectralMethod::LocalPolynomial(LocalPolynomial::default()),
    ];
    for method in methods {
        let found = run(&trial, &one_input(), method.clone());
        let response = &found.direct.response;
        for f in (0..response.len()).filter(|&f| (2.0..10.0).contains(&response.frequency_hz[f])) {
            let expected = -TAU * response.frequency_hz[f] * 0.03;
            assert!((response.value[[f, 0, 0]].arg() - expected).abs() < 0.1, "{} at {} Hz", method.name(), response.frequency_hz[f]);
        }
    }
}

/// Two limbs' worth of resonances held by a diagonal robot of stiffness `hold`, forces and positions measured.
fn held_arm(seed: u64, n: usize, limb_noise: f64) -> Recording {
    let (rate, hold) = (100.0, 0.6);
    let systems = [Resonance::new(3.0, 0.3, rate), Resonance::new(4.0, 0.4, rate)];
    let (commands, disturbances) = ([noise(seed, n), noise(seed + 1000, n)], [noise(seed + 2000, n), noise(seed + 3000, n)]);
    let mut state = [[0.0; 2]; 2];
    let mut out = [Vec::new(), Vec::new(), Vec::new(), Vec::new()];
    for k in 0..n {
        let last: [f64; 2] = [0, 1].map(|i| state[i][0]);
        for i in 0..2 {
            // The other axis pulls a little: a coupled limb and a coupled robot.
            let force = commands[i][k] - hold * (last[i] + 0.2 * last[1 - i]);
            let s = &systems[i];
            let y = s.a1 * state[i][0] + s.a2 * state[i][1] + s.gain * (force + limb_noise * disturbances[i][k]);
            state[i] = [y, state[i][0]];
            out[i].push(force);
            out[2 + i].push(y);
        }
    }
    let [fx, fy, x, y] = out;
    let [cx, cy] = commands;
    recording(rate, vec![("cmd_x", cx), ("cmd_y", cy), ("force_x", fx), ("force_y", fy), ("pos_x", x), ("pos_y", y)])
}

#[test]
fn every_method_finds_the_limb_under_feedback_by_way_of_the_references() {
    let ports = Ports { references: vec![0, 1], inputs: vec![2, 3], outputs: vec![4, 5] };
    let trials: Vec<Recording> = (0..6).map(|k| held_arm(10 + k, 5000, 0.5)).collect();
    let truth = [Resonance::new(3.0, 0.3, 100.0), Resonance::new(4.0, 0.4, 100.0)];
    let methods = [
        SpectralMethod::Welch(Welch::new(512)),
        SpectralMethod::Multitaper(Multitaper::default()),
        SpectralMethod::LocalPolynomial(LocalPolynomial::default()),
    ];
    for method in methods {
        let found = run(&trials, &ports, method.clone());
        let derived = found.derived.expect("references");
        let (mut chi2, mut direct_chi2, mut count) = (0.0, 0.0, 0.0);
        let response = &derived.response;
        let spacing = response.uncertainty.as_ref().expect("covariance").independent_spacing_hz;
        let mut next_hz = 0.5;
        for f in 0..response.len() {
            if response.frequency_hz[f] < next_hz || response.frequency_hz[f] > 8.0 {
                continue;
            }
            next_hz = response.frequency_hz[f] + spacing;
            for (i, system) in truth.iter().enumerate() {
                let exact = system.at(response.frequency_hz[f]);
                chi2 += (response.value[[f, i, i]] - exact).norm_sqr() / response.variance(f, i, i);
                direct_chi2 += (found.direct.response.value[[f, i, i]] - exact).norm_sqr() / found.direct.response.variance(f, i, i);
                count += 1.0;
            }
        }
        // |δ|²/E|δ|² has mean ν/(ν−1) and a standard deviation near 1; the window's bias adds a little.
        let (chi2, direct_chi2) = (chi2 / count, direct_chi2 / count);
        println!("{}: chi2 derived {chi2:.2}, direct {direct_chi2:.2}, {count} cells", method.name());
        assert!((chi2 - 1.03).abs() < 4.0 * 1.1 / f64::sqrt(count), "{}: {chi2} over {count}", method.name());
        assert!(direct_chi2 > 1.5 * chi2, "{}: the direct estimate is biased: {direct_chi2}", method.name());
    }
}

#[test]
fn the_choice_of_method_follows_the_recordings_and_says_why() {
    let ports = one_input();
    let choice = |records: &[Recording]| choose_method(&records.iter().collect::<Vec<_>>(), &ports);
    let random = |seed: u64, n: usize| recording(100.0, vec![("force", noise(seed, n)), ("pos", noise(seed + 1, n))]);
    let six: Vec<Recording> = (0..6).map(|k| random(2 * k, 5000)).collect();
    let found = choice(&six);
    assert_eq!(found.method, SpectralMethod::LocalPolynomial(LocalPolynomial::default()));
    // Thirteen lines of a record of 50 s.
    assert!(found.reason.contains("0.26 Hz"), "{}", found.reason);
    // Of several lengths pieces of one, and not another method.
    let found = choice(&[random(1, 4000), random(3, 8100)]);
    assert_eq!(found.method, SpectralMethod::LocalPolynomial(LocalPolynomial::default()));
    assert!(found.reason.contains("3 pieces of 40.0 s, which hold 99 % of the samples"), "{}", found.reason);
    assert!(matches!(choice(&[random(1, 600_000)]).method, SpectralMethod::Welch(_)));
    assert!(matches!(choice(&[random(1, 20)]).method, SpectralMethod::Welch(_)), "too short for a polynomial");
    let period = multisine(1000, &[3, 5, 7, 20], 1);
    let force: Vec<f64> = (0..5000).map(|k| period[k % 1000]).collect();
    let found = choice(&[recording(100.0, vec![("force", force.clone()), ("pos", force)])]);
    assert_eq!(found.method, SpectralMethod::Periodic(Periodic { period: 1000, discard: 1 }));
}

/// What is estimated of a trial and of one that is a little longer is what is estimated of both without the rest; of twice the length it is two pieces.
#[test]
fn trials_of_several_lengths_are_estimated_in_pieces_of_one() {
    let ports = Ports { references: vec![0, 1], inputs: vec![2, 3], outputs: vec![4, 5] };
    let whole = held_arm(7, 10_000, 0.3);
    let cut = |range: std::ops::Range<usize>| whole.slice(range).expect("a part");
    let methods = [SpectralMethod::LocalPolynomial(LocalPolynomial::default()), SpectralMethod::Multitaper(Multitaper::default())];
    for method in methods {
        // Bit by bit, as what is not known is no number.
        let value = |trials: &[Recording]| -> Vec<[u64; 2]> {
            run(trials, &ports, method.clone()).derived.expect("references").response.value.iter().map(|v| [v.re.to_bits(), v.im.to_bits()]).collect()
        };
        let of_one_length = value(&[cut(0..5000), cut(5000..10_000)]);
        assert_eq!(value(&[cut(0..5000), cut(5000..10_000).slice(0..5000).expect("a part")]), of_one_length);
        assert_eq!(value(&[whole.clone(), cut(0..5000)]), value(&[cut(0..5000), cut(5000..10_000), cut(0..5000)]));
        assert_eq!(value(&[cut(0..5003), cut(5000..10_000)]), of_one_length);
    }
}

/// Σ|Ĉ − C|² over 0.5 to 8 Hz, both axes of the held arm.
fn arm_error(response: &FrequencyResponse) -> f64 {
    let truth = [Resonance::new(3.0, 0.3, 100.0), Resonance::new(4.0, 0.4, 100.0)];
    let band = (0..response.len()).filter(|&f| (0.5..8.0).contains(&response.frequency_hz[f]));
    band.flat_map(|f| [0, 1].map(|i| (response.value[[f, i, i]] - truth[i].at(response.frequency_hz[f])).norm_sqr())).sum()
}

#[test]
fn a_few_wrecked_segments_do_not_ruin_the_estimate_and_are_reported() {
    let ports = Ports { references: vec![0, 1], inputs: vec![2, 3], outputs: vec![4, 5] };
    let welch = Welch { noverlap: 192, ..Welch::new(256) };
    let (mut clean_error, mut naive_error, mut robust_error) = (0.0, 0.0, 0.0);
    for seed in 0..4 {
        let clean: Vec<Recording> = (0..6).map(|k| held_arm(100 * seed + k, 5000, 0.3)).collect();
        let mut wrecked = clean.clone();
        // One knock of 0.1 s in each of four trials: 16 of 450 segments (3.6 %) hold one.
        for (trial, at) in [(0, 2000), (3, 3100), (4, 4000), (5, 900)] {
            for (name, size) in [("force_x", 120.0), ("pos_y", 40.0)] {
                let mut k = 0;
                let add = |v: f64| {
                    k += 1;
                    if (at..at + 10).contains(&k) { v + size } else { v }
                };
                wrecked[trial].map_channel(name, add).expect("channel");
            }
        }
        let labels = Labels::of(&clean[0], &ports);
        let error = |records: &[Recording]| arm_error(&run(records, &ports, SpectralMethod::Welch(welch.clone())).derived.expect("references").response);
        clean_error += error(&clean);
        naive_error += error(&wrecked);
        let (spectra, rejected) = robust_spectra(&wrecked.iter().collect::<Vec<_>>(), &ports, &welch).expect("spectra");
        let found = estimate_from_spectra(spectra, &ports, &labels, &SpectralMethod::Welch(welch.clone()), Direct::H1).expect("estimate");
        robust_error += arm_error(&found.derived.expect("references").response);
        assert!((12..=19).contains(&rejected.len()), "{rejected:?}");
        let knocked_s = |trial: usize| [(1, 20.0), (4, 31.0), (5, 40.0), (6, 9.0)].iter().find(|k| k.0 == trial).map(|k| k.1);
        assert!(rejected.iter().all(|r| knocked_s(r.trial).is_some_and(|at| r.start_s < at + 0.1 && r.end_s > at)), "{rejected:?}");
        let (_, none) = robust_spectra(&clean.iter().collect::<Vec<_>>(), &ports, &welch).expect("spectra");
        assert!(none.len() <= 2, "{none:?}");
    }
    println!("squared error: clean {clean_error:.3e}, wrecked {naive_error:.3e}, robust {robust_error:.3e}");
    assert!(robust_error < 1.3_f64.powi(2) * clean_error, "{robust_error} against {clean_error}");
    assert!(naive_error > 3.0 * clean_error, "the knocks do harm: {naive_error}");
}

#[test]
fn a_resonance_narrower_than_the_window_is_reported_with_its_bias() {
    let (rate, peak_hz) = (500.0, 5.0);
    let force = noise(21, 300_000);
    for (damping, seen) in [(0.02, true), (0.5, false)] {
        let system = Resonance::new(peak_hz, damping, rate);
        let output = system.respond(&force);
        let found = run(&[recording(rate, vec![("force", force.clone()), ("pos", output)])], &one_input(), SpectralMethod::Welch(Welch::new(4096)));
        let reported = unresolved(&found.direct.response, 0.1, 1.0, 20.0);
        assert_eq!(!reported.is_empty(), seen, "{reported:?}");
        assert_eq!(found.warnings.iter().any(|w| w.code == "resolution"), seen);
        if let Some(worst) = reported.first() {
            // A first-order measure of a large bias: the sign, the place and the size within a factor of two.
            let f = (worst.frequency_hz * 4096.0 / rate).round() as usize;
            let exact = found.direct.response.value[[f, 0, 0]].norm() / system.at(worst.frequency_hz).norm() - 1.0;
            assert!((worst.frequency_hz - peak_hz).abs() < 0.2 && worst.relative_bias < 0.0);
            assert!((0.5..2.0).contains(&(worst.relative_bias / exact)), "{} for {exact}", worst.relative_bias);
        }
    }
}

#[test]
fn a_sliding_window_follows_a_gain_that_changes() {
    let force = noise(33, 6000);
    let output = force.iter().enumerate().map(|(k, f)| if k < 3000 { 0.5 * f } else { 2.0 * f }).collect();
    let trial = recording(100.0, vec![("force", force), ("pos", output)]);
    let (ports, method) = (one_input(), SpectralMethod::Welch(Welch::new(128)));
    let course = sliding(&[&trial], &ports, &Labels::of(&trial, &ports), (&method, Direct::H1), 10.0, 5.0).expect("eleven stretches fit");
    assert_eq!(course.iter().map(|(t, _)| *t).collect::<Vec<_>>(), [5.0, 10.0, 15.0, 20.0, 25.0, 30.0, 35.0, 40.0, 45.0, 50.0, 55.0]);
    for (time_s, found) in &course {
        let gain = found.direct.response.value[[20, 0, 0]].re;
        if (time_s - 30.0).abs() >= 5.0 {
            assert!((gain - if *time_s < 30.0 { 0.5 } else { 2.0 }).abs() < 1e-12, "{gain} at {time_s} s");
        }
    }
}

#[test]
fn local_methods_find_a_mixture_of_three_axes_exactly_by_way_of_the_references() {
    let references: Vec<Vec<f64>> = (0..3).map(|k| noise(50 + k, 400)).collect();
    let mixed = |share: f64, of: &[Vec<f64>]| -> Vec<Vec<f64>> {
        (0..3).map(|i| (0..400).map(|k| of[i][k] + share * of[(i + 1) % 3][k] - 0.2 * of[(i + 2) % 3][k]).collect()).collect()
    };
    let inputs = mixed(0.5, &references);
    let outputs = mixed(0.3, &inputs);
    let named = [("cmd", references), ("force", inputs), ("pos", outputs)];
    let channels = named.into_iter().flat_map(|(role, all)| {
        let quantity = if role == "pos" { Quantity::Displacement } else { Quantity::Effort };
        all.into_iter().zip(["x", "y", "z"]).map(move |(samples, axis)| Channel::new(format!("{role}_{axis}"), Unit::si(quantity, false), samples))
    });
    let trial = [Recording::new(100.0, channels.collect()).expect("equal lengths")];
    let ports = Ports { references: vec![0, 1, 2], inputs: vec![3, 4, 5], outputs: vec![6, 7, 8] };
    for method in [SpectralMethod::LocalPolynomial(LocalPolynomial::default()), SpectralMethod::LocalRational(LocalRational::default())] {
        let found = run(&trial, &ports, method.clone());
        let derived = found.derived.expect("references");
        for (f, i, j) in (1..200).flat_map(|f| (0..9).map(move |ij| (f, ij / 3, ij % 3))) {
            let expected = [1.0, 0.3, -0.2][(3 + j - i) % 3];
            for value in [found.direct.response.value[[f, i, j]], derived.response.value[[f, i, j]]] {
                assert!((value - expected).norm() < 1e-9, "{} line {f}: {i} {j} {value}", method.name());
            }
        }
    }
}

/// Lines of the window that leaving out chose, over the default's, by the degrees of freedom that they leave.
fn chosen_width(trials: &[Recording], ports: &Ports) -> f64 {
    let settings = LocalPolynomial { leave_one_out: true, ..LocalPolynomial::default() };
    let default = settings.default_half_width(ports.inputs.len(), ports.outputs.len()) as f64;
    let freedom = run(trials, ports, SpectralMethod::LocalPolynomial(settings)).direct.response.uncertainty.expect("noise").degrees_of_freedom;
    // ν = trials (2n + 1 − 3) − 3 q.
    ((freedom + 3.0 * ports.inputs.len() as f64) / trials.len() as f64 + 2.0) / 2.0 / default
}

#[test]
fn leaving_out_takes_narrow_windows_for_a_long_delay_and_wide_ones_for_none_where_drivers_drive() {
    let n = 700;
    // Nearly all power below 4 Hz of 50: the lines above, far more, say nothing of the response.
    let slow = |x: Vec<f64>| (0..3).fold(x, |x, _| (0..n).map(|k| (0..12).map(|l| x[(k + n - l) % n]).sum::<f64>() / 12.0).collect::<Vec<f64>>());
    let late = |x: &[f64], samples: usize| (0..n).map(|k| x[(k + n - samples) % n]).collect::<Vec<f64>>();
    let with = |x: Vec<f64>, sigma: f64, seed: u64| x.iter().zip(noise(seed, n)).map(|(x, e)| x + sigma * e).collect::<Vec<f64>>();
    let trial = |force: Vec<f64>, pos: Vec<f64>| [recording(100.0, vec![("force", force), ("pos", pos)])];
    let u = slow(noise(1, n));
    assert_eq!(chosen_width(&trial(u.clone(), with(late(&u, 25), 1e-3, 2)), &one_input()), 1.0);
    assert!(chosen_width(&trial(u.clone(), with(u.clone(), 0.1, 3)), &one_input()) > 1.0);
    // A trial that is all but still, and whose output has nothing of the input, has no say.
    let still = |x: Vec<f64>| x.iter().map(|x| 0.02 * x).collect::<Vec<f64>>();
    let [moving] = trial(noise(4, n), late(&noise(4, n), 25));
    let [quiet] = trial(still(noise(5, n)), still(noise(6, n)));
    assert_eq!(chosen_width(&[quiet, moving], &one_input()), 1.0);
    // Outputs count by their relative errors, whatever their size.
    let large = with(noise(8, n), 0.1, 9).iter().map(|x| 1e3 * x).collect::<Vec<f64>>();
    let both = [recording(100.0, vec![("force", noise(8, n)), ("pos_x", large), ("pos_y", late(&noise(8, n), 25))])];
    assert_eq!(chosen_width(&both, &Ports { references: vec![], inputs: vec![0], outputs: vec![1, 2] }), 1.0);
}

#[test]
fn where_a_response_is_smooth_the_local_rational_estimate_is_the_polynomial_one() {
    let force = noise(61, 8000);
    let pos = force.iter().zip(noise(62, 8000)).map(|(f, e)| 0.5 * f + 0.3 * e).collect();
    let trial = [recording(100.0, vec![("force", force), ("pos", pos)])];
    let polynomial = run(&trial, &one_input(), SpectralMethod::LocalPolynomial(LocalPolynomial { half_width: Some(9), ..LocalPolynomial::default() }));
    for denominator in [1, 2] {
        let settings = LocalRational { denominator, half_width: Some(9), ..LocalRational::default() };
        let rational = run(&trial, &one_input(), SpectralMethod::LocalRational(settings));
        let pairs = rational.direct.response.value.iter().zip(&polynomial.direct.response.value).skip(1).take(3999);
        let other = pairs.filter(|(a, b)| (*a - *b).norm() > 1e-9).count();
        // The F test's thousandth is that of a given denominator; the best of all that are sought is found in some per cent of windows.
        assert!(other <= 200, "{other} of 3999 with a denominator of degree {denominator}");
    }
}

#[test]
fn only_a_residual_or_a_power_far_beyond_the_usual_leaves_a_segment_out_and_eight_must_stay() {
    let welch = Welch { noverlap: 0, ..Welch::new(64) };
    let rejected = |segments: usize, scaled: &[usize], by: [f64; 2]| {
        let u: Vec<f64> = noise(71, 64 * segments).iter().enumerate().map(|(k, u)| if scaled.contains(&(k / 64)) { by[0] * u } else { *u }).collect();
        let e = noise(72, 64 * segments);
        let y = (0..u.len()).map(|k| 0.5 * u[k] + if scaled.contains(&(k / 64)) { by[1] } else { 0.1 } * e[k]).collect();
        robust_spectra(&[&recording(100.0, vec![("force", u), ("pos", y)])], &one_input(), &welch).expect("spectra").1
    };
    let starts = |found: Vec<ndof_sysid::RejectedSegment>| found.iter().map(|r| (r.start_s / 0.64).round() as usize).collect::<Vec<usize>>();
    assert_eq!(starts(rejected(10, &[4], [1.0, 30.0])), [4]);
    assert_eq!(starts(rejected(10, &[4, 7], [1.0, 30.0])), [4, 7]);
    assert!(starts(rejected(9, &[4, 7], [1.0, 30.0])).is_empty());
    assert_eq!(starts(rejected(9, &[4], [1.0, 30.0])), [4]);
    let (mut few, mut many) = (0, 0);
    for k in 0..60 {
        let found = rejected(40, &[11], [1.0 + 0.05 * f64::from(k), 0.1]);
        assert!(found.iter().all(|r| r.residual >= 5.0 || r.leverage >= 8.0), "{found:?}");
        if found.is_empty() { few += 1 } else { many += 1 }
    }
    assert!(few > 5 && many > 5, "{few} {many}");
}
