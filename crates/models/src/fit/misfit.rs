//! Fits of a model that is wrong: the size of its own error, told from what it leaves, in the weights and in the intervals (stochastic embedding).

use super::result::t_quantile;
use super::whitened::Whitened;
use super::{Fit, FitError, Parameter, Solved, WeightedFit, search};
use crate::ParametricModel;
use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, MatRef, Par};
use ndarray::Array2;
use ndof_linear::Cholesky;
use ndof_sysid::FrequencyResponse;
use num_complex::Complex64;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use statrs::distribution::{ChiSquared, ContinuousCDF};

/// Where the width of the intervals comes from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Width {
    /// From the covariance of the estimate.
    #[default]
    Covariance,
    /// From the residuals.
    Residuals,
    /// From the disagreement of the trials.
    Trials,
    /// From one of these and, added to it, what the model's own error does.
    Misfit,
}

/// Share of right models whose χ² is taken for a misfit.
const FALSE_ALARM: f64 = 1e-3;

impl Fit {
    /// Whether χ² is larger than its law allows one right model in a thousand.
    pub fn misfits(&self) -> bool {
        ChiSquared::new(self.degrees_of_freedom).is_ok_and(|law| law.sf(self.chi2) < FALSE_ALARM)
    }
}

/// A step by which half of χ² falls by less is the last of a fit with other weights: it moves no parameter by more than √(2/1000) of its standard error.
const SETTLED: f64 = 1e-3;
/// Sizes and reaches that are weighed differ by this factor.
const STEP: f64 = std::f64::consts::SQRT_2;
/// Size, in standard deviations of the noise, below which a model error moves nothing.
const UNSEEN: f64 = 0.1;
/// Sizes among which the likeliest is sought first are that many steps apart, a factor of four.
const APART: usize = 4;
/// Logarithm of the odds against a size that no sum of numbers of 53 bits would show: e⁻⁴⁰ is a fortieth of the last of them.
const UNLIKELY: f64 = 40.0;
/// Keeps what the data leave undetermined from spoiling a factor.
const RIDGE: f64 = 1e-12;

