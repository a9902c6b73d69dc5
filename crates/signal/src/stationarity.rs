//! Does a record look like one stationary, Gaussian process? (Bendat & Piersol 2010, *Random Data*, ch. 4 and 10.)

use crate::periodic::autocorrelation;
use crate::totals::total;
use serde::{Deserialize, Serialize};

/// Why a test cannot be made.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[allow(missing_docs, reason = "a message says what its fields are")]
pub enum StationarityError {
    /// Fewer samples than intervals, or no interval.
    #[error("{samples} samples in {intervals} intervals; every interval needs a sample (usual: 16 to 25 intervals)")]
    Intervals { samples: usize, intervals: usize },
    /// The test is not defined for so few values, or its exact distribution too long to add up.
    #[error("{0} values; the reverse arrangement test takes 4 to 400 (usual: 16 to 25)")]
    Count(usize),
    /// A signal without variance, or with a NaN.
    #[error("the signal is constant or holds a value that is not a number; there is nothing to test")]
    NoVariance,
}

/// The reverse arrangement test for a trend.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ReverseArrangements {
    /// Pairs i < j with x_i > x_j.
    pub count: usize,
    /// Their expected number without a trend, N(N−1)/4.
    pub expected: f64,
    /// Two-sided p-value, exact but for round-off of 1e-13: small means that the values rise or fall.
    pub p_value: f64,
}

/// Counts the reverse arrangements of `values` (e.g. [`mean_squares`](crate::Amplitudes::mean_squares)) and compares them with those of independent,
/// equally distributed values, of which every order is equally likely. Ties count half, rounded down.
///
/// # Errors
/// [`StationarityError::Count`] unless there are 4 to 400 values.
///
/// ```
/// let rising: Vec<f64> = (0..20).map(f64::from).collect();
/// let test = ndof_signal::reverse_arrangements(&rising)?;
/// assert!(test.count == 0 && test.p_value < 1e-12);
/// # Ok::<(), ndof_signal::StationarityError>(())
/// ```
pub fn reverse_arrangements(values: &[f64]) -> Result<ReverseArrangements, StationarityError> {
    let n = values.len();
    if !(4..=400).contains(&n) {
        return Err(StationarityError::Count(n));
    }
    let pairs = values.iter().enumerate().flat_map(|(i, x)| values[i + 1..].iter().map(move |y| usize::from(x > y) + usize::from(x >= y)));
    let count = pairs.sum::<usize>() / 2;
    // Probability of each number of inversions: the n-th value is inverted with 0 … n−1 of the others, equally likely.
    let mut probability = vec![1.0];
    for n in 2..=n {
        let mut next = vec![0.0; probability.len() + n - 1];
        let mut window: f64 = 0.0;
        for (k, next) in next.iter_mut().enumerate() {
            window += probability.get(k).copied().unwrap_or(0.0);
            if k >= n {
                window -= probability.get(k - n).copied().unwrap_or(0.0);
            }
            *next = window.max(0.0) / n as f64;
        }
        probability = next;
    }
    // The distribution is symmetric: sum the shorter tail.
    let tail = count.min(n * (n - 1) / 2 - count);
    let p_value = (2.0 * probability[..=tail].iter().sum::<f64>()).min(1.0);
    Ok(ReverseArrangements { count, expected: (n * (n - 1)) as f64 / 4.0, p_value })
}

/// Lags whose autocovariance is summed at most, which is to outlast a signal's memory of itself: a minute at 1 kHz.
const LAGS: usize = 1 << 16;

/// Shape of a signal's distribution, and whether a Gaussian process would have it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Normality {
    /// Third standardised moment, 0 for a Gaussian.
    pub skewness: f64,
    /// Fourth standardised moment less 3, 0 for a Gaussian.
    pub excess_kurtosis: f64,
    /// p-value of both together, samples taken as correlated as they are.
    pub p_value: f64,
}

