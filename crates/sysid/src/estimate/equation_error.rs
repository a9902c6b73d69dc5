//! The error of y = C u where what the references leave of outputs and inputs is Σ, for several frequencies side by side.

use crate::lanes::{LANES, Lanes, Reals, each, entry, lanes, lower};

/// Σ, a lower triangle of responders, and where outputs and inputs begin in it.
pub(super) struct LeftOver<'a> {
    pub(super) sigma: &'a [Lanes],
    pub(super) outputs: usize,
    pub(super) inputs: usize,
}

impl LeftOver<'_> {
    /// Σ_uu.
    #[inline(always)]
    fn of_inputs(&self, l: usize, j: usize) -> Lanes {
        entry(self.sigma, self.inputs + l, self.inputs + j)
    }

    /// Σ_yu.
    #[inline(always)]
    fn across(&self, i: usize, j: usize) -> Lanes {
        entry(self.sigma, self.outputs + i, self.inputs + j)
    }

    /// The lower triangle of A Σ Aᴴ = Σ_yy − C Σ_uy + (C Σ_uu − Σ_yu) Cᴴ, A = [1, −C] and C of `q` columns; `row` is workspace of q.
    #[inline(always)]
    pub(super) fn noise(&self, c: &[Lanes], q: usize, row: &mut [Lanes], to: &mut [Lanes]) {
        for (i, own) in c.chunks_exact(q).enumerate() {
            for (j, left) in row.iter_mut().enumerate() {
                let minus = self.across(i, j);
                *left = Lanes { re: each(&minus.re, |v| -v), im: each(&minus.im, |v| -v) };
                for (l, c) in own.iter().enumerate() {
                    *left = left.plus(c, &self.of_inputs(l, j));
                }
            }
            for (k, other) in c.chunks_exact(q).enumerate().take(i + 1) {
                let mut sum = self.sigma[lower(self.outputs + i, self.outputs + k)];
                for (j, c) in own.iter().enumerate() {
                    sum = sum.minus_conj(c, &self.across(k, j)).plus_conj(&row[j], &other[j]);
                }
                // Round-off below nought is nought; what is not a number stays none.
                let real = Lanes { re: each(&sum.re, |v| if v < 0.0 { 0.0 } else { v }), im: [0.0; LANES] };
                to[lower(i, k)] = if i == k { real } else { sum };
            }
        }
    }

    /// tr(M⁻¹ Σ_uu) by the lower triangle of M⁻¹, which has `q` rows: what the error of C makes of the inputs that the references do not cause.
    #[inline(always)]
    pub(super) fn taken_in(&self, inverse: &[Lanes], q: usize) -> Reals {
        let mut sum = [0.0; LANES];
        for j in 0..q {
            for l in 0..=j {
                let (a, b, times) = (&inverse[lower(j, l)], &self.sigma[lower(self.inputs + j, self.inputs + l)], if j == l { 1.0 } else { 2.0 });
                sum = lanes(|k| sum[k] + times * (a.re[k] * b.re[k] + a.im[k] * b.im[k]));
            }
        }
        sum
    }
}