impl WeightedFit {
    /// `fit`, a minimum of [`fit_trials`](Self::fit_trials) with `response`, weighed anew and with wider intervals where χ² is larger than its law allows.
    ///
    /// The system is taken for H (1 + δ), δ a complex random process of size a that is alike at near frequencies: at two of them its correlation is
    /// exp(−|ln f − ln f'| / ℓ) (Ornstein–Uhlenbeck), for each element by itself. Both a and ℓ are told from what the fit leaves, by the likelihood of
    /// what no parameter takes up (restricted likelihood), and a² and Σ_δ are means over all a and ℓ by that likelihood. ℓ reaches from one independent
    /// frequency to the whole band, a to 1: an error as large as the model.
    ///
    /// A line of noise σ² then errs by σ² + a² |H|², and is weighed by that: with hardly any noise the least noisy lines would decide alone, and a wrong
    /// model would be fitted to a corner of the band. The covariance of θ is A Jᵀ(W + W Σ_δ W) J A, A = (JᵀWJ)⁻¹ with J and Σ_δ over the noise, W the
    /// weights σ²/(σ² + a² |H|²).
    ///
    /// # Errors
    /// As [`WeightedFit::fit`].
    ///
    /// # References
    /// G. C. Goodwin, M. Gevers & B. Ninness (1992), Quantifying the error in estimated transfer functions with application to model order selection,
    /// IEEE Transactions on Automatic Control 37.
    pub fn allowing_for_misfit(&self, model: &dyn ParametricModel, response: &FrequencyResponse, mut fit: Fit) -> Result<Fit, FitError> {
        if !fit.misfits() {
            return Ok(fit);
        }
        let mut problem = self.problem(model, response, &fit.theta)?;
        let solved = Solved::new(&problem, model, &fit.theta, self.cost_tolerance)?;
        let scale = fit.covariance_scale.max(1.0);
        let lines = Lines::new(&problem, &solved);
        let errors = lines.errors(scale);
        // What trials and averages know of the noise beyond the plain covariance.
        let plain = solved.inverse();
        let noise = mean_ratio(&fit.covariance, |k| plain[(k, k)]);
        let before = solved.minimum.residuals;
        let weights = lines.weights(errors.iter().map(|[_, square]| square).sum::<f64>() / scale);
        problem.weigh(&weights);
        // By steps that stay near: what is learned from longer ones leads such a search away from where the weights were told.
        let near = search(model, self.cost_tolerance.max(2.0 * SETTLED / fit.degrees_of_freedom));
        let solved = Solved::by(near, &problem, model, &fit.theta)?;
        let rows = solved.jacobian.nrows() / weights.len();
        let weighed = Mat::from_fn(solved.jacobian.nrows(), solved.jacobian.ncols(), |r, c| solved.jacobian[(r, c)] * weights[r / rows].sqrt());
        let meat = weighed.transpose() * &weighed * noise + Lines::new(&problem, &solved).weighed(&errors);
        let covariance = solved.covariance(Some(&meat), 1.0);
        fit.covariance_scale *= mean_ratio(&covariance, |k| fit.covariance[[k, k]]);
        let unweighed = |(k, r): (usize, &f64)| r * r / weights[k / rows];
        let grown = solved.minimum.residuals.iter().enumerate().map(unweighed).sum::<f64>() / before.iter().map(|r| r * r).sum::<f64>();
        (fit.chi2, fit.chi2_reduced) = (fit.chi2 * grown, fit.chi2_reduced * grown);
        (fit.theta, fit.covariance, fit.width) = (solved.theta, covariance, Width::Misfit);
        // Of two sources with freedoms of their own, that of the smaller one is the careful choice.
        fit.interval_quantile = fit.interval_quantile.max(t_quantile(fit.degrees_of_freedom));
        fit.parameters = Parameter::describe(&model.parameters(), &fit.theta, &fit.covariance, |_| fit.interval_quantile, &model.scales(&fit.theta));
        Ok(fit)
    }
}

/// Mean of variances over others, of the parameters that have both.
fn mean_ratio(covariance: &Array2<f64>, other: impl Fn(usize) -> f64) -> f64 {
    let variances = covariance.diag();
    let ratios = variances.iter().enumerate().map(|(k, v)| v / other(k)).filter(|ratio| ratio.is_finite() && *ratio > 0.0);
    let (sum, count) = ratios.fold((0.0, 0.0), |(sum, count), ratio| (sum + ratio, count + 1.0));
    if count > 0.0 { sum / count } else { 1.0 }
}

/// A fit's whitened lines, each turned by the phase of its model, so that a relative error is real in one part and imaginary in the other.
struct Lines {
    /// Natural logarithm of the frequency, and the share of an independent line.
    at: Vec<f64>,
    share: Vec<f64>,
    /// Of each element and part.
    parts: Vec<Part>,
    parameters: usize,
}

struct Part {
    /// At each line the derivatives and, last, what is left.
    rows: Vec<f64>,
    /// The model's size at each line.
    size: Vec<f64>,
}

impl Lines {
    fn new(problem: &Whitened<'_>, solved: &Solved) -> Self {
        let (model, [p, q], k) = (problem.whitened_model(&solved.theta), problem.shape, problem.parameters);
        let (residuals, jacobian) = (&solved.minimum.residuals, &solved.jacobian);
        let size = p * q;
        let norm = |line: &[Complex64], of: &dyn Fn(usize) -> bool| (0..size).filter(|&e| of(e)).map(|e| line[e].norm_sqr()).sum::<f64>().sqrt();
        let mut parts = Vec::with_capacity(2 * size);
        for e in 0..size {
            // An element that couples two axes errs by the size of what it couples.
            let scale: Vec<f64> = model.iter().map(|line| (norm(line, &|o| o / q == e / q) * norm(line, &|o| o % q == e % q)).sqrt()).collect();
            let [mut real, mut imaginary] = [(); 2].map(|()| Vec::with_capacity(model.len() * (k + 1)));
            for (f, line) in model.iter().enumerate() {
                let (row, length) = (2 * (f * size + e), line[e].norm());
                let phase = if length > 0.0 { line[e].conj() / length } else { Complex64::from(1.0) };
                for c in 0..=k {
                    let at = |row: usize| if c < k { jacobian[(row, c)] } else { residuals[row] };
                    let turned = Complex64::new(at(row), at(row + 1)) * phase;
                    real.push(turned.re);
                    imaginary.push(turned.im);
                }
            }
            parts.extend([real, imaginary].map(|rows| Part { rows, size: scale.clone() }));
        }
        let (at, share) = (problem.bins.iter().map(|bin| bin.hz.ln()).collect(), problem.bins.iter().map(|bin| bin.share).collect());
        Lines { at, share, parts, parameters: k }
    }

