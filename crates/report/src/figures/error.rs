//! What can be wrong with the data of a figure.

/// Data that do not fit together.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[allow(missing_docs, reason = "a message says what its fields are")]
pub enum FigureError {
    /// A table has another shape than its axes.
    #[error("{what} has the shape {found:?}, but {expected:?} is needed ({meaning}); pass one value for each")]
    Shape { what: String, meaning: &'static str, expected: Vec<usize>, found: Vec<usize> },
    /// There is nothing to draw.
    #[error("{what} is empty; leave the figure out or pass data")]
    Empty { what: &'static str },
    /// A model has no response of the kind that is shown.
    #[error(transparent)]
    Response(#[from] ndof_sysid::ResponseError),
}

/// Compares sizes.
pub(crate) fn expect_shape(what: impl Into<String>, meaning: &'static str, expected: &[usize], found: &[usize]) -> Result<(), FigureError> {
    if expected == found {
        return Ok(());
    }
    Err(FigureError::Shape { what: what.into(), meaning, expected: expected.to_vec(), found: found.to_vec() })
}
