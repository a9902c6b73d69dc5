//! Middle and spread that a few outliers do not move.

/// A deviation over the median of distances from the median, by the normal law.
const OF_A_MEDIAN: f64 = 1.4826;

/// The median, and the deviation by the distances from it.
pub(crate) fn spread(values: &[f64]) -> (f64, f64) {
    let middle = median(values.to_vec());
    (middle, OF_A_MEDIAN * median(values.iter().map(|x| (x - middle).abs()).collect()))
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(0.0)
}
