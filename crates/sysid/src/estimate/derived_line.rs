//! The derived estimate at several lines of a local fit side by side, and the arrays that it fills.

use super::equation_error::LeftOver;
use super::fitted::Fitted;
use super::instrument::about;
use super::judged::{Judged, implied};
use crate::filling::{Filling, scatter, scatter_hermitian, scatter_real};
use crate::lanes::{LANES, LaneCholesky, Lanes, Reals, dot_conj, each, entry, lanes, lower};
use crate::uncertainty::NAN;
use ndarray::Array3;
use ndof_linear::hermitian_eigen;
use ndof_signal::vectorized;
use num_complex::Complex64;
use pulp::{Simd, WithSimd};
use std::ops::Range;

/// The arrays of a derived estimate while they are made.
pub(super) struct Found {
    pub(super) value: Filling<Complex64>,
    pub(super) noise: Filling<Complex64>,
    pub(super) input_inverse: Filling<Complex64>,
    /// Of no line where only the response is asked for.
    pub(super) judged: Judged,
    /// Lines at which references or inputs depend on each other.
    pub(super) missing: Vec<usize>,
}

impl Found {
    /// Nothing yet, of so many lines, outputs and inputs.
    fn new(bins: usize, p: usize, q: usize, judged: bool) -> Self {
        let complex = |rows: usize, columns: usize| Filling::new(bins, rows, columns, NAN);
        let judged = Judged::new(if judged { bins } else { 0 }, p, q);
        Found { value: complex(p, q), noise: complex(p, p), input_inverse: complex(q, q), judged, missing: Vec::new() }
    }

    /// What is found of lines that follow.
    pub(super) fn append(&mut self, other: Found) {
        self.value.append(other.value);
        self.noise.append(other.noise);
        self.input_inverse.append(other.input_inverse);
        self.missing.extend(other.missing);
        self.judged.append(other.judged);
    }

    /// The `k`th line has no estimate; what the references do to its channels stays.
    fn erase(&mut self, k: usize) {
        [&mut self.value, &mut self.noise, &mut self.input_inverse].into_iter().for_each(|array| array.erase(k));
        self.judged.erase(k);
    }
}

/// Workspace for [`LANES`] lines side by side: responders are `p` outputs, then `q` inputs, drivers `qr` references.
pub(super) struct DerivedLines<'a> {
    fit: &'a Fitted,
    /// The fit of outputs on inputs, by whose noise and inputs the estimate is judged; unless only the response is asked for.
    direct: Option<&'a Fitted>,
    p: usize,
    q: usize,
    qr: usize,
    gram: LaneCholesky,
    information: LaneCholesky,
    caused: LaneCholesky,
    measured: LaneCholesky,
    /// Responders over references.
    g: Vec<Lanes>,
    /// The same whitened: rows a, b make what the references tell of them, g_a W g_bᴴ.
    white: Vec<Lanes>,
    /// Σ, what the references leave of the responders; like all that is Hermitian here a lower triangle.
    sigma: Vec<Lanes>,
    /// The inverse of the information on the inputs.
    inverse: Vec<Lanes>,
    caused_inverse: Vec<Lanes>,
    measured_inverse: Vec<Lanes>,
    triangle: Vec<Lanes>,
    scratch: Vec<Lanes>,
    c: Vec<Lanes>,
    row: Vec<Lanes>,
    /// The noise of the equation that was solved.
    noise: Vec<Lanes>,
    square: [Vec<Lanes>; 2],
}

impl<'a> DerivedLines<'a> {
    pub(super) fn new(fit: &'a Fitted, direct: Option<&'a Fitted>, p: usize) -> Self {
        let (_, m, qr) = fit.g.dim();
        let q = m - p;
        let zeros = |n: usize| vec![Lanes::ZERO; n];
        let triangle = |n: usize| zeros(lower(n, 0));
        DerivedLines {
            fit,
            direct,
            p,
            q,
            qr,
            gram: LaneCholesky::new(qr),
            information: LaneCholesky::new(q),
            caused: LaneCholesky::new(q),
            measured: LaneCholesky::new(q),
            g: zeros(m * qr),
            white: zeros(m * qr),
            sigma: triangle(m),
            inverse: triangle(q),
            caused_inverse: triangle(q),
            measured_inverse: triangle(q),
            triangle: triangle(q.max(qr)),
            scratch: triangle(q),
            c: zeros(p * q),
            row: zeros(q),
            noise: triangle(p),
            square: [zeros(q * q.max(qr)), zeros(q * q)],
        }
    }

