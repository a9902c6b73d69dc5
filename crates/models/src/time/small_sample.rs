//! Intervals that allow for a noise model that was itself estimated, and from few independent values where the noise is slow.

use super::noise::Chain;
use super::shooting::Shooting;
use faer::Mat;
use faer::linalg::solvers::DenseSolveCore;
use ndof_signal::{forward_transform, spectrum_by};
use num_complex::Complex64;
use std::f64::consts::TAU;

/// What the noise model's own uncertainty does to the parameters.
pub(super) struct SmallSample {
    /// What their covariance is to be enlarged by.
    pub excess: Mat<f64>,
    /// Degrees of freedom of each parameter's variance.
    pub degrees: Vec<f64>,
}

/// Derivatives of the information Φ⁻¹ in one axis' noise model (Laguerre coefficients, then ln σ²), and the covariance of those.
struct NoiseSlopes {
    information: Vec<Mat<f64>>,
    covariance: Mat<f64>,
}

/// Kenward and Roger's correction: with Φ the covariance of the parameters at the estimated noise model η, W that of η and
/// P_j = ∂Φ⁻¹/∂η_j, the excess is 2 Φ [Σ W_jk (Q_jk − P_j Φ P_k)] Φ, where Σ W_jk Q_jk is the information with each frequency
/// weighted by the variance of the logarithm of the estimated spectrum there; one half because the weights scatter, the other because
/// Φ is too small by as much. Variances have 2 Φ_kk²/(gᵀ W g) degrees of freedom, g_j = (Φ P_j Φ)_kk (Satterthwaite).
///
/// # References
/// M. G. Kenward & J. H. Roger (1997), Small sample inference for fixed effects from restricted maximum likelihood.
pub(super) fn small_sample(problem: &Shooting<'_>, x: &[f64], phi: &Mat<f64>, variance: f64) -> SmallSample {
    let m = x.len();
    let mut middle = Mat::<f64>::zeros(m, m);
    let mut scatter = vec![0.0; m];
    for axis in 0..problem.axes() {
        let (slopes, weighted) = axis_slopes(problem, x, phi, variance, axis);
        middle += &weighted;
        let turned: Vec<Mat<f64>> = slopes.information.iter().map(|p| phi * p).collect();
        for (k, out) in scatter.iter_mut().enumerate() {
            let g: Vec<f64> = turned.iter().map(|t| (0..m).map(|c| t[(k, c)] * phi[(c, k)]).sum()).collect();
            *out += (0..g.len()).map(|a| (0..g.len()).map(|b| g[a] * slopes.covariance[(a, b)] * g[b]).sum::<f64>()).sum::<f64>();
        }
        for (k, p) in slopes.information.iter().enumerate() {
            let mut mixed = Mat::<f64>::zeros(m, m);
            turned.iter().enumerate().for_each(|(j, t)| mixed += t * faer::Scale(slopes.covariance[(j, k)]));
            middle -= p * mixed;
        }
    }
    let excess = phi * middle * phi * faer::Scale(2.0);
    let degrees = (0..m).map(|k| if scatter[k] > 0.0 { 2.0 * phi[(k, k)].powi(2) / scatter[k] } else { f64::INFINITY }).collect();
    SmallSample { excess, degrees }
}

