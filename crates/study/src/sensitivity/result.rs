//! `ndof/sensitivity/1`: what pre-compensation by a wrong model does.

use crate::cases::result::MatrixNumbers;
use crate::design::result::CoherenceSize;
use ndof_analysis::result::Head;
use serde::{Deserialize, Serialize};

/// The table of sensitivity.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct SensitivityResult {
    /// Which result this is.
    #[serde(flatten)]
    pub head: Head,
    /// By how much the model is wrong, as a share.
    pub spread: f64,
    /// The band (Hz).
    pub band_hz: [f64; 2],
    /// Its lower part, in which the hold couples the forces (Hz).
    pub low_band_hz: [f64; 2],
    /// Model by model.
    pub rows: Vec<SensitivityRow>,
    /// Frequencies of the curves (Hz).
    pub frequency_hz: Vec<f64>,
    /// Largest coherence of an axis with the others at each frequency, by model: without compensation, and by the nominal arm.
    pub curves: Vec<(String, Vec<f64>)>,
    /// The largest of all corners of the box of parameters at each frequency.
    pub envelope: Vec<f64>,
}

impl SensitivityResult {
    /// The schema's name.
    pub const SCHEMA: &str = "ndof/sensitivity/1";
}

/// Compensation by one model.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct SensitivityRow {
    /// How the model differs from the arm.
    pub model: String,
    /// Coherence between the delivered forces by the linear models, without scatter.
    pub coherence: CoherenceSize,
    /// The largest in the lower part of the band.
    pub coherence_low_max: f64,
    /// All trials on the simulated device, and what is estimated from them.
    pub simulated: Option<SimulatedSensitivity>,
}

/// Trials behind one compensation.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct SimulatedSensitivity {
    /// Coherence between the delivered forces, all trials pooled; of independent ones it is one over the effective averages.
    pub coherence: CoherenceSize,
    /// Root mean square of the delivered forces about their means.
    pub force_rms: f64,
    /// ‖X̂ − X‖/‖X‖ of the fit to the direct estimate.
    pub direct: MatrixNumbers,
    /// The same of the fit to the derived one.
    pub derived: MatrixNumbers,
}
