//! The local polynomial method: response and leakage as smooth functions of frequency around each line.

use super::EstimateError;
use super::fitted::{Fitted, freedom};
use super::local_rational::{LocalRational, Rational};
use crate::hermitian::Cholesky;
use ndarray::Array3;
use ndof_signal::forward_transform;
use num_complex::Complex64;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

const NAN: Complex64 = Complex64::new(f64::NAN, f64::NAN);

/// Lines that one task treats, so that workspaces are made once for many.
const CHUNK: usize = 256;

/// Settings of the local polynomial method.
///
/// Within ±n lines of each line k of the whole record's transform,
///
/// Y(k+r) = [G + Σ_s g_s rˢ] U(k+r) + t₀ + Σ_s t_s rˢ + V(k+r), s = 1…R,
///
/// is solved by least squares: the polynomial in G is the response's curvature, the one in t the leakage. No window, so
/// no loss of resolution; trials share G and g_s and have a leakage each.
///
/// Pintelon & Schoukens, System Identification, 2nd ed. 2012, ch. 7; Pintelon et al., Mech. Syst. Signal Process. 24,
/// 2010.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default)]
pub struct LocalPolynomial {
    /// R, the degree of both polynomials: 2; 4 where a resonance is only a few lines wide.
    pub order: usize,
    /// n, lines on each side; by [`default_half_width`](Self::default_half_width) where none is given.
    pub half_width: Option<usize>,
    /// Where no half width is given, take the one of 1, 1½, 2 and 3 times the default that best predicts each line from
    /// its neighbours (leave one out): one width for the whole band, so that ν is one number.
    pub leave_one_out: bool,
}

impl Default for LocalPolynomial {
    fn default() -> Self {
        LocalPolynomial { order: 2, half_width: None, leave_one_out: false }
    }
}

impl LocalPolynomial {
    /// n = ⌈((R+1)(q+1) + m + 4)/2⌉ for q drivers and m responders, which leaves ν ≥ m + 5 for the noise covariance.
    ///
    /// A degree above 2 is asked for where a resonance is only a few lines wide, so that every line of the window counts
    /// against it: n = ⌈((R+1)(q+1) + m + 1)/2⌉, ν ≥ m + 2, wider intervals for less bias.
    ///
    /// ```
    /// use ndof_sysid::LocalPolynomial;
    /// assert_eq!([(1, 2), (2, 4), (3, 6), (6, 12)].map(|(q, m)| LocalPolynomial::default().default_half_width(q, m)), [6, 9, 11, 19]);
    /// ```
    pub fn default_half_width(&self, drivers: usize, responders: usize) -> usize {
        ((self.order + 1) * (drivers + 1) + responders + if self.order > 2 { 1 } else { 4 }).div_ceil(2)
    }
}

/// The transforms of one trial, one a channel, 0 to Nyquist, scaled so that |Z|² is a one-sided density.
pub(crate) struct Lines(Vec<Vec<Complex64>>);

impl Lines {
    /// Transforms of the first `len` samples of each channel, each without its mean.
    pub(crate) fn new(sample_rate_hz: f64, channels: &[&[f64]], len: usize) -> Self {
        let fft = forward_transform(len);
        let scale = (2.0 / (sample_rate_hz * len as f64)).sqrt();
        let transform = |samples: &&[f64]| {
            let mean = samples[..len].iter().sum::<f64>() / len as f64;
            let mut input: Vec<f64> = samples[..len].iter().map(|v| (v - mean) * scale).collect();
            let mut output = fft.make_output_vec();
            // Lengths are those of the plan, so the transform cannot refuse.
            let done = fft.process(&mut input, &mut output);
            debug_assert!(done.is_ok());
            output
        };
        Lines(channels.par_iter().map(transform).collect())
    }

    /// `width` lines of a channel from line `low` on.
    pub(super) fn window(&self, channel: usize, low: usize, width: usize) -> &[Complex64] {
        &self.0[channel][low..low + width]
    }
}

/// The fit with the settings' half width, or the best of four by prediction of left-out lines.
pub(crate) fn fit_as_set(
    trials: &[Lines],
    rate_and_len: (f64, usize),
    drivers: &[usize],
    responders: &[usize],
    settings: LocalPolynomial,
) -> Result<LocalFit, EstimateError> {
    let default = settings.default_half_width(drivers.len(), responders.len());
    let fit = |half_width: usize| fit(trials, rate_and_len, drivers, responders, (settings.order, 0, half_width));
    if !settings.leave_one_out || settings.half_width.is_some() {
        return fit(settings.half_width.unwrap_or(default));
    }
    let mut best = fit(default)?;
    for half_width in [3 * default / 2, 2 * default, 3 * default] {
        match fit(half_width) {
            Ok(other) if other.prediction_error() < best.prediction_error() => best = other,
            Ok(_) => {}
            Err(EstimateError::TooFewLines { .. }) => break,
            Err(error) => return Err(error),
        }
    }
    Ok(best)
}

