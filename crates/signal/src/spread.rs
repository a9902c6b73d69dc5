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

/// Places at most at which a scatter is looked at: its deviation is known to a hundredth by them.
const PLACES: usize = 1 << 16;

/// Robust standard deviation about zero of what `of` tells of so many places; zero where there are none, or nine in ten tell zero.
pub(crate) fn scatter(places: usize, of: impl Fn(usize) -> f64) -> f64 {
    let mut sizes: Vec<f64> = (0..places).step_by(places.div_ceil(PLACES).max(1)).map(|k| of(k).abs()).filter(|size| size.is_finite()).collect();
    let (middle, far) = (sizes.len() / 2, 9 * sizes.len() / 10);
    let mut at = |place: usize| if sizes.is_empty() { 0.0 } else { *sizes.select_nth_unstable_by(place, f64::total_cmp).1 };
    let far = at(far);
    robust_deviation(at(middle), far)
}

/// A robust standard deviation: 1.4826 times the median distance or, of what rests or goes between levels, the distance of nine in ten over 1.645.
pub(crate) fn robust_deviation(median: f64, nine_in_ten: f64) -> f64 {
    (OF_A_MEDIAN * median).max(nine_in_ten / 1.645)
}

fn median(mut x: Vec<f64>) -> f64 {
    x.sort_by(f64::total_cmp);
    x.get(x.len() / 2).copied().unwrap_or(0.0)
}
