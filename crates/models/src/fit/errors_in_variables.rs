//! Maximum likelihood with noise on effort and motion alike, from periods of a periodic excitation.

use super::{COST_TOLERANCE, Fit, FitError, Solved};
use crate::{LeastSquares, ParametricModel};
use faer::Mat;
use ndof_linear::{Cholesky, square};
use ndof_signal::{forward_transform, spectrum_by};
use num_complex::Complex64;
use serde::{Deserialize, Serialize};

/// Means over periods of the spectra of effort F and motion d, and what the periods say of their noise.
#[derive(Clone, Debug, PartialEq)]
pub struct PeriodMeans {
    /// Frequencies that the excitation drives.
    pub frequency_hz: Vec<f64>,
    /// (F, d) at each of them: 2 N numbers, of N axes each (unit · samples).
    pub mean: Vec<Vec<Complex64>>,
    /// Covariance E[δ δ*] of that mean, 2 N × 2 N by rows.
    pub covariance: Vec<Vec<Complex64>>,
    /// Degrees of freedom of the covariance: periods less one.
    pub degrees_of_freedom: f64,
}

impl PeriodMeans {
    /// Of whole periods of `period` samples, of which the transient has died out; `lines` are multiples of 1/period, 0 Hz and
    /// half the rate never count. `None` if channels differ in length or number, or hold fewer than two periods.
    pub fn of_periods(sample_rate_hz: f64, period: usize, effort: &[&[f64]], motion: &[&[f64]], lines: &[usize]) -> Option<Self> {
        let samples = effort.first()?.len();
        let channels: Vec<&[f64]> = effort.iter().chain(motion).copied().collect();
        let periods = samples.checked_div(period)?;
        if effort.len() != motion.len() || channels.iter().any(|c| c.len() != samples) || periods < 2 {
            return None;
        }
        let plan = forward_transform(period);
        let lines: Vec<usize> = lines.iter().copied().filter(|&l| l > 0 && 2 * l < period).collect();
        let size = channels.len();
        let mut each = vec![vec![vec![Complex64::default(); size]; lines.len()]; periods];
        for (c, channel) in channels.iter().enumerate() {
            for (p, own) in channel.chunks_exact(period).enumerate() {
                let spectrum = spectrum_by(plan.as_ref(), &mut own.to_vec());
                lines.iter().enumerate().for_each(|(k, &line)| each[p][k][c] = spectrum[line]);
            }
        }
        let count = periods as f64;
        let mean: Vec<Vec<Complex64>> =
            (0..lines.len()).map(|k| (0..size).map(|c| each.iter().map(|p| p[k][c]).sum::<Complex64>() / count).collect()).collect();
        let covariance = mean
            .iter()
            .enumerate()
            .map(|(k, mean)| {
                let product = |e: usize| each.iter().map(|p| (p[k][e / size] - mean[e / size]) * (p[k][e % size] - mean[e % size]).conj()).sum::<Complex64>();
                (0..size * size).map(|e| product(e) / (count * (count - 1.0))).collect()
            })
            .collect();
        let frequency_hz = lines.iter().map(|&l| l as f64 * sample_rate_hz / period as f64).collect();
        Some(PeriodMeans { frequency_hz, mean, covariance, degrees_of_freedom: count - 1.0 })
    }
}

/// Fit with noise on both sides: minimises Σ eᴴ C⁻¹ e over frequencies and experiments, where e = F̂ − D(θ) d̂ and
/// C(θ) = C_FF − D C_dF − C_Fd Dᴴ + D C_dd Dᴴ is what the noise of both makes of it.
///
/// A least-squares fit of F = D d, or of an H1 estimate, is biased by noise on its regressor; this one is not. C comes from the
/// periods themselves, which makes χ² larger by ν/(ν − N) and the scatter of θ by ν²/((ν − N)² − 1); both are allowed for.
///
/// # References
/// R. Pintelon & J. Schoukens (2012), System identification: a frequency domain approach, ch. 9 and 12 (sample maximum likelihood).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ErrorsInVariables {
    /// Lowest and highest frequency.
    pub band_hz: [f64; 2],
}

