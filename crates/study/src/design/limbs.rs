//! Limbs that take the place of an experiment's: another in its linear model, or one that is not described further.

use crate::error::StudyError;
use ndarray::Array2;
use ndof_devices::{EndpointLinear, Experiment, Impedance, Linearised};
use num_complex::Complex64;
use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;

/// The linear model with the limb's matrices changed.
pub(crate) fn with_limb(experiment: &Experiment, change: impl FnOnce(Impedance) -> Impedance) -> Result<Linearised, StudyError> {
    let bench = experiment.build()?;
    let changed = change(bench.limb.linearised());
    let axes = changed.inertia.nrows();
    let limb = EndpointLinear::from_matrices(changed, vec![0.0; axes])?;
    Ok(Linearised::new(bench.device.robot.as_ref(), &limb, bench.device.transducer, bench.hold, &bench.rest)?)
}

/// Inertia, damping and stiffness of every axis of a limb that is not described further.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(from = "[f64; 3]", into = "[f64; 3]")]
pub struct LooseLimb {
    /// kg, kg m².
    pub inertia: f64,
    /// N s/m, N m s/rad.
    pub damping: f64,
    /// N/m, N m/rad.
    pub stiffness: f64,
}

impl From<[f64; 3]> for LooseLimb {
    fn from([inertia, damping, stiffness]: [f64; 3]) -> Self {
        LooseLimb { inertia, damping, stiffness }
    }
}

impl From<LooseLimb> for [f64; 3] {
    fn from(limb: LooseLimb) -> Self {
        [limb.inertia, limb.damping, limb.stiffness]
    }
}

impl LooseLimb {
    /// A soft and a stiff limb: a relaxed arm and one that braces itself; about the wrist where the axes turn.
    pub fn soft_and_stiff(rotational: bool) -> [LooseLimb; 2] {
        let limb = |inertia, damping, stiffness| LooseLimb { inertia, damping, stiffness };
        if rotational { [limb(0.004, 0.03, 0.5), limb(0.006, 0.1, 5.0)] } else { [limb(1.5, 8.0, 100.0), limb(2.5, 25.0, 800.0)] }
    }

    /// (M s² + B s + K)⁻¹ along each axis.
    pub(super) fn compliance(&self, hz: f64, axes: usize) -> Array2<Complex64> {
        let s = Complex64::new(0.0, TAU * hz);
        Array2::from_diag_elem(axes, (self.inertia * s * s + self.damping * s + self.stiffness).inv())
    }
}
