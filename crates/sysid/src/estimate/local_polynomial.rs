//! The local polynomial method: response and leakage as smooth functions of frequency around each line.

use super::local_lines::{Basis, Chunk, Lines};
use ndof_linear::Cholesky;
use num_complex::Complex64;
use serde::{Deserialize, Serialize};

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

/// Workspace for one line: regressors X (unknowns × equations) and responders Y (m × equations), equations being the
/// lines of the window of each trial in turn, all without the leakage polynomial.
pub(super) struct Local<'a> {
    trials: &'a [Lines],
    drivers: &'a [usize],
    responders: &'a [usize],
    basis: &'a Basis,
    x: Vec<Complex64>,
    y: Vec<Complex64>,
    /// Y Xᴴ, whitened by the factor of X Xᴴ, m × unknowns.
    projection: Vec<Complex64>,
    factor: Cholesky<Complex64>,
    row: Vec<Complex64>,
    evaluation: Vec<Complex64>,
}

impl<'a> Local<'a> {
    pub(super) fn new(trials: &'a [Lines], drivers: &'a [usize], responders: &'a [usize], basis: &'a Basis) -> Self {
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
    pub(super) fn solve(&mut self, k: usize, low: usize, degrees_of_freedom: f64, out: &mut Chunk) {
        let Basis { terms, width, .. } = *self.basis;
        let (q, m, equations) = (self.drivers.len(), self.responders.len(), self.trials.len() * width);
        let unknowns = q * terms;
        for (t, trial) in self.trials.iter().enumerate() {
            for (j, &channel) in self.drivers.iter().enumerate() {
                let u = trial.window(channel, low, width);
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
                series.copy_from_slice(trial.window(channel, low, width));
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
        out.left_out.push(self.left_out(offset));
    }

    /// Σ_i |e_i|²/(1 − h)² / S_ii of a line of the window, the fit being that with it.
    fn left_out(&mut self, offset: usize) -> f64 {
        let Basis { terms, width, .. } = *self.basis;
        let (m, equations, unknowns) = (self.responders.len(), self.trials.len() * width, self.drivers.len() * terms);
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
        left_out
    }
}
