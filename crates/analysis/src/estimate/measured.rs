//! What the channels of trials mean for a response.

use crate::error::AnalysisError;
use crate::trials::Trials;
use ndof_sysid::{EstimateError, FrequencyResponse, Labels, ResponseKind};
use num_complex::Complex64;
use std::f64::consts::TAU;

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
    let power = |order: &Option<i32>| order.unwrap_or(0);
    let rows: Vec<i32> = trials.roles.output_motion.iter().map(|order| -power(order)).collect();
    let columns: Vec<i32> = trials.roles.input_motion.iter().map(power).collect();
    if rows.iter().chain(&columns).all(|power| *power == 0) {
        return;
    }
    for f in 0..response.len() {
        let s = Complex64::new(0.0, TAU * response.frequency_hz[f]);
        let factor = |power: i32| if power == 0 { Complex64::new(1.0, 0.0) } else { s.powi(power) };
        for (i, &row) in rows.iter().enumerate() {
            for (j, &column) in columns.iter().enumerate() {
                response.value[[f, i, j]] *= factor(row) * factor(column);
            }
        }
        if let Some(u) = &mut response.uncertainty {
            for (i, &a) in rows.iter().enumerate() {
                for (k, &b) in rows.iter().enumerate() {
                    u.noise[[f, i, k]] *= factor(a) * factor(b).conj();
                }
            }
            for (l, &b) in columns.iter().enumerate() {
                for (j, &a) in columns.iter().enumerate() {
                    u.input_inverse[[f, l, j]] *= factor(b).conj() * factor(a);
                }
            }
        }
    }
}
