//! Small Hermitian systems at several frequencies side by side, so that the compiler can use vector instructions.
//!
//! Everything here is compiled into its caller, so that it is vector code where that is, and its loops are straight where sizes are constants.
//!
//! The algebra is that of [`Cholesky`](ndof_linear::Cholesky), number by number. A frequency at which a matrix is not positive
//! definite becomes NaN in its own lane and disturbs no other.

use ndof_linear::SMALLEST_PIVOT;
use ndof_signal::CrossSpectra;
use num_complex::Complex64;
use pulp::Simd;

/// Frequencies treated at once.
pub(crate) const LANES: usize = 8;

/// One real number a lane.
pub(crate) type Reals = [f64; LANES];

/// One complex number a lane.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Lanes {
    pub(crate) re: Reals,
    pub(crate) im: Reals,
}

impl Lanes {
    pub(crate) const ZERO: Lanes = Lanes { re: [0.0; LANES], im: [0.0; LANES] };

    /// The numbers of a slice, ones beyond its end (a harmless matrix entry).
    #[inline(always)]
    pub(crate) fn load(from: &[Complex64]) -> Self {
        if let Some(from) = from.first_chunk::<LANES>() {
            return Lanes { re: lanes(|l| from[l].re), im: lanes(|l| from[l].im) };
        }
        let mut lanes = Lanes { re: [1.0; LANES], im: [0.0; LANES] };
        for (l, v) in from.iter().enumerate() {
            lanes.re[l] = v.re;
            lanes.im[l] = v.im;
        }
        lanes
    }

    #[inline(always)]
    pub(crate) fn conj(self) -> Self {
        Lanes { re: self.re, im: each(&self.im, |v| -v) }
    }

    #[inline(always)]
    pub(crate) fn norm_sqr(&self) -> Reals {
        lanes(|l| self.re[l] * self.re[l] + self.im[l] * self.im[l])
    }

    #[inline(always)]
    pub(crate) fn scaled(&self, by: &Reals) -> Self {
        Lanes { re: lanes(|l| self.re[l] * by[l]), im: lanes(|l| self.im[l] * by[l]) }
    }

    /// self + a b*.
    #[inline(always)]
    pub(crate) fn plus_conj(&self, a: &Lanes, b: &Lanes) -> Self {
        Lanes { re: lanes(|l| self.re[l] + (a.re[l] * b.re[l] + a.im[l] * b.im[l])), im: lanes(|l| self.im[l] + (a.im[l] * b.re[l] - a.re[l] * b.im[l])) }
    }

    /// self − a b*.
    #[inline(always)]
    pub(crate) fn minus_conj(&self, a: &Lanes, b: &Lanes) -> Self {
        Lanes { re: lanes(|l| self.re[l] - (a.re[l] * b.re[l] + a.im[l] * b.im[l])), im: lanes(|l| self.im[l] - (a.im[l] * b.re[l] - a.re[l] * b.im[l])) }
    }

    /// self + a b.
    #[inline(always)]
    pub(crate) fn plus(&self, a: &Lanes, b: &Lanes) -> Self {
        Lanes { re: lanes(|l| self.re[l] + (a.re[l] * b.re[l] - a.im[l] * b.im[l])), im: lanes(|l| self.im[l] + (a.im[l] * b.re[l] + a.re[l] * b.im[l])) }
    }

    /// self − a b.
    #[inline(always)]
    pub(crate) fn minus(&self, a: &Lanes, b: &Lanes) -> Self {
        Lanes { re: lanes(|l| self.re[l] - (a.re[l] * b.re[l] - a.im[l] * b.im[l])), im: lanes(|l| self.im[l] - (a.im[l] * b.re[l] + a.re[l] * b.im[l])) }
    }
}

/// One number for each lane. The standard library's `from_fn` is not always compiled into its caller.
#[inline(always)]
pub(crate) fn lanes(f: impl Fn(usize) -> f64) -> Reals {
    let mut all = [0.0; LANES];
    for (l, one) in all.iter_mut().enumerate() {
        *one = f(l);
    }
    all
}

#[inline(always)]
pub(crate) fn each(a: &Reals, f: impl Fn(f64) -> f64) -> Reals {
    let mut all = *a;
    for one in &mut all {
        *one = f(*one);
    }
    all
}

