//! An estimate beside a model, each frequency weighed by the noise that it has if the model is true.

use super::{Prediction, Solved, add_scores, shares, summed_scores};
use crate::levenberg_marquardt::{root, triangle};
use crate::{Gains, LeastSquares};
use faer::Mat;
use ndof_linear::{Cholesky, square};
use ndof_sysid::{FrequencyResponse, Uncertainty};
use num_complex::Complex64;
use std::borrow::Cow;
use std::ops::Range;

/// Bins an independent one that are used at most.
const DENSE: f64 = 4.0;
/// The usable bins of the band with what whitens them.
pub(super) fn bins(band_hz: [f64; 2], response: &FrequencyResponse, uncertainty: &Uncertainty, full: bool) -> Vec<Bin> {
    let (p, q) = response.shape();
    let usable: Vec<usize> = (0..response.len())
        .filter(|&f| {
            let hz = response.frequency_hz[f];
            hz > 0.0 && (band_hz[0]..=band_hz[1]).contains(&hz) && response.value.index_axis(ndarray::Axis(0), f).iter().all(|v| v.is_finite())
        })
        .collect();
    let stride = response.stride(DENSE);
    let mut bins = Vec::with_capacity(usable.len().div_ceil(stride));
    for &f in usable.iter().step_by(stride) {
        let matrix = |a: &ndarray::Array3<Complex64>| a.index_axis(ndarray::Axis(0), f).iter().copied().collect::<Vec<_>>();
        let (noise, input) = (matrix(&uncertainty.noise), matrix(&uncertainty.input_inverse));
        let diagonal = |a: &[Complex64], n: usize| (0..n * n).map(|e| if e / n == e % n { a[e] } else { Complex64::default() }).collect();
        let whitener = |a: &[Complex64], n: usize| Cholesky::of(&if full { a.to_vec() } else { diagonal(a, n) }, n).map(|c| c.whitener());
        let (Some(left), Some(right)) = (whitener(&noise, p), whitener(&input, q)) else {
            continue;
        };
        bins.push(Bin {
            hz: response.frequency_hz[f],
            share: 0.0,
            weight: 1.0,
            estimate: matrix(&response.value),
            right: square::adjoint(&right, q),
            left,
            noise,
            input,
            unexplained: uncertainty.unexplained.as_ref().filter(|_| full).map(matrix),
        });
    }
    let hz: Vec<f64> = bins.iter().map(|b| b.hz).collect();
    bins.iter_mut().zip(shares(&hz, uncertainty.independent_spacing_hz)).for_each(|(b, share)| b.share = share);
    bins
}

/// One frequency of an estimate with what whitens it: √(2 share weight) · left · δ · right has unit variance.
pub(super) struct Bin {
    pub hz: f64,
    pub share: f64,
    /// Beside that of its noise.
    weight: f64,
    estimate: Vec<Complex64>,
    /// Of the noise that the estimate itself has.
    left: Vec<Complex64>,
    right: Vec<Complex64>,
    noise: Vec<Complex64>,
    input: Vec<Complex64>,
    /// Σ of outputs and inputs, by which the noise follows the model.
    unexplained: Option<Vec<Complex64>>,
}

/// What whitens a frequency's δ where a model is true.
struct Sides<'a> {
    left: Cow<'a, [Complex64]>,
    right: Cow<'a, [Complex64]>,
}

impl Bin {
    /// By what the estimate itself says of its noise, or by what Σ says of the model's: N = A Σ Aᴴ with A = \[1, −H\]. Inputs then are what they likely
    /// were if the model is true, T̂ − Σ_ue N⁻¹ E with Σ_ue = Σ_uy − Σ_uu Hᴴ: the cost has the slope −2 Re tr(N⁻¹ E W (T̂ − Σ_ue N⁻¹ E)ᴴ ∂Hᴴ). Not a
    /// number where the model is none.
    fn sides(&self, model: &[Complex64], [p, q]: [usize; 2]) -> Sides<'_> {
        let Some(sigma) = &self.unexplained else { return Sides { left: Cow::Borrowed(&self.left), right: Cow::Borrowed(&self.right) } };
        let block =
            |rows: Range<usize>, columns: Range<usize>| -> Vec<Complex64> { rows.flat_map(|i| columns.clone().map(move |j| sigma[i * (p + q) + j])).collect() };
        let minus: Vec<Complex64> = (0..q * p).map(|e| -model[(e % p) * q + e / p].conj()).collect();
        // Σ Aᴴ, of outputs and of inputs.
        let error = |rows: Range<usize>| {
            let mut of = block(rows.clone(), 0..p);
            square::rectangular_product(&block(rows, p..p + q), &minus, [q, p]).iter().zip(&mut of).for_each(|(v, to)| *to += v);
            of
        };
        let (mut noise, of_inputs) = (error(0..p), error(p..p + q));
        square::rectangular_product(model, &of_inputs, [q, p]).iter().zip(&mut noise).for_each(|(v, to)| *to -= v);
        let Some(left) = Cholesky::of(&noise, p).map(|c| c.whitener()) else {
            let nan = |n: usize| Cow::Owned(vec![Complex64::new(f64::NAN, 0.0); n * n]);
            return Sides { left: nan(p), right: nan(q) };
        };
        let error: Vec<Complex64> = self.estimate.iter().zip(model).map(|(e, m)| e - m).collect();
        let inverse = square::product(&square::adjoint(&left, p), &left, p);
        let taken = square::rectangular_product(&square::rectangular_product(&of_inputs, &inverse, [p, p]), &error, [p, q]);
        let likely: Vec<Complex64> = square::identity::<Complex64>(q).iter().zip(&taken).map(|(one, taken)| one - taken).collect();
        Sides { left: Cow::Owned(left), right: Cow::Owned(square::product(&likely, &self.right, q)) }
    }

    /// √(2 share weight) · left · v · right.
    fn whiten(&self, left: &[Complex64], v: &[Complex64], [p, q]: [usize; 2]) -> Vec<Complex64> {
        let factor = (2.0 * self.share * self.weight).sqrt();
        let left = square::rectangular_product(left, v, [p, q]);
        square::rectangular_product(&left, &self.right, [q, q]).iter().map(|v| v * factor).collect()
    }
}

