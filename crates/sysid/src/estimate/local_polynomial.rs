//! The local polynomial method: response and leakage as smooth functions of frequency around each line.

use super::local_lines::{Basis, Chunk, Lines, next};
use crate::filling::{scatter, scatter_hermitian};
use crate::lanes::{LANES, LaneCholesky, Lanes, dot_conj, hermitian_products, lanes, lower, map, power};
use pulp::{Arch, Simd, WithSimd};
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

/// Workspace for [`LANES`] lines side by side.
pub(super) struct Local<'a> {
    trials: &'a [Lines],
    drivers: &'a [usize],
    responders: &'a [usize],
    basis: &'a Basis,
    degrees_of_freedom: f64,
    /// Whether lines are also predicted from their neighbours alone.
    judged: bool,
    /// Where each lane's window begins, and the line in it.
    low: [usize; LANES],
    offset: [usize; LANES],
    window: Vec<Lanes>,
    /// Regressors X (unknowns × equations) and below them responders Y (m × equations), equations being the lines of the window of each trial in
    /// turn, all without the leakage polynomial.
    series: Vec<Lanes>,
    /// The lower triangle of their products: rows of X Xᴴ, then of Y Xᴴ, whitened by the factor of X Xᴴ, each with its part of Y Yᴴ behind it.
    products: Vec<Lanes>,
    factor: LaneCholesky,
    /// What drivers leave of the responders, a lower triangle.
    rest: Vec<Lanes>,
    row: Vec<Lanes>,
    evaluation: Vec<Lanes>,
}

impl<'a> Local<'a> {
    pub(super) fn new(trials: &'a [Lines], (drivers, responders): (&'a [usize], &'a [usize]), basis: &'a Basis, degrees_of_freedom: f64, judged: bool) -> Self {
        let (unknowns, equations, m) = (drivers.len() * basis.terms, trials.len() * basis.width, responders.len());
        let zeros = |n: usize| vec![Lanes::ZERO; n];
        Local {
            trials,
            drivers,
            responders,
            basis,
            degrees_of_freedom,
            judged,
            low: [0; LANES],
            offset: [0; LANES],
            window: zeros(basis.width),
            series: zeros((unknowns + m) * equations),
            products: zeros(lower(unknowns + m, 0)),
            factor: LaneCholesky::new(unknowns),
            rest: zeros(m * (m + 1) / 2),
            row: zeros(unknowns),
            evaluation: zeros(drivers.len() * unknowns),
        }
    }

    /// Appends what is found at these lines.
    pub(super) fn solve(&mut self, lines: &[usize], out: &mut Chunk<'_>) {
        for batch in lines.chunks(LANES) {
            // Lanes that are not asked for repeat the last line.
            for l in 0..LANES {
                let k = batch[l.min(batch.len() - 1)];
                self.low[l] = self.basis.low(k);
                self.offset[l] = k - self.low[l];
            }
            Arch::new().dispatch(Solve { local: self, count: batch.len(), out });
        }
    }

    fn unknowns(&self) -> usize {
        self.drivers.len() * self.basis.terms
    }

    fn equations(&self) -> usize {
        self.trials.len() * self.basis.width
    }

    /// Responder i on regressors, whitened.
    fn projection(&self, i: usize) -> &[Lanes] {
        let unknowns = self.unknowns();
        &self.products[lower(unknowns + i, 0)..][..unknowns]
    }

    /// Y Yᴴ of two responders, l ≤ i.
    fn full(&self, i: usize, l: usize) -> &Lanes {
        &self.products[lower(self.unknowns() + i, self.unknowns() + l)]
    }

    #[inline(always)]
    fn solve_lanes<S: Simd>(&mut self, simd: S, count: usize, out: &mut Chunk<'_>) {
        self.load(simd);
        self.regress(simd);
        self.write_noise(count, out);
        self.write_response(count, out);
        if self.judged {
            self.write_left_out(count, out);
        }
    }

    /// X and Y.
    #[inline(always)]
    fn load<S: Simd>(&mut self, simd: S) {
        let (terms, width, unknowns, equations) = (self.basis.terms, self.basis.width, self.unknowns(), self.equations());
        for (t, trial) in self.trials.iter().enumerate() {
            for (j, &channel) in self.drivers.iter().enumerate() {
                trial.windows(channel, &self.low, &mut self.window);
                for s in 0..terms {
                    let series = &mut self.series[(j * terms + s) * equations + t * width..][..width];
                    for (r, (x, u)) in series.iter_mut().zip(&self.window).enumerate() {
                        *x = u.scaled(&[self.basis.at(s, r); LANES]);
                    }
                    self.basis.project_out_lanes(simd, series);
                }
            }
            for (i, &channel) in self.responders.iter().enumerate() {
                let series = &mut self.series[(unknowns + i) * equations + t * width..][..width];
                trial.windows(channel, &self.low, series);
                self.basis.project_out_lanes(simd, series);
            }
        }
    }

