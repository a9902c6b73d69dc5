//! Ordered partial coherence.

use crate::response::FrequencyResponse;
use ndarray::{Array2, Array3};
use ndof_linear::Cholesky;
use num_complex::Complex64;

/// Ordered partial coherence γ²_{r y_i·(r−1)!} of any estimate, `[f][p][q]`: of input r with output i given the inputs before
/// it, as the response H, the inputs' spectrum S_uu = G Gᴴ and the multiple coherence of the estimate imply them,
///
/// |[H G]_ir|² / (Σ_{s ≥ r} |[H G]_is|² + S_nn,ii).
///
/// For H1 this is γ² of the spectra conditioned on the inputs before (Bendat & Piersol, Random Data, 4th ed. 2010, section 7.3); for the derived
/// estimate it holds under the same assumption about the noise as the multiple coherence does. `input_inverse` is that of an [`Uncertainty`](crate::Uncertainty): S_uu of the
/// direct, S^c_uu of the derived estimate. NaN where there is no estimate.
pub fn ordered_coherence(response: &FrequencyResponse, input_inverse: &Array3<Complex64>, multiple: &Array2<f64>) -> Array3<f64> {
    let (p, q) = response.shape();
    let mut ordered = Array3::from_elem((response.len(), p, q), f64::NAN);
    // With the inputs in reverse order P = L Lᴴ makes L⁻ᴴ, put back in order, a lower triangular G with G Gᴴ = P⁻¹.
    let (mut factor, mut row) = (Cholesky::new(q), vec![Complex64::default(); q]);
    let back = |k: usize| q - 1 - k;
    for f in 0..response.len() {
        if !factor.factor(|a, b| input_inverse[[f, back(a), back(b)]]) {
            continue;
        }
        for i in 0..p {
            (0..q).for_each(|k| row[k] = response.value[[f, i, back(k)]]);
            factor.whiten(&mut row);
            let power: Vec<f64> = (0..q).map(|r| row[back(r)].norm_sqr()).collect();
            let explained: f64 = power.iter().sum();
            let noise = explained * (1.0 - multiple[[f, i]]) / multiple[[f, i]];
            for r in 0..q {
                ordered[[f, i, r]] = power[r] / (power[r..].iter().sum::<f64>() + noise);
            }
        }
    }
    ordered
}