pub(super) struct Whitened<'a> {
    pub prediction: Prediction<'a>,
    pub bins: Vec<Bin>,
    pub gains: Option<&'a Gains>,
    /// Rows and columns of the estimate.
    pub shape: [usize; 2],
    pub parameters: usize,
    pub known: Known,
}

/// How well the estimate's covariance is known.
#[derive(Clone, Copy)]
pub(super) struct Known {
    pub degrees: f64,
    /// Whether as a matrix, not as variances only.
    pub full: bool,
    /// Independent frequencies.
    pub independent: f64,
}

impl LeastSquares for Whitened<'_> {
    /// Real and imaginary part of each element, bin after bin.
    fn residuals(&self, theta: &[f64]) -> Vec<f64> {
        let size = self.size();
        let (value, _) = self.evaluate(theta, false);
        let mut out = Vec::with_capacity(2 * value.len());
        for (bin, model) in self.bins.iter().zip(value.chunks_exact(size)) {
            let delta: Vec<Complex64> = bin.estimate.iter().zip(model).map(|(e, m)| e - m).collect();
            out.extend(bin.whiten(&bin.sides(model, self.shape).left, &delta, self.shape).iter().flat_map(|v| [v.re, v.im]));
        }
        out
    }

    fn jacobian(&self, theta: &[f64]) -> Mat<f64> {
        let mut out = Mat::zeros(2 * self.size() * self.bins.len(), self.parameters);
        for (first, rows) in self.rows(theta, |bins, rows| (2 * self.size() * bins.start, rows)) {
            out.subrows_mut(first, rows.nrows()).copy_from(rows);
        }
        out
    }

    /// From sums of products, which are the same work on each thread; where those do not serve, from the whole Jacobian.
    fn triangle(&self, theta: &[f64], residuals: &[f64]) -> Mat<f64> {
        let k = self.parameters;
        let parts = self.rows(theta, |bins, rows| {
            let first = 2 * self.size() * bins.start;
            let all = Mat::from_fn(rows.nrows(), k + 1, |i, j| if j < k { rows[(i, j)] } else { residuals[first + i] });
            all.transpose() * &all
        });
        let mut products = Mat::zeros(k + 1, k + 1);
        parts.iter().for_each(|part| products += part);
        root(&products).unwrap_or_else(|| triangle(&self.jacobian(theta), residuals))
    }
}

