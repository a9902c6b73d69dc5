//! Weighted least squares on a frequency response, with the covariance that its estimator gave it.

use super::{COST_TOLERANCE, Fit, FitError, Prediction, Smoothing, Solved, Transducer, Width, add_scores, check_shape, shares, summed_scores};
use crate::levenberg_marquardt::{root, triangle};
use crate::{Gains, LeastSquares, ParametricModel};
use faer::Mat;
use ndarray::Array3;
use ndof_linear::{Cholesky, square};
use ndof_signal::Kernel;
use ndof_sysid::{FrequencyResponse, ResponseKind, Uncertainty};
use num_complex::Complex64;
use serde::{Deserialize, Serialize};
use std::ops::Range;

/// Settings of the weighted fit.
///
/// Minimises Σ_f s_f ‖√2 Lᴴ (Ĥ(f) − H(f, θ)) G‖² over the band, where (L Lᴴ)⁻¹ is the covariance of the estimate on its
/// output side and (G Gᴴ)⁻¹ on its input side, H is the model seen through the estimate's window, and
/// s_f = bin spacing / independent spacing counts neighbouring bins once. Of a finer grid, four bins an independent one are used: what lies
/// between says nothing more, while thinning to independent bins would lose some.
///
/// The estimated covariance makes χ² larger by ν/(ν − p) and the scatter of θ by ν²/((ν − p)² − 1) (moments of the
/// inverse complex Wishart distribution); both are taken into account. With fewer than p + 4 degrees of freedom only the
/// variances are used, and the covariance of θ allows for what that ignores.
///
/// ```
/// use ndof_models::{Axis, InertiaDampingStiffnessModel, Symmetry, WeightedFit};
/// let settings = WeightedFit { band_hz: [0.5, 8.0], ..WeightedFit::default() };
/// let model = InertiaDampingStiffnessModel::new(vec![Axis::linear("x")], Symmetry::Symmetric);
/// # let _ = (settings, model);
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct WeightedFit {
    /// Lowest and highest frequency; 0 Hz is never used.
    pub band_hz: [f64; 2],
    /// How the estimate's window enters.
    pub smoothing: Smoothing,
    /// A known series compliance that the estimate contains and the model does not.
    pub transducer: Option<Transducer>,
    /// How the covariance of the parameters is found.
    pub covariance: CovarianceKind,
    /// The relative decrease of χ² at which the search ends.
    pub cost_tolerance: f64,
}

/// How the covariance of the parameters is found.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum CovarianceKind {
    /// From the covariance of the estimate: right if the model is.
    #[default]
    Model,
    /// From the residuals (sandwich): right also where the weights are not.
    Sandwich,
}

impl Default for WeightedFit {
    fn default() -> Self {
        WeightedFit {
            band_hz: [0.5, 8.0],
            smoothing: Smoothing::default(),
            transducer: None,
            covariance: CovarianceKind::default(),
            cost_tolerance: COST_TOLERANCE,
        }
    }
}

/// Bins an independent one that are used at most.
const DENSE: f64 = 4.0;
/// Degrees of freedom beyond the outputs that a full covariance needs to be worth its noise.
const FULL_COVARIANCE_MARGIN: f64 = 4.0;

impl WeightedFit {
    /// Fits `model` to `response` from `start`.
    ///
    /// The response is compared as the kind that it is; do not invert an estimate before.
    ///
    /// # Errors
    /// [`FitError`] if shape, kind, covariance or band do not serve.
    pub fn fit(&self, model: &dyn ParametricModel, response: &FrequencyResponse, start: &[f64]) -> Result<Fit, FitError> {
        let problem = self.problem(model, response, start)?;
        let [n, inputs] = problem.shape;
        let solved = Solved::new(&problem, model, start, self.cost_tolerance)?;

        let Known { degrees, full, independent } = problem.known;
        let rows = if full { n as f64 } else { 1.0 };
        let inflation = if degrees > rows + 1.0 { degrees * degrees / ((degrees - rows).powi(2) - 1.0) } else { f64::INFINITY };
        let covariance = match self.covariance {
            CovarianceKind::Sandwich => solved.covariance(Some(&problem.neighbour_meat(&solved)), 1.0),
            CovarianceKind::Model if full => solved.covariance(None, inflation),
            CovarianceKind::Model => solved.covariance(Some(&problem.known_meat(&solved.jacobian)), inflation),
        };
        // With as few averages as rows the noise is known from nothing else than what the model is judged by.
        let chi2 = if degrees > rows { 2.0 * solved.minimum.cost * (degrees - rows) / degrees } else { f64::NAN };
        let degrees_of_freedom = 2.0 * independent * (n * inputs) as f64 - problem.parameters as f64;
        let width = if self.covariance == CovarianceKind::Sandwich { Width::Residuals } else { Width::Covariance };
        Ok(Fit { width, ..solved.into_fit(model, covariance, &problem.frequency_hz(), chi2, degrees_of_freedom) })
    }

