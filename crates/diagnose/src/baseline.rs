//! The simulation that is judged.

use ndarray::Array2;
pub use ndof_models::Status;
use serde::{Deserialize, Serialize};

/// One of the matrices M, B, K of the baseline, axes in the order of the outputs.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Part {
    /// Its entries, SI.
    pub value: Vec<Vec<f64>>,
    /// Whether they may be wrong.
    pub status: Status,
    /// Whether a free matrix is symmetric.
    pub symmetric: bool,
}

impl Part {
    /// A symmetric matrix that may be wrong.
    pub fn nominal(matrix: &Array2<f64>) -> Self {
        Part { value: matrix.rows().into_iter().map(|row| row.to_vec()).collect(), status: Status::Nominal, symmetric: true }
    }
}

/// An inertia-damping-stiffness model to be judged. A part that is missing is fitted.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Baseline {
    /// M.
    pub mass: Option<Part>,
    /// B.
    pub damping: Option<Part>,
    /// K.
    pub stiffness: Option<Part>,
}

impl Baseline {
    /// The first matrix that is not `axes` × `axes`, by its letter.
    pub(crate) fn misshapen(&self, axes: usize) -> Option<&'static str> {
        [("M", &self.mass), ("B", &self.damping), ("K", &self.stiffness)].into_iter().find_map(|(letter, part)| {
            let part = part.as_ref()?;
            (part.value.len() != axes || part.value.iter().any(|row| row.len() != axes)).then_some(letter)
        })
    }
}