#[inline(always)]
pub(crate) fn map(a: &Reals, b: &Reals, f: impl Fn(f64, f64) -> f64) -> Reals {
    let mut all = *a;
    for (one, b) in all.iter_mut().zip(b) {
        *one = f(*one, *b);
    }
    all
}

/// Index of entry (i, j ≤ i) of a lower triangle stored row by row.
#[inline(always)]
pub(crate) fn lower(i: usize, j: usize) -> usize {
    i * (i + 1) / 2 + j
}

/// Entry (i, j) of a Hermitian matrix of which there is the lower triangle.
#[inline(always)]
pub(crate) fn entry(triangle: &[Lanes], i: usize, j: usize) -> Lanes {
    if i >= j { triangle[lower(i, j)] } else { triangle[lower(j, i)].conj() }
}

/// Σ_k a_k b_k*.
#[inline(always)]
pub(crate) fn dot_conj(a: &[Lanes], b: &[Lanes]) -> Lanes {
    let mut sum = Lanes::ZERO;
    for (a, b) in a.iter().zip(b) {
        sum = sum.plus_conj(a, b);
    }
    sum
}

/// Rows whose products are taken together: what is read of one serves as many of the other.
const TILE: usize = 2;
/// Columns that are taken together, so that all rows stay in the nearest cache.
const BLOCK: usize = 12;

/// The lower triangle of Z Zᴴ, Z being rows of `columns` numbers.
#[inline(always)]
pub(crate) fn hermitian_products<S: Simd>(simd: S, rows: &[Lanes], columns: usize, to: &mut [Lanes]) {
    let last = rows.len() / columns - 1;
    to.fill(Lanes::ZERO);
    for block in (0..columns).step_by(BLOCK) {
        // Beyond the last row it stands again.
        let tile = |first: usize| [0, 1].map(|k| &rows[(first + k).min(last) * columns..][block..columns.min(block + BLOCK)]);
        for a in (0..=last).step_by(TILE) {
            for b in (0..=a).step_by(TILE) {
                let sums = tile_products(simd, tile(a), tile(b));
                for (i, j) in [(a, b), (a, b + 1), (a + 1, b), (a + 1, b + 1)] {
                    if i <= last && j <= i {
                        let (sum, more) = (&mut to[lower(i, j)], &sums[i - a][j - b]);
                        *sum = Lanes { re: map(&sum.re, &more.re, |x, y| x + y), im: map(&sum.im, &more.im, |x, y| x + y) };
                    }
                }
            }
        }
    }
    for i in 0..=last {
        to[lower(i, i)].im = [0.0; LANES];
    }
}

/// Σ_k a_k b_k* of each row a with each row b, by fused multiplications where the processor has them.
#[inline(always)]
fn tile_products<S: Simd>(simd: S, [a, c]: [&[Lanes]; TILE], [b, d]: [&[Lanes]; TILE]) -> [[Lanes; TILE]; TILE] {
    let mut out = [[Lanes::ZERO; TILE]; TILE];
    for part in 0..LANES / S::F64_LANES {
        let of = |v: &Lanes| [&v.re, &v.im].map(|v| S::as_simd_f64s(v).0[part]);
        let mut sums = [[[simd.splat_f64s(0.0); 2]; TILE]; TILE];
        for ((a, c), (b, d)) in a.iter().zip(c).zip(b.iter().zip(d)) {
            let (rows, columns) = ([of(a), of(c)], [of(b), of(d)]);
            for (sums, [a, turned]) in sums.iter_mut().zip(rows) {
                for ([re, im], [b, other]) in sums.iter_mut().zip(columns) {
                    *re = simd.mul_add_e_f64s(turned, other, simd.mul_add_e_f64s(a, b, *re));
                    *im = simd.negate_mul_add_e_f64s(a, other, simd.mul_add_e_f64s(turned, b, *im));
                }
            }
        }
        for (to, sum) in out.iter_mut().flatten().zip(sums.iter().flatten()) {
            S::as_mut_simd_f64s(&mut to.re).0[part] = sum[0];
            S::as_mut_simd_f64s(&mut to.im).0[part] = sum[1];
        }
    }
    out
}