    /// Everything at these lines.
    pub(super) fn solve(&mut self, lines: Range<usize>) -> Found {
        let mut out = Found::new(lines.len(), self.p, self.q, self.direct.is_some());
        for first in lines.clone().step_by(LANES) {
            let count = LANES.min(lines.end - first);
            let sound = vectorized(Solve { lines: self, first, count, out: &mut out });
            for l in (0..count).filter(|&l| !sound[l]) {
                out.erase(first - lines.start + l);
                out.missing.extend((self.fit.frequency_hz[first + l] != 0.0).then_some(first + l));
            }
        }
        out
    }

    /// Whether there is an estimate, a lane each.
    #[inline(always)]
    fn solve_lanes(&mut self, first: usize, count: usize, out: &mut Found) -> [bool; LANES] {
        self.load(first, count);
        self.invert(count, out);
        let left_over = LeftOver { sigma: &self.sigma, outputs: 0, inputs: self.p };
        left_over.noise(&self.c, self.q, &mut self.row, &mut self.noise);
        let taken_in = left_over.taken_in(&self.inverse, self.q);
        let mut decisive = [self.g[0].re, self.inverse[0].re, [0.0; LANES], [0.0; LANES]];
        if let Some(direct) = self.direct {
            self.tell_caused(first, count, &mut out.judged);
            self.tell_coherence(direct, first, count, &mut out.judged);
            self.judge_instrument(count, &mut out.judged);
            (decisive[2], decisive[3]) = (self.caused_inverse[0].re, self.measured_inverse[0].re);
        }
        // The error of C takes in what the references do not cause of the inputs.
        let share = each(&taken_in, |taken| 1.0 / (1.0 + taken));
        scatter_hermitian(out.noise.batch(count), self.p, |i, k| self.noise[lower(i, k)].scaled(&share));
        let at_rest = |l: usize| self.fit.frequency_hz[first + l.min(count - 1)] == 0.0;
        std::array::from_fn(|l| !at_rest(l) && decisive.iter().all(|of| of[l].is_finite()))
    }

    /// Responders over references as they are and whitened, P = L Lᴴ and g L⁻ᴴ with W = P⁻¹, and Σ.
    #[inline(always)]
    fn load(&mut self, first: usize, count: usize) {
        let (fit, qr, m) = (self.fit, self.qr, self.p + self.q);
        self.gram.factor(|i, j| gather(&fit.gram_inverse, first, count, i, j));
        for a in 0..m {
            for k in 0..qr {
                self.g[a * qr + k] = gather(&fit.g, first, count, a, k);
            }
            let white = &mut self.white[a * qr..(a + 1) * qr];
            white.copy_from_slice(&self.g[a * qr..(a + 1) * qr]);
            self.gram.whiten(white);
        }
        gather_triangle(&fit.noise, m, first, count, &mut self.sigma);
    }

    /// What the references tell of responders a and b.
    #[inline(always)]
    fn told(&self, a: usize, b: usize) -> Lanes {
        dot_conj(row(&self.white, a, self.qr), row(&self.white, b, self.qr))
    }

    /// C and the inverse of the information on the inputs.
    #[inline(always)]
    fn invert(&mut self, count: usize, out: &mut Found) {
        let (p, q) = (self.p, self.q);
        for i in 0..q {
            for j in 0..=i {
                self.triangle[lower(i, j)] = self.told(p + i, p + j);
            }
        }
        self.information.factor(|i, j| self.triangle[lower(i, j)]);
        self.information.inverse(&mut self.inverse, &mut self.scratch);
        scatter_hermitian(out.input_inverse.batch(count), q, |i, j| self.inverse[lower(i, j)]);
        let value = out.value.batch(count);
        for i in 0..p {
            for j in 0..q {
                self.c[i * q + j] = self.told(i, p + j);
            }
            let own = &mut self.c[i * q..(i + 1) * q];
            self.information.whiten(own);
            self.information.unwhiten(own);
            for (j, c) in own.iter().enumerate() {
                scatter(value, p * q, i * q + j, c);
            }
        }
    }

