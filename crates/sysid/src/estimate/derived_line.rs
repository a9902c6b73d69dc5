//! The derived estimate at one line of a local fit, and the arrays that it fills.

use super::coherence::{Coherence, imply};
use super::fitted::Fitted;
use super::instrument::{WEAK_INSTRUMENT, largest_ratio};
use ndarray::{Array, Array2, Array3, Axis, Dimension, Slice};
use ndof_linear::Cholesky;
use num_complex::Complex64;
use std::ops::Range;

const NAN: Complex64 = Complex64::new(f64::NAN, f64::NAN);

/// The arrays of a derived estimate while they are made, from line `first` on.
pub(super) struct Found {
    first: usize,
    pub(super) value: Array3<Complex64>,
    pub(super) noise: Array3<Complex64>,
    pub(super) input_inverse: Array3<Complex64>,
    pub(super) paper: Coherence,
    pub(super) iv: Coherence,
    pub(super) output_coherence: Array2<f64>,
    pub(super) input_coherence: Array2<f64>,
    pub(super) instrument_strength: Vec<f64>,
    pub(super) weak_instrument: Vec<bool>,
}

impl Found {
    /// Nothing yet, for `p` of the responders being outputs.
    pub(super) fn new(lines: Range<usize>, (_, m, _): (usize, usize, usize), p: usize) -> Self {
        let (q, bins) = (m - p, lines.len());
        let complex = |rows: usize, columns: usize| Array3::from_elem((bins, rows, columns), NAN);
        Found {
            first: lines.start,
            value: complex(p, q),
            noise: complex(p, p),
            input_inverse: complex(q, q),
            paper: Coherence::nan(bins, p, q),
            iv: Coherence::nan(bins, p, q),
            output_coherence: Array2::from_elem((bins, p), f64::NAN),
            input_coherence: Array2::from_elem((bins, q), f64::NAN),
            instrument_strength: vec![f64::NAN; bins],
            weak_instrument: vec![false; bins],
        }
    }

    /// Takes over what was found of a stretch of its lines.
    pub(super) fn put(&mut self, part: &Found) {
        let lines = part.first..part.first + part.weak_instrument.len();
        put(&mut self.value, &part.value, &lines);
        put(&mut self.noise, &part.noise, &lines);
        put(&mut self.input_inverse, &part.input_inverse, &lines);
        for (all, own) in [(&mut self.paper, &part.paper), (&mut self.iv, &part.iv)] {
            put(&mut all.ordinary, &own.ordinary, &lines);
            put(&mut all.partial, &own.partial, &lines);
            put(&mut all.multiple, &own.multiple, &lines);
        }
        put(&mut self.output_coherence, &part.output_coherence, &lines);
        put(&mut self.input_coherence, &part.input_coherence, &lines);
        self.instrument_strength[lines.clone()].copy_from_slice(&part.instrument_strength);
        self.weak_instrument[lines].copy_from_slice(&part.weak_instrument);
    }
}

/// Writes these lines of an array.
fn put<T: Clone, D: Dimension>(all: &mut Array<T, D>, own: &Array<T, D>, lines: &Range<usize>) {
    all.slice_axis_mut(Axis(0), Slice::from(lines.clone())).assign(own);
}

/// Workspace for one line of a derived estimate: responders are `p` outputs, then `q` inputs, drivers `qr` references.
pub(super) struct DerivedLine<'a> {
    fit: &'a Fitted,
    direct: &'a Fitted,
    p: usize,
    q: usize,
    qr: usize,
    gram: Cholesky<Complex64>,
    coherent: Cholesky<Complex64>,
    measured: Cholesky<Complex64>,
    /// Responders over references, whitened: rows a, b make what the references explain of them, g_a W g_bᴴ.
    white: Vec<Complex64>,
    /// Responders over references times the references' density.
    driven: Vec<Complex64>,
    /// What references cause of the inputs.
    caused: Vec<Complex64>,
    c: Vec<Complex64>,
    row: Vec<Complex64>,
    inverse_information: Vec<Complex64>,
    inverse_c: Vec<Complex64>,
    inverse_u: Vec<Complex64>,
    scratch: Vec<Complex64>,
    values: Vec<f64>,
}

impl<'a> DerivedLine<'a> {
    pub(super) fn new(fit: &'a Fitted, direct: &'a Fitted, p: usize) -> Self {
        let (_, m, qr) = fit.g.dim();
        let q = m - p;
        let zeros = |n: usize| vec![Complex64::default(); n];
        DerivedLine {
            fit,
            direct,
            p,
            q,
            qr,
            gram: Cholesky::new(qr),
            coherent: Cholesky::new(q),
            measured: Cholesky::new(q),
            white: zeros(m * qr),
            driven: zeros(m * qr),
            caused: zeros(q * q),
            c: zeros(p * q),
            row: zeros(qr.max(q)),
            inverse_information: zeros(q * q),
            inverse_c: zeros(q * q),
            inverse_u: zeros(q * q),
            scratch: zeros(q * q),
            values: vec![0.0; q],
        }
    }