/// Σ_k |a_k|².
#[inline(always)]
pub(crate) fn power(a: &[Lanes]) -> Reals {
    let mut sum = [0.0; LANES];
    for a in a {
        sum = map(&sum, &a.norm_sqr(), |s, n| s + n);
    }
    sum
}

/// S = L Lᴴ in every lane.
pub(crate) struct LaneCholesky {
    n: usize,
    factor: Vec<Lanes>,
    inverse_pivot: Vec<Reals>,
}

impl LaneCholesky {
    pub(crate) fn new(n: usize) -> Self {
        LaneCholesky { n, factor: vec![Lanes::ZERO; n * (n + 1) / 2], inverse_pivot: vec![[0.0; LANES]; n] }
    }

    /// Factors the matrix whose lower triangle is `entry(i, j ≤ i)`.
    #[inline(always)]
    pub(crate) fn factor(&mut self, entry: impl Fn(usize, usize) -> Lanes) {
        for i in 0..self.n {
            let (done, row) = self.factor.split_at_mut(lower(i, 0));
            for j in 0..i {
                let known = &done[lower(j, 0)..lower(j, j)];
                let mut sum = entry(i, j);
                for (a, b) in row[..j].iter().zip(known) {
                    sum = sum.minus_conj(a, b);
                }
                row[j] = sum.scaled(&self.inverse_pivot[j]);
            }
            let diagonal = entry(i, i).re;
            let explained = power(&row[..i]);
            self.inverse_pivot[i] = lanes(|l| {
                let pivot = diagonal[l] - explained[l];
                if pivot > SMALLEST_PIVOT * diagonal[l] { 1.0 / pivot.sqrt() } else { f64::NAN }
            });
        }
    }

    /// Turns the row b into b L⁻ᴴ.
    #[inline(always)]
    pub(crate) fn whiten(&self, row: &mut [Lanes]) {
        for j in 0..self.n {
            let (known, rest) = row.split_at_mut(j);
            let mut sum = rest[0];
            for (r, l) in known.iter().zip(&self.factor[lower(j, 0)..]) {
                sum = sum.minus_conj(r, l);
            }
            rest[0] = sum.scaled(&self.inverse_pivot[j]);
        }
    }

    /// Turns the row w into w L⁻¹.
    #[inline(always)]
    pub(crate) fn unwhiten(&self, row: &mut [Lanes]) {
        for j in (0..self.n).rev() {
            let (start, later) = row.split_at_mut(j + 1);
            let mut sum = start[j];
            for (k, known) in later[..self.n - j - 1].iter().enumerate() {
                sum = sum.minus(known, &self.factor[lower(j + 1 + k, j)]);
            }
            start[j] = sum.scaled(&self.inverse_pivot[j]);
        }
    }

    /// Writes the lower triangle of S⁻¹ = L⁻ᴴ L⁻¹; `scratch` holds a triangle too.
    #[inline(always)]
    pub(crate) fn inverse(&self, inverse: &mut [Lanes], scratch: &mut [Lanes]) {
        let n = self.n;
        // L⁻¹, row by row.
        for i in 0..n {
            for j in 0..i {
                let mut sum = Lanes::ZERO;
                for k in j..i {
                    sum = sum.minus(&self.factor[lower(i, k)], &scratch[lower(k, j)]);
                }
                scratch[lower(i, j)] = sum.scaled(&self.inverse_pivot[i]);
            }
            scratch[lower(i, i)] = Lanes { re: self.inverse_pivot[i], im: [0.0; LANES] };
        }
        for i in 0..n {
            for j in 0..=i {
                // Σ_k (L⁻¹)_ki* (L⁻¹)_kj.
                let mut sum = Lanes::ZERO;
                for k in i..n {
                    sum = sum.plus_conj(&scratch[lower(k, j)], &scratch[lower(k, i)]);
                }
                inverse[lower(i, j)] = sum;
            }
        }
    }
}

