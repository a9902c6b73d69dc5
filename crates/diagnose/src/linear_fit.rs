//! A linear model that was fitted elsewhere, with its errors: what a diagnosis judges where no simulation is given.

use crate::linear::Symmetric;
use ndarray::Array2;
use ndof_models::effects::Matrix;
use ndof_models::physical::is_of_no_body;
use ndof_models::{Hold, InertiaDampingStiffness, Ticks};
use std::ops::Neg;

/// Standard errors beyond which a sign is not in doubt: odds of 1000 by the normal law.
const SURE: f64 = 3.3;

/// Inertia, damping and stiffness as they were fitted to the part of the recordings that is not held out.
#[derive(Clone, Debug, PartialEq)]
pub struct LinearFit {
    /// The matrices, axes in the order of the outputs.
    pub matrices: InertiaDampingStiffness,
    /// Their standard errors.
    pub std_errors: InertiaDampingStiffness,
    /// The share of the standard errors that counts where a sign is asked for: what noise of the size of all that is left does. The rest of them,
    /// an error of the model that is smaller than the model, changes sizes and no sign.
    pub of_sign: f64,
    /// What efforts do between their samples, where that was said or the data say it; else they are taken as they are, and may as well stay until the next.
    pub hold: Option<Hold>,
    /// The loop at whose ticks channels are read, where there is one.
    pub ticks: Option<Ticks>,
}

impl LinearFit {
    /// One of the matrices, with its standard errors.
    fn part(&self, matrix: Matrix) -> [&Array2<f64>; 2] {
        [&self.matrices, &self.std_errors].map(|of| match matrix {
            Matrix::Mass => &of.inertia,
            Matrix::Damping => &of.damping,
            Matrix::Stiffness => &of.stiffness,
        })
    }

    /// An entry with its standard error.
    pub(crate) fn entry(&self, matrix: Matrix, row: usize, column: usize) -> (f64, f64) {
        let [value, error] = self.part(matrix);
        (value[[row, column]], error[[row, column]])
    }

    /// All entries: matrix, row, column, value.
    pub(crate) fn entries(&self) -> Vec<(Matrix, usize, usize, f64)> {
        let of = |matrix| self.part(matrix)[0].indexed_iter().map(move |((i, j), value)| (matrix, i, j, *value));
        [Matrix::Mass, Matrix::Damping, Matrix::Stiffness].into_iter().flat_map(of).collect()
    }

    /// Whether its damping and stiffness are symmetric, as they are unless the fit was asked otherwise.
    pub(crate) fn is_symmetric(&self) -> bool {
        [&self.matrices.damping, &self.matrices.stiffness].iter().all(|matrix| *matrix == matrix.t())
    }

    /// Whether a motion follows from it: no axis's inertia may as well be below zero, and M takes energy to be moved (its symmetric part is
    /// positive definite).
    pub(crate) fn moves(&self) -> bool {
        let inertia = &self.matrices.inertia;
        let n = inertia.nrows();
        let mass = Symmetric::of(n, |i, j| 0.5 * (inertia[[i, j]] + inertia[[j, i]]));
        let sure = |i| {
            let (value, error) = self.entry(Matrix::Mass, i, i);
            value > SURE * self.of_sign * error || value > 0.0 && !error.is_finite()
        };
        (0..n).all(sure) && mass.factor().is_some()
    }

    /// Whether the effort can have been counted the other way round: each axis has an inertia or a damping that is below zero beyond doubt. A
    /// plant that takes energy up has neither; which of the two a missing law bends to the other side is not for a linear fit to say. And turned round it
    /// is a body's: of motions in each other's place it is not.
    pub(crate) fn reversed(&self) -> bool {
        let axes = self.matrices.inertia.nrows();
        let turned = |matrix, i, j| {
            let (value, error) = self.entry(matrix, i, j);
            let half = SURE * self.of_sign * error;
            [-value - half, -value + half]
        };
        let below = |matrix, i| turned(matrix, i, i)[0] > 0.0;
        let most = |i| turned(Matrix::Mass, i, i)[1];
        let mut pairs = (0..axes).flat_map(|i| (0..i).map(move |j| (i, j)));
        (0..axes).all(|i| below(Matrix::Mass, i) || below(Matrix::Damping, i))
            && !pairs.any(|(i, j)| is_of_no_body(turned(Matrix::Mass, i, j), [most(i), most(j)]))
    }
}

impl Neg for LinearFit {
    type Output = Self;

    /// The same with the effort counted the other way round.
    fn neg(mut self) -> Self {
        let InertiaDampingStiffness { inertia, damping, stiffness, .. } = &mut self.matrices;
        [inertia, damping, stiffness].into_iter().for_each(|matrix| matrix.mapv_inplace(|value| -value));
        self
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndarray::arr2;
    use ndof_models::Axis;

    fn fit(mass: f64, damping: f64, stiffness: f64, error: f64) -> LinearFit {
        let of = |m, b, k| InertiaDampingStiffness { axes: vec![Axis::linear("x")], inertia: arr2(&[[m]]), damping: arr2(&[[b]]), stiffness: arr2(&[[k]]) };
        LinearFit { matrices: of(mass, damping, stiffness), std_errors: of(error, error, error), of_sign: 1.0, hold: None, ticks: None }
    }

    #[test]
    fn no_motion_follows_from_an_inertia_that_may_be_none() {
        assert!(fit(2.0, -10.0, -300.0, 0.6).moves() && fit(2.0, 10.0, 300.0, f64::INFINITY).moves());
        for fit in [fit(2.0, 10.0, 300.0, 0.7), fit(-2.0, 10.0, 300.0, 0.1)] {
            assert!(!fit.moves(), "{fit:?}");
        }
    }

    #[test]
    fn an_effort_can_be_turned_where_an_inertia_or_a_damping_is_below_zero_beyond_doubt() {
        assert!(fit(-2.0, -10.0, -300.0, 0.1).reversed() && fit(-2.0, 0.1, -300.0, 0.1).reversed());
        assert!(fit(2.0, -10.0, 0.1, 0.1).reversed(), "a damping of the other side outweighs what a missing law makes of the inertia");
        assert!(!fit(-0.2, -0.2, -300.0, 0.1).reversed(), "an inertia and a damping within two errors of zero");
        assert!(!fit(2.0, 10.0, 300.0, 0.1).reversed() && (-fit(2.0, 10.0, 300.0, 0.1)).reversed());
        // 2 kg along each axis and 0.8 between them, by motions in each other's place and by efforts that were turned.
        let of_two = |along: f64, between: f64| {
            let of = |a: f64, b: f64| InertiaDampingStiffness {
                axes: vec![Axis::linear("x"), Axis::linear("y")],
                inertia: arr2(&[[a, b], [b, a]]),
                damping: arr2(&[[a, b], [b, a]]),
                stiffness: arr2(&[[a, b], [b, a]]),
            };
            LinearFit { matrices: of(along, between), std_errors: of(0.1, 0.1), of_sign: 1.0, hold: None, ticks: None }
        };
        assert!(of_two(-2.0, 0.8).reversed() && !of_two(-0.8, 2.0).reversed());
    }
}
