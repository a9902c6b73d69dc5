//! Noise of a torque as an autoregression, and what makes it white.

use ndof_linear::{cholesky_in_place, cholesky_solve};

/// e_k = x_k − Σ φ_i x_{k−i}, over its standard deviation.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Whitener {
    pub coefficients: Vec<f64>,
    pub deviation: f64,
}

/// Largest order that is tried; a log of n samples is given no more than the tenth of its length.
const LARGEST: usize = 16;

impl Whitener {
    /// White noise of this deviation.
    pub fn plain(deviation: f64) -> Self {
        Whitener { coefficients: vec![], deviation: deviation.max(f64::MIN_POSITIVE) }
    }

    /// The autoregression of stretches of noise, its order by BIC; least squares over all stretches together. Of silence it has no deviation.
    pub fn of(stretches: &[&[f64]]) -> Self {
        let count: usize = stretches.iter().map(|x| x.len()).sum();
        let most = LARGEST.min(count / 10);
        // Σ x_{k−i} x_{k−j}, over the samples that every order has a past for.
        let mut moments = vec![vec![0.0; most + 1]; most + 1];
        for window in stretches.iter().flat_map(|x| x.windows(most + 1)) {
            for (i, row) in moments.iter_mut().enumerate() {
                row.iter_mut().enumerate().for_each(|(j, sum)| *sum += window[most - i] * window[most - j]);
            }
        }
        let n = stretches.iter().map(|x| x.len().saturating_sub(most)).sum::<usize>() as f64;
        let mut best: Option<(f64, Whitener)> = None;
        for order in 0..=most {
            let past = 1..=order;
            let mut normal: Vec<f64> = past.clone().flat_map(|i| moments[i][past.clone()].to_vec()).collect();
            if order > 0 && !cholesky_in_place(&mut normal, order) {
                break;
            }
            let mut coefficients = moments[0][past.clone()].to_vec();
            cholesky_solve(&normal, order, &mut coefficients);
            let variance = (moments[0][0] - coefficients.iter().zip(&moments[0][past]).map(|(c, m)| c * m).sum::<f64>()) / n;
            if variance.is_nan() || variance <= 0.0 {
                break;
            }
            let bic = n * variance.ln() + order as f64 * n.ln();
            if best.as_ref().is_none_or(|(least, _)| bic < *least) {
                best = Some((bic, Whitener { coefficients, deviation: variance.sqrt() }));
            }
        }
        best.map_or(Whitener { coefficients: vec![], deviation: 0.0 }, |(_, whitener)| whitener)
    }

    /// The white sequence of a stretch, shorter by the order.
    pub fn apply(&self, x: &[f64]) -> Vec<f64> {
        let order = self.coefficients.len();
        (order..x.len()).map(|k| (x[k] - self.coefficients.iter().enumerate().map(|(i, c)| c * x[k - 1 - i]).sum::<f64>()) / self.deviation).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};

    #[test]
    fn coloured_noise_comes_out_white() {
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(1);
        let mut x = vec![0.0; 20_000];
        for k in 2..x.len() {
            x[k] = 1.2 * x[k - 1] - 0.5 * x[k - 2] + rng.random_range(-1.0..1.0);
        }
        let found = Whitener::of(&[&x[..10_000], &x[10_000..]]);
        let e = found.apply(&x);
        let n = e.len() as f64;
        let lag = |l: usize| e[l..].iter().zip(&e).map(|(a, b)| a * b).sum::<f64>() / n;
        // Autocorrelations of white noise have a standard error of 1/√n.
        assert!((lag(0) - 1.0).abs() < 0.02 && (1..6).all(|l| lag(l).abs() < 4.0 / n.sqrt()));
        assert!((found.coefficients[0] - 1.2).abs() < 0.05 && (found.coefficients[1] + 0.5).abs() < 0.05, "{found:?}");
    }
}
