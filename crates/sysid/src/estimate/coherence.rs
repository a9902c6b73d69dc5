//! Coherences of an estimate, and what chance alone would give.

use ndarray::{Array2, Array3};
use num_complex::Complex64;
use serde::{Deserialize, Serialize};

/// Magnitude-squared coherences, uncorrected for bias; NaN where they do not exist.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Coherence {
    /// γ²_ij = |S_ij|² / (S_ii S_jj), `[f][p][q]`.
    pub ordinary: Array3<f64>,
    /// Of input j on output i given all other inputs, `[f][p][q]`:
    /// |H_ij|² / (|H_ij|² + S_nn,ii [S_uu⁻¹]_jj).
    pub partial: Array3<f64>,
    /// Of all inputs together on output i, `[f][p]`: [H S_uu Hᴴ]_ii / ([H S_uu Hᴴ]_ii + S_nn,ii).
    pub multiple: Array2<f64>,
}

impl Coherence {
    /// Room for `f` frequencies, `p` outputs and `q` inputs, NaN throughout.
    pub(crate) fn nan(f: usize, p: usize, q: usize) -> Self {
        Coherence {
            ordinary: Array3::from_elem((f, p, q), f64::NAN),
            partial: Array3::from_elem((f, p, q), f64::NAN),
            multiple: Array2::from_elem((f, p), f64::NAN),
        }
    }
}

/// Coherences that independent noise exceeds in 5 % of all cases.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Significance {
    /// 1 − 0.05^(1/(n − 1)).
    pub ordinary: f64,
    /// 1 − 0.05^(1/(n − q)).
    pub partial: f64,
    /// The 95 % quantile of Beta(q, n − q).
    pub multiple: f64,
}

impl Significance {
    /// The 95 % thresholds for `inputs` inputs and so many effective averages; NaN if there are not more averages
    /// than inputs.
    ///
    /// ```
    /// use ndof_sysid::Significance;
    /// let threshold = Significance::at_95_percent(20.0, 2);
    /// assert!((threshold.multiple - 0.2264).abs() < 5e-5);
    /// ```
    pub fn at_95_percent(effective_averages: f64, inputs: usize) -> Self {
        let q = inputs as f64;
        let tail = |dof: f64| if dof > 0.0 { 1.0 - 0.05_f64.powf(1.0 / dof) } else { f64::NAN };
        Significance {
            ordinary: tail(effective_averages - 1.0),
            partial: tail(effective_averages - q),
            multiple: crate::quantile::beta(0.95, inputs, effective_averages - q),
        }
    }
}

/// Coherences of output `i` at `f` as the response, the input spectrum and the noise imply them.
pub(crate) fn imply(
    coherence: &mut Coherence,
    (f, i): (usize, usize),
    response: &[Complex64],
    input: impl Fn(usize, usize) -> Complex64,
    inverse: &[Complex64],
    noise: f64,
) {
    let q = response.len();
    let mut explained = 0.0;
    for j in 0..q {
        let cross: Complex64 = (0..q).map(|k| response[k] * input(k, j)).sum();
        explained += (cross * response[j].conj()).re;
        coherence.ordinary[[f, i, j]] = cross.norm_sqr() / input(j, j).re;
        let alone = response[j].norm_sqr() / inverse[j * q + j].re;
        coherence.partial[[f, i, j]] = alone / (alone + noise);
    }
    for j in 0..q {
        coherence.ordinary[[f, i, j]] /= explained + noise;
    }
    coherence.multiple[[f, i]] = explained / (explained + noise);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn of_one_input_all_coherences_are_one_and_the_same() {
        let (response, power, noise) = (Complex64::new(3.0, -4.0), 0.2, 1.5);
        let mut coherence = Coherence::nan(1, 1, 1);
        imply(&mut coherence, (0, 0), &[response], |_, _| power.into(), &[Complex64::from(1.0 / power)], noise);
        // |H|² S_uu / (|H|² S_uu + S_nn)
        let expected = 5.0 / 6.5;
        for found in [coherence.ordinary[[0, 0, 0]], coherence.partial[[0, 0, 0]], coherence.multiple[[0, 0]]] {
            assert!((found - expected).abs() < 1e-15, "{found}");
        }
    }

    #[test]
    fn without_averages_beyond_the_inputs_nothing_is_significant() {
        for inputs in [1, 2, 5] {
            let found = Significance::at_95_percent(inputs as f64, inputs);
            assert!(found.partial.is_nan() && found.multiple.is_nan() && found.ordinary.is_nan() == (inputs == 1), "{inputs}: {found:?}");
        }
    }

    #[test]
    fn of_two_independent_inputs_each_is_judged_without_the_other() {
        let power = [0.5, 2.0];
        let response = [Complex64::new(0.0, 2.0), Complex64::new(1.0, 0.0)];
        let mut coherence = Coherence::nan(1, 1, 2);
        let input = |i: usize, j: usize| Complex64::from(if i == j { power[i] } else { 0.0 });
        let inverse = [2.0, 0.0, 0.0, 0.5].map(Complex64::from);
        imply(&mut coherence, (0, 0), &response, input, &inverse, 4.0);
        // Each causes a power of 2, the noise 4.
        for j in 0..2 {
            assert!((coherence.ordinary[[0, 0, j]] - 0.25).abs() < 1e-15);
            assert!((coherence.partial[[0, 0, j]] - 1.0 / 3.0).abs() < 1e-15);
        }
        assert!((coherence.multiple[[0, 0]] - 0.5).abs() < 1e-15);
    }
}
