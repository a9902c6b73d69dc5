//! The paper's fit: gain in decibels and phase in degrees, weighted with partial coherence.

use super::vaf::{GAIN_WEIGHT, difference};
use super::{
    COST_TOLERANCE, Fit, FitError, Prediction, Smoothing, Solved, add_lower, add_scores, check_shape, found, jackknife::left_out, jackknife::rescale_by_trials,
    shares, summed_scores,
};
use crate::{LeastSquares, ParametricModel, Slopes};
use faer::Mat;
use ndarray::{Array3, Axis};
use ndof_signal::Kernel;
use ndof_sysid::{FrequencyResponse, ResponseKind};
use num_complex::Complex64;
use serde::{Deserialize, Serialize};

/// Settings of the paper's fit: minimises ψ_z of [`agreement`](crate::agreement), summed over all elements.
///
/// The cost is no likelihood, so the covariance is a sandwich (JᵀJ)⁻¹ Jᵀ Ω J (JᵀJ)⁻¹, Ω being what the covariance of the
/// estimate makes of gains and phases. Where the estimate has none, the squares of the residuals take its place.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PaperFit {
    /// Lowest and highest frequency; 0 Hz is never used.
    pub band_hz: [f64; 2],
}

impl Default for PaperFit {
    /// The band of the paper's tables, 0.25 to 10 Hz.
    fn default() -> Self {
        PaperFit { band_hz: [0.25, 10.0] }
    }
}

impl PaperFit {
    /// Fits `model` to `response` with `weight[f, i, j]` = γ.
    ///
    /// # Errors
    /// [`FitError`] if shape, kind or band do not serve.
    pub fn fit(&self, model: &dyn ParametricModel, response: &FrequencyResponse, weight: &Array3<f64>, start: &[f64]) -> Result<Fit, FitError> {
        let Prepared { problem, impedance, bins, frequency_hz } = self.prepared(model, response, weight, start)?;
        let n = impedance.shape().0;
        let solved = Solved::new(&problem, model, start, COST_TOLERANCE)?;
        let share = shares(&frequency_hz, impedance.uncertainty.as_ref().map_or(0.0, |u| u.independent_spacing_hz));
        let meat = problem.meat(&solved.jacobian, &solved.minimum.residuals, &impedance, &bins, &share);
        let covariance = solved.covariance(Some(&meat), 1.0);
        let degrees_of_freedom = 2.0 * share.iter().sum::<f64>() * (n * n) as f64 - problem.parameters as f64;
        let chi2 = 2.0 * solved.minimum.cost;
        Ok(solved.into_fit(model, covariance, &frequency_hz, chi2, degrees_of_freedom))
    }

    /// What is to be minimised.
    fn prepared<'a>(
        &self,
        model: &'a dyn ParametricModel,
        response: &FrequencyResponse,
        weight: &Array3<f64>,
        start: &[f64],
    ) -> Result<Prepared<'a>, FitError> {
        let [n, _] = check_shape(model, response, start)?;
        let in_band = response.within(self.band_hz);
        let impedance = response.select(&in_band).to_kind(ResponseKind::Impedance)?;
        let weight = weight.select(Axis(0), &in_band);
        let parameters = model.parameters().len();
        let bins: Vec<usize> = (0..impedance.len())
            .filter(|&f| {
                impedance.frequency_hz[f] > 0.0 && (0..n * n).all(|e| impedance.value[[f, e / n, e % n]].is_finite() && weight[[f, e / n, e % n]].is_finite())
            })
            .collect();
        if 2 * bins.len() * n * n <= parameters {
            let needed = parameters / (2 * n * n) + 1;
            return Err(FitError::TooFewBins { bins: bins.len(), independent: bins.len() as f64, needed, low_hz: self.band_hz[0], high_hz: self.band_hz[1] });
        }
        let frequency_hz: Vec<f64> = bins.iter().map(|&f| impedance.frequency_hz[f]).collect();
        let problem = Logarithmic {
            prediction: Prediction::new(model, ResponseKind::Impedance, &frequency_hz, &Kernel::default(), &Smoothing::None, None),
            estimate: bins.iter().flat_map(|&f| (0..n * n).map(move |e| (f, e))).map(|(f, e)| impedance.value[[f, e / n, e % n]]).collect(),
            weight: bins.iter().flat_map(|&f| (0..n * n).map(move |e| (f, e))).map(|(f, e)| weight[[f, e / n, e % n]]).collect(),
            parameters,
        };
        Ok(Prepared { problem, impedance, bins, frequency_hz })
    }

    /// The same with the width of the intervals from the disagreement of trials, as
    /// [`WeightedFit::fit_trials`](super::WeightedFit::fit_trials) finds it; weights are those of the pooled estimate.
    ///
    /// # Errors
    /// As [`PaperFit::fit`].
    pub fn fit_trials(
        &self,
        model: &dyn ParametricModel,
        response: &FrequencyResponse,
        without: &[FrequencyResponse],
        weight: &Array3<f64>,
        start: &[f64],
    ) -> Result<Fit, FitError> {
        let fit = self.fit(model, response, weight, start)?;
        let left = left_out(without, |r| found(&self.prepared(model, r, weight, &fit.theta)?.problem, model, &fit.theta, COST_TOLERANCE))?;
        Ok(rescale_by_trials(model, fit, &left))
    }
}

