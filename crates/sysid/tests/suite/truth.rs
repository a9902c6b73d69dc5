//! Known systems: estimates converge to them at the rate that theory gives.

use crate::draws::{hermitian, normal, seeded, spectra, stack, uniform};
use ndarray::Array2;
use ndof_sysid::{Confidence, Direct, FrequencyResponse, Labels, Ports, ResponseKind, derived, direct};
use num_complex::Complex64;

const SIZES: [(usize, usize); 5] = [(1, 1), (2, 2), (3, 3), (2, 3), (6, 6)];

/// Statistical: four standard deviations.
const SIGMAS: f64 = 4.0;

struct System {
    h: Array2<Complex64>,
    /// u = mix · (independent unit draws).
    mix: Array2<Complex64>,
    noise: f64,
}

impl System {
    fn random(q: usize, p: usize) -> Self {
        let mut rng = seeded(10 * q as u64 + p as u64);
        let mut mix = uniform(&mut rng, q, q);
        (0..q).for_each(|i| mix[[i, i]] += 2.0);
        System { h: uniform(&mut rng, p, q), mix, noise: 0.7 }
    }

    fn ports(&self) -> Ports {
        let (p, q) = self.h.dim();
        Ports { references: vec![], inputs: (0..q).collect(), outputs: (q..q + p).collect() }
    }

    fn estimate(&self, bins: usize, averages: usize, seed: u64) -> ndof_sysid::DirectEstimate {
        let (p, q) = self.h.dim();
        let mut rng = seeded(seed);
        let s = spectra(bins, |_| {
            let u = self.mix.dot(&normal(&mut rng, q, averages));
            let y = self.h.dot(&u) + normal(&mut rng, p, averages) * Complex64::from(self.noise);
            stack(&[&u, &y])
        });
        direct(&s, &self.ports(), &Labels::numbered(&self.ports(), ResponseKind::Transfer), Direct::H1).expect("estimate")
    }

    fn input(&self) -> Array2<Complex64> {
        self.mix.dot(&hermitian(&self.mix))
    }

    /// [S_uu⁻¹]_jj, by columns of the inverse mixing matrix.
    fn inverse_input_diagonal(&self) -> Vec<f64> {
        let exact = FrequencyResponse {
            frequency_hz: vec![1.0],
            inputs: vec![String::new(); self.mix.nrows()],
            outputs: vec![String::new(); self.mix.nrows()],
            kind: ResponseKind::Transfer,
            value: self.input().insert_axis(ndarray::Axis(0)),
            uncertainty: None,
        };
        exact.inverse().expect("square").at(0).diag().iter().map(|v| v.re).collect()
    }
}

#[test]
fn the_error_of_h1_has_the_exact_variance_at_every_number_of_averages() {
    for (q, p) in SIZES {
        let system = System::random(q, p);
        let inverse = system.inverse_input_diagonal();
        for averages in [q + 6, q + 40] {
            let bins = 1500;
            let found = system.estimate(bins, averages, 100);
            let freedom = (averages - q) as f64;
            // |δ|² / (its mean) = E · (n−q)/G with E ~ Exp(1), G ~ Gamma(n−q+1): variance 2(n−q)/(n−q−1) − 1.
            let spread = ((2.0 * freedom / (freedom - 1.0) - 1.0) / (bins - 1) as f64).sqrt();
            for (i, j) in (0..p).flat_map(|i| (0..q).map(move |j| (i, j))) {
                let truth = system.noise.powi(2) * inverse[j] / freedom;
                let seen = (1..bins).map(|f| (found.response.value[[f, i, j]] - system.h[[i, j]]).norm_sqr()).sum::<f64>() / (bins - 1) as f64;
                assert!((seen / truth - 1.0).abs() < SIGMAS * spread, "{q}x{p}, n = {averages}, entry {i}{j}: {}", seen / truth);
                // The estimated variance is unbiased: S_nn/(n−q) and [S_uu⁻¹] are independent.
                let told = (1..bins).map(|f| found.response.variance(f, i, j)).sum::<f64>() / (bins - 1) as f64;
                let wide = ((1.0 + 1.0 / freedom) * freedom / (freedom - 1.0) - 1.0).sqrt() / ((bins - 1) as f64).sqrt();
                assert!((told / truth - 1.0).abs() < SIGMAS * wide.max(spread), "{q}x{p}, n = {averages}: told {}", told / truth);
            }
        }
    }
}