    /// Reaches with the mean square of the model's error of each, by their likelihood beside noise of that variance.
    fn errors(&self, noise: f64) -> Vec<[f64; 2]> {
        let band = self.at.last().zip(self.at.first()).map_or(0.0, |(last, first)| last - first);
        let independent: f64 = self.share.iter().sum();
        let largest = self.parts.iter().flat_map(|part| &part.size).zip(self.share.iter().cycle()).map(|(s, share)| s / share.sqrt()).fold(0.0, f64::max);
        let steps = |from: f64, to: f64| (0..).map(move |k| from * STEP.powi(-k)).take_while(move |v| *v > to).collect::<Vec<_>>();
        let (reaches, sizes) = (steps(band, band / independent.max(2.0)), steps(1.0, UNSEEN * noise.sqrt() / largest));
        let thinned = self.thinned();
        let of_reach = |reach: &f64| likely(sizes.len(), |k| thinned.likelihood(sizes[k], *reach, noise));
        let likelihoods: Vec<Vec<f64>> = reaches.par_iter().map(of_reach).collect();
        let most = likelihoods.iter().flatten().copied().fold(f64::NEG_INFINITY, f64::max);
        let share = |likelihood: &f64| (likelihood - most).exp();
        let total: f64 = likelihoods.iter().flatten().map(share).sum();
        let squares = |row: &Vec<f64>| row.iter().zip(&sizes).map(|(likelihood, size)| size * size * share(likelihood) / total).sum();
        reaches.iter().zip(&likelihoods).map(|(reach, row)| [*reach, squares(row)]).collect()
    }

    /// σ²/(σ² + a² |H|²) at each line, of a mean square a² in units of the noise, |H|² the mean over the elements.
    fn weights(&self, square: f64) -> Vec<f64> {
        let mean = |f: usize| self.parts.iter().map(|part| part.size[f].powi(2)).sum::<f64>() / self.parts.len() as f64;
        self.share.iter().enumerate().map(|(f, share)| 1.0 / (1.0 + square * mean(f) / share)).collect()
    }

    /// Independent lines only, each of unit noise.
    fn thinned(&self) -> Lines {
        let (mut kept, mut sum) = (Vec::new(), 1.0);
        for (f, share) in self.share.iter().enumerate() {
            if sum >= 1.0 - 1e-9 {
                kept.push(f);
                sum = 0.0;
            }
            sum += share;
        }
        let width = self.parameters + 1;
        let part = |part: &Part| Part {
            rows: kept.iter().flat_map(|&f| part.rows[f * width..(f + 1) * width].iter().map(move |v| v / self.share[f].sqrt())).collect(),
            size: kept.iter().map(|&f| part.size[f] / self.share[f].sqrt()).collect(),
        };
        Lines {
            at: kept.iter().map(|&f| self.at[f]).collect(),
            share: vec![1.0; kept.len()],
            parts: self.parts.iter().map(part).collect(),
            parameters: self.parameters,
        }
    }

    /// How much of the process at one line is left at the next, 0 before the first.
    fn fades(&self, reach: f64) -> Vec<f64> {
        std::iter::once(0.0).chain(self.at.windows(2).map(|at| (-(at[1] - at[0]) / reach).exp())).collect()
    }