impl ErrorsInVariables {
    /// Fits `model` to one or more experiments from `start`.
    ///
    /// # Errors
    /// [`FitError`] if the spectra do not have the model's axes, the band holds too little, or periods are too few for a covariance.
    pub fn fit(&self, model: &dyn ParametricModel, experiments: &[PeriodMeans], start: &[f64]) -> Result<Fit, FitError> {
        let (n, parameters) = (model.axes().len(), model.parameters());
        if start.len() != parameters.len() {
            return Err(FitError::StartLength { found: start.len(), expected: parameters.len() });
        }
        let mut lines = Vec::new();
        for experiment in experiments {
            for (k, &hz) in experiment.frequency_hz.iter().enumerate() {
                let size = experiment.mean[k].len();
                if size != 2 * n {
                    return Err(FitError::Shape { outputs: size / 2, inputs: size / 2, axes: n });
                }
                if (self.band_hz[0]..=self.band_hz[1]).contains(&hz) {
                    lines.push(Line::new(hz, &experiment.mean[k], &experiment.covariance[k], n));
                }
            }
        }
        let degrees = experiments.iter().map(|e| e.degrees_of_freedom).fold(f64::INFINITY, f64::min);
        let data = 2 * n * lines.len();
        if data <= parameters.len() {
            let needed = parameters.len() / (2 * n) + 1;
            return Err(FitError::TooFewBins { bins: lines.len(), independent: lines.len() as f64, needed, low_hz: self.band_hz[0], high_hz: self.band_hz[1] });
        }
        let own = n as f64;
        if degrees <= own + 1.0 {
            return Err(FitError::NoCovariance);
        }
        let solved = Solved::new(&BothSides { model, lines: &lines, n, parameters: parameters.len() }, model, start, COST_TOLERANCE)?;
        let inflation = degrees * degrees / ((degrees - own).powi(2) - 1.0);
        let covariance = solved.covariance(None, inflation);
        let degrees_of_freedom = (data - parameters.len()) as f64;
        let chi2 = 2.0 * solved.minimum.cost * (degrees - own) / degrees;
        let hz: Vec<f64> = lines.iter().map(|l| l.hz).collect();
        Ok(solved.into_fit(model, covariance, &hz, chi2, degrees_of_freedom))
    }
}

/// One frequency of one experiment.
struct Line {
    hz: f64,
    effort: Vec<Complex64>,
    motion: Vec<Complex64>,
    /// C_FF, C_Fd and C_dd.
    noise: [Vec<Complex64>; 3],
}

impl Line {
    fn new(hz: f64, mean: &[Complex64], covariance: &[Complex64], n: usize) -> Self {
        let block = |r: usize, c: usize| (0..n * n).map(|e| covariance[(r * n + e / n) * 2 * n + c * n + e % n]).collect();
        Line { hz, effort: mean[..n].to_vec(), motion: mean[n..].to_vec(), noise: [block(0, 0), block(0, 1), block(1, 1)] }
    }
}

struct BothSides<'a> {
    model: &'a dyn ParametricModel,
    lines: &'a [Line],
    n: usize,
    parameters: usize,
}

/// A x for a square A.
fn apply(a: &[Complex64], x: &[Complex64]) -> Vec<Complex64> {
    let n = x.len();
    a.chunks_exact(n).map(|row| row.iter().zip(x).map(|(a, x)| a * x).sum()).collect()
}

impl BothSides<'_> {
    /// What whitens the error of a line, that error, and D C_dd − C_Fd, whose product with ∂Dᴴ is half of ∂C.
    fn error(&self, line: &Line, d: &[Complex64]) -> Option<(Vec<Complex64>, Vec<Complex64>, Vec<Complex64>)> {
        let n = self.n;
        let [effort, cross, motion] = &line.noise;
        let along: Vec<Complex64> = square::product(d, motion, n).iter().zip(cross).map(|(a, b)| a - b).collect();
        let turned = square::product(&along, &square::adjoint(d, n), n);
        let back = square::product(d, &square::adjoint(cross, n), n);
        let covariance: Vec<Complex64> = (0..n * n).map(|e| effort[e] + turned[e] - back[e]).collect();
        let left = Cholesky::of(&covariance, n).map(|c| c.whitener())?;
        let error: Vec<Complex64> = line.effort.iter().zip(apply(d, &line.motion)).map(|(f, m)| f - m).collect();
        Some((left, error, along))
    }

    fn stiffness(&self, theta: &[f64], hz: f64, derivative: Option<&mut [Complex64]>) -> Vec<Complex64> {
        let mut value = vec![Complex64::default(); self.n * self.n];
        self.model.stiffness(theta, Complex64::new(0.0, std::f64::consts::TAU * hz), &mut value, derivative);
        value
    }
}

/// A complex residual of unit variance is two real ones of half.
const ROOT_TWO: f64 = std::f64::consts::SQRT_2;