#[test]
fn coherences_converge_to_their_exact_values() {
    let averages = 3000;
    for (q, p) in SIZES {
        let system = System::random(q, p);
        let found = system.estimate(21, averages, 200);
        let (s_uu, inverse) = (system.input(), system.inverse_input_diagonal());
        let s_yu = system.h.dot(&s_uu);
        let power = |i: usize| s_yu.dot(&hermitian(&system.h))[[i, i]].re + system.noise.powi(2);
        let agree = |what: &str, seen: f64, exact: f64| {
            // Mean of 20 bins; Var = 2γ²(1−γ²)²/n, bias (1−γ²) q/n.
            let sigma = (2.0 * exact * (1.0 - exact).powi(2) / averages as f64 / 20.0).sqrt();
            let bias = (1.0 - exact) * q as f64 / averages as f64;
            assert!((seen - exact).abs() < SIGMAS * sigma + 2.0 * bias, "{what} of {q}x{p}: {seen}, exact {exact}");
        };
        let mean = |value: &dyn Fn(usize) -> f64| (1..21).map(value).sum::<f64>() / 20.0;
        for i in 0..p {
            agree("multiple", mean(&|f| found.coherence.multiple[[f, i]]), 1.0 - system.noise.powi(2) / power(i));
            for j in 0..q {
                agree("ordinary", mean(&|f| found.coherence.ordinary[[f, i, j]]), s_yu[[i, j]].norm_sqr() / (s_uu[[j, j]].re * power(i)));
                let alone = system.h[[i, j]].norm_sqr() / inverse[j];
                agree("partial", mean(&|f| found.coherence.partial[[f, i, j]]), alone / (alone + system.noise.powi(2)));
            }
        }
        for (j, k) in (0..q).flat_map(|j| (0..j).map(move |k| (j, k))) {
            agree("input", mean(&|f| found.input_coherence[[f, j, k]]), s_uu[[j, k]].norm_sqr() / (s_uu[[j, j]].re * s_uu[[k, k]].re));
        }
    }
}

#[test]
fn errors_of_coherence_fall_with_the_root_of_the_averages() {
    let bins = 1001;
    for (q, p) in SIZES {
        let system = System::random(q, p);
        let s_uu = system.input();
        let power = (0..p).map(|i| system.h.dot(&s_uu).dot(&hermitian(&system.h))[[i, i]].re + system.noise.powi(2));
        let exact: Vec<f64> = power.map(|power| 1.0 - system.noise.powi(2) / power).collect();
        let error = |averages: usize| {
            // A fit of q inputs explains q of n averages of nothing.
            let free = averages as f64 / (averages - q) as f64;
            let found = system.estimate(bins, averages, 400 + averages as u64).coherence.multiple.mapv(|g| (1.0 - (1.0 - g) * free).max(0.0));
            let square = |f: usize, i: usize| (found[[f, i]] - exact[i]).powi(2) / (2.0 * exact[i] * (1.0 - exact[i]).powi(2) / averages as f64);
            (1..bins).flat_map(|f| (0..p).map(move |i| (f, i))).map(|(f, i)| square(f, i)).sum::<f64>() / ((bins - 1) * p) as f64
        };
        // 2γ²(1−γ²)²/n is the first term in 1/n: what is left at 160 and 640 averages is below a tenth; 1000 independent bins.
        for averages in [160, 640] {
            let ratio = error(averages);
            assert!((ratio - 1.0).abs() < 0.1 + SIGMAS * (2.0 / (bins - 1) as f64).sqrt(), "{q}x{p} at {averages}: {ratio}");
        }
    }
}

