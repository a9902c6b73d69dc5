//! What is linear in a simulation once A and C are known.

use super::error::SubspaceError;
use super::{LinearTrial, StateSpace};
use crate::levenberg_marquardt::triangle_of_rows;
use faer::Mat;
use ndarray::Array2;
use ndof_linear::least_squares;

/// The model of A and C whose B, D and constants, with the initial states of all trials, minimise the error of the
/// simulation.
pub(super) fn fit_inputs(a: Array2<f64>, c: Array2<f64>, trials: &[LinearTrial<'_>]) -> Result<StateSpace, SubspaceError> {
    let (n, p) = (a.nrows(), c.nrows());
    let q = trials.first().map_or(0, |t| t.inputs.len());
    // Unknowns: B column by column, D by rows, constants, then n initial states a trial.
    let shared = n * q + p * q + p;
    let columns = shared + n * trials.len();
    let mut triangle = Mat::zeros(0, columns + 1);
    for (number, trial) in trials.iter().enumerate() {
        let rows = trial_rows(&a, &c, trial, number, shared, columns);
        let own = triangle_of_rows(&rows, columns + 1);
        let mut both = Mat::zeros(triangle.nrows() + own.nrows(), columns + 1);
        both.submatrix_mut(0, 0, triangle.nrows(), columns + 1).copy_from(&triangle);
        both.submatrix_mut(triangle.nrows(), 0, own.nrows(), columns + 1).copy_from(&own);
        triangle = if both.nrows() > columns + 1 { both.qr().thin_R().to_owned() } else { both };
    }
    let x = solve(&triangle, columns);
    if x.iter().any(|v| !v.is_finite()) {
        return Err(SubspaceError::NotExcited);
    }
    let b = Array2::from_shape_fn((n, q), |(i, j)| x[j * n + i]);
    let d = Array2::from_shape_fn((p, q), |(i, j)| x[n * q + i * q + j]);
    let offset = x[n * q + p * q..shared].to_vec();
    Ok(StateSpace { a, b, c, d, offset })
}

/// The initial state with which a model stays nearest to the first `samples` of a trial, and the constants of its outputs.
pub(super) fn fit_beginning(model: &StateSpace, trial: &LinearTrial<'_>, samples: usize) -> (Vec<f64>, Vec<f64>) {
    let (n, p) = (model.order(), model.c.nrows());
    let inputs: Vec<&[f64]> = trial.inputs.iter().map(|u| &u[..samples]).collect();
    let forced = model.simulate(&inputs, &vec![0.0; n]);
    let width = n + p + 1;
    let mut rows = vec![0.0; samples * p * width];
    let mut seen = model.c.clone();
    for k in 0..samples {
        for i in 0..p {
            let row = &mut rows[(k * p + i) * width..(k * p + i + 1) * width];
            (0..n).for_each(|j| row[j] = seen[[i, j]]);
            row[n + i] = 1.0;
            row[width - 1] = trial.outputs[i][k] - forced[i][k];
        }
        seen = seen.dot(&model.a);
    }
    let x = solve(&triangle_of_rows(&rows, width), n + p);
    (x[..n].to_vec(), x[n..].to_vec())
}

/// Rows of one trial, the measured output last: outputs of runs with one unknown at one and all others at nought.
fn trial_rows(a: &Array2<f64>, c: &Array2<f64>, trial: &LinearTrial<'_>, number: usize, shared: usize, columns: usize) -> Vec<f64> {
    let (n, p, q, samples) = (a.nrows(), c.nrows(), trial.inputs.len(), trial.samples());
    let width = columns + 1;
    let mut rows = vec![0.0; samples * p * width];
    // One state a pair (input, state that it drives), one a component of the initial state.
    let mut driven = Array2::<f64>::zeros((n, n * q));
    let mut free = Array2::<f64>::eye(n);
    for k in 0..samples {
        let (of_input, of_initial) = (c.dot(&driven), c.dot(&free));
        for i in 0..p {
            let row = &mut rows[(k * p + i) * width..(k * p + i + 1) * width];
            (0..n * q).for_each(|e| row[e] = of_input[[i, e]]);
            (0..q).for_each(|j| row[n * q + i * q + j] = trial.inputs[j][k]);
            row[n * q + p * q + i] = 1.0;
            (0..n).for_each(|e| row[shared + n * number + e] = of_initial[[i, e]]);
            row[width - 1] = trial.outputs[i][k];
        }
        driven = a.dot(&driven);
        for j in 0..q {
            (0..n).for_each(|e| driven[[e, j * n + e]] += trial.inputs[j][k]);
        }
        free = a.dot(&free);
    }
    rows
}

/// Least squares from the triangle of [A b]; directions that the data leave open stay at nought.
fn solve(triangle: &Mat<f64>, columns: usize) -> Vec<f64> {
    let a = Array2::from_shape_fn((triangle.nrows(), columns), |(i, j)| triangle[(i, j)]);
    let b: Vec<f64> = (0..triangle.nrows()).map(|i| triangle[(i, columns)]).collect();
    least_squares(&a, &b).map_or(vec![f64::NAN; columns], |found| found.solution)
}