    /// Finds everything at line `f`; `None` where references or inputs depend on each other.
    pub(super) fn solve(&mut self, f: usize, out: &mut Found) -> Option<()> {
        self.explain(f, out)?;
        let q = self.q;
        for i in 0..q {
            for j in 0..q {
                self.caused[i * q + j] = self.coherent_power(f, self.p + i, self.p + j);
            }
        }
        let direct = self.direct;
        let input = |i: usize, j: usize| direct.driver[[f, i, j]];
        if !self.coherent.factor(|i, j| self.caused[i * q + j]) || !self.measured.factor(input) {
            return None;
        }
        self.coherent.inverse(&mut self.inverse_c);
        self.measured.inverse(&mut self.inverse_u);
        self.invert(f, out)?;
        self.find_noise(f, out);
        let at = f - out.first;
        for (i, own) in self.c.chunks_exact(self.q).enumerate() {
            imply(&mut out.paper, (at, i), own, input, &self.inverse_u, direct.noise[[f, i, i]].re);
            imply(&mut out.iv, (at, i), own, |i, j| self.caused[i * q + j], &self.inverse_c, out.noise[[at, i, i]].re);
        }
        self.judge_instrument(f, out);
        Some(())
    }

    /// Whitens the responders, P = L Lᴴ and g L⁻ᴴ with W = P⁻¹, and tells the references' coherence with each.
    fn explain(&mut self, f: usize, out: &mut Found) -> Option<()> {
        let (fit, p, qr) = (self.fit, self.p, self.qr);
        if !(fit.g[[f, 0, 0]].is_finite() && self.gram.factor(|i, j| fit.gram_inverse[[f, i, j]])) {
            return None;
        }
        for (a, row) in self.white.chunks_exact_mut(qr).enumerate() {
            (0..qr).for_each(|k| row[k] = fit.g[[f, a, k]]);
            self.gram.whiten(row);
            for (l, to) in self.driven[a * qr..(a + 1) * qr].iter_mut().enumerate() {
                *to = (0..qr).map(|k| fit.g[[f, a, k]] * fit.driver[[f, k, l]]).sum();
            }
        }
        let at = f - out.first;
        for a in 0..self.p + self.q {
            let power = self.coherent_power(f, a, a).re;
            let share = power / (power + fit.noise[[f, a, a]].re);
            if a < p { out.output_coherence[[at, a]] = share } else { out.input_coherence[[at, a - p]] = share }
        }
        Some(())
    }

    /// What the references cause of responders a and b, g_a S g_bᴴ with S the density of the references.
    fn coherent_power(&self, f: usize, a: usize, b: usize) -> Complex64 {
        self.driven[a * self.qr..(a + 1) * self.qr].iter().enumerate().map(|(l, driven)| driven * self.fit.g[[f, b, l]].conj()).sum()
    }

    fn information(&self, a: usize, b: usize) -> Complex64 {
        let rows = [a, b].map(|r| &self.white[r * self.qr..(r + 1) * self.qr]);
        rows[0].iter().zip(rows[1]).map(|(x, y)| x * y.conj()).sum()
    }

    /// C and the inverse of the information on the inputs.
    fn invert(&mut self, f: usize, out: &mut Found) -> Option<()> {
        let (p, q) = (self.p, self.q);
        for e in 0..q * q {
            self.scratch[e] = self.information(p + e / q, p + e % q);
        }
        if !self.coherent.factor(|i, j| self.scratch[i * q + j]) {
            return None;
        }
        self.coherent.inverse(&mut self.inverse_information);
        out.input_inverse.index_axis_mut(Axis(0), f - out.first).iter_mut().zip(&self.inverse_information).for_each(|(to, &from)| *to = from);
        for i in 0..p {
            for j in 0..q {
                self.c[i * q + j] = self.information(i, p + j);
            }
            let row = &mut self.c[i * q..(i + 1) * q];
            self.coherent.whiten(row);
            self.coherent.unwhiten(row);
            (0..q).for_each(|j| out.value[[f - out.first, i, j]] = row[j]);
        }
        Some(())
    }

    /// The noise of the equation that was solved, A Σ Aᴴ with A = [1, −C].
    fn find_noise(&self, f: usize, out: &mut Found) {
        let (p, q, c) = (self.p, self.q, &self.c);
        let sigma = |a: usize, b: usize| self.fit.noise[[f, a, b]];
        for (i, k) in (0..p).flat_map(|i| (0..p).map(move |k| (i, k))) {
            let mut sum = sigma(i, k);
            for j in 0..q {
                sum -= c[i * q + j] * sigma(p + j, k) + sigma(i, p + j) * c[k * q + j].conj();
                for l in 0..q {
                    sum += c[i * q + j] * sigma(p + j, p + l) * c[k * q + l].conj();
                }
            }
            out.noise[[f - out.first, i, k]] = if i == k { Complex64::from(sum.re.max(0.0)) } else { sum };
        }
    }

    /// Takes out of the noise what the error of C makes of the inputs that the references do not cause, and tells how strong the references are.
    fn judge_instrument(&mut self, f: usize, out: &mut Found) {
        let (fit, p, q, at) = (self.fit, self.p, self.q, f - out.first);
        let sigma = |a: usize, b: usize| fit.noise[[f, a, b]];
        let pairs = (0..q).flat_map(|l| (0..q).map(move |j| (l, j)));
        let taken_in: Complex64 = pairs.map(|(l, j)| self.inverse_information[l * q + j] * sigma(p + j, p + l)).sum();
        out.noise.index_axis_mut(Axis(0), f - out.first).mapv_inplace(|v| v / (1.0 + taken_in.re));
        let of_inputs = |i: usize, j: usize| sigma(p + i, p + j);
        let largest = largest_ratio(&self.coherent, of_inputs, &mut self.scratch, &mut self.inverse_u, &mut self.row, &mut self.values);
        out.instrument_strength[at] = 1.0 / (self.qr as f64 * largest);
        let weakest = (0..q).map(|j| self.information(p + j, p + j).re / sigma(p + j, p + j).re).fold(f64::INFINITY, f64::min);
        out.weak_instrument[at] = out.instrument_strength[at].min(weakest) < WEAK_INSTRUMENT;
    }
}