/// Skewness and kurtosis with a test that allows for the correlation of the samples:
///
/// G = N m₃² / (6 Σ γ(j)³) + N (m₄ − 3m₂²)² / (24 Σ γ(j)⁴) is χ² with two degrees of freedom for a Gaussian process
/// with autocovariance γ, at 65 536 lags at most (Lobato & Velasco 2004, *Econometric Theory* 20:671).
///
/// # Errors
/// [`StationarityError::NoVariance`] for a signal without variance or with a NaN.
///
/// ```
/// let uniform: Vec<f64> = (0..5000).map(|k| (f64::from(k * k) * 0.618_034).fract()).collect();
/// let test = ndof_signal::normality(&uniform)?;
/// assert!((test.excess_kurtosis + 1.2).abs() < 0.01 && test.p_value < 1e-6);
/// # Ok::<(), ndof_signal::StationarityError>(())
/// ```
pub fn normality(signal: &[f64]) -> Result<Normality, StationarityError> {
    let n = signal.len() as f64;
    let mean = total(signal, |x| [x])[0] / n;
    let level: Vec<f64> = signal.iter().map(|x| x - mean).collect();
    let [second, third, fourth] = total(&level, |x| [x * x, x * x * x, x * x * (x * x)]).map(|sum| sum / n);
    // Round-off of the mean leaves a constant with a variance of up to this size.
    if second.is_nan() || second <= (n * f64::EPSILON * mean).powi(2) {
        return Err(StationarityError::NoVariance);
    }
    let covariance: Vec<f64> = autocorrelation(&level, LAGS).iter().map(|r| r / n).collect();
    let sum = |power: i32| second.powi(power) + 2.0 * covariance[1..].iter().map(|c| c.powi(power)).sum::<f64>();
    // The sum of cubes can come out small or negative by chance; that of white noise is the least that is believed.
    let (cubes, fourths) = (sum(3).max(second.powi(3)), sum(4));
    let statistic = n * third * third / (6.0 * cubes) + n * (fourth - 3.0 * second * second).powi(2) / (24.0 * fourths);
    Ok(Normality { skewness: third / second.powf(1.5), excess_kurtosis: fourth / (second * second) - 3.0, p_value: (-statistic / 2.0).exp() })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Amplitudes;
    use rand::{Rng, SeedableRng};
    use rand_distr::{Distribution, StandardNormal};

    fn correlated(rng: &mut impl Rng, n: usize, memory: f64) -> Vec<f64> {
        let mut state = 0.0;
        (0..n)
            .map(|_| {
                let fresh: f64 = StandardNormal.sample(rng);
                state = memory * state + fresh;
                state
            })
            .collect()
    }

    #[test]
    fn the_exact_distribution_has_the_mean_and_tails_of_the_table() {
        // Bendat & Piersol 2010, Table A.6: for N = 10, A = 11 and 33 bound 95 % (P(A ≤ 11) ≤ 0.025 < P(A ≤ 12) …).
        let with = |inversions: usize| {
            let mut values: Vec<f64> = (0..10).map(f64::from).collect();
            let mut left = inversions;
            for end in 1..10 {
                let step = left.min(end);
                values[end - step..=end].rotate_right(1);
                left -= step;
            }
            reverse_arrangements(&values).expect("ten values")
        };
        for a in 0..=45 {
            assert_eq!(with(a).count, a);
            assert!((with(a).p_value - with(45 - a).p_value).abs() < 1e-12);
        }
        assert_eq!(with(0).expected, 22.5);
        assert!((with(0).p_value - 2.0 / 3_628_800.0).abs() < 1e-15);
        assert!(with(11).p_value < 0.05 && with(12).p_value > 0.05, "{} {}", with(11).p_value, with(12).p_value);
    }

    #[test]
    fn a_trend_is_seen_and_noise_is_not_more_often_than_it_should() {
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(1);
        let trend = |x: &[f64]| reverse_arrangements(&Amplitudes::of(x).mean_squares(20).expect("valid")).expect("valid").p_value < 0.05;
        let (mut false_alarms, mut found) = (0, 0);
        for _ in 0..400 {
            let mut x = correlated(&mut rng, 2000, 0.5);
            false_alarms += usize::from(trend(&x));
            x.iter_mut().enumerate().for_each(|(k, v)| *v *= 1.0 + k as f64 / 2000.0);
            found += usize::from(trend(&x));
        }
        // At most 5 % of 400 and four sigma of the binomial.
        assert!(false_alarms as f64 <= 20.0 + 4.0 * (400.0_f64 * 0.05 * 0.95).sqrt(), "{false_alarms}");
        assert!(found > 380, "{found}");
    }

    #[test]
    fn gaussian_processes_pass_at_the_nominal_rate() {
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(2);
        let rejected = (0..400).filter(|_| normality(&correlated(&mut rng, 4000, 0.7)).expect("varies").p_value < 0.05).count();
        // The χ² is reached slowly from below: at most 5 % of 400 and four sigma of the binomial, and not nothing.
        assert!((1..=37).contains(&rejected), "{rejected}");
        assert_eq!(normality(&[3.3; 100]).unwrap_err(), StationarityError::NoVariance);
        assert_eq!(normality(&[]).unwrap_err(), StationarityError::NoVariance);
    }

    #[test]
    fn what_is_skewed_or_flat_is_found_and_its_moments_are_right() {
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(3);
        let uniform: Vec<f64> = (0..2000).map(|k| 3.0 * (f64::from(k) + 0.5) / 2000.0).collect();
        // Fourth moment of the uniform distribution: 9/5 of the squared variance.
        let flat = normality(&uniform).expect("varies");
        assert!((flat.excess_kurtosis + 1.2).abs() < 1e-5 && flat.skewness.abs() < 1e-9, "{flat:?}");
        let squares: Vec<f64> = correlated(&mut rng, 2000, 0.0).iter().map(|x| 0.1 * x * x).collect();
        // χ² of one degree: skewness √8; the statistic is some hundreds.
        let skewed = normality(&squares).expect("varies");
        assert!((1.5..4.5).contains(&skewed.skewness) && skewed.p_value < 1e-12, "{skewed:?}");
    }

    #[test]
    fn too_few_values_are_refused() {
        assert_eq!(reverse_arrangements(&[1.0; 3]).unwrap_err(), StationarityError::Count(3));
        // Ties count half: a constant shows no trend.
        assert!(reverse_arrangements(&[1.0; 16]).expect("sixteen").p_value > 0.9);
    }

    #[test]
    fn six_values_have_the_probabilities_of_all_their_orders() {
        // Of 720 orders 1, 5, 14, 29, 49, 71 and 90 have 0 to 6 inversions (Mahonian numbers).
        let p = |values: [f64; 6]| reverse_arrangements(&values).expect("six values").p_value;
        assert!((p([2.0, 1.0, 4.0, 3.0, 5.0, 6.0]) - 2.0 * 20.0 / 720.0).abs() < 1e-12);
        assert!((p([4.0, 3.0, 2.0, 1.0, 5.0, 6.0]) - 2.0 * 259.0 / 720.0).abs() < 1e-12);
    }

    #[test]
    fn the_test_of_shape_is_its_formula_with_every_covariance() {
        let x: Vec<f64> = (0..60).map(|k| (f64::from(k) * 0.9).sin() + (f64::from(k * k) * 0.37).sin().powi(2)).collect();
        let n = 60.0;
        let mean = x.iter().sum::<f64>() / n;
        let covariance = |lag: usize| x[lag..].iter().zip(&x).map(|(a, b)| (a - mean) * (b - mean)).sum::<f64>() / n;
        let moment = |power: i32| x.iter().map(|x| (x - mean).powi(power)).sum::<f64>() / n;
        let both_sides = |power: i32| covariance(0).powi(power) + 2.0 * (1..60).map(|lag| covariance(lag).powi(power)).sum::<f64>();
        let skewed = n * moment(3).powi(2) / (6.0 * both_sides(3).max(moment(2).powi(3)));
        let flat = n * (moment(4) - 3.0 * moment(2).powi(2)).powi(2) / (24.0 * both_sides(4));
        let found = normality(&x).expect("varies").p_value;
        assert!((found - (-(skewed + flat) / 2.0).exp()).abs() < 1e-12 && found < 0.9, "{found}");
    }

    #[test]
    fn a_constant_of_any_size_has_no_shape_and_a_coin_without_a_mean_has() {
        for constant in [1e-7 / 3.0, 0.1, 1e7 / 3.0] {
            assert_eq!(normality(&vec![constant; 1001]).unwrap_err(), StationarityError::NoVariance, "{constant}");
        }
        let coin = normality(&[1.0, -1.0, -1.0, 1.0, 1.0, -1.0, 1.0, -1.0]).expect("varies");
        assert_eq!((coin.skewness, coin.excess_kurtosis), (0.0, -2.0));
    }
}