/// 1-norm condition number of S scaled to a unit diagonal, from S and S⁻¹ (lower triangles); NaN where S is singular.
///
/// For one and two rows it equals the 2-norm condition number; for n it is at most n times as large and never smaller.
#[inline(always)]
pub(crate) fn condition(n: usize, s: impl Fn(usize, usize) -> Lanes, inverse: &[Lanes]) -> Reals {
    if n == 1 {
        return lanes(|l| if inverse[0].re[l].is_finite() { 1.0 } else { f64::NAN });
    }
    if n == 2 {
        let power = map(&s(0, 0).re, &s(1, 1).re, |a, b| a * b);
        let coherence = map(&s(1, 0).norm_sqr(), &power, |a, b| a / b);
        return each(&coherence, |c| if c < 1.0 { (1.0 + c.sqrt()) * (1.0 + c.sqrt()) / (1.0 - c) } else { f64::NAN });
    }
    let (mut norm, mut inverse_norm) = ([0.0_f64; LANES], [0.0_f64; LANES]);
    for j in 0..n {
        let (mut column, mut inverse_column) = ([0.0; LANES], [0.0; LANES]);
        let own = s(j, j).re;
        for i in 0..n {
            let (a, b) = (i.max(j), i.min(j));
            let other = s(i, i).re;
            let (entry, inverse_entry) = (s(a, b).norm_sqr(), inverse[lower(a, b)].norm_sqr());
            for l in 0..LANES {
                let scale = own[l] * other[l];
                column[l] += (entry[l] / scale).sqrt();
                inverse_column[l] += (inverse_entry[l] * scale).sqrt();
            }
        }
        for l in 0..LANES {
            // f64::max would hide a NaN.
            norm[l] = if column[l] > norm[l] || column[l].is_nan() { column[l] } else { norm[l] };
            inverse_norm[l] = if inverse_column[l] > inverse_norm[l] || inverse_column[l].is_nan() { inverse_column[l] } else { inverse_norm[l] };
        }
    }
    map(&norm, &inverse_norm, |a, b| a * b)
}

/// 1-norm condition number of S scaled to a unit diagonal, from S and S⁻¹ (n², row by row): what
/// [`condition`] finds, of one matrix.
pub(crate) fn scaled_condition(n: usize, entry: impl Fn(usize, usize) -> Complex64, inverse: &[Complex64]) -> f64 {
    let largest = |size: &dyn Fn(usize, usize) -> f64| (0..n).map(|j| (0..n).map(|i| size(i, j)).sum::<f64>()).fold(0.0_f64, f64::max);
    let scale = |i: usize, j: usize| (entry(i, i).re * entry(j, j).re).sqrt();
    largest(&|i, j| entry(i, j).norm() / scale(i, j)) * largest(&|i, j| inverse[i * n + j].norm() * scale(i, j))
}

/// The lower triangle of chosen channels of a set of spectra, batch by batch.
pub(crate) struct Batches<'a> {
    spectra: &'a CrossSpectra,
    channels: Vec<usize>,
    triangle: Vec<Lanes>,
}

impl<'a> Batches<'a> {
    pub(crate) fn new(spectra: &'a CrossSpectra, channels: Vec<usize>) -> Self {
        let n = channels.len();
        Batches { spectra, channels, triangle: vec![Lanes::ZERO; n * (n + 1) / 2] }
    }