    /// The coefficients, whitened, and the rows that evaluate each driver's polynomial at the line.
    #[inline(always)]
    fn regress<S: Simd>(&mut self, simd: S) {
        let (terms, unknowns) = (self.basis.terms, self.unknowns());
        hermitian_products(simd, &self.series, self.equations(), &mut self.products);
        self.factor.factor(|i, j| self.products[lower(i, j)]);
        for i in 0..self.responders.len() {
            self.factor.whiten(&mut self.products[lower(unknowns + i, 0)..][..unknowns]);
        }
        for (j, row) in self.evaluation.chunks_exact_mut(unknowns).enumerate() {
            row.fill(Lanes::ZERO);
            for s in 0..terms {
                row[j * terms + s].re = lanes(|l| self.basis.at(s, self.offset[l]));
            }
            self.factor.whiten(row);
        }
    }

    /// What drivers do not explain of the responders.
    #[inline(always)]
    fn write_noise(&mut self, count: usize, out: &mut Chunk<'_>) {
        let m = self.responders.len();
        let share = [1.0 / self.degrees_of_freedom; LANES];
        for i in 0..m {
            for l in 0..=i {
                let (explained, full) = (dot_conj(self.projection(i), self.projection(l)), self.full(i, l));
                let rest = if i == l {
                    // Round-off below nought is nought; what is not a number stays none.
                    Lanes { re: map(&full.re, &explained.re, |a, b| if a < b { 0.0 } else { a - b }), im: [0.0; LANES] }
                } else {
                    Lanes { re: map(&full.re, &explained.re, |a, b| a - b), im: map(&full.im, &explained.im, |a, b| a - b) }
                };
                self.rest[lower(i, l)] = rest.scaled(&share);
            }
        }
        scatter_hermitian(next(&mut out.noise, count * m * m), m, |i, l| self.rest[lower(i, l)]);
    }

    /// The response, its spread and the drivers.
    #[inline(always)]
    fn write_response(&mut self, count: usize, out: &mut Chunk<'_>) {
        let (q, m, terms, unknowns) = (self.drivers.len(), self.responders.len(), self.basis.terms, self.unknowns());
        let at = |j: usize| &self.evaluation[j * unknowns..(j + 1) * unknowns];
        let to = next(&mut out.g, count * m * q);
        for i in 0..m {
            for j in 0..q {
                scatter(to, m * q, i * q + j, &dot_conj(self.projection(i), at(j)));
            }
        }
        scatter_hermitian(next(&mut out.gram_inverse, count * q * q), q, |l, j| dot_conj(at(l), at(j)));
        // Drivers without leakage: their lowest regressor, whose polynomial is the constant 1/√width. None where there is no response.
        let averages = (self.trials.len() * (self.basis.width - terms)) as f64 / self.basis.width as f64;
        let known = lanes(|l| if self.evaluation[q * unknowns - 1].re[l].is_nan() { f64::NAN } else { 1.0 / averages });
        scatter_hermitian(next(&mut out.driver, count * q * q), q, |l, j| self.products[lower(l * terms, j * terms)].scaled(&known));
    }

    /// Σ_i |e_i|²/(1 − h)² / S_ii of the line itself, the fit being that with it.
    #[inline(always)]
    fn write_left_out(&mut self, count: usize, out: &mut Chunk<'_>) {
        let (terms, width, unknowns, equations) = (self.basis.terms, self.basis.width, self.unknowns(), self.equations());
        let leakage = lanes(|l| (0..terms).map(|s| self.basis.at(s, self.offset[l]).powi(2)).sum());
        let mut left_out = [0.0; LANES];
        for t in 0..self.trials.len() {
            let own = |series: &[Lanes]| {
                let at = &series[t * width..(t + 1) * width];
                Lanes { re: lanes(|l| at[self.offset[l]].re[l]), im: lanes(|l| at[self.offset[l]].im[l]) }
            };
            for (to, x) in self.row.iter_mut().zip(self.series.chunks_exact(equations)) {
                *to = own(x).conj();
            }
            self.factor.whiten(&mut self.row);
            let leverage = map(&leakage, &power(&self.row[..unknowns]), |a, b| a + b);
            for (i, y) in self.series.chunks_exact(equations).skip(unknowns).enumerate() {
                let (fitted, y) = (dot_conj(self.projection(i), &self.row), own(y));
                for (l, sum) in left_out.iter_mut().enumerate() {
                    let error = ((y.re[l] - fitted.re[l]).powi(2) + (y.im[l] - fitted.im[l]).powi(2)) / (1.0 - leverage[l]).powi(2);
                    *sum += error * equations as f64 / self.full(i, i).re[l].max(f64::MIN_POSITIVE);
                }
            }
        }
        next(&mut out.left_out, count).copy_from_slice(&left_out[..count]);
    }
}

/// All of it is compiled for the processor's vectors.
struct Solve<'a, 'b, 'c> {
    local: &'a mut Local<'c>,
    count: usize,
    out: &'a mut Chunk<'b>,
}

impl WithSimd for Solve<'_, '_, '_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        self.local.solve_lanes(simd, self.count, self.out);
    }
}