    /// What the references cause of the inputs, g S gᴴ with S their density, and their coherence with each responder.
    #[inline(always)]
    fn tell_caused(&mut self, first: usize, count: usize, judged: &mut Judged) {
        let (fit, p, q, qr) = (self.fit, self.p, self.q, self.qr);
        gather_triangle(&fit.driver, qr, first, count, &mut self.triangle);
        // A row for each input; the first serves the outputs before.
        let [driven, _] = &mut self.square;
        let shares = [judged.output_coherence.batch(count), judged.input_coherence.batch(count)];
        for a in 0..p + q {
            let g = row(&self.g, a, qr);
            let driven = &mut driven[a.saturating_sub(p) * qr..][..qr];
            for (l, to) in driven.iter_mut().enumerate() {
                *to = Lanes::ZERO;
                for (k, g) in g.iter().enumerate() {
                    *to = to.plus(g, &entry(&self.triangle, k, l));
                }
            }
            let (power, noise, known) = (dot_conj(driven, g).re, &self.sigma[lower(a, a)].re, &self.white[qr - 1].re);
            let share = lanes(|k| if known[k].is_finite() { power[k] / (power[k] + noise[k]) } else { f64::NAN });
            if a < p { scatter_real(shares[0], p, a, &share) } else { scatter_real(shares[1], q, a - p, &share) }
        }
        for i in 0..q {
            for j in 0..=i {
                self.triangle[lower(i, j)] = dot_conj(row(driven, i, qr), row(&self.g, p + j, qr));
            }
        }
        self.caused.factor(|i, j| self.triangle[lower(i, j)]);
        self.caused.inverse(&mut self.caused_inverse, &mut self.scratch);
    }

    /// Coherences by the inputs as they were measured with the noise of the direct fit, and by what the references cause of them.
    #[inline(always)]
    fn tell_coherence(&mut self, direct: &Fitted, first: usize, count: usize, judged: &mut Judged) {
        let (p, q) = (self.p, self.q);
        let [input, cross] = &mut self.square;
        gather_triangle(&direct.driver, q, first, count, input);
        self.measured.factor(|i, j| input[lower(i, j)]);
        self.measured.inverse(&mut self.measured_inverse, &mut self.scratch);
        let [paper, iv] = judged.coherences(count);
        let direct_noise = |i: usize| gather(&direct.noise, first, count, i, i).re;
        coherence(&self.c, (p, q), (input, &self.measured_inverse), direct_noise, cross, paper);
        coherence(&self.c, (p, q), (&self.triangle, &self.caused_inverse), |i| self.noise[lower(i, i)].re, cross, iv);
    }

    /// How strong the references are.
    #[inline(always)]
    fn judge_instrument(&mut self, count: usize, judged: &mut Judged) {
        let (p, q) = (self.p, self.q);
        let [half, full] = &mut self.square;
        about(&self.information, q, |i, j| entry(&self.sigma, p + i, p + j), &mut half[..q * q], full);
        let (mut matrix, mut values) = (vec![Complex64::default(); q * q], vec![0.0; q]);
        for l in 0..count {
            matrix.iter_mut().zip(&*full).for_each(|(to, from)| *to = Complex64::new(from.re[l], from.im[l]));
            hermitian_eigen(&mut matrix, &mut values, None);
            let strength = 1.0 / (self.qr as f64 * values.iter().fold(0.0_f64, |a, &b| a.max(b)));
            judged.trust(strength);
        }
    }
}

/// Coherences of the response C with inputs of such a spectrum and its inverse, and such noise of each output.
#[inline(always)]
fn coherence(
    c: &[Lanes],
    (p, q): (usize, usize),
    (input, inverse): (&[Lanes], &[Lanes]),
    noise: impl Fn(usize) -> Reals,
    cross: &mut [Lanes],
    [ordinary, partial, multiple]: [&mut [f64]; 3],
) {
    for i in 0..p {
        let own = row(c, i, q);
        for (j, to) in cross[..q].iter_mut().enumerate() {
            *to = Lanes::ZERO;
            for (l, c) in own.iter().enumerate() {
                *to = to.plus(c, &entry(input, l, j));
            }
        }
        implied((i, p), (own, &cross[..q]), |j| input[lower(j, j)].re, inverse, &noise(i), [&mut *ordinary, &mut *partial, &mut *multiple]);
    }
}

/// Row `a` of a matrix of so many columns.
#[inline(always)]
fn row(rows: &[Lanes], a: usize, columns: usize) -> &[Lanes] {
    &rows[a * columns..(a + 1) * columns]
}

/// Entry (i, j) at `count` lines from `first` on, of the last of them beyond.
#[inline(always)]
fn gather(from: &Array3<Complex64>, first: usize, count: usize, i: usize, j: usize) -> Lanes {
    let mut to = Lanes::ZERO;
    for l in 0..LANES {
        let v = from[[first + l.min(count - 1), i, j]];
        (to.re[l], to.im[l]) = (v.re, v.im);
    }
    to
}