/// The fit of the local rational method.
pub(crate) fn fit_rational(
    trials: &[Lines],
    rate_and_len: (f64, usize),
    drivers: &[usize],
    responders: &[usize],
    settings: LocalRational,
) -> Result<Fitted, EstimateError> {
    let half_width = settings.half_width.unwrap_or_else(|| settings.default_half_width(drivers.len(), responders.len()));
    fit(trials, rate_and_len, drivers, responders, (settings.order, settings.denominator, half_width)).map(|f| f.fitted)
}

/// A fit, and how well each line is predicted from its neighbours alone.
pub(crate) struct LocalFit {
    pub(crate) fitted: Fitted,
    /// Σ_i |e_i|²/(1 − h)² / S_ii over responders and trials, e the residual at the line and h its leverage, `[f]`.
    pub(crate) left_out: Vec<f64>,
}

impl LocalFit {
    /// Mean relative error of left-out lines where the drivers drive (−30 dB of the strongest line).
    fn prediction_error(&self) -> f64 {
        let (bins, q, _) = self.fitted.driver.dim();
        let power = |f: usize| (0..q).map(|j| self.fitted.driver[[f, j, j]].re).sum::<f64>();
        let strongest = (0..bins).map(power).filter(|p| p.is_finite()).fold(0.0, f64::max);
        let driven = (0..bins).filter(|&f| power(f) > 1e-3 * strongest && self.left_out[f].is_finite());
        let (count, sum) = driven.fold((0.0, 0.0), |(n, sum), f| (n + 1.0, sum + self.left_out[f]));
        sum / count
    }
}

/// Fits `responders` on `drivers` at every line of trials of `len` samples, with a denominator if its degree is not zero.
fn fit(
    trials: &[Lines],
    (sample_rate_hz, len): (f64, usize),
    drivers: &[usize],
    responders: &[usize],
    (order, denominator, half_width): (usize, usize, usize),
) -> Result<LocalFit, EstimateError> {
    let (q, m, s, width) = (drivers.len(), responders.len(), order + 1, 2 * half_width + 1);
    let degrees_of_freedom = freedom(trials.len() * (width - width.min(s)), s * q + denominator.div_ceil(m))?;
    let (bins, last) = (len / 2 + 1, (len - 1) / 2);
    if last < width {
        return Err(EstimateError::TooFewLines { lines: last, needed: width });
    }
    let basis = Basis::new(half_width, s);
    let solve = |first: usize| {
        let mut local = Local::new(trials, drivers, responders, &basis);
        let polynomial = (trials.len() * (width - s) - s * q) as f64;
        let mut rational = (denominator > 0).then(|| Rational::new(trials, drivers, responders, &basis, denominator, polynomial));
        let mut out = Chunk::default();
        for k in first..bins.min(first + CHUNK) {
            if k == 0 || k > last {
                out.missing(m, q);
                continue;
            }
            let low = k.saturating_sub(half_width).clamp(1, last + 1 - width);
            match &mut rational {
                Some(rational) => rational.solve(k, low, &mut out),
                None => local.solve(k, low, degrees_of_freedom, &mut out),
            }
        }
        out
    };
    let chunks: Vec<Chunk> = (0..bins).step_by(CHUNK).collect::<Vec<_>>().into_par_iter().map(solve).collect();
    let join = |part: fn(&Chunk) -> &Vec<Complex64>, rows: usize, columns: usize| {
        let mut all = chunks.iter().flat_map(|c| part(c).iter().copied());
        Array3::from_shape_simple_fn((bins, rows, columns), || all.next().unwrap_or(NAN))
    };
    Ok(LocalFit {
        fitted: Fitted {
            frequency_hz: (0..bins).map(|k| k as f64 * sample_rate_hz / len as f64).collect(),
            g: join(|c| &c.g, m, q),
            noise: join(|c| &c.noise, m, m),
            gram_inverse: join(|c| &c.gram_inverse, q, q),
            driver: join(|c| &c.driver, q, q),
            degrees_of_freedom,
            independent_spacing_hz: basis.independent_lines() * sample_rate_hz / len as f64,
        },
        left_out: chunks.iter().flat_map(|c| c.left_out.iter().copied()).collect(),
    })
}

/// Orthonormal polynomials on 2n+1 equidistant points (Gram), row by row: `value[s * width + r]`.
pub(super) struct Basis {
    pub(super) terms: usize,
    pub(super) width: usize,
    value: Vec<f64>,
}