impl Whitened<'_> {
    pub fn frequency_hz(&self) -> Vec<f64> {
        self.bins.iter().map(|bin| bin.hz).collect()
    }

    /// Gives each frequency another weight, beside that of its noise.
    pub fn weigh(&mut self, weights: &[f64]) {
        for (bin, weight) in self.bins.iter_mut().zip(weights) {
            bin.weight = *weight;
        }
    }

    /// What the model says of each frequency, whitened as the residuals are.
    pub fn whitened_model(&self, theta: &[f64]) -> Vec<Vec<Complex64>> {
        let (value, _) = self.evaluate(theta, false);
        self.bins.iter().zip(value.chunks_exact(self.size())).map(|(bin, model)| bin.whiten(&bin.sides(model, self.shape).left, model, self.shape)).collect()
    }

    /// Elements of one frequency.
    fn size(&self) -> usize {
        self.shape.iter().product()
    }

    /// What `take` makes of the rows of the Jacobian for a few bins at a time, in their order.
    fn rows<T: Send>(&self, theta: &[f64], take: impl Fn(Range<usize>, Mat<f64>) -> T + Sync) -> Vec<T> {
        let size = self.size();
        self.prediction.by_bins(theta, true, |bins, value, slopes| {
            let (value, slopes) = match self.gains {
                Some(gains) => gains.drive(theta, &value, &slopes),
                None => (value, slopes),
            };
            let mut rows = Mat::zeros(2 * size * bins.len(), self.parameters);
            let [p, q] = self.shape;
            let of_bins = self.bins[bins.clone()].iter().zip(value.chunks_exact(size)).zip(slopes.chunks_exact(size * self.parameters));
            for (f, ((bin, model), blocks)) in of_bins.enumerate() {
                let sides = bin.sides(model, self.shape);
                // The blocks stand below each other, so that one product takes the right side of all.
                let driven = square::rectangular_product(blocks, &sides.right, [q, q]);
                let left: Vec<Complex64> = sides.left.iter().map(|v| v * -(2.0 * bin.share * bin.weight).sqrt()).collect();
                for (k, block) in driven.chunks_exact(size).enumerate() {
                    let whitened = square::rectangular_product(&left, block, [p, q]);
                    let column = &mut rows.col_as_slice_mut(k)[2 * size * f..2 * size * (f + 1)];
                    column.chunks_exact_mut(2).zip(&whitened).for_each(|(at, v)| (at[0], at[1]) = (v.re, v.im));
                }
            }
            take(bins, rows)
        })
    }

    /// The expected estimate and its derivatives, of the shape of the estimate.
    fn evaluate(&self, theta: &[f64], derivatives: bool) -> (Vec<Complex64>, Vec<Complex64>) {
        let (value, slopes) = self.prediction.evaluate(theta, derivatives);
        match self.gains {
            Some(gains) => gains.drive(theta, &value, &slopes),
            None => (value, slopes),
        }
    }

    /// Jᵀ Ω J where Ω is the covariance that the residuals have by the estimate's full covariance.
    pub fn known_meat(&self, jacobian: &Mat<f64>) -> Mat<f64> {
        let ([p, q], k) = (self.shape, self.parameters);
        let size = self.size();
        summed_scores(self.bins.len(), k, |f, meat| {
            let bin = &self.bins[f];
            let side = |whitener: &[Complex64], covariance: &[Complex64], n: usize| {
                square::product(&square::product(whitener, covariance, n), &square::adjoint(whitener, n), n)
            };
            // E[e_ij e_kl*] of the whitened residual, 1 on the diagonal.
            let noise = side(&bin.left, &bin.noise, p);
            let input = side(&square::adjoint(&bin.right, q), &bin.input, q);
            let at = |e: usize, c: usize| Complex64::new(jacobian[(2 * (f * size + e), c)], -jacobian[(2 * (f * size + e) + 1, c)]);
            let scores: Vec<Vec<Complex64>> = (0..k).map(|c| (0..size).map(|e| at(e, c)).collect()).collect();
            add_scores(meat, &scores, [&noise, &input], [p, q], 1.0);
        })
    }

    /// Jᵀ Ω̂ J from the residuals themselves, products of neighbouring bins included with Bartlett's weights (Newey & West
    /// 1987). Each bin's residual is first divided by the root of I − H, H its leverage, because a fit makes the
    /// residuals of influential bins small (Bell & McCaffrey 2002).
    pub fn neighbour_meat(&self, solved: &Solved) -> Mat<f64> {
        let (jacobian, residuals) = (&solved.jacobian, &solved.minimum.residuals);
        let (size, k) = (2 * self.size(), self.parameters);
        let inverse = solved.inverse();
        let scores: Vec<Vec<f64>> = (0..self.bins.len())
            .map(|f| {
                let block = jacobian.subrows(f * size, size);
                let opened = open_leverage(&(block * &inverse * block.transpose()), &residuals[f * size..(f + 1) * size]);
                (0..k).map(|c| (0..size).map(|row| block[(row, c)] * opened[row]).sum()).collect()
            })
            .collect();
        let share = self.bins.iter().map(|b| b.share).fold(f64::INFINITY, f64::min).max(1e-3);
        let reach = if share < 1.0 { (2.0 / share).ceil() as usize } else { 0 };
        let mut meat = Mat::zeros(k, k);
        for (f, score) in scores.iter().enumerate() {
            for (lag, other) in scores[f..].iter().take(reach + 1).enumerate() {
                let weight = (1.0 - lag as f64 / (reach + 1) as f64) * if lag == 0 { 0.5 } else { 1.0 };
                for r in 0..k {
                    for c in 0..k {
                        meat[(r, c)] += weight * (score[r] * other[c] + other[r] * score[c]);
                    }
                }
            }
        }
        meat
    }
}

/// (I − H)^(−½) r for the leverage H of one bin; r itself where that does not exist.
fn open_leverage(leverage: &Mat<f64>, residual: &[f64]) -> Vec<f64> {
    let n = residual.len();
    let Ok(eigen) = leverage.self_adjoint_eigen(faer::Side::Lower) else { return residual.to_vec() };
    let mut out = vec![0.0; n];
    for e in 0..n {
        // A bin that alone determines a parameter has h = 1 and no residual left to enlarge.
        let part = (0..n).map(|i| eigen.U()[(i, e)] * residual[i]).sum::<f64>() / (1.0 - eigen.S()[e]).max(1e-6).sqrt();
        out.iter_mut().enumerate().for_each(|(i, o)| *o += eigen.U()[(i, e)] * part);
    }
    out
}
