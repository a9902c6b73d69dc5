//! The native part of the Python package `ndof`: arrays in, results out, the work without the interpreter's lock.
//!
//! Everything here is thin: settings become those of `ndof`, results go back as its JSON and as arrays. What
//! reads well in Python is written in Python, in `python/ndof`.

mod analysis;
mod document;
mod error;
mod estimate;
mod fit;
mod recording;
mod share;
mod simulation;
mod spectra;
mod work;

use pyo3::prelude::*;

/// The native part of ndof.
#[pymodule]
mod _ndof {
    #[pymodule_export]
    use super::analysis::{check, diagnose};
    #[pymodule_export]
    use super::estimate::{Estimate, frequency_response};
    #[pymodule_export]
    use super::fit::{Fit, fit, project};
    #[pymodule_export]
    use super::recording::{align, explain, from_columns, negate, read_trials, tare, unit, validate, without_handle, write};
    #[pymodule_export]
    use super::share::{block_samples, blocks};
    #[pymodule_export]
    use super::simulation::{Case, design, excite, registry, settings, simulate, study};
    #[pymodule_export]
    use super::spectra::{Spectra, cross_spectra};
    #[pymodule_export]
    use super::work::{set_threads, threads};
    use pyo3::prelude::*;

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        module.add("__version__", ndof::analysis::result::VERSION)
    }
}