/// What is minimised, and the impedances that it came from: of the band, and which of their frequencies are used.
struct Prepared<'a> {
    problem: Logarithmic<'a>,
    impedance: FrequencyResponse,
    bins: Vec<usize>,
    frequency_hz: Vec<f64>,
}

/// Residuals 10 γ (g_e − g_m) and γ (φ_e − φ_m), element after element, bin after bin.
struct Logarithmic<'a> {
    prediction: Prediction<'a>,
    estimate: Vec<Complex64>,
    weight: Vec<f64>,
    parameters: usize,
}

/// dB and degrees of a relative change.
fn units() -> (f64, f64) {
    (GAIN_WEIGHT * 20.0 / std::f64::consts::LN_10, 1f64.to_degrees())
}

impl LeastSquares for Logarithmic<'_> {
    fn residuals(&self, theta: &[f64]) -> Vec<f64> {
        let (value, _) = self.prediction.evaluate(theta, false);
        let elements = self.estimate.iter().zip(&value).zip(&self.weight);
        elements
            .flat_map(|((e, m), w)| {
                let (gain, phase) = difference(*e, *m);
                [GAIN_WEIGHT * w * gain, w * phase]
            })
            .collect()
    }

    fn jacobian(&self, theta: &[f64]) -> Mat<f64> {
        let (value, slopes) = self.prediction.evaluate(theta, true);
        let (k, (gain, phase)) = (self.parameters, units());
        let size = self.prediction.elements();
        let mut out = Mat::zeros(2 * value.len(), k);
        for (e, (m, w)) in value.iter().zip(&self.weight).enumerate() {
            for c in 0..k {
                let relative = slopes[(e / size) * size * k + c * size + e % size] / m;
                out[(2 * e, c)] = -gain * w * relative.re;
                out[(2 * e + 1, c)] = -phase * w * relative.im;
            }
        }
        out
    }

    fn slopes(&self, theta: &[f64], residuals: &[f64]) -> Slopes {
        let k = self.parameters;
        let parts = self.prediction.by_bins(theta, true, |bins, value, slopes| self.sums(bins.start, &value, &slopes, residuals));
        let [mut information, mut curvature] = [(); 2].map(|()| Mat::zeros(k, k));
        let mut gradient = Mat::zeros(k, 1);
        for part in &parts {
            information += &part.information;
            curvature += &part.curvature;
            gradient += &part.gradient;
        }
        let symmetric = |lower: Mat<f64>| Mat::from_fn(k, k, |i, j| lower[(i.max(j), i.min(j))]);
        Slopes::Curved { information: symmetric(information), gradient, curvature: symmetric(curvature) }
    }
}

/// What the rows Re g and Im g of an element are multiplied with for JᵀJ and for Σ r ∂²r/∂θ²; the first of the latter is −Jᵀr too.
fn of_row(g: Complex64, [squared_gain, squared_phase, gain, phase]: &[f64; 4]) -> [f64; 4] {
    [squared_gain * g.re, squared_phase * g.im, gain * g.re + phase * g.im, phase * g.re - gain * g.im]
}

/// Lower triangles of JᵀJ and Σ r ∂²r/∂θ², and Jᵀr.
struct Sums {
    information: Mat<f64>,
    curvature: Mat<f64>,
    gradient: Mat<f64>,
}

