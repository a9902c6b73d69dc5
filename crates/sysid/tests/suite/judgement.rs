//! Tests, sets and rules that judge estimates: calibrated where nothing is wrong, awake where something is.

use crate::draws::{normal, seeded, spectra, stack};
use ndarray::{Array2, Array3};
use ndof_signal::CrossSpectra;
use ndof_sysid::{Direct, FrequencyResponse, Labels, Ports, ResponseKind, StoppingRule, averages_for_interval, derived, direct, spread};
use num_complex::Complex64;
use rand::RngExt;

fn ports() -> Ports {
    Ports { references: vec![0, 1], inputs: vec![2, 3], outputs: vec![4, 5] }
}

fn labels() -> Labels {
    Labels::numbered(&ports(), ResponseKind::Compliance)
}

fn limb() -> Array2<Complex64> {
    let c = |re: f64, im: f64| Complex64::new(re, im);
    ndarray::arr2(&[[c(1.0, 0.3), c(0.0, -0.2)], [c(0.3, 0.0), c(0.7, -0.4)]])
}

/// u = r + own + feedback·(limb noise), y = C u + limb noise.
fn experiment(bins: usize, averages: usize, (own, noise, feedback): (f64, f64, f64), seed: u64) -> CrossSpectra {
    let mut rng = seeded(seed);
    spectra(bins, |_| {
        let r = normal(&mut rng, 2, averages);
        let w = normal(&mut rng, 2, averages) * Complex64::from(noise);
        let u = &r + &(normal(&mut rng, 2, averages) * Complex64::from(own)) + &w * Complex64::from(feedback);
        let y = limb().dot(&u) + &w;
        stack(&[&r, &u, &y])
    })
}

/// Standard deviation of each entry of an estimate over draws with replacement of as many blocks as there are; drawing from B of them shrinks the
/// variance by (B − 1)/B (Efron & Tibshirani, An Introduction to the Bootstrap, 1993).
fn bootstrap_variance(blocks: &[CrossSpectra], resamples: usize, estimate: impl Fn(&CrossSpectra) -> FrequencyResponse) -> Array3<f64> {
    let mut rng = seeded(1);
    let draws: Vec<Array3<Complex64>> = (0..resamples)
        .map(|_| {
            let drawn: Vec<CrossSpectra> = blocks.iter().map(|_| blocks[rng.random_range(0..blocks.len())].clone()).collect();
            estimate(&CrossSpectra::pool(&drawn).expect("alike")).value
        })
        .collect();
    let mean = draws.iter().fold(Array3::<Complex64>::zeros(draws[0].dim()), |sum, d| sum + d) / Complex64::from(resamples as f64);
    let shrink = (blocks.len() - 1) as f64 / blocks.len() as f64;
    draws.iter().map(|d| (d - &mean).mapv(|v| v.norm_sqr())).fold(Array3::<f64>::zeros(mean.dim()), |sum, d| sum + d) / ((resamples - 1) as f64 * shrink)
}

#[test]
fn bootstrap_over_blocks_and_the_closed_formula_agree() {
    let (bins, blocks, averages) = (41, 40, 4);
    let trials: Vec<CrossSpectra> = (0..blocks).map(|k| experiment(bins, averages, (0.5, 0.5, -0.3), 500 + k)).collect();
    let pooled = CrossSpectra::pool(&trials).expect("alike");
    let estimate = |s: &CrossSpectra| derived(s, &ports(), &labels()).expect("derived").response;
    let resampled = bootstrap_variance(&trials, 300, estimate);
    let told = estimate(&pooled);
    let mut ratio = 0.0;
    for f in 1..bins {
        for (i, j) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
            ratio += resampled[[f, i, j]] / told.variance(f, i, j) / (4 * (bins - 1)) as f64;
        }
    }
    // 40 blocks and 300 resamples at 160 cells: each variance is known to 1/√39 = 16 %, their mean to about 2 %; the
    // bootstrap of a ratio of 160 averages is itself biased by a few per cent.
    assert!((ratio - 1.0).abs() < 0.1, "{ratio}");
}

