//! Spectra and signals against properties and against SciPy, in one program.

mod properties;
mod scipy;