impl LeastSquares for BothSides<'_> {
    fn residuals(&self, theta: &[f64]) -> Vec<f64> {
        let mut out = Vec::with_capacity(2 * self.n * self.lines.len());
        for line in self.lines {
            match self.error(line, &self.stiffness(theta, line.hz, None)) {
                Some((left, error, _)) => out.extend(apply(&left, &error).iter().flat_map(|v| [ROOT_TWO * v.re, ROOT_TWO * v.im])),
                None => out.extend(std::iter::repeat_n(f64::NAN, 2 * self.n)),
            }
        }
        out
    }

    /// L⁻¹ (∂e − ½ ∂C C⁻¹ e): not the derivative of L⁻¹ e, but it has the same gradient of the cost, and no derivative of a root.
    fn jacobian(&self, theta: &[f64]) -> Mat<f64> {
        let n = self.n;
        let mut out = Mat::zeros(2 * n * self.lines.len(), self.parameters);
        let mut slopes = vec![Complex64::default(); n * n * self.parameters];
        for (f, line) in self.lines.iter().enumerate() {
            slopes.fill(Complex64::default());
            let d = self.stiffness(theta, line.hz, Some(&mut slopes));
            let Some((left, error, along)) = self.error(line, &d) else { continue };
            // C⁻¹ e.
            let weighted = apply(&square::adjoint(&left, n), &apply(&left, &error));
            for (k, slope) in slopes.chunks_exact(n * n).enumerate() {
                let moved = apply(slope, &line.motion);
                let half = apply(&along, &apply(&square::adjoint(slope, n), &weighted));
                let other = apply(slope, &apply(&square::adjoint(&along, n), &weighted));
                let column: Vec<Complex64> = (0..n).map(|i| -moved[i] - 0.5 * (half[i] + other[i])).collect();
                for (i, v) in apply(&left, &column).iter().enumerate() {
                    out[(2 * (f * n + i), k)] = ROOT_TWO * v.re;
                    out[(2 * (f * n + i) + 1, k)] = ROOT_TWO * v.im;
                }
            }
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Axis, InertiaDampingStiffnessModel, Symmetry};

    #[test]
    fn means_and_covariances_over_periods_are_those_of_their_lines() {
        // Lines 1 and 3 of 16 samples with amplitudes that differ by period.
        let amplitude = [[1.0, 2.0, 4.0, 1.0], [0.5, -1.0, 0.5, 3.0]];
        let channel = |c: usize| -> Vec<f64> {
            let at = |k: usize, line: usize| (std::f64::consts::TAU * (line * k) as f64 / 16.0).cos();
            (0..64).map(|k| amplitude[c][k / 16] * (at(k, 1) + 2.0 * at(k, 3)) + 9.0).collect()
        };
        let (effort, motion) = (channel(0), channel(1));
        let spectra = PeriodMeans::of_periods(32.0, 16, &[&effort], &[&motion], &[0, 1, 3, 8, 11]).expect("whole periods");
        assert_eq!((spectra.frequency_hz.as_slice(), spectra.degrees_of_freedom), (&[2.0, 6.0][..], 3.0));
        let products = [[6.0, -2.5], [-2.5, 8.25]];
        for (line, size) in [(0, 8.0), (1, 16.0)] {
            for c in 0..2 {
                let mean = amplitude[c].iter().sum::<f64>() / 4.0;
                assert!((spectra.mean[line][c] - size * mean).norm() < 1e-12);
                for (d, product) in products[c].into_iter().enumerate() {
                    // Σ (a − ā)(b − b̄) over four periods, for the covariance of a mean of four.
                    let (found, want) = (spectra.covariance[line][2 * c + d], size * size * product / 12.0);
                    assert!((found - want).norm() < 1e-11, "{line} {c} {d}: {found} {want}");
                }
            }
        }
    }

    #[test]
    fn records_that_are_not_whole_periods_of_both_sides_are_refused() {
        let (long, short) = (vec![0.0; 64], vec![0.0; 48]);
        let of = |effort: &[&[f64]], motion: &[&[f64]], period: usize| PeriodMeans::of_periods(32.0, period, effort, motion, &[1]).is_some();
        assert!(of(&[&long], &[&long], 32));
        assert!(!of(&[&long], &[&short], 16), "of two lengths");
        assert!(!of(&[&long, &long], &[&long], 16), "two forces for one motion");
        assert!(!of(&[&long], &[&long], 33), "one period and a part");
        assert!(!of(&[&long], &[&long], 0) && !of(&[], &[], 16));
    }

    #[test]
    fn what_is_not_enough_is_said() {
        let axes = vec![Axis::linear("x"), Axis::linear("y"), Axis::linear("z")];
        let model = InertiaDampingStiffnessModel::new(axes, Symmetry::Free);
        let spectra = |lines: usize, channels: usize, degrees_of_freedom: f64| PeriodMeans {
            frequency_hz: (1..=lines).map(|k| k as f64).collect(),
            mean: vec![vec![Complex64::ONE; channels]; lines],
            covariance: vec![vec![Complex64::ZERO; channels * channels]; lines],
            degrees_of_freedom,
        };
        let fit = |spectra: PeriodMeans| ErrorsInVariables { band_hz: [0.5, 20.0] }.fit(&model, &[spectra], &[1.0; 27]).err();
        assert!(matches!(fit(spectra(4, 8, 30.0)), Some(FitError::Shape { outputs: 4, inputs: 4, axes: 3 })));
        // Six numbers a line for 27 parameters.
        assert!(matches!(fit(spectra(4, 6, 30.0)), Some(FitError::TooFewBins { bins: 4, needed: 5, .. })));
        assert!(matches!(fit(spectra(5, 6, 4.0)), Some(FitError::NoCovariance)));
    }
}