    /// What is to be minimised.
    pub(super) fn problem<'a>(&'a self, model: &'a dyn ParametricModel, response: &'a FrequencyResponse, start: &[f64]) -> Result<Whitened<'a>, FitError> {
        let shape = check_shape(model, response, start)?;
        let [n, inputs] = shape;
        let parameters = model.parameters().len();
        let uncertainty = response.uncertainty.as_ref().ok_or(FitError::NoCovariance)?;
        let degrees = uncertainty.degrees_of_freedom;
        let full = degrees >= n as f64 + FULL_COVARIANCE_MARGIN;
        let bins = self.bins(response, uncertainty, full);
        let independent: f64 = bins.iter().map(|b| b.share).sum();
        if bins.is_empty() || 2.0 * independent * (n * inputs) as f64 <= parameters as f64 {
            let needed = parameters / (2 * n * inputs) + 1;
            return Err(FitError::TooFewBins { bins: bins.len(), independent, needed, low_hz: self.band_hz[0], high_hz: self.band_hz[1] });
        }
        let frequency_hz: Vec<f64> = bins.iter().map(|b| b.hz).collect();
        let prediction = Prediction::new(model, response.kind, &frequency_hz, &uncertainty.kernel, &self.smoothing, self.transducer);
        Ok(Whitened { prediction, bins, gains: model.gains(), shape, parameters, known: Known { degrees, full, independent } })
    }

    /// The model as an estimate of this kind would show it on average: through the window's `kernel`, in the loop that
    /// `smoothing` describes, with the transducer's give; `H[f][row][column]`, NaN where the model does not exist.
    ///
    /// ```
    /// use ndof_models::{Axis, InertiaDampingStiffnessModel, Smoothing, Symmetry, WeightedFit};
    /// use ndof_signal::Kernel;
    /// use ndof_sysid::ResponseKind;
    ///
    /// let model = InertiaDampingStiffnessModel::new(vec![Axis::linear("x")], Symmetry::Symmetric);
    /// let settings = WeightedFit { smoothing: Smoothing::None, ..WeightedFit::default() };
    /// let seen = settings.seen(&model, &[2.0, 11.0, 300.0], ResponseKind::Compliance, &[0.0], &Kernel::default());
    /// assert!((seen[[0, 0, 0]].re - 1.0 / 300.0).abs() < 1e-15);
    /// ```
    pub fn seen(&self, model: &dyn ParametricModel, theta: &[f64], kind: ResponseKind, frequency_hz: &[f64], kernel: &Kernel) -> Array3<Complex64> {
        let n = model.axes().len();
        let (values, _) = Prediction::new(model, kind, frequency_hz, kernel, &self.smoothing, self.transducer).evaluate(theta, false);
        Array3::from_shape_fn((frequency_hz.len(), n, n), |(f, i, j)| values[(f * n + i) * n + j])
    }

    /// The usable bins of the band with what whitens them.
    fn bins(&self, response: &FrequencyResponse, uncertainty: &Uncertainty, full: bool) -> Vec<Bin> {
        let (p, q) = response.shape();
        let usable: Vec<usize> = (0..response.len())
            .filter(|&f| {
                let hz = response.frequency_hz[f];
                hz > 0.0 && (self.band_hz[0]..=self.band_hz[1]).contains(&hz) && response.value.index_axis(ndarray::Axis(0), f).iter().all(|v| v.is_finite())
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
                estimate: matrix(&response.value),
                right: square::adjoint(&right, q),
                left,
                noise,
                input,
            });
        }
        let hz: Vec<f64> = bins.iter().map(|b| b.hz).collect();
        bins.iter_mut().zip(shares(&hz, uncertainty.independent_spacing_hz)).for_each(|(b, share)| b.share = share);
        bins
    }
}