#[test]
fn the_derived_estimate_converges_to_the_limb_under_feedback_for_every_size_as_its_covariance_says() {
    for (q, p) in SIZES {
        let system = System::random(q, p);
        // Every output pulls back on every input; small enough for a loop that could exist.
        let back = uniform(&mut seeded(77), q, p) * Complex64::from(0.3 / p as f64);
        let loop_matrix = Array2::from_diag_elem(q, Complex64::from(1.0)) + back.dot(&system.h);
        let closed = FrequencyResponse {
            frequency_hz: vec![1.0],
            inputs: vec![String::new(); q],
            outputs: vec![String::new(); q],
            kind: ResponseKind::Transfer,
            value: loop_matrix.insert_axis(ndarray::Axis(0)),
            uncertainty: None,
        };
        let closed = closed.inverse().expect("square").at(0);
        let ports = Ports { references: (0..q).collect(), inputs: (q..2 * q).collect(), outputs: (2 * q..2 * q + p).collect() };
        let labels = Labels::numbered(&ports, ResponseKind::Transfer);
        let (bins, mut last) = (801, f64::INFINITY);
        for averages in [60, 240, 960] {
            let mut rng = seeded(500 + averages as u64);
            let s = spectra(bins, |_| {
                let r = system.mix.dot(&normal(&mut rng, q, averages));
                let w = normal(&mut rng, p, averages) * Complex64::from(system.noise);
                let u = closed.dot(&(&r - &back.dot(&w)));
                stack(&[&r, &u, &(system.h.dot(&u) + w)])
            });
            let found = derived(&s, &ports, &labels).expect("estimate").response;
            let (mut square, mut told) = (0.0, 0.0);
            for (f, i, j) in (1..bins).flat_map(|f| (0..p).flat_map(move |i| (0..q).map(move |j| (f, i, j)))) {
                let error = (found.value[[f, i, j]] - system.h[[i, j]]).norm_sqr();
                square += error;
                told += error / found.variance(f, i, j) / ((bins - 1) * p * q) as f64;
            }
            // |δ|²/Var has mean ν/(ν−1) and about unit standard deviation; 800 bins, whose entries depend on each other.
            let freedom = (averages - q) as f64;
            assert!((told - freedom / (freedom - 1.0)).abs() < SIGMAS * 1.1 / ((bins - 1) as f64).sqrt(), "{q}x{p} at {averages}: {told}");
            if last.is_finite() {
                assert!((last / square / 4.0 - 1.0).abs() < 0.3, "{q}x{p}: four times the averages, {} of the squared error", square / last);
            }
            last = square;
        }
    }
}

#[test]
fn noise_alone_gives_the_coherence_that_theory_says() {
    let (q, averages, bins) = (2, 20, 6000);
    let mut system = System::random(q, 1);
    system.h.fill(Complex64::default());
    let found = system.estimate(bins, averages, 300);
    let n = (bins - 1) as f64;
    let multiple: Vec<f64> = found.coherence.multiple.iter().copied().filter(|g| g.is_finite()).collect();
    // Beta(q, n−q): mean q/n, variance q(n−q)/(n²(n+1)).
    let (a, b) = (q as f64, (averages - q) as f64);
    let sigma = (a * b / ((a + b).powi(2) * (a + b + 1.0)) / n).sqrt();
    assert!((multiple.iter().sum::<f64>() / n - a / (a + b)).abs() < SIGMAS * sigma);
    for (values, threshold) in [
        (multiple, found.significance_95.multiple),
        (found.coherence.partial.iter().copied().filter(|g| g.is_finite()).step_by(2).collect(), found.significance_95.partial),
        (found.coherence.ordinary.iter().copied().filter(|g| g.is_finite()).step_by(2).collect(), found.significance_95.ordinary),
    ] {
        let beyond = values.iter().filter(|&&g| g > threshold).count() as f64 / n;
        assert!((beyond - 0.05).abs() < SIGMAS * (0.05 * 0.95 / n).sqrt(), "{beyond} beyond {threshold}");
    }
}

/// A limb C held by a robot Z: u = r − Z y, y = C (u + w), both measured with noise.
struct Loop {
    c: Array2<Complex64>,
    z: Array2<Complex64>,
    limb_noise: f64,
    sensor_noise: f64,
}

