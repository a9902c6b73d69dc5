//! Simulated trials to estimate and fit, in the name of a study.

use crate::error::StudyError;
use ndof_analysis::{Estimate, Estimated, Fit, Fitted, Trials, estimate};

/// What results of a study say of where they come from.
pub(crate) const COMMAND: &str = "study";

/// The estimate of trials, and the fit to it.
pub(crate) fn analysed(trials: &Trials, settings: &Estimate, fit: &Fit) -> Result<(Estimated, Fitted), StudyError> {
    let mut estimated = estimate(trials, settings)?;
    estimated.result.head.command = COMMAND.to_owned();
    let fitted = fitted(&estimated, fit)?;
    Ok((estimated, fitted))
}

/// The fit to an estimate.
pub(crate) fn fitted(estimated: &Estimated, fit: &Fit) -> Result<Fitted, StudyError> {
    let mut fitted = fit.run(estimated)?;
    fitted.result.head.command = COMMAND.to_owned();
    Ok(fitted)
}