    /// The restricted log-likelihood of what is left, but for a constant.
    fn likelihood(&self, size: f64, reach: f64, noise: f64) -> f64 {
        let (width, fades) = (self.parameters + 1, self.fades(reach));
        // Innovations of the derivatives and, last, of what is left, each over its spread: row by row what a regression would see.
        let mut innovations = vec![0.0; self.at.len() * width];
        let mut products = Mat::zeros(width, width);
        let (mut log_det, mut determinant) = (0.0, 1.0);
        for part in &self.parts {
            // Kalman filter of δ/a: its variance is the same for all columns.
            let (mut variance, mut means) = (1.0, vec![0.0; width]);
            for (f, (row, out)) in part.rows.chunks_exact(width).zip(innovations.chunks_exact_mut(width)).enumerate() {
                variance = 1.0 - fades[f] * fades[f] * (1.0 - variance);
                let gain = size * part.size[f];
                let spread = noise + gain * gain * variance;
                let (taken, scale) = (variance * gain / spread, 1.0 / spread.sqrt());
                for ((mean, value), out) in means.iter_mut().zip(row).zip(out) {
                    let faded = *mean * fades[f];
                    let innovation = value - gain * faded;
                    *mean = faded + taken * innovation;
                    *out = innovation * scale;
                }
                variance *= noise / spread;
                determinant *= spread;
                // A logarithm of many at once, as long as their product is a number.
                if !(1e-100..1e100).contains(&determinant) {
                    log_det += determinant.ln();
                    determinant = 1.0;
                }
            }
            let rows = MatRef::from_row_major_slice(&innovations, self.at.len(), width);
            matmul(&mut products, Accum::Add, rows.transpose(), rows, 1.0, Par::Seq);
        }
        restricted(log_det + determinant.ln(), &products)
    }

    /// Σ weight · Jᵀ P J over reaches with their weights, P the correlation of each reach.
    fn weighed(&self, weights: &[[f64; 2]]) -> Mat<f64> {
        let (k, lines) = (self.parameters, self.at.len());
        let fading: Vec<(f64, Vec<f64>)> = weights.iter().filter(|[_, weight]| *weight > 0.0).map(|[reach, weight]| (*weight, self.fades(*reach))).collect();
        let of_part = |part: &Part| {
            let here: Vec<f64> = part.rows.chunks_exact(k + 1).zip(&part.size).flat_map(|(row, size)| row[..k].iter().map(move |slope| slope * size)).collect();
            let mut before = vec![0.0; here.len()];
            for (weight, fades) in &fading {
                // Half of the line itself, and the sum over earlier ones, faded to it.
                let mut sums = vec![0.0; k];
                for ((here, before), fade) in here.chunks_exact(k).zip(before.chunks_exact_mut(k)).zip(fades) {
                    for ((sum, here), before) in sums.iter_mut().zip(here).zip(before) {
                        *sum *= fade;
                        *before += weight * (*sum + 0.5 * here);
                        *sum += here;
                    }
                }
            }
            let [here, before] = [&here, &before].map(|rows| MatRef::from_row_major_slice(rows, lines, k));
            here.transpose() * before
        };
        let halves: Vec<Mat<f64>> = self.parts.par_iter().map(of_part).collect();
        let half = halves.iter().fold(Mat::zeros(k, k), |sum: Mat<f64>, part| sum + part);
        &half + half.transpose()
    }
}

