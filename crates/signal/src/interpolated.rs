//! What lies between samples at uneven times.

/// `values`, taken at `times`, at other times that do not decrease: cubic Hermite interpolation with the slopes of the parabola through three neighbours,
/// exact for parabolas, and local, so that a missing sample (NaN) spoils only its own neighbourhood. Beyond the ends the value there.
///
/// `times` increase; both are of one length, of two or more.
///
/// ```
/// let parabola = |t: f64| 1.0 + t - 0.5 * t * t;
/// let times = [0.0, 0.7, 2.0, 2.9, 4.0];
/// let between = ndof_signal::interpolated(&times, &times.map(parabola), [1.0, 2.0, 3.0].into_iter());
/// assert!(between.iter().zip([1.0, 2.0, 3.0]).all(|(y, t)| (y - parabola(t)).abs() < 1e-13));
/// ```
pub fn interpolated(times: &[f64], values: &[f64], at: impl Iterator<Item = f64>) -> Vec<f64> {
    let n = times.len();
    let mut k = 0;
    at.map(|t| {
        while k + 2 < n && times[k + 1] <= t {
            k += 1;
        }
        hermite(times, values, k, t)
    })
    .collect()
}

fn hermite(x: &[f64], y: &[f64], k: usize, t: f64) -> f64 {
    let h = x[k + 1] - x[k];
    let u = ((t - x[k]) / h).clamp(0.0, 1.0);
    if u == 0.0 {
        return y[k];
    }
    if u == 1.0 {
        return y[k + 1];
    }
    let (m0, m1) = (slope(x, y, k), slope(x, y, k + 1));
    let v = 1.0 - u;
    y[k] * v * v * (1.0 + 2.0 * u) + y[k + 1] * u * u * (1.0 + 2.0 * v) + h * u * v * (m0 * v - m1 * u)
}

/// The slope at `k` of the parabola through it and its neighbours; at an end, of the parabola of its neighbour.
fn slope(x: &[f64], y: &[f64], k: usize) -> f64 {
    let n = x.len();
    if n == 2 {
        return (y[1] - y[0]) / (x[1] - x[0]);
    }
    let c = k.clamp(1, n - 2);
    let (h0, h1) = (x[c] - x[c - 1], x[c + 1] - x[c]);
    let (d0, d1) = ((y[c] - y[c - 1]) / h0, (y[c + 1] - y[c]) / h1);
    let curvature = (d1 - d0) / (h0 + h1);
    d0 + curvature * (2.0 * x[k] - x[c - 1] - x[c])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_parabola_is_reproduced_exactly_between_uneven_samples() {
        let times: Vec<f64> = (0..40).map(|k| k as f64 + 0.3 * (k as f64 * 1.7).sin()).collect();
        let parabola = |t: f64| (1.0 + 0.5 * t - 0.02 * t * t) / 40.0;
        let values: Vec<f64> = times.iter().map(|&t| parabola(t)).collect();
        for (i, v) in interpolated(&times, &values, (0..39).map(|i| times[0] + f64::from(i))).iter().enumerate() {
            let truth = parabola(times[0] + i as f64);
            // Round-off of a handful of operations on numbers of order one.
            assert!((v - truth).abs() < 1e-13, "{i}: {v} {truth}");
        }
    }
}
