//! The algebra of the derived estimate, for several frequencies side by side.

use super::direct::LARGEST_CONDITION;
use super::equation_error::LeftOver;
use super::instrument::about;
use super::judged::{Judged, implied};
use crate::filling::{Filling, scatter, scatter_hermitian, scatter_real};
use crate::lanes::{LANES, LaneCholesky, Lanes, Reals, condition, dot_conj, each, entry, lower, map, power};
use crate::uncertainty::NAN;
use ndof_signal::vectorized;
use num_complex::Complex64;
use pulp::{Simd, WithSimd};

/// The arrays of a derived estimate while they are made.
pub(super) struct Results {
    pub(super) value: Filling<Complex64>,
    pub(super) noise: Filling<Complex64>,
    pub(super) input_inverse: Filling<Complex64>,
    pub(super) r: Filling<Complex64>,
    pub(super) t: Filling<Complex64>,
    /// Of outputs, then inputs.
    pub(super) unexplained: Filling<Complex64>,
    pub(super) reference_inverse: Filling<Complex64>,
    pub(super) judged: Judged,
    pub(super) singular_bins: Vec<usize>,
}

impl Results {
    pub(super) fn new(bins: usize, (p, q, qr): (usize, usize, usize)) -> Self {
        let complex = |rows: usize, columns: usize| Filling::new(bins, rows, columns, NAN);
        Results {
            value: complex(p, q),
            noise: complex(p, p),
            input_inverse: complex(q, q),
            r: complex(p, qr),
            t: complex(q, qr),
            unexplained: complex(p + q, p + q),
            reference_inverse: complex(qr, qr),
            judged: Judged::new(bins, p, q),
            singular_bins: Vec::new(),
        }
    }

    fn complex(&mut self) -> [&mut Filling<Complex64>; 7] {
        let Results { value, noise, input_inverse, r, t, unexplained, reference_inverse, .. } = self;
        [value, noise, input_inverse, r, t, unexplained, reference_inverse]
    }

    /// Frequencies that have no estimate by nature.
    pub(super) fn skip(&mut self, count: usize) {
        for array in self.complex() {
            array.batch(count);
        }
        self.judged.skip(count);
    }

    /// A frequency without an estimate.
    fn erase(&mut self, f: usize) {
        self.complex().into_iter().for_each(|array| array.erase(f));
        self.judged.erase(f);
        [&mut self.judged.output_coherence, &mut self.judged.input_coherence].into_iter().for_each(|array| array.erase(f));
        self.singular_bins.push(f);
    }
}

/// Workspace for some frequencies side by side. Channels stand in the order references, inputs, outputs; responders are
/// inputs, then outputs.
pub(super) struct Batch {
    p: usize,
    q: usize,
    qr: usize,
    freedom: f64,
    reference: LaneCholesky,
    caused: LaneCholesky,
    measured: LaneCholesky,
    reference_inverse: Vec<Lanes>,
    caused_inverse: Vec<Lanes>,
    measured_inverse: Vec<Lanes>,
    scratch: Vec<Lanes>,
    /// Responders by whitened references, (q + p) × q_r: S_zr L⁻ᴴ.
    white: Vec<Lanes>,
    /// What references explain of the responders, and what they do not; lower triangles.
    explained: Vec<Lanes>,
    sigma: Vec<Lanes>,
    /// C, p × q.
    c: Vec<Lanes>,
    /// The noise of the equation that was solved, a lower triangle.
    noise: Vec<Lanes>,
    row: Vec<Lanes>,
    square: [Vec<Lanes>; 2],
}

impl Batch {
    pub(super) fn new(p: usize, q: usize, qr: usize, freedom: f64) -> Self {
        let zeros = |n: usize| vec![Lanes::ZERO; n];
        let triangle = |n: usize| zeros(n * (n + 1) / 2);
        Batch {
            p,
            q,
            qr,
            freedom,
            reference: LaneCholesky::new(qr),
            caused: LaneCholesky::new(q),
            measured: LaneCholesky::new(q),
            reference_inverse: triangle(qr),
            caused_inverse: triangle(q),
            measured_inverse: triangle(q),
            scratch: triangle(qr),
            white: zeros((p + q) * qr),
            explained: triangle(p + q),
            sigma: triangle(p + q),
            c: zeros(p * q),
            noise: triangle(p),
            row: zeros(qr.max(q)),
            square: [zeros(q * q), zeros(q * q)],
        }
    }

    /// Appends the results of `count` frequencies whose spectra are `s`.
    pub(super) fn solve(&mut self, s: &[Lanes], count: usize, out: &mut Results) {
        vectorized(Solve { batch: self, s, count, out });
    }