impl Loop {
    fn new() -> Self {
        let c = |re: f64, im: f64| Complex64::new(re, im);
        Loop {
            c: ndarray::arr2(&[[c(1.0, 0.3), c(0.0, -0.2)], [c(0.3, 0.0), c(0.7, -0.4)]]),
            z: ndarray::arr2(&[[c(0.9, 0.6), c(0.1, 0.0)], [c(0.0, 0.2), c(1.1, -0.3)]]),
            limb_noise: 0.8,
            sensor_noise: 0.15,
        }
    }

    /// (I + Z C)⁻¹ of the 2 × 2 system.
    fn sensitivity(&self) -> Array2<Complex64> {
        let m = Array2::from_diag_elem(2, Complex64::from(1.0)) + self.z.dot(&self.c);
        let determinant = m[[0, 0]] * m[[1, 1]] - m[[0, 1]] * m[[1, 0]];
        ndarray::arr2(&[[m[[1, 1]], -m[[0, 1]]], [-m[[1, 0]], m[[0, 0]]]]) / determinant
    }

    fn ports() -> Ports {
        Ports { references: vec![0, 1], inputs: vec![2, 3], outputs: vec![4, 5] }
    }

    fn spectra(&self, bins: usize, averages: usize, seed: u64) -> ndof_signal::CrossSpectra {
        let (mut rng, s) = (seeded(seed), self.sensitivity());
        spectra(bins, |_| {
            let r = normal(&mut rng, 2, averages);
            let w = normal(&mut rng, 2, averages) * Complex64::from(self.limb_noise);
            let u = s.dot(&(&r - &self.z.dot(&self.c).dot(&w)));
            let y = self.c.dot(&(&u + &w));
            let m = |rng: &mut _| normal(rng, 2, averages) * Complex64::from(self.sensor_noise);
            stack(&[&r, &(&u + &m(&mut rng)), &(&y + &m(&mut rng))])
        })
    }
}

#[test]
fn under_feedback_the_direct_estimate_is_biased_as_theory_says_and_the_derived_one_is_not() {
    let system = Loop::new();
    let averages = 200_000;
    let spectra = system.spectra(2, averages, 1);
    let labels = Labels::numbered(&Loop::ports(), ResponseKind::Transfer);
    let direct = direct(&spectra, &Loop::ports(), &labels, Direct::H1).expect("estimate");
    let derived = derived(&spectra, &Loop::ports(), &labels).expect("estimate");
    let s = system.sensitivity();
    let szc = s.dot(&system.z).dot(&system.c);
    let noise = Complex64::from(system.limb_noise.powi(2));
    let identity = Array2::from_diag_elem(2, Complex64::from(1.0));
    let s_uu = s.dot(&hermitian(&s)) + szc.dot(&hermitian(&szc)) * noise + &identity * Complex64::from(system.sensor_noise.powi(2));
    let s_yu = system.c.dot(&s).dot(&hermitian(&s)) - (&system.c - &system.c.dot(&szc)).dot(&hermitian(&szc)) * noise;
    // The limit times S_uu is S_yu: no inverse needed.
    for (i, j) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
        let limit = direct.response.at(1).dot(&s_uu)[[i, j]] - s_yu[[i, j]];
        let size = s_uu[[j, j]].re * direct.response.variance(1, i, j).sqrt();
        assert!(limit.norm() < 3.0 * SIGMAS * size, "direct {i}{j}: {limit}");
        let bias = (direct.response.value[[1, i, j]] - system.c[[i, j]]).norm();
        let error = (derived.response.value[[1, i, j]] - system.c[[i, j]]).norm();
        let sigma = derived.response.variance(1, i, j).sqrt();
        assert!(error < SIGMAS * sigma, "derived {i}{j}: {error} of {sigma}");
        assert!(i != j || bias > 30.0 * sigma, "the bias of the direct estimate shows");
    }
    assert!(!derived.weak_instrument[1]);
    // SCIENCE A.6: paper-type 0.58/0.57, consistent 0.27/0.32 for a correlated reference; here the order must hold.
    for i in 0..2 {
        assert!(derived.coherence_paper.multiple[[1, i]] > derived.coherence_iv.multiple[[1, i]]);
    }
}