impl Basis {
    fn new(half_width: usize, terms: usize) -> Self {
        let width = 2 * half_width + 1;
        let mut value: Vec<f64> = Vec::with_capacity(terms * width);
        for s in 0..terms {
            let mut row: Vec<f64> = (0..width).map(|r| ((r as f64 - half_width as f64) / half_width as f64).powi(s as i32)).collect();
            // Twice, so that what round-off leaves of the first pass is gone.
            for _ in 0..2 {
                for known in value.chunks_exact(width) {
                    let dot: f64 = known.iter().zip(&row).map(|(a, b)| a * b).sum();
                    row.iter_mut().zip(known).for_each(|(a, b)| *a -= dot * b);
                }
            }
            let norm = row.iter().map(|a| a * a).sum::<f64>().sqrt();
            value.extend(row.iter().map(|a| a / norm));
        }
        Basis { terms, width, value }
    }

    pub(super) fn at(&self, s: usize, r: usize) -> f64 {
        self.value[s * self.width + r]
    }

    /// Lines that bring as much as one independent value. The response at a line is the mean of its neighbours' with weights
    /// h_r = Σ_s φ_s(0) φ_s(r), Σ h = 1: its variance is Σ h² = h₀ of a line's, that of a mean over a band 1/N of it.
    fn independent_lines(&self) -> f64 {
        let centre = self.width / 2;
        1.0 / (0..self.terms).map(|s| self.at(s, centre).powi(2)).sum::<f64>()
    }

    /// Takes the polynomial out of a series of `width` numbers.
    fn project_out(&self, series: &mut [Complex64]) {
        for known in self.value.chunks_exact(self.width) {
            let dot: Complex64 = known.iter().zip(series.iter()).map(|(a, b)| b * a).sum();
            series.iter_mut().zip(known).for_each(|(x, a)| *x -= dot * a);
        }
    }
}

/// Results of some lines, one after the other.
#[derive(Default)]
pub(super) struct Chunk {
    pub(super) g: Vec<Complex64>,
    pub(super) noise: Vec<Complex64>,
    pub(super) gram_inverse: Vec<Complex64>,
    pub(super) driver: Vec<Complex64>,
    pub(super) left_out: Vec<f64>,
}

impl Chunk {
    pub(super) fn missing(&mut self, m: usize, q: usize) {
        self.g.resize(self.g.len() + m * q, NAN);
        self.noise.resize(self.noise.len() + m * m, NAN);
        self.gram_inverse.resize(self.gram_inverse.len() + q * q, NAN);
        self.driver.resize(self.driver.len() + q * q, NAN);
        self.left_out.push(f64::NAN);
    }
}

/// Workspace for one line: regressors X (unknowns × equations) and responders Y (m × equations), equations being the
/// lines of the window of each trial in turn, all without the leakage polynomial.
struct Local<'a> {
    trials: &'a [Lines],
    drivers: &'a [usize],
    responders: &'a [usize],
    basis: &'a Basis,
    x: Vec<Complex64>,
    y: Vec<Complex64>,
    /// Y Xᴴ, whitened by the factor of X Xᴴ, m × unknowns.
    projection: Vec<Complex64>,
    factor: Cholesky,
    row: Vec<Complex64>,
    evaluation: Vec<Complex64>,
}

impl<'a> Local<'a> {
    fn new(trials: &'a [Lines], drivers: &'a [usize], responders: &'a [usize], basis: &'a Basis) -> Self {
        let (unknowns, equations, m) = (drivers.len() * basis.terms, trials.len() * basis.width, responders.len());
        let zeros = |n: usize| vec![Complex64::default(); n];
        Local {
            trials,
            drivers,
            responders,
            basis,
            x: zeros(unknowns * equations),
            y: zeros(m * equations),
            projection: zeros(m * unknowns),
            factor: Cholesky::new(unknowns),
            row: zeros(unknowns),
            evaluation: zeros(drivers.len() * unknowns),
        }
    }