    #[inline(always)]
    fn solve_lanes(&mut self, s: &[Lanes], count: usize, out: &mut Results) {
        let condition = self.explain(s, count, out);
        self.solve_outputs(s, count, out);
        self.judge_outputs(s, count, out);
        self.judge_instrument(&condition, count, out);
    }

    /// What the references do to inputs and outputs, R and T, and what they leave; the references' condition number.
    #[inline(always)]
    fn explain(&mut self, s: &[Lanes], count: usize, out: &mut Results) -> Reals {
        let (p, q, qr, m) = (self.p, self.q, self.qr, self.p + self.q);
        let share = [1.0 / self.freedom; LANES];
        let responder = |a: usize, b: usize| s[lower(qr + a, qr + b)];
        self.reference.factor(|i, j| s[lower(i, j)]);
        self.reference.inverse(&mut self.reference_inverse, &mut self.scratch);
        let condition = condition(qr, |i, j| s[lower(i, j)], &self.reference_inverse);
        scatter_hermitian(out.reference_inverse.batch(count), qr, |i, j| self.reference_inverse[lower(i, j)]);
        let (r, t) = (out.r.batch(count), out.t.batch(count));
        let (output_coherence, input_coherence) = (out.judged.output_coherence.batch(count), out.judged.input_coherence.batch(count));
        for a in 0..m {
            let row = &mut self.white[a * qr..(a + 1) * qr];
            row.iter_mut().enumerate().for_each(|(k, w)| *w = s[lower(qr + a, k)]);
            self.reference.whiten(row);
            self.row[..qr].copy_from_slice(row);
            self.reference.unwhiten(&mut self.row[..qr]);
            for (k, entry) in self.row[..qr].iter().enumerate() {
                if a < q { scatter(t, q * qr, a * qr + k, entry) } else { scatter(r, p * qr, (a - q) * qr + k, entry) }
            }
            for b in 0..=a {
                let (w, v) = (&self.white[a * qr..(a + 1) * qr], &self.white[b * qr..(b + 1) * qr]);
                let (explained, full) = (dot_conj(w, v), responder(a, b));
                let rest = if a == b {
                    Lanes { re: map(&full.re, &explained.re, |x, y| if x < y { 0.0 } else { x - y }), im: [0.0; LANES] }
                } else {
                    Lanes { re: map(&full.re, &explained.re, |x, y| x - y), im: map(&full.im, &explained.im, |x, y| x - y) }
                };
                self.explained[lower(a, b)] = explained;
                self.sigma[lower(a, b)] = rest;
            }
            let coherence = map(&self.explained[lower(a, a)].re, &responder(a, a).re, |x, y| if x > y { 1.0 } else { x / y });
            if a < q { scatter_real(input_coherence, q, a, &coherence) } else { scatter_real(output_coherence, p, a - q, &coherence) }
        }
        let place = |a: usize| if a < p { q + a } else { a - p };
        scatter_hermitian(out.unexplained.batch(count), m, |a, b| entry(&self.sigma, place(a), place(b)).scaled(&share));
        condition
    }

    /// C, and what its residual needs.
    #[inline(always)]
    fn solve_outputs(&mut self, s: &[Lanes], count: usize, out: &mut Results) {
        let (p, q, qr) = (self.p, self.q, self.qr);
        self.caused.factor(|i, j| self.explained[lower(i, j)]);
        self.caused.inverse(&mut self.caused_inverse, &mut self.scratch);
        self.measured.factor(|i, j| s[lower(qr + i, qr + j)]);
        self.measured.inverse(&mut self.measured_inverse, &mut self.scratch);
        scatter_hermitian(out.input_inverse.batch(count), q, |i, j| self.caused_inverse[lower(i, j)]);
        let value = out.value.batch(count);
        for i in 0..p {
            let row = &mut self.c[i * q..(i + 1) * q];
            row.iter_mut().enumerate().for_each(|(j, c)| *c = self.explained[lower(q + i, j)]);
            self.caused.whiten(row);
            self.caused.unwhiten(row);
            row.iter().enumerate().for_each(|(j, c)| scatter(value, p * q, i * q + j, c));
        }
    }

