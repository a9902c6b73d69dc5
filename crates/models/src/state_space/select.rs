//! The order of a state-space model by what it does on held-out data.

use super::output_error::fit_beginning;
use super::{LinearTrial, StateSpace, Subspace, SubspaceError};

/// One order.
#[derive(Clone, Debug)]
pub struct Candidate {
    /// The model.
    pub model: StateSpace,
    /// rms(y − ŷ)/std(y) of each output on held-out trials, simulated from the inputs alone.
    pub held_out_nrmse: Vec<f64>,
    /// 100 (1 − var(y − ŷ)/var(y)) of the same.
    pub held_out_vaf_percent: Vec<f64>,
}

/// All orders that were tried.
#[derive(Clone, Debug)]
pub struct Selection {
    /// From order 1 on; unstable models are left out.
    pub candidates: Vec<Candidate>,
    /// Index of the chosen one.
    pub best: usize,
    /// Singular values of the states, largest first.
    pub singular_values: Vec<f64>,
}

impl Selection {
    /// The chosen model with its scores.
    pub fn chosen(&self) -> &Candidate {
        &self.candidates[self.best]
    }
}

/// A larger order must lower the held-out error by this share to be worth it.
const WORTH: f64 = 0.01;

/// Fits orders 1 to `largest` and chooses the smallest whose held-out error is within a hundredth of the least: free-run
/// simulation from the inputs, where only initial state and constants are fitted, to the first `beginning` samples, which
/// are not scored.
///
/// # Errors
/// [`SubspaceError`] if the trials are too short or no order gives a stable model.
pub fn select(
    settings: &Subspace,
    trials: &[LinearTrial<'_>],
    held_out: &[LinearTrial<'_>],
    largest: usize,
    beginning: usize,
) -> Result<Selection, SubspaceError> {
    let states = settings.states(trials)?;
    let mut candidates = Vec::new();
    for order in 1..=largest.min(states.singular_values.len()) {
        let model = settings.of_order(trials, &states, order)?;
        if model.poles().iter().any(|z| z.norm() >= 1.0) {
            continue;
        }
        let (held_out_nrmse, held_out_vaf_percent) = score(&model, held_out, beginning);
        candidates.push(Candidate { model, held_out_nrmse, held_out_vaf_percent });
    }
    let error = |c: &Candidate| c.held_out_nrmse.iter().map(|v| v * v).sum::<f64>().sqrt();
    let least = candidates.iter().map(error).fold(f64::INFINITY, f64::min);
    let best = candidates.iter().position(|c| error(c) <= (1.0 + WORTH) * least).ok_or(SubspaceError::NotExcited)?;
    Ok(Selection { candidates, best, singular_values: states.singular_values })
}

fn score(model: &StateSpace, trials: &[LinearTrial<'_>], beginning: usize) -> (Vec<f64>, Vec<f64>) {
    let p = model.c.nrows();
    let mut errors = vec![Vec::new(); p];
    let mut measured = vec![Vec::new(); p];
    for trial in trials {
        let first = beginning.min(trial.samples());
        let (initial, constants) = fit_beginning(model, trial, first);
        let run = model.simulate(&trial.inputs, &initial);
        for i in 0..p {
            errors[i].extend((first..trial.samples()).map(|k| trial.outputs[i][k] - run[i][k] - constants[i]));
            measured[i].extend_from_slice(&trial.outputs[i][first..]);
        }
    }
    let mean = |v: &[f64]| v.iter().sum::<f64>() / v.len().max(1) as f64;
    let variance = |v: &[f64]| {
        let m = mean(v);
        v.iter().map(|x| (x - m).powi(2)).sum::<f64>() / v.len().max(1) as f64
    };
    errors
        .iter()
        .zip(&measured)
        .map(|(e, y)| ((mean(&e.iter().map(|v| v * v).collect::<Vec<_>>()) / variance(y)).sqrt(), 100.0 * (1.0 - variance(e) / variance(y))))
        .unzip()
}