/// The lower triangle of `n` rows of the same.
#[inline(always)]
fn gather_triangle(from: &Array3<Complex64>, n: usize, first: usize, count: usize, to: &mut [Lanes]) {
    for i in 0..n {
        for j in 0..=i {
            to[lower(i, j)] = gather(from, first, count, i, j);
        }
    }
}

/// [`DerivedLines::solve_lanes`] as a type, so that it is compiled for the vector unit at hand.
struct Solve<'a, 'b> {
    lines: &'a mut DerivedLines<'b>,
    first: usize,
    count: usize,
    out: &'a mut Found,
}

impl WithSimd for Solve<'_, '_> {
    type Output = [bool; LANES];

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> [bool; LANES] {
        self.lines.solve_lanes(self.first, self.count, self.out)
    }
}

#[cfg(test)]
mod tests {
    use super::super::instrument::WEAK_INSTRUMENT;
    use super::*;
    use ndarray::{Array2, ArrayView2, Axis, Slice, concatenate};
    use ndof_linear::inverse;

    const BINS: usize = 11;

    fn number(k: usize) -> Complex64 {
        Complex64::new((1.7 * k as f64).sin(), (2.3 * k as f64 + 1.0).cos())
    }

    /// A Aᴴ and something on its diagonal.
    fn positive(n: usize, seed: usize) -> Array3<Complex64> {
        let mut out = Array3::zeros((BINS, n, n));
        for (f, mut of_line) in out.axis_iter_mut(Axis(0)).enumerate() {
            let a = Array2::from_shape_fn((n, n), |(i, j)| number(seed + 31 * f + n * i + j));
            of_line.assign(&(a.dot(&a.t().mapv(|v| v.conj())) + Array2::from_diag_elem(n, Complex64::from(0.5))));
        }
        out
    }

    fn fit(m: usize, q: usize, seed: usize) -> Fitted {
        Fitted {
            frequency_hz: (0..BINS).map(|f| f as f64).collect(),
            g: Array3::from_shape_fn((BINS, m, q), |(f, i, j)| number(seed + 100 + 50 * f + q * i + j) + if i % q == j { 2.0 } else { 0.0 }),
            noise: positive(m, seed + 1),
            gram_inverse: positive(q, seed + 2),
            driver: positive(q, seed + 3),
            degrees_of_freedom: 9.0,
            independent_spacing_hz: 1.0,
        }
    }

