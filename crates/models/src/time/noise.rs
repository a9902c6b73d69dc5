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
    /// The same with Laguerre's functions in place of plain delays: e_k = Σ a_j L_j(q) e_k + white with
    /// L_j = g q⁻¹/(1 − λ q⁻¹) · [(q⁻¹ − λ)/(1 − λ q⁻¹)]^(j−1) and λ = e^(−1/memory). A few of them reach as far back as slow noise
    /// on a fast grid asks for, where plain delays would need hundreds.
    ///
    /// # References
    /// B. Wahlberg (1991), System identification using Laguerre models.
    Laguerre {
        /// How many functions.
        order: usize,
        /// Samples in which the first of them forgets.
        memory: usize,
    },
}

impl Noise {
    /// Order and pole of what whitens; `None` where nothing does.
    pub(super) fn whitener(self) -> Option<(usize, f64)> {
        match self {
            Noise::Blocks => None,
            Noise::Autoregressive(order) => Some((order, 0.0)),
            Noise::Laguerre { order, memory } => Some((order, (-1.0 / memory.max(1) as f64).exp())),
        }
    }
}

/// What one axis' residuals have in common with their past.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Colour {
    pub pole: f64,
    pub coefficients: Vec<f64>,
}

/// Laguerre's functions of rows that come one after the other; with a pole of 0 their delays.
pub(super) struct Chain {
    pole: f64,
    gain: f64,
    width: usize,
    /// Order × width.
    states: Vec<f64>,
    before: Vec<f64>,
}

impl Chain {
    pub(super) fn new(order: usize, pole: f64, width: usize) -> Self {
        Chain { pole, gain: (1.0 - pole * pole).sqrt(), width, states: vec![0.0; order * width], before: vec![0.0; width] }
    }

    /// What the rows so far say of the next one, one slice a function.
    pub(super) fn states(&self) -> impl Iterator<Item = &[f64]> {
        self.states.chunks_exact(self.width)
    }

    pub(super) fn push(&mut self, row: &[f64]) {
        let (pole, gain, width) = (self.pole, self.gain, self.width);
        for j in 0..self.states.len() / width {
            let (below, own) = self.states.split_at_mut(j * width);
            for c in 0..width {
                let old = own[c];
                own[c] = pole * old + if j == 0 { gain * row[c] } else { self.before[c] - pole * below[(j - 1) * width + c] };
                self.before[c] = old;
            }
        }
    }
}

/// Coefficients a of e = Σ a_j L_j e + white from the moments of (L₁ e … L_order e, e).
pub(crate) fn coefficients(moments: &Mat<f64>) -> Vec<f64> {
    let order = moments.nrows() - 1;
    if order == 0 || moments[(order, order)] <= 0.0 {
        return Vec::new();
    }
    let left = moments.submatrix(0, 0, order, order).to_owned();
    let right = Mat::from_fn(order, 1, |j, _| moments[(j, order)]);
    let solved = left.qr().solve_lstsq(&right);
    let out: Vec<f64> = (0..order).map(|j| solved[(j, 0)]).collect();
    if out.iter().all(|a| a.is_finite()) { out } else { Vec::new() }
}

/// Adds the moments of every column of `rows`, which follow one another, to those of (L₁ e … L_order e, e).
pub(crate) fn add_moments(moments: &mut Mat<f64>, pole: f64, rows: impl Iterator<Item = Vec<f64>>, width: usize) {
    let order = moments.nrows() - 1;
    let mut chain = Chain::new(order, pole, width);
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    for row in rows {
        for (j, a) in chain.states().enumerate() {
            for (k, b) in chain.states().enumerate().take(j + 1) {
                moments[(j, k)] += dot(a, b);
            }
            moments[(order, j)] += dot(a, &row);
        }
        moments[(order, order)] += dot(&row, &row);
        chain.push(&row);
    }
    for j in 0..=order {
        (0..j).for_each(|k| moments[(k, j)] = moments[(j, k)]);
    }
}

/// Replaces rows (each `width` long, as many axes interleaved as there are colours) by what their past does not say of them.
pub(crate) fn whiten(rows: &mut [f64], width: usize, colours: &[Colour]) {
    let mut chains: Vec<Chain> = colours.iter().map(|c| Chain::new(c.coefficients.len(), c.pole, width)).collect();
    let mut own = vec![0.0; width];
    for (r, row) in rows.chunks_exact_mut(width).enumerate() {
        let axis = r % colours.len();
        own.copy_from_slice(row);
        for (a, state) in colours[axis].coefficients.iter().zip(chains[axis].states()) {
            row.iter_mut().zip(state).for_each(|(v, s)| *v -= a * s);
        }
        chains[axis].push(&own);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn second_order(samples: usize) -> Vec<f64> {
        let (mut seed, mut e) = (1u64, vec![0.0f64; samples]);
        for k in 2..e.len() {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            let white = (seed >> 11) as f64 / (1u64 << 53) as f64 - 0.5;
            e[k] = 1.6 * e[k - 1] - 0.8 * e[k - 2] + white;
        }
        e
    }

    #[test]
    fn an_autoregression_is_found_and_taken_out() {
        let e = second_order(20_000);
        let mut moments = Mat::zeros(3, 3);
        for part in [&e[..9000], &e[9000..]] {
            add_moments(&mut moments, 0.0, part.iter().map(|v| vec![*v]), 1);
        }
        let found = coefficients(&moments);
        // Var a = (1 - a2²)/N: 0.6/141; four of that.
        assert!((found[0] - 1.6).abs() < 0.017 && (found[1] + 0.8).abs() < 0.017, "{found:?}");
        let mut rows = e.clone();
        whiten(&mut rows, 1, &[Colour { pole: 0.0, coefficients: vec![1.6, -0.8] }]);
        assert!(rows[2..].iter().all(|w| w.abs() <= 0.5 + 1e-9));
    }

    #[test]
    fn functions_of_laguerre_are_orthonormal() {
        let mut chain = Chain::new(4, 0.8, 1);
        let mut gram = [[0.0; 4]; 4];
        for k in 0..600 {
            let now: Vec<f64> = chain.states().map(|s| s[0]).collect();
            (0..4).for_each(|i| (0..4).for_each(|j| gram[i][j] += now[i] * now[j]));
            chain.push(&[f64::from(u8::from(k == 0))]);
        }
        // 0.8^600 is nothing; sums of 600 terms.
        assert!((0..16).all(|e| (gram[e / 4][e % 4] - f64::from(u8::from(e / 4 == e % 4))).abs() < 1e-12), "{gram:?}");
    }
}
