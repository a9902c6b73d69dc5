//! The loop that closes around a limb, as far as a fit has to know it.

use super::linear_start;
use crate::{Axis, InertiaDampingStiffness, InertiaDampingStiffnessModel, Symmetry};
use ndof_linear::square;
use ndof_sysid::{FrequencyResponse, ResponseError, ResponseKind};
use num_complex::Complex64;
use serde::{Deserialize, Serialize};

/// Dynamic stiffness Z_r of what holds the limb (robot and controller): F = r − Z_r d.
///
/// A fit needs it only to know how a window smooths: an estimate in the loop is smooth(R) smooth(T)⁻¹ with
/// T = (I + Z_r C)⁻¹ and R = C T, so its second derivatives matter and its small errors do not.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LoopModel {
    /// Z_r(s) ≈ M s² + B s + K, not symmetric in general.
    pub impedance: InertiaDampingStiffness,
}

/// Why a loop cannot be modelled.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[allow(missing_docs, reason = "a message says what its fields are")]
pub enum LoopModelError {
    /// The two responses do not belong to one loop.
    #[error("responses to the reference of {effort} efforts, {motion} motions and {references} references; a loop model needs as many of each")]
    Shape { effort: usize, motion: usize, references: usize },
    /// There is no frequency at which the loop could be computed.
    #[error("no frequency between {low_hz} and {high_hz} Hz at which both responses to the reference exist; widen the band")]
    NoFrequency { low_hz: f64, high_hz: f64 },
    /// The loop's stiffness cannot be computed.
    #[error(transparent)]
    Response(#[from] ResponseError),
}

impl LoopModel {
    /// Z_r from the responses of effort (T) and displacement (R) to a reference in units of effort:
    /// Z_r = (I − T) R⁻¹ at each frequency within the band, and M, B, K of that by linear least squares.
    ///
    /// # Errors
    /// [`LoopModelError`] if the shapes differ or nothing is left within the band.
    pub fn estimate(effort: &FrequencyResponse, motion: &FrequencyResponse, band_hz: [f64; 2]) -> Result<Self, LoopModelError> {
        let (p, n) = effort.shape();
        if p != n || motion.shape() != (n, n) || motion.len() != effort.len() {
            return Err(LoopModelError::Shape { effort: p, motion: motion.shape().0, references: n });
        }
        let mut impedance = FrequencyResponse { uncertainty: None, kind: ResponseKind::DynamicStiffness, ..effort.clone() };
        for f in 0..effort.len() {
            let flat = |r: &FrequencyResponse| r.at(f).iter().copied().collect::<Vec<Complex64>>();
            let mut at = impedance.value.index_axis_mut(ndarray::Axis(0), f);
            match square::inverse(&flat(motion), n) {
                Some(inverse) => {
                    let opened: Vec<Complex64> = square::identity::<Complex64>(n).iter().zip(flat(effort)).map(|(i, t)| i - t).collect();
                    at.iter_mut().zip(square::product(&opened, &inverse, n)).for_each(|(v, z)| *v = z);
                }
                None => at.fill(Complex64::new(f64::NAN, f64::NAN)),
            }
        }
        let axes: Vec<Axis> = motion.outputs.iter().map(|name| Axis::from_channel(name)).collect();
        let model = InertiaDampingStiffnessModel::new(axes, Symmetry::Free);
        let impedance = model.matrices(&linear_start(&model, &impedance.band(band_hz[0], band_hz[1]))?);
        let finite = [&impedance.inertia, &impedance.damping, &impedance.stiffness].iter().all(|m| m.iter().all(|v| v.is_finite()));
        if finite { Ok(LoopModel { impedance }) } else { Err(LoopModelError::NoFrequency { low_hz: band_hz[0], high_hz: band_hz[1] }) }
    }

    /// Z_r(s), row-major.
    pub(crate) fn at(&self, s: Complex64) -> Vec<Complex64> {
        self.impedance.dynamic_stiffness(s).iter().copied().collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndarray::{Array3, arr2};

    #[test]
    fn what_holds_a_limb_comes_back_from_what_the_limb_answers() {
        let robot = InertiaDampingStiffness {
            axes: vec![Axis::linear("x"), Axis::linear("y")],
            inertia: arr2(&[[0.9, -0.3], [-0.2, 1.1]]),
            damping: arr2(&[[5.0, 0.4], [-0.3, 6.0]]),
            stiffness: arr2(&[[100.0, 7.0], [-3.0, 90.0]]),
        };
        let limb = InertiaDampingStiffness { inertia: arr2(&[[2.0, 0.1], [0.1, 1.5]]), ..robot.clone() };
        let grid: Vec<f64> = (0..20).map(|k| 0.4 * f64::from(k)).collect();
        let compliance = limb.response(&grid, ResponseKind::Compliance);
        let (mut effort, mut motion) = (compliance.clone(), compliance.clone());
        effort.kind = ResponseKind::Transfer;
        for (f, hz) in grid.iter().enumerate() {
            let c: Vec<Complex64> = compliance.at(f).iter().copied().collect();
            let z: Vec<Complex64> = robot.dynamic_stiffness(Complex64::new(0.0, std::f64::consts::TAU * hz)).iter().copied().collect();
            let opened: Vec<Complex64> = square::identity::<Complex64>(2).iter().zip(square::product(&z, &c, 2)).map(|(i, o)| i + o).collect();
            let t = square::inverse(&opened, 2).expect("regular");
            let r = square::product(&c, &t, 2);
            for e in 0..4 {
                effort.value[[f, e / 2, e % 2]] = t[e];
                motion.value[[f, e / 2, e % 2]] = r[e];
            }
        }
        let found = LoopModel::estimate(&effort, &motion, [0.5, 8.0]).expect("a loop").impedance;
        for (a, b) in [(&found.inertia, &robot.inertia), (&found.damping, &robot.damping), (&found.stiffness, &robot.stiffness)] {
            assert!(a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-8), "{a} {b}");
        }
        // Responses of another shape are no loop, nor are such of unequal length.
        let cut = |r: &FrequencyResponse, outputs: usize, bins: usize| FrequencyResponse {
            value: Array3::from_shape_fn((bins, outputs, 2), |e| r.value[e]),
            frequency_hz: grid[..bins].to_vec(),
            outputs: r.outputs[..outputs].to_vec(),
            ..r.clone()
        };
        for (effort, motion) in [(cut(&effort, 1, 20), motion.clone()), (effort.clone(), cut(&motion, 1, 20)), (effort.clone(), cut(&motion, 2, 19))] {
            assert!(matches!(LoopModel::estimate(&effort, &motion, [0.5, 8.0]), Err(LoopModelError::Shape { .. })));
        }
        assert!(matches!(LoopModel::estimate(&effort, &motion, [50.0, 80.0]), Err(LoopModelError::NoFrequency { .. })));
    }
}
