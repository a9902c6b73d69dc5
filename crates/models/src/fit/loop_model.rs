//! The loop that closes around a limb, as far as a fit has to know it.

use super::linear_start;
use crate::{Axis, InertiaDampingStiffness, InertiaDampingStiffnessModel, Symmetry, small};
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
pub enum LoopModelError {
    /// The two responses do not belong to one loop.
    #[error("responses to the reference of {effort} efforts, {motion} motions and {references} references; a loop model needs as many of each")]
    Shape {
        /// Rows of the response of the effort.
        effort: usize,
        /// Rows of the response of the motion.
        motion: usize,
        /// Columns.
        references: usize,
    },
    /// There is no frequency at which the loop could be computed.
    #[error("no frequency between {low_hz} and {high_hz} Hz at which both responses to the reference exist; widen the band")]
    NoFrequency {
        /// Lower end of the band.
        low_hz: f64,
        /// Upper end of the band.
        high_hz: f64,
    },
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
            match small::inverse(&flat(motion), n) {
                Some(inverse) => {
                    let opened: Vec<Complex64> = small::identity(n).iter().zip(flat(effort)).map(|(i, t)| i - t).collect();
                    at.iter_mut().zip(small::product(&opened, &inverse, n)).for_each(|(v, z)| *v = z);
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
