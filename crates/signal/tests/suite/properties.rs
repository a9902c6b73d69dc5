//! Properties that hold for every record and every setting.

use ndof_signal::{CrossSpectra, Detrend, Multitaper, Passband, SosFilter, Welch, Window, detect_period, input_coherence};
use proptest::prelude::*;
use rand::{RngExt, SeedableRng};

/// Round-off of sums of at most a few thousand products, relative to the largest entry.
const ROUND_OFF: f64 = 1e-11;

fn noise(seed: u64, stream: u64, n: usize) -> Vec<f64> {
    let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
    rng.set_stream(stream);
    (0..n).map(|_| rng.random_range(-1.0..1.0)).collect()
}

fn settings() -> impl Strategy<Value = Welch> {
    let windows = prop_oneof![Just(Window::Hann), Just(Window::Rectangular), Just(Window::BlackmanHarris), Just(Window::Tukey(0.3))];
    let detrend = prop_oneof![Just(Detrend::None), Just(Detrend::Constant), Just(Detrend::Linear)];
    (8..200_usize, 0..100_usize, 0..60_usize, windows, any::<bool>(), detrend).prop_map(|(nperseg, overlap, padding, window, window_symmetric, detrend)| {
        Welch { nperseg, noverlap: overlap * (nperseg - 1) / 100, nfft: nperseg + padding, window, window_symmetric, detrend }
    })
}

fn largest(s: &CrossSpectra) -> f64 {
    (0..s.frequency_hz().len()).flat_map(|f| (0..s.channels()).map(move |a| s.power(f, a))).fold(0.0, f64::max)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn coherence_lies_between_zero_and_one_and_the_matrix_is_hermitian(welch in settings(), seed in 0..1000_u64) {
        let channels: Vec<Vec<f64>> = (0..3).map(|stream| noise(seed, stream, 600)).collect();
        let s = welch.spectra(10.0, &channels.iter().map(Vec::as_slice).collect::<Vec<_>>()).expect("valid");
        for f in 0..s.frequency_hz().len() {
            for a in 0..3 {
                prop_assert!(s.power(f, a) >= 0.0 && s.at(f, a, a).im == 0.0);
                for b in 0..3 {
                    prop_assert_eq!(s.at(f, a, b), s.at(f, b, a).conj());
                    prop_assert!(s.at(f, a, b).norm_sqr() <= s.power(f, a) * s.power(f, b) * (1.0 + ROUND_OFF) + (ROUND_OFF * largest(&s)).powi(2));
                }
            }
        }
        // Several averages at least, so that three independent channels do not predict each other.
        if s.effective_averages() > 6.0 {
            let found = input_coherence(&s, (1.0, 4.0)).expect("bins");
            prop_assert!(found.mean < found.max && found.max <= 1.0);
        }
    }

    #[test]
    fn units_scale_and_channels_change_places(welch in settings(), seed in 0..1000_u64, unit in -6..6_i32) {
        let factor = 10.0_f64.powi(unit);
        let (x, y) = (noise(seed, 0, 600), noise(seed, 1, 600));
        let scaled: Vec<f64> = y.iter().map(|v| v * factor).collect();
        let plain = welch.spectra(10.0, &[&x, &y]).expect("valid");
        let other = welch.spectra(10.0, &[&scaled, &x]).expect("valid");
        for f in 0..plain.frequency_hz().len() {
            let tolerance = ROUND_OFF * largest(&plain);
            prop_assert!((other.at(f, 1, 0) / factor - plain.at(f, 0, 1)).norm() <= tolerance);
            prop_assert!((other.power(f, 0) / (factor * factor) - plain.power(f, 1)).abs() <= tolerance);
            prop_assert!((other.power(f, 1) - plain.power(f, 0)).abs() <= tolerance);
        }
    }

    #[test]
    fn a_trend_that_is_taken_off_does_not_matter(seed in 0..1000_u64, offset in -100.0..100.0_f64, slope in -1.0..1.0_f64) {
        let x = noise(seed, 0, 600);
        let shifted: Vec<f64> = x.iter().enumerate().map(|(k, v)| v + offset + slope * k as f64).collect();
        let welch = Welch { detrend: Detrend::Linear, ..Welch::new(100) };
        let (plain, other) = (welch.spectra(10.0, &[&x]).expect("valid"), welch.spectra(10.0, &[&shifted]).expect("valid"));
        // The trend is up to 700 times the signal, and its round-off with it.
        for f in 0..plain.frequency_hz().len() {
            prop_assert!((plain.power(f, 0) - other.power(f, 0)).abs() <= 1e3 * ROUND_OFF * largest(&plain));
        }
    }

    #[test]
    fn pieces_of_any_size_stream_to_the_same_bytes(welch in settings(), seed in 0..1000_u64, piece in 1..700_usize) {
        let (x, y) = (noise(seed, 0, 1500), noise(seed, 1, 1500));
        let mut stream = welch.stream(10.0, 2).expect("valid");
        for (x, y) in x.chunks(piece).zip(y.chunks(piece)) {
            stream.push(&[x, y]).expect("valid");
        }
        prop_assert_eq!(stream.spectra().expect("segments"), welch.spectra(10.0, &[&x, &y]).expect("valid"));
    }

    #[test]
    fn multitaper_scales_and_is_positive(seed in 0..1000_u64, factor in 0.001..1000.0_f64, adaptive in any::<bool>()) {
        let (x, y) = (noise(seed, 0, 300), noise(seed, 1, 300));
        let scaled: Vec<f64> = y.iter().map(|v| v * factor).collect();
        let method = Multitaper { adaptive, ..Multitaper::default() };
        let (plain, other) = (method.spectra(10.0, &[&x, &y]).expect("valid"), method.spectra(10.0, &[&x, &scaled]).expect("valid"));
        for f in 0..plain.frequency_hz().len() {
            prop_assert!(plain.at(f, 1, 0).norm_sqr() <= plain.power(f, 0) * plain.power(f, 1) * (1.0 + ROUND_OFF));
            // Adaptive weights are iterated to 1e-10.
            prop_assert!((other.at(f, 1, 0) / factor - plain.at(f, 1, 0)).norm() <= 1e-8 * largest(&plain));
        }
    }

    #[test]
    fn filters_are_linear_and_stable(order in 1..12_usize, share in 0.01..0.45_f64, seed in 0..1000_u64) {
        let filter = SosFilter::butterworth(order, Passband::Low(share), 1.0).expect("valid");
        let (x, y) = (noise(seed, 0, 300), noise(seed, 1, 300));
        let sum: Vec<f64> = x.iter().zip(&y).map(|(x, y)| 2.0 * x - y).collect();
        let (fx, fy, fs) = (filter.filter(&x), filter.filter(&y), filter.filter(&sum));
        for k in 0..300 {
            prop_assert!((2.0 * fx[k] - fy[k] - fs[k]).abs() < 1e-9);
        }
        for section in filter.sections() {
            // Both roots of z² + a₁z + a₂ lie inside the unit circle (Jury).
            prop_assert!(section.a[1] < 1.0 && section.a[0].abs() < 1.0 + section.a[1]);
        }
    }

    #[test]
    fn a_repeated_stretch_shows_its_period(period in 40..200_usize, repeats in 3..6_usize, seed in 0..1000_u64) {
        let x = noise(seed, 0, period).repeat(repeats);
        let found = detect_period(&x).expect("periodic");
        prop_assert_eq!(found.period, period);
        prop_assert!(found.mismatch < 1e-9);
    }
}
