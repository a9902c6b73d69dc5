//! How large signals are, and how far they spread.

/// A deviation over the median of distances from the median, by the normal law.
const OF_A_MEDIAN: f64 = 1.4826;

/// Root of the mean square; zero for no samples.
pub fn rms(x: &[f64]) -> f64 {
    (x.iter().map(|x| x * x).sum::<f64>() / x.len().max(1) as f64).sqrt()
}

/// Standard deviation, of all samples that there are; zero for none.
pub fn deviation(x: &[f64]) -> f64 {
    let mean = x.iter().sum::<f64>() / x.len().max(1) as f64;
    (x.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / x.len().max(1) as f64).sqrt()
}

/// Median, and standard deviation by the distances from it, which few outliers do not move; zero for no samples.
pub fn robust_spread(x: &[f64]) -> (f64, f64) {
    let middle = median(x.to_vec());
    (middle, OF_A_MEDIAN * median(x.iter().map(|x| (x - middle).abs()).collect()))
}

fn median(mut x: Vec<f64>) -> f64 {
    x.sort_by(f64::total_cmp);
    x.get(x.len() / 2).copied().unwrap_or(0.0)
}
