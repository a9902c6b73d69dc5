//! Matrices of the linear model.

/// Which matrix of M ẍ + B ẋ + K x an entry belongs to: the order of its derivative.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Matrix {
    /// K.
    Stiffness,
    /// B.
    Damping,
    /// M.
    Mass,
}
