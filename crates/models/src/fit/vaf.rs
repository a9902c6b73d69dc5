//! Agreement of estimate and model as the paper measures it.

use ndarray::Array3;
use ndof_sysid::{FrequencyResponse, ResponseError, ResponseKind};
use num_complex::Complex64;
use serde::{Deserialize, Serialize};

/// Variance accounted for of each element, and R² of all.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Agreement {
    /// VAF in percent, outputs × inputs of the impedance; `None` where the model's element is identically zero.
    pub vaf_percent: Vec<Vec<Option<f64>>>,
    /// R² over the elements that have a VAF; `None` without one.
    pub r2: Option<f64>,
}

/// Elements of the model below this share of its largest are identically zero.
const ZERO: f64 = 1e-12;
/// The paper's extra weight of gains (dB) over phases (degrees).
pub(crate) const GAIN_WEIGHT: f64 = 10.0;

/// VAF and R² of the paper's appendix (A.1 to A.6), on the impedance Z = D/s within `band_hz`, 0 Hz left out:
///
/// ψ_z = Σ_f (10 γ (g_e − g_m))² + (γ Δφ)²,  ψ_n = Σ_f (10 γ g_m)² + (γ φ_m)²
///
/// VAF = 100 (1 − ψ_z/ψ_n) %,  R² = 1 − Σ ψ_z / Σ ψ_n
///
/// with gains g in dB re 1 SI unit and phases φ in degrees within ±180°, differences wrapped likewise. `weight[f, i, j]`
/// is γ: the partial γ² of the same element (the paper), or its root. Bins that are not finite do not count.
///
/// # Errors
/// [`ResponseError`] if either response cannot be turned into an impedance.
///
/// # References
/// J. J. Palazzolo et al. (2007), Stochastic estimation of arm mechanical impedance during robotic stroke
/// rehabilitation, IEEE Trans. Neural Syst. Rehabil. Eng. 15(1), appendix.
pub fn agreement(estimate: &FrequencyResponse, model: &FrequencyResponse, weight: &Array3<f64>, band_hz: [f64; 2]) -> Result<Agreement, ResponseError> {
    let (estimate, model) = (estimate.to_kind(ResponseKind::Impedance)?, model.to_kind(ResponseKind::Impedance)?);
    let (p, q) = estimate.shape();
    let used: Vec<usize> = (0..estimate.len().min(model.len()))
        .filter(|&f| estimate.frequency_hz[f] > 0.0 && (band_hz[0]..=band_hz[1]).contains(&estimate.frequency_hz[f]))
        .collect();
    let size = |i: usize, j: usize| used.iter().map(|&f| model.value[[f, i, j]].norm()).fold(0.0, f64::max);
    let largest = (0..p * q).map(|e| size(e / q, e % q)).fold(0.0, f64::max);
    let (mut all_misfit, mut all_size) = (0.0, 0.0);
    let mut vaf_percent = vec![vec![None; q]; p];
    for i in 0..p {
        for j in 0..q {
            if size(i, j) <= ZERO * largest {
                continue;
            }
            let (mut misfit, mut norm) = (0.0, 0.0);
            for &f in &used {
                let (e, m, w) = (estimate.value[[f, i, j]], model.value[[f, i, j]], weight[[f, i, j]]);
                let (gain, phase) = difference(e, m);
                let here = (GAIN_WEIGHT * w * gain).powi(2) + (w * phase).powi(2);
                if here.is_finite() {
                    misfit += here;
                    norm += (GAIN_WEIGHT * w * decibel(m)).powi(2) + (w * m.arg().to_degrees()).powi(2);
                }
            }
            if norm > 0.0 {
                vaf_percent[i][j] = Some(100.0 * (1.0 - misfit / norm));
                all_misfit += misfit;
                all_size += norm;
            }
        }
    }
    Ok(Agreement { vaf_percent, r2: (all_size > 0.0).then(|| 1.0 - all_misfit / all_size) })
}

fn decibel(z: Complex64) -> f64 {
    20.0 * z.norm().log10()
}

/// Gain (dB) and phase (degrees within ±180) of the quotient of two numbers.
pub(crate) fn difference(estimate: Complex64, model: Complex64) -> (f64, f64) {
    let quotient = estimate / model;
    (decibel(quotient), quotient.arg().to_degrees())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Axis, InertiaDampingStiffness};
    use ndarray::arr2;

    fn model() -> InertiaDampingStiffness {
        InertiaDampingStiffness {
            axes: vec![Axis::linear("x"), Axis::linear("y")],
            inertia: arr2(&[[2.0, 0.0], [0.0, 1.0]]),
            damping: arr2(&[[10.0, 0.0], [0.0, 12.0]]),
            stiffness: arr2(&[[300.0, 0.0], [0.0, 500.0]]),
        }
    }

    #[test]
    fn a_model_accounts_for_all_of_itself_and_says_nothing_of_elements_that_it_lacks() {
        let f: Vec<f64> = (0..40).map(|k| 0.25 * f64::from(k)).collect();
        let z = model().response(&f, ResponseKind::DynamicStiffness);
        let found = agreement(&z, &z, &Array3::ones((40, 2, 2)), [0.0, 10.0]).expect("mechanical");
        assert_eq!(found.vaf_percent, [[Some(100.0), None], [None, Some(100.0)]]);
        assert_eq!(found.r2, Some(1.0));
    }

    #[test]
    fn vaf_of_a_constant_gain_error_is_that_of_the_formula() {
        // One frequency: Z_m = 2j, so g_m = 6.02 dB, φ_m = 90°; the estimate is twice that, 6.02 dB off.
        let at = |v: Complex64| FrequencyResponse {
            frequency_hz: vec![1.0],
            inputs: vec!["x".into()],
            outputs: vec!["x".into()],
            kind: ResponseKind::Impedance,
            value: Array3::from_elem((1, 1, 1), v),
            uncertainty: None,
        };
        let found =
            agreement(&at(Complex64::new(0.0, 4.0)), &at(Complex64::new(0.0, 2.0)), &Array3::from_elem((1, 1, 1), 0.5), [0.5, 2.0]).expect("mechanical");
        let g = (20.0 * 2f64.log10()).powi(2) * 25.0;
        let expected = 100.0 * (1.0 - g / (g + 45f64.powi(2)));
        assert!((found.vaf_percent[0][0].expect("one") - expected).abs() < 1e-10);
    }

    #[test]
    fn phases_are_wrapped_before_they_are_compared() {
        let (gain, phase) = difference(Complex64::from_polar(1.0, -3.1), Complex64::from_polar(1.0, 3.1));
        assert!(gain.abs() < 1e-12 && (phase - (2.0 * std::f64::consts::PI - 6.2).to_degrees()).abs() < 1e-9);
    }
}