impl Logarithmic<'_> {
    /// Sums over the bins from `first` on. For a Z that is linear in θ the second derivative of ln Z is −g gᵀ with g = Z⁻¹ ∂Z/∂θ, of which a row of
    /// the Jacobian is −γ a Re g and the next −γ b Im g. Residuals stay large where the estimate is poor, and Gauss-Newton's steps shrink by little
    /// from one to the next. Both are products of one matrix, of the rows Re g and Im g, with another.
    fn sums(&self, first: usize, value: &[Complex64], slopes: &[Complex64], residuals: &[f64]) -> Sums {
        let (gain, phase) = units();
        let first = first * self.prediction.elements();
        let weights: Vec<[f64; 4]> = (first..first + value.len())
            .map(|row| {
                let [a, b] = [gain * self.weight[row], phase * self.weight[row]];
                [a * a, b * b, a * residuals[2 * row], b * residuals[2 * row + 1]]
            })
            .collect();
        let inverses: Vec<Complex64> = value.iter().map(|v| v.inv()).collect();
        let dense = 2 * slopes.iter().filter(|slope| **slope != Complex64::ZERO).count() > slopes.len();
        if dense { self.dense_sums(&weights, &inverses, slopes) } else { self.sparse_sums(&weights, &inverses, slopes) }
    }

    fn dense_sums(&self, weights: &[[f64; 4]], inverses: &[Complex64], slopes: &[Complex64]) -> Sums {
        let (k, size) = (self.parameters, self.prediction.elements());
        let [mut relative, mut squared, mut bent] = [(); 3].map(|()| Mat::zeros(2 * weights.len(), k));
        let mut gradient = Mat::zeros(k, 1);
        for c in 0..k {
            let [of_relative, of_squared, of_bent] = [&mut relative, &mut squared, &mut bent].map(|rows| rows.col_as_slice_mut(c));
            for (e, (inverse, weights)) in inverses.iter().zip(weights).enumerate() {
                let g = slopes[(e / size * k + c) * size + e % size] * inverse;
                let [real, imaginary, bent, turned] = of_row(g, weights);
                [of_relative[2 * e], of_relative[2 * e + 1]] = [g.re, g.im];
                [of_squared[2 * e], of_squared[2 * e + 1]] = [real, imaginary];
                [of_bent[2 * e], of_bent[2 * e + 1]] = [bent, turned];
                gradient[(c, 0)] -= bent;
            }
        }
        let lower = |rows: &Mat<f64>| {
            let mut out = Mat::zeros(k, k);
            add_lower(&mut out, &relative, rows, 1.0);
            out
        };
        Sums { information: lower(&squared), curvature: lower(&bent), gradient }
    }

    /// The same where an element of Z has few parameters, as it has of a model that is linear in them: the others cost nothing.
    fn sparse_sums(&self, weights: &[[f64; 4]], inverses: &[Complex64], slopes: &[Complex64]) -> Sums {
        let (k, size) = (self.parameters, self.prediction.elements());
        let mut out = Sums { information: Mat::zeros(k, k), curvature: Mat::zeros(k, k), gradient: Mat::zeros(k, 1) };
        let mut own: Vec<(usize, Complex64)> = Vec::with_capacity(k);
        for (e, (inverse, weights)) in inverses.iter().zip(weights).enumerate() {
            let of_element = slopes[e / size * k * size..].iter().skip(e % size).step_by(size).take(k).enumerate();
            own.clear();
            own.extend(of_element.filter(|(_, slope)| **slope != Complex64::ZERO).map(|(c, slope)| (c, slope * inverse)));
            for (at, (c, g)) in own.iter().enumerate() {
                let [real, imaginary, bent, turned] = of_row(*g, weights);
                out.gradient[(*c, 0)] -= bent;
                for (r, g) in &own[at..] {
                    out.information[(*r, *c)] += real * g.re + imaginary * g.im;
                    out.curvature[(*r, *c)] += bent * g.re + turned * g.im;
                }
            }
        }
        out
    }

    /// Jᵀ Ω J, neighbouring bins counted by their share.
    fn meat(&self, jacobian: &Mat<f64>, residuals: &[f64], impedance: &FrequencyResponse, bins: &[usize], share: &[f64]) -> Mat<f64> {
        let (k, size) = (self.parameters, self.prediction.elements());
        let n = impedance.shape().0;
        let (gain, phase) = units();
        summed_scores(bins.len(), k, |b, meat| {
            let (f, rows) = (bins[b], 2 * size * b);
            match &impedance.uncertainty {
                // E[Re(a δ) Re(b δ)] = ½ Re(a Cov bᴴ) for circular δ.
                Some(u) => {
                    // The scores of this bin as complex factors of the relative errors: Re(Σ_e s_e δZ_e/Z_e).
                    let inverses: Vec<Complex64> = self.estimate[b * size..(b + 1) * size].iter().map(|z| z.inv()).collect();
                    let score = |c: usize| {
                        let of_bin = jacobian.col_as_slice(c)[rows..rows + 2 * size].chunks_exact(2).zip(&inverses).zip(&self.weight[b * size..]);
                        of_bin.map(|((j, inverse), w)| Complex64::new(j[0] * gain * w, -j[1] * phase * w) * inverse).collect()
                    };
                    let scores: Vec<Vec<Complex64>> = (0..k).map(score).collect();
                    let at = |a: &Array3<Complex64>| a.index_axis(Axis(0), f).iter().copied().collect::<Vec<_>>();
                    add_scores(meat, &scores, [&at(&u.noise), &at(&u.input_inverse)], [n, n], 0.5 / share[b]);
                }
                None => {
                    let weighed = Mat::from_fn(2 * size, k, |e, c| jacobian[(rows + e, c)] * residuals[rows + e].powi(2));
                    add_lower(meat, &jacobian.subrows(rows, 2 * size).to_owned(), &weighed, 1.0);
                }
            }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shared_tests::difference;
    use crate::{Axis, InertiaDampingStiffnessModel, Symmetry};

    /// Of a Z that is linear in θ the curvature is exact: JᵀJ + S is the slope of Jᵀr.
    #[test]
    fn the_curvature_is_the_slope_of_the_gradient() {
        let model = InertiaDampingStiffnessModel::new(vec![Axis::linear("x"), Axis::linear("y")], Symmetry::Symmetric);
        let theta = [2.1, -0.55, 1.9, 11.0, -2.0, 15.0, 300.0, -60.0, 520.0];
        let (hz, k) = ([0.7, 2.1, 5.0], theta.len());
        let problem = Logarithmic {
            prediction: Prediction::new(&model, ResponseKind::Impedance, &hz, &Kernel::default(), &Smoothing::None, None),
            // Far from any limb, so that residuals are large.
            estimate: (0..12).map(|e| Complex64::from_polar(40.0 + 7.0 * f64::from(e), 1.9 * f64::from(e))).collect(),
            weight: (0..12).map(|e| 0.08 * f64::from(e)).collect(),
            parameters: k,
        };
        let jacobian = problem.jacobian(&theta);
        let (value, slopes) = problem.prediction.evaluate(&theta, true);
        let (weights, inverses) = (vec![[0.7, 0.4, -1.3, 0.2]; value.len()], value.iter().map(|v| v.inv()).collect::<Vec<_>>());
        let [few, all] = [problem.sparse_sums(&weights, &inverses, &slopes), problem.dense_sums(&weights, &inverses, &slopes)];
        for (few, all) in [(&few.information, &all.information), (&few.curvature, &all.curvature), (&few.gradient, &all.gradient)] {
            assert!((few - all).norm_max() < 1e-13 * all.norm_max());
        }
        let Slopes::Curved { information, gradient: own, curvature } = problem.slopes(&theta, &problem.residuals(&theta)) else { panic!("curved") };
        // Sums of 24 products of one size, in another order.
        assert!((&information - jacobian.transpose() * &jacobian).norm_max() < 1e-13 * information.norm_max());
        let hessian = information + curvature;
        let gradient = |theta: &[f64]| {
            let (jacobian, residuals) = (problem.jacobian(theta), problem.residuals(theta));
            (0..k).map(|c| jacobian.col(c).iter().zip(&residuals).map(|(j, r)| j * r).sum::<f64>()).collect::<Vec<f64>>()
        };
        let here = gradient(&theta);
        for c in 0..k {
            assert!((own[(c, 0)] - here[c]).abs() < 1e-12 * here[c].abs().max(1.0), "{c}");
            for (r, slope) in difference(&theta, c, 1e-5 * theta[c].abs(), gradient).into_iter().enumerate() {
                let scale = (hessian[(r, r)] * hessian[(c, c)]).abs().sqrt();
                assert!((hessian[(r, c)] - slope).abs() < 1e-7 * scale, "{r} {c}");
            }
        }
    }
}