    /// Solves line `k` from the window that begins at line `low`.
    fn solve(&mut self, k: usize, low: usize, degrees_of_freedom: f64, out: &mut Chunk) {
        let Basis { terms, width, .. } = *self.basis;
        let (q, m, equations) = (self.drivers.len(), self.responders.len(), self.trials.len() * width);
        let unknowns = q * terms;
        for (t, trial) in self.trials.iter().enumerate() {
            for (j, &channel) in self.drivers.iter().enumerate() {
                let u = &trial.0[channel][low..low + width];
                for s in 0..terms {
                    let at = (j * terms + s) * equations + t * width;
                    let series = &mut self.x[at..at + width];
                    series.iter_mut().enumerate().for_each(|(r, x)| *x = u[r] * self.basis.at(s, r));
                    self.basis.project_out(series);
                }
            }
            for (i, &channel) in self.responders.iter().enumerate() {
                let at = i * equations + t * width;
                let series = &mut self.y[at..at + width];
                series.copy_from_slice(&trial.0[channel][low..low + width]);
                self.basis.project_out(series);
            }
        }
        let product = |a: &[Complex64], i: usize, b: &[Complex64], j: usize| -> Complex64 {
            a[i * equations..(i + 1) * equations].iter().zip(&b[j * equations..(j + 1) * equations]).map(|(a, b)| a * b.conj()).sum()
        };
        if !self.factor.factor(|i, j| product(&self.x, i, &self.x, j)) {
            return out.missing(m, q);
        }
        for (i, row) in self.projection.chunks_exact_mut(unknowns).enumerate() {
            row.iter_mut().enumerate().for_each(|(j, b)| *b = product(&self.y, i, &self.x, j));
            self.factor.whiten(row);
        }
        let first_noise = out.noise.len();
        for i in 0..m {
            for l in 0..m {
                let explained: Complex64 = (0..unknowns).map(|a| self.projection[i * unknowns + a] * self.projection[l * unknowns + a].conj()).sum();
                let rest = (product(&self.y, i, &self.y, l) - explained) / degrees_of_freedom;
                out.noise.push(if i == l { Complex64::from(rest.re.max(0.0)) } else { rest });
            }
        }
        // Coefficients, and the whitened rows that evaluate each driver's polynomial at the line.
        let offset = k - low;
        for j in 0..q {
            let row = &mut self.evaluation[j * unknowns..(j + 1) * unknowns];
            row.fill(Complex64::default());
            (0..terms).for_each(|s| row[j * terms + s] = Complex64::from(self.basis.at(s, offset)));
            self.factor.whiten(row);
        }
        for i in 0..m {
            for j in 0..q {
                let whitened = &self.evaluation[j * unknowns..(j + 1) * unknowns];
                out.g.push(self.projection[i * unknowns..(i + 1) * unknowns].iter().zip(whitened).map(|(b, e)| b * e.conj()).sum());
            }
        }
        for l in 0..q {
            for j in 0..q {
                let (a, b) = (&self.evaluation[l * unknowns..(l + 1) * unknowns], &self.evaluation[j * unknowns..(j + 1) * unknowns]);
                out.gram_inverse.push(a.iter().zip(b).map(|(a, b)| a * b.conj()).sum());
            }
        }
        // Drivers without leakage: their lowest regressor, whose polynomial is the constant 1/√width.
        let averages = (self.trials.len() * (width - terms)) as f64 / width as f64;
        for l in 0..q {
            for j in 0..q {
                out.driver.push(product(&self.x, l * terms, &self.x, j * terms) / averages);
            }
        }
        let mut left_out = 0.0;
        for t in 0..self.trials.len() {
            let at = t * width + offset;
            (0..unknowns).for_each(|a| self.row[a] = self.x[a * equations + at].conj());
            self.factor.whiten(&mut self.row);
            let leakage: f64 = (0..terms).map(|s| self.basis.at(s, offset).powi(2)).sum();
            let leverage = leakage + self.row.iter().map(|v| v.norm_sqr()).sum::<f64>();
            for i in 0..m {
                let fitted: Complex64 = self.projection[i * unknowns..(i + 1) * unknowns].iter().zip(&self.row).map(|(b, x)| b * x.conj()).sum();
                let error = (self.y[i * equations + at] - fitted).norm_sqr() / (1.0 - leverage).powi(2);
                let power: f64 = self.y[i * equations..(i + 1) * equations].iter().map(|v| v.norm_sqr()).sum();
                left_out += error * equations as f64 / power.max(f64::MIN_POSITIVE);
            }
        }
        debug_assert_eq!(out.noise.len() - first_noise, m * m);
        out.left_out.push(left_out);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The weight of the middle in a least-squares parabola over 2n+1 points, h₀ = 3 (3n² + 3n − 1) / ((2n+1)(4n² + 4n − 3)) (Savitzky & Golay 1964);
    /// that of a mean is 1/(2n+1).
    #[test]
    fn the_middle_weighs_what_smoothing_by_a_parabola_gives_it() {
        for n in 2..40 {
            let (k, width) = (n as f64, 2.0 * n as f64 + 1.0);
            let middle = 3.0 * (3.0 * k * k + 3.0 * k - 1.0) / (width * (4.0 * k * k + 4.0 * k - 3.0));
            for (terms, lines) in [(1, width), (3, 1.0 / middle)] {
                let found = Basis::new(n, terms).independent_lines();
                assert!((found / lines - 1.0).abs() < 1e-12, "n = {n}, {terms} terms: {found} and {lines}");
            }
        }
    }
}
