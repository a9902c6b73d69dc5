//! How strongly the references move the inputs.

use crate::lanes::{LaneCholesky, Lanes};

/// Below this strength of the instrument the estimate is biased towards the direct one, and its intervals are too
/// narrow.
pub const WEAK_INSTRUMENT: f64 = 10.0;

/// L⁻¹ N L⁻ᴴ (q², row by row, in `full`) for S = L Lᴴ already factored: its eigenvalues are those of S⁻¹N. N may be singular. `half` is workspace of q².
#[inline(always)]
pub(super) fn about(factor: &LaneCholesky, q: usize, n: impl Fn(usize, usize) -> Lanes, half: &mut [Lanes], full: &mut [Lanes]) {
    // N L⁻ᴴ row by row, then the rows of its conjugate transpose.
    for (i, row) in half.chunks_exact_mut(q).enumerate() {
        row.iter_mut().enumerate().for_each(|(j, to)| *to = n(i, j));
        factor.whiten(row);
    }
    for (j, row) in full.chunks_exact_mut(q).enumerate() {
        row.iter_mut().enumerate().for_each(|(i, to)| *to = half[i * q + j].conj());
        factor.whiten(row);
    }
}
