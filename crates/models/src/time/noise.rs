//! What the residuals of a fit in time are taken for.

use faer::Mat;
use faer::prelude::SolveLstsq;
use serde::{Deserialize, Serialize};

/// What the residuals of a fit in time are taken for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Noise {
    /// Anything: unweighted in time, and intervals come from the scatter of the scores of blocks. Needs many blocks.
    #[default]
    Blocks,
    /// An autoregression of this order, estimated with the model: residuals are whitened by it, and intervals follow from
    /// the likelihood. 0 is white noise.
    Autoregressive(usize),
}

/// Coefficients a of e_k = Σ a_j e_(k−j) + white, by least squares over stretches that are each `axes` interleaved series.
pub(super) fn autoregression(stretches: &[Vec<f64>], order: usize) -> Vec<f64> {
    let rows: usize = stretches.iter().map(|s| s.len().saturating_sub(order)).sum();
    if order == 0 || rows <= 2 * order {
        return Vec::new();
    }
    let at: Vec<(usize, usize)> = stretches.iter().enumerate().flat_map(|(s, e)| (order..e.len()).map(move |k| (s, k))).collect();
    let past = Mat::from_fn(rows, order, |r, j| stretches[at[r].0][at[r].1 - 1 - j]);
    let now = Mat::from_fn(rows, 1, |r, _| stretches[at[r].0][at[r].1]);
    let gram = past.transpose() * &past;
    let solved = gram.qr().solve_lstsq(past.transpose() * &now);
    (0..order).map(|j| solved[(j, 0)]).collect()
}

/// Replaces rows (each `width` long, `axes` interleaved) by what their autoregression leaves, from the last to the first.
/// The first rows of a stretch keep what they lack a past for.
pub(super) fn whiten(rows: &mut [f64], width: usize, coefficients: &[Vec<f64>]) {
    let axes = coefficients.len();
    let total = rows.len() / width;
    for r in (0..total).rev() {
        let own = &coefficients[r % axes];
        for (j, a) in own.iter().enumerate() {
            let Some(past) = r.checked_sub((j + 1) * axes) else { break };
            let (before, after) = rows.split_at_mut(r * width);
            after[..width].iter_mut().zip(&before[past * width..(past + 1) * width]).for_each(|(v, p)| *v -= a * p);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_autoregression_is_found_and_taken_out() {
        let (mut seed, mut e) = (1u64, vec![0.0f64; 20_000]);
        for k in 2..e.len() {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            let white = (seed >> 11) as f64 / (1u64 << 53) as f64 - 0.5;
            e[k] = 1.6 * e[k - 1] - 0.8 * e[k - 2] + white;
        }
        let found = autoregression(&[e[..9000].to_vec(), e[9000..].to_vec()], 2);
        // Var a = (1 - a2²)/N: 0.6/141; four of that.
        assert!((found[0] - 1.6).abs() < 0.017 && (found[1] + 0.8).abs() < 0.017, "{found:?}");
        let mut rows = e.clone();
        whiten(&mut rows, 1, &[vec![1.6, -0.8]]);
        assert!(rows[2..].iter().all(|w| w.abs() <= 0.5 + 1e-9));
    }
}