    /// ⟨A B*⟩ for all pairs at `count` frequencies from `first` on, in the order of the channels.
    #[inline(always)]
    pub(crate) fn load(&mut self, first: usize, count: usize) -> &[Lanes] {
        let mut at = 0;
        for (i, &a) in self.channels.iter().enumerate() {
            for &b in &self.channels[..=i] {
                let pair = Lanes::load(&self.spectra.pair(a.max(b), a.min(b))[first..first + count]);
                self.triangle[at] = if a >= b { pair } else { pair.conj() };
                at += 1;
            }
        }
        &self.triangle
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndof_linear::Cholesky;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    fn random(rng: &mut ChaCha8Rng, count: usize) -> Vec<Lanes> {
        let mut reals = || std::array::from_fn(|_| rng.random_range(-1.0..1.0));
        (0..count).map(|_| Lanes { re: reals(), im: reals() }).collect()
    }

    /// Odd numbers of rows, of which a tile lacks one, too.
    #[test]
    fn products_of_rows_are_sums_over_their_numbers() {
        struct Products<'a>(&'a [Lanes], usize, &'a mut [Lanes]);
        impl pulp::WithSimd for Products<'_> {
            type Output = ();
            fn with_simd<S: Simd>(self, simd: S) {
                hermitian_products(simd, self.0, self.1, self.2);
            }
        }
        let (mut rng, columns) = (ChaCha8Rng::seed_from_u64(4), 2 * BLOCK + 7);
        for n in 1..=5 {
            let rows = random(&mut rng, n * columns);
            let [mut scalar, mut vector] = [(); 2].map(|()| vec![Lanes::ZERO; lower(n, 0)]);
            hermitian_products(pulp::Scalar, &rows, columns, &mut scalar);
            pulp::Arch::new().dispatch(Products(&rows, columns, &mut vector));
            for (i, j) in (0..n).flat_map(|i| (0..=i).map(move |j| (i, j))) {
                let at = |row: usize, k: usize, l: usize| Complex64::new(rows[row * columns + k].re[l], rows[row * columns + k].im[l]);
                for l in 0..LANES {
                    let want: Complex64 = (0..columns).map(|k| at(i, k, l) * at(j, k, l).conj()).sum();
                    for found in [&scalar, &vector].map(|all| Complex64::new(all[lower(i, j)].re[l], all[lower(i, j)].im[l])) {
                        assert!((found - want).norm() < 1e-13 && (i != j || found.im == 0.0), "{n} {i} {j}: {found} {want}");
                    }
                }
            }
        }
    }

    /// Every lane against the scalar kernel, one lane singular.
    #[test]
    fn lanes_do_what_one_frequency_at_a_time_does() {
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        for n in 1..=6 {
            let x = random(&mut rng, 2 * n * n);
            let mut s: Vec<Lanes> = Vec::new();
            for i in 0..n {
                (0..=i).for_each(|j| s.push(dot_conj(&x[i * 2 * n..(i + 1) * 2 * n], &x[j * 2 * n..(j + 1) * 2 * n])));
            }
            s[lower(n - 1, n - 1)].re[5] = 0.0;
            let entry = |i: usize, j: usize| s[lower(i, j)];
            let (mut lanes, mut inverse, mut scratch) = (LaneCholesky::new(n), s.clone(), s.clone());
            lanes.factor(entry);
            lanes.inverse(&mut inverse, &mut scratch);
            let mut row: Vec<Lanes> = x[..n].to_vec();
            lanes.whiten(&mut row);
            lanes.unwhiten(&mut row);
            let conditions = condition(n, entry, &inverse);
            for (l, &found) in conditions.iter().enumerate() {
                let at = |v: &Lanes| Complex64::new(v.re[l], v.im[l]);
                let mut one = Cholesky::new(n);
                if l == 5 {
                    assert!(!one.factor(|i, j| at(&entry(i, j))));
                    assert!(found.is_nan() && row.iter().all(|r| r.re[l].is_nan()));
                    continue;
                }
                assert!(one.factor(|i, j| at(&entry(i, j))));
                let mut full = vec![Complex64::default(); n * n];
                one.inverse(&mut full);
                let mut expected: Vec<Complex64> = x[..n].iter().map(at).collect();
                one.whiten(&mut expected);
                one.unwhiten(&mut expected);
                for i in 0..n {
                    assert!((at(&row[i]) - expected[i]).norm() < 1e-10 * (1.0 + expected[i].norm()), "n = {n}, lane {l}");
                    (0..=i).for_each(|j| assert!((at(&inverse[lower(i, j)]) - full[i * n + j]).norm() < 1e-10 * (1.0 + full[i * n + i].norm())));
                }
                let expected = scaled_condition(n, |i, j| if i >= j { at(&entry(i, j)) } else { at(&entry(j, i)).conj() }, &full);
                assert!((found / expected - 1.0).abs() < 1e-9, "{found} and {expected}");
                if n == 2 {
                    // The 2-norm condition number of two inputs, by their coherence.
                    let coherence = at(&s[1]).norm_sqr() / (s[0].re[l] * s[2].re[l]);
                    assert!((found / ((1.0 + coherence.sqrt()) / (1.0 - coherence.sqrt())) - 1.0).abs() < 1e-9);
                }
            }
        }
    }
}
