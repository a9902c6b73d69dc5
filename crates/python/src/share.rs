//! How a record is shared out among workers.

use crate::spectra::settings;
use pyo3::prelude::*;

/// Number of blocks of up to 64 segments in a record of `samples` samples.
#[pyfunction]
pub fn blocks(samples: usize, nperseg: usize, noverlap: Option<usize>) -> PyResult<usize> {
    Ok(settings(nperseg, noverlap, None, "hann", false, "constant")?.blocks(samples))
}

/// The samples, first and one past the last, that blocks `first` to `end` need.
#[pyfunction]
pub fn block_samples(samples: usize, nperseg: usize, noverlap: Option<usize>, first: usize, end: usize) -> PyResult<(usize, usize)> {
    let range = settings(nperseg, noverlap, None, "hann", false, "constant")?.block_samples(first..end, samples);
    Ok((range.start, range.end))
}