#[test]
fn intervals_of_the_derived_estimate_hold_the_limb_under_feedback_and_those_of_the_direct_do_not() {
    let system = Loop { limb_noise: 0.4, ..Loop::new() };
    let (bins, averages) = (2001, 24);
    let spectra = system.spectra(bins, averages, 2);
    let labels = Labels::numbered(&Loop::ports(), ResponseKind::Transfer);
    let direct = direct(&spectra, &Loop::ports(), &labels, Direct::H1).expect("estimate").response;
    let derived = derived(&spectra, &Loop::ports(), &labels).expect("estimate").response;
    for (i, j) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
        let truth = system.c[[i, j]];
        let share = |inside: &dyn Fn(usize) -> bool| (1..bins).filter(|&f| inside(f)).count() as f64 / (bins - 1) as f64;
        let disc = Confidence::new(0.95, (averages - 2) as f64);
        let regions = share(&|f| (derived.value[[f, i, j]] - truth).norm() <= disc.radius(derived.variance(f, i, j)));
        assert!((0.93..=0.97).contains(&regions), "disc {i}{j}: {regions}");
        // A gain near zero is covered too often, since no gain is negative: entries that stand out of the noise only.
        if i != j {
            continue;
        }
        let covered = |response: &FrequencyResponse| {
            let entries = response.gain_phase(i, j, 0.95);
            share(&|f| (entries[f].gain_interval[0]..=entries[f].gain_interval[1]).contains(&truth.norm()))
        };
        let (ours, naive) = (covered(&derived), covered(&direct));
        assert!((0.93..=0.97).contains(&ours), "derived {i}{j}: {ours}");
        assert!(naive < 0.9, "direct {i}{j}: {naive}");
    }
}

#[test]
fn intervals_of_h1_and_h2_hold_the_truth_from_low_to_high_coherence() {
    let (bins, averages) = (4001, 12);
    let ports = Ports { references: vec![], inputs: vec![0, 1], outputs: vec![2, 3] };
    let labels = Labels::numbered(&ports, ResponseKind::Transfer);
    let h = Loop::new().c;
    for (method, seed) in [(Direct::H1, 31), (Direct::H2, 32)] {
        for coherence in [0.5, 0.8, 0.99] {
            let mut rng = seeded(seed);
            let s = spectra(bins, |_| {
                let u = normal(&mut rng, 2, averages);
                let y = h.dot(&u);
                // Noise of each channel in proportion to its own power.
                let share = Complex64::from(f64::sqrt((1.0 - coherence) / coherence));
                if method == Direct::H1 {
                    let power = |i: usize| Complex64::from((h[[i, 0]].norm_sqr() + h[[i, 1]].norm_sqr()).sqrt());
                    let noise = normal(&mut rng, 2, averages) * share;
                    let noise = Array2::from_shape_fn(noise.dim(), |(i, k)| noise[[i, k]] * power(i));
                    stack(&[&u, &(&y + &noise)])
                } else {
                    stack(&[&(&u + &(normal(&mut rng, 2, averages) * share)), &y])
                }
            });
            let response = direct(&s, &ports, &labels, method).expect("estimate").response;
            for i in 0..2 {
                let entries = response.gain_phase(i, i, 0.95);
                let share = |inside: &dyn Fn(usize) -> bool| (1..bins).filter(|&f| inside(f)).count() as f64 / (bins - 1) as f64;
                let gain = share(&|f| (entries[f].gain_interval[0]..=entries[f].gain_interval[1]).contains(&h[[i, i]].norm()));
                let phase = share(&|f| {
                    entries[f].phase_interval_rad.is_none_or(|[low, high]| (h[[i, i]] / response.value[[f, i, i]]).arg().abs() <= (high - low) / 2.0)
                });
                println!("{method:?}, coherence {coherence}, entry {i}{i}: gain {gain:.3}, phase {phase:.3}");
                // 4000 bins: one sigma is 0.34 %; the phase of an inverse is bounded to first order, which is wide at low coherence.
                assert!((gain - 0.95).abs() < 0.02 && (phase - 0.95).abs() < 0.02, "{method:?} at {coherence}: {gain} {phase}");
            }
        }
    }
}
