//! The local rational method: a denominator common to all responders around each line, for resonances a few lines wide.

use super::local_lines::{Basis, Chunk, Lines, next};
use crate::quantile::fisher;
use crate::response::places;
use ndof_linear::Cholesky;
use num_complex::Complex64;
use serde::{Deserialize, Serialize};

/// Steps in which the denominator is sought at most; it settles in three to five.
const STEPS: usize = 12;

/// The first steps weight the equation error (Sanathanan & Koerner), the later ones reduce the output error itself.
const EQUATION_ERROR_STEPS: usize = 2;

/// A step that lowers the cost by a smaller share is the last: a few hundredths of the denominator's standard error.
const SETTLED: f64 = 1e-3;

/// Halvings of a step that does not lower the cost.
const HALVINGS: usize = 4;

/// Where the equation error finds less than this share of what the F test wants, the output error is not asked.
const HOPELESS: f64 = 0.3;

/// A denominator this small within the window has a pole on the frequency axis.
const POLE: f64 = 1e-3;

/// The denominator is kept where noise alone would let a given one lower the residual as much in at most this share of all windows. It is not
/// given but searched for: of pure noise some windows in a hundred keep theirs.
const BY_CHANCE: f64 = 0.001;

/// Settings of the local rational method.
///
/// Within ±n lines of each line k, with ρ = r/n,
///
/// Y(k+r) = [N(ρ) U(k+r) + T(ρ)] / D(ρ) + V(k+r), D(ρ) = 1 + Σ_s d_s ρˢ,
///
/// N and T of degree R, D common to all outputs, inputs and trials. D starts from the linearised equation error (Levy),
/// is reweighted by its own inverse (Sanathanan & Koerner) and then refined by Gauss-Newton steps on the output error,
/// whose minimum is free of the bias that noise on Y gives to the linearised one. Where an F test does not find D needed
/// (p > 0.001), the window keeps the polynomial, D = 1; the test is that of a D which is given, and since it is searched for, noise alone
/// keeps one in some 2 (degree 1) to 4 % (degree 2) of windows. A denominator of degree 1 holds one resonance, 2 two neighbours.
///
/// The covariance is that of the linearised least squares, the error of d included; for several outputs and inputs its
/// Kronecker form keeps the variance of each entry as well as a product of a row and a column factor can. Frequencies count as
/// independent where the polynomial's of the same window are; what neighbours share through the error of d is not counted.
///
/// McKelvey & Guérin, IFAC SYSID 2012; Sanathanan & Koerner, IEEE Trans. Autom. Control 8, 1963.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default)]
pub struct LocalRational {
    /// R, the degree of the numerators and of the leakage.
    pub order: usize,
    /// Degree of the common denominator, 1 or 2.
    pub denominator: usize,
    /// n, lines on each side; by [`default_half_width`](Self::default_half_width) where none is given.
    pub half_width: Option<usize>,
}

impl Default for LocalRational {
    fn default() -> Self {
        LocalRational { order: 2, denominator: 1, half_width: None }
    }
}

impl LocalRational {
    /// n = ⌈((R+1)(q+1) + D + m + 4)/2⌉ for q drivers and m responders.
    pub fn default_half_width(&self, drivers: usize, responders: usize) -> usize {
        ((self.order + 1) * (drivers + 1) + self.denominator + responders + 4).div_ceil(2)
    }
}