    /// Two outputs, three inputs and four references; a line at rest, two whose references depend on each other, and one whose measured inputs do,
    /// which only a judge misses. Lines are solved in two parts, as many tasks solve them.
    #[test]
    fn each_line_is_what_its_equations_say() {
        let (p, q, qr) = (2, 3, 4);
        let (mut joint, mut direct) = (fit(p + q, qr, 0), fit(p, q, 900));
        [5, 9].into_iter().for_each(|f| joint.gram_inverse.index_axis_mut(Axis(0), f).fill(Complex64::ONE));
        direct.driver.index_axis_mut(Axis(0), 10).fill(Complex64::ONE);
        let solve = |direct: Option<&Fitted>| {
            let mut found = DerivedLines::new(&joint, direct, p).solve(0..8);
            found.append(DerivedLines::new(&joint, direct, p).solve(8..BINS));
            found
        };
        let (found, alone) = (solve(Some(&direct)), solve(None));
        assert_eq!((&found.missing, &alone.missing), (&vec![5, 9, 10], &vec![5, 9]));
        let Found { value, noise, input_inverse, judged, .. } = found;
        let arrays = [value, noise, input_inverse].map(Filling::finish);
        let bare = [alone.value, alone.noise, alone.input_inverse].map(Filling::finish);
        for (with, without) in arrays.iter().zip(&bare) {
            assert!(with.outer_iter().zip(without.outer_iter()).enumerate().all(|(f, (a, b))| f == 10 || a == b || a.iter().chain(b).all(|v| v.is_nan())));
        }
        let [paper, iv] = [judged.paper, judged.iv].map(|all| all.map(Filling::finish));
        let shares = [judged.output_coherence, judged.input_coherence].map(Filling::finish);
        let adjoint = |a: &Array2<Complex64>| a.t().mapv(|v| v.conj());
        let product = |a: ArrayView2<Complex64>, b: &Array2<Complex64>| a.dot(b).dot(&adjoint(&a.to_owned()));
        for f in 0..BINS {
            if [0, 5, 9, 10].contains(&f) {
                assert!(arrays.iter().all(|array| array.index_axis(Axis(0), f).iter().all(|v| v.is_nan())) && paper[0][[f, 1, 2]].is_nan());
                assert!(judged.instrument_strength[f].is_nan() && !judged.weak_instrument[f]);
                assert!(shares.iter().all(|share| share[[f, 0, 0]].is_nan() == [5, 9].contains(&f)));
                continue;
            }
            let at = |a: &Array3<Complex64>| a.index_axis(Axis(0), f).to_owned();
            let (g, sigma, s) = (at(&joint.g), at(&joint.noise), at(&joint.driver));
            let (r, t) = (g.slice_axis(Axis(0), Slice::from(..p)), g.slice_axis(Axis(0), Slice::from(p..)));
            let w = inverse(&at(&joint.gram_inverse)).expect("regular");
            // C = R W Tᴴ (T W Tᴴ)⁻¹.
            let information = inverse(&product(t, &w)).expect("regular");
            let c = r.dot(&w).dot(&adjoint(&t.to_owned())).dot(&information);
            // A Σ Aᴴ / (1 + tr((T W Tᴴ)⁻¹ Σ_uu)) with A = [1, −C].
            let a = concatenate(Axis(1), &[Array2::eye(p).view(), c.mapv(|v| -v).view()]).expect("rows alike");
            let of_inputs = sigma.slice_axis(Axis(0), Slice::from(p..)).slice_axis(Axis(1), Slice::from(p..)).to_owned();
            let taken_in = information.dot(&of_inputs).diag().sum().re;
            let equation = product(a.view(), &sigma);
            let near =
                |found: Complex64, want: Complex64, what: &str| assert!((found - want).norm() < 1e-11 * (1.0 + want.norm()), "{f} {what}: {found} {want}");
            let caused = product(t, &s);
            let all = product(g.view(), &s);
            for i in 0..p {
                for j in 0..q {
                    near(arrays[0][[f, i, j]], c[[i, j]], "C");
                }
                (0..p).for_each(|k| near(arrays[1][[f, i, k]], equation[[i, k]] / (1.0 + taken_in), "noise"));
                for (found, input, noise) in [(&paper, at(&direct.driver), direct.noise[[f, i, i]].re), (&iv, caused.clone(), equation[[i, i]].re)] {
                    let (back, explained) = (inverse(&input).expect("regular"), product(c.view(), &input)[[i, i]].re);
                    near(found[2][[f, 0, i]].into(), (explained / (explained + noise)).into(), "multiple");
                    for j in 0..q {
                        let (cross, alone) = (c.dot(&input)[[i, j]].norm_sqr(), c[[i, j]].norm_sqr() / back[[j, j]].re);
                        near(found[0][[f, i, j]].into(), (cross / input[[j, j]].re / (explained + noise)).into(), "ordinary");
                        near(found[1][[f, i, j]].into(), (alone / (alone + noise)).into(), "partial");
                    }
                }
            }
            for e in 0..q * q {
                near(arrays[2][[f, e / q, e % q]], information[[e / q, e % q]], "input inverse");
            }
            for k in 0..p + q {
                let share = all[[k, k]].re / (all[[k, k]].re + sigma[[k, k]].re);
                near((if k < p { shares[0][[f, 0, k]] } else { shares[1][[f, 0, k - p]] }).into(), share.into(), "share");
            }
            // The largest λ of (T W Tᴴ)⁻¹ Σ_uu by repeated squares: M^n turns into λ^n.
            let mut power = information.dot(&of_inputs);
            let mut logarithm = 0.0;
            for k in 0..40 {
                let size = power.diag().sum().norm();
                logarithm += size.ln() / 2.0_f64.powi(k);
                power = power.mapv(|v| v / size);
                power = power.dot(&power);
            }
            near(judged.instrument_strength[f].into(), (1.0 / (qr as f64 * logarithm.exp())).into(), "strength");
            assert_eq!(judged.weak_instrument[f], judged.instrument_strength[f] < WEAK_INSTRUMENT);
            // No input alone is moved less than the weakest mixture of them: xᴴ T W Tᴴ x ≥ λ xᴴ Σ_uu x of every x.
            let told = product(t, &w);
            assert!((0..q).all(|j| told[[j, j]].re / of_inputs[[j, j]].re >= judged.instrument_strength[f] * qr as f64));
        }
    }
}
