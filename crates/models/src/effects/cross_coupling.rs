//! Coupling between axes that the baseline does not have.

use super::vocabulary::*;

const MATRIX: ParameterCard = plain("matrix", "", 0.0, 0.0, None);
const DAMPING: ParameterCard = plain("damping", "", 0.0, 0.0, None);
const CARD: Card = Card {
    name: "cross-coupling",
    what: "coupling that the baseline does not have: stiffness that it sets to zero, or a force that turns with the motion, as in a curl field",
    sides: &[Side::Limb],
    parameters: &[MATRIX, DAMPING],
    signature: "a force along one axis in proportion to the displacement or velocity along another, and not the other way round",
    look_alikes: &["sensor-misalignment", "parameter-error"],
    next_experiment: "a perturbation along one axis alone: the coupling shows in the other axis' force, with the inertia uncoupled",
    equation: "f = matrix x + damping v",
    source: "Mussa-Ivaldi, Hogan & Bizzi 1985, Neural, mechanical, and geometric factors subserving arm posture in humans; Shadmehr & Mussa-Ivaldi 1994, Adaptive representation of dynamics, for the curl field",
    trace: Trace::Forms,
};

/// Stiffness and damping between axes.
pub(super) const EFFECT: Effect = Effect { forms, ..Effect::new(&CARD, injection) };

/// A linear force of all axes: rows of stiffness and of damping.
fn coupling(matrices: [Vec<Vec<f64>>; 2]) -> impl ForceLaw {
    move |motion: &Motion<'_>, force: &mut [f64]| {
        for (matrix, of) in matrices.iter().zip([motion.position, motion.velocity]) {
            for (f, row) in force.iter_mut().zip(matrix) {
                *f += row.iter().zip(of).map(|(k, x)| k * x).sum::<f64>();
            }
        }
    }
}

/// A matrix as it is told.
fn told(name: &'static str, n: usize, entries: &[(usize, usize, f64)], value: f64) -> Vec<(&'static str, Value)> {
    let mut matrix = vec![vec![0.0; n]; n];
    entries.iter().for_each(|&(i, j, weight)| matrix[i][j] = weight * value);
    vec![(name, Value::Matrix(matrix))]
}

fn injection(parameters: &Parameters, setting: &Setting) -> Result<Injection, EffectError> {
    let given = [MATRIX.name, DAMPING.name].map(|name| parameters.matrix(name));
    if given.iter().all(Option::is_none) {
        return Err(EffectError::Missing { effect: CARD.name, parameter: MATRIX.name });
    }
    for (matrix, card) in given.iter().zip([MATRIX, DAMPING]) {
        if matrix.is_some_and(|rows| rows.len() != setting.axes || rows.iter().any(|row| row.len() != setting.axes)) {
            return Err(EffectError::Kind { effect: CARD.name, parameter: card.name, expected: "a square matrix with a row for each axis" });
        }
    }
    Ok(Injection::Force(Box::new(coupling(given.map(|matrix| matrix.map(<[_]>::to_vec).unwrap_or_default())))))
}

/// A symmetric stiffness only where the baseline holds it at zero, since a fitted one absorbs it; what turns only where the baseline fits symmetric
/// matrices, whose given entries may each be wrong.
fn forms(scale: &Scale) -> Vec<Form> {
    let zero = |i: usize, j: usize| scale.nominal.iter().chain(&scale.held).any(|e| (e.0, e.1, e.2) == (Matrix::Stiffness, i, j) && e.3 == 0.0);
    let given = |matrix: Matrix, i: usize, j: usize| scale.nominal.iter().any(|e| (e.0, e.1, e.2) == (matrix, i, j));
    let n = scale.axes();
    let form = |label: &'static str, matrix: Matrix, entries: Vec<(usize, usize, f64)>| {
        let (name, of) = (if matrix == Matrix::Damping { DAMPING.name } else { MATRIX.name }, entries.clone());
        Form::new(label, None, Action::Entries { matrix, entries }).coefficients(vec![Sign::Free]).naming(move |_, c| told(name, n, &of, c[0]))
    };
    let pairs = (0..n).flat_map(|i| (i + 1..n).map(move |j| (i, j)));
    pairs
        .flat_map(|(i, j)| {
            let symmetric = (zero(i, j) && zero(j, i)).then(|| form("symmetric stiffness", Matrix::Stiffness, vec![(i, j, 1.0), (j, i, 1.0)]));
            let turning = [("turning stiffness", Matrix::Stiffness), ("turning damping", Matrix::Damping)]
                .into_iter()
                .filter(|(_, matrix)| scale.symmetric && !given(*matrix, i, j))
                .map(|(label, matrix)| form(label, matrix, vec![(i, j, 1.0), (j, i, -1.0)]));
            symmetric.into_iter().chain(turning).collect::<Vec<_>>()
        })
        .collect()
}