/// Workspace for one line. Equations are the lines of the window of each trial in turn.
pub(super) struct Rational<'a> {
    trials: &'a [Lines],
    drivers: &'a [usize],
    responders: &'a [usize],
    basis: &'a Basis,
    degree: usize,
    /// ν for a window with a denominator and for one without.
    freedom: [f64; 2],
    /// Largest ratio of mean squares that chance gives.
    threshold: f64,
    /// ρ over the window.
    rho: Vec<f64>,
    /// 1/D over the window.
    weight: Vec<Complex64>,
    /// Leakage polynomials over D, orthonormal, terms × width.
    leakage: Vec<Complex64>,
    /// Regressors (U φ_s)/D without leakage, unknowns × equations.
    x: Vec<Complex64>,
    /// Responders without leakage, m × equations; after [`regress`](Self::regress) the residuals.
    residual: Vec<Complex64>,
    /// Coefficients whitened by the factor of X Xᴴ, m × unknowns.
    projection: Vec<Complex64>,
    factor: Cholesky<Complex64>,
    /// Sensitivities of the residuals to d, (m D) × equations, and what X takes of them, (m D) × unknowns.
    sensitivity: Vec<Complex64>,
    absorbed: Vec<Complex64>,
    /// Variances that make responders comparable.
    scale: Vec<f64>,
    row: Vec<Complex64>,
}

impl<'a> Rational<'a> {
    pub(super) fn new(trials: &'a [Lines], drivers: &'a [usize], responders: &'a [usize], basis: &'a Basis, degree: usize, freedom: f64) -> Self {
        let (unknowns, equations, m) = (drivers.len() * basis.terms, trials.len() * basis.width, responders.len());
        let zeros = |n: usize| vec![Complex64::default(); n];
        let half = (basis.width / 2) as f64;
        let left = freedom - degree as f64 / m as f64;
        Rational {
            trials,
            drivers,
            responders,
            basis,
            degree,
            freedom: [left, freedom],
            threshold: fisher(1.0 - BY_CHANCE, degree, left * m as f64),
            rho: (0..basis.width).map(|r| (r as f64 - half) / half).collect(),
            weight: zeros(basis.width),
            leakage: zeros(basis.terms * basis.width),
            x: zeros(unknowns * equations),
            residual: zeros(m * equations),
            projection: zeros(m * unknowns),
            factor: Cholesky::new(unknowns),
            sensitivity: zeros(m * degree * equations),
            absorbed: zeros(m * degree * unknowns),
            scale: vec![1.0; m],
            row: zeros(unknowns),
        }
    }

    fn equations(&self) -> usize {
        self.trials.len() * self.basis.width
    }

    fn unknowns(&self) -> usize {
        self.drivers.len() * self.basis.terms
    }

    /// Numerators and leakage for a given denominator, and the sum of squares that is left; `None` where the drivers
    /// depend on each other or the denominator has a pole on the axis.
    fn regress(&mut self, low: usize, d: &[Complex64]) -> Option<f64> {
        let (width, terms, equations, unknowns) = (self.basis.width, self.basis.terms, self.equations(), self.unknowns());
        for (w, rho) in self.weight.iter_mut().zip(&self.rho) {
            let value: Complex64 = 1.0 + d.iter().enumerate().map(|(s, d)| d * rho.powi(s as i32 + 1)).sum::<Complex64>();
            if value.norm() < POLE {
                return None;
            }
            *w = value.inv();
        }
        for s in 0..terms {
            let (known, rest) = self.leakage.split_at_mut(s * width);
            let own = &mut rest[..width];
            own.iter_mut().enumerate().for_each(|(r, t)| *t = self.weight[r] * self.basis.at(s, r));
            // Twice, so that what round-off leaves of the first pass is gone.
            (0..2).for_each(|_| project_out(known, own));
            let norm = own.iter().map(|v| v.norm_sqr()).sum::<f64>().sqrt();
            own.iter_mut().for_each(|v| *v /= norm);
        }
        for (t, trial) in self.trials.iter().enumerate() {
            for (j, &channel) in self.drivers.iter().enumerate() {
                let u = &trial.window(channel, low, width);
                for s in 0..terms {
                    let series = &mut self.x[(j * terms + s) * equations + t * width..][..width];
                    series.iter_mut().enumerate().for_each(|(r, x)| *x = u[r] * self.weight[r] * self.basis.at(s, r));
                    project_out(&self.leakage, series);
                }
            }
            for (i, &channel) in self.responders.iter().enumerate() {
                let series = &mut self.residual[i * equations + t * width..][..width];
                series.copy_from_slice(trial.window(channel, low, width));
                project_out(&self.leakage, series);
            }
        }
        if !self.factor.factor(|i, j| dot(&self.x, i, &self.x, j, equations)) {
            return None;
        }
        let mut cost = 0.0;
        for i in 0..self.responders.len() {
            let whitened = &mut self.projection[i * unknowns..(i + 1) * unknowns];
            take_out(&self.factor, &self.x, &mut self.residual[i * equations..(i + 1) * equations], whitened, &mut self.row);
            cost += power(&self.residual[i * equations..(i + 1) * equations]) / self.scale[i];
        }
        cost.is_finite().then_some(cost)
    }

