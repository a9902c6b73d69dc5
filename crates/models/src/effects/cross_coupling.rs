//! Coupling between axes that the baseline sets to zero.

use super::vocabulary::*;

const MATRIX: ParameterCard = plain("matrix", "", 0.0, 0.0, None);
const CARD: Card = Card {
    name: "cross-coupling",
    what: "off-diagonal stiffness that the baseline sets to zero",
    sides: &[Side::Limb],
    parameters: &[MATRIX],
    signature: "a force along one axis in proportion to the displacement along another",
    look_alikes: &["sensor-misalignment", "parameter-error"],
    next_experiment: "a perturbation along one axis alone: the coupling shows in the other axis' force, with the inertia uncoupled",
    equation: "f = matrix x",
    source: "Mussa-Ivaldi, Hogan & Bizzi 1985, Neural, mechanical, and geometric factors subserving arm posture in humans",
    trace: Trace::Forms,
};

/// Stiffness between axes.
pub struct CrossCoupling;

/// A linear force of all axes.
struct Coupling(Vec<Vec<f64>>);

impl ForceLaw for Coupling {
    fn evaluate(&self, motion: &Motion<'_>, _states: &[f64], force: &mut [f64], _rates: &mut [f64]) {
        for (f, row) in force.iter_mut().zip(&self.0) {
            *f += row.iter().zip(motion.position).map(|(k, x)| k * x).sum::<f64>();
        }
    }
}

impl Effect for CrossCoupling {
    fn card(&self) -> &'static Card {
        &CARD
    }

    fn injection(&self, parameters: &Parameters, setting: &Setting) -> Result<Injection, EffectError> {
        let matrix = parameters.matrix("matrix").ok_or(EffectError::Missing { effect: CARD.name, parameter: MATRIX.name })?;
        if matrix.len() != setting.axes || matrix.iter().any(|row| row.len() != setting.axes) {
            return Err(EffectError::Kind { effect: CARD.name, parameter: MATRIX.name, expected: "a square matrix with a row for each axis" });
        }
        Ok(Injection::Force(Box::new(Coupling(matrix.to_vec()))))
    }

    /// Only where the baseline holds off-diagonal stiffness at zero: a fitted one absorbs it.
    fn forms(&self, scale: &Scale) -> Vec<Form> {
        let zero = |i: usize, j: usize| scale.nominal.iter().chain(&scale.held).any(|e| (e.0, e.1, e.2) == (Matrix::Stiffness, i, j) && e.3 == 0.0);
        let n = scale.axes();
        (0..n)
            .flat_map(|i| (i + 1..n).map(move |j| (i, j)))
            .filter(|&(i, j)| zero(i, j) && zero(j, i))
            .map(|(i, j)| {
                let entries = vec![(i, j, 1.0), (j, i, 1.0)];
                Form::new("symmetric stiffness", None, Action::Entries { matrix: Matrix::Stiffness, entries }).coefficients(vec![Sign::Free]).naming(
                    move |_, c| {
                        let mut matrix = vec![vec![0.0; n]; n];
                        (matrix[i][j], matrix[j][i]) = (c[0], c[0]);
                        vec![("matrix", Value::Matrix(matrix))]
                    },
                )
            })
            .collect()
    }
}