    /// Noise and coherences of the outputs.
    #[inline(always)]
    fn judge_outputs(&mut self, s: &[Lanes], count: usize, out: &mut Results) {
        let (p, q, qr) = (self.p, self.q, self.qr);
        let share = [1.0 / self.freedom; LANES];
        let responder = |a: usize, b: usize| s[lower(qr + a, qr + b)];
        let input = |i: usize, j: usize| s[lower(qr + i, qr + j)];
        // The residual holds what the error of C makes of the inputs that the references do not cause: tr((S^c)⁻¹ Σ_uu)/ν.
        let left_over = LeftOver { sigma: &self.sigma, outputs: q, inputs: 0 };
        left_over.noise(&self.c, q, &mut self.row[..q], &mut self.noise);
        let taken_in = left_over.taken_in(&self.caused_inverse, q);
        let share = map(&share, &taken_in, |share, taken| share / (1.0 + share * taken));
        scatter_hermitian(out.noise.batch(count), p, |i, k| self.noise[lower(i, k)].scaled(&share));
        let [[paper_ordinary, paper_partial, paper_multiple], [iv_ordinary, iv_partial, iv_multiple]] = out.judged.coherences(count);
        for i in 0..p {
            let own = &self.c[i * q..(i + 1) * q];
            let row = &mut self.row[..q];
            row.iter_mut().enumerate().for_each(|(j, w)| *w = s[lower(qr + q + i, qr + j)]);
            self.measured.whiten(row);
            let direct_noise = map(&responder(q + i, q + i).re, &power(row), |a, b| if a < b { 0.0 } else { a - b });
            for (j, entry) in row.iter_mut().enumerate() {
                *entry = (0..q).fold(Lanes::ZERO, |sum, l| if l >= j { sum.plus(&own[l], &input(l, j)) } else { sum.plus_conj(&own[l], &input(j, l)) });
            }
            implied((i, p), (own, row), |j| input(j, j).re, &self.measured_inverse, &direct_noise, [paper_ordinary, paper_partial, paper_multiple]);
            // C S^c is what the references explain of S_yu.
            row.iter_mut().enumerate().for_each(|(j, w)| *w = self.explained[lower(q + i, j)]);
            implied(
                (i, p),
                (own, row),
                |j| self.explained[lower(j, j)].re,
                &self.caused_inverse,
                &self.noise[lower(i, i)].re,
                [iv_ordinary, iv_partial, iv_multiple],
            );
        }
    }

    /// How far the instrument is to be trusted, and which frequencies have no estimate.
    #[inline(always)]
    fn judge_instrument(&mut self, condition: &Reals, count: usize, out: &mut Results) {
        let start = out.judged.weak_instrument.len();
        let strength = self.strength();
        for l in 0..count {
            out.judged.trust(strength[l]);
            let usable = condition[l] <= LARGEST_CONDITION && self.caused_inverse[0].re[l].is_finite() && self.measured_inverse[0].re[l].is_finite();
            if !usable {
                out.erase(start + l);
            }
        }
    }

    /// (n_e − q_r)/q_r times the smallest eigenvalue of N⁻¹ S^c, which is 1 over the largest of L⁻¹ N L⁻ᴴ with
    /// S^c = L Lᴴ; N itself may be singular.
    #[inline(always)]
    fn strength(&mut self) -> Reals {
        let (q, scale) = (self.q, self.freedom / self.qr as f64);
        if q == 1 {
            return map(&self.explained[0].re, &self.sigma[0].re, |caused, rest| scale * caused / rest);
        }
        let [half, full] = &mut self.square;
        about(&self.caused, q, |i, j| entry(&self.sigma, i, j), half, full);
        if q == 2 {
            let off = full[2].norm_sqr();
            return std::array::from_fn(|l| {
                let (a, b) = (full[0].re[l], full[3].re[l]);
                2.0 * scale / (a + b + ((a - b) * (a - b) + 4.0 * off[l]).sqrt())
            });
        }
        // ‖B v‖/‖v‖ after a dozen multiplications, in all lanes at once. Never above the eigenvalue, and within a few per
        // cent of it: enough for a number that is held against a rule of thumb.
        let (v, next) = half.split_at_mut(q);
        // A start that no symmetry of the channels makes orthogonal to the eigenvector.
        v.iter_mut().enumerate().for_each(|(j, v)| *v = Lanes { re: [1.0 / (1.0 + j as f64); LANES], im: [0.3 * j as f64; LANES] });
        let mut growth = [f64::NAN; LANES];
        for _ in 0..12 {
            for (row, n) in full.chunks_exact(q).zip(next.iter_mut()) {
                *n = row.iter().zip(v.iter()).fold(Lanes::ZERO, |sum, (b, v)| sum.plus(b, v));
            }
            growth = each(&power(&next[..q]), f64::sqrt);
            let shrink = each(&growth, f64::recip);
            v.iter_mut().zip(next.iter()).for_each(|(v, n)| *v = n.scaled(&shrink));
        }
        each(&growth, |largest| scale / largest)
    }
}

/// [`Batch::solve`] as a type, so that it is compiled for the vector unit at hand.
struct Solve<'a> {
    batch: &'a mut Batch,
    s: &'a [Lanes],
    count: usize,
    out: &'a mut Results,
}

impl WithSimd for Solve<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        self.batch.solve_lanes(self.s, self.count, self.out);
    }
}