    /// ∂e/∂d_s = ρˢ M/D without what numerators and leakage absorb; M is the model, or Y itself for the equation error.
    fn differentiate(&mut self, low: usize, equation_error: bool) {
        let (width, equations, unknowns) = (self.basis.width, self.equations(), self.unknowns());
        for (i, &channel) in self.responders.iter().enumerate() {
            for s in 0..self.degree {
                let at = i * self.degree + s;
                let series = &mut self.sensitivity[at * equations..(at + 1) * equations];
                for (t, part) in series.chunks_exact_mut(width).enumerate() {
                    let y = self.trials[t].window(channel, low, width);
                    let e = &self.residual[i * equations + t * width..][..width];
                    for (r, to) in part.iter_mut().enumerate() {
                        let model = if equation_error { y[r] } else { y[r] - e[r] };
                        *to = model * self.weight[r] * self.rho[r].powi(s as i32 + 1);
                    }
                    project_out(&self.leakage, part);
                }
                take_out(&self.factor, &self.x, series, &mut self.absorbed[at * unknowns..(at + 1) * unknowns], &mut self.row);
            }
        }
    }

    /// δ = −(Σ e Jᴴ/σ²) (Σ J Jᴴ/σ²)⁻¹, the step of d.
    fn step(&self) -> Option<Vec<Complex64>> {
        let (degree, equations) = (self.degree, self.equations());
        let normal = self.normal()?;
        let error = |s: usize, i: usize| dot(&self.residual, i, &self.sensitivity, i * degree + s, equations) / self.scale[i];
        let mut step: Vec<Complex64> = (0..degree).map(|s| -(0..self.responders.len()).map(|i| error(s, i)).sum::<Complex64>()).collect();
        normal.whiten(&mut step);
        normal.unwhiten(&mut step);
        Some(step)
    }

    /// Σ J Jᴴ/σ², factored.
    fn normal(&self) -> Option<Cholesky<Complex64>> {
        let mut normal = Cholesky::new(self.degree);
        normal.factor(|s, l| (0..self.responders.len()).map(|i| self.inner(i, s, i, l) / self.scale[i]).sum()).then_some(normal)
    }

    /// J_is J_klᴴ.
    fn inner(&self, i: usize, s: usize, k: usize, l: usize) -> Complex64 {
        dot(&self.sensitivity, i * self.degree + s, &self.sensitivity, k * self.degree + l, self.equations())
    }

    /// The denominator of least output error, or none where it is not needed.
    fn seek(&mut self, low: usize, polynomial: f64) -> Vec<Complex64> {
        let none = vec![Complex64::default(); self.degree];
        let (mut best, mut best_cost) = (none.clone(), polynomial);
        let mut at = none.clone();
        for count in 0..STEPS {
            let equation_error = count < EQUATION_ERROR_STEPS;
            if count == EQUATION_ERROR_STEPS {
                if self.ratio(polynomial, best_cost) < HOPELESS * self.threshold {
                    break;
                }
                at.clone_from(&best);
                if self.regress(low, &at).is_none() {
                    break;
                }
            }
            self.differentiate(low, equation_error);
            let Some(step) = self.step() else { break };
            let before = best_cost;
            let mut share = 1.0;
            let mut moved = false;
            for _ in 0..=HALVINGS {
                let next: Vec<Complex64> = at.iter().zip(&step).map(|(d, s)| d + s * share).collect();
                if let Some(cost) = self.regress(low, &next) {
                    let better = cost < best_cost;
                    if better {
                        (best_cost, best) = (cost, next.clone());
                    }
                    if better || equation_error {
                        (at, moved) = (next, true);
                        break;
                    }
                }
                share *= 0.5;
            }
            if !moved || (!equation_error && before - best_cost < SETTLED * best_cost) {
                break;
            }
        }
        if self.ratio(polynomial, best_cost) > self.threshold { best } else { none }
    }

