//! Conditioned spectra and ordered partial coherence, as Bendat & Piersol define them.

use crate::response::FrequencyResponse;
use ndarray::{Array2, Array3};
use ndof_linear::Cholesky;
use ndof_signal::CrossSpectra;
use num_complex::Complex64;

/// Inputs removed one after the other from the spectra of all channels at one frequency.
///
/// S_ab·r! = S_ab·(r−1)! − S_ar·(r−1)! S_rb·(r−1)! / S_rr·(r−1)!, where r! stands for the linear effects of the first r
/// inputs. What the order gives to an input (its own part and what it shares with those after it) is not what it has
/// alone: for that, see the `partial` coherence of an estimate, which is the same in every order.
///
/// Bendat & Piersol, Random Data, 4th ed. 2010, section 7.3.
#[derive(Clone, Debug, PartialEq)]
pub struct Conditioned {
    /// γ²_{r y_i·(r−1)!} of the r-th input in order with output i given the inputs before it, `[p][q]`.
    pub partial_coherence: Array2<f64>,
    /// L_ri = S_{ir·(r−1)!} / S_{rr·(r−1)!} from the r-th conditioned input to each input (0..q) and output (q..q+p), `[q][q+p]`.
    pub l_systems: Array2<Complex64>,
    /// What all inputs leave unexplained of the outputs, S_yy·q!, `[p][p]`.
    pub residual: Array2<Complex64>,
}

/// Conditions `outputs` on `inputs`, one by one in the order given, at frequency index `f`.
///
/// `None` where an input is silent or a combination of those before it.
///
/// The product 1 − γ²_multiple = Π_r (1 − γ²_{r y·(r−1)!}) holds in any order.
pub fn conditioned(spectra: &CrossSpectra, f: usize, inputs: &[usize], outputs: &[usize]) -> Option<Conditioned> {
    let (q, p) = (inputs.len(), outputs.len());
    let channels: Vec<usize> = inputs.iter().chain(outputs).copied().collect();
    let mut s = spectra.block(f, &channels, &channels);
    let mut partial_coherence = Array2::zeros((p, q));
    let mut l_systems = Array2::zeros((q, q + p));
    for r in 0..q {
        let pivot = s[[r, r]].re;
        // Fourteen digits gone: what is left of this input is round-off.
        if pivot.is_nan() || pivot <= 1e-14 * spectra.power(f, channels[r]) {
            return None;
        }
        for i in 0..p {
            partial_coherence[[i, r]] = s[[q + i, r]].norm_sqr() / (pivot * s[[q + i, q + i]].re);
        }
        for b in 0..q + p {
            l_systems[[r, b]] = s[[b, r]] / pivot;
        }
        let (column, row) = (s.column(r).to_owned(), s.row(r).to_owned());
        for a in 0..q + p {
            for b in 0..q + p {
                s[[a, b]] -= column[a] * row[b] / pivot;
            }
        }
    }
    let residual = Array2::from_shape_fn((p, p), |(i, k)| s[[q + i, q + k]]);
    Some(Conditioned { partial_coherence, l_systems, residual })
}

impl Conditioned {
    /// The response by back substitution, H_j = L_jy − Σ_{i>j} L_ji H_i, `[p][q]` in the order of conditioning.
    pub fn response(&self) -> Array2<Complex64> {
        let (q, p) = (self.l_systems.nrows(), self.l_systems.ncols() - self.l_systems.nrows());
        let mut h = Array2::zeros((p, q));
        for j in (0..q).rev() {
            for i in 0..p {
                let later: Complex64 = (j + 1..q).map(|k| self.l_systems[[j, k]] * h[[i, k]]).sum();
                h[[i, j]] = self.l_systems[[j, q + i]] - later;
            }
        }
        h
    }

    /// Multiple coherence of each output, 1 − Π_r (1 − γ²_{r y·(r−1)!}).
    pub fn multiple_coherence(&self) -> Vec<f64> {
        self.partial_coherence.outer_iter().map(|row| 1.0 - row.iter().map(|g| 1.0 - g).product::<f64>()).collect()
    }
}

/// Ordered partial coherence γ²_{r y_i·(r−1)!} of any estimate, `[f][p][q]`: of input r with output i given the inputs before
/// it, as the response H, the inputs' spectrum S_uu = G Gᴴ and the multiple coherence of the estimate imply them,
///
/// |[H G]_ir|² / (Σ_{s ≥ r} |[H G]_is|² + S_nn,ii).
///
/// For H1 this is the `partial_coherence` of [`conditioned`]; for the derived estimate it holds under the same assumption
/// about the noise as the multiple coherence does. `input_inverse` is that of an [`Uncertainty`](crate::Uncertainty): S_uu of the
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