/// One frequency of an estimate with what whitens it: √(2 share) · left · δ · right has unit variance.
pub(super) struct Bin {
    pub hz: f64,
    pub share: f64,
    estimate: Vec<Complex64>,
    left: Vec<Complex64>,
    right: Vec<Complex64>,
    noise: Vec<Complex64>,
    input: Vec<Complex64>,
}

impl Bin {
    fn whiten(&self, delta: &[Complex64], [p, q]: [usize; 2]) -> Vec<Complex64> {
        let factor = (2.0 * self.share).sqrt();
        let left = square::rectangular_product(&self.left, delta, [p, q]);
        square::rectangular_product(&left, &self.right, [q, q]).iter().map(|v| v * factor).collect()
    }
}

pub(super) struct Whitened<'a> {
    prediction: Prediction<'a>,
    pub bins: Vec<Bin>,
    gains: Option<&'a Gains>,
    /// Rows and columns of the estimate.
    pub shape: [usize; 2],
    pub parameters: usize,
    known: Known,
}

/// How well the estimate's covariance is known.
#[derive(Clone, Copy)]
struct Known {
    degrees: f64,
    /// Whether as a matrix, not as variances only.
    full: bool,
    /// Independent frequencies.
    independent: f64,
}

impl LeastSquares for Whitened<'_> {
    /// Real and imaginary part of each element, bin after bin.
    fn residuals(&self, theta: &[f64]) -> Vec<f64> {
        let size = self.size();
        let (value, _) = self.evaluate(theta, false);
        let mut out = Vec::with_capacity(2 * value.len());
        for (bin, model) in self.bins.iter().zip(value.chunks_exact(size)) {
            let delta: Vec<Complex64> = bin.estimate.iter().zip(model).map(|(e, m)| e - m).collect();
            out.extend(bin.whiten(&delta, self.shape).iter().flat_map(|v| [v.re, v.im]));
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
    fn frequency_hz(&self) -> Vec<f64> {
        self.bins.iter().map(|bin| bin.hz).collect()
    }

    /// Gives each frequency another weight, beside that of its noise.
    pub fn weigh(&mut self, weights: &[f64]) {
        for (bin, weight) in self.bins.iter_mut().zip(weights) {
            bin.left.iter_mut().for_each(|v| *v *= weight.sqrt());
        }
    }

    /// What the model says of each frequency, whitened as the residuals are.
    pub fn whitened_model(&self, theta: &[f64]) -> Vec<Vec<Complex64>> {
        let (value, _) = self.evaluate(theta, false);
        self.bins.iter().zip(value.chunks_exact(self.size())).map(|(bin, model)| bin.whiten(model, self.shape)).collect()
    }

    /// Elements of one frequency.
    fn size(&self) -> usize {
        self.shape.iter().product()
    }

    /// What `take` makes of the rows of the Jacobian for a few bins at a time, in their order.
    fn rows<T: Send>(&self, theta: &[f64], take: impl Fn(Range<usize>, Mat<f64>) -> T + Sync) -> Vec<T> {
        let size = self.size();
        self.prediction.by_bins(theta, true, |bins, value, slopes| {
            let slopes = self.gains.map(|gains| gains.drive(theta, &value, &slopes).1).unwrap_or(slopes);
            let mut rows = Mat::zeros(2 * size * bins.len(), self.parameters);
            let [p, q] = self.shape;
            for (f, (bin, blocks)) in self.bins[bins.clone()].iter().zip(slopes.chunks_exact(size * self.parameters)).enumerate() {
                // The blocks stand below each other, so that one product takes the right side of all.
                let driven = square::rectangular_product(blocks, &bin.right, [q, q]);
                let left: Vec<Complex64> = bin.left.iter().map(|v| v * -(2.0 * bin.share).sqrt()).collect();
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
    fn known_meat(&self, jacobian: &Mat<f64>) -> Mat<f64> {
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
    fn neighbour_meat(&self, solved: &Solved) -> Mat<f64> {
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