    /// Mean squares that the denominator explains over those that it leaves.
    fn ratio(&self, polynomial: f64, rational: f64) -> f64 {
        let left = self.freedom[0] * self.responders.len() as f64;
        (polynomial - rational) / self.degree as f64 / (rational / left)
    }

    /// Solves line `k` from the window that begins at line `low`.
    pub(super) fn solve(&mut self, k: usize, low: usize, out: &mut Chunk) {
        let (q, m, terms, width, equations, unknowns) =
            (self.drivers.len(), self.responders.len(), self.basis.terms, self.basis.width, self.equations(), self.unknowns());
        let none = vec![Complex64::default(); self.degree];
        self.scale.fill(1.0);
        if self.regress(low, &none).is_none() {
            return out.missing(m, q);
        }
        for i in 0..m {
            self.scale[i] = power(&self.residual[i * equations..(i + 1) * equations]).max(f64::MIN_POSITIVE);
        }
        // Drivers without leakage: their lowest regressor, whose polynomial is the constant 1/√width.
        let averages = (self.trials.len() * (width - terms)) as f64 / width as f64;
        let driver: Vec<Complex64> = places(q, q).map(|(l, j)| dot(&self.x, l * terms, &self.x, j * terms, equations) / averages).collect();
        let d = self.seek(low, m as f64);
        let rational = d.iter().any(|d| *d != Complex64::default());
        // The search left the workspace at its last trial.
        if self.regress(low, &d).is_none() {
            return out.missing(m, q);
        }
        let freedom = self.freedom[usize::from(!rational)];
        let noise: Vec<Complex64> = places(m, m).map(|(i, l)| dot(&self.residual, i, &self.residual, l, equations) / freedom).collect();

        let offset = k - low;
        let mut evaluation = vec![Complex64::default(); q * unknowns];
        for (j, row) in evaluation.chunks_exact_mut(unknowns).enumerate() {
            (0..terms).for_each(|s| row[j * terms + s] = (self.weight[offset] * self.basis.at(s, offset)).conj());
            self.factor.whiten(row);
        }
        let across = |b: &[Complex64], j: usize| -> Complex64 { b.iter().zip(&evaluation[j * unknowns..]).map(|(b, e)| b * e.conj()).sum() };
        let g: Vec<Complex64> = places(m, q).map(|(i, j)| across(&self.projection[i * unknowns..(i + 1) * unknowns], j)).collect();
        let mut gram: Vec<Complex64> = places(q, q).map(|(l, j)| across(&evaluation[l * unknowns..(l + 1) * unknowns], j)).collect();
        let (mut rows, mut columns) = (vec![1.0; m], vec![1.0; q]);
        if rational {
            self.differentiate(low, false);
            let extra = self.denominator_variance(&noise, &g, &evaluation, offset);
            (rows, columns) = factors(m, q, |i, j| 1.0 + extra[i * q + j] / (noise[i * m + i].re * gram[j * q + j].re));
        }
        for (i, l) in places(m, m) {
            next(&mut out.noise, 1).fill(noise[i * m + l] * (rows[i] * rows[l]).sqrt());
        }
        for (l, j) in places(q, q) {
            gram[l * q + j] *= (columns[l] * columns[j]).sqrt();
        }
        next(&mut out.driver, q * q).copy_from_slice(&driver);
        next(&mut out.gram_inverse, q * q).copy_from_slice(&gram);
        next(&mut out.g, m * q).copy_from_slice(&g);
    }