#[test]
fn trials_of_one_limb_spread_as_they_say_and_of_a_changing_limb_more() {
    let one = |k: u64, scale: f64| -> FrequencyResponse {
        let mut r = derived(&experiment(201, 30, (0.3, 0.4, -0.3), 900 + k), &ports(), &labels()).expect("derived").response;
        r.value.mapv_inplace(|v| v * scale);
        r
    };
    let same: Vec<FrequencyResponse> = (0..6).map(|k| one(k, 1.0)).collect();
    let found = spread(&same, 1.0, 1000.0).expect("comparable");
    // Complex t-like ratios at ν = 28: mean square 28/27.
    assert!((found.ratio - 1.02).abs() < 4.0 * found.ratio_std_error * 1.1, "{} ± {}", found.ratio, found.ratio_std_error);
    let changing: Vec<FrequencyResponse> = (0..6).map(|k| one(k, 1.0 + 0.2 * (k as f64 - 2.5))).collect();
    assert!(spread(&changing, 1.0, 1000.0).expect("comparable").ratio > 1.5);
    assert_eq!(spread(&same[..1], 1.0, 1000.0), None);
    // A frequency where no error is predicted says nothing.
    let mut silent = same.clone();
    silent.iter_mut().for_each(|r| r.uncertainty.as_mut().expect("noise").noise.index_axis_mut(ndarray::Axis(0), 7).fill(Complex64::default()));
    let without = spread(&silent, 1.0, 1000.0).expect("comparable");
    assert!((without.ratio / found.ratio - 1.0).abs() < 0.02 && without.ratio_std_error > found.ratio_std_error, "{} {}", without.ratio, found.ratio);
}

#[test]
fn the_predicted_length_gives_the_wanted_interval() {
    // One input of known coherence: measure as long as told, and look.
    let (coherence, wanted): (f64, f64) = (0.8, 0.15);
    let averages = averages_for_interval(coherence, 1, wanted, 0.95).ceil() as usize;
    let ports = Ports { references: vec![], inputs: vec![0], outputs: vec![1] };
    let noise = ((1.0 - coherence) / coherence).sqrt();
    let mut rng = seeded(7);
    let mut record = |averages: usize| {
        let s = spectra(401, |_| {
            let u = normal(&mut rng, 1, averages);
            stack(&[&u, &(&u + &(normal(&mut rng, 1, averages) * Complex64::from(noise)))])
        });
        direct(&s, &ports, &Labels::numbered(&ports, ResponseKind::Transfer), Direct::H1).expect("estimate").response
    };
    let rule = StoppingRule { relative_half_width: wanted, level: 0.95, low_hz: 1.0, high_hz: 1e9, share: 0.5, diagonal_only: true };
    let widths: f64 = {
        let entries = record(averages).gain_phase(0, 0, 0.95);
        entries.iter().skip(1).map(|e| (e.gain_interval[1] - e.gain) / e.gain).sum::<f64>() / 400.0
    };
    assert!((widths / wanted - 1.0).abs() < 0.05, "{widths}");
    assert!(rule.judge(&record(2 * averages)).expect("covariance").reached);
    let early = rule.judge(&record(averages / 3)).expect("covariance");
    assert!(!early.reached && (2.0..5.0).contains(&early.times_present_length), "{early:?}");
}

#[test]
fn a_stream_stops_when_the_wanted_interval_is_reached_and_not_before() {
    let mut rng = seeded(9);
    let mut draw = || -> f64 { rng.sample(rand_distr::StandardNormal) };
    let (welch, wanted) = (ndof_signal::Welch::new(256), 0.1);
    let ports = Ports { references: vec![], inputs: vec![0], outputs: vec![1] };
    let rule = StoppingRule { relative_half_width: wanted, level: 0.95, low_hz: 1.0, high_hz: 40.0, share: 0.9, diagonal_only: true };
    let mut stream = welch.stream(100.0, 2).expect("valid settings");
    let (mut whole, mut progress, mut first) = ([Vec::new(), Vec::new()], None, None);
    for _ in 0..400 {
        let force: Vec<f64> = (0..500).map(|_| draw()).collect();
        let motion: Vec<f64> = force.iter().map(|f| f + 0.5 * draw()).collect();
        stream.push(&[&force, &motion]).expect("equal lengths");
        whole[0].extend(force);
        whole[1].extend(motion);
        let spectra = stream.spectra().expect("a segment");
        let Ok(found) = direct(&spectra, &ports, &Labels::numbered(&ports, ResponseKind::Transfer), Direct::H1) else { continue };
        let now = rule.judge(&found.response).expect("covariance");
        first.get_or_insert((whole[0].len(), now.times_present_length));
        assert!(!progress.is_some_and(|p: ndof_sysid::Progress| p.reached), "it went on although it was done");
        progress = Some(now);
        if now.reached {
            // Nine of ten frequencies have the interval, and the stream holds what the whole record does.
            assert!(now.share >= 0.9);
            assert_eq!(spectra, welch.spectra(100.0, &[&whole[0], &whole[1]]).expect("spectra"));
            break;
        }
    }
    assert!(progress.expect("judged").reached, "{progress:?}");
    // γ² = 0.8: so many averages for a typical frequency; the ninth of ten needs somewhat more.
    let typical = averages_for_interval(0.8, 1, wanted, 0.95) * 128.0;
    assert!((0.9..1.6).contains(&(whole[0].len() as f64 / typical)), "{} samples, typically {typical}", whole[0].len());
}