/// The likelihoods of `count` sizes in their order, −∞ for what is no number or too unlikely to be looked at: of one size it has one peak, which is
/// sought among every [`APART`]th and walked down on both sides.
fn likely(count: usize, of: impl Fn(usize) -> f64) -> Vec<f64> {
    let mut all = vec![None; count];
    let mut at = |k: usize| *all[k].get_or_insert_with(|| Some(of(k)).filter(|l| l.is_finite()).unwrap_or(f64::NEG_INFINITY));
    let top = (0..count).step_by(APART).fold(0, |top, k| if at(k) > at(top) { k } else { top });
    let mut most = if count > 0 { at(top) } else { f64::NEG_INFINITY };
    let walks: [Box<dyn Iterator<Item = usize>>; 2] = [Box::new(top + 1..count), Box::new((0..top).rev())];
    for walk in walks {
        for k in walk {
            most = most.max(at(k));
            if at(k) < most - UNLIKELY {
                break;
            }
        }
    }
    all.into_iter().map(|likelihood| likelihood.unwrap_or(f64::NEG_INFINITY)).collect()
}

/// −½ (ln|Γ| + ln|Jᵀ Γ⁻¹ J| + what is left when the score is taken up) from [J r]ᵀ Γ⁻¹ [J r], parameters without a derivative left out.
fn restricted(log_det: f64, information: &Mat<f64>) -> f64 {
    let last = information.nrows() - 1;
    let sound: Vec<usize> = (0..last).filter(|&k| information[(k, k)] > 0.0).collect();
    let scale: Vec<f64> = sound.iter().map(|&k| information[(k, k)].sqrt()).collect();
    let mut factor = Cholesky::new(sound.len());
    if !factor.factor(|i, j| information[(sound[i], sound[j])] / (scale[i] * scale[j]) + if i == j { RIDGE } else { 0.0 }) {
        return f64::NEG_INFINITY;
    }
    let scaled: Vec<f64> = sound.iter().zip(&scale).map(|(&k, s)| information[(k, last)] / s).collect();
    let mut solved = scaled.clone();
    factor.solve(&mut solved);
    let taken: f64 = solved.iter().zip(&scaled).map(|(a, b)| a * b).sum();
    let of_information: f64 = (0..sound.len()).map(|k| 2.0 * (factor.lower()[k * sound.len() + k] * scale[k]).ln()).sum();
    -0.5 * (log_det + of_information + information[(last, last)] - taken)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shared_tests::{add_noise, fitted_limb, limb};

    #[test]
    fn chance_is_no_misfit() {
        let (model, response, fit) = fitted_limb();
        let of = |chi2: f64| Fit { chi2, degrees_of_freedom: 100.0, chi2_reduced: chi2 / 100.0, ..fit.clone() };
        // The 99.9 % quantile of χ² with 100 degrees of freedom is 149.449.
        assert!(!of(149.4).misfits() && of(149.5).misfits());
        assert_eq!(WeightedFit::default().allowing_for_misfit(&model, &response, of(149.0)), Ok(of(149.0)));
    }

    /// A late motion, which no inertia, damping or stiffness is, seen with hardly any noise above 5 Hz: lines that are known to a millionth do not
    /// decide over the stiffness, which shows below.
    #[test]
    fn the_least_noisy_lines_do_not_decide_alone() {
        let (model, limb) = limb();
        let hz: Vec<f64> = (1..=200).map(|k| 0.06 * k as f64).collect();
        let mut response = limb.response(&hz, ndof_sysid::ResponseKind::Compliance);
        add_noise(&mut response, 20.0, |hz| if hz > 5.0 { 1e-6 } else { 1e-3 });
        let late_s = 0.0025;
        hz.iter().enumerate().for_each(|(f, hz)| response.value[[f, 0, 0]] *= Complex64::from_polar(1.0, -std::f64::consts::TAU * hz * late_s));
        let settings = WeightedFit { band_hz: [0.05, 12.5], ..WeightedFit::default() };
        let alone = settings.fit(&model, &response, &model.theta(&limb)).expect("a fit");
        let fit = settings.allowing_for_misfit(&model, &response, alone.clone()).expect("a fit");
        assert!((alone.theta[2] / 300.0 - 1.0).abs() > 0.05, "{:?}", alone.theta);
        assert!((fit.theta[2] / 300.0 - 1.0).abs() < 0.02, "{:?}", fit.theta);
        // To first order a delay is a damping of -K τ.
        let held = |k: usize, truth: f64| (fit.theta[k] - truth).abs() < fit.interval_quantile * fit.covariance[[k, k]].sqrt();
        assert!(held(2, 300.0) && held(0, 2.0) && fit.width == Width::Misfit && fit.chi2 > alone.chi2, "{fit:?}");
    }

    #[test]
    fn no_likely_size_is_left_out_and_few_others_are_looked_at() {
        for (count, peak, width) in [(27, 11.3, 0.7), (27, 0.0, 0.2), (27, 26.0, 2.0), (3, 1.0, 1.0), (1, 0.0, 1.0), (0, 0.0, 1.0)] {
            let law = |k: usize| -((k as f64 - peak) / width).powi(2);
            let looked = std::cell::Cell::new(0);
            let found = likely(count, |k| {
                looked.set(looked.get() + 1);
                law(k)
            });
            assert!(found.len() == count && (0..count).all(|k| found[k] == law(k) || law(k) < -UNLIKELY), "{found:?}");
            assert!(looked.get() <= count.div_ceil(APART) + 2 + (2.0 * width * UNLIKELY.sqrt()) as usize + 2, "{}", looked.get());
        }
        assert_eq!(likely(2, |_| f64::NAN), [f64::NEG_INFINITY; 2]);
    }

    /// The filter and the recursion against the matrices that they stand for.
    #[test]
    fn a_likelihood_and_a_covariance_are_those_of_the_matrices() {
        let count = 7;
        let column = |a: f64, b: f64| (0..count).map(|f| (a * f as f64 + b).sin()).collect::<Vec<f64>>();
        // Two derivatives and what is left.
        let columns = |k: f64| [column(0.4, 1.0 + k), column(1.1, k), column(2.3, k)];
        let part = |k: f64| Part { rows: (0..3 * count).map(|e| columns(k)[e % 3][e / 3]).collect(), size: column(0.1, 1.0).iter().map(|s| 2.0 + s).collect() };
        let at: Vec<f64> = (0..count).map(|f| (1.0 + 0.3 * f as f64 * f as f64).ln()).collect();
        let lines = Lines { at, share: vec![1.0; count], parts: vec![part(0.2), part(0.7)], parameters: 2 };
        let (size, reach, noise) = (0.4, 0.8, 1.3);
        let correlation = |f: usize, g: usize| (-(lines.at[f] - lines.at[g]).abs() / reach).exp();
        let (mut log_det, mut information, mut meat) = (0.0, Mat::zeros(3, 3), Mat::<f64>::zeros(2, 2));
        for part in &lines.parts {
            let error = |f: usize, g: usize| size * size * part.size[f] * part.size[g] * correlation(f, g);
            let mut factor = Cholesky::new(count);
            assert!(factor.factor(|f, g| error(f, g) + if f == g { noise } else { 0.0 }));
            let solved = |column: &[f64]| {
                let mut out = column.to_vec();
                factor.solve(&mut out);
                out
            };
            let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
            log_det += (0..count).map(|f| 2.0 * factor.lower()[f * count + f].ln()).sum::<f64>();
            let columns: Vec<Vec<f64>> = (0..3).map(|c| part.rows.iter().skip(c).step_by(3).copied().collect()).collect();
            for (e, value) in (0..9).map(|e| (e, dot(&columns[e / 3], &solved(&columns[e % 3])))) {
                information[(e / 3, e % 3)] += value;
            }
            for (r, c) in (0..4).map(|e| (e / 2, e % 2)) {
                meat[(r, c)] += (0..count * count).map(|e| columns[r][e / count] * error(e / count, e % count) * columns[c][e % count]).sum::<f64>();
            }
        }
        let expected = restricted(log_det, &information);
        assert!((lines.likelihood(size, reach, noise) - expected).abs() < 1e-10 * expected.abs());
        let found = lines.weighed(&[[reach, size * size]]);
        assert!((0..4).all(|e| (found[(e / 2, e % 2)] - meat[(e / 2, e % 2)]).abs() < 1e-12 * meat[(0, 0)].abs()));
    }
}