    /// What the error of d adds to the variance of each entry of G, m × q.
    ///
    /// Cov d = A⁻¹ B A⁻¹ with A = Σ_i J_i J_iᴴ/σ_i² and B the same sum with the noise between responders, since they are
    /// weighted as if independent and are not.
    fn denominator_variance(&self, noise: &[Complex64], g: &[Complex64], evaluation: &[Complex64], offset: usize) -> Vec<f64> {
        let (q, m, degree, unknowns) = (self.drivers.len(), self.responders.len(), self.degree, self.unknowns());
        let Some(normal) = self.normal() else { return vec![0.0; m * q] };
        let mut found = Vec::with_capacity(m * q);
        let mut slope = vec![Complex64::default(); degree];
        for (i, j) in places(m, q) {
            for (s, to) in slope.iter_mut().enumerate() {
                let absorbed = &self.absorbed[(i * degree + s) * unknowns..][..unknowns];
                let numerator: Complex64 = absorbed.iter().zip(&evaluation[j * unknowns..(j + 1) * unknowns]).map(|(b, e)| b * e.conj()).sum();
                *to = (numerator - self.weight[offset] * self.rho[offset].powi(s as i32 + 1) * g[i * q + j]).conj();
            }
            normal.whiten(&mut slope);
            normal.unwhiten(&mut slope);
            let mut variance = 0.0;
            for (k, h) in places(m, m) {
                let between: Complex64 = places(degree, degree).map(|(s, t)| slope[s].conj() * self.inner(h, t, k, s) * slope[t]).sum();
                variance += (between * noise[k * m + h]).re / (self.scale[k] * self.scale[h]);
            }
            found.push(variance.max(0.0));
        }
        found
    }
}

/// Row and column factors whose products come nearest to `entry` in the logarithm.
fn factors(rows: usize, columns: usize, entry: impl Fn(usize, usize) -> f64) -> (Vec<f64>, Vec<f64>) {
    let log = |i: usize, j: usize| entry(i, j).ln().clamp(0.0, 50.0);
    let row: Vec<f64> = (0..rows).map(|i| (0..columns).map(|j| log(i, j)).sum::<f64>() / columns as f64).collect();
    let mean = row.iter().sum::<f64>() / rows as f64;
    let column = (0..columns).map(|j| ((0..rows).map(|i| log(i, j)).sum::<f64>() / rows as f64 - mean).exp());
    (row.iter().map(|v| v.exp()).collect(), column.collect())
}

fn power(series: &[Complex64]) -> f64 {
    series.iter().map(|v| v.norm_sqr()).sum()
}

/// a_i b_jᴴ of rows of `length` numbers.
fn dot(a: &[Complex64], i: usize, b: &[Complex64], j: usize, length: usize) -> Complex64 {
    a[i * length..(i + 1) * length].iter().zip(&b[j * length..(j + 1) * length]).map(|(a, b)| a * b.conj()).sum()
}

/// Takes orthonormal rows out of one trial's stretch.
fn project_out(known: &[Complex64], series: &mut [Complex64]) {
    for row in known.chunks_exact(series.len()) {
        let dot: Complex64 = series.iter().zip(row).map(|(x, k)| x * k.conj()).sum();
        series.iter_mut().zip(row).for_each(|(x, k)| *x -= dot * k);
    }
}

/// Takes the rows of X out of `series`; `whitened` becomes series Xᴴ L⁻ᴴ.
fn take_out(factor: &Cholesky<Complex64>, x: &[Complex64], series: &mut [Complex64], whitened: &mut [Complex64], coefficients: &mut [Complex64]) {
    let length = series.len();
    whitened.iter_mut().enumerate().for_each(|(a, w)| *w = dot(series, 0, x, a, length));
    factor.whiten(whitened);
    coefficients.copy_from_slice(whitened);
    factor.unwhiten(coefficients);
    for (c, row) in coefficients.iter().zip(x.chunks_exact(length)) {
        series.iter_mut().zip(row).for_each(|(e, x)| *e -= c * x);
    }
}
