//! What the channels of trials mean for a response.

use crate::error::AnalysisError;
use crate::trials::Trials;
use ndof_sysid::{EstimateError, FrequencyResponse, Labels, ResponseKind};

/// Names of the channels by role, and what outputs over inputs are.
pub(super) fn labels(trials: &Trials) -> Labels {
    let ports = &trials.roles.ports;
    Labels {
        references: trials.names(&ports.references),
        inputs: trials.names(&ports.inputs),
        outputs: trials.names(&ports.outputs),
        kind: trials.roles.natural_kind(),
    }
}

/// Names the file of the trial that an error is about.
pub(super) fn in_file(error: EstimateError, trials: &Trials) -> AnalysisError {
    let file = match &error {
        EstimateError::Welch { trial, .. }
        | EstimateError::Multitaper { trial, .. }
        | EstimateError::Periodic { trial, .. }
        | EstimateError::NotFinite { trial, .. } => trials.trials.get(trial - 1).map(|t| t.file.clone()),
        _ => None,
    };
    let all = || match &*trials.trials {
        [one] => one.file.clone(),
        several => format!("{} trials", several.len()),
    };
    AnalysisError::Estimate { file: file.unwrap_or_else(all), source: error }
}

/// Divides by s for each time that an output is the derivative of a displacement, and multiplies for an input.
pub(crate) fn to_displacement(response: &mut FrequencyResponse, trials: &Trials) {
    if response.kind == ResponseKind::Transfer {
        return;
    }
    let back = |orders: &[Option<i32>]| orders.iter().map(|order| -order.unwrap_or(0)).collect::<Vec<_>>();
    response.differentiate(&back(&trials.roles.output_motion), &back(&trials.roles.input_motion));
}