/// The slopes of one axis, and its information weighted by the variance of the log spectrum.
fn axis_slopes(problem: &Shooting<'_>, x: &[f64], phi: &Mat<f64>, variance: f64, axis: usize) -> (NoiseSlopes, Mat<f64>) {
    let (m, axes) = (x.len(), problem.axes());
    let colour = &problem.coloured[axis];
    let order = colour.coefficients.len();
    let moments = problem.moments(x, axis, order, colour.pole, Some(phi));
    let inverse = if order > 0 { moments.submatrix(0, 0, order, order).partial_piv_lu().inverse() } else { Mat::zeros(0, 0) };
    let mut samples = 0;
    let mut information: Vec<Mat<f64>> = (0..=order).map(|_| Mat::zeros(m, m)).collect();
    let mut spectra = Vec::new();
    for window in 0..problem.windows.len() {
        let (width, settle, rows) = problem.raw(x, window, true);
        let local = width - 1;
        let columns: Vec<usize> = problem.columns_of(window).collect();
        let mut chain = Chain::new(order, colour.pole, local);
        let mut white: Vec<Vec<f64>> = vec![Vec::with_capacity(rows.len() / (width * axes)); local];
        let mut sums = vec![vec![0.0; local * local]; order + 1];
        for (k, row) in rows.chunks_exact(width).skip(axis).step_by(axes).enumerate() {
            let mut own = row[..local].to_vec();
            for (a, state) in colour.coefficients.iter().zip(chain.states()) {
                own.iter_mut().zip(state).for_each(|(v, s)| *v -= a * s);
            }
            if k >= settle {
                samples += 1;
                for (sum, state) in sums.iter_mut().zip(chain.states().chain([own.as_slice()])) {
                    for (line, s) in sum.chunks_exact_mut(local).zip(state) {
                        line.iter_mut().zip(&own).for_each(|(v, w)| *v += s * w);
                    }
                }
                white.iter_mut().zip(&own).for_each(|(column, v)| column.push(*v));
            }
            chain.push(&row[..local]);
        }
        for (j, sum) in sums.iter().enumerate() {
            for (r, &row) in columns.iter().enumerate() {
                for (c, &column) in columns.iter().enumerate() {
                    // ∂(a)/∂a_j of the whitened columns is −L_j J; the last is that of ln σ².
                    let both = if j < order { sum[r * local + c] + sum[c * local + r] } else { sum[r * local + c] };
                    information[j][(row, column)] -= both / variance;
                }
            }
        }
        spectra.push((columns, white));
    }
    let mut covariance = Mat::zeros(order + 1, order + 1);
    (0..order).for_each(|a| (0..order).for_each(|b| covariance[(a, b)] = variance * inverse[(a, b)]));
    covariance[(order, order)] = 2.0 / f64::max(samples as f64, 1.0);
    let mut weighted = Mat::zeros(m, m);
    for (columns, white) in &spectra {
        add_weighted(&mut weighted, columns, white, &colour.coefficients, colour.pole, &covariance, variance);
    }
    (NoiseSlopes { information, covariance }, weighted)
}

/// Adds ∫ J* J u/s² of whitened columns, u(f) the variance of the logarithm of the noise model's spectrum.
fn add_weighted(into: &mut Mat<f64>, columns: &[usize], white: &[Vec<f64>], coefficients: &[f64], pole: f64, covariance: &Mat<f64>, variance: f64) {
    let samples = white.first().map_or(0, Vec::len);
    let length = (2 * samples).next_power_of_two().max(2);
    let plan = forward_transform(length);
    let bins = length / 2 + 1;
    let order = coefficients.len();
    let gain = (1.0 - pole * pole).sqrt();
    let root: Vec<f64> = (0..bins)
        .map(|f| {
            let back = Complex64::from_polar(1.0, -TAU * f as f64 / length as f64);
            let turn = (back - pole) / (1.0 - pole * back);
            let mut function = gain * back / (1.0 - pole * back);
            let mut functions = Vec::with_capacity(order);
            let mut left = Complex64::new(1.0, 0.0);
            for a in coefficients {
                left -= a * function;
                functions.push(function);
                function *= turn;
            }
            // ∂ ln S/∂a_j = 2 Re L_j/A, and 1 in ln σ².
            let slope: Vec<f64> = functions.iter().map(|l| 2.0 * (l / left).re).chain([1.0]).collect();
            let u: f64 = (0..=order).map(|a| (0..=order).map(|b| slope[a] * covariance[(a, b)] * slope[b]).sum::<f64>()).sum();
            let twice = if f == 0 || f + 1 == bins { 1.0 } else { 2.0 };
            (twice * u.max(0.0) / (length as f64 * variance)).sqrt()
        })
        .collect();
    let transformed: Vec<Vec<Complex64>> = white
        .iter()
        .map(|column| {
            let mut input = column.clone();
            input.resize(length, 0.0);
            spectrum_by(plan.as_ref(), &mut input).iter().zip(&root).map(|(v, r)| v * r).collect()
        })
        .collect();
    for (r, &row) in columns.iter().enumerate() {
        for (c, &column) in columns.iter().enumerate() {
            into[(row, column)] += transformed[r].iter().zip(&transformed[c]).map(|(a, b)| (a.conj() * b).re).sum::<f64>();
        }
    }
}
