//! Tests, sets and rules that judge estimates: calibrated where nothing is wrong, awake where something is.

use crate::draws::{normal, seeded, spectra, stack};
use ndarray::Array2;
use ndof_signal::CrossSpectra;
use ndof_sysid::{
    Direct, FrequencyResponse, Labels, Ports, ResponseKind, StoppingRule, anderson_rubin, averages_for_interval, bootstrap_std, derived, direct, hausman,
    spread,
};
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

fn hausman_of(s: &CrossSpectra) -> ndof_sysid::Hausman {
    let (a, b) = (direct(s, &ports(), &labels(), Direct::H1).expect("direct"), derived(s, &ports(), &labels()).expect("derived"));
    hausman(&a, &b, 0.0, f64::INFINITY).expect("same grid")
}

#[test]
fn hausman_is_calibrated_without_feedback_and_wakes_with_it() {
    let found = hausman_of(&experiment(2001, 60, (0.8, 0.5, 0.0), 1));
    assert_eq!(found.degrees_of_freedom, 16_000.0);
    // χ² has a standard deviation of √(2 dof); the noise is estimated on 56 degrees, which adds a few per cent to that.
    assert!((found.statistic - found.degrees_of_freedom).abs() < 4.0 * 1.05 * (2.0 * found.degrees_of_freedom).sqrt(), "{found:?}");
    let small: Vec<f64> = (0..200).map(|k| hausman_of(&experiment(11, 60, (0.8, 0.5, 0.0), 100 + k)).probability).collect();
    let rejected = small.iter().filter(|p| **p < 0.05).count() as f64 / 200.0;
    assert!(rejected < 0.05 + 4.0 * (0.05 * 0.95 / 200.0_f64).sqrt(), "{rejected}");
    assert!(hausman_of(&experiment(11, 60, (0.8, 0.5, -0.7), 2)).probability < 1e-6);
}

#[test]
fn the_anderson_rubin_set_holds_the_truth_even_if_the_instrument_is_weak() {
    let (bins, averages) = (4001, 16);
    let mut rng = seeded(3);
    // Feedback noise five times the reference: the derived intervals fail here.
    let s = spectra(bins, |_| {
        let r = normal(&mut rng, 2, averages) * Complex64::from(0.3);
        let w = normal(&mut rng, 2, averages);
        let u = &r - &w * Complex64::new(0.8, 0.3);
        let y = limb().dot(&u) + &w;
        stack(&[&r, &u, &y])
    });
    let truth = limb();
    for output in 0..2 {
        let row: Vec<Complex64> = truth.row(output).to_vec();
        let held = (1..bins).filter(|&f| anderson_rubin(&s, &ports(), f, output, &row, 0.95).expect("defined")).count() as f64 / (bins - 1) as f64;
        assert!((held - 0.95).abs() < 4.0 * (0.05 * 0.95 / (bins - 1) as f64).sqrt(), "{held}");
    }
    let weak = derived(&s, &ports(), &labels()).expect("derived").weak_instrument;
    assert!(weak.iter().skip(1).filter(|w| **w).count() as f64 > 0.9 * (bins - 1) as f64, "the weakness is flagged");
    let far = [Complex64::from(30.0), Complex64::from(-30.0)];
    let strong = experiment(3, 60, (0.1, 0.1, 0.0), 4);
    assert_eq!(anderson_rubin(&strong, &ports(), 1, 0, &far, 0.95), Some(false));
    assert_eq!(anderson_rubin(&strong, &Ports { references: vec![], ..ports() }, 1, 0, &far, 0.95), None, "no instrument");
    assert_eq!(anderson_rubin(&experiment(3, 2, (0.1, 0.1, 0.0), 5), &ports(), 1, 0, &far, 0.95), None, "as many averages as references");
}

#[test]
fn bootstrap_over_blocks_and_the_closed_formula_agree() {
    let (bins, blocks, averages) = (41, 40, 4);
    let trials: Vec<CrossSpectra> = (0..blocks).map(|k| experiment(bins, averages, (0.5, 0.5, -0.3), 500 + k)).collect();
    let pooled = CrossSpectra::pool(&trials).expect("alike");
    let estimate = |s: &CrossSpectra| derived(s, &ports(), &labels()).ok().map(|d| d.response);
    let resampled = bootstrap_std(&trials, 300, 1, estimate).expect("enough");
    let told = estimate(&pooled).expect("derived");
    let mut ratio = 0.0;
    for f in 1..bins {
        for (i, j) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
            ratio += resampled[[f, i, j]].powi(2) / told.variance(f, i, j) / (4 * (bins - 1)) as f64;
        }
    }
    // 40 blocks and 300 resamples at 160 cells: each variance is known to 1/√39 = 16 %, their mean to about 2 %; the
    // bootstrap of a ratio of 160 averages is itself biased by a few per cent.
    assert!((ratio - 1.0).abs() < 0.1, "{ratio}");
    let bits = || bootstrap_std(&trials, 20, 1, estimate).map(|s| s.mapv(f64::to_bits));
    assert_eq!(bits(), bits(), "the seed fixes the result");
    assert!([1, 2].map(|resamples| bootstrap_std(&trials, resamples, 1, estimate).is_some()) == [false, true], "two differ, one does not");
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
