//! The linear model that a diagnosis begins from: what `fit` finds in the part that is not held out.

use crate::error::AnalysisError;
use crate::estimate::{Estimate, estimate};
use crate::fit::{Fit, fit};
use crate::trials::{Trial, Trials};
use ndof_diagnose::{HeldOut, LinearFit, Stretch};
use ndof_models::InertiaDampingStiffness;

/// Inertia, damping and stiffness by the defaults of `estimate` and `fit`.
pub(super) fn linear_fit(trials: &Trials, band_hz: Option<[f64; 2]>, held_out: &HeldOut) -> Result<LinearFit, AnalysisError> {
    let shortest = trials.trials.iter().map(|trial| trial.recording.len()).min().unwrap_or(0);
    let [fitted, _] = held_out.divide(trials.trials.len(), shortest, trials.sample_rate_hz())?;
    let part = Trials { trials: stretch(trials, fitted)?.into(), ..trials.clone() };
    let fitted = fit(&estimate(&part, &Estimate::default())?, &Fit { band_hz, ..Fit::default() })?;
    let errors: Vec<f64> = fitted.fit.parameters.iter().map(|parameter| parameter.std_error).collect();
    let std_errors: InertiaDampingStiffness = fitted.model.matrices(&errors);
    let of_sign = (fitted.fit.chi2_reduced.max(1.0) / fitted.fit.covariance_scale.max(1.0)).sqrt().min(1.0);
    Ok(LinearFit { of_sign, matrices: fitted.matrices, std_errors, hold: fitted.sampling.hold })
}

fn stretch(trials: &Trials, part: Stretch) -> Result<Vec<Trial>, AnalysisError> {
    let range = match part {
        Stretch::Trials(chosen) => return Ok(chosen.into_iter().map(|k| trials.trials[k].clone()).collect()),
        Stretch::Samples(range) => range,
    };
    let cut = |trial: &Trial| match trial.recording.slice(range.clone()) {
        Ok(recording) => Ok(Trial { recording, ..trial.clone() }),
        Err(source) => Err(AnalysisError::Recording { file: trial.file.clone(), source }),
    };
    trials.trials.iter().map(cut).collect()
}
